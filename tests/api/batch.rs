//! Batches: one document and one answer for each line, in order.

use std::io::{Read as _, Write as _};
use std::net::TcpStream;
use std::process::{Command, Stdio};

use serde_json::{Value, json};

use crate::asking::{Answer, ENDLESS, LIMITS, Limits, Question, Service, answer_on, ask_at};
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

/// Returns case 5.1 with another torque for each index, so that each answer identifies its document.
fn variant(index: u64) -> Value {
    with(&with(&shortest(), "/model", of_the_paper()), "/load/input_torque_nm", json!(20.0 + index as f64))
}

#[tokio::test]
async fn answers_each_document_as_alone() {
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
async fn answers_keep_order_of_a_thousand_documents() {
    let documents: Vec<_> = (0..1000).map(|index| variant(index).to_string()).collect();
    let found = lines(&batch(&Service::new(), "?peaks_only=true", &documents).await);
    assert_eq!(found.len(), 1000);
    let first = found[0]["answer"]["peaks"]["ring"]["force_n"]["value"].as_f64().unwrap();
    for (index, line) in found.iter().enumerate() {
        assert_eq!(line["index"], index);
        // Forces are proportional to the torque.
        let force_n = line["answer"]["peaks"]["ring"]["force_n"]["value"].as_f64().unwrap();
        assert!((force_n / first / ((20.0 + index as f64) / 20.0) - 1.0).abs() < 1e-12, "{index}");
    }
}

#[tokio::test]
async fn peaks_only_equal_peaks_of_full_answer() {
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
async fn skips_blank_lines_and_reports_long_line() {
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
async fn empty_batch_answers_last_line_only() {
    assert!(lines(&batch(&Service::new(), "", &[]).await).is_empty());
}

#[tokio::test]
async fn rejects_body_that_is_no_batch() {
    let service = Service::new();
    for query in ["?endpoint=accuracy", "?states=false", "?peaks_only=1", "?endpoint=geometry&peaks_only=true"] {
        batch(&service, query, &[variant(0).to_string()]).await.refused(400, "invalid_query");
    }
    let question = Question::post("/v1/batch", variant(0).to_string());
    service.ask(&question).await.refused(415, "unsupported_media_type");
}

#[tokio::test]
async fn line_over_deadline_fails_alone() {
    let service = Service::within(Limits { deadline_ms: 400, ..ENDLESS });
    let endless = with(&shortest(), "/sweep", json!({ "samples": 10_000_000 })).to_string();
    let found =
        lines(&batch(&service, "?peaks_only=true", &[variant(0).to_string(), endless, variant(2).to_string()]).await);
    let codes: Vec<_> = found.iter().map(|line| line["problem"]["code"].as_str()).collect();
    assert_eq!(codes, [None, Some("deadline_exceeded"), None]);
}

#[test]
fn command_line_batch_answers_same_lines() {
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

/// Returns documents of very different lengths, so that slices end anywhere.
fn uneven(count: u64) -> Vec<String> {
    (0..count)
        .map(|index| with(&variant(index), "/sweep", json!({ "samples": 1 + 97 * index % 2000 })).to_string())
        .collect()
}

/// Sends the head of a batch in chunks, through a proxy or directly.
fn open(service: &Service, is_behind_proxy: bool) -> TcpStream {
    let mut stream = TcpStream::connect(service.address()).unwrap();
    let forwarded = if is_behind_proxy { "x-forwarded-for: 192.0.2.1\r\n" } else { "" };
    let head = "POST /v1/batch?peaks_only=true HTTP/1.1\r\nhost: localhost\r\nconnection: close\r\n";
    let body = "content-type: application/x-ndjson\r\ntransfer-encoding: chunked\r\n\r\n";
    stream.write_all(format!("{head}{forwarded}{body}").as_bytes()).unwrap();
    stream
}

fn send(stream: &mut TcpStream, piece: &str) {
    stream.write_all(format!("{:x}\r\n{piece}\r\n", piece.len()).as_bytes()).unwrap();
}

/// Reads until the answer contains this text.
fn read_until(stream: &mut TcpStream, text: &str) {
    let (mut read, mut buffer) = (String::new(), [0; 4096]);
    while !read.contains(text) {
        let length = stream.read(&mut buffer).unwrap();
        assert!(length > 0, "{read}");
        read.push_str(&String::from_utf8_lossy(&buffer[..length]));
    }
}

#[test]
fn line_may_arrive_in_any_pieces() {
    let service = Service::new();
    let mut stream = open(&service, false);
    let text = format!("{}\n{}", variant(0), variant(1));
    for piece in text.as_bytes().chunks(7) {
        send(&mut stream, std::str::from_utf8(piece).unwrap());
    }
    stream.write_all(b"0\r\n\r\n").unwrap();
    let found = lines(&answer_on(stream));
    assert!(found.len() == 2 && found.iter().all(|line| line["status"] == 200));
}

#[test]
fn answers_lines_while_others_arrive() {
    let service = Service::new();
    let mut stream = open(&service, false);
    send(&mut stream, &format!("{}\n", variant(0)));
    read_until(&mut stream, "\"index\":0");
    send(&mut stream, &format!("{}\n", variant(1)));
    read_until(&mut stream, "\"index\":1");
}

/// nginx forwards no more of a request once its answer has begun.
#[test]
fn batch_behind_proxy_is_read_first() {
    let service = Service::new();
    let mut stream = open(&service, true);
    for index in 0..100 {
        send(&mut stream, &format!("{}\n", variant(index)));
    }
    stream.set_nonblocking(true).unwrap();
    // The service answers other requests meanwhile, so the batch's answer could have begun.
    assert_eq!(ask_at(service.address(), &Question::post("/v1/sweep", variant(7).to_string())).status, 200);
    assert!(stream.read(&mut [0; 1]).is_err(), "no byte of the answer before the end of the batch");
    stream.set_nonblocking(false).unwrap();
    stream.write_all(b"0\r\n\r\n").unwrap();
    assert_eq!(lines(&answer_on(stream)).len(), 100);
}

#[test]
fn whole_batch_may_be_sent_before_reading() {
    let service = Service::new();
    let answer =
        ask_at(service.address(), &question("?peaks_only=true", vec![variant(0).to_string(); 2_000].join("\n")));
    assert_eq!(lines(&answer).len(), 2_000);
}

#[test]
fn many_batches_all_end() {
    let service = Service::new();
    let address = service.address();
    let asked = |_| std::thread::spawn(move || ask_at(address, &question("?peaks_only=true", uneven(100).join("\n"))));
    let clients: Vec<_> = (0..16).map(asked).collect();
    for client in clients {
        assert_eq!(lines(&client.join().unwrap()).len(), 100);
    }
}

#[test]
fn broken_batch_ends_with_its_reason() {
    let service = Service::new();
    let mut stream = open(&service, false);
    send(&mut stream, &format!("{}\n{}\n{{\"dri", variant(0), variant(1)));
    read_until(&mut stream, "\"index\":1");
    stream.write_all(b"no length\r\n").unwrap();
    read_until(&mut stream, "\"code\":\"broken_body\"");
}

#[test]
fn open_batch_gets_last_line_at_shutdown() {
    let service = Service::with(LIMITS, &["--shutdown-ms", "500"]);
    let mut stream = open(&service, false);
    send(&mut stream, &format!("{}\n", variant(0)));
    read_until(&mut stream, "\"index\":0");
    service.process().signalled("-TERM");
    read_until(&mut stream, "\"code\":\"shutting_down\"");
}

#[test]
fn unread_batches_delay_no_one() {
    let service = Service::new();
    let _unread: Vec<_> = (0..6).map(|_| service.send(&question("", uneven(300).join("\n")))).collect();
    for index in 0..4 {
        assert_eq!(
            ask_at(service.address(), &Question::post("/v1/sweep", variant(100 + index).to_string())).status,
            200
        );
    }
    let answer = ask_at(service.address(), &question("?peaks_only=true", uneven(50).join("\n")));
    assert_eq!(lines(&answer).len(), 50);
}
