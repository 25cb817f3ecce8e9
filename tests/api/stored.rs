//! Studies in a file: restarts, damage and other builds.

use std::fs;
use std::path::PathBuf;
use std::process::{Command, Stdio};
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

use rusqlite::Connection;
use serde_json::{Value, json};
use tokio::sync::OnceCell;

use crate::asking::{Answer, LIMITS, Limits, Question, Service, ask_at};
use crate::designs::shortest;
use crate::serving::Process;

const EXPIRY_S: u64 = 100_000;

/// A temporary file.
struct File(PathBuf);

impl File {
    fn new() -> Self {
        static FILES: AtomicU64 = AtomicU64::new(0);
        let name = format!("studies-{}-{}", std::process::id(), FILES.fetch_add(1, Ordering::Relaxed));
        Self(PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join(name))
    }

    fn path(&self) -> &str {
        self.0.to_str().unwrap()
    }

    /// Changes the file's rows while no service has it open. Returns their number.
    fn change(&self, text: &str) -> usize {
        Connection::open(&self.0).unwrap().execute(text, []).unwrap()
    }
}

impl Drop for File {
    fn drop(&mut self) {
        for ending in ["", "-wal", "-shm", "-journal"] {
            let _ = fs::remove_file(format!("{}{ending}", self.path()));
        }
    }
}

/// A service with a file of studies.
struct Keeper(Service);

impl Keeper {
    fn of(file: &File) -> Self {
        Self::within(file, LIMITS)
    }

    fn within(file: &File, limits: Limits) -> Self {
        let expiry = format!("--study-expiry-s={EXPIRY_S}");
        Self(Service::with(limits, &["--studies", file.path(), &expiry]))
    }

    /// Stops the process and waits for its end.
    fn end(self) {
        let process = self.0.into_process();
        process.signalled("-TERM");
        assert_eq!(process.ended().code(), Some(0));
    }

    async fn ask(&self, study: &Value) -> Answer {
        self.0.ask(&Question::post("/v1/studies", study.to_string())).await
    }

    async fn wait_for(&self, study: &Value) -> Value {
        self.0.ask(&waiting(study)).await.found()
    }

    async fn delete(&self, study: &Value) -> u16 {
        self.0.ask(&Question::of("DELETE", &place(study))).await.status
    }
}

fn waiting(study: &Value) -> Question {
    Question::post("/v1/studies", study.to_string()).with("prefer", "wait=600")
}

fn map(steps: u64) -> Value {
    json!({
        "study": "map", "base": shortest(),
        "over": { "/drive/teeth/radius_mm": { "min": 3.0, "max": 7.0, "steps": steps } },
        "quantities": ["peak_stress_ring_mpa", "undercut"]
    })
}

/// Returns a study that runs for a while.
pub(crate) fn long() -> Value {
    let mut study = map(300);
    study["over"]["/load/input_torque_nm"] = json!({ "min": 10.0, "max": 20.0, "steps": 300 });
    study
}

fn place(study: &Value) -> String {
    format!("/v1/studies/{}", study["id"].as_str().unwrap())
}

fn result(study: &Value) -> String {
    format!("{}/result", place(study))
}

/// Returns the result of the long study when nothing disturbs it.
pub(crate) async fn undisturbed_result() -> &'static Value {
    static RESULT: OnceCell<Value> = OnceCell::const_new();
    RESULT.get_or_init(async || Service::new().ask(&waiting(&long())).await.found()["result"].clone()).await
}

fn start_at(process: &Process, study: &Value) -> Value {
    let answer = ask_at(process.address, &Question::post("/v1/studies", study.to_string()));
    assert_eq!(answer.status, 202, "{}", answer.text());
    answer.json()
}

/// Waits until the study's status meets a condition.
fn once(process: &Process, study: &Value, is_true: impl Fn(&Value) -> bool) -> Value {
    loop {
        let stands = ask_at(process.address, &Question::of("GET", &place(study))).found();
        if is_true(&stands) {
            return stands;
        }
        std::thread::sleep(Duration::from_millis(2));
    }
}

#[tokio::test]
async fn file_and_memory_give_same_bytes() {
    let (file, memory) = (File::new(), Service::new());
    let keeper = Keeper::of(&file);
    let tolerance = json!({
        "study": "tolerance", "base": shortest(), "samples": 500, "quantities": ["peak_stress_ring_mpa"],
        "inputs": { "/drive/teeth/radius_mm": { "distribution": "normal", "sigma": 0.01, "limit": 0.03 } }
    });
    let search = json!({
        "study": "search", "base": shortest(), "evaluations": 100,
        "free": { "/drive/teeth/radius_mm": { "min": 3.0, "max": 7.5 } }, "require": { "undercut": false },
        "objectives": [{ "quantity": "slot_wall_mm", "goal": "max" }, { "quantity": "outer_diameter_mm", "goal": "min" }]
    });
    for study in [map(300), tolerance, search] {
        let expected = memory.ask(&waiting(&study)).await.found();
        assert_eq!(keeper.wait_for(&study).await, expected);
        for accept in ["application/json", "text/csv", "application/vnd.apache.parquet"] {
            let question = Question::of("GET", &result(&expected)).with("accept", accept);
            assert!(memory.ask(&question).await.body == keeper.0.ask(&question).await.body, "{accept}");
        }
    }
    keeper.end();
}

#[tokio::test]
async fn killed_service_continues_with_same_bits() {
    let file = File::new();
    let process = Process::started(&["serve", "--studies", file.path()]);
    let study = start_at(&process, &long());
    let stands = once(&process, &study, |stands| stands["looked_at"].as_u64() > Some(1000));
    assert_eq!(stands["state"], "running");
    process.signalled("-KILL");
    process.ended();
    let process = Process::started(&["serve", "--studies", file.path()]);
    let stands = once(&process, &study, |stands| stands["state"] != "running");
    assert_eq!((&stands["state"], &stands["looked_at"]), (&json!("done"), &json!(90_000)));
    let found = ask_at(process.address, &Question::of("GET", &result(&study))).found();
    assert!(found == *undisturbed_result().await);
}

/// A limit on file size acts like a full disk.
#[tokio::test]
async fn full_disk_fails_only_the_study() {
    let file = File::new();
    let mut command = Command::new("bash");
    let script = "ulimit -f 300; exec \"$0\" serve --log off --studies \"$1\" \"${@:2}\"";
    command.args(["-c", script, env!("CARGO_BIN_EXE_toothwave"), file.path()]);
    let process = Process::of(&mut command, Stdio::null());
    let small = ask_at(process.address, &waiting(&map(5))).found();
    let study = start_at(&process, &long());
    let stands = once(&process, &study, |stands| stands["state"] != "running");
    assert_eq!((&stands["state"], &stands["problem"]["code"]), (&json!("failed"), &json!("store_unavailable")));
    assert!(stands["looked_at"].as_u64() < Some(90_000), "{stands}");
    assert_eq!(ask_at(process.address, &Question::of("GET", &result(&small))).found(), small["result"]);
    process.signalled("-KILL");
    process.ended();
    let keeper = Keeper::of(&file);
    assert_eq!(keeper.0.get(&result(&small)).await.found(), small["result"]);
    assert!(keeper.wait_for(&long()).await["result"] == *undisturbed_result().await);
    keeper.end();
}

fn refusal_at_start(file: &File) -> String {
    let mut command = Command::new("timeout");
    let service = ["60", env!("CARGO_BIN_EXE_toothwave"), "serve", "--listen", "127.0.0.1:0", "--studies"];
    let output = command.args(service).arg(file.path()).output().unwrap();
    assert_eq!(output.status.code(), Some(1));
    String::from_utf8(output.stderr).unwrap()
}

#[test]
fn other_schema_version_is_refused_with_both_versions() {
    let file = File::new();
    file.change("CREATE TABLE schema_versions (version BIGINT PRIMARY KEY, applied_at_s BIGINT NOT NULL)");
    file.change("INSERT INTO schema_versions VALUES (4, 0)");
    let error = refusal_at_start(&file);
    assert!(error.contains("schema 4") && error.contains("schema 5") && error.contains(file.path()), "{error}");
    fs::remove_file(&file.0).unwrap();
    Keeper::of(&file).end();
    Connection::open(&file.0).unwrap().pragma_update(None, "user_version", 6).unwrap();
    let error = refusal_at_start(&file);
    assert!(error.contains("schema 6"), "{error}");
}

#[test]
fn foreign_file_is_left_alone() {
    let file = File::new();
    file.change("CREATE TABLE accounts (name TEXT)");
    let before = fs::read(&file.0).unwrap();
    assert!(refusal_at_start(&file).contains("another program"));
    assert!(fs::read(&file.0).unwrap() == before);
    fs::write(&file.0, [b'x'; 10_000]).unwrap();
    assert!(refusal_at_start(&file).contains("damaged"));
}

#[test]
fn file_serves_one_process() {
    let file = File::new();
    let _process = Process::started(&["serve", "--studies", file.path()]);
    let error = refusal_at_start(&file);
    assert!(error.contains("another process") && error.contains(file.path()), "{error}");
}

#[tokio::test]
async fn cancelled_study_continues_after_restart() {
    let file = File::new();
    let keeper = Keeper::of(&file);
    let study = keeper.ask(&long()).await.json();
    assert_eq!(keeper.delete(&study).await, 204);
    let cancelled = keeper.0.get(&place(&study)).await.found();
    assert_eq!(cancelled["state"], "cancelled");
    keeper.end();
    let keeper = Keeper::of(&file);
    assert_eq!(keeper.0.get(&place(&study)).await.found(), cancelled);
    assert!(keeper.wait_for(&long()).await["result"] == *undisturbed_result().await);
    assert_eq!(keeper.delete(&study).await, 204);
    keeper.0.get(&place(&study)).await.refused(404, "not_found");
    keeper.end();
    let keeper = Keeper::of(&file);
    assert_eq!(keeper.delete(&study).await, 404);
}

/// Each damaged result is refused. A running study is computed again or refused.
#[tokio::test]
async fn damaged_file_never_gives_wrong_number() {
    let file = File::new();
    let keeper = Keeper::of(&file);
    let study = keeper.wait_for(&map(500)).await;
    keeper.end();
    let whole = fs::read(&file.0).unwrap();
    for damage in [
        "UPDATE parts SET part = zeroblob(length(part)) WHERE chunk = 7",
        "UPDATE parts SET part = (SELECT part FROM parts WHERE chunk = 8) WHERE chunk = 7",
        "UPDATE parts SET chunk = 1000 WHERE chunk = 0",
        "DELETE FROM parts WHERE chunk = 3",
    ] {
        assert_eq!(file.change(damage), 1, "{damage}");
        let keeper = Keeper::of(&file);
        let problem = keeper.0.get(&result(&study)).await.refused(500, "internal_error");
        assert!(problem["detail"].as_str().unwrap().contains("damaged"), "{damage}: {problem}");
        // The advice in the problem restores the study.
        assert_eq!(keeper.delete(&study).await, 204);
        assert_eq!(keeper.wait_for(&map(500)).await, study);
        keeper.end();
        fs::write(&file.0, &whole).unwrap();
    }
}

#[tokio::test]
async fn study_with_damaged_document_is_removed() {
    let file = File::new();
    let keeper = Keeper::of(&file);
    let study = keeper.wait_for(&map(5)).await;
    keeper.end();
    let damage = "UPDATE studies SET document = CAST(replace(CAST(document AS TEXT), '3.0', '3.5') AS BLOB)";
    assert_eq!(file.change(damage), 1);
    let keeper = Keeper::of(&file);
    keeper.0.get(&result(&study)).await.refused(404, "not_found");
    assert_eq!(keeper.wait_for(&map(5)).await, study);
    keeper.end();
}

/// SQLite itself detects that these pages are broken.
#[tokio::test]
async fn broken_pages_are_a_problem() {
    let file = File::new();
    let keeper = Keeper::of(&file);
    let study = keeper.wait_for(&map(5000)).await;
    keeper.end();
    let mut bytes = fs::read(&file.0).unwrap();
    let length = bytes.len();
    bytes[length / 2..].fill(0x5a);
    fs::write(&file.0, bytes).unwrap();
    let keeper = Keeper::of(&file);
    keeper.0.get(&result(&study)).await.refused(500, "internal_error");
    keeper.end();
}

#[tokio::test]
async fn parts_of_another_build_are_computed_again() {
    let file = File::new();
    let keeper = Keeper::of(&file);
    let (running, done) = (keeper.wait_for(&map(500)).await, keeper.wait_for(&map(5)).await);
    keeper.end();
    // Another build gives the same study another id.
    let id = running["id"].as_str().unwrap();
    file.change(&format!("UPDATE studies SET id = 'other', state = 'running' WHERE id = '{id}'"));
    file.change(&format!("UPDATE parts SET study = 'other' WHERE study = '{id}'"));
    file.change("UPDATE studies SET origin = 'another'");
    let keeper = Keeper::of(&file);
    // A finished study's result would have other bits in this build.
    keeper.0.get(&place(&done)).await.refused(404, "not_found");
    while keeper.0.get("/v1/studies/other").await.found()["state"] == "running" {
        tokio::task::yield_now().await;
    }
    assert_eq!(keeper.0.get("/v1/studies/other/result").await.found(), running["result"]);
    keeper.end();
    assert_eq!(file.change("DELETE FROM parts WHERE study <> 'other'"), 0);
    // The next start finds a complete study.
    let keeper = Keeper::of(&file);
    assert_eq!(keeper.0.get("/v1/studies/other/result").await.found(), running["result"]);
    keeper.end();
}

#[tokio::test]
async fn reading_a_study_delays_its_expiry() {
    for read in ["", "/result", "/events"] {
        let file = File::new();
        let age = |seconds: u64| file.change(&format!("UPDATE studies SET asked_at_s = asked_at_s - {seconds}"));
        let keeper = Keeper::of(&file);
        let (asked, left) = (keeper.wait_for(&map(5)).await, keeper.wait_for(&map(6)).await);
        keeper.end();
        age(EXPIRY_S / 2);
        let keeper = Keeper::of(&file);
        assert_eq!(keeper.0.get(&format!("{}{read}", place(&asked))).await.status, 200);
        keeper.end();
        age(EXPIRY_S / 2 + 1);
        let keeper = Keeper::of(&file);
        keeper.0.get(&place(&left)).await.refused(404, "not_found");
        assert_eq!(keeper.0.get(&place(&asked)).await.found()["state"], "done", "{read}");
        keeper.end();
    }
}

#[tokio::test]
async fn stored_study_outlives_smaller_limits() {
    let file = File::new();
    let keeper = Keeper::of(&file);
    let done = keeper.wait_for(&map(5)).await;
    keeper.ask(&long()).await;
    keeper.end();
    let keeper = Keeper::within(&file, Limits { max_states: 10, ..LIMITS });
    assert_eq!(keeper.0.get(&result(&done)).await.found(), done["result"]);
    keeper.0.until("toothwave_studies_running", 1.0);
    keeper.end();
}

#[tokio::test]
async fn service_without_studies_says_so() {
    let service = Service::with(LIMITS, &["--studies", "off"]);
    let problem = service.ask(&waiting(&map(5))).await.refused(501, "studies_off");
    assert!(problem["detail"].as_str().unwrap().contains("--studies off"), "{problem}");
    service.get("/v1/studies/any").await.refused(501, "studies_off");
}
