//! Studies over HTTP: start, wait, events, cancel, resume and refusals.

use std::io::Read as _;
use std::time::Duration;

use futures_util::future::join_all;
use serde_json::{Value, json};

use crate::asking::{Answer, ENDLESS, LIMITS, Limits, Question, Service};
use crate::designs::{every_number, shortest, spelled_out, undercut, with};
use crate::openapi::document;
use crate::stored::{long, undisturbed_result};

const WAIT: &str = "wait=600";

fn map(base: &Value, steps: u64) -> Value {
    json!({
        "study": "map", "base": base,
        "over": { "/drive/teeth/radius_mm": { "min": 3.0, "max": 7.0, "steps": steps } },
        "quantities": ["peak_stress_ring_mpa", "undercut"]
    })
}

/// Returns a study with this many variants, each slower than any test.
fn slow(steps: u64) -> Value {
    let mut document = with(&shortest(), "/sweep", json!({ "samples": 10_000_000 }));
    document["parts"] = json!({ "ring": { "clearance_um": 10.0 } });
    document["model"] = json!({ "refinements": ["wave_generator_moves"] });
    map(&document, steps)
}

async fn start_study(service: &Service, study: &Value) -> Answer {
    service.ask(&Question::post("/v1/studies", study.to_string())).await
}

async fn wait_for(service: &Service, study: &Value) -> Value {
    service.ask(&Question::post("/v1/studies", study.to_string()).with("prefer", WAIT)).await.found()
}

fn place(study: &Value) -> String {
    format!("/v1/studies/{}", study["id"].as_str().unwrap())
}

async fn delete(service: &Service, place: &str) -> u16 {
    service.ask(&Question::of("DELETE", place)).await.status
}

#[tokio::test]
async fn waiting_client_gets_study_with_result() {
    let service = Service::new();
    let found = wait_for(&service, &map(&shortest(), 5)).await;
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

/// RFC 7240 allows a number of any length.
#[tokio::test]
async fn wait_preference_may_have_any_length() {
    let service = Service::new();
    for (steps, wait) in [(5, "wait=99999999999"), (6, "wait=18446744073709551616")] {
        let asked = Question::post("/v1/studies", map(&shortest(), steps).to_string());
        let answer = service.ask(&asked.with("prefer", wait)).await;
        assert!(!answer.header("preference-applied").is_empty(), "{wait}");
        assert_eq!(answer.found()["state"], "done");
    }
}

#[tokio::test]
async fn events_end_with_the_final_state() {
    let service = Service::new();
    let study = start_study(&service, &map(&shortest(), 5)).await.json();
    let events = service.get(study["events_href"].as_str().unwrap()).await;
    assert_eq!((events.status, events.header("content-type")), (200, "text/event-stream"));
    let last = events.text().trim_end().rsplit("\n\n").next().unwrap();
    assert!(last.starts_with("event: end\ndata: {"), "{last}");
    let told: Value = serde_json::from_str(last.split_once("data: ").unwrap().1).unwrap();
    assert_eq!(told["state"], "done");
    assert_eq!(service.get(&place(&study)).await.found(), told);
}

/// A chunk may take minutes, and a proxy closes a silent connection.
#[tokio::test]
async fn first_event_comes_at_once_and_comments_follow() {
    let service = Service::within(ENDLESS);
    let answer = start_study(&service, &slow(2)).await;
    assert_eq!(answer.status, 202, "{}", answer.text());
    let study = answer.json();
    assert_eq!(format!("/v1/{}", answer.header("location")), place(&study));
    let mut events = service.send(&Question::of("GET", study["events_href"].as_str().unwrap()));
    let (mut read, mut buffer) = (String::new(), [0; 4096]);
    // A comment is a line that begins with a colon (HTML Living Standard, section 9.2).
    while !(read.contains("event: progress\n") && read.contains("\n:\n")) {
        let length = events.read(&mut buffer).unwrap();
        assert!(length > 0, "{read}");
        read.push_str(&String::from_utf8_lossy(&buffer[..length]));
    }
    assert_eq!(delete(&service, &place(&study)).await, 204);
}

#[tokio::test]
async fn equal_question_is_same_study_however_spelled() {
    let service = Service::new();
    let first = wait_for(&service, &map(&shortest(), 3)).await;
    let spelled = map(&shortest(), 3).to_string().replace("3.0", "3e0").replace("28,", "28.0,");
    let other = service.ask(&Question::post("/v1/studies", spelled).with("prefer", WAIT)).await.found();
    assert_eq!(first["id"], other["id"]);
    assert_ne!(first["id"], wait_for(&service, &map(&shortest(), 4)).await["id"]);
}

#[tokio::test]
async fn cancelled_study_continues_when_requested_again() {
    let service = Service::new();
    let study = start_study(&service, &long()).await.json();
    assert_eq!(study["state"], "running");
    assert_eq!(delete(&service, &place(&study)).await, 204);
    assert_eq!(service.get(&place(&study)).await.found()["state"], "cancelled");
    let partial = service.get(&format!("{}/result", place(&study))).await.found();
    assert_eq!(partial["is_complete"], false);
    let found = wait_for(&service, &long()).await;
    assert_eq!((&found["id"], &found["state"], &found["looked_at"]), (&study["id"], &json!("done"), &json!(90_000)));
    assert!(found["result"] == *undisturbed_result().await);
    // A study that no longer runs is deleted.
    assert_eq!(delete(&service, &place(&study)).await, 204);
    service.get(&place(&study)).await.refused(404, "not_found");
    assert_eq!(delete(&service, &place(&study)).await, 404);
}

#[tokio::test]
async fn cancelled_study_has_the_variants_it_counts() {
    let service = Service::within(LIMITS);
    let study = start_study(&service, &long()).await.json();
    let variants = async || {
        let partial = service.get(&format!("{}/result", place(&study))).await.found();
        let has = |what: &str| partial[what]["variant"].as_array().unwrap().len() as u64;
        has("possible") + has("impossible")
    };
    while variants().await == 0 {
        tokio::time::sleep(Duration::from_millis(20)).await;
    }
    assert_eq!(delete(&service, &place(&study)).await, 204);
    let stands = service.get(&place(&study)).await.found();
    let variants = variants().await;
    assert_eq!((&stands["state"], &stands["looked_at"]), (&json!("cancelled"), &json!(variants)));
    assert!(variants < 90_000, "{variants}");
}

/// Nobody could cancel a study that runs but is not listed.
#[tokio::test(flavor = "multi_thread", worker_threads = 4)]
async fn concurrent_requests_and_cancels_leave_no_unlisted_study() {
    let service = Service::new();
    let study = start_study(&service, &long()).await.json();
    let clients = (0..16).map(|client| {
        let (service, place) = (service.clone(), place(&study));
        tokio::spawn(async move {
            for turn in 0..60 {
                if (client + turn) % 2 == 0 {
                    let answer = start_study(&service, &long()).await;
                    // 404: another client cancelled and deleted it before its answer was read.
                    assert!(matches!(answer.status, 200 | 202 | 404), "{}", answer.text());
                } else {
                    assert!(matches!(delete(&service, &place).await, 204 | 404));
                }
            }
        })
    });
    for client in clients.collect::<Vec<_>>() {
        client.await.unwrap();
    }
    while delete(&service, &place(&study)).await != 404 {}
    service.until("toothwave_studies_running", 0.0);
}

#[tokio::test]
async fn single_request_does_not_wait_for_study() {
    let service = Service::within(Limits { max_concurrent_solves: 1, ..LIMITS });
    let study = start_study(&service, &long()).await.json();
    service.post("/v1/sweep", &spelled_out()).await.found();
    let stands = service.get(&place(&study)).await.found();
    assert_eq!(stands["state"], "running", "{stands}");
    assert_eq!(delete(&service, &place(&study)).await, 204);
}

#[tokio::test]
async fn rejects_study_over_limit() {
    let mut study = map(&shortest(), 10_000);
    study["over"]["/load/input_torque_nm"] = json!({ "min": 10.0, "max": 20.0, "steps": 1001 });
    let problem = start_study(&Service::new(), &study).await.refused(422, "too_many_variants");
    assert!(problem["detail"].as_str().unwrap().contains("max_study_variants"), "{problem}");
    let error = &problem["errors"][0];
    assert_eq!(error["code"], "too_many_variants");
    assert!(error["value"].as_f64() > error["limit"].as_f64(), "{problem}");
}

#[tokio::test]
async fn at_most_four_studies_run() {
    let service = Service::within(ENDLESS);
    let studies: Vec<_> = (2..10).map(slow).collect();
    let answers = join_all(studies.iter().map(|study| start_study(&service, study))).await;
    let (running, refused): (Vec<_>, Vec<_>) = answers.iter().partition(|answer| answer.status == 202);
    assert_eq!(running.len(), 4);
    for answer in refused {
        answer.refused(503, "queue_full");
    }
    for study in running {
        assert_eq!(delete(&service, &place(&study.json())).await, 204);
    }
    wait_for(&service, &map(&shortest(), 6)).await;
}

/// With 17 or more islands each chunk holds several.
#[tokio::test]
async fn search_of_many_islands_evaluates_all() {
    let service = Service::within(LIMITS);
    let study = json!({
        "study": "search", "base": shortest(), "evaluations": 212_500, "free": { "/drive/teeth/radius_mm": { "min": 3.0, "max": 7.5 } },
        "objectives": [{ "quantity": "slot_wall_mm", "goal": "max" }, { "quantity": "outer_diameter_mm", "goal": "min" }]
    });
    let found = wait_for(&service, &study).await;
    assert_eq!((&found["state"], &found["looked_at"]), (&json!("done"), &json!(212_500)));
    assert_eq!((&found["result"]["is_complete"], &found["result"]["evaluated"]), (&json!(true), &json!(212_500)));
}

#[tokio::test]
async fn invalid_study_is_refused_at_its_field() {
    let service = Service::new();
    let study = map(&shortest(), 5);
    for (document, pointer, code) in [
        (with(&study, "/study", json!("guess")), "/study", "unknown_choice"),
        (with(&study, "/quantities", json!(["beauty"])), "/quantities/0", "unknown_choice"),
        (with(&study, "/over", json!({})), "/over", "missing_field"),
        (with(&study, "/base/load", json!({})), "/base/load", "missing_field"),
        (with(&study, "/colour", json!(1)), "/colour", "unknown_field"),
    ] {
        let (at, found, _) = start_study(&service, &document).await.faulty_field();
        assert_eq!((at.as_str(), found.as_str()), (pointer, code));
    }
    let search = json!({
        "study": "search", "base": shortest(), "free": { "/drive/teeth/radius_mm": { "min": 4.0, "max": 5.0 } },
        "objectives": [{ "quantity": "transmission_ratio", "goal": "max" }]
    });
    let (at, found, _) = start_study(&service, &search).await.faulty_field();
    assert_eq!((at.as_str(), found.as_str()), ("/objectives/0/quantity", "unaffected"));
    start_study(&service, &json!("map")).await.refused(422, "invalid_document");
    service.post_text("/v1/studies", "{").await.refused(400, "malformed_json");
}

/// The kinds come from the API document, so a search cannot miss a kind's fields.
#[tokio::test]
async fn search_frees_all_lengths_of_every_kind() {
    let service = Service::new();
    let schemas = &document()["components"]["schemas"];
    // Counts are not free, nor are grooves, which are optional.
    let apart = ["kind", "shape", "lobes", "count", "installed", "groove_radius_mm"];
    for (union, place, tag) in [("WaveGenerator", "/drive/wave_generator", "kind"), ("Teeth", "/drive/teeth", "shape")]
    {
        for variant in schemas[union]["oneOf"].as_array().unwrap() {
            let name = variant["$ref"].as_str().unwrap().rsplit('/').next().unwrap();
            let word = &schemas[name]["properties"][tag]["enum"][0];
            let fields = schemas[name]["properties"].as_object().unwrap().keys();
            let lengths = fields.filter(|field| !apart.contains(&field.as_str()));
            let base = with(&json!({ "drive": {}, "load": { "output_torque_nm": 20.0 } }), place, json!({ tag: word }));
            let found = wait_for(&service, &json!({
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
async fn map_is_available_as_table() {
    let service = Service::new();
    let found = wait_for(&service, &map(&shortest(), 3)).await;
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

/// Compares each quantity with the value at its pointer in the answers. Returns the number of compared quantities.
async fn count_matching_pointers(service: &Service, document: &Value) -> usize {
    let listed = service.get("/v1/quantities").await.found();
    let listed = listed["quantities"].as_array().unwrap();
    let study = json!({ "study": "map", "base": with(document, "/sweep", json!({ "wind_up": true })), "over": { "/drive/teeth/radius_mm": { "one_of": [document["drive"]["teeth"]["radius_mm"]] } } });
    let found = wait_for(service, &study).await;
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
async fn every_quantity_matches_value_at_its_pointer() {
    let service = Service::new();
    let mut compared = 0;
    let load = json!({ "input_torque_nm": 20.0, "input_speed_rpm": 1500.0, "allowable_stress_mpa": 1500.0 });
    let full = with(&with(&shortest(), "/load", load), "/friction", rubbing());
    for document in [full, undercut(), every_number()] {
        compared += count_matching_pointers(&service, &document).await;
    }
    assert!(compared > 100, "{compared} compared");
}

#[tokio::test]
async fn losses_under_duty_cover_all_points() {
    let duty = json!({ "duty": [
        { "input_torque_nm": 20.0, "input_speed_rpm": 500.0, "share_of_time": 0.25 },
        { "input_torque_nm": 2.0, "input_speed_rpm": 3000.0, "share_of_time": 0.75 },
    ] });
    let document = with(&with(&shortest(), "/load", duty), "/friction", rubbing());
    let compared = count_matching_pointers(&Service::new(), &document).await;
    assert!(compared > 40, "{compared} compared");
}

#[tokio::test]
async fn every_quantity_names_unit_and_meaning() {
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
            "arcmin" => "_arcmin",
            "MPa" => "_mpa",
            "N" => "_n",
            "W" => "_w",
            other => panic!("{other} of {name}"),
        };
        assert!(name.ends_with(ending) && quantity["meaning"].as_str().unwrap().ends_with('.'), "{quantity}");
        assert_eq!(listed.iter().filter(|other| other["name"] == name).count(), 1, "{name}");
    }
}
