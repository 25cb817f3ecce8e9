//! The process of the service: start, requests and stop.

use std::io::{BufRead as _, BufReader};
use std::net::{SocketAddr, TcpListener};
use std::process::{Child, ChildStdout, Command, ExitStatus, Stdio};
use std::time::Duration;

use serde_json::{Value, json};

use crate::asking::{LIMITS, Question, ask_at};
use crate::designs::{shortest, with};

/// A running service that ends with the test.
#[derive(Debug)]
pub(crate) struct Process {
    pub(crate) child: Child,
    pub(crate) address: SocketAddr,
    /// Kept open, because the process fails if it greets into a closed pipe.
    _greeting: BufReader<ChildStdout>,
}

impl Process {
    /// Starts a process with these arguments on a free port, which its greeting names.
    pub(crate) fn started(arguments: &[&str]) -> Self {
        Self::logging(&[arguments, &["--log", "off"]].concat(), Stdio::null())
    }

    /// Starts a process with its log at the default level.
    pub(crate) fn logging(arguments: &[&str], log: Stdio) -> Self {
        Self::of(Command::new(env!("CARGO_BIN_EXE_toothwave")).args(arguments), log)
    }

    /// Starts a process with this command.
    pub(crate) fn of(command: &mut Command, log: Stdio) -> Self {
        command.args(["--listen", "127.0.0.1:0"]);
        let mut child = command.stdin(Stdio::null()).stdout(Stdio::piped()).stderr(log).spawn().unwrap();
        let mut greeting = BufReader::new(child.stdout.take().unwrap());
        let mut line = String::new();
        greeting.read_line(&mut line).unwrap();
        let address = line.trim().rsplit_once("http://").map(|(_, address)| address.parse().unwrap());
        Self { child, address: address.unwrap_or_else(|| panic!("no address in {line:?}")), _greeting: greeting }
    }

    pub(crate) fn signalled(&self, signal: &str) {
        let status = Command::new("kill").args([signal, &self.child.id().to_string()]).status().unwrap();
        assert!(status.success());
    }

    /// Waits for the exit status. Fails if the process does not end.
    pub(crate) fn ended(mut self) -> ExitStatus {
        for _ in 0..60_000 {
            if let Some(status) = self.child.try_wait().unwrap() {
                return status;
            }
            std::thread::sleep(Duration::from_millis(5));
        }
        panic!("the process does not end");
    }
}

impl Drop for Process {
    fn drop(&mut self) {
        // The process may have ended already.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

fn sweep(samples: u32) -> Question {
    Question::post("/v1/sweep", with(&shortest(), "/sweep", json!({ "samples": samples })).to_string())
}

#[test]
fn serves_with_and_without_subcommand_serve() {
    for arguments in [&["serve"][..], &[]] {
        let process = Process::started(arguments);
        ask_at(process.address, &sweep(50)).found();
        assert_eq!(ask_at(process.address, &Question::of("GET", "/health/ready")).status, 200);
        assert!(
            ask_at(process.address, &Question::of("GET", "/metrics")).text().contains("toothwave_http_requests_total")
        );
    }
}

#[test]
fn settings_become_limits() {
    let arguments = [
        "serve",
        "--max-body-bytes",
        "1000",
        "--max-states",
        "2000",
        "--max-concurrent-solves",
        "4",
        "--deadline-ms",
        "6000",
        "--cache-max-bytes",
        "7000",
        "--max-unread-bytes",
        "11000",
    ];
    let process = Process::started(&arguments);
    let limits = ask_at(process.address, &Question::of("GET", "/v1/limits")).found();
    for (name, value) in [
        ("max_body_bytes", 1000),
        ("max_states", 2000),
        ("max_profile_points", 2000),
        ("max_concurrent_solves", 4),
        ("max_queued_solves", 32),
        ("max_concurrent_batches", 16),
        ("max_concurrent_studies", 4),
        ("deadline_ms", 6000),
        ("cache_max_bytes", 7000),
        ("max_unread_bytes", 11_000),
        ("max_connections", 1024),
        ("header_timeout_ms", 30_000),
    ] {
        assert_eq!(limits[name], value, "{name}");
    }
}

#[test]
fn named_origin_may_call_from_browser() {
    let process = Process::started(&["serve", "--cors-origin", "https://one.example,https://two.example"]);
    let answer = ask_at(process.address, &sweep(50).with("origin", "https://two.example"));
    assert_eq!(answer.header("access-control-allow-origin"), "https://two.example");
}

#[test]
fn each_request_logs_one_line_without_design_numbers() {
    let path = std::path::Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("log-{}", std::process::id()));
    let process = Process::logging(&["serve"], std::fs::File::create(&path).unwrap().into());
    // No other number contains this torque.
    let design = with(&shortest(), "/load/input_torque_nm", json!(17.931)).to_string();
    let question = Question::post("/v1/sweep", design).with("x-request-id", "drawing-4711");
    for _ in 0..2 {
        ask_at(process.address, &question).found();
    }
    ask_at(process.address, &Question::post("/v1/sweep", r#"{"drive": 17.931}"#)).problem();
    process.signalled("-TERM");
    assert_eq!(process.ended().code(), Some(0));
    let log = std::fs::read_to_string(&path).unwrap();
    std::fs::remove_file(&path).unwrap();
    assert!(!log.contains("17.931") && !log.contains("17931"), "{log}");
    let lines = log.lines().map(|line| serde_json::from_str::<Value>(line).unwrap());
    let requests: Vec<_> = lines.filter(|line| line["fields"]["message"] == "request").collect();
    let [miss, hit, refused] = requests.as_slice() else { panic!("{log}") };
    for (line, cache) in [(miss, "miss"), (hit, "hit")] {
        let (fields, span) = (&line["fields"], &line["span"]);
        assert_eq!((&fields["method"], &fields["route"]), (&json!("POST"), &json!("/v1/sweep")), "{line}");
        assert_eq!((&fields["status"], &fields["cache"]), (&json!(200), &json!(cache)), "{line}");
        assert!(fields["solve_ms"].is_f64() && fields["elapsed_ms"].is_f64(), "{line}");
        assert_eq!(span["id"], "drawing-4711", "{line}");
        assert_eq!(
            (span["design"].as_str().map(str::len), &span["design"]),
            (Some(32), &miss["span"]["design"]),
            "{line}"
        );
    }
    assert_eq!(hit["fields"]["solve_ms"], miss["fields"]["solve_ms"]);
    assert_eq!((&refused["fields"]["status"], &refused["fields"]["cache"]), (&json!(422), &Value::Null), "{refused}");
}

#[test]
fn terminated_process_exits_with_0() {
    for signal in ["-TERM", "-INT"] {
        let process = Process::started(&["serve"]);
        ask_at(process.address, &sweep(50)).found();
        process.signalled(signal);
        assert_eq!(process.ended().code(), Some(0), "{signal}");
    }
}

#[test]
fn running_request_is_answered_before_exit() {
    let process = Process::started(&["serve", "--deadline-ms", "600000", "--shutdown-ms", "600000"]);
    let address = process.address;
    let asker = std::thread::spawn(move || ask_at(address, &sweep(30_000)));
    // Waits until the solve has begun. A fast solve answers before the signal, which is fine too.
    for _ in 0..10_000 {
        let metrics = ask_at(address, &Question::of("GET", "/metrics"));
        if metrics.text().contains("toothwave_solves_running 1") || asker.is_finished() {
            break;
        }
    }
    process.signalled("-TERM");
    let answer = asker.join().unwrap();
    assert_eq!(answer.status, 200);
    assert!(answer.body.ends_with(b"}"), "whole");
    assert_eq!(process.ended().code(), Some(0));
}

#[test]
fn used_address_is_an_error_naming_it() {
    let taken = TcpListener::bind("127.0.0.1:0").unwrap();
    let address = taken.local_addr().unwrap().to_string();
    let output = Command::new(env!("CARGO_BIN_EXE_toothwave")).args(["serve", "--listen", &address]).output().unwrap();
    assert!(!output.status.success());
    let stderr = String::from_utf8(output.stderr).unwrap();
    assert!(stderr.contains(&address), "{stderr}");
}

#[test]
fn huge_limit_does_not_panic() {
    let taken = TcpListener::bind("127.0.0.1:0").unwrap();
    let address = taken.local_addr().unwrap().to_string();
    for limit in ["--max-states", "--max-concurrent-solves"] {
        // The limit may be refused or accepted, but the used address ends the process.
        let arguments = ["serve", "--listen", &address, limit, "18446744073709551615"];
        let output = Command::new(env!("CARGO_BIN_EXE_toothwave")).args(arguments).output().unwrap();
        assert!(matches!(output.status.code(), Some(1 | 2)), "{limit}: {:?}", output.status);
    }
}

#[test]
fn body_over_limit_is_refused_over_connection() {
    let process = Process::started(&["serve"]);
    let question = Question::post("/v1/sweep", " ".repeat(LIMITS.max_body_bytes + 1));
    let problem = ask_at(process.address, &question).refused(413, "body_too_large");
    assert!(problem["detail"].as_str().unwrap().contains("65537"), "{problem}");
}
