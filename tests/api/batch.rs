//! Batches: a document a line, an answer a line, in order and whatever each comes to.

use std::convert::Infallible;
use std::io::Write as _;
use std::process::{Command, Stdio};

use axum::body::{Body, Bytes};
use axum::http::Request;
use futures_util::{StreamExt as _, stream};
use serde_json::{Value, json};
use toothwave::config::Limits;

use crate::asking::{Answer, LIMITS, Listening, Occupied, Question, Service, ask_at, until};
use crate::designs::{of_the_paper, shortest, undercut, with};

fn question(query: &str, body: impl Into<Vec<u8>>) -> Question {
    Question::post_as("application/x-ndjson", &format!("/v1/batch{query}"), body)
}

async fn batch(service: &Service, query: &str, lines: &[String]) -> Answer {
    service.ask(&question(query, lines.join("\n"))).await
}

fn lines(answer: &Answer) -> Vec<Value> {
    assert_eq!((answer.status, answer.header("content-type")), (200, "application/x-ndjson"), "{}", answer.text());
    let mut lines: Vec<Value> = answer.text().lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    let count = lines.len() - 1;
    assert_eq!(lines.pop(), Some(json!({ "asked": count, "answered": count })));
    lines
}

/// Case 5.1 with another torque for each index, so that every answer tells whose it is.
fn variant(index: u64) -> Value {
    with(&with(&shortest(), "/model", of_the_paper()), "/load/input_torque_nm", json!(20.0 + index as f64))
}

#[tokio::test]
async fn every_document_is_answered_in_its_place_as_it_would_be_by_itself() {
    let service = Service::new();
    let impossible = with(&shortest(), "/drive/teeth/radius_mm", json!(0));
    let documents =
        [variant(0).to_string(), "{".into(), impossible.to_string(), undercut().to_string(), variant(4).to_string()];
    for endpoint in ["geometry", "coincidence-degree", "sweep"] {
        let found = lines(&batch(&service, &format!("?endpoint={endpoint}"), &documents).await);
        assert_eq!(found.len(), documents.len());
        for (index, (line, document)) in found.iter().zip(&documents).enumerate() {
            let single = service.post_text(&format!("/v1/{endpoint}"), document.clone()).await;
            assert_eq!(
                (line["index"].as_u64(), line["status"].as_u64()),
                (Some(index as u64), Some(single.status.into()))
            );
            let part = if single.status == 200 { "answer" } else { "problem" };
            assert_eq!(line[part], single.json(), "{endpoint} {index}");
        }
    }
}

#[tokio::test]
async fn answers_keep_the_order_of_a_thousand_documents() {
    let documents: Vec<_> = (0..1000).map(|index| variant(index).to_string()).collect();
    let found = lines(&batch(&Service::new(), "?peaks_only=true", &documents).await);
    assert_eq!(found.len(), 1000);
    let first = found[0]["answer"]["peaks"]["ring"]["force_n"]["value"].as_f64().unwrap();
    for (index, line) in found.iter().enumerate() {
        assert_eq!(line["index"], index);
        // Forces go with the torque.
        let force_n = line["answer"]["peaks"]["ring"]["force_n"]["value"].as_f64().unwrap();
        assert!((force_n / first / ((20.0 + index as f64) / 20.0) - 1.0).abs() < 1e-12, "{index}");
    }
}

#[tokio::test]
async fn the_peaks_alone_are_those_of_the_whole_answer() {
    let service = Service::new();
    let limited = with(&shortest(), "/load/allowable_stress_mpa", json!(1500.0));
    let cam = json!({ "kind": "plain", "coefficient": 0.03 });
    let rubbing = with(&limited, "/friction", crate::friction::on(&cam));
    let point = json!({ "input_torque_nm": 20.0, "input_speed_rpm": 1500.0, "share_of_time": 1.0 });
    let on_duty = with(&rubbing, "/load", json!({ "duty": [point] }));
    for document in [limited, rubbing, on_duty].map(|document| document.to_string()) {
        let whole = service.post_text("/v1/sweep", document.clone()).await.json();
        let line = &lines(&batch(&service, "?peaks_only=true", &[document]).await)[0];
        let mut expected = whole.clone();
        expected.as_object_mut().unwrap().remove("states");
        if let Some(losses) = expected.get_mut("losses").and_then(|losses| losses.as_object_mut()) {
            for column in ["slip_mm_per_rad", "rolls", "by_input_angle"] {
                losses.remove(column);
            }
            assert!(losses["efficiency"]["ring_fixed"].is_number());
        }
        assert_eq!(line["answer"], expected);
    }
}

#[tokio::test]
async fn blank_lines_are_passed_over_and_a_line_too_long_is_a_problem_of_its_own() {
    let service = Service::within(Limits { max_body_bytes: 1_000, ..LIMITS });
    let long = format!("{:2000}", variant(1).to_string());
    let documents =
        [variant(0).to_string(), String::new(), "  ".into(), long, "\r".into(), variant(2).to_string(), String::new()];
    let found = lines(&batch(&service, "", &documents).await);
    let statuses: Vec<_> =
        found.iter().map(|line| (line["index"].as_u64().unwrap(), line["status"].as_u64().unwrap())).collect();
    assert_eq!(statuses, [(0, 200), (1, 413), (2, 200)]);
    assert!(found[1]["problem"]["detail"].as_str().unwrap().contains("max_body_bytes"));
}

#[tokio::test]
async fn a_line_may_arrive_in_any_pieces() {
    let text = format!("{}\n{}", variant(0), variant(1));
    for size in [1, 7, 100] {
        let pieces: Vec<_> =
            text.as_bytes().chunks(size).map(|piece| Ok::<_, std::io::Error>(Bytes::copy_from_slice(piece))).collect();
        let request = Request::post("/v1/batch")
            .header("content-type", "application/x-ndjson")
            .body(Body::from_stream(stream::iter(pieces)))
            .unwrap();
        let found = lines(&Service::new().send(request).await);
        assert!(found.len() == 2 && found.iter().all(|line| line["status"] == 200), "{size}");
    }
}

#[tokio::test]
async fn an_empty_batch_has_the_last_line_alone() {
    assert!(lines(&batch(&Service::new(), "", &[]).await).is_empty());
}

#[tokio::test]
async fn what_is_no_batch_is_refused() {
    let service = Service::new();
    for query in ["?endpoint=accuracy", "?states=false", "?peaks_only=1", "?endpoint=geometry&peaks_only=true"] {
        batch(&service, query, &[variant(0).to_string()]).await.refused(400, "invalid_query");
    }
    let question = Question::post("/v1/batch", variant(0).to_string());
    service.ask(&question).await.refused(415, "unsupported_media_type");
}

/// A client of two cores' worth of long sweeps: its permits are taken, and still a neighbour's request is answered before the batch is.
#[test]
fn a_single_request_does_not_wait_for_a_batch() {
    let service = Listening::within(Limits { max_concurrent_solves: 1, ..LIMITS });
    let address = service.address;
    let slow = with(&shortest(), "/sweep", json!({ "samples": 20_000 })).to_string();
    let lines = vec![slow; 40].join("\n");
    let batch = std::thread::spawn(move || ask_at(address, &question("?peaks_only=true", lines)));
    service.run(until("the batch runs", || service.app.pool.batches() == 1 && service.app.pool.running() == 1));
    let single = ask_at(address, &Question::post("/v1/sweep", variant(7).to_string()));
    assert_eq!(single.status, 200);
    assert!(!batch.is_finished(), "the neighbour came in between");
    let answer = batch.join().unwrap();
    assert_eq!(answer.text().lines().filter(|line| line.contains("\"status\":200")).count(), 40);
}

#[tokio::test]
async fn a_batch_whose_client_leaves_frees_its_place_and_stops() {
    let service = Service::within(Limits { max_concurrent_solves: 1, ..LIMITS });
    let endless = stream::repeat_with(|| Ok::<_, std::io::Error>(Bytes::from(format!("{}\n", variant(0)))));
    let request = Request::post("/v1/batch")
        .header("content-type", "application/x-ndjson")
        .body(Body::from_stream(endless))
        .unwrap();
    let response = service.response(request).await;
    let mut body = response.into_body().into_data_stream();
    assert!(body.next().await.is_some(), "answers come while the batch is still sent");
    assert_eq!(service.app.pool.batches(), 1);
    drop(body);
    until("it has ended", || service.app.pool.batches() == 0 && service.app.pool.running() == 0).await;
}

#[tokio::test]
async fn more_batches_than_are_admitted_are_refused_at_once() {
    let service = Service::within(Limits { max_concurrent_batches: 1, ..LIMITS });
    let place = service.app.pool.batch_place().unwrap();
    let refused = batch(&service, "", &[variant(0).to_string()]).await;
    assert_eq!(refused.header("retry-after"), "1");
    refused.refused(503, "queue_full");
    drop(place);
    assert_eq!(lines(&batch(&service, "", &[variant(0).to_string()]).await).len(), 1);
}

#[tokio::test]
async fn a_full_queue_is_no_reason_to_refuse_a_batchs_line() {
    let service = Service::within(Limits { max_concurrent_solves: 1, max_queued_solves: 0, ..LIMITS });
    let occupied = Occupied::by_one(&service.app.pool).await;
    let app = service.app.clone();
    let batch = tokio::spawn(async move { batch(&service, "", &[variant(0).to_string()]).await });
    until("the batch waits", || app.pool.batches() == 1).await;
    drop(occupied);
    assert_eq!(lines(&batch.await.unwrap())[0]["status"], 200);
}

#[tokio::test]
async fn a_line_beyond_the_deadline_is_a_problem_and_the_others_are_answered() {
    let service = Service::within(Limits { deadline_ms: 400, max_states: 100_000_000, ..LIMITS });
    let endless = with(&shortest(), "/sweep", json!({ "samples": 10_000_000 })).to_string();
    let found =
        lines(&batch(&service, "?peaks_only=true", &[variant(0).to_string(), endless, variant(2).to_string()]).await);
    let codes: Vec<_> = found.iter().map(|line| line["problem"]["code"].as_str()).collect();
    assert_eq!(codes, [None, Some("deadline_exceeded"), None]);
}

#[test]
fn without_a_server_a_batch_answers_the_same_lines() {
    let documents = format!("{}\n\n{{\n{}\n", variant(0), undercut());
    let mut child = Command::new(env!("CARGO_BIN_EXE_toothwave"))
        .args(["batch", "-", "--peaks-only"])
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    child.stdin.take().unwrap().write_all(documents.as_bytes()).unwrap();
    let output = child.wait_with_output().unwrap();
    assert!(output.status.success() && output.stderr.is_empty(), "{}", String::from_utf8_lossy(&output.stderr));
    let offline: Vec<Value> =
        String::from_utf8(output.stdout).unwrap().lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    let service = tokio::runtime::Runtime::new().unwrap();
    let online = service.block_on(async {
        lines(
            &batch(&Service::new(), "?peaks_only=true", &documents.lines().map(str::to_owned).collect::<Vec<_>>())
                .await,
        )
    });
    let (end, offline) = offline.split_last().unwrap();
    assert_eq!((offline, end), (online.as_slice(), &json!({ "asked": 3, "answered": 3 })));
}

/// Documents of very different length, so that slices end anywhere.
fn uneven(count: u64) -> Vec<String> {
    (0..count)
        .map(|index| with(&variant(index), "/sweep", json!({ "samples": 1 + 97 * index % 2000 })).to_string())
        .collect()
}

/// Lines of an answer as it goes over the wire, between the lengths of its pieces.
fn answered(answer: &Answer) -> usize {
    answer.text().lines().filter(|line| line.starts_with("{\"index\"")).count()
}

#[test]
fn many_batches_at_once_all_come_to_their_end() {
    let service = Listening::within(Limits { max_concurrent_solves: 2, max_concurrent_batches: 8, ..LIMITS });
    let address = service.address;
    let asked = |_| std::thread::spawn(move || ask_at(address, &question("?peaks_only=true", uneven(300).join("\n"))));
    let clients: Vec<_> = (0..8).map(asked).collect();
    for client in clients {
        assert_eq!(answered(&client.join().unwrap()), 300);
    }
}

#[tokio::test]
async fn batches_that_nobody_reads_hold_up_neither_single_requests_nor_other_batches() {
    let service = Service::within(Limits { max_concurrent_solves: 2, max_concurrent_batches: 8, ..LIMITS });
    let mut unread = Vec::new();
    for _ in 0..6 {
        let request = Request::post("/v1/batch")
            .header("content-type", "application/x-ndjson")
            .body(Body::from(uneven(300).join("\n")))
            .unwrap();
        let mut body = service.response(request).await.into_body().into_data_stream();
        assert!(body.next().await.is_some());
        unread.push(body);
    }
    for index in 0..4 {
        service.post("/v1/sweep", &variant(100 + index)).await.found();
    }
    assert_eq!(lines(&batch(&service, "?peaks_only=true", &uneven(200)).await).len(), 200);
    assert_eq!(service.app.pool.batches(), unread.len());
}

#[test]
fn a_whole_batch_may_be_sent_before_its_answers_are_read() {
    let service = Listening::within(Limits { max_concurrent_solves: 2, ..LIMITS });
    let answer = ask_at(service.address, &question("", vec![variant(0).to_string(); 6_000].join("\n")));
    assert_eq!(answered(&answer), 6_000);
}

/// A batch whose body is made of these pieces, the last of which may be a fault.
async fn sent_in_pieces(service: &Service, pieces: Vec<Result<Bytes, std::io::Error>>) -> Vec<Value> {
    let request = Request::post("/v1/batch?peaks_only=true")
        .header("content-type", "application/x-ndjson")
        .body(Body::from_stream(stream::iter(pieces)))
        .unwrap();
    service.send(request).await.text().lines().map(|line| serde_json::from_str(line).unwrap()).collect()
}

#[tokio::test]
async fn a_batch_that_breaks_off_ends_with_a_line_that_says_so() {
    let whole = Bytes::from(format!("{}\n{}\n{{\"dri", variant(0), variant(1)));
    let found = sent_in_pieces(&Service::new(), vec![Ok(whole), Err(std::io::Error::other("reset"))]).await;
    let [first, second, end] = found.as_slice() else { panic!("{found:?}") };
    assert_eq!((&first["status"], &second["status"]), (&json!(200), &json!(200)));
    assert_eq!((&end["asked"], &end["answered"]), (&json!(2), &json!(2)));
    assert_eq!(end["problem"]["code"], "broken_body");
}

/// A document, and then this again and again, each time within the patience.
async fn is_ended_that_drips(drip: &'static [u8]) {
    let service = Service::within(Limits { header_timeout_ms: 30_000, ..LIMITS });
    let drips = stream::unfold((), |()| async {
        tokio::time::sleep(std::time::Duration::from_secs(20)).await;
        Some((Ok::<_, std::io::Error>(Bytes::from_static(drip)), ()))
    });
    let request = Request::post("/v1/batch")
        .header("content-type", "application/x-ndjson")
        .body(Body::from_stream(stream::once(async { Ok(Bytes::from(format!("{}\n", variant(0)))) }).chain(drips)))
        .unwrap();
    let answer = service.send(request).await;
    let end: Value = serde_json::from_str(answer.text().lines().last().unwrap()).unwrap();
    assert_eq!((&end["asked"], &end["problem"]["code"]), (&json!(1), &json!("request_timeout")));
    assert_eq!(service.app.pool.batches(), 0);
}

#[tokio::test(start_paused = true)]
async fn a_batch_that_drips_is_ended() {
    is_ended_that_drips(b" ").await;
}

/// They would bring enough if they asked anything.
#[tokio::test(start_paused = true)]
async fn a_batch_of_blank_lines_without_end_is_ended() {
    is_ended_that_drips(&[b'\n'; 10_000]).await;
}

/// Something of a line each time, and less than 32 bytes a second of it.
#[tokio::test(start_paused = true)]
async fn a_batch_whose_line_never_comes_to_its_end_is_ended() {
    for drip in [&b"{"[..], &[b'{'; 600]] {
        is_ended_that_drips(drip).await;
    }
}

/// Slower than a machine, faster than nothing: a document each few seconds.
#[tokio::test(start_paused = true)]
async fn a_batch_that_is_sent_bit_by_bit_is_answered() {
    let documents = stream::unfold(0, |index| async move {
        tokio::time::sleep(std::time::Duration::from_secs(4)).await;
        (index < 40).then(|| (Ok::<_, std::io::Error>(Bytes::from(format!("{}\n", variant(index)))), index + 1))
    });
    let request = Request::post("/v1/batch?peaks_only=true")
        .header("content-type", "application/x-ndjson")
        .body(Body::from_stream(documents))
        .unwrap();
    let service = Service::within(Limits { header_timeout_ms: 30_000, ..LIMITS });
    assert_eq!(lines(&service.send(request).await).len(), 40);
}

/// Whoever sent through a proxy got no answer at all, though the first line was there.
#[tokio::test]
async fn behind_a_proxy_lines_that_have_come_are_told_of_a_stop_though_more_is_to_come() {
    let service = Service::new();
    let arriving =
        stream::iter([Ok::<_, Infallible>(Bytes::from(format!("{}\n", variant(0))))]).chain(stream::pending());
    let request = Request::post("/v1/batch?peaks_only=true")
        .header("content-type", "application/x-ndjson")
        .header("x-forwarded-for", "192.0.2.1");
    let mut response = std::pin::pin!(service.response(request.body(Body::from_stream(arriving)).unwrap()));
    assert!(futures_util::poll!(&mut response).is_pending());
    service.app.pool.close();
    let first = response.await.into_body().into_data_stream().next().await.unwrap().unwrap();
    let line: Value = serde_json::from_slice(&first).unwrap();
    assert_eq!((line["index"].as_u64(), line["problem"]["code"].as_str()), (Some(0), Some("shutting_down")));
}

/// It held up the stop for as long as that may take, and broke off without its last line.
#[tokio::test]
async fn a_batch_of_a_silent_client_has_its_last_line_when_the_service_stops() {
    let service = Service::new();
    let arriving =
        stream::iter([Ok::<_, Infallible>(Bytes::from(format!("{}\n", variant(0))))]).chain(stream::pending());
    let request = Request::post("/v1/batch?peaks_only=true").header("content-type", "application/x-ndjson");
    let response = service.response(request.body(Body::from_stream(arriving)).unwrap()).await;
    let mut told = response.into_body().into_data_stream();
    let first: Value = serde_json::from_slice(&told.next().await.unwrap().unwrap()).unwrap();
    assert_eq!(first["status"], 200);
    service.app.pool.close();
    let end: Value = serde_json::from_slice(&told.next().await.unwrap().unwrap()).unwrap();
    assert_eq!((&end["asked"], &end["answered"]), (&json!(1), &json!(1)));
    assert_eq!(end["problem"]["code"], "shutting_down");
    assert!(told.next().await.is_none());
}

/// nginx passes on no more of a request once its answer has begun: a batch of some megabytes broke off behind it.
#[tokio::test]
async fn behind_a_proxy_a_batch_is_read_before_its_answer_begins_and_directly_answered_while_it_is_sent() {
    for (forwarded_for, is_answered_at_once) in [(None, true), (Some("192.0.2.1"), false)] {
        let service = Service::new();
        let (send, sent) = tokio::sync::mpsc::unbounded_channel::<Bytes>();
        let arriving = stream::unfold(sent, |mut sent| async {
            sent.recv().await.map(|piece| (Ok::<_, Infallible>(piece), sent))
        });
        let mut request = Request::post("/v1/batch?peaks_only=true").header("content-type", "application/x-ndjson");
        if let Some(address) = forwarded_for {
            request = request.header("x-forwarded-for", address);
        }
        let response = service.response(request.body(Body::from_stream(arriving)).unwrap());
        let mut response = std::pin::pin!(response);
        let line = |index| Bytes::from(format!("{}\n", variant(index)));
        send.send(line(0)).unwrap();
        // As long as it could have begun in.
        let mut is_begun = false;
        for _ in 0..1000 {
            is_begun = is_begun || futures_util::poll!(&mut response).is_ready();
            if is_begun {
                break;
            }
            tokio::task::yield_now().await;
        }
        assert_eq!(is_begun, is_answered_at_once, "{forwarded_for:?}");
        if !is_begun {
            send.send(line(1)).unwrap();
            drop(send);
            let body = response.await.into_body();
            let text = axum::body::to_bytes(body, usize::MAX).await.unwrap();
            let last = text.split(|&byte| byte == b'\n').rfind(|line| !line.is_empty()).unwrap();
            assert_eq!(last, br#"{"asked":2,"answered":2}"#);
        }
    }
}

#[tokio::test]
async fn a_line_without_room_is_refused_in_its_place_and_the_others_are_answered() {
    let service = Service::within(Limits { max_unread_bytes: 30_000_000, max_concurrent_solves: 1, ..LIMITS });
    // Some 14 MB of answer, and half as much beside it while it is made.
    let long = with(&variant(0), "/sweep", json!({ "samples": 10_000 })).to_string();
    let found =
        lines(&batch(&service, "", &[variant(1).to_string(), long.clone(), long, variant(2).to_string()]).await);
    let codes: Vec<_> = found.iter().map(|line| line["problem"]["code"].as_str()).collect();
    assert!(codes[0].is_none() && codes[3].is_none(), "{codes:?}");
    assert!(codes[1..3].contains(&Some("too_many_unread_bytes")), "{codes:?}");
    assert_eq!(service.app.room.taken_bytes(), 0);
}

#[tokio::test]
async fn a_batch_takes_8_mib_and_one_more_for_each_permit_while_it_lasts() {
    for max_concurrent_solves in [1, 3] {
        let service = Service::within(Limits { max_concurrent_solves, ..LIMITS });
        let response = service.response(question("", variant(0).to_string()).request()).await;
        assert_eq!(service.app.room.taken_bytes(), (8 + max_concurrent_solves as u64) << 20);
        drop(response);
        assert_eq!(service.app.room.taken_bytes(), 0);
    }
}
