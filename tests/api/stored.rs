//! Studies that are kept in a file, and by several replicas.

use std::fs;
use std::path::PathBuf;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, Instant};

use futures_util::StreamExt as _;
use futures_util::future::join_all;
use serde_json::{Value, json};
use sqlx::{Connection as _, SqliteConnection};
use tokio::net::TcpListener;
use tokio::task::JoinHandle;
use toothwave::compute::Pool;
use toothwave::config::Limits;
use toothwave::parts::Parts;
use toothwave::problem::{Problem, ProblemCode};
use toothwave::studies::Keeping;
use toothwave_calculation::BUILD;
use toothwave_store::{Address, Claim, Figures, NewStudy, Store};
use toothwave_study::Study;

use crate::asking::{Answer, LIMITS, Occupied, Question, Service, until};
use crate::designs::{shortest, with};

const EXPIRY: Duration = Duration::from_secs(3600);

/// A file of its own, gone with it.
pub(crate) struct File(PathBuf);

impl File {
    pub(crate) fn new() -> Self {
        static FILES: AtomicU64 = AtomicU64::new(0);
        let name = format!("toothwave-stored-{}-{}", std::process::id(), FILES.fetch_add(1, Ordering::Relaxed));
        Self(std::env::temp_dir().join(name))
    }

    async fn store(&self) -> Store {
        Store::open(&Address::File(self.0.clone())).await.unwrap()
    }
}

impl Drop for File {
    fn drop(&mut self) {
        for ending in ["", "-wal", "-shm"] {
            let _ = fs::remove_file(format!("{}{ending}", self.0.display()));
        }
    }
}

/// A folder of its own, gone with it.
struct Folder(PathBuf);

impl Folder {
    fn new() -> Self {
        let folder = Self(File::new().0.with_extension("parts"));
        fs::create_dir(&folder.0).unwrap();
        folder
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = fs::remove_dir_all(&self.0);
    }
}

/// A service that keeps its studies in a file, with its workers where it has some.
pub(crate) struct Keeper {
    pub(crate) service: Service,
    store: Store,
    workers: Option<JoinHandle<()>>,
}

impl Keeper {
    pub(crate) async fn of(file: &File, limits: Limits, has_workers: bool) -> Self {
        Self::with_parts(file, limits, has_workers, None).await
    }

    async fn with_parts(file: &File, limits: Limits, has_workers: bool, parts: Option<Parts>) -> Self {
        let store = file.store().await;
        let service = Service::keeping(limits, Keeping::Store { store: store.clone(), expiry: EXPIRY, parts });
        let app = std::sync::Arc::clone(&service.app);
        let workers = has_workers.then(|| tokio::spawn(async move { app.studies.serve_store().await }));
        Self { service, store, workers }
    }

    /// As when the process is told to stop.
    pub(crate) async fn end(self) {
        self.service.app.studies.close();
        if let Some(workers) = self.workers {
            workers.await.unwrap();
        }
        self.service.app.studies.close_store().await;
    }

    async fn ask(&self, study: &Value) -> Answer {
        self.service.ask(&Question::post("/v1/studies", study.to_string())).await
    }

    async fn wait_for(&self, study: &Value) -> Value {
        let question = Question::post("/v1/studies", study.to_string()).with("prefer", "wait=600");
        self.service.ask(&question).await.found()
    }
}

fn map(steps: u64) -> Value {
    json!({
        "study": "map", "base": shortest(),
        "over": { "/drive/teeth/radius_mm": { "min": 3.0, "max": 7.0, "steps": steps } },
        "quantities": ["peak_stress_ring_mpa", "undercut"]
    })
}

fn tolerance() -> Value {
    json!({
        "study": "tolerance", "base": shortest(), "samples": 500, "quantities": ["peak_stress_ring_mpa"],
        "inputs": { "/drive/teeth/radius_mm": { "distribution": "normal", "sigma": 0.01, "limit": 0.03 } }
    })
}

fn search() -> Value {
    json!({
        "study": "search", "base": shortest(), "evaluations": 100,
        "free": { "/drive/teeth/radius_mm": { "min": 3.0, "max": 7.5 } }, "require": { "undercut": false },
        "objectives": [{ "quantity": "slot_wall_mm", "goal": "max" }, { "quantity": "outer_diameter_mm", "goal": "min" }]
    })
}

fn place(study: &Value) -> String {
    format!("/v1/studies/{}", study["id"].as_str().unwrap())
}

#[tokio::test]
async fn a_stored_study_has_the_bytes_of_one_in_memory() {
    let (file, memory) = (File::new(), Service::new());
    let keeper = Keeper::of(&file, LIMITS, true).await;
    for study in [map(300), tolerance(), search()] {
        let question = Question::post("/v1/studies", study.to_string()).with("prefer", "wait=600");
        let expected = memory.ask(&question).await.found();
        let found = keeper.wait_for(&study).await;
        assert_eq!(found, expected);
        let result = memory.get(&format!("{}/result", place(&expected))).await;
        let kept = keeper.service.get(&format!("{}/result", place(&found))).await;
        assert!(kept.body == result.body, "{}", study["study"]);
    }
    keeper.end().await;
}

#[tokio::test]
async fn a_restart_goes_on_where_it_was_and_loses_nothing_that_was_finished() {
    let file = File::new();
    // Nobody computes: the study stays as it is.
    let asked = Keeper::of(&file, LIMITS, false).await;
    let study = asked.ask(&map(40)).await;
    assert_eq!(study.status, 202, "{}", study.text());
    let study = study.json();
    assert_eq!((&study["state"], &study["looked_at"]), (&json!("running"), &json!(0)));
    asked.end().await;
    let again = Keeper::of(&file, LIMITS, true).await;
    let stands = again.service.get(&place(&study)).await.found();
    assert_eq!((&stands["id"], &stands["variants"]), (&study["id"], &json!(40)));
    let done = again.wait_for(&map(40)).await;
    assert_eq!((&done["state"], &done["looked_at"]), (&json!("done"), &json!(40)));
    again.end().await;
    let after = Keeper::of(&file, LIMITS, false).await;
    assert_eq!(after.service.get(&format!("{}/result", place(&study))).await.found(), done["result"]);
    after.end().await;
}

#[tokio::test]
async fn a_stored_study_is_cancelled_goes_on_and_is_forgotten() {
    let file = File::new();
    let keeper = Keeper::of(&file, LIMITS, false).await;
    let study = keeper.ask(&map(5)).await.json();
    let delete = Question::of("DELETE", &place(&study));
    assert_eq!(keeper.service.ask(&delete).await.status, 204);
    assert_eq!(keeper.service.get(&place(&study)).await.found()["state"], "cancelled");
    assert_eq!(keeper.ask(&map(5)).await.status, 202, "the same question lets it go on");
    assert_eq!(keeper.service.get(&place(&study)).await.found()["state"], "running");
    assert_eq!(keeper.service.ask(&delete).await.status, 204);
    assert_eq!(keeper.service.ask(&delete).await.status, 204);
    keeper.service.get(&place(&study)).await.refused(404, "not_found");
    assert_eq!(keeper.service.ask(&delete).await.status, 404);
    keeper.end().await;
}

#[tokio::test]
async fn more_stored_studies_than_may_run_are_refused() {
    let file = File::new();
    let keeper = Keeper::of(&file, Limits { max_concurrent_studies: 1, ..LIMITS }, false).await;
    assert_eq!(keeper.ask(&map(5)).await.status, 202);
    assert_eq!(keeper.ask(&map(5)).await.status, 202, "it runs already");
    keeper.ask(&map(6)).await.refused(503, "queue_full");
    keeper.end().await;
}

#[tokio::test]
async fn no_more_stored_studies_run_than_may_however_many_are_asked_for_at_once() {
    let file = File::new();
    let keeper = Keeper::of(&file, Limits { max_concurrent_studies: 2, ..LIMITS }, false).await;
    let studies: Vec<_> = (5..15).map(map).collect();
    let answers = join_all(studies.iter().map(|study| keeper.ask(study))).await;
    let (begun, refused): (Vec<_>, Vec<_>) = answers.iter().partition(|answer| answer.status == 202);
    assert_eq!(begun.len(), 2);
    for answer in refused {
        answer.refused(503, "queue_full");
    }
    assert_eq!(keeper.store.waiting().await.unwrap().len(), 2);
    keeper.end().await;
}

/// All that is asked of a study but its result.
async fn is_seen_and_deleted(service: &Service, study: &Value) {
    let place = place(study);
    assert_eq!(service.get(&place).await.found()["id"], study["id"]);
    assert_eq!(service.ask(&Question::of("DELETE", &place)).await.status, 204);
    let events = service.get(&format!("{place}/events")).await;
    assert_eq!((events.status, events.text().starts_with("event: end")), (200, true));
    assert_eq!(service.ask(&Question::of("DELETE", &place)).await.status, 204);
    service.get(&place).await.refused(404, "not_found");
}

/// Each takes 17 kB with its result.
#[tokio::test]
async fn stored_studies_are_seen_read_and_deleted_from_every_replica_whatever_runs_and_whatever_it_takes() {
    let file = File::new();
    let limits = Limits { max_study_bytes: 30_000, ..LIMITS };
    let keeper = Keeper::of(&file, limits, false).await;
    let of_store = |store: &Store| Keeping::Store { store: store.clone(), expiry: EXPIRY, parts: None };
    let replicas = [&keeper.service, &Service::keeping(limits, of_store(&keeper.store))];
    let mut studies = Vec::new();
    for (steps, replica) in (5..).zip([replicas[0], replicas[1], replicas[0]]) {
        let answer = replica.ask(&Question::post("/v1/studies", map(steps).to_string())).await;
        assert_eq!(answer.status, 202, "{}", answer.text());
        studies.push(answer.json());
    }
    for (study, replica) in studies.iter().flat_map(|study| replicas.map(|replica| (study, replica))) {
        assert_eq!(replica.get(&place(study)).await.found()["state"], "running");
        let result = replica.get(&format!("{}/result", place(study))).await.found();
        assert_eq!(result["is_complete"], false);
    }
    for (study, replica) in studies.iter().zip([replicas[1], replicas[0], replicas[1]]) {
        is_seen_and_deleted(replica, study).await;
    }
    keeper.end().await;
}

#[tokio::test]
async fn a_stored_study_outlives_limits_that_became_smaller() {
    let file = File::new();
    let keeper = Keeper::of(&file, LIMITS, true).await;
    let done = keeper.wait_for(&map(5)).await;
    keeper.end().await;
    let keeper = Keeper::of(&file, LIMITS, false).await;
    let running = keeper.ask(&map(6)).await.json();
    keeper.end().await;
    let keeper = Keeper::of(&file, Limits { max_study_bytes: 1000, ..LIMITS }, false).await;
    assert_eq!(keeper.service.get(&format!("{}/result", place(&done))).await.found(), done["result"]);
    is_seen_and_deleted(&keeper.service, &running).await;
    keeper.end().await;
}

#[tokio::test]
async fn unread_answers_keep_nobody_from_seeing_a_stored_study_or_deleting_it() {
    let file = File::new();
    let keeper = Keeper::of(&file, LIMITS, false).await;
    // Of which nothing needs to be computed: 336 kB.
    let study = keeper.ask(&map(10_000)).await.json();
    keeper.end().await;
    let keeper = Keeper::of(&file, Limits { max_unread_bytes: 1_000_000, ..LIMITS }, false).await;
    let _unread = keeper.service.app.room.reserve(900_000).unwrap();
    keeper.service.get(&format!("{}/result", place(&study))).await.refused(503, "too_many_unread_bytes");
    is_seen_and_deleted(&keeper.service, &study).await;
    keeper.end().await;
}

/// One at a time has room.
#[tokio::test]
async fn of_stored_studies_a_result_alone_waits_until_others_are_read() {
    let file = File::new();
    let keeper = Keeper::of(&file, Limits { max_study_bytes: 30_000, ..LIMITS }, false).await;
    let (one, other) = (keeper.ask(&map(5)).await.json(), keeper.ask(&map(6)).await.json());
    let studies = &keeper.service.app.studies;
    let kept = studies.find(one["id"].as_str().unwrap()).await.unwrap().unwrap();
    let reading = studies.read(&kept, keeper.service.app.pool.deadline()).await.unwrap();
    let result = format!("{}/result", place(&other));
    let problem = keeper.service.get(&result).await.refused(503, "queue_full");
    let detail = problem["detail"].as_str().unwrap();
    assert!(detail.contains("being read") && detail.contains("max_study_bytes"), "{detail}");
    assert_eq!(keeper.service.get(&place(&other)).await.found()["state"], "running");
    drop(reading);
    assert_eq!(keeper.service.get(&result).await.found()["is_complete"], false);
    keeper.end().await;
}

/// The file as it is when so much more time has passed since anything was asked or computed.
async fn aged(file: &File, time: Duration) {
    let mut later = SqliteConnection::connect(&format!("sqlite:{}", file.0.display())).await.unwrap();
    for (table, column) in [("studies", "asked_at_s"), ("attempts", "began_at_s")] {
        let text = format!("UPDATE {table} SET {column} = {column} - {}", time.as_secs());
        sqlx::raw_sql(sqlx::AssertSqlSafe(text)).execute(&mut later).await.unwrap();
    }
    later.close().await.unwrap();
}

/// Once it is noted that the study was asked for, for which nobody waits.
async fn noted(store: &Store, study: &Value) {
    for _ in 0..100_000 {
        if store.look(study["id"].as_str().unwrap()).await.unwrap().unwrap().unasked < EXPIRY {
            return;
        }
    }
    panic!("nobody noted that it was asked for");
}

#[tokio::test]
async fn who_reads_a_stored_study_in_whatever_way_keeps_it_from_expiring() {
    for read in ["", "/result", "/events"] {
        let file = File::new();
        let keeper = Keeper::of(&file, LIMITS, true).await;
        let (asked, left) = (keeper.wait_for(&map(5)).await, keeper.wait_for(&map(6)).await);
        keeper.end().await;
        aged(&file, 2 * EXPIRY).await;
        let keeper = Keeper::of(&file, LIMITS, false).await;
        assert_eq!(keeper.service.get(&format!("{}{read}", place(&asked))).await.status, 200);
        noted(&keeper.store, &asked).await;
        assert_eq!(keeper.store.expire(EXPIRY).await.unwrap(), 1, "{read}");
        assert_eq!(keeper.service.get(&place(&asked)).await.found()["state"], "done");
        keeper.service.get(&place(&left)).await.refused(404, "not_found");
        keeper.end().await;
    }
}

/// Sixty requests for studies of 5 KB with 256 choices, 7 MB each as they are read, ended a process of 128 MiB: of what there was no room for nothing was counted.
#[tokio::test]
async fn what_a_stored_study_consists_of_takes_room_for_each_who_asks_where_it_is_much() {
    let file = File::new();
    let keeper = Keeper::of(&file, LIMITS, true).await;
    let choices: Vec<_> = (0..256).map(|choice| 3.0 + f64::from(choice) * 1e-3).collect();
    let mut much = map(5);
    much["over"] = json!({ "/drive/teeth/radius_mm": { "one_of": choices } });
    let (much, little) = (keeper.wait_for(&much).await, keeper.wait_for(&map(5)).await);
    keeper.end().await;
    let keeper = Keeper::of(&file, LIMITS, false).await;
    let room = &keeper.service.app.room;
    let others = room.reserve(LIMITS.max_unread_bytes).unwrap();
    keeper.service.get(&place(&much)).await.refused(503, "too_many_unread_bytes");
    assert_eq!(keeper.service.get(&place(&little)).await.found()["state"], "done");
    drop(others);
    assert_eq!(keeper.service.get(&place(&much)).await.found()["state"], "done");
    assert!(room.taken_bytes() > 1 << 18);
    // Nor is any read while memory is scarce.
    keeper.end().await;
    let keeper = Keeper::of(&file, LIMITS, false).await;
    keeper.service.app.room.memory().set_scarce(true);
    keeper.service.get(&place(&little)).await.refused(503, "too_many_unread_bytes");
    assert_eq!(keeper.service.ask(&Question::of("DELETE", &place(&little))).await.status, 204);
    keeper.end().await;
}

/// Whoever only listened to one that nobody computed was told in the end that it is cancelled: it was forgotten.
#[tokio::test]
async fn who_listens_to_a_stored_study_keeps_it_from_expiring() {
    let file = File::new();
    let store = file.store().await;
    // It is noted each second.
    let expiry = Duration::ZERO;
    let service = Service::keeping(LIMITS, Keeping::Store { store: store.clone(), expiry, parts: None });
    let study = service.ask(&Question::post("/v1/studies", map(5).to_string())).await.json();
    let (begun, id) = (Instant::now(), study["id"].as_str().unwrap());
    let question = Question::of("GET", study["events_href"].as_str().unwrap());
    let mut events = service.response(question.request()).await.into_body().into_data_stream();
    let mut is_kept = false;
    for _ in 0..100 {
        events.next().await.unwrap().unwrap();
        let unasked = store.look(id).await.unwrap().unwrap().unasked;
        is_kept |= unasked + Duration::from_secs(2) < begun.elapsed();
        if is_kept {
            break;
        }
    }
    assert!(is_kept, "who listened was not counted as asking");
    drop(events);
    service.app.studies.close();
    service.app.studies.close_store().await;
}

/// Those that need a turn of computing for it wait for one; nobody waits for them.
#[tokio::test]
async fn who_begins_a_stored_study_waits_for_no_other_that_begins() {
    let file = File::new();
    let limits = Limits { max_concurrent_solves: 1, deadline_ms: 10_000, ..LIMITS };
    let keeper = Keeper::of(&file, limits, false).await;
    let study = keeper.ask(&map(5)).await.json();
    assert_eq!(keeper.service.ask(&Question::of("DELETE", &place(&study))).await.status, 204);
    let occupied = Occupied::by_one(&keeper.service.app.pool).await;
    let (waiting, again) = (map(6), map(5));
    let waits = keeper.ask(&waiting);
    let begins = async {
        // The other is on its way, and waits for its canary's turn.
        tokio::time::sleep(Duration::from_millis(300)).await;
        keeper.ask(&again).await
    };
    tokio::select! {
        biased;
        begun = begins => assert_eq!(begun.status, 202, "{}", begun.text()),
        refused = waits => panic!("it waited for one that was refused: {}", refused.text()),
    }
    drop(occupied);
    keeper.end().await;
}

/// Sixty of them once ended a service of 256 MiB.
#[tokio::test]
async fn studies_that_wait_for_their_canary_have_taken_the_room_of_what_is_asked() {
    let file = File::new();
    let limits = Limits { max_concurrent_solves: 1, max_unread_bytes: 5_000_000, deadline_ms: 10_000, ..LIMITS };
    let keeper = Keeper::of(&file, limits, false).await;
    let occupied = Occupied::by_one(&keeper.service.app.pool).await;
    // Each choice has a document of its own: some three megabytes of them.
    let base = json!({
        "drive": {
            "wave_generator": { "semi_major_mm": 1600.0, "semi_minor_mm": 1599.0 },
            "teeth": { "count": 900, "radius_mm": 3.0, "width_mm": 15.0 }, "ring": { "teeth": 898 }
        },
        "deviations": { "tooth_radius_um": vec![0.0; 900] }
    });
    let asked = |lowest: u64| {
        let choices: Vec<_> = (lowest..lowest + 100).collect();
        json!({
            "study": "map", "base": base, "quantities": ["undercut"],
            "over": { "/drive/teeth/width_mm": { "one_of": choices } }
        })
    };
    let (one, other) = (asked(10), asked(20));
    let begins = keeper.ask(&one);
    let refused = async {
        while keeper.service.app.room.taken_bytes() == 0 {
            tokio::task::yield_now().await;
        }
        keeper.ask(&other).await.refused(503, "too_many_unread_bytes")
    };
    tokio::select! {
        _ = refused => {}
        begun = begins => panic!("it did not wait: {} {}", begun.status, begun.text()),
    }
    assert_eq!(keeper.service.app.room.taken_bytes(), 0, "who left gave it back");
    drop(occupied);
    keeper.end().await;
}

/// Each had one of its own once, of up to eight megabytes, for as long as the study ran.
#[tokio::test]
async fn however_many_ask_at_once_for_a_study_that_is_not_known_here_it_is_kept_once() {
    let file = File::new();
    let keeper = Keeper::of(&file, LIMITS, false).await;
    let mut study = map(5);
    study["over"] = json!({ "/drive/teeth/width_mm": { "one_of": (0..200).map(|i| 10 + i).collect::<Vec<_>>() } });
    study["base"]["deviations"] = json!({ "tooth_radius_um": vec![0.25; 28] });
    let place = place(&keeper.ask(&study).await.json());
    let once_bytes = keeper.service.app.room.taken_bytes();
    assert!(once_bytes > 0);
    keeper.end().await;
    let keeper = Keeper::of(&file, LIMITS, false).await;
    let answers = join_all((0..20).map(|_| keeper.service.get(&place))).await;
    assert!(answers.iter().all(|answer| answer.status == 200));
    assert_eq!(keeper.service.app.room.taken_bytes(), once_bytes);
    keeper.end().await;
}

#[tokio::test]
async fn a_study_that_another_has_cancelled_is_forgotten_by_who_deletes_it_next() {
    let file = File::new();
    let keeper = Keeper::of(&file, LIMITS, false).await;
    let study = keeper.ask(&map(5)).await.json();
    keeper.store.cancel(study["id"].as_str().unwrap()).await.unwrap();
    assert_eq!(keeper.service.ask(&Question::of("DELETE", &place(&study))).await.status, 204);
    keeper.service.get(&place(&study)).await.refused(404, "not_found");
    keeper.end().await;
}

/// How many variants a chunk has hangs on how long the canary took.
#[tokio::test]
async fn a_study_that_another_forgot_and_began_anew_in_other_chunks_is_whole() {
    let file = File::new();
    let keeper = Keeper::of(&file, LIMITS, false).await;
    let study = keeper.ask(&map(5)).await.json();
    let first = keeper.store.find(study["id"].as_str().unwrap()).await.unwrap().unwrap().study;
    keeper.store.cancel(&first.id).await.unwrap();
    keeper.store.forget(&first.id).await.unwrap();
    assert!(first.chunk_variants >= 5 && first.chunks == 1);
    let second = NewStudy { chunk_variants: 2, chunks: 3, ..first };
    keeper.store.create(&second).await.unwrap();
    let mut held = Vec::new();
    for _ in 0..2 {
        let Claim::Chunk(lease) = keeper.store.claim(&second.cut(), Duration::from_secs(60)).await.unwrap() else {
            panic!()
        };
        held.push(lease);
    }
    held.remove(0).give_back().await.unwrap();
    let app = std::sync::Arc::clone(&keeper.service.app);
    let workers = tokio::spawn(async move { app.studies.serve_store().await });
    let done = async || keeper.store.chunks_done(&second.cut()).await.unwrap();
    while done().await.iter().map(|(chunk, _)| *chunk).collect::<Vec<_>>() != [0, 2] {
        tokio::time::sleep(Duration::from_millis(10)).await;
    }
    // Whoever followed the first one does not take its chunks for these.
    let partial = keeper.service.get(&format!("{}/result", place(&study))).await.found();
    assert_eq!(partial["is_complete"], false);
    drop(held);
    let question = Question::post("/v1/studies", map(5).to_string()).with("prefer", "wait=600");
    let whole = Service::new().ask(&question).await.found();
    assert_eq!(keeper.wait_for(&map(5)).await, whole);
    keeper.service.app.studies.close();
    workers.await.unwrap();
}

/// Of two axes of powers of two the canary saw those variants alone that took no time, and the study was one chunk.
#[tokio::test]
async fn a_study_of_which_its_canary_has_not_seen_all_has_many_chunks() {
    let file = File::new();
    let keeper = Keeper::of(&file, LIMITS, false).await;
    let mut study = map(8192);
    study["over"]["/sweep/samples"] = json!({ "one_of": [16, 50] });
    let study = keeper.ask(&study).await.json();
    let frozen = keeper.store.find(study["id"].as_str().unwrap()).await.unwrap().unwrap().study;
    assert!(frozen.canary_variants < frozen.variants);
    assert!(frozen.chunks >= 64, "{} chunks of {} variants", frozen.chunks, frozen.variants);
    keeper.end().await;
}

/// A chunk of hundreds of thousands of variants, on one core.
#[tokio::test]
async fn a_study_does_not_wait_for_the_end_of_anothers_chunk() {
    let file = File::new();
    let keeper = Keeper::of(&file, Limits { max_concurrent_solves: 1, ..LIMITS }, false).await;
    let mut long = map(700);
    long["over"]["/load/input_torque_nm"] = json!({ "min": 10.0, "max": 20.0, "steps": 700 });
    let study = keeper.ask(&long).await.json();
    let first = keeper.store.find(study["id"].as_str().unwrap()).await.unwrap().unwrap().study;
    keeper.store.cancel(&first.id).await.unwrap();
    keeper.store.forget(&first.id).await.unwrap();
    let long = NewStudy { chunk_variants: first.variants, chunks: 1, ..first };
    keeper.store.create(&long).await.unwrap();
    let app = std::sync::Arc::clone(&keeper.service.app);
    let workers = tokio::spawn(async move { app.studies.serve_store().await });
    while keeper.store.figures().await.unwrap().in_work == 0 {
        tokio::time::sleep(Duration::from_millis(10)).await;
    }
    assert_eq!(keeper.wait_for(&map(5)).await["state"], "done");
    assert_eq!(keeper.store.chunks_done(&long.cut()).await.unwrap(), []);
    keeper.store.cancel(&long.id).await.unwrap();
    keeper.service.app.studies.close();
    workers.await.unwrap();
}

/// What a request may take is none of a study's: its canary was begun again and again, and it ran for ever.
#[tokio::test]
async fn a_file_of_studies_is_worked_on_where_requests_have_less_time_than_a_slice() {
    let file = File::new();
    let keeper = Keeper::of(&file, LIMITS, false).await;
    let study = keeper.ask(&map(300)).await.json();
    keeper.end().await;
    let keeper = Keeper::of(&file, Limits { deadline_ms: 1, ..LIMITS }, true).await;
    while !keeper.store.find(study["id"].as_str().unwrap()).await.unwrap().unwrap().is_done() {
        tokio::time::sleep(Duration::from_millis(10)).await;
    }
    keeper.end().await;
}

/// Whoever reads it goes through a list of them: of millions that took seconds, in which nobody else was answered.
#[tokio::test]
async fn a_study_however_large_has_a_hundred_thousand_chunks_at_most() {
    let file = File::new();
    let limits = Limits { max_study_variants: u64::MAX, max_study_bytes: u64::MAX, ..LIMITS };
    let keeper = Keeper::of(&file, limits, false).await;
    // Of chunks of a second there were millions.
    let study = json!({
        "study": "map", "base": shortest(), "quantities": ["peak_stress_ring_mpa"],
        "over": {
            "/drive/teeth/radius_mm": { "min": 3.0, "max": 7.0, "steps": 100_000 },
            "/load/input_torque_nm": { "min": 1.0, "max": 20.0, "steps": 100_000 }
        }
    });
    let study = keeper.ask(&study).await.json();
    let frozen = keeper.store.find(study["id"].as_str().unwrap()).await.unwrap().unwrap().study;
    assert_eq!((frozen.variants, frozen.chunks, frozen.chunk_variants), (10_000_000_000, 100_000, 100_000));
    assert_eq!(frozen.lease, Duration::from_secs(30), "who computes a long chunk is not silent");
    keeper.end().await;
}

#[tokio::test]
async fn an_answer_is_of_what_has_come_when_it_is_made_though_it_was_asked_for_before() {
    let file = File::new();
    let keeper = Keeper::of(&file, LIMITS, false).await;
    let study = keeper.ask(&map(5)).await.json();
    let studies = &keeper.service.app.studies;
    let kept = studies.find(study["id"].as_str().unwrap()).await.unwrap().unwrap();
    // Who waits for the turn to make it holds nothing of its own.
    let reading = studies.read(&kept, keeper.service.app.pool.deadline()).await.unwrap();
    let app = std::sync::Arc::clone(&keeper.service.app);
    let workers = tokio::spawn(async move { app.studies.serve_store().await });
    let done = keeper.wait_for(&map(5)).await;
    assert_eq!(done["result"]["is_complete"], true);
    assert_eq!(serde_json::to_value(reading.answer()).unwrap(), done["result"]);
    keeper.service.app.studies.close();
    workers.await.unwrap();
}

/// What comes of two who read the result of `map(5)`: one has its rows and waits for the turn to decode them; the other asks then, when the
/// store answers nobody any more.
async fn two_who_read(file: &File, end: impl AsyncFnOnce(&Pool, Occupied)) -> [Result<Value, Problem>; 2] {
    let keeper = Keeper::of(file, Limits { max_concurrent_solves: 1, ..LIMITS }, false).await;
    let (studies, pool) = (&keeper.service.app.studies, &keeper.service.app.pool);
    let id = Study::read(map(5).to_string().as_bytes(), &keeper.service.app.limits.of_studies()).unwrap().id();
    let kept = studies.find(&id.to_string()).await.unwrap().unwrap();
    let occupied = Occupied::by_one(pool).await;
    let one = studies.read(&kept, pool.deadline());
    let other = async {
        // Its one connection is given in turn: after some more turns the one has all that it asks for.
        for _ in 0..20 {
            keeper.store.waiting().await.unwrap();
            tokio::task::yield_now().await;
        }
        keeper.store.close().await;
        tokio::join!(studies.read(&kept, pool.deadline()), end(pool, occupied)).0
    };
    let (one, other) = tokio::join!(one, other);
    [one, other].map(|reading| Ok(serde_json::to_value(reading?.answer()).unwrap()))
}

/// Each once read them for itself, and held them until its turn to decode them came.
#[tokio::test]
async fn rows_that_one_reads_from_the_store_are_read_for_all_who_wait_for_them() {
    let file = File::new();
    let keeper = Keeper::of(&file, LIMITS, true).await;
    let done = keeper.wait_for(&map(5)).await;
    keeper.end().await;
    for answer in two_who_read(&file, async |_, occupied| occupied.end().await).await {
        assert_eq!(answer.unwrap(), done["result"]);
    }
}

#[tokio::test]
async fn who_waits_for_rows_that_another_reads_is_told_why_they_do_not_come() {
    let file = File::new();
    let keeper = Keeper::of(&file, LIMITS, true).await;
    keeper.wait_for(&map(5)).await;
    keeper.end().await;
    for answer in two_who_read(&file, async |pool, _occupied| pool.close()).await {
        assert_eq!(answer.unwrap_err().code, ProblemCode::ShuttingDown);
    }
}

#[tokio::test]
async fn a_result_that_another_forgets_as_it_is_read_is_not_there_instead_of_empty() {
    let file = File::new();
    let keeper = Keeper::of(&file, LIMITS, true).await;
    let id = keeper.wait_for(&map(5)).await["id"].as_str().unwrap().to_owned();
    keeper.end().await;
    // Who has read nothing of it yet.
    let reader = Keeper::of(&file, LIMITS, false).await;
    let studies = &reader.service.app.studies;
    let kept = studies.find(&id).await.unwrap().unwrap();
    reader.store.forget(&id).await.unwrap();
    let read = studies.read(&kept, reader.service.app.pool.deadline()).await;
    assert_eq!(read.err().map(|problem| problem.code), Some(ProblemCode::NotFound));
    reader.end().await;
}

#[tokio::test]
async fn a_study_that_another_forgets_while_it_begins_is_no_fault_of_the_service() {
    let file = File::new();
    let keeper = Keeper::of(&file, LIMITS, false).await;
    let study = keeper.ask(&map(5)).await.json();
    let (again, delete) = (map(5), Question::of("DELETE", &place(&study)));
    for _ in 0..30 {
        let (begun, one, other) =
            tokio::join!(keeper.ask(&again), keeper.service.ask(&delete), keeper.service.ask(&delete));
        assert!(matches!(begun.status, 200 | 202), "{}", begun.text());
        assert!([one, other].iter().all(|deleted| matches!(deleted.status, 204 | 404)));
    }
    keeper.end().await;
}

#[tokio::test]
async fn a_stored_study_beyond_its_time_says_so() {
    let file = File::new();
    let keeper = Keeper::of(&file, Limits { study_deadline_ms: 0, ..LIMITS }, false).await;
    let found = keeper.ask(&map(5)).await.found();
    assert_eq!((&found["state"], &found["problem"]["code"]), (&json!("failed"), &json!("deadline_exceeded")));
    assert_eq!(found["result"]["is_complete"], false);
    keeper.end().await;
}

#[tokio::test]
async fn a_chunk_that_never_came_to_a_result_is_named_and_tried_anew_when_it_is_asked_for_again() {
    let file = File::new();
    let keeper = Keeper::of(&file, LIMITS, false).await;
    let study = keeper.ask(&map(5)).await.json();
    let cut = keeper.store.find(study["id"].as_str().unwrap()).await.unwrap().unwrap().study.cut();
    // As workers do who die at it.
    loop {
        match keeper.store.claim(&cut, Duration::from_secs(60)).await.unwrap() {
            Claim::Chunk(lease) => drop(lease),
            Claim::Gap(chunk) => break assert_eq!(chunk, 0),
            Claim::None => panic!("nobody waits"),
        }
    }
    keeper.end().await;
    let keeper = Keeper::of(&file, LIMITS, false).await;
    let stands = keeper.service.get(&place(&study)).await.found();
    assert_eq!((&stands["state"], &stands["problem"]["code"]), (&json!("failed"), &json!("internal_error")));
    let result = keeper.service.get(&format!("{}/result", place(&study))).await.found();
    let gap = json!([{ "chunk": 0, "first_variant": 0, "variants": 5, "attempts": 3 }]);
    assert_eq!((&result["is_complete"], &result["gaps"]), (&json!(false), &gap));
    keeper.end().await;
    let keeper = Keeper::of(&file, LIMITS, true).await;
    let found = keeper.wait_for(&map(5)).await;
    assert_eq!((&found["state"], found["result"].get("gaps")), (&json!("done"), None));
    keeper.end().await;
}

#[tokio::test]
async fn a_study_of_another_build_or_of_other_bits_is_left_to_others() {
    let file = File::new();
    let keeper = Keeper::of(&file, LIMITS, false).await;
    let study = keeper.ask(&map(5)).await.json();
    let store = &keeper.store;
    let frozen = store.find(study["id"].as_str().unwrap()).await.unwrap().unwrap().study;
    store.cancel(&frozen.id).await.unwrap();
    store.forget(&frozen.id).await.unwrap();
    for other in [
        NewStudy { id: "of-another-build".into(), origin: "another-build".into(), ..frozen.clone() },
        NewStudy { id: "of-another-processor".into(), origin: format!("{BUILD}-another"), ..frozen.clone() },
        NewStudy { canary: "of other bits".into(), ..frozen.clone() },
    ] {
        store.create(&other).await.unwrap();
    }
    keeper.end().await;
    // Of the three that wait one is of this build and kind of processor: one more may run of two, though not of one.
    let keeper = Keeper::of(&file, Limits { max_concurrent_studies: 1, ..LIMITS }, false).await;
    keeper.ask(&map(6)).await.refused(503, "queue_full");
    keeper.end().await;
    let keeper = Keeper::of(&file, Limits { max_concurrent_studies: 2, ..LIMITS }, true).await;
    // Once this one is done, the workers have looked at those as well.
    assert_eq!(keeper.wait_for(&map(6)).await["state"], "done");
    for id in ["of-another-build", "of-another-processor", &frozen.id] {
        let standing = keeper.store.find(id).await.unwrap().unwrap();
        assert_eq!((standing.done, standing.is_running()), (0, true), "{id}");
    }
    // Whoever has kept the id of one is told so.
    for (id, why) in [("of-another-build", "belongs to build another"), ("of-another-processor", "kind of processor")] {
        let problem = keeper.service.get(&format!("/v1/studies/{id}")).await.refused(404, "not_found");
        assert!(problem["detail"].as_str().unwrap().contains(why), "{problem}");
        // Nor can it be watched here; that it ends can be seen to.
        for stands in [Some(false), None] {
            let told = keeper.service.ask(&Question::of("DELETE", &format!("/v1/studies/{id}"))).await;
            assert_eq!(told.status, 204);
            assert_eq!(keeper.store.find(id).await.unwrap().map(|standing| standing.is_running()), stands, "{id}");
        }
    }
    keeper.end().await;
}

/// A study in chunks of another size than it was cut into was done and complete, with some of its samples.
#[tokio::test]
async fn a_study_of_which_what_is_frozen_or_indexed_is_damaged_is_told_so_and_has_no_result() {
    let file = File::new();
    let keeper = Keeper::of(&file, LIMITS, true).await;
    let study = keeper.wait_for(&map(500)).await;
    keeper.end().await;
    let whole = fs::read(&file.0).unwrap();
    for damage in [
        "UPDATE studies SET chunk_variants = chunk_variants + 1",
        "UPDATE studies SET chunks = chunks - 1",
        "UPDATE studies SET variants = variants + 1",
        // As an index does that has lost some of them.
        "UPDATE results SET chunk = 1000 WHERE chunk = 0",
    ] {
        let mut damaged = SqliteConnection::connect(&format!("sqlite:{}", file.0.display())).await.unwrap();
        let changed = sqlx::query(damage).execute(&mut damaged).await.unwrap().rows_affected();
        damaged.close().await.unwrap();
        assert_eq!(changed, 1, "{damage}");
        let keeper = Keeper::of(&file, LIMITS, false).await;
        keeper.service.get(&format!("{}/result", place(&study))).await.refused(500, "internal_error");
        keeper.end().await;
        fs::write(&file.0, &whole).unwrap();
    }
}

/// Their store was closed in the moment in which the service was told to stop, though it had seconds left to answer what was begun.
#[tokio::test]
async fn requests_for_studies_that_are_begun_at_a_stop_are_answered_from_the_store() {
    let file = File::new();
    let mut keeper = Keeper::of(&file, LIMITS, true).await;
    let study = keeper.wait_for(&map(50)).await;
    keeper.service.app.studies.close();
    keeper.workers.take().unwrap().await.unwrap();
    keeper.service.get(&format!("{}/result", place(&study))).await.found();
    let service = keeper.service.clone();
    keeper.end().await;
    service.get(&format!("{}/result", place(&study))).await.refused(503, "store_unavailable");
}

/// Whoever waited for a silent database at the end of a stop got no answer at all.
#[tokio::test]
async fn who_waits_for_the_store_at_the_end_of_a_stop_is_told_so() {
    let mute = TcpListener::bind("127.0.0.1:0").await.unwrap();
    let address = format!("postgres://any@{}/studies?sslmode=disable", mute.local_addr().unwrap());
    let store = Store::open(&Address::new(&address, None).unwrap()).await.unwrap();
    let service = Service::keeping(LIMITS, Keeping::Store { store, expiry: EXPIRY, parts: None });
    let (asker, app) = (service.clone(), std::sync::Arc::clone(&service.app));
    let answer = tokio::spawn(async move { asker.get("/v1/studies/any").await });
    let _silence = mute.accept().await.unwrap();
    app.pool.close();
    answer.await.unwrap().refused(503, "shutting_down");
}

#[tokio::test]
async fn a_replica_without_a_shared_store_refuses_studies_and_says_so() {
    let service = Service::keeping(LIMITS, Keeping::Nowhere);
    let answer = service.ask(&Question::post("/v1/studies", map(5).to_string())).await;
    let problem = answer.refused(501, "no_shared_store");
    assert!(problem["detail"].as_str().unwrap().contains("replicas"), "{problem}");
}

#[tokio::test]
async fn a_store_that_does_not_answer_is_a_problem_that_passes() {
    let file = File::new();
    let keeper = Keeper::of(&file, LIMITS, false).await;
    keeper.store.close().await;
    let answer = keeper.ask(&map(5)).await;
    answer.refused(503, "store_unavailable");
    assert_eq!(answer.header("retry-after"), "1");
}

#[tokio::test]
async fn the_service_knows_how_the_store_stands() {
    let file = File::new();
    let keeper = Keeper::of(&file, LIMITS, true).await;
    keeper.wait_for(&map(5)).await;
    keeper.end().await;
    let keeper = Keeper::of(&file, LIMITS, true).await;
    let figures = loop {
        match keeper.service.app.studies.figures() {
            Some(figures) => break figures,
            None => tokio::task::yield_now().await,
        }
    };
    let Figures { studies, running, done, waiting, attempts, gaps, .. } = figures;
    assert_eq!((studies, running, done, waiting, attempts, gaps), (1, 0, 1, 0, 1, 0));
    keeper.end().await;
}

#[tokio::test]
async fn the_rows_of_a_stored_study_are_a_parquet_file_a_chunk_besides() {
    let (file, folder) = (File::new(), Folder::new());
    let (_, of_study) = asked_for_in(&file, &folder).await;
    // What a worker left behind that was killed in the middle.
    fs::create_dir(&of_study).unwrap();
    fs::write(of_study.join(".0000000000.begun"), vec![b'x'; 100_000]).unwrap();
    let parts = Parts::new(&folder.0).unwrap();
    let keeper = Keeper::with_parts(&file, LIMITS, true, Some(parts)).await;
    let found = keeper.wait_for(&map(5)).await;
    let result = Question::of("GET", &format!("{}/result", place(&found)));
    let result = keeper.service.ask(&result.with("accept", "application/vnd.apache.parquet")).await;
    let names: Vec<_> = fs::read_dir(&of_study).unwrap().map(|entry| entry.unwrap().file_name()).collect();
    assert_eq!(names, ["0000000000.parquet"]);
    assert!(fs::read(of_study.join(&names[0])).unwrap() == result.body, "they have the bytes of the result");
    // What a search comes to are designs.
    keeper.wait_for(&search()).await;
    assert_eq!(fs::read_dir(&folder.0).unwrap().count(), 1);
    keeper.end().await;
}

/// A study that nobody has computed yet, and where its rows will be.
async fn asked_for_in(file: &File, folder: &Folder) -> (Value, PathBuf) {
    let asked = Keeper::of(file, LIMITS, false).await;
    let study = asked.ask(&map(5)).await.json();
    let id = study["id"].as_str().unwrap();
    let frozen = asked.store.find(id).await.unwrap().unwrap().study;
    asked.end().await;
    assert_eq!(frozen.chunks, 1);
    let of_study = folder.0.join(format!("{id}-by-{}", frozen.chunk_variants));
    (study, of_study)
}

#[tokio::test]
async fn a_cancelled_study_whose_rows_find_no_place_holds_up_no_other() {
    let (file, folder) = (File::new(), Folder::new());
    let (study, of_study) = asked_for_in(&file, &folder).await;
    // No file can be given the name of a folder that is not empty.
    fs::create_dir_all(of_study.join("0000000000.parquet/taken")).unwrap();
    let one_slot = Limits { max_concurrent_solves: 1, deadline_ms: 60_000, ..LIMITS };
    let keeper = Keeper::with_parts(&file, one_slot, true, Some(Parts::new(&folder.0).unwrap())).await;
    while !of_study.join(".0000000000.begun").exists() {
        tokio::task::yield_now().await;
    }
    let cancelled = keeper.service.ask(&Question::of("DELETE", &place(&study))).await;
    assert_eq!(cancelled.status, 204);
    assert_eq!(keeper.wait_for(&map(6)).await["state"], "done");
    keeper.end().await;
}

/// Of each time that such a study was cancelled and asked for again a thread and its rows stayed, which nobody counted: ten ended a worker of 128 MiB.
#[tokio::test]
async fn of_a_folder_that_stands_still_no_more_threads_wait_than_chunks_are_in_work() {
    let (file, folder) = (File::new(), Folder::new());
    let (study, of_study) = asked_for_in(&file, &folder).await;
    // Who opens it waits until somebody reads.
    fs::create_dir(&of_study).unwrap();
    let still = of_study.join(".0000000000.begun");
    rustix::fs::mknodat(rustix::fs::CWD, &still, rustix::fs::FileType::Fifo, rustix::fs::Mode::RWXU, 0).unwrap();
    let one_slot = Limits { max_concurrent_solves: 1, deadline_ms: 60_000, ..LIMITS };
    let keeper = Keeper::with_parts(&file, one_slot, true, Some(Parts::new(&folder.0).unwrap())).await;
    for evaluations in 100..104 {
        assert_eq!(keeper.ask(&map(5)).await.json()["state"], "running");
        // By the others' slot, whose rows are none.
        assert_eq!(keeper.wait_for(&with(&search(), "/evaluations", json!(evaluations))).await["state"], "done");
        assert_eq!(keeper.service.ask(&Question::of("DELETE", &place(&study))).await.status, 204);
    }
    let written = tokio::task::spawn_blocking(move || fs::read(still)).await.unwrap().unwrap();
    let ends = written.windows(4).filter(|window| window == b"PAR1").count();
    assert_eq!(ends, 2, "a file has one at either end");
    keeper.end().await;
}

#[test]
fn rows_are_kept_in_a_folder_that_is_there() {
    let folder = Folder::new();
    let error = Parts::new(&folder.0.join("none")).unwrap_err();
    assert!(error.to_string().contains("none"), "{error}");
    let file = folder.0.join("file");
    fs::write(&file, "").unwrap();
    assert!(Parts::new(&file).unwrap_err().to_string().contains("no folder"));
}

/// A tolerance study whose answer is made apart.
fn large() -> Value {
    json!({
        "study": "tolerance", "base": shortest(), "samples": 14_000,
        "quantities": [
            "transmission_ratio", "outer_diameter_mm", "slot_wall_mm", "ring_root_radius_mm", "ring_tip_radius_mm", "ring_tooth_height_mm",
            "tooth_gap_min_mm", "coincidence_degree"
        ],
        "inputs": { "/drive/teeth/radius_mm": { "distribution": "normal", "sigma": 0.01, "limit": 0.03 } }
    })
}

/// Answers that wait for their turn, until it is let go: who has it.
fn held_up(pool: Pool) -> (std::sync::mpsc::Sender<()>, JoinHandle<Result<bool, Problem>>) {
    let (release, released) = std::sync::mpsc::channel::<()>();
    let before = tokio::spawn(async move {
        let waiting = move || Ok(released.recv().is_ok());
        pool.run_unhurried(waiting).await
    });
    (release, before)
}

/// A study that one client cancelled, let go on and read again and again was read long after it had left, and nobody else's meanwhile; its rows stayed though it was
/// forgotten.
#[tokio::test]
async fn an_answer_that_nobody_wants_any_more_is_not_made() {
    let service = Service::new();
    let (studies, app) = (&service.app.studies, &service.app);
    let question = Question::post("/v1/studies", large().to_string()).with("prefer", "wait=600");
    let told = service.ask(&question).await.json();
    while service.get(&place(&told)).await.found()["state"] == "running" {
        tokio::task::yield_now().await;
    }
    let (release, before) = held_up(app.pool.clone());
    tokio::task::yield_now().await;
    // That of the first question is whole; it is gone with its rows.
    assert_eq!(service.ask(&Question::of("DELETE", &place(&told))).await.status, 204);
    assert_eq!(service.ask(&Question::post("/v1/studies", large().to_string())).await.status, 202);
    let kept = studies.find(told["id"].as_str().unwrap()).await.unwrap().unwrap();
    let refused = studies.read(&kept, tokio::time::Instant::now()).await.unwrap_err();
    assert_eq!(refused.code, ProblemCode::DeadlineExceeded);
    drop(kept);
    while service.ask(&Question::of("DELETE", &place(&told))).await.status != 404 {}
    let is_given_back = || service.app.room.taken_bytes() == 0;
    until("what waits for its turn holds nothing", is_given_back).await;
    release.send(()).unwrap();
    assert!(before.await.unwrap().unwrap());
}

#[tokio::test]
async fn who_asks_for_a_study_that_is_over_gets_all_of_it_though_another_asked_while_it_ran() {
    let service = Service::new();
    let studies = &service.app.studies;
    let (release, before) = held_up(service.app.pool.clone());
    tokio::task::yield_now().await;
    let study = with(&large(), "/samples", json!(100_000)).to_string();
    let begun = service.ask(&Question::post("/v1/studies", study)).await.json();
    assert_eq!(begun["state"], "running");
    let kept = studies.find(begun["id"].as_str().unwrap()).await.unwrap().unwrap();
    let refused = studies.read(&kept, tokio::time::Instant::now()).await.unwrap_err();
    assert_eq!(refused.code, ProblemCode::DeadlineExceeded);
    while service.get(&place(&begun)).await.found()["state"] == "running" {
        tokio::task::yield_now().await;
    }
    let an_hour = tokio::time::Instant::now() + EXPIRY;
    let (made, ()) = tokio::join!(studies.read(&kept, an_hour), async { release.send(()).unwrap() });
    assert_eq!(serde_json::to_value(made.unwrap().answer()).unwrap()["is_complete"], true);
    assert!(before.await.unwrap().unwrap());
}

#[tokio::test]
async fn the_answer_of_a_large_study_goes_on_being_made_when_the_time_of_who_asked_is_over() {
    let (file, memory) = (File::new(), Service::new());
    let question = Question::post("/v1/studies", large().to_string()).with("prefer", "wait=600");
    let mut told = memory.ask(&question).await.found();
    while told["state"] == "running" {
        told = memory.ask(&question).await.json();
    }
    let keeper = Keeper::of(&file, LIMITS, true).await;
    while keeper.ask(&large()).await.json()["state"] == "running" {}
    keeper.end().await;
    let replica = Keeper::of(&file, LIMITS, false).await;
    let studies = &replica.service.app.studies;
    let kept = studies.find(told["id"].as_str().unwrap()).await.unwrap().unwrap();
    // Whose time is over at once: an answer that ended with its request would never be there.
    let mut refused = 0;
    let made = loop {
        match studies.read(&kept, tokio::time::Instant::now()).await {
            Ok(made) => break made,
            Err(problem) => {
                assert_eq!(problem.code, ProblemCode::DeadlineExceeded);
                refused += 1;
                tokio::task::yield_now().await;
            }
        }
    };
    assert!(refused > 0);
    let result = replica.service.get(&format!("{}/result", place(&told))).await.found();
    assert_eq!(result, told["result"]);
    assert_eq!(serde_json::to_value(made.answer()).unwrap(), result);
    replica.end().await;
}

/// A database takes no text with a zero in it, and one that is not in Unicode not every letter.
#[tokio::test]
async fn an_id_of_other_letters_is_no_studys() {
    let file = File::new();
    let keeper = Keeper::of(&file, LIMITS, false).await;
    for service in [&keeper.service, &Service::new()] {
        for (method, place) in [("GET", ""), ("GET", "/result"), ("GET", "/events"), ("DELETE", "")] {
            for id in ["%00", "%E2%82%AC"] {
                let question = Question::of(method, &format!("/v1/studies/{id}{place}"));
                service.ask(&question).await.refused(404, "not_found");
            }
        }
    }
    keeper.end().await;
}
