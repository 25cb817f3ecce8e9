//! What bad input and trouble get: RFC 9457 problems, each with the headers that HTTP wants.

use axum::body::Body;
use axum::http::Request;
use bytes_of::pending_forever;
use serde_json::json;
use toothwave::compute::Thread;
use toothwave::config::Limits;

use crate::asking::{Answer, ENDPOINTS, LIMITS, Occupied, Question, Service};
use crate::designs::{shortest, with};

/// Bodies that no client library would send.
mod bytes_of {
    use std::convert::Infallible;

    use axum::body::Body;
    use futures_util::stream;

    /// A body that begins and never ends.
    pub(super) fn pending_forever() -> Body {
        Body::from_stream(stream::pending::<Result<Vec<u8>, Infallible>>())
    }

    /// A body whose length nobody announces.
    pub(super) fn unannounced(text: String) -> Body {
        Body::from_stream(stream::iter([Ok::<_, Infallible>(text.into_bytes())]))
    }
}

fn sweep() -> Question {
    Question::post("/v1/sweep", shortest().to_string())
}

/// A problem of each kind that a request alone can provoke, with its status and code.
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
async fn every_problem_is_problem_json_with_type_title_status_detail_and_code() {
    let service = Service::within(Limits { max_profile_points: 10_000, ..LIMITS });
    for (answer, status, code) in provoked(&service).await {
        answer.refused(status, code);
    }
}

#[tokio::test]
async fn every_problem_carries_the_headers_that_browsers_ask_for() {
    let service = Service::for_origins(&["https://cad.example", "https://other.example"]);
    for (answer, status, _) in provoked(&service).await {
        assert_eq!(answer.header("access-control-allow-origin"), "https://cad.example", "{status}");
        let exposed = answer.header("access-control-expose-headers").to_ascii_lowercase();
        for header in ["etag", "location", "retry-after", "cache-status", "preference-applied", "server-timing"] {
            assert!(exposed.contains(header), "{status}: {exposed}");
        }
    }
}

#[tokio::test]
async fn a_service_that_is_full_answers_browsers_too() {
    let limits = Limits { max_concurrent_solves: 1, max_queued_solves: 0, ..LIMITS };
    let service = Service::within_for_origins(limits, &["*"]);
    let occupied = Occupied::by_one(&service.app.pool).await;
    let answer = service.ask(&sweep().with("origin", "https://cad.example")).await;
    answer.refused(503, "queue_full");
    assert_eq!(answer.header("access-control-allow-origin"), "*");
    occupied.end().await;
}

#[tokio::test]
async fn answers_name_an_allowed_origin_and_no_other() {
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
async fn a_browser_that_asks_first_is_allowed_to_post_json() {
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
async fn the_answer_to_a_browser_that_asks_first_has_a_request_id_too() {
    let answer = Service::for_origins(&["https://cad.example"]).ask(&preflight()).await;
    assert_ne!(answer.header("x-request-id"), "");
}

#[tokio::test]
async fn a_request_id_that_the_client_chose_comes_back() {
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
async fn nothing_stands_at_any_other_path() {
    let service = Service::new();
    for path in
        ["/v1", "/v1/", "/v1/sweep/", "/V1/sweep", "/v1/Sweep", "/v2/sweep", "/v1/examples/", "/v1/examples/paper-5.3"]
    {
        for method in ["GET", "POST"] {
            let answer = service.ask(&Question::of(method, path)).await;
            // A path with a name in it knows GET alone, whatever the name.
            if (method, path) != ("POST", "/v1/examples/paper-5.3") {
                answer.refused(404, "not_found");
            }
        }
    }
}

#[tokio::test]
async fn nothing_stands_beside_the_pages_of_the_documentation_either() {
    let service = Service::new();
    for path in ["/docs/nothing.js", "/docs/v1/sweep", "/docs/../main.rs"] {
        service.get(path).await.refused(404, "not_found");
    }
}

#[tokio::test]
async fn a_name_that_is_no_text_is_no_examples_name() {
    let answer = Service::new().get("/v1/examples/%FF").await;
    assert!([400, 404].contains(&answer.status));
    answer.problem();
}

#[tokio::test]
async fn a_path_that_knows_other_methods_lists_them() {
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
async fn head_gets_what_get_gets_without_the_body() {
    let service = Service::new();
    for path in ["/v1/limits", "/v1/examples/paper-5.1", "/health/live", "/openapi.json", "/docs/"] {
        let (get, head) = (service.get(path).await, service.ask(&Question::of("HEAD", path)).await);
        assert_eq!((head.status, head.header("content-type")), (200, get.header("content-type")), "{path}");
        assert!(head.body.is_empty());
    }
}

#[tokio::test]
async fn the_best_format_that_the_client_accepts_is_chosen() {
    let service = Service::new();
    for (accept, expected) in [
        ("application/json; charset=utf-8", "application/json"),
        ("text/csv; charset=utf-8; header=present", "text/csv"),
        ("text/csv;charset=utf-8;q=0.5, application/json;charset=utf-8;q=0.4", "text/csv"),
        // What cannot be read is passed over, as empty items are, and a list in quotes.
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
async fn a_client_that_accepts_no_format_of_a_path_is_told_which_there_are() {
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

/// Thousands of ranges took milliseconds each, in which nobody else was answered.
#[tokio::test]
async fn of_lists_of_what_is_accepted_no_more_is_read_than_anybody_sends() {
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
async fn a_body_that_is_too_large_is_refused_with_its_length_and_the_limit() {
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

#[tokio::test]
async fn a_body_that_is_too_large_is_refused_even_where_nobody_announced_it() {
    let service = Service::within(Limits { max_body_bytes: 1_000, ..LIMITS });
    let padded = |length: usize| format!("{:length$}", shortest().to_string());
    let request = |length| {
        let request = Request::post("/v1/sweep").header("content-type", "application/json");
        request.body(bytes_of::unannounced(padded(length))).unwrap()
    };
    assert_eq!(service.send(request(1_000)).await.status, 200);
    let problem = service.send(request(1_001)).await.refused(413, "body_too_large");
    assert_eq!(problem["detail"], "the body has more than the 1000 bytes of `max_body_bytes`");
}

#[tokio::test]
async fn a_body_that_is_announced_too_large_is_not_even_read() {
    let request =
        Request::post("/v1/sweep").header("content-type", "application/json").header("content-length", "65537");
    let answer = Service::new().send(request.body(pending_forever()).unwrap()).await;
    assert!(answer.refused(413, "body_too_large")["detail"].as_str().unwrap().contains("65537"));
}

#[tokio::test]
async fn a_body_that_does_not_arrive_is_not_waited_for_beyond_the_deadline() {
    let service = Service::within(Limits { deadline_ms: 5, ..LIMITS });
    let request = Request::post("/v1/sweep").header("content-type", "application/json");
    service.send(request.body(pending_forever()).unwrap()).await.refused(408, "request_timeout");
}

#[tokio::test]
async fn a_body_is_json_by_its_content_type() {
    let service = Service::new();
    let of_type = |content_type: &str| {
        let request = Request::post("/v1/sweep").header("content-type", content_type);
        request.body(Body::from(shortest().to_string())).unwrap()
    };
    for content_type in [
        "application/json",
        "application/json; charset=utf-8",
        "Application/JSON",
        "application/vnd.cad+json",
        "application/json;v=1",
    ] {
        assert_eq!(service.send(of_type(content_type)).await.status, 200, "{content_type}");
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
        service.send(of_type(content_type)).await.refused(415, "unsupported_media_type");
    }
    let untyped = Request::post("/v1/sweep").body(Body::from(shortest().to_string())).unwrap();
    let problem = service.send(untyped).await.refused(415, "unsupported_media_type");
    assert!(problem["detail"].as_str().unwrap().contains("application/json"), "{problem}");
}

#[tokio::test]
async fn a_body_in_a_content_coding_is_refused() {
    let service = Service::new();
    for coding in ["gzip", "br", "gzip, gzip", "x"] {
        service.ask(&sweep().with("content-encoding", coding)).await.refused(415, "unsupported_media_type");
    }
    assert_eq!(service.ask(&sweep().with("content-encoding", "identity")).await.status, 200);
}

#[tokio::test]
async fn a_full_service_says_when_to_try_again() {
    let service = Service::within(Limits { max_concurrent_solves: 1, max_queued_solves: 0, ..LIMITS });
    let occupied = Occupied::by_one(&service.app.pool).await;
    let answer = service.ask(&sweep()).await;
    answer.refused(503, "queue_full");
    assert!(answer.header("retry-after").parse::<u32>().unwrap() >= 1);
    occupied.end().await;
    assert_eq!(service.ask(&sweep()).await.status, 200, "and then it has room");
}

#[tokio::test]
async fn refusals_are_not_for_keeping() {
    let service = Service::within(Limits { max_profile_points: 10_000, ..LIMITS });
    for (answer, status, _) in provoked(&service).await {
        for header in ["etag", "cache-status"] {
            assert_eq!(answer.header(header), "", "{status}");
        }
    }
}

#[tokio::test]
async fn a_panic_is_an_internal_error_that_tells_nothing_of_itself() {
    let service = Service::new();
    let pool = &service.app.pool;
    for thread in [Thread::Blocking, Thread::Executor] {
        let problem = pool.run::<()>(pool.deadline(), thread, |_| panic!("the flux capacitor")).await.unwrap_err();
        assert_eq!(problem.status, 500);
        assert!(!serde_json::to_string(&problem).unwrap().contains("flux"), "{problem}");
        assert_eq!((pool.running(), pool.admitted()), (0, 0), "and its permit is back");
    }
}
