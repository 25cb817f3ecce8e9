//! Who may come in, and how much of a connection anyone gets.

use std::io::{Read as _, Write as _};
use std::net::TcpStream;
use std::process::Command;

use toothwave::keys::{Keys, new_key};

use crate::asking::{ENDPOINTS, Question, Service, ask_at};
use crate::designs::shortest;
use crate::serving::Process;

const OTHERS: [&str; 5] = ["/v1/limits", "/v1/examples", "/metrics", "/openapi.json", "/docs/"];

#[tokio::test]
async fn with_keys_every_path_but_health_and_the_page_wants_one() {
    let (key, line) = new_key("a team").unwrap();
    let service = Service::behind(&line);
    // The page asks for the key itself; it holds nothing secret.
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
    // Nor does it tell strangers what stands where.
    for path in ["/nowhere", "/page", "/pages/main.js"] {
        service.get(path).await.refused(401, "unauthorized");
    }
}

#[test]
fn a_new_key_opens_what_its_line_stands_in_and_the_line_does_not_tell_it() {
    let ((key, line), (other, _)) = (new_key("one").unwrap(), new_key("two").unwrap());
    assert!(Keys::parse(&format!("# a team's\n\n{line}\n")).is_ok());
    assert!(!line.contains(&key) && key != other && key.len() >= 64);
}

#[test]
fn a_keys_file_without_a_key_or_with_something_else_is_refused() {
    assert!(Keys::parse("").is_err() && Keys::parse("# none\n").is_err());
    assert!(Keys::parse("secret one").unwrap_err().contains("line 1"));
}

#[test]
fn a_keys_file_that_is_none_or_is_too_large_is_refused() {
    for never_ends in ["/dev/zero", "/dev/stdin", "."] {
        assert!(Keys::read(never_ends).unwrap_err().contains("regular file"), "{never_ends}");
    }
    let file = std::path::Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("large-keys-{}", std::process::id()));
    std::fs::File::create(&file).unwrap().set_len(5 << 20).unwrap();
    assert!(Keys::read(file.to_str().unwrap()).unwrap_err().contains("at most"));
    std::fs::remove_file(&file).unwrap();
}

#[test]
fn all_that_is_wrong_with_the_settings_is_said_at_once() {
    let output = Command::new(env!("CARGO_BIN_EXE_toothwave"))
        .args(["serve", "--listen", "127.0.0.1:0"])
        .envs([
            ("TOOTHWAVE_MAX_STATES", "many"),
            ("TOOTHWAVE_MAX_CONNECTIONS", "0"),
            ("TOOTHWAVE_KEYS_FILE", "/no/such/file"),
            ("TOOTHWAVE_CORS_ORIGINS", "example.com"),
            ("TOOTHWAVE_LOG", "=/="),
        ])
        .output()
        .unwrap();
    assert_eq!(output.status.code(), Some(2));
    let stderr = String::from_utf8(output.stderr).unwrap();
    for named in ["max-states", "max-connections", "keys-file", "example.com", "log filter"] {
        assert!(stderr.contains(named), "{named}: {stderr}");
    }
}

/// What comes back before the connection is closed.
fn whole(mut stream: TcpStream) -> String {
    let mut bytes = Vec::new();
    // A reset ends it too.
    let _ = stream.read_to_end(&mut bytes);
    String::from_utf8_lossy(&bytes).into_owned()
}

#[test]
fn a_head_that_trickles_in_is_not_waited_for() {
    let process = Process::started(&["serve", "--header-timeout-ms", "50"]);
    let mut stream = TcpStream::connect(process.address).unwrap();
    stream.write_all(b"POST /v1/sweep HTTP/1.1\r\nhost: t").unwrap();
    let answer = whole(stream);
    assert!(answer.is_empty() || answer.starts_with("HTTP/1.1 408"), "{answer}");
}

#[test]
fn a_connection_on_which_nobody_says_anything_is_closed() {
    let process = Process::started(&["serve", "--header-timeout-ms", "50"]);
    assert_eq!(whole(TcpStream::connect(process.address).unwrap()), "");
}

#[test]
fn a_head_larger_than_may_be_is_refused() {
    let process = Process::started(&["serve"]);
    let long = Question::of("GET", "/health/live").with("x-long", &"x".repeat(50_000));
    assert_eq!(ask_at(process.address, &long).status, 431);
}

#[test]
fn a_connection_too_many_is_told_so_and_one_that_is_closed_makes_room() {
    let process = Process::started(&["serve", "--max-connections", "2"]);
    let held: Vec<_> = (0..2)
        .map(|_| {
            let mut stream = TcpStream::connect(process.address).unwrap();
            stream.write_all(b"GET /health/live HTTP/1.1\r\nhost: localhost\r\n\r\n").unwrap();
            let mut some = [0; 8];
            stream.read_exact(&mut some).unwrap();
            stream
        })
        .collect();
    let limits = Question::of("GET", "/v1/limits");
    let refused = ask_at(process.address, &limits);
    assert_eq!((refused.header("retry-after"), refused.header("connection")), ("1", "close"));
    refused.refused(503, "too_many_connections");
    drop(held);
    // The service learns of it in its own time.
    assert!((0..10_000).any(|_| ask_at(process.address, &limits).status == 200));
}

#[test]
fn a_client_that_never_asked_holds_up_no_shutdown() {
    let process = Process::started(&["serve", "--shutdown-ms", "600000"]);
    let mut stalled = TcpStream::connect(process.address).unwrap();
    stalled.write_all(b"POST /v1/sweep HTTP/1.1\r\nhost:").unwrap();
    process.signalled("-TERM");
    assert_eq!(process.ended().code(), Some(0));
}

#[test]
fn a_solve_that_outlasts_the_shutdown_is_told_so() {
    let process =
        Process::started(&["serve", "--shutdown-ms", "1", "--deadline-ms", "600000", "--max-states", "100000000"]);
    let (address, designs) =
        (process.address, crate::designs::with(&shortest(), "/sweep", serde_json::json!({ "samples": 10_000_000 })));
    let asker = std::thread::spawn(move || ask_at(address, &Question::post("/v1/sweep", designs.to_string())));
    while !ask_at(address, &Question::of("GET", "/metrics")).text().contains("toothwave_solves_running 1") {}
    process.signalled("-TERM");
    asker.join().unwrap().refused(503, "shutting_down");
    assert_eq!(process.ended().code(), Some(0));
}

#[test]
fn a_fault_in_the_settings_is_none_of_another_command() {
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
