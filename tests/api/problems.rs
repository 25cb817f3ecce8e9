//! Responses to bad input and faults: RFC 9457 problems with the headers that HTTP requires.

use std::io::Write as _;
use std::net::TcpStream;

use serde_json::json;

use crate::asking::{Answer, ENDLESS, ENDPOINTS, LIMITS, Limits, Question, Service, answer_on, ask_at, endless};
use crate::designs::{shortest, with};

fn sweep() -> Question {
    Question::post("/v1/sweep", shortest().to_string())
}

/// Provokes each problem that a request alone can cause. Returns it with expected status and code.
async fn provoked(service: &Service) -> Vec<(Answer, u16, &'static str)> {
    let huge = " ".repeat(LIMITS.max_body_bytes + 1);
    let impossible = with(&shortest(), "/drive/teeth/radius_mm", json!(0.0)).to_string();
    let unloaded = with(&shortest(), "/drive/teeth/installed", json!(4)).to_string();
    let many = with(&shortest(), "/sweep", json!({ "samples": 10_000_000 })).to_string();
    let points = json!({ "extent": "full", "chord_tolerance_mm": 1e-6 });
    let points = with(&shortest(), "/profile", points).to_string();
    let questions = [
        (Question::post("/v1/sweep", "{"), 400, "malformed_json"),
        (Question::of("GET", "/v2/sweep"), 404, "not_found"),
        (Question::of("GET", "/v1/examples/paper-5.3"), 404, "not_found"),
        (Question::of("GET", "/v1/sweep"), 405, "method_not_allowed"),
        (sweep().with("accept", "image/png"), 406, "not_acceptable"),
        (Question::post("/v1/sweep", huge), 413, "body_too_large"),
        (Question::of("POST", "/v1/sweep"), 415, "unsupported_media_type"),
        (Question::post("/v1/sweep", "{}"), 422, "invalid_document"),
        (Question::post("/v1/sweep", impossible), 422, "impossible_design"),
        (Question::post("/v1/sweep", unloaded), 422, "no_tooth_in_mesh"),
        (Question::post("/v1/sweep", many), 422, "too_many_states"),
        (Question::post("/v1/geometry", points), 422, "too_many_points"),
    ];
    let mut provoked = Vec::new();
    for (question, status, code) in questions {
        let question = question.with("origin", "https://cad.example");
        provoked.push((service.ask(&question).await, status, code));
    }
    provoked
}

#[tokio::test]
async fn every_problem_is_complete_problem_json() {
    let service = Service::within(Limits { max_states: 10_000, ..LIMITS });
    for (answer, status, code) in provoked(&service).await {
        answer.refused(status, code);
    }
}

#[tokio::test]
async fn every_problem_carries_headers_for_browsers() {
    let service = Service::for_origins(&["https://cad.example", "https://other.example"]);
    for (answer, status, _) in provoked(&service).await {
        assert_eq!(answer.header("access-control-allow-origin"), "https://cad.example", "{status}");
        let exposed = answer.header("access-control-expose-headers").to_ascii_lowercase();
        for header in ["etag", "location", "retry-after", "cache-status", "preference-applied", "server-timing"] {
            assert!(exposed.contains(header), "{status}: {exposed}");
        }
    }
}

#[test]
fn full_service_tells_browsers_when_to_retry() {
    let limits = Limits { max_concurrent_solves: 1, ..ENDLESS };
    let service = Service::with(limits, &["--cors-origin", "*"]);
    let occupied = service.occupied_by(1);
    let waiting: Vec<_> = (1..33).map(|number| service.send(&endless(number))).collect();
    service.until("toothwave_solves_queued", 32.0);
    let answer = ask_at(service.address(), &sweep().with("origin", "https://cad.example"));
    answer.refused(503, "queue_full");
    assert_eq!((answer.header("access-control-allow-origin"), answer.header("retry-after")), ("*", "1"));
    drop((occupied, waiting));
}

#[tokio::test]
async fn answers_name_only_allowed_origin() {
    let service = Service::for_origins(&["https://cad.example"]);
    let from = |origin| sweep().with("origin", origin);
    assert_eq!(
        service.ask(&from("https://cad.example")).await.header("access-control-allow-origin"),
        "https://cad.example"
    );
    assert_eq!(service.ask(&from("https://evil.example")).await.header("access-control-allow-origin"), "");
    let anyone = Service::for_origins(&["*"]);
    assert_eq!(anyone.ask(&from("https://evil.example")).await.header("access-control-allow-origin"), "*");
    assert_eq!(Service::new().ask(&from("https://cad.example")).await.header("access-control-allow-origin"), "");
}

fn preflight() -> Question {
    Question::of("OPTIONS", "/v1/sweep")
        .with("origin", "https://cad.example")
        .with("access-control-request-method", "POST")
        .with("access-control-request-headers", "content-type,if-none-match")
}

#[tokio::test]
async fn preflight_request_allows_posting_json() {
    let answer = Service::for_origins(&["https://cad.example"]).ask(&preflight()).await;
    assert_eq!(answer.status, 200);
    assert_eq!(answer.header("access-control-allow-origin"), "https://cad.example");
    for (header, wanted) in [("access-control-allow-methods", "post"), ("access-control-allow-headers", "content-type")]
    {
        let allowed = answer.header(header).to_ascii_lowercase();
        assert!(allowed == "*" || allowed.contains(wanted), "{header}: {allowed}");
    }
}

#[tokio::test]
async fn every_answer_has_a_request_id() {
    let service = Service::for_origins(&["https://cad.example"]);
    let mut ids = Vec::new();
    for (answer, ..) in provoked(&service).await {
        ids.push(answer.header("x-request-id").to_owned());
    }
    for path in [
        "/",
        "/docs",
        "/docs/",
        "/openapi.json",
        "/health/live",
        "/health/ready",
        "/metrics",
        "/v1/limits",
        "/v1/examples",
    ] {
        ids.push(service.get(path).await.header("x-request-id").to_owned());
    }
    ids.push(service.ask(&sweep()).await.header("x-request-id").to_owned());
    assert!(ids.iter().all(|id| !id.is_empty()), "{ids:?}");
    let count = ids.len();
    ids.sort_unstable();
    ids.dedup();
    assert_eq!(ids.len(), count, "each has its own");
}

#[tokio::test]
async fn preflight_answer_has_request_id() {
    let answer = Service::for_origins(&["https://cad.example"]).ask(&preflight()).await;
    assert_ne!(answer.header("x-request-id"), "");
}

#[tokio::test]
async fn request_id_of_client_is_returned() {
    let service = Service::new();
    for question in [
        sweep(),
        Question::of("GET", "/nowhere"),
        Question::post("/v1/sweep", "{"),
        Question::of("GET", "/health/live"),
    ] {
        let answer = service.ask(&question.with("x-request-id", "drawing-4711")).await;
        assert_eq!(answer.header("x-request-id"), "drawing-4711");
    }
}

#[tokio::test]
async fn unknown_path_is_not_found() {
    let service = Service::new();
    for path in
        ["/v1", "/v1/", "/v1/sweep/", "/V1/sweep", "/v1/Sweep", "/v2/sweep", "/v1/examples/", "/v1/examples/paper-5.3"]
    {
        for method in ["GET", "POST"] {
            let answer = service.ask(&Question::of(method, path)).await;
            // A path with a name allows only GET, for any name.
            if (method, path) != ("POST", "/v1/examples/paper-5.3") {
                answer.refused(404, "not_found");
            }
        }
    }
}

#[tokio::test]
async fn unknown_documentation_path_is_not_found() {
    let service = Service::new();
    for path in ["/docs/nothing.js", "/docs/v1/sweep", "/docs/../main.rs"] {
        service.get(path).await.refused(404, "not_found");
    }
}

#[tokio::test]
async fn example_name_without_valid_text_is_not_found() {
    let answer = Service::new().get("/v1/examples/%FF").await;
    assert!([400, 404].contains(&answer.status));
    answer.problem();
}

#[tokio::test]
async fn wrong_method_lists_allowed_ones() {
    let service = Service::new();
    let posts = ENDPOINTS.map(|path| (path, "POST"));
    let gets = [
        "/v1/limits",
        "/v1/examples",
        "/v1/examples/paper-5.1",
        "/health/live",
        "/health/ready",
        "/metrics",
        "/openapi.json",
    ];
    for (path, known) in posts.into_iter().chain(gets.map(|path| (path, "GET"))) {
        for method in ["GET", "POST", "PUT", "PATCH", "DELETE", "OPTIONS", "BREW"] {
            if method != known {
                let answer = service.ask(&Question::of(method, path)).await;
                let problem = answer.refused(405, "method_not_allowed");
                assert!(
                    answer.header("allow").split(',').any(|allowed| allowed.trim() == known),
                    "{path}: {:?}",
                    answer.headers
                );
                assert!(problem["detail"].as_str().unwrap().contains(method), "{problem}");
            }
        }
    }
}

#[tokio::test]
async fn head_equals_get_without_body() {
    let service = Service::new();
    for path in ["/v1/limits", "/v1/examples/paper-5.1", "/health/live", "/openapi.json", "/docs/"] {
        let (get, head) = (service.get(path).await, service.ask(&Question::of("HEAD", path)).await);
        assert_eq!((head.status, head.header("content-type")), (200, get.header("content-type")), "{path}");
        assert!(head.body.is_empty());
    }
}

#[tokio::test]
async fn accept_header_chooses_best_format() {
    let service = Service::new();
    for (accept, expected) in [
        ("application/json; charset=utf-8", "application/json"),
        ("text/csv; charset=utf-8; header=present", "text/csv"),
        ("text/csv;charset=utf-8;q=0.5, application/json;charset=utf-8;q=0.4", "text/csv"),
        // Unreadable items are skipped, like empty ones and a quoted list.
        ("text/html, image/gif, image/jpeg, *; q=.2, */*; q=.2", "application/json"),
        ("text/csv, ,", "text/csv"),
        ("text/csv, text/x;a=\"b,c\"", "text/csv"),
        ("*/*", "application/json"),
        ("application/*", "application/json"),
        ("text/*", "text/csv"),
        ("text/csv", "text/csv"),
        ("TEXT/CSV", "text/csv"),
        ("text/csv;q=0.9, application/json;q=0.1", "text/csv"),
        ("text/csv;q=0.1, application/json;q=0.9", "application/json"),
        ("text/csv;q=0.5, */*", "application/json"),
        ("application/json;q=0, */*", "text/csv"),
        ("text/plain", "text/plain"),
        ("image/*", "image/svg+xml"),
        ("image/svg+xml, text/plain;q=0.5", "image/svg+xml"),
        ("text/csv;q=0, */*;q=0.1", "application/json"),
        ("text/html, application/json;q=0.1", "application/json"),
    ] {
        let answer = service.ask(&sweep().with("accept", accept)).await;
        assert_eq!(answer.status, 200, "{accept}");
        assert_eq!(answer.header("content-type").split(';').next(), Some(expected), "{accept}");
    }
}

#[tokio::test]
async fn unaccepted_formats_get_list_of_available_ones() {
    let service = Service::new();
    for accept in ["image/png", "text/html", "application/json;q=0", "*/*;q=0", "application/xml, image/vnd.dxf"] {
        let problem = service.ask(&sweep().with("accept", accept)).await.refused(406, "not_acceptable");
        let detail = problem["detail"].as_str().unwrap();
        assert!(detail.contains("application/json") && detail.contains("text/csv"), "{detail}");
    }
    for (path, accept, known) in [
        ("/v1/geometry", "image/svg+xml", "text/plain"),
        ("/v1/coincidence-degree", "image/svg+xml", "text/csv"),
        ("/v1/drawings/ring", "text/csv", "image/vnd.dxf"),
    ] {
        let question = Question::post(path, shortest().to_string()).with("accept", accept);
        let problem = service.ask(&question).await.refused(406, "not_acceptable");
        let detail = problem["detail"].as_str().unwrap();
        assert!(detail.contains("application/json") && detail.contains(known), "{detail}");
    }
}

/// Thousands of ranges would take milliseconds and delay other requests.
#[tokio::test]
async fn reads_limited_number_of_accept_ranges() {
    let service = Service::new();
    let list = |length: usize| format!("application/json,{}", "a/b,".repeat(length / 4));
    assert_eq!(service.ask(&sweep().with("accept", &list(4000))).await.status, 200);
    let problem = service.ask(&sweep().with("accept", &list(4100))).await.refused(406, "not_acceptable");
    assert!(problem["detail"].as_str().unwrap().contains("4096"), "{problem}");
    for (length, coding) in [(4000, "gzip"), (4100, "")] {
        let list = format!("gzip,{}", "ab,".repeat(length / 3));
        assert_eq!(service.ask(&sweep().with("accept-encoding", &list)).await.header("content-encoding"), coding);
    }
}

#[tokio::test]
async fn refusal_of_large_body_states_length_and_limit() {
    let service = Service::within(Limits { max_body_bytes: 1_000, ..LIMITS });
    let padded = |length: usize| format!("{:length$}", shortest().to_string());
    for path in ENDPOINTS {
        assert_eq!(service.post_text(path, padded(1_000)).await.status, 200, "as large as may be");
        let announced = Question::post(path, padded(1_001)).with("content-length", "1001");
        let problem = service.ask(&announced).await.refused(413, "body_too_large");
        let detail = problem["detail"].as_str().unwrap();
        assert!(detail.contains("1001") && detail.contains("1000"), "{detail}");
    }
}

/// Makes a request with a chunked body, so that no header states its length.
fn unannounced(text: &str, end: &str) -> Vec<u8> {
    let head = "POST /v1/sweep HTTP/1.1\r\nhost: localhost\r\nconnection: close\r\ncontent-type: application/json";
    format!("{head}\r\ntransfer-encoding: chunked\r\n\r\n{:x}\r\n{text}\r\n{end}", text.len()).into_bytes()
}

fn sent(service: &Service, bytes: &[u8]) -> Answer {
    let mut stream = TcpStream::connect(service.address()).unwrap();
    stream.write_all(bytes).unwrap();
    answer_on(stream)
}

#[test]
fn rejects_unannounced_body_over_limit() {
    let service = Service::within(Limits { max_body_bytes: 1_000, ..LIMITS });
    let padded = |length: usize| format!("{:length$}", shortest().to_string());
    assert_eq!(sent(&service, &unannounced(&padded(1_000), "0\r\n\r\n")).status, 200);
    let problem = sent(&service, &unannounced(&padded(1_001), "0\r\n\r\n")).refused(413, "body_too_large");
    assert!(problem["detail"].as_str().unwrap().contains("more than 1000"), "{problem}");
}

#[test]
fn rejects_body_that_breaks_off() {
    sent(&Service::new(), &unannounced("{\"dri", "no length\r\n")).refused(400, "broken_body");
}

/// The service refuses before most of the body has arrived.
#[test]
fn client_sending_large_body_receives_refusal() {
    let service = Service::new();
    ask_at(service.address(), &Question::post("/v1/sweep", " ".repeat(900_000))).refused(413, "body_too_large");
}

#[test]
fn body_that_stops_arriving_times_out() {
    let service = Service::within(Limits { deadline_ms: 5, ..LIMITS });
    sent(&service, &unannounced("{", "")).refused(408, "request_timeout");
}

#[tokio::test]
async fn content_type_must_be_json() {
    let service = Service::new();
    let of_type = |content_type: &str| Question::post_as(content_type, "/v1/sweep", shortest().to_string());
    for content_type in [
        "application/json",
        "application/json; charset=utf-8",
        "Application/JSON",
        "application/vnd.cad+json",
        "application/json;v=1",
    ] {
        assert_eq!(service.ask(&of_type(content_type)).await.status, 200, "{content_type}");
    }
    for content_type in [
        "text/plain",
        "application/xml",
        "application/x-www-form-urlencoded",
        "multipart/form-data; boundary=x",
        "json",
        "text/json",
        "",
        ";",
    ] {
        service.ask(&of_type(content_type)).await.refused(415, "unsupported_media_type");
    }
    let untyped = Question::of("POST", "/v1/sweep");
    let problem = service.ask(&untyped).await.refused(415, "unsupported_media_type");
    assert!(problem["detail"].as_str().unwrap().contains("application/json"), "{problem}");
}

#[tokio::test]
async fn body_with_content_coding_is_refused() {
    let service = Service::new();
    for coding in ["gzip", "br", "gzip, gzip", "x"] {
        service.ask(&sweep().with("content-encoding", coding)).await.refused(415, "unsupported_media_type");
    }
    assert_eq!(service.ask(&sweep().with("content-encoding", "identity")).await.status, 200);
}

#[tokio::test]
async fn refusals_are_not_cacheable() {
    let service = Service::within(Limits { max_states: 10_000, ..LIMITS });
    for (answer, status, _) in provoked(&service).await {
        for header in ["etag", "cache-status"] {
            assert_eq!(answer.header(header), "", "{status}");
        }
    }
}
