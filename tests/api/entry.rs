//! Keys, settings and host names.

use std::io::{Read as _, Write as _};
use std::net::TcpStream;
use std::path::PathBuf;
use std::process::Command;
use std::sync::atomic::{AtomicUsize, Ordering};

use crate::asking::{ENDPOINTS, LIMITS, Question, Service, ask_at};
use crate::designs::shortest;
use crate::serving::Process;

/// Makes a key and its line of a keys file with the command line.
pub(crate) fn new_key(name: &str) -> (String, String) {
    let output = Command::new(env!("CARGO_BIN_EXE_toothwave")).args(["new-key", name]).output().unwrap();
    let text = String::from_utf8(output.stdout).unwrap();
    let mut values = text.lines().map(|line| line.split_once(':').unwrap().1.trim().to_owned());
    (values.next().unwrap(), values.next().unwrap())
}

/// A temporary keys file.
pub(crate) struct KeysFile(PathBuf);

impl KeysFile {
    pub(crate) fn of(text: &str) -> Self {
        static FILES: AtomicUsize = AtomicUsize::new(0);
        let name = format!("keys-{}-{}", std::process::id(), FILES.fetch_add(1, Ordering::Relaxed));
        let path = std::path::Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
        std::fs::write(&path, text).unwrap();
        Self(path)
    }

    pub(crate) fn path(&self) -> &str {
        self.0.to_str().unwrap()
    }
}

impl Drop for KeysFile {
    fn drop(&mut self) {
        let _ = std::fs::remove_file(&self.0);
    }
}

const OTHERS: [&str; 5] = ["/v1/limits", "/v1/examples", "/metrics", "/openapi.json", "/docs/"];

#[tokio::test]
async fn keys_guard_all_but_health_and_page() {
    let (key, line) = new_key("a team");
    let file = KeysFile::of(&line);
    let service = Service::with(LIMITS, &["--keys-file", file.path()]);
    // The page asks for the key itself and holds nothing secret.
    for path in ["/health/live", "/health/ready", "/", "/page/main.js"] {
        assert_eq!(service.get(path).await.status, 200);
    }
    let posts = ENDPOINTS.map(|path| Question::post(path, shortest().to_string()));
    for question in OTHERS.map(|path| Question::of("GET", path)).into_iter().chain(posts) {
        let closed = service.ask(&question).await;
        assert_eq!(closed.header("www-authenticate"), "Bearer");
        closed.refused(401, "unauthorized");
        for authorization in ["Bearer tw_0", "Basic dXNlcjpwYXNz", "Bearer", &key] {
            service.ask(&question.clone().with("authorization", authorization)).await.refused(401, "unauthorized");
        }
        let open = service.ask(&question.with("authorization", &format!("bearer {key}"))).await;
        assert_eq!(open.status, 200);
    }
    // An unauthorized client cannot learn which paths exist.
    for path in ["/nowhere", "/page", "/pages/main.js"] {
        service.get(path).await.refused(401, "unauthorized");
    }
}

#[test]
fn wrong_setting_is_named_at_exit() {
    for (variable, value, named) in [
        ("TOOTHWAVE_MAX_STATES", "many", "max-states"),
        ("TOOTHWAVE_MAX_CONCURRENT_SOLVES", "0", "max-concurrent-solves"),
        ("TOOTHWAVE_KEYS_FILE", "/no/such/file", "keys-file"),
        ("TOOTHWAVE_CORS_ORIGINS", "example.com", "example.com"),
        ("TOOTHWAVE_LOG", "=/=", "log filter"),
    ] {
        let mut command = Command::new(env!("CARGO_BIN_EXE_toothwave"));
        let output = command.args(["serve", "--listen", "127.0.0.1:0"]).env(variable, value).output().unwrap();
        let stderr = String::from_utf8(output.stderr).unwrap();
        assert!(output.status.code() == Some(2) && stderr.contains(named), "{named}: {stderr}");
    }
}

#[test]
fn wrong_setting_breaks_no_other_command() {
    let command = |arguments: &[&str]| {
        Command::new(env!("CARGO_BIN_EXE_toothwave"))
            .args(arguments)
            .env("TOOTHWAVE_KEYS_FILE", "/no/such/file")
            .output()
            .unwrap()
    };
    assert!(command(&["openapi"]).status.success());
    assert_eq!(command(&[]).status.code(), Some(2));
}

#[test]
fn hang_up_reads_keys_again() {
    let ((old, old_line), (new, new_line)) = (new_key("old"), new_key("new"));
    let file = KeysFile::of(&old_line);
    let process = Process::started(&["serve", "--keys-file", file.path()]);
    let status = |key: &str| {
        let limits = Question::of("GET", "/v1/limits");
        ask_at(process.address, &limits.with("authorization", &format!("Bearer {key}"))).status
    };
    assert_eq!((status(&old), status(&new)), (200, 401));
    std::fs::write(file.path(), new_line).unwrap();
    process.signalled("-HUP");
    while status(&new) != 200 {}
    assert_eq!(status(&old), 401);
    std::fs::write(file.path(), "not a key").unwrap();
    process.signalled("-HUP");
    assert_eq!(status(&new), 200);
}

#[test]
fn local_service_rejects_foreign_host_names() {
    let process = Process::started(&["serve"]);
    let status = |host: &str| {
        let mut stream = TcpStream::connect(process.address).unwrap();
        stream.write_all(format!("GET /v1/limits HTTP/1.1\r\n{host}connection: close\r\n\r\n").as_bytes()).unwrap();
        let mut answer = String::new();
        stream.read_to_string(&mut answer).unwrap();
        (answer[9..12].to_owned(), answer)
    };
    for host in ["localhost", "LOCALHOST:8080", "127.0.0.1", "127.0.0.1:1", "[::1]", "[::1]:8080"] {
        assert_eq!(status(&format!("host: {host}\r\n")).0, "200", "{host}");
    }
    let strangers = ["rebound.example", "localhost.example:8080", "10.0.0.1", "127.0.0.1.example", ""];
    // None of these is a valid name.
    let malformed =
        ["[::1]rebound.example", "rebound.example@127.0.0.1", "127.0.0.1:x", "localhost\r\nhost: rebound.example"];
    for host in strangers.into_iter().chain(malformed) {
        let (status, answer) = status(&format!("host: {host}\r\n"));
        assert!(status == "421" && answer.contains("\"misdirected_request\""), "{host}: {answer}");
    }
}
