//! Health, limits, metrics, and the documentation page.

use std::collections::BTreeSet;

use serde_json::Value;

use crate::asking::{ENDLESS, ENDPOINTS, LIMITS, Limits, Question, Service, endless};
use crate::designs::spelled_out;

/// Returns the names of all series in Prometheus text, with one name for each histogram.
fn series(text: &str) -> BTreeSet<String> {
    let names = text.lines().filter(|line| !line.starts_with('#') && !line.is_empty()).map(|line| {
        let name = line.split(['{', ' ']).next().unwrap();
        ["_bucket", "_sum", "_count"].iter().find_map(|end| name.strip_suffix(end)).unwrap_or(name).to_owned()
    });
    names.collect()
}

#[tokio::test]
async fn documented_series_are_the_exported_ones() {
    // Causes one count in each series.
    let service = Service::within(Limits { deadline_ms: 200, ..ENDLESS });
    service.post("/v1/sweep", &spelled_out()).await.found();
    let line = Question::post_as("application/x-ndjson", "/v1/batch", spelled_out().to_string());
    assert_eq!(service.ask(&line).await.status, 200);
    service.ask(&endless(0)).await.refused(503, "deadline_exceeded");
    let text = service.get("/metrics").await.text().to_owned();
    for series in series(&text) {
        assert!(text.contains(&format!("# HELP {series} ")), "{series} says nothing of itself");
    }
    let documented: BTreeSet<String> = include_str!("../../docs/reference/service.md")
        .split('`')
        .filter(|word| word.starts_with("toothwave_") || word.starts_with("process_"))
        .map(|word| word.split('{').next().unwrap().to_owned())
        .collect();
    assert_eq!(series(&text), documented);
}

#[tokio::test]
async fn metrics_count_requests_cache_and_solves() {
    let service = Service::new();
    service.post("/v1/sweep", &spelled_out()).await.found();
    service.post("/v1/sweep", &spelled_out()).await.found();
    service.get("/nowhere").await.problem();
    let answer = service.get("/metrics").await;
    assert_eq!(answer.status, 200);
    assert!(
        answer.header("content-type").starts_with("text/plain; version=0.0.4"),
        "{}",
        answer.header("content-type")
    );
    let text = answer.text();
    for line in text.lines().filter(|line| !line.starts_with('#') && !line.is_empty()) {
        let (_, value) = line.rsplit_once(' ').unwrap();
        assert!(value.parse::<f64>().is_ok(), "{line}");
    }
    for sample in [
        "toothwave_http_requests_total{route=\"/v1/sweep\",method=\"POST\",status=\"200\"}",
        "toothwave_http_requests_total{route=\"none\",method=\"GET\",status=\"404\"}",
        "toothwave_http_request_duration_seconds_bucket{route=\"/v1/sweep\",le=",
        "toothwave_cache_requests_total{status=\"hit\"}",
        "toothwave_cache_requests_total{status=\"miss\"}",
        "toothwave_cache_bytes ",
        "toothwave_cache_entries ",
        "toothwave_solve_duration_seconds_count ",
        "toothwave_solves_running ",
        "toothwave_solves_queued ",
    ] {
        assert!(text.contains(sample), "no `{sample}` in\n{text}");
    }
}

#[tokio::test]
async fn unknown_path_creates_no_metric() {
    let service = Service::new();
    service.get("/a-path-that-a-scanner-made-up").await.problem();
    service.get("/v1/examples/a-name-that-a-scanner-made-up").await.problem();
    assert!(!service.get("/metrics").await.text().contains("scanner"));
}

/// Requests the page at `/docs/` and everything that it loads.
async fn pages(service: &Service) -> Vec<(String, String)> {
    let page = service.get("/docs/").await;
    assert_eq!((page.status, page.header("content-type").split(';').next()), (200, Some("text/html")));
    let html = page.text().to_owned();
    let mut pages = vec![("/docs/".to_owned(), html.clone())];
    for attribute in ["src=\"", "href=\""] {
        for (_, rest) in html.match_indices(attribute).map(|(at, _)| html.split_at(at + attribute.len())) {
            let target = rest.split('"').next().unwrap();
            assert!(!target.contains("//"), "the page loads {target}");
            let path = format!("/docs/{}", target.trim_start_matches("./"));
            let part = service.get(&path).await;
            assert_eq!(part.status, 200, "{path}");
            pages.push((path, String::from_utf8_lossy(&part.body).into_owned()));
        }
    }
    pages
}

#[tokio::test]
async fn documentation_page_loads_from_this_service_only() {
    let service = Service::new();
    let pages = pages(&service).await;
    assert!(pages.len() > 3, "page, style, and scripts");
    for (path, text) in &pages {
        if path.ends_with('/') || path.contains("initializer") || path.ends_with("index.css") {
            assert!(!text.contains("http:") && !text.contains("https:"), "{path} names an outside host");
        }
    }
    let (_, initializer) = pages.iter().find(|(path, _)| path.contains("initializer")).expect("the initializer");
    let compact: String = initializer.split_whitespace().collect();
    assert!(
        compact.contains("\"validatorUrl\":\"none\"") || compact.contains("\"validatorUrl\":null"),
        "{initializer}"
    );
    assert!(compact.contains("\"url\":\"openapi.json\""), "{initializer}");
}

#[tokio::test]
async fn documentation_path_works_without_slash() {
    let answer = Service::new().get("/docs").await;
    assert!((300..400).contains(&answer.status), "{}", answer.status);
    assert_eq!(answer.header("location"), "docs/");
}

#[tokio::test]
async fn served_api_document_is_the_committed_one() {
    let answer = Service::new().get("/openapi.json").await;
    assert_eq!(answer.header("content-type"), "application/json");
    assert_eq!(answer.text(), crate::openapi::COMMITTED);
}

#[tokio::test]
async fn no_answer_contains_null() {
    let service = Service::within(LIMITS);
    let mut answers = Vec::new();
    for path in ["/v1/limits", "/v1/examples"] {
        answers.push(service.get(path).await.found());
    }
    for path in ENDPOINTS {
        answers.push(service.post(path, &spelled_out()).await.found());
    }
    for answer in answers {
        assert!(crate::designs::pointers(&answer, Value::is_null).is_empty());
    }
}
