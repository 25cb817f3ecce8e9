//! More work than the service can do: it says so at once, and stays well.

use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Arc, Barrier, mpsc};

use serde_json::json;
use toothwave::compute::{Pool, Thread};
use toothwave::config::Limits;

use crate::asking::{Answer, LIMITS, Listening, Occupied, Question, Service, ask_at, until};
use crate::designs::{shortest, spelled_out, undercut, with};

/// One solve at a time, and one that waits.
const NARROW: Limits = Limits { max_concurrent_solves: 1, max_queued_solves: 1, ..LIMITS };

/// A sweep that takes long, different from all others by its torque.
fn large(samples: u32, torque_nm: u32) -> Question {
    let document = with(&spelled_out(), "/sweep/samples", json!(samples));
    Question::post("/v1/sweep", with(&document, "/load/input_torque_nm", json!(torque_nm)).to_string())
}

fn is_idle(pool: &Pool) -> bool {
    (pool.running(), pool.admitted()) == (0, 0)
}

/// What answers however full the service is.
const SIDE: [&str; 6] = ["/health/live", "/health/ready", "/v1/limits", "/metrics", "/v1/examples", "/openapi.json"];

#[test]
fn of_large_sweeps_at_once_as_many_as_fit_are_answered_and_the_others_refused_while_all_else_answers() {
    let service = Listening::within(NARROW);
    // One solve runs for as long as it takes all the others to arrive: of these, one fits.
    let occupied = service.run(Occupied::by_one(&service.app.pool));
    let (answers, answered) = mpsc::channel();
    let start = Arc::new(Barrier::new(8));
    for torque_nm in 1..=8 {
        let (address, start, answers) = (service.address, Arc::clone(&start), answers.clone());
        std::thread::spawn(move || {
            start.wait();
            answers.send(ask_at(address, &large(20_000, torque_nm))).unwrap();
        });
    }
    for _ in 0..7 {
        let answer: Answer = answered.recv().unwrap();
        answer.refused(503, "queue_full");
        assert!(answer.header("retry-after").parse::<u32>().unwrap() >= 1);
    }
    let side = || {
        for path in SIDE {
            assert_eq!(ask_at(service.address, &Question::of("GET", path)).status, 200, "{path}");
        }
    };
    side();
    service.run(occupied.end());
    // Now the one that waited is solved, for real.
    let last = loop {
        side();
        if let Ok(answer) = answered.try_recv() {
            break answer;
        }
    };
    assert_eq!(last.status, 200);
    assert!(is_idle(&service.app.pool), "an answer is only given when its solve has ended");
    assert_eq!(ask_at(service.address, &large(50, 9)).status, 200, "and then there is room again");
}

#[test]
fn under_large_sweeps_at_once_nothing_but_answers_and_refusals_comes_back() {
    let service = Listening::within(NARROW);
    let start = Arc::new(Barrier::new(8));
    let askers: Vec<_> = (1..=8)
        .map(|torque_nm| {
            let (address, start) = (service.address, Arc::clone(&start));
            std::thread::spawn(move || {
                start.wait();
                ask_at(address, &large(10_000, torque_nm))
            })
        })
        .collect();
    let answers: Vec<Answer> = askers.into_iter().map(|asker| asker.join().unwrap()).collect();
    for refused in answers.iter().filter(|answer| answer.status != 200) {
        refused.refused(503, "queue_full");
    }
    let answered = answers.iter().filter(|answer| answer.status == 200).count();
    assert!((1..8).contains(&answered), "{answered} of 8 answered");
    assert!(is_idle(&service.app.pool));
}

#[tokio::test]
async fn exactly_as_many_are_admitted_as_run_and_wait() {
    let limits = Limits { max_concurrent_solves: 2, max_queued_solves: 3, ..LIMITS };
    let service = Service::within(limits);
    let (one, other) = (Occupied::by_one(&service.app.pool).await, Occupied::by_one(&service.app.pool).await);
    assert_eq!((service.app.pool.running(), service.app.pool.admitted()), (2, 2));
    let mut waiting = Vec::new();
    for torque_nm in 1..=3 {
        let (asker, admitted) = (service.clone(), service.app.pool.admitted());
        waiting.push(tokio::spawn(async move { asker.ask(&large(50, torque_nm)).await }));
        until("one more waits", || service.app.pool.admitted() == admitted + 1).await;
    }
    for torque_nm in 4..=9 {
        let problem = service.ask(&large(50, torque_nm)).await.refused(503, "queue_full");
        let detail = problem["detail"].as_str().unwrap();
        assert!(detail.contains('2') && detail.contains('3'), "the limits are not in `{detail}`");
    }
    assert_eq!((service.app.pool.running(), service.app.pool.admitted()), (2, 5));
    one.end().await;
    other.end().await;
    for asker in waiting {
        assert_eq!(asker.await.unwrap().status, 200);
    }
    until("the pool is idle", || is_idle(&service.app.pool)).await;
}

#[tokio::test]
async fn all_else_answers_while_the_service_is_full() {
    let service = Service::within(Limits { max_queued_solves: 0, ..NARROW });
    let occupied = Occupied::by_one(&service.app.pool).await;
    for path in SIDE {
        assert_eq!(service.get(path).await.status, 200, "{path}");
    }
    service.post_text("/v1/sweep", "{").await.refused(400, "malformed_json");
    service.post_text("/v1/sweep", "{}").await.refused(422, "invalid_document");
    service.ask(&large(50, 1)).await.refused(503, "queue_full");
    occupied.end().await;
}

#[tokio::test]
async fn what_is_kept_is_answered_by_a_full_service_too() {
    let service = Service::within(Limits { max_queued_solves: 0, ..NARROW });
    let first = service.ask(&large(50, 1)).await;
    let occupied = Occupied::by_one(&service.app.pool).await;
    let again = service.ask(&large(50, 1)).await;
    assert!(again.is_hit() && again.body == first.body);
    occupied.end().await;
}

#[tokio::test]
async fn a_computation_longer_than_the_deadline_is_stopped_and_its_permit_comes_back() {
    let service = Service::within(Limits { deadline_ms: 5, ..NARROW });
    let answer = service.ask(&large(140_000, 1)).await;
    let problem = answer.refused(503, "deadline_exceeded");
    assert!(problem["detail"].as_str().unwrap().contains("5 ms"), "{problem}");
    assert!(answer.header("retry-after").parse::<u32>().unwrap() >= 1);
    until("the computation has stopped", || is_idle(&service.app.pool)).await;
}

#[tokio::test]
async fn a_computation_that_is_stopped_leaves_nothing_in_the_cache() {
    let service = Service::within(Limits { deadline_ms: 5, ..NARROW });
    for _ in 0..2 {
        service.ask(&large(140_000, 1)).await.refused(503, "deadline_exceeded");
        until("the computation has stopped", || is_idle(&service.app.pool)).await;
    }
    assert_eq!(service.app.cache.size().entries, 0);
}

#[tokio::test]
async fn waiting_counts_towards_the_deadline_and_gives_its_place_back() {
    let service = Service::within(Limits { deadline_ms: 5, ..NARROW });
    // Not through the deadline of the pool itself: this one holds on.
    let occupied = Occupied::by_one(&service.app.pool).await;
    service.ask(&large(50, 1)).await.refused(503, "deadline_exceeded");
    assert_eq!(service.app.pool.admitted(), 1, "only the solve that runs");
    drop(occupied);
    until("the pool is idle", || is_idle(&service.app.pool)).await;
}

#[tokio::test]
async fn the_deadline_tells_a_computation_to_stop() {
    let service = Service::within(Limits { deadline_ms: 5, ..NARROW });
    let (begun, ended) = (Arc::new(AtomicUsize::new(0)), Arc::new(AtomicUsize::new(0)));
    let pool = &service.app.pool;
    // Where everything is slow its time may be over before it begins.
    while begun.load(Ordering::SeqCst) == 0 {
        let (begins, ends) = (Arc::clone(&begun), Arc::clone(&ended));
        let endless = move |stop: &AtomicBool| {
            begins.fetch_add(1, Ordering::SeqCst);
            while !stop.load(Ordering::Relaxed) {
                std::thread::yield_now();
            }
            ends.fetch_add(1, Ordering::SeqCst);
            Ok(())
        };
        let problem = pool.run(pool.deadline(), Thread::Blocking, endless).await.unwrap_err();
        assert_eq!(problem.status, 503);
    }
    until("it has stopped", || ended.load(Ordering::SeqCst) == begun.load(Ordering::SeqCst) && is_idle(pool)).await;
}

#[tokio::test]
async fn the_largest_numbers_for_limits_mean_no_limit() {
    let limits = Limits {
        max_states: u64::MAX,
        max_profile_points: u64::MAX,
        max_body_bytes: usize::MAX,
        deadline_ms: u64::MAX,
        cache_max_bytes: u64::MAX,
        max_unread_bytes: u64::MAX,
        ..LIMITS
    };
    let service = Service::within(limits);
    for path in crate::asking::ENDPOINTS {
        service.post(path, &spelled_out()).await.found();
    }
}

#[tokio::test]
async fn answers_that_nobody_reads_leave_no_room_for_another_until_they_are_read() {
    let service = Service::within(Limits { max_unread_bytes: 1_000_000, ..LIMITS });
    // Some 700 kB each.
    let unread = service.response(large(500, 1).request()).await;
    assert_eq!(unread.status(), 200);
    let answer = service.ask(&large(500, 2)).await;
    answer.refused(503, "too_many_unread_bytes");
    assert!(answer.header("retry-after").parse::<u32>().unwrap() >= 1);
    // Ordinary ones are given all the same, and the same answer to whoever else wants it: it is in memory once.
    service.ask(&large(50, 2)).await.found();
    service.ask(&large(500, 1)).await.found();
    drop(unread);
    service.ask(&large(500, 2)).await.found();
}

/// Where light loads press teeth against corners a search looks at more input angles than any other, and nobody knows it before.
#[tokio::test]
async fn a_search_that_looks_further_than_was_expected_takes_room_on_its_way() {
    const BATCH_BYTES: u64 = 9 << 20;
    let service =
        Service::within(Limits { max_unread_bytes: BATCH_BYTES + 7_000_000, max_concurrent_solves: 1, ..LIMITS });
    let model = json!({ "corner_contact": true, "clearance": { "carrier_um": 0.028, "ring_um": 0.0115 } });
    let mut document = with(&with(&undercut(), "/model", model), "/sweep", json!({ "tolerance": 4.4e-9 }));
    document["load"] = json!({ "input_torque_nm": 1.45e-6 });
    document["drive"]["teeth"] = json!({ "count": 80, "radius_mm": 1.5, "width_mm": 10.0 });
    let sweep = Question::post("/v1/sweep", document.to_string()).with("accept", "text/plain");
    let batch = Question::post_as("application/x-ndjson", "/v1/batch?peaks_only=true", document.to_string());
    for (question, others_bytes, refused) in
        [(sweep, BATCH_BYTES + 4_500_000, r#""status":503"#), (batch, 4_500_000, r#""status":503,"problem""#)]
    {
        let others = service.app.room.reserve(others_bytes).unwrap();
        let without_room = service.ask(&question).await;
        assert!(without_room.text().contains(refused), "{}", without_room.text());
        assert!(without_room.text().contains("too_many_unread_bytes"));
        drop(others);
        let alone = service.ask(&question).await;
        assert_eq!(alone.status, 200);
        assert!(!alone.text().contains(refused), "{}", alone.text());
        assert_eq!(service.app.room.taken_bytes(), 0);
    }
}

#[tokio::test]
async fn an_answer_larger_than_all_that_may_be_unread_is_given_when_it_is_alone() {
    for max_unread_bytes in [0, 10_000] {
        let service = Service::within(Limits { max_unread_bytes, ..LIMITS });
        let unread = service.response(large(500, 1).request()).await;
        service.ask(&large(500, 2)).await.refused(503, "too_many_unread_bytes");
        drop(unread);
        service.ask(&large(500, 2)).await.found();
    }
}

/// Where bodies may be of megabytes, some tens of them that were nearly sent ended a service of 128 MiB.
#[tokio::test]
async fn bodies_that_are_long_take_room_until_they_are_read() {
    let service = Service::within(Limits { max_body_bytes: 4 << 20, max_unread_bytes: 4 << 20, ..LIMITS });
    let long = format!("{}{}", " ".repeat(1 << 20), shortest());
    let ask = async || service.ask(&Question::post("/v1/coincidence-degree", long.clone())).await;
    assert_eq!(ask().await.status, 200);
    assert_eq!(service.app.room.taken_bytes(), 0);
    let others = service.app.room.reserve(3 << 20).unwrap();
    ask().await.refused(503, "too_many_unread_bytes");
    drop(others);
    assert_eq!(ask().await.status, 200);
    // What comes of one may take all the room, made or kept.
    let document = with(&spelled_out(), "/sweep/samples", json!(2000)).to_string();
    for _ in 0..2 {
        let long = format!("{}{document}", " ".repeat(3 << 19));
        assert_eq!(service.ask(&Question::post("/v1/sweep", long)).await.status, 200);
    }
}
