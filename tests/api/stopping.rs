//! Graceful shutdown without lost requests.

use std::io::{Read as _, Write as _};
use std::net::{SocketAddr, TcpStream};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Barrier};
use std::time::Duration;

use crate::asking::{ENDLESS, LIMITS, Question, Service, answer_on, ask_at};
use crate::serving::Process;

/// Sends requests on one connection and opens another one only after the service announces its end.
/// Returns the number of answered requests, or the failure of an unanswered one.
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
            // A load balancer would ask another replica.
            break;
        }
    }
    Ok(answered)
}

#[test]
fn stopping_service_loses_no_request() {
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

#[test]
fn silent_connection_delays_no_stop() {
    let process = Process::started(&["serve", "--shutdown-ms", "600000"]);
    let mut unfinished = TcpStream::connect(process.address).unwrap();
    unfinished.write_all(b"POST /v1/sweep HTTP/1.1\r\nhost:").unwrap();
    let _silent = TcpStream::connect(process.address).unwrap();
    assert_eq!(ask_at(process.address, &Question::of("GET", "/health/live")).status, 200);
    process.signalled("-TERM");
    assert_eq!(process.ended().code(), Some(0));
}

#[test]
fn computation_beyond_shutdown_gets_problem() {
    let service = Service::with(ENDLESS, &["--shutdown-ms", "1"]);
    let running = service.occupied_by(1);
    service.process().signalled("-TERM");
    for stream in running {
        answer_on(stream).refused(503, "shutting_down");
    }
}

#[test]
fn draining_service_is_live_but_not_ready() {
    let service = Service::with(LIMITS, &["--lame-duck-ms", "600000"]);
    let status = |path: &str| ask_at(service.address(), &Question::of("GET", path)).status;
    assert_eq!((status("/health/live"), status("/health/ready")), (200, 200));
    service.process().signalled("-TERM");
    while status("/health/ready") == 200 {}
    assert_eq!((status("/health/live"), status("/health/ready"), status("/v1/limits")), (200, 503, 200));
}

#[test]
fn second_signal_stops_at_once() {
    for lame_duck_ms in ["0", "600000"] {
        let arguments = ["--shutdown-ms", "600000", "--lame-duck-ms", lame_duck_ms];
        let service = Service::with(ENDLESS, &arguments);
        let _running = service.occupied_by(1);
        let process = service.into_process();
        process.signalled("-TERM");
        // The first signal is handled before the second arrives.
        let is_ready = || {
            let mut stream = TcpStream::connect(process.address).ok()?;
            stream.write_all(b"GET /health/ready HTTP/1.1\r\nhost: localhost\r\nconnection: close\r\n\r\n").ok()?;
            let mut answer = String::new();
            stream.read_to_string(&mut answer).ok()?;
            Some(answer.starts_with("HTTP/1.1 200"))
        };
        while is_ready() == Some(true) {}
        process.signalled("-INT");
        assert_eq!(process.ended().code(), Some(0));
    }
}
