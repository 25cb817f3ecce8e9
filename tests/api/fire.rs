//! The service under fire: what it is given to wait for, it does not wait for.

use std::fs::File;
use std::io::{Read as _, Write as _};
use std::net::{Shutdown, SocketAddr, TcpStream};
use std::process::{Command, Stdio};
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Arc, Barrier};
use std::time::Duration;

use axum::body::{Body, Bytes};
use axum::http::Request;
use serde_json::{Value, json};
use socket2::{Domain, Socket, Type};
use toothwave::keys::new_key;

use crate::asking::{Question, Service, ask_at};
use crate::designs::{shortest, with};
use crate::serving::Process;

fn live() -> Question {
    Question::of("GET", "/health/live")
}

fn metric(address: SocketAddr, series: &str) -> f64 {
    let metrics = ask_at(address, &Question::of("GET", "/metrics"));
    let line = metrics.text().lines().find(|line| line.starts_with(&format!("{series} ")));
    line.unwrap_or_else(|| panic!("no {series} in {}", metrics.text())).rsplit_once(' ').unwrap().1.parse().unwrap()
}

/// A sweep that no test waits for.
fn endless() -> String {
    with(&shortest(), "/sweep", json!({ "samples": 10_000_000 })).to_string()
}

const ENDLESS: [&str; 5] = ["serve", "--deadline-ms", "600000", "--max-states", "100000000"];

/// Until a solve runs.
fn until_running(address: SocketAddr, solves: f64) {
    assert!((0..100_000).any(|_| metric(address, "toothwave_solves_running") == solves), "never {solves} solves");
}

/// A file of its own for a test.
fn scratch(name: &str) -> std::path::PathBuf {
    std::path::Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("{name}-{}", std::process::id()))
}

// --- The log

#[test]
fn a_log_on_a_full_device_stops_nothing_and_is_counted() {
    let full = File::options().write(true).open("/dev/full").unwrap();
    let process = Process::logging(&["serve"], full.into());
    for _ in 0..3 {
        assert_eq!(ask_at(process.address, &live()).status, 200);
    }
    assert!((0..10_000).any(|_| metric(process.address, "toothwave_log_lines_lost_total") >= 3.0));
    process.signalled("-TERM");
    assert_eq!(process.ended().code(), Some(0));
}

#[test]
fn a_log_whose_reader_has_gone_stops_nothing_and_is_counted() {
    let mut process = Process::logging(&["serve"], Stdio::piped());
    drop(process.child.stderr.take());
    for _ in 0..3 {
        assert_eq!(ask_at(process.address, &live()).status, 200);
    }
    assert!((0..10_000).any(|_| metric(process.address, "toothwave_log_lines_lost_total") >= 3.0));
    process.signalled("-TERM");
    assert_eq!(process.ended().code(), Some(0));
}

/// A pipe holds 64 KiB, some 250 lines.
#[test]
fn a_log_whose_reader_is_stuck_stops_nothing_and_what_does_not_fit_is_counted() {
    let process = Process::logging(&["serve"], Stdio::piped());
    let mut stream = TcpStream::connect(process.address).unwrap();
    let asked = b"GET /health/live HTTP/1.1\r\nhost: localhost\r\n\r\n".repeat(100);
    let mut buffer = [0; 1 << 16];
    let mut lost = 0.0;
    for _ in 0..300 {
        stream.write_all(&asked).unwrap();
        let mut answers = 0;
        while answers < 100 {
            let read = stream.read(&mut buffer).unwrap();
            assert!(read > 0, "the connection was closed");
            answers += buffer[..read].windows(5).filter(|word| word == b"live\n").count();
        }
        lost = metric(process.address, "toothwave_log_lines_lost_total");
        if lost > 0.0 {
            break;
        }
    }
    assert!(lost > 0.0);
    process.signalled("-TERM");
    assert_eq!(process.ended().code(), Some(0));
}

#[test]
fn a_log_in_a_file_that_is_as_large_as_it_may_be_stops_nothing_and_is_counted() {
    let file = scratch("as-large-as-it-may-be");
    let mut command = Command::new("sh");
    command.args(["-c", "ulimit -f 4; exec \"$0\" serve \"$@\"", env!("CARGO_BIN_EXE_toothwave")]);
    let process = Process::of(&mut command, File::create(&file).unwrap().into());
    assert!((0..10_000).any(|_| metric(process.address, "toothwave_log_lines_lost_total") >= 3.0));
    process.signalled("-TERM");
    assert_eq!(process.ended().code(), Some(0));
    std::fs::remove_file(&file).unwrap();
}

// --- Connections

/// A connection that was served once and says nothing more.
fn idle(address: SocketAddr) -> TcpStream {
    let mut stream = TcpStream::connect(address).unwrap();
    stream.write_all(b"GET /health/live HTTP/1.1\r\nhost: localhost\r\n\r\n").unwrap();
    assert!(stream.read(&mut [0; 512]).unwrap() > 0);
    stream
}

fn held_to(limit: &str, arguments: &[&str]) -> Process {
    let mut command = Command::new("sh");
    command.args(["-c", &format!("ulimit {limit}; exec \"$0\" \"$@\""), env!("CARGO_BIN_EXE_toothwave")]);
    Process::of(command.args(arguments).args(["--log", "off"]), Stdio::null())
}

#[test]
fn where_the_process_may_open_few_files_it_admits_fewer_connections_and_refuses_the_others_at_once() {
    let process = held_to("-n 200", &["serve"]);
    let limits = ask_at(process.address, &Question::of("GET", "/v1/limits")).found();
    assert_eq!(limits["max_connections"], 200 - 128);
    // More than there are files.
    let silent: Vec<_> = (0..400).map(|_| TcpStream::connect(process.address).unwrap()).collect();
    for _ in 0..5 {
        assert_eq!(ask_at(process.address, &live()).status, 200);
        ask_at(process.address, &Question::of("GET", "/v1/limits")).refused(503, "too_many_connections");
    }
    drop(silent);
}

#[test]
fn where_the_process_may_open_too_few_files_for_a_connection_it_does_not_start() {
    let script = "ulimit -n 128; exec \"$0\" serve --listen 127.0.0.1:0";
    let ended = Command::new("timeout").args(["60", "sh", "-c", script, env!("CARGO_BIN_EXE_toothwave")]).output();
    let ended = ended.unwrap();
    assert_eq!(ended.status.code(), Some(1));
    let said = String::from_utf8(ended.stderr).unwrap();
    assert!(said.contains("the process may open 128 files: 128, and one for each connection, are wanted"), "{said}");
}

#[test]
fn a_limit_of_files_that_the_process_may_raise_itself_is_raised() {
    let process = held_to("-S -n 100", &["serve"]);
    let limits = ask_at(process.address, &Question::of("GET", "/v1/limits")).found();
    assert_eq!(limits["max_connections"], 1024);
}

#[test]
fn what_a_process_may_not_take_of_the_memory_is_not_shared_out() {
    let process = held_to("-v 1000000", &["serve"]);
    let limits = ask_at(process.address, &Question::of("GET", "/v1/limits")).found();
    // But for 64 MiB, which are nobody's.
    let shared_bytes = 1_024_000_000 - (64 << 20);
    assert_eq!(limits["max_unread_bytes"], shared_bytes / 2);
    assert_eq!(limits["cache_max_bytes"], shared_bytes / 8);
    assert_eq!(limits["max_connections"], 1_024_000_000 / (2 << 20));
}

/// One page of two megabytes for each touched one of four kilobytes is memory that nobody counts.
#[test]
fn where_the_memory_is_small_its_pages_are() {
    let process = held_to("-v 1000000", &["serve"]);
    let status = std::fs::read_to_string(format!("/proc/{}/status", process.child.id())).unwrap();
    // Kernels before 5.0 do not say.
    assert!(!status.contains("THP_enabled:\t1"), "{status}");
}

#[test]
fn where_all_connections_are_taken_health_and_metrics_answer_however_many_others_come_and_say_nothing() {
    let process = Process::started(&["serve", "--max-connections", "3"]);
    let held: Vec<_> = (0..3).map(|_| idle(process.address)).collect();
    let silent: Vec<_> = (0..300).map(|_| TcpStream::connect(process.address).unwrap()).collect();
    for path in ["/health/live", "/health/ready", "/metrics"] {
        assert_eq!(ask_at(process.address, &Question::of("GET", path)).status, 200, "{path}");
    }
    ask_at(process.address, &Question::of("GET", "/v1/limits")).refused(503, "too_many_connections");
    drop((held, silent));
}

#[test]
fn probes_in_a_burst_of_silent_connections_beyond_the_last_one_are_answered() {
    let process = Process::started(&["serve", "--max-connections", "3"]);
    let held: Vec<_> = (0..3).map(|_| idle(process.address)).collect();
    // So that all of the burst waits to be taken in at once.
    process.signalled("-STOP");
    let (mut probes, mut silent) = (Vec::new(), Vec::new());
    for _ in 0..10 {
        let mut probe = TcpStream::connect(process.address).unwrap();
        probe.write_all(b"GET /health/live HTTP/1.1\r\nhost: localhost\r\n\r\n").unwrap();
        probes.push(probe);
        silent.extend((0..80).map(|_| TcpStream::connect(process.address).unwrap()));
    }
    process.signalled("-CONT");
    for mut probe in probes {
        let mut answer = String::new();
        probe.read_to_string(&mut answer).unwrap();
        assert!(answer.starts_with("HTTP/1.1 200"), "{answer}");
    }
    drop((held, silent));
}

/// Where few files may be open, those beyond the last connection took them all before others were closed, and nobody was taken in for a while.
#[test]
fn a_burst_of_silent_connections_beyond_the_last_one_leaves_files_for_the_next() {
    let file = scratch("a-burst");
    let mut command = Command::new("sh");
    command.args(["-c", "ulimit -n 150; exec \"$0\" serve \"$@\"", env!("CARGO_BIN_EXE_toothwave")]);
    let process = Process::of(&mut command, File::create(&file).unwrap().into());
    let held: Vec<_> = (0..150 - 128).map(|_| idle(process.address)).collect();
    process.signalled("-STOP");
    let silent: Vec<_> = (0..800).map(|_| TcpStream::connect(process.address).unwrap()).collect();
    process.signalled("-CONT");
    assert_eq!(ask_at(process.address, &live()).status, 200);
    drop((held, silent));
    process.signalled("-TERM");
    assert_eq!(process.ended().code(), Some(0));
    let log = std::fs::read_to_string(&file).unwrap();
    assert!(!log.contains("no connection could be accepted"), "{log}");
    std::fs::remove_file(&file).unwrap();
}

#[test]
fn a_client_that_takes_less_than_the_least_of_its_answer_is_left() {
    let process = Process::started(&["serve", "--header-timeout-ms", "200"]);
    let document = with(&shortest(), "/sweep", json!({ "samples": 50_000 })).to_string();
    let stream = Socket::new(Domain::IPV4, Type::STREAM, None).unwrap();
    stream.set_recv_buffer_size(4096).unwrap();
    stream.connect(&process.address.into()).unwrap();
    let mut stream = TcpStream::from(stream);
    let head = format!(
        "POST /v1/sweep HTTP/1.1\r\nhost: localhost\r\ncontent-type: application/json\r\ncontent-length: {}\r\n\r\n",
        document.len()
    );
    stream.write_all(format!("{head}{document}").as_bytes()).unwrap();
    let mut some = [0; 1];
    stream.read_exact(&mut some).unwrap();
    while metric(process.address, "toothwave_connections") > 1.0 {}
    let mut rest = Vec::new();
    // Cut in any way.
    let _ = stream.read_to_end(&mut rest);
    // The system holds little of it back, so that the service sees what the client takes.
    assert!(rest.len() < 1_000_000, "{}", rest.len());
}

// --- Leaving

/// Asks for an endless sweep, with something behind the request, and leaves in some way while it runs.
fn leaves<T>(encoding: &str, behind: &str, leave: impl FnOnce(TcpStream) -> T) {
    let process = Process::started(&ENDLESS);
    let document = endless();
    let mut stream = TcpStream::connect(process.address).unwrap();
    let head = format!(
        "POST /v1/sweep HTTP/1.1\r\nhost: localhost\r\ncontent-type: application/json\r\naccept-encoding: {encoding}\r\ncontent-length: {}\r\n\r\n",
        document.len()
    );
    stream.write_all(format!("{head}{document}{behind}").as_bytes()).unwrap();
    until_running(process.address, 1.0);
    let _left = leave(stream);
    until_running(process.address, 0.0);
    assert_eq!(metric(process.address, "toothwave_cancellations_total"), 1.0);
}

#[test]
fn a_client_that_leaves_ends_its_solve() {
    leaves("identity", "", drop);
}

#[test]
fn a_client_that_says_that_it_sends_no_more_is_taken_for_gone() {
    leaves("identity", "", |stream| {
        stream.shutdown(Shutdown::Write).unwrap();
        stream
    });
}

#[test]
fn a_byte_of_another_request_does_not_hide_that_the_client_has_left() {
    leaves("gzip", "G", drop);
    leaves("identity", &"GET /health/live HTTP/1.1\r\n".repeat(3000), drop);
}

#[test]
fn a_body_that_breaks_off_is_bad_and_not_large() {
    let process = Process::started(&["serve"]);
    let mut stream = TcpStream::connect(process.address).unwrap();
    let head = "POST /v1/sweep HTTP/1.1\r\nhost: localhost\r\ncontent-type: application/json\r\ntransfer-encoding: chunked\r\n\r\n";
    stream.write_all(format!("{head}5\r\n{{\"dri\r\nno length\r\n").as_bytes()).unwrap();
    let mut answer = String::new();
    stream.read_to_string(&mut answer).unwrap();
    assert!(answer.starts_with("HTTP/1.1 400") && answer.contains("\"broken_body\""), "{answer}");
}

/// More than a connection holds by itself: whoever is answered at the head still has most of it to send.
#[test]
fn a_client_that_sends_its_whole_body_before_it_reads_learns_why_it_was_refused() {
    let process = Process::started(&["serve"]);
    let body = vec![b' '; 30_000_000];
    for (path, status) in [("/v1/sweep", 413), ("/v1/studies", 413), ("/v1/batch?typo", 400), ("/nowhere", 404)] {
        let mut stream = TcpStream::connect(process.address).unwrap();
        let head = format!("POST {path} HTTP/1.1\r\nhost: localhost\r\ncontent-type: application/json\r\n");
        stream.write_all(format!("{head}content-length: {}\r\n\r\n", body.len()).as_bytes()).unwrap();
        stream.write_all(&body).unwrap_or_else(|error| panic!("{path}: {error}"));
        let mut answer = String::new();
        stream.read_to_string(&mut answer).unwrap_or_else(|error| panic!("{path}: {error}"));
        assert!(answer.starts_with(&format!("HTTP/1.1 {status}")), "{path}: {answer}");
    }
}

#[test]
fn a_body_in_a_transfer_coding_that_nobody_undoes_is_not_taken_for_plain() {
    let process = Process::started(&["serve"]);
    let document = shortest().to_string();
    let status = |path: &str, coding: &str| {
        let mut stream = TcpStream::connect(process.address).unwrap();
        let media_type = if path == "/v1/batch" { "application/x-ndjson" } else { "application/json" };
        let head =
            format!("POST {path} HTTP/1.1\r\nhost: localhost\r\nconnection: close\r\ncontent-type: {media_type}");
        let body = format!("{:x}\r\n{document}\r\n0\r\n\r\n", document.len());
        stream.write_all(format!("{head}\r\ntransfer-encoding: {coding}\r\n\r\n{body}").as_bytes()).unwrap();
        let mut answer = String::new();
        stream.read_to_string(&mut answer).unwrap();
        answer[9..12].to_owned()
    };
    for path in ["/v1/coincidence-degree", "/v1/batch"] {
        assert_eq!(status(path, "chunked"), "200");
        assert_eq!(status(path, "Chunked"), "200");
        assert_eq!(status(path, "gzip, chunked"), "415");
        assert_eq!(status(path, "chunked, chunked"), "415");
    }
}

// --- Stopping

/// A client that asks again and again on a connection that it keeps, and makes another one only when it was told that this one ends. Returns how
/// many requests were answered, or what became of one that was not.
fn keeps_asking(address: SocketAddr, is_stopping: &AtomicBool) -> Result<usize, String> {
    let mut answered = 0;
    while let Ok(mut stream) = TcpStream::connect(address) {
        loop {
            stream
                .write_all(b"GET /v1/limits HTTP/1.1\r\nhost: localhost\r\n\r\n")
                .map_err(|error| error.to_string())?;
            let mut answer = [0; 4096];
            let read = stream.read(&mut answer).map_err(|error| error.to_string())?;
            let answer = String::from_utf8_lossy(&answer[..read]);
            if !answer.starts_with("HTTP/1.1 200") {
                return Err(format!("after {answered} answers: {answer:?}, stopping: {is_stopping:?}"));
            }
            answered += 1;
            if answer.contains("connection: close") {
                break;
            }
            std::thread::sleep(Duration::from_millis(5));
        }
        if is_stopping.load(Ordering::Relaxed) {
            // There is another replica to go to.
            break;
        }
    }
    Ok(answered)
}

#[test]
fn no_client_that_keeps_its_connection_loses_a_request_when_the_process_is_told_to_stop() {
    let process = Process::started(&["serve", "--lame-duck-ms", "1000"]);
    let (address, start) = (process.address, Arc::new(Barrier::new(21)));
    let is_stopping = Arc::new(AtomicBool::new(false));
    let clients: Vec<_> = (0..20)
        .map(|_| {
            let (start, is_stopping) = (Arc::clone(&start), Arc::clone(&is_stopping));
            std::thread::spawn(move || {
                start.wait();
                keeps_asking(address, &is_stopping)
            })
        })
        .collect();
    start.wait();
    process.signalled("-TERM");
    is_stopping.store(true, Ordering::Relaxed);
    for client in clients {
        assert!(client.join().unwrap().unwrap() > 0);
    }
    assert_eq!(process.ended().code(), Some(0));
}

/// Each is refused, and asks again at once, on and on: there is always one more that waits to be taken in.
#[test]
fn clients_that_keep_coming_hold_up_no_stop() {
    let process = Process::started(&["serve", "--max-connections", "4"]);
    let address = process.address;
    let held: Vec<_> = (0..4).map(|_| idle(address)).collect();
    let begun = Arc::new(AtomicUsize::new(0));
    let clients: Vec<_> = (0..250)
        .map(|_| {
            let begun = Arc::clone(&begun);
            std::thread::spawn(move || {
                while let Ok(mut stream) = TcpStream::connect(address) {
                    begun.fetch_add(1, Ordering::Relaxed);
                    // What becomes of it is none of this test's matter.
                    let _ = stream.write_all(b"GET /v1/limits HTTP/1.1\r\nhost: localhost\r\n\r\n");
                    let _ = stream.read(&mut [0; 512]);
                }
            })
        })
        .collect();
    while begun.load(Ordering::Relaxed) < 1000 {
        std::thread::yield_now();
    }
    process.signalled("-TERM");
    assert_eq!(process.ended().code(), Some(0));
    clients.into_iter().for_each(|client| client.join().unwrap());
    drop(held);
}

#[test]
fn a_process_that_is_told_twice_to_stop_ends_at_once() {
    for lame_duck_ms in ["0", "600000"] {
        let arguments = [&ENDLESS[..], &["--shutdown-ms", "600000", "--lame-duck-ms", lame_duck_ms]].concat();
        let process = Process::started(&arguments);
        let address = process.address;
        let asker = std::thread::spawn(move || {
            let mut stream = TcpStream::connect(address).unwrap();
            let document = endless();
            let head = "POST /v1/sweep HTTP/1.1\r\nhost: localhost\r\ncontent-type: application/json";
            stream
                .write_all(format!("{head}\r\ncontent-length: {}\r\n\r\n{document}", document.len()).as_bytes())
                .unwrap();
            let _ = stream.read_to_end(&mut Vec::new());
        });
        until_running(address, 1.0);
        process.signalled("-TERM");
        // The first one is taken up before the second one comes.
        while ask_at_any(address, "/health/ready") == Some(200) {}
        process.signalled("-INT");
        assert_eq!(process.ended().code(), Some(0));
        asker.join().unwrap();
    }
}

/// The status, if anybody listens.
fn ask_at_any(address: SocketAddr, path: &str) -> Option<u16> {
    let mut stream = TcpStream::connect(address).ok()?;
    stream.write_all(format!("GET {path} HTTP/1.1\r\nhost: localhost\r\nconnection: close\r\n\r\n").as_bytes()).ok()?;
    let mut answer = String::new();
    stream.read_to_string(&mut answer).ok()?;
    answer.split(' ').nth(1)?.parse().ok()
}

// --- Entry

#[test]
fn what_listens_on_this_machine_alone_answers_to_its_names_alone() {
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
    // None of these is a name.
    let malformed =
        ["[::1]rebound.example", "rebound.example@127.0.0.1", "127.0.0.1:x", "localhost\r\nhost: rebound.example"];
    for host in strangers.into_iter().chain(malformed) {
        let (status, answer) = status(&format!("host: {host}\r\n"));
        assert!(status == "421" && answer.contains("\"misdirected_request\""), "{host}: {answer}");
    }
}

#[tokio::test]
async fn a_query_that_a_path_does_not_know_is_refused() {
    let service = Service::new();
    for path in ["/v1/limits", "/v1/examples", "/v1/examples/paper-5.1", "/metrics", "/health/live", "/health/ready"] {
        service.get(&format!("{path}?pretty=1")).await.refused(400, "invalid_query");
        assert_eq!(service.get(&format!("{path}?")).await.status, 200, "{path}");
    }
    for path in crate::asking::ENDPOINTS {
        let question = Question::post(&format!("{path}?samples=7"), shortest().to_string());
        service.ask(&question).await.refused(400, "invalid_query");
    }
}

#[tokio::test]
async fn a_file_of_the_page_whose_name_is_no_text_is_not_found() {
    for name in ["/page/%FF", "/docs/%FF"] {
        Service::new().get(name).await.refused(404, "not_found");
    }
}

#[tokio::test]
async fn an_id_that_is_long_or_no_word_is_replaced() {
    let service = Service::new();
    for (id, is_kept) in
        [("a-b.c:1", true), (&*"x".repeat(128), true), (&*"x".repeat(129), false), ("two words", false), ("", false)]
    {
        let answer = service.ask(&live().with("x-request-id", id)).await;
        assert_eq!(answer.header("x-request-id") == id, is_kept, "{id}");
        assert!(!answer.header("x-request-id").is_empty());
    }
}

/// The lines that stand in a log once the process has ended.
fn requests_in(path: &std::path::Path) -> Vec<Value> {
    let log = std::fs::read_to_string(path).unwrap();
    std::fs::remove_file(path).unwrap();
    let lines = log.lines().map(|line| serde_json::from_str::<Value>(line).unwrap());
    lines.filter(|line| line["fields"]["message"] == "request").collect()
}

#[test]
fn a_requests_line_names_its_problem_its_key_its_caller_and_what_became_of_its_answer() {
    let (log, file) = (scratch("completion"), scratch("named-keys"));
    let (key, line) = new_key("drawing office").unwrap();
    std::fs::write(&file, line).unwrap();
    let process =
        Process::logging(&["serve", "--keys-file", file.to_str().unwrap()], File::create(&log).unwrap().into());
    let traceparent = "00-0af7651916cd43dd8448eb211c80319c-b7ad6b7169203331-01";
    let asked = Question::post("/v1/sweep", "{").with("authorization", &format!("Bearer {key}"));
    let refused = ask_at(process.address, &asked.clone().with("traceparent", traceparent));
    refused.refused(400, "malformed_json");
    let of_no_trace = format!("00-{}-b7ad6b7169203331-01", "0".repeat(32));
    for no_trace in ["no trace", &of_no_trace, &traceparent.replacen("00", "ff", 1)] {
        ask_at(process.address, &asked.clone().with("traceparent", no_trace));
    }
    let mut connection = TcpStream::connect(process.address).unwrap();
    connection.write_all(b"HEAD /health/live HTTP/1.1\r\nhost: 127.0.0.1\r\nconnection: close\r\n\r\n").unwrap();
    connection.read_to_end(&mut Vec::new()).unwrap();
    process.signalled("-TERM");
    assert_eq!(process.ended().code(), Some(0));
    std::fs::remove_file(&file).unwrap();
    let requests = requests_in(&log);
    let [first, without @ .., head] = requests.as_slice() else { panic!("{requests:?}") };
    assert_eq!((&first["fields"]["problem"], without.len()), (&json!("malformed_json"), 3));
    assert_eq!(
        (&first["fields"]["sent_bytes"], &first["fields"]["is_whole"]),
        (&json!(refused.body.len()), &json!(true))
    );
    assert!(first["fields"]["completed_ms"].as_f64() >= first["fields"]["elapsed_ms"].as_f64());
    assert_eq!((&first["span"]["key"], &first["span"]["traceparent"]), (&json!("drawing office"), &json!(traceparent)));
    assert!(without.iter().all(|line| line["span"]["traceparent"] == Value::Null), "{without:?}");
    assert_eq!((&head["fields"]["sent_bytes"], &head["fields"]["is_whole"]), (&json!(0), &json!(true)));
}

#[test]
fn a_request_whose_client_leaves_before_its_answer_has_a_line_too() {
    let log = scratch("leaver");
    let process = Process::logging(&["serve"], File::create(&log).unwrap().into());
    let over = json!({
        "/drive/teeth/radius_mm": { "min": 3.0, "max": 7.0, "steps": 1000 },
        "/load/input_torque_nm": { "min": 10.0, "max": 20.0, "steps": 1000 }
    });
    let study =
        json!({ "study": "map", "base": shortest(), "over": over, "quantities": ["peak_stress_ring_mpa"] }).to_string();
    let mut client = TcpStream::connect(process.address).unwrap();
    let head = "POST /v1/studies HTTP/1.1\r\nhost: localhost\r\nprefer: wait=600\r\nx-request-id: leaver\r\ncontent-type: application/json";
    write!(client, "{head}\r\ncontent-length: {}\r\n\r\n{study}", study.len()).unwrap();
    // It is waited for as soon as it runs.
    let begun =
        || ask_at(process.address, &Question::of("GET", "/metrics")).text().contains("toothwave_studies_running 1");
    while !begun() {}
    drop(client);
    let has_line = || std::fs::read_to_string(&log).unwrap().lines().any(|line| line.contains("leaver"));
    while !has_line() {
        std::thread::sleep(Duration::from_millis(10));
    }
    process.signalled("-TERM");
    assert_eq!(process.ended().code(), Some(0));
    let requests = requests_in(&log);
    let left: Vec<_> = requests.iter().filter(|line| line["span"]["id"] == "leaver").collect();
    let [line] = left.as_slice() else { panic!("{left:?}") };
    let fields = &line["fields"];
    assert_eq!((&fields["method"], &fields["route"]), (&json!("POST"), &json!("/v1/studies")));
    assert_eq!((&fields["status"], &fields["is_whole"]), (&Value::Null, &json!(false)));
}

#[test]
fn keys_are_read_again_when_the_process_is_told_so_and_a_file_that_is_wrong_changes_nothing() {
    let file = scratch("keys");
    let ((old, old_line), (new, new_line)) = (new_key("old").unwrap(), new_key("new").unwrap());
    std::fs::write(&file, old_line).unwrap();
    let process = Process::started(&["serve", "--keys-file", file.to_str().unwrap()]);
    let status = |key: &str| {
        let limits = Question::of("GET", "/v1/limits");
        ask_at(process.address, &limits.with("authorization", &format!("Bearer {key}"))).status
    };
    assert_eq!((status(&old), status(&new)), (200, 401));
    std::fs::write(&file, new_line).unwrap();
    process.signalled("-HUP");
    while status(&new) != 200 {}
    assert_eq!(status(&old), 401);
    std::fs::write(&file, "not a key").unwrap();
    process.signalled("-HUP");
    assert_eq!(status(&new), 200);
    std::fs::remove_file(&file).unwrap();
    process.signalled("-HUP");
    assert_eq!(status(&new), 200);
}

/// As one that a shell makes of a command's output.
#[test]
fn a_keys_file_that_has_become_a_pipe_nobody_writes_to_holds_nothing_up() {
    let file = scratch("keys-pipe");
    let ((old, old_line), (new, new_line)) = (new_key("old").unwrap(), new_key("new").unwrap());
    std::fs::write(&file, &old_line).unwrap();
    let process = Process::started(&["serve", "--keys-file", file.to_str().unwrap()]);
    let status = |key: &str| {
        let limits = Question::of("GET", "/v1/limits");
        ask_at(process.address, &limits.with("authorization", &format!("Bearer {key}"))).status
    };
    std::fs::remove_file(&file).unwrap();
    assert!(Command::new("mkfifo").arg(&file).status().unwrap().success());
    for _ in 0..10 {
        process.signalled("-HUP");
        for _ in 0..10 {
            assert_eq!(status(&old), 200);
        }
    }
    // Nobody waits for who writes to it.
    let tasks = format!("/proc/{}/task", process.child.id());
    let name = |task: std::io::Result<std::fs::DirEntry>| std::fs::read_to_string(task.ok()?.path().join("comm")).ok();
    while std::fs::read_dir(&tasks).unwrap().filter_map(name).any(|name| name.trim() == "keys") {}
    std::fs::remove_file(&file).unwrap();
    std::fs::write(&file, new_line).unwrap();
    process.signalled("-HUP");
    while status(&new) != 200 {}
    assert_eq!(status(&old), 401);
    process.signalled("-TERM");
    assert_eq!(process.ended().code(), Some(0));
    std::fs::remove_file(&file).unwrap();
}

#[test]
fn a_keys_file_that_anyone_may_read_is_warned_of() {
    use std::os::unix::fs::PermissionsExt as _;
    for (mode, is_warned) in [(0o644, true), (0o640, false)] {
        let (log, file) = (scratch("mode"), scratch("keys-of-mode"));
        std::fs::write(&file, new_key("one").unwrap().1).unwrap();
        std::fs::set_permissions(&file, std::fs::Permissions::from_mode(mode)).unwrap();
        let process =
            Process::logging(&["serve", "--keys-file", file.to_str().unwrap()], File::create(&log).unwrap().into());
        process.signalled("-TERM");
        process.ended();
        let text = std::fs::read_to_string(&log).unwrap();
        assert_eq!(text.contains("may read the keys file"), is_warned, "{text}");
        std::fs::remove_file(&log).unwrap();
        std::fs::remove_file(&file).unwrap();
    }
}

// --- Answers that nobody reads

fn most_resident_mib(process: &Process) -> u64 {
    let status = std::fs::read_to_string(format!("/proc/{}/status", process.child.id())).unwrap();
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:")).unwrap();
    line.split_whitespace().next().unwrap().parse::<u64>().unwrap() / 1024
}

/// Sent, and nothing of the answer read.
fn sent(address: SocketAddr, path: &str, content_type: &str, body: &str) -> TcpStream {
    let mut stream = TcpStream::connect(address).unwrap();
    let length = body.len();
    let head =
        format!("POST {path} HTTP/1.1\r\nhost: localhost\r\ncontent-type: {content_type}\r\ncontent-length: {length}");
    stream.write_all(format!("{head}\r\n\r\n{body}").as_bytes()).unwrap();
    stream
}

/// Twelve answers of 80 MB each, 30 MB of columns beside them while they are made.
#[test]
fn however_many_large_answers_are_asked_for_they_keep_to_their_room() {
    let arguments =
        ["serve", "--max-unread-bytes", "250000000", "--max-concurrent-solves", "6", "--cache-max-bytes", "0"];
    let process = Process::started(&arguments);
    let document = |torque_nm: u32| {
        let document = with(&shortest(), "/sweep", json!({ "samples": 50_000 }));
        with(&document, "/load/input_torque_nm", json!(torque_nm)).to_string()
    };
    let mut unread: Vec<_> =
        (1..=6).map(|torque_nm| sent(process.address, "/v1/sweep", "application/json", &document(torque_nm))).collect();
    unread.extend((7..=9).map(|torque_nm| {
        let lines = format!("{}\n{}\n", document(torque_nm), document(torque_nm + 10));
        sent(process.address, "/v1/batch", "application/x-ndjson", &lines)
    }));
    // Each has the head of its answer, whatever that is, and no solve runs any more.
    for stream in &mut unread {
        stream.read_exact(&mut [0; 12]).unwrap();
    }
    until_running(process.address, 0.0);
    assert!(metric(process.address, "toothwave_unread_bytes") <= 250e6);
    let most = most_resident_mib(&process);
    assert!(most < 450, "{most} MiB");
}

#[tokio::test]
async fn an_answers_room_is_taken_while_it_is_made_and_given_back() {
    let limits = toothwave::config::Limits { max_unread_bytes: 3_000_000, ..crate::asking::LIMITS };
    let service = Service::within(limits);
    let large = |samples: u32| {
        Question::post("/v1/sweep", with(&shortest(), "/sweep", json!({ "samples": samples })).to_string())
    };
    // 0.8 MB of answer, and 0.3 MB beside it while it is made.
    service.ask(&large(500)).await.found();
    let unread = service.response(large(900).request()).await;
    assert_eq!(unread.status(), 200);
    assert!(service.app.room.taken_bytes() > 1_000_000);
    service.ask(&large(901)).await.refused(503, "too_many_unread_bytes");
    drop(unread);
    assert_eq!(service.app.room.taken_bytes(), 0);
    service.ask(&large(901)).await.found();
}

/// Pieces of one byte, each of which says when it is let go.
#[tokio::test]
async fn the_pieces_that_a_body_arrives_in_are_let_go_as_they_arrive() {
    struct Piece(Arc<AtomicUsize>);
    impl AsRef<[u8]> for Piece {
        fn as_ref(&self) -> &[u8] {
            b" "
        }
    }
    impl Drop for Piece {
        fn drop(&mut self) {
            self.0.fetch_sub(1, Ordering::Relaxed);
        }
    }
    let (held, most) = (Arc::new(AtomicUsize::new(0)), Arc::new(AtomicUsize::new(0)));
    let (pieces, seen) = (Arc::clone(&held), Arc::clone(&most));
    let pieces = (0..10_000).map(move |_| {
        seen.fetch_max(pieces.fetch_add(1, Ordering::Relaxed) + 1, Ordering::Relaxed);
        Ok::<_, std::io::Error>(Bytes::from_owner(Piece(Arc::clone(&pieces))))
    });
    for path in ["/v1/sweep", "/v1/studies"] {
        let body = Body::from_stream(futures_util::stream::iter(pieces.clone()));
        let request = Request::post(path).header("content-type", "application/json").body(body).unwrap();
        Service::new().send(request).await.refused(400, "malformed_json");
        assert!(most.load(Ordering::Relaxed) <= 2, "{path}: {most:?} at once");
    }
}

// --- Studies that are made to be read slowly, to fill the memory, or to break the stack

/// A map of the shortest design with something changed.
fn map_over(base: &Value, over: &Value) -> Question {
    let quantities = ["coincidence_degree"];
    let study = json!({ "study": "map", "base": base, "over": over, "quantities": quantities });
    Question::post("/v1/studies", study.to_string())
}

#[tokio::test]
async fn a_pointer_deeper_than_any_document_is_no_pointer() {
    let service = Service::new();
    let deep = "/a".repeat(25_000);
    for pointer in [deep.clone(), format!("/drive/teeth{deep}"), "/a".repeat(129)] {
        for values in [json!({ "min": 1, "max": 2, "steps": 2 }), json!({ "one_of": ["x"] })] {
            let problem = service.ask(&map_over(&shortest(), &json!({ (pointer.as_str()): values }))).await;
            let problem = problem.refused(422, "invalid_document");
            assert_eq!(problem["errors"][0]["code"], "unknown_field");
        }
    }
}

#[test]
fn the_values_of_a_map_are_counted_before_they_are_made() {
    let process = Process::started(&["serve"]);
    let deviations: Vec<u32> = vec![0; 28];
    let base =
        with(&shortest(), "/deviations", json!({ "tooth_radius_um": deviations, "slot_angle_arcsec": deviations }));
    let pointers = ["tooth_radius_um", "slot_angle_arcsec"]
        .map(|name| (0..28).map(move |item| format!("/deviations/{name}/{item}")));
    let over: serde_json::Map<_, _> = pointers
        .into_iter()
        .flatten()
        .map(|pointer| (pointer, json!({ "min": 0, "max": 1, "steps": 1_000_000 })))
        .collect();
    ask_at(process.address, &map_over(&base, &over.into())).refused(422, "too_many_variants");
    let most = most_resident_mib(&process);
    assert!(most < 400, "56 million values took {most} MiB");
}

/// Each field that is left out costs another reading of the whole document, for each combination of choices.
#[tokio::test]
async fn of_fields_that_no_kind_has_few_are_left_out_before_one_is_refused() {
    let mut base = shortest();
    let teeth = base["drive"]["teeth"].as_object_mut().unwrap();
    teeth.extend((0..4000).map(|field| (format!("a{field}"), json!(1))));
    let shapes = ["cylinder", "ball", "flat_sided"];
    let answer = Service::new().ask(&map_over(&base, &json!({ "/drive/teeth/shape": { "one_of": shapes } }))).await;
    let problem = answer.refused(422, "invalid_document");
    assert_eq!(problem["errors"][0]["code"], "unknown_field");
}

#[tokio::test]
async fn the_documents_of_all_choices_may_not_take_more_than_their_bound() {
    let teeth = 2000;
    let base = with(&shortest(), "/drive/teeth/count", json!(teeth));
    let base = with(&base, "/deviations", json!({ "tooth_radius_um": vec![0; teeth] }));
    let choices: Vec<_> = (0..250).map(|step| 4.0 + 1e-3 * f64::from(step)).collect();
    let answer =
        Service::new().ask(&map_over(&base, &json!({ "/drive/teeth/radius_mm": { "one_of": choices } }))).await;
    let problem = answer.refused(422, "invalid_document");
    assert_eq!(problem["errors"][0]["pointer"], "/over");
}

#[tokio::test]
async fn what_is_kept_of_a_study_counts_with_what_is_asked() {
    let limits = toothwave::config::Limits { max_study_bytes: 550_000, ..crate::asking::LIMITS };
    let service = Service::within(limits);
    let mut places = Vec::new();
    // Of 200 designs each, of a kilobyte, and little that comes of them.
    for torque_nm in [1, 2, 3] {
        let choices: Vec<_> = (0..200).map(|step| 4.0 + 1e-3 * f64::from(step)).collect();
        let base = with(&shortest(), "/load/input_torque_nm", json!(torque_nm));
        let asked =
            map_over(&base, &json!({ "/drive/teeth/radius_mm": { "one_of": choices } })).with("prefer", "wait=600");
        let study = service.ask(&asked).await.found();
        places.push(format!("/v1/studies/{}", study["id"].as_str().unwrap()));
    }
    service.get(&places[0]).await.refused(404, "not_found");
    assert_eq!(service.get(&places[2]).await.status, 200);
}

// --- Time and joining

/// Whoever joins another's solve has a deadline of its own: it began later.
#[tokio::test(start_paused = true)]
async fn a_joiner_is_answered_though_the_time_of_the_first_is_over() {
    let limits = toothwave::config::Limits { max_concurrent_solves: 1, deadline_ms: 1000, ..crate::asking::LIMITS };
    let service = Service::within(limits);
    let (release, released) = std::sync::mpsc::channel::<()>();
    let pool = service.app.pool.clone();
    let occupied = tokio::spawn(async move {
        let job = move |_: &AtomicBool| {
            let _ = released.recv();
            Ok(())
        };
        pool.run_while_wanted(toothwave::compute::Thread::Blocking, job).await
    });
    let ask = || {
        let service = service.clone();
        tokio::spawn(async move { service.ask(&Question::post("/v1/sweep", shortest().to_string())).await })
    };
    crate::asking::until("the pool is occupied", || service.app.pool.running() == 1).await;
    let first = ask();
    crate::asking::until("the first waits", || service.app.pool.admitted() == 2).await;
    tokio::time::advance(Duration::from_millis(600)).await;
    let joiner = ask();
    for _ in 0..1000 {
        tokio::task::yield_now().await;
    }
    tokio::time::advance(Duration::from_millis(401)).await;
    first.await.unwrap().refused(503, "deadline_exceeded");
    release.send(()).unwrap();
    occupied.await.unwrap().unwrap();
    let answer = joiner.await.unwrap();
    assert_eq!(answer.status, 200, "{}", answer.text());
    assert!(answer.is_collapsed());
}

// --- Entity tags

#[tokio::test]
async fn a_picture_made_again_is_the_same_to_the_byte() {
    let plots = Question::post("/v1/sweep", shortest().to_string()).with("accept", "image/svg+xml");
    let (first, again) = (Service::new().ask(&plots).await, Service::new().ask(&plots).await);
    assert!(first.is_miss() && again.is_miss());
    assert_eq!(first.etag(), again.etag());
    assert_eq!(first.text(), again.text());
    let references = first.text().matches("url(#kuva-clip-").count();
    let named: std::collections::BTreeSet<_> =
        first.text().split("id=\"kuva-clip-").skip(1).map(|rest| rest.split('"').next().unwrap()).collect();
    assert!(named.len() == 6 && references >= 6, "each of six plots is clipped by its own: {named:?}");
}

/// The mathematical library chooses its code by the processor: under one tag there is one text, whatever it chose.
#[test]
fn another_arithmetic_has_other_tags() {
    let answer = |tunables: &str| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_toothwave"));
        let process =
            Process::of(command.env("GLIBC_TUNABLES", tunables).args(["serve", "--log", "off"]), Stdio::null());
        let design = with(&shortest(), "/model", json!({ "stiffness": { "law": "palmgren" } }));
        let answer = ask_at(process.address, &Question::post("/v1/sweep", design.to_string()));
        (answer.etag().to_owned(), answer.body)
    };
    let (usual, masked) = (answer(""), answer("glibc.cpu.hwcaps=-AVX2,-FMA,-AVX2_Usable,-FMA_Usable"));
    assert!(usual.1 == masked.1 || usual.0 != masked.0, "{} for two texts", usual.0);
}

/// The first refusal would otherwise be no increase of anything.
#[test]
fn what_has_not_happened_yet_stands_in_the_metrics_as_zero() {
    let process = Process::started(&["serve"]);
    for series in ["toothwave_cancellations_total", "toothwave_study_variants_total"] {
        assert_eq!(metric(process.address, series), 0.0);
    }
    for reason in ["unauthorized", "queue_full", "store_unavailable"] {
        assert_eq!(metric(process.address, &format!("toothwave_refusals_total{{reason=\"{reason}\"}}")), 0.0);
    }
}

#[tokio::test]
async fn metrics_say_what_was_built() {
    toothwave::observe::install_recorder();
    let metrics = Service::new().get("/metrics").await;
    let info = metrics.text().lines().find(|line| line.starts_with("toothwave_build_info{")).unwrap().to_owned();
    assert!(info.contains(&format!("build=\"{}\"", toothwave_calculation::BUILD)) && info.ends_with(" 1"), "{info}");
    assert!(
        toothwave_calculation::BUILD.len() == 16
            && toothwave_calculation::BUILD.bytes().all(|byte| byte.is_ascii_hexdigit())
    );
}
