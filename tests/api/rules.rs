//! The six rules of the service. Each test exceeds one of them.

use std::fs::File;
use std::io::{Read as _, Write as _};
use std::net::TcpStream;
use std::process::Stdio;

use serde_json::json;

use crate::asking::{ENDLESS, LIMITS, Limits, Question, Service, answer_on, ask_at, endless};
use crate::designs::{shortest, with};
use crate::serving::Process;

const SOLVES_RUNNING: &str = "toothwave_solves_running";
const SOLVES_QUEUED: &str = "toothwave_solves_queued";
const UNREAD_BYTES: &str = "toothwave_unread_bytes";
const BATCHES_RUNNING: &str = "toothwave_batches_running";

const ONE_SOLVE: Limits = Limits { max_concurrent_solves: 1, ..ENDLESS };

/// Returns a request for a sweep whose answer has about 30 MB. Each number gives another sweep.
fn large(number: u32) -> Question {
    Question::post("/v1/sweep", with(&shortest(), "/sweep", json!({ "samples": 20_000 + number })).to_string())
}

fn small(torque_nm: f64) -> Question {
    Question::post("/v1/sweep", with(&shortest(), "/load/input_torque_nm", json!(torque_nm)).to_string())
}

fn batch(document: &str) -> Question {
    Question::post_as("application/x-ndjson", "/v1/batch?peaks_only=true", document)
}

// --- CPU

#[test]
fn batches_leave_permits_for_requests() {
    let service = Service::within(ONE_SOLVE);
    let document = with(&shortest(), "/sweep", json!({ "samples": 10_000_000 })).to_string();
    let _batches: Vec<_> = (0..4).map(|_| service.send(&batch(&document))).collect();
    service.until(BATCHES_RUNNING, 4.0);
    assert_eq!(ask_at(service.address(), &small(20.0)).status, 200);
}

// --- Queue

#[test]
fn thirty_third_waiting_request_is_refused() {
    let service = Service::within(ONE_SOLVE);
    let running = service.occupied_by(1);
    let waiting: Vec<_> = (0..32).map(|number| service.send(&small(20.0 + f64::from(number)))).collect();
    service.until(SOLVES_QUEUED, 32.0);
    let refused = ask_at(service.address(), &small(100.0));
    assert_eq!(refused.header("retry-after"), "1");
    refused.refused(503, "queue_full");
    drop(running);
    for request in waiting {
        assert_eq!(answer_on(request).status, 200);
    }
}

#[test]
fn seventeenth_batch_is_refused() {
    let service = Service::within(ONE_SOLVE);
    let document = with(&shortest(), "/sweep", json!({ "samples": 10_000_000 })).to_string();
    let running: Vec<_> = (0..16).map(|_| service.send(&batch(&document))).collect();
    service.until(BATCHES_RUNNING, 16.0);
    ask_at(service.address(), &batch(&document)).refused(503, "queue_full");
    drop(running);
    service.until(BATCHES_RUNNING, 0.0);
    service.until(SOLVES_RUNNING, 0.0);
}

// --- Time

#[test]
fn deadline_stops_computation() {
    let service = Service::within(Limits { deadline_ms: 200, ..ONE_SOLVE });
    ask_at(service.address(), &endless(0)).refused(503, "deadline_exceeded");
    service.until(SOLVES_RUNNING, 0.0);
    assert_eq!(ask_at(service.address(), &small(20.0)).status, 200);
}

#[test]
fn leaving_client_stops_computation() {
    let service = Service::within(ONE_SOLVE);
    drop(service.occupied_by(1));
    service.until(SOLVES_RUNNING, 0.0);
    assert_eq!(service.metric("toothwave_cancellations_total"), 1.0);
}

#[test]
fn leaving_client_stops_batch() {
    let service = Service::within(ONE_SOLVE);
    let document = with(&shortest(), "/sweep", json!({ "samples": 10_000_000 })).to_string();
    let client = service.send(&batch(&document));
    service.until(SOLVES_RUNNING, 1.0);
    drop(client);
    service.until(BATCHES_RUNNING, 0.0);
    service.until(SOLVES_RUNNING, 0.0);
}

// --- Bytes

#[test]
fn unread_answers_never_exceed_budget() {
    let budget_bytes = 160 << 20;
    let service = Service::within(Limits { max_unread_bytes: budget_bytes, cache_max_bytes: 0, ..LIMITS });
    let unread: Vec<_> = (0..12).map(|number| service.send(&large(number))).collect();
    // Health and small answers still arrive, and reservations never exceed the budget.
    for number in 0..50 {
        assert_eq!(ask_at(service.address(), &small(30.0 + f64::from(number))).status, 200);
        assert!(service.metric(UNREAD_BYTES) <= budget_bytes as f64);
    }
    let refused = unread.into_iter().map(answer_on).filter(|answer| answer.status == 503);
    for answer in refused {
        answer.refused(503, "too_many_unread_bytes");
    }
    service.until(UNREAD_BYTES, 0.0);
}

#[test]
fn answer_above_budget_is_refused_at_once() {
    let service = Service::within(Limits { max_unread_bytes: 10_000_000, ..LIMITS });
    ask_at(service.address(), &large(0)).refused(422, "too_many_states");
}

#[test]
fn tolerance_sweep_above_its_part_is_refused() {
    let service = Service::within(Limits { max_unread_bytes: 1_000_000, ..LIMITS });
    let fine = with(&shortest(), "/sweep", json!({ "tolerance": 1e-9 })).to_string();
    ask_at(service.address(), &Question::post("/v1/sweep", fine)).refused(422, "too_many_states");
}

// --- Cache

#[test]
fn large_body_is_not_kept() {
    let service = Service::within(ENDLESS);
    for (samples, is_kept) in [(400, true), (4_000, false)] {
        let document = with(&shortest(), "/sweep", json!({ "samples": samples })).to_string();
        let question = Question::post("/v1/sweep", document);
        let (first, again) = (ask_at(service.address(), &question), ask_at(service.address(), &question));
        assert!(first.is_miss() && (first.body.len() <= 1 << 20) == is_kept, "{}", first.body.len());
        assert_eq!((again.is_hit(), again.body == first.body), (is_kept, true));
    }
}

// --- Connections

#[test]
fn connection_over_limit_gets_canned_refusal() {
    let service = Service::new();
    let held: Vec<_> = (0..1024).map(|_| TcpStream::connect(service.address()).unwrap()).collect();
    let limits = Question::of("GET", "/v1/limits");
    let refused = (0..1000).map(|_| ask_at(service.address(), &limits)).find(|answer| answer.status == 503).unwrap();
    assert_eq!((refused.header("retry-after"), refused.header("connection")), ("1", "close"));
    refused.refused(503, "too_many_connections");
    drop(held);
    assert!((0..100_000).any(|_| ask_at(service.address(), &limits).status == 200));
}

#[test]
fn head_over_limit_is_refused() {
    let long = Question::of("GET", "/health/live").with("x-long", &"x".repeat(50_000));
    assert_eq!(ask_at(Service::new().address(), &long).status, 431);
}

// --- The log

/// A pipe holds 64 KiB, about 250 lines.
#[test]
fn stuck_log_reader_blocks_nothing() {
    let process = Process::logging(&["serve"], Stdio::piped());
    let mut stream = TcpStream::connect(process.address).unwrap();
    let asked = b"GET /health/live HTTP/1.1\r\nhost: localhost\r\n\r\n".repeat(100);
    let mut buffer = [0; 1 << 16];
    let lost = || {
        let metrics = ask_at(process.address, &Question::of("GET", "/metrics"));
        metrics.text().lines().any(|line| {
            line.strip_prefix("toothwave_log_lines_lost_total ")
                .is_some_and(|value| value.parse::<f64>().unwrap() > 0.0)
        })
    };
    let is_lost = (0..300).any(|_| {
        stream.write_all(&asked).unwrap();
        let mut answers = 0;
        while answers < 100 {
            let read = stream.read(&mut buffer).unwrap();
            assert!(read > 0, "the connection was closed");
            answers += buffer[..read].windows(5).filter(|word| word == b"live\n").count();
        }
        lost()
    });
    assert!(is_lost);
    process.signalled("-TERM");
    assert_eq!(process.ended().code(), Some(0));
}

#[test]
fn full_log_device_blocks_nothing() {
    let process = Process::logging(&["serve"], File::options().write(true).open("/dev/full").unwrap().into());
    for _ in 0..3 {
        assert_eq!(ask_at(process.address, &Question::of("GET", "/health/live")).status, 200);
    }
    process.signalled("-TERM");
    assert_eq!(process.ended().code(), Some(0));
}
