//! Studies over HTTP: asked, waited for, watched, cancelled, gone on with, refused.

use std::time::Duration;

use futures_util::StreamExt as _;
use serde_json::{Value, json};
use toothwave::config::Limits;

use crate::asking::{Answer, LIMITS, Occupied, Question, Service, until};
use crate::designs::{every_number, shortest, spelled_out, undercut, with};
use crate::openapi::document;

const WAIT: &str = "wait=600";

fn map(base: &Value, steps: u64) -> Value {
    json!({
        "study": "map", "base": base,
        "over": { "/drive/teeth/radius_mm": { "min": 3.0, "max": 7.0, "steps": steps } },
        "quantities": ["peak_stress_ring_mpa", "undercut"]
    })
}

/// As many variants as take a while.
fn long() -> Value {
    let mut study = map(&shortest(), 700);
    study["over"]["/load/input_torque_nm"] = json!({ "min": 10.0, "max": 20.0, "steps": 700 });
    study
}

async fn begun(service: &Service, study: &Value) -> Answer {
    service.ask(&Question::post("/v1/studies", study.to_string())).await
}

async fn waited_for(service: &Service, study: &Value) -> Value {
    service.ask(&Question::post("/v1/studies", study.to_string()).with("prefer", WAIT)).await.found()
}

fn place(study: &Value) -> String {
    format!("/v1/studies/{}", study["id"].as_str().unwrap())
}

async fn deleted(service: &Service, place: &str) -> u16 {
    service.ask(&Question::of("DELETE", place)).await.status
}

#[tokio::test]
async fn who_waits_for_a_study_gets_its_result_with_it() {
    let service = Service::new();
    let found = waited_for(&service, &map(&shortest(), 5)).await;
    assert_eq!((&found["state"], &found["study"]), (&json!("done"), &json!("map")));
    assert_eq!((&found["variants"], &found["looked_at"], &found["impossible"]), (&json!(5), &json!(5), &json!(0)));
    assert_eq!(service.get(found["result_href"].as_str().unwrap()).await.found(), found["result"]);
    for (variant, radius_mm) in [3.0, 4.0, 5.0, 6.0, 7.0].into_iter().enumerate() {
        let document = with(&shortest(), "/drive/teeth/radius_mm", json!(radius_mm));
        let sweep = service.post("/v1/sweep", &document).await.found();
        let quantities = &found["result"]["possible"]["quantities"];
        assert_eq!(quantities["peak_stress_ring_mpa"][variant], sweep["peaks"]["ring"]["stress_mpa"]["value"]);
    }
}

/// Seconds of three thousand years: as RFC 7240 has it, a number of any length.
#[tokio::test]
async fn who_would_wait_for_ever_waits_as_long_as_anybody() {
    let service = Service::new();
    for (steps, wait) in [(5, "wait=99999999999"), (6, "wait=18446744073709551616")] {
        let asked = Question::post("/v1/studies", map(&shortest(), steps).to_string());
        let answer = service.ask(&asked.with("prefer", wait)).await;
        assert!(!answer.header("preference-applied").is_empty(), "{wait}");
        assert_eq!(answer.found()["state"], "done");
    }
}

#[tokio::test]
async fn who_does_not_wait_is_told_where_the_study_stands_and_its_events_end_with_it() {
    let service = Service::new();
    let answer = begun(&service, &map(&shortest(), 5)).await;
    assert_eq!(answer.status, 202, "{}", answer.text());
    let study = answer.json();
    assert_eq!(answer.header("location"), place(&study));
    let events = service.get(study["events_href"].as_str().unwrap()).await;
    assert_eq!((events.status, events.header("content-type")), (200, "text/event-stream"));
    let last = events.text().trim_end().rsplit("\n\n").next().unwrap();
    assert!(last.starts_with("event: end\ndata: {"), "{last}");
    let told: Value = serde_json::from_str(last.split_once("data: ").unwrap().1).unwrap();
    assert_eq!(told["state"], "done");
    assert_eq!(service.get(&place(&study)).await.found(), told);
}

/// A chunk may take minutes, and a proxy takes who says nothing for gone. Each event once came with the next change alone.
#[tokio::test]
async fn events_tell_at_once_how_a_study_stands_and_give_a_sign_of_life_while_there_is_nothing_to_tell() {
    let service = Service::within(Limits { max_concurrent_solves: 1, ..LIMITS });
    let occupied = Occupied::by_one(&service.app.pool).await;
    let study = begun(&service, &map(&shortest(), 5)).await.json();
    let question = Question::of("GET", study["events_href"].as_str().unwrap());
    let mut events = service.response(question.request()).await.into_body().into_data_stream();
    tokio::time::pause();
    let first = events.next().await.unwrap().unwrap();
    assert!(first.starts_with(b"event: progress\n"), "{first:?}");
    tokio::time::advance(Duration::from_secs(6)).await;
    // A comment (HTML Living Standard, section 9.2).
    assert_eq!(events.next().await.unwrap().unwrap()[..], b":\n\n"[..]);
    tokio::time::resume();
    drop(occupied);
}

#[tokio::test]
async fn the_same_question_is_the_same_study_however_it_is_spelled() {
    let service = Service::new();
    let first = waited_for(&service, &map(&shortest(), 3)).await;
    let spelled = map(&shortest(), 3).to_string().replace("3.0", "3e0").replace("28,", "28.0,");
    let other = service.ask(&Question::post("/v1/studies", spelled).with("prefer", WAIT)).await.found();
    assert_eq!(first["id"], other["id"]);
    assert_ne!(first["id"], waited_for(&service, &map(&shortest(), 4)).await["id"]);
}

#[tokio::test]
async fn a_cancelled_study_keeps_what_it_has_and_goes_on_when_it_is_asked_for_again() {
    let service = Service::within(Limits { max_concurrent_solves: 1, ..LIMITS });
    let occupied = Occupied::by_one(&service.app.pool).await;
    let study = begun(&service, &map(&shortest(), 5)).await.json();
    assert_eq!((&study["state"], &study["looked_at"]), (&json!("running"), &json!(0)));
    assert_eq!(deleted(&service, &place(&study)).await, 204);
    assert_eq!(service.get(&place(&study)).await.found()["state"], "cancelled");
    occupied.end().await;
    let partial = service.get(&format!("{}/result", place(&study))).await.found();
    assert_eq!((&partial["is_complete"], &partial["possible"]["variant"]), (&json!(false), &json!([])));
    let found = waited_for(&service, &map(&shortest(), 5)).await;
    assert_eq!((&found["id"], &found["state"], &found["looked_at"]), (&study["id"], &json!("done"), &json!(5)));
    // One that does not run any more is forgotten.
    assert_eq!(deleted(&service, &place(&study)).await, 204);
    service.get(&place(&study)).await.refused(404, "not_found");
    assert_eq!(deleted(&service, &place(&study)).await, 404);
}

/// In memory thousands of variants were lost, of which each may take seconds, and were counted as looked at.
#[tokio::test]
async fn a_study_that_is_cancelled_has_the_variants_that_it_says_it_has_looked_at() {
    let service = Service::within(LIMITS);
    let study = begun(&service, &long()).await.json();
    let variants = async || {
        let partial = service.get(&format!("{}/result", place(&study))).await.found();
        let has = |what: &str| partial[what]["variant"].as_array().unwrap().len() as u64;
        has("possible") + has("impossible")
    };
    // After a second something is handed over, long before any piece is over.
    while variants().await == 0 {
        tokio::time::sleep(Duration::from_millis(20)).await;
    }
    assert_eq!(deleted(&service, &place(&study)).await, 204);
    let stands = service.get(&place(&study)).await.found();
    let variants = variants().await;
    assert_eq!((&stands["state"], &stands["looked_at"]), (&json!("cancelled"), &json!(variants)));
    assert!(variants < 490_000, "{variants}");
}

/// What runs and is not kept could be cancelled by nobody, and would count nowhere.
#[tokio::test(flavor = "multi_thread", worker_threads = 4)]
async fn however_many_ask_for_a_study_and_cancel_it_at_once_none_runs_that_is_not_kept() {
    let service = Service::new();
    let study = begun(&service, &long()).await.json();
    let clients = (0..16).map(|client| {
        let (service, place) = (service.clone(), place(&study));
        tokio::spawn(async move {
            for turn in 0..60 {
                if (client + turn) % 2 == 0 {
                    let answer = begun(&service, &long()).await;
                    assert!(matches!(answer.status, 200 | 202), "{}", answer.text());
                } else {
                    assert!(matches!(deleted(&service, &place).await, 204 | 404));
                }
            }
        })
    });
    for client in clients.collect::<Vec<_>>() {
        client.await.unwrap();
    }
    while deleted(&service, &place(&study)).await != 404 {}
    until("nothing runs", || service.app.pool.running() == 0).await;
}

#[tokio::test]
async fn a_single_request_does_not_wait_for_a_study() {
    let service = Service::within(Limits { max_concurrent_solves: 1, ..LIMITS });
    let study = begun(&service, &long()).await.json();
    service.post("/v1/sweep", &spelled_out()).await.found();
    let stands = service.get(&place(&study)).await.found();
    assert_eq!(stands["state"], "running", "{stands}");
    assert_eq!(deleted(&service, &place(&study)).await, 204);
}

#[tokio::test]
async fn a_study_that_is_too_large_is_refused_with_the_limit_before_anything_runs() {
    for (limits, limit) in [
        (Limits { max_study_variants: 4, ..LIMITS }, "max_study_variants"),
        (Limits { max_study_bytes: 1000, ..LIMITS }, "max_study_bytes"),
    ] {
        let service = Service::within(limits);
        let problem = begun(&service, &map(&shortest(), 5)).await.refused(422, "too_many_variants");
        assert!(problem["detail"].as_str().unwrap().contains(limit), "{problem}");
        let error = &problem["errors"][0];
        assert_eq!(error["code"], "too_many_variants");
        assert!(error["value"].as_f64() > error["limit"].as_f64(), "{problem}");
    }
}

#[tokio::test]
async fn more_studies_than_may_run_are_refused_and_the_oldest_that_is_done_makes_room() {
    let limits = Limits { max_concurrent_solves: 1, max_concurrent_studies: 1, max_study_bytes: 60_000, ..LIMITS };
    let service = Service::within(limits);
    let occupied = Occupied::by_one(&service.app.pool).await;
    let first = begun(&service, &map(&shortest(), 5)).await.json();
    begun(&service, &map(&shortest(), 6)).await.refused(503, "queue_full");
    occupied.end().await;
    waited_for(&service, &map(&shortest(), 5)).await;
    let second = waited_for(&service, &map(&shortest(), 6)).await;
    assert_eq!(service.get(&place(&first)).await.status, 200, "there is room for two");
    waited_for(&service, &map(&shortest(), 7)).await;
    assert_eq!(service.get(&place(&first)).await.status, 404, "and the oldest is forgotten for a third");
    assert_eq!(service.get(&place(&second)).await.status, 200);
}

#[tokio::test]
async fn a_study_that_is_refused_makes_none_forgotten() {
    let service = Service::within(Limits { max_concurrent_solves: 1, max_study_bytes: 145_000, ..LIMITS });
    let (one, other) =
        (waited_for(&service, &map(&shortest(), 5)).await, waited_for(&service, &map(&shortest(), 6)).await);
    let occupied = Occupied::by_one(&service.app.pool).await;
    // 86 kB each: beside one that runs, which is never forgotten, no other has room whatever is.
    let running = begun(&service, &map(&shortest(), 2000)).await.json();
    assert_eq!(running["state"], "running");
    begun(&service, &map(&shortest(), 2001)).await.refused(503, "queue_full");
    for kept in [&one, &other] {
        assert_eq!(service.get(&place(kept)).await.status, 200, "it was there before");
    }
    // For what is admitted as many go as it takes, and no more.
    assert_eq!(begun(&service, &map(&shortest(), 7)).await.status, 202);
    service.get(&place(&one)).await.refused(404, "not_found");
    assert_eq!(service.get(&place(&other)).await.status, 200);
    occupied.end().await;
}

#[tokio::test]
async fn a_study_that_unread_answers_leave_no_room_makes_none_forgotten() {
    let service = Service::within(Limits { max_concurrent_solves: 1, max_unread_bytes: 1_000_000, ..LIMITS });
    let occupied = Occupied::by_one(&service.app.pool).await;
    // 336 kB, of which nothing needs to be computed.
    let kept = begun(&service, &map(&shortest(), 10_000)).await.json();
    assert_eq!(deleted(&service, &place(&kept)).await, 204);
    let unread = service.app.room.reserve(600_000).unwrap();
    begun(&service, &map(&shortest(), 20_000)).await.refused(503, "too_many_unread_bytes");
    assert_eq!(service.get(&place(&kept)).await.found()["state"], "cancelled");
    drop(unread);
    assert_eq!(begun(&service, &map(&shortest(), 25_000)).await.status, 202);
    service.get(&place(&kept)).await.refused(404, "not_found");
    occupied.end().await;
}

/// What the work of a study with a long base takes was held until it was forgotten: of 64 KB with 16 solves all the room of a small service.
#[tokio::test]
async fn a_study_holds_room_for_its_work_while_that_goes_on_and_no_longer() {
    let limits = Limits { max_concurrent_solves: 2, max_unread_bytes: 20 << 20, ..LIMITS };
    let service = Service::within(limits);
    let base = with(&shortest(), "/deviations", json!({ "ring_space_um": vec![0; 30_000] }));
    let taken_bytes = || service.app.room.taken_bytes();
    let occupied = async || [Occupied::by_one(&service.app.pool).await, Occupied::by_one(&service.app.pool).await];
    let both = occupied().await;
    let study = begun(&service, &map(&base, 5)).await.json();
    let running_bytes = taken_bytes();
    assert_eq!(deleted(&service, &place(&study)).await, 204);
    for one in both {
        one.end().await;
    }
    until("a cancelled study gives back what its work takes", || taken_bytes() < running_bytes / 2).await;
    let both = occupied().await;
    assert_eq!(begun(&service, &map(&base, 5)).await.json()["state"], "running");
    assert_eq!(taken_bytes(), running_bytes, "it goes on");
    for one in both {
        one.end().await;
    }
    assert_eq!(waited_for(&service, &map(&base, 5)).await["state"], "done");
    until("a done study gives back what its work takes", || taken_bytes() < running_bytes / 2).await;
}

/// What its work takes was wanted once more beside its rows, and more than there is.
#[tokio::test]
async fn a_study_that_takes_all_the_room_goes_on_as_it_began() {
    let limits = Limits { max_unread_bytes: 8 << 20, max_study_bytes: 8 << 20, max_concurrent_solves: 1, ..LIMITS };
    let service = Service::within(limits);
    let mut study = map(&shortest(), 1275);
    let choices: Vec<_> = (0..16).map(|choice| 1.0 + f64::from(choice)).collect();
    study["over"]["/load/input_torque_nm"] = json!({ "one_of": choices });
    study["over"]["/drive/teeth/width_mm"] = json!({ "one_of": choices });
    study["quantities"] = json!(["undercut"]);
    let occupied = Occupied::by_one(&service.app.pool).await;
    let begun_once = begun(&service, &study).await.json();
    assert_eq!(begun_once["state"], "running", "{begun_once}");
    assert_eq!(deleted(&service, &place(&begun_once)).await, 204);
    assert_eq!(begun(&service, &study).await.json()["state"], "running");
    assert_eq!(deleted(&service, &place(&begun_once)).await, 204);
    // Nor is anything forgotten for another while memory is scarce.
    service.app.room.memory().set_scarce(true);
    begun(&service, &map(&shortest(), 5)).await.refused(503, "too_many_unread_bytes");
    assert_eq!(service.get(&place(&begun_once)).await.found()["state"], "cancelled");
    occupied.end().await;
}

/// One such study that ran took all the room from others.
#[tokio::test]
async fn pieces_that_take_much_are_worked_on_side_by_side_as_far_as_an_eighth_of_the_room_goes() {
    let limits = Limits { max_concurrent_solves: 8, max_unread_bytes: 20 << 20, ..LIMITS };
    let service = Service::within(limits);
    let mut occupied = Vec::new();
    for _ in 0..limits.max_concurrent_solves {
        occupied.push(Occupied::by_one(&service.app.pool).await);
    }
    let base = with(&shortest(), "/deviations", json!({ "ring_space_um": vec![0; 30_000] }));
    assert_eq!(begun(&service, &map(&base, 50)).await.json()["state"], "running");
    assert!(service.app.room.taken_bytes() < limits.max_unread_bytes / 4, "{}", service.app.room.taken_bytes());
}

/// From seventeen islands on each piece was several of them, of which the first alone was looked at, and the study was done.
#[tokio::test]
async fn a_search_of_many_islands_looks_at_all_of_them() {
    let service = Service::within(Limits { deadline_ms: 600_000, max_concurrent_solves: 2, ..LIMITS });
    let study = json!({
        "study": "search", "base": shortest(), "evaluations": 212_500, "free": { "/drive/teeth/radius_mm": { "min": 3.0, "max": 7.5 } },
        "objectives": [{ "quantity": "slot_wall_mm", "goal": "max" }, { "quantity": "outer_diameter_mm", "goal": "min" }]
    });
    let found = waited_for(&service, &study).await;
    assert_eq!((&found["state"], &found["looked_at"]), (&json!("done"), &json!(212_500)));
    assert_eq!((&found["result"]["is_complete"], &found["result"]["evaluated"]), (&json!(true), &json!(212_500)));
}

#[tokio::test]
async fn a_study_beyond_its_time_says_so_and_goes_on_when_it_is_asked_for_again() {
    let service = Service::within(Limits { study_deadline_ms: 0, ..LIMITS });
    let found = waited_for(&service, &long()).await;
    assert_eq!((&found["state"], &found["problem"]["code"]), (&json!("failed"), &json!("deadline_exceeded")));
    assert!(found["problem"]["detail"].as_str().unwrap().contains("study_deadline_ms"), "{found}");
}

#[tokio::test]
async fn what_cannot_be_is_said_at_the_field() {
    let service = Service::new();
    let study = map(&shortest(), 5);
    for (document, pointer, code) in [
        (with(&study, "/study", json!("guess")), "/study", "unknown_choice"),
        (with(&study, "/quantities", json!(["beauty"])), "/quantities/0", "unknown_choice"),
        (with(&study, "/over", json!({})), "/over", "missing_field"),
        (with(&study, "/base/load", json!({})), "/base/load", "missing_field"),
        (with(&study, "/colour", json!(1)), "/colour", "unknown_field"),
    ] {
        let (at, found, _) = begun(&service, &document).await.faulty_field();
        assert_eq!((at.as_str(), found.as_str()), (pointer, code));
    }
    let search = json!({
        "study": "search", "base": shortest(), "free": { "/drive/teeth/radius_mm": { "min": 4.0, "max": 5.0 } },
        "objectives": [{ "quantity": "transmission_ratio", "goal": "max" }]
    });
    let (at, found, _) = begun(&service, &search).await.faulty_field();
    assert_eq!((at.as_str(), found.as_str()), ("/objectives/0/quantity", "unaffected"));
    begun(&service, &json!("map")).await.refused(422, "invalid_document");
    service.post_text("/v1/studies", "{").await.refused(400, "malformed_json");
}

/// A kind whose fields the search did not know was searched with nothing of it free, or refused as if something were missing.
#[tokio::test]
async fn of_every_kind_of_wave_generator_and_tooth_in_the_api_document_all_lengths_are_free_in_a_search() {
    let service = Service::new();
    let schemas = &document()["components"]["schemas"];
    // Not free are the counts, and grooves, which a ball need not have.
    let apart = ["kind", "shape", "lobes", "count", "installed", "groove_radius_mm"];
    for (union, place) in [("WaveGenerator", "/drive/wave_generator"), ("Teeth", "/drive/teeth")] {
        let discriminator = &schemas[union]["discriminator"];
        let tag = discriminator["propertyName"].as_str().unwrap();
        for (word, reference) in discriminator["mapping"].as_object().unwrap() {
            let name = reference.as_str().unwrap().rsplit('/').next().unwrap();
            let fields = schemas[name]["properties"].as_object().unwrap().keys();
            let lengths = fields.filter(|field| !apart.contains(&field.as_str()));
            let base = with(&json!({ "drive": {}, "load": { "output_torque_nm": 20.0 } }), place, json!({ tag: word }));
            let found = waited_for(&service, &json!({
                "study": "search", "evaluations": 200, "base": base,
                "require": { "transmission_ratio": { "min": 19.5, "max": 20.5 }, "outer_diameter_mm": { "max": 120.0 } },
                "objectives": [{ "quantity": "outer_diameter_mm", "goal": "min" }]
            }))
            .await;
            let free = found["result"]["free"].as_array().unwrap();
            for field in lengths {
                let pointer = json!(format!("{place}/{field}"));
                assert!(free.iter().any(|free| free["pointer"] == pointer), "{word}: {pointer} is not free: {free:?}");
            }
        }
    }
}

#[tokio::test]
async fn a_map_is_a_table_too() {
    let service = Service::new();
    let found = waited_for(&service, &map(&shortest(), 3)).await;
    let question = Question::of("GET", found["result_href"].as_str().unwrap()).with("accept", "text/csv");
    let answer = service.ask(&question).await;
    assert_eq!(answer.status, 200);
    let mut lines = answer.text().lines();
    assert_eq!(lines.next(), Some("variant,/drive/teeth/radius_mm,peak_stress_ring_mpa,undercut,reason"));
    assert_eq!(lines.count(), 3);
    let question =
        Question::of("GET", found["result_href"].as_str().unwrap()).with("accept", "application/vnd.apache.parquet");
    let answer = service.ask(&question).await;
    assert_eq!((answer.status, answer.header("content-type")), (200, "application/vnd.apache.parquet"));
    // The magic number at both ends (Apache Parquet, file format).
    assert!(answer.body.starts_with(b"PAR1") && answer.body.ends_with(b"PAR1"));
}

/// Each quantity of a document that every answer has, against the answer that holds it.
/// How many quantities of a document were held against what their pointers lead to.
async fn held_against_their_pointers(service: &Service, document: &Value) -> usize {
    let listed = service.get("/v1/quantities").await.found();
    let listed = listed["quantities"].as_array().unwrap();
    let study = json!({ "study": "map", "base": with(document, "/sweep", json!({ "wind_up": true })), "over": { "/drive/teeth/radius_mm": { "one_of": [document["drive"]["teeth"]["radius_mm"]] } } });
    let found = waited_for(service, &study).await;
    let mut compared = 0;
    for (name, values) in found["result"]["possible"]["quantities"].as_object().unwrap() {
        let quantity = listed.iter().find(|quantity| quantity["name"] == **name).unwrap();
        let Some(place) = quantity["source"].get("answer") else { continue };
        let answer = service.post(place["path"].as_str().unwrap(), &study["base"]).await.found();
        let expected = &answer.pointer(place["pointer"].as_str().unwrap());
        let expected = expected.unwrap_or_else(|| panic!("{name}: {place} leads nowhere"));
        let expected = expected.as_bool().map_or_else(|| expected.as_f64(), |flag| Some(f64::from(u8::from(flag))));
        let (expected, value) = (expected.unwrap(), values[0].as_f64().unwrap());
        assert!((value - expected).abs() <= 1e-12 * expected.abs(), "{name}: {value} and not {expected}");
        compared += 1;
    }
    compared
}

fn rubbing() -> Value {
    json!({ "wave_generator": { "kind": "plain", "coefficient": 0.03 }, "ring": { "coefficient": 0.05 }, "carrier": { "coefficient": 0.04 } })
}

#[tokio::test]
async fn every_quantity_is_what_its_pointer_leads_to() {
    let service = Service::new();
    let mut compared = 0;
    let load = json!({ "input_torque_nm": 20.0, "input_speed_rpm": 1500.0, "allowable_stress_mpa": 1500.0 });
    let full = with(&with(&shortest(), "/load", load), "/friction", rubbing());
    for document in [full, undercut(), every_number()] {
        compared += held_against_their_pointers(&service, &document).await;
    }
    assert!(compared > 100, "{compared} compared");
}

/// They once were those of the hardest point alone, which is neither what the answer has nor what the drive loses.
#[tokio::test]
async fn under_a_duty_the_losses_of_a_variant_are_those_over_all_its_points() {
    let duty = json!({ "duty": [
        { "input_torque_nm": 20.0, "input_speed_rpm": 500.0, "share_of_time": 0.25 },
        { "input_torque_nm": 2.0, "input_speed_rpm": 3000.0, "share_of_time": 0.75 },
    ] });
    let document = with(&with(&shortest(), "/load", duty), "/friction", rubbing());
    let compared = held_against_their_pointers(&Service::new(), &document).await;
    assert!(compared > 40, "{compared} compared");
}

#[tokio::test]
async fn every_quantity_ends_in_its_unit_and_says_what_it_means() {
    let listed = Service::new().get("/v1/quantities").await.found();
    let listed = listed["quantities"].as_array().unwrap();
    for quantity in listed {
        let (name, unit) = (quantity["name"].as_str().unwrap(), quantity["unit"].as_str().unwrap());
        let ending = match unit {
            "" => "",
            "MPa m/s" => "_mpa_m_per_s",
            "N·m/rad" => "_nm_per_rad",
            "N·m" => "_nm",
            "mm" => "_mm",
            "deg" => "_deg",
            "MPa" => "_mpa",
            "N" => "_n",
            "W" => "_w",
            other => panic!("{other} of {name}"),
        };
        assert!(name.ends_with(ending) && quantity["meaning"].as_str().unwrap().ends_with('.'), "{quantity}");
        assert_eq!(listed.iter().filter(|other| other["name"] == name).count(), 1, "{name}");
    }
}
