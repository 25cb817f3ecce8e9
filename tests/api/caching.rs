//! The cache: equal questions share a key and are solved once.

use std::io::Read as _;
use std::net::TcpStream;

use flate2::read::GzDecoder;
use serde_json::json;

use crate::asking::{Answer, ENDLESS, ENDPOINTS, LIMITS, Limits, Question, Service, answer_on};
use crate::designs::{bored, in_reverse, shortest, spelled_out, undercut, with};

fn question(path: &str) -> Question {
    Question::post(path, spelled_out().to_string())
}

#[tokio::test]
async fn second_request_hits_cache_with_same_bytes() {
    for path in ENDPOINTS {
        let service = Service::new();
        let (first, second) = (service.ask(&question(path)).await, service.ask(&question(path)).await);
        assert!(first.is_miss() && !first.is_hit(), "{}", first.header("cache-status"));
        assert!(second.is_hit() && !second.is_miss(), "{}", second.header("cache-status"));
        assert_eq!(
            (first.etag(), first.header("vary"), &first.body),
            (second.etag(), second.header("vary"), &second.body)
        );
    }
}

#[tokio::test]
async fn cache_hit_ignores_spelling() {
    let service = Service::new();
    for (path, document) in ENDPOINTS.into_iter().zip([spelled_out(), undercut(), bored()]) {
        assert!(service.post(path, &document).await.is_miss());
        assert!(service.post_text(path, in_reverse(&document)).await.is_hit());
    }
    assert!(service.post("/v1/geometry", &shortest()).await.is_hit());
}

#[tokio::test]
async fn entity_tag_is_equal_across_services() {
    for path in ENDPOINTS {
        let (one, other) = (Service::new().ask(&question(path)).await, Service::new().ask(&question(path)).await);
        assert_eq!(one.etag(), other.etag(), "{path}");
        assert!(one.body == other.body, "{path}");
    }
}

#[tokio::test]
async fn cache_status_names_one_cache_first() {
    let answer = Service::new().ask(&question("/v1/sweep")).await;
    assert!(answer.header("cache-status").starts_with("toothwave;"), "{}", answer.header("cache-status"));
}

#[tokio::test]
async fn server_timing_reports_solve_on_hits_too() {
    let service = Service::new();
    let duration = |answer: &Answer| {
        let timing = answer.header("server-timing").to_owned();
        let (_, duration) = timing.split_once("dur=").unwrap_or_else(|| panic!("no `dur` in `{timing}`"));
        duration.split([';', ',']).next().unwrap().parse::<f64>().unwrap()
    };
    let (miss, hit) = (service.ask(&question("/v1/sweep")).await, service.ask(&question("/v1/sweep")).await);
    assert!(duration(&miss) >= 0.0 && duration(&miss).is_finite());
    assert_eq!(duration(&miss), duration(&hit), "that of the solve which made the bytes");
}

/// Requests every representation of a sweep.
async fn representations(service: &Service) -> Vec<(&'static str, &'static str, Answer)> {
    let mut answers = Vec::new();
    for accept in ["application/json", "text/csv"] {
        for coding in ["identity", "gzip"] {
            let question = question("/v1/sweep").with("accept", accept).with("accept-encoding", coding);
            answers.push((accept, coding, service.ask(&question).await));
        }
    }
    answers
}

/// A client that kept "too many states" must not get 304 from a service with larger limits.
#[tokio::test]
async fn entity_tag_depends_on_reported_limit() {
    let few = Service::within(Limits { max_states: 10, ..LIMITS }).ask(&question("/v1/design")).await;
    let service = Service::new();
    let again = service.ask(&question("/v1/design").with("if-none-match", few.etag())).await;
    assert_eq!((few.found()["problems"]["sweep"]["code"].as_str(), again.status), (Some("too_many_states"), 200));
    assert_ne!(few.etag(), again.etag());
}

#[tokio::test]
async fn each_representation_has_own_entity_tag() {
    let service = Service::new();
    let answers = representations(&service).await;
    for (accept, coding, answer) in &answers {
        assert_eq!(answer.status, 200);
        assert_eq!(answer.header("content-type").split(';').next(), Some(*accept));
        assert_eq!(answer.header("content-encoding"), if *coding == "gzip" { "gzip" } else { "" });
    }
    let mut tags: Vec<_> = answers.iter().map(|(.., answer)| answer.etag()).collect();
    tags.sort_unstable();
    tags.dedup();
    assert_eq!(tags.len(), 4);
    for (.., again) in representations(&service).await {
        assert!(again.is_hit());
    }
}

#[tokio::test]
async fn every_answer_varies_by_accept_and_accept_encoding() {
    let service = Service::new();
    let tag = service.ask(&question("/v1/geometry")).await.etag().to_owned();
    let mut answers: Vec<_> = representations(&service).await.into_iter().map(|(.., answer)| answer).collect();
    answers.push(service.ask(&question("/v1/geometry")).await);
    answers.push(service.ask(&question("/v1/geometry").with("if-none-match", &tag)).await);
    assert_eq!(answers.last().unwrap().status, 304);
    for answer in answers {
        let vary = answer.header("vary").to_ascii_lowercase();
        let fields: Vec<_> = vary.split(',').map(str::trim).collect();
        assert!(fields.contains(&"accept") && fields.contains(&"accept-encoding"), "{vary}");
    }
}

#[tokio::test]
async fn compressed_body_decodes_to_plain_one() {
    let service = Service::new();
    for path in ENDPOINTS {
        let plain = service.ask(&question(path)).await;
        let compressed = service.ask(&question(path).with("accept-encoding", "gzip")).await;
        assert_eq!((plain.header("content-encoding"), compressed.header("content-encoding")), ("", "gzip"));
        let mut decoded = Vec::new();
        GzDecoder::new(compressed.body.as_slice()).read_to_end(&mut decoded).unwrap();
        assert!(decoded == plain.body, "{path}");
    }
}

#[tokio::test]
async fn compresses_when_client_prefers_it() {
    let service = Service::new();
    for (accepted, is_compressed) in [
        ("gzip", true),
        ("GZIP", true),
        ("x-gzip", true),
        ("br, gzip, deflate", true),
        ("gzip;q=0.5", true),
        ("gzip; q=1.0, identity; q=0.5", true),
        ("*", true),
        ("", false),
        ("br", false),
        ("identity", false),
        ("gzip;q=0", false),
        ("gzip; q=0.000", false),
        ("gzip;q=0.1, identity;q=0.9", false),
        ("*;q=0, identity", false),
        ("gzip;q=0, *", false),
    ] {
        let answer = service.ask(&question("/v1/coincidence-degree").with("accept-encoding", accepted)).await;
        assert_eq!(answer.header("content-encoding") == "gzip", is_compressed, "{accepted}");
    }
}

#[tokio::test]
async fn accepts_weight_in_capitals() {
    let question = question("/v1/coincidence-degree").with("accept-encoding", "gzip;Q=0");
    assert_eq!(Service::new().ask(&question).await.header("content-encoding"), "", "RFC 9110, 12.4.2: gzip is refused");
}

#[tokio::test]
async fn page_and_api_document_are_served_compressed() {
    let service = Service::new();
    for path in ["/", "/page/main.js", "/page/style.css", "/openapi.json", "/openapi-3.0.json"] {
        let asked = |coding| Question::of("GET", path).with("accept-encoding", coding);
        let (plain, compressed) = (service.ask(&asked("identity")).await, service.ask(&asked("gzip")).await);
        assert_eq!((plain.header("content-encoding"), compressed.header("content-encoding")), ("", "gzip"), "{path}");
        assert!(2 * compressed.body.len() < plain.body.len(), "{path}: {} bytes", compressed.body.len());
        let mut decoded = Vec::new();
        GzDecoder::new(compressed.body.as_slice()).read_to_end(&mut decoded).unwrap();
        assert!(decoded == plain.body, "{path}");
        assert_ne!(plain.etag(), compressed.etag(), "{path}: each coding has its own tag");
        for (answer, coding) in [(plain, "identity"), (compressed, "gzip")] {
            let again = service.ask(&asked(coding).with("if-none-match", answer.etag())).await;
            assert_eq!((again.status, again.body.len()), (304, 0), "{path}");
            for seen in [&answer, &again] {
                assert_eq!(seen.header("vary").to_ascii_lowercase(), "accept-encoding", "{path}");
            }
        }
    }
}

#[tokio::test]
async fn known_representation_gets_304_without_body() {
    let service = Service::new();
    for path in ENDPOINTS {
        let first = service.ask(&question(path)).await;
        let tag = first.etag();
        for condition in [tag, &format!("W/{tag}"), &format!("\"other\", {tag}"), &format!("W/\"a\" ,W/{tag},\"b\"")] {
            let answer = service.ask(&question(path).with("if-none-match", condition)).await;
            assert_eq!((answer.status, answer.body.len()), (304, 0), "{path}: {condition}");
            assert_eq!((answer.etag(), answer.header("vary")), (tag, first.header("vary")));
            assert!(answer.is_hit(), "{}", answer.header("cache-status"));
        }
        let two_lines = question(path).with("if-none-match", "\"other\"").with("if-none-match", tag);
        assert_eq!(service.ask(&two_lines).await.status, 304, "a list may stand on several lines");
    }
}

#[tokio::test]
async fn other_entity_tag_gets_full_answer() {
    let service = Service::new();
    let json = service.ask(&question("/v1/sweep")).await;
    let other = service.post("/v1/sweep", &undercut()).await;
    for condition in ["\"other\"", other.etag(), "", json.etag().trim_matches('"'), "\"*\"", "*"] {
        let answer = service.ask(&question("/v1/sweep").with("if-none-match", condition)).await;
        assert_eq!((answer.status, &answer.body), (200, &json.body), "{condition}");
    }
    let as_csv = question("/v1/sweep").with("accept", "text/csv").with("if-none-match", json.etag());
    assert_eq!(service.ask(&as_csv).await.status, 200, "another representation");
    let compressed = question("/v1/sweep").with("accept-encoding", "gzip").with("if-none-match", json.etag());
    assert_eq!(service.ask(&compressed).await.status, 200, "another representation");
}

#[tokio::test]
async fn entity_tag_gets_304_without_cached_body() {
    let tag = Service::new().ask(&question("/v1/sweep")).await.etag().to_owned();
    let answer = Service::new().ask(&question("/v1/sweep").with("if-none-match", &tag)).await;
    assert_eq!(answer.status, 304, "the bytes follow from the parameters, and so does the tag");
}

#[tokio::test]
async fn refused_design_is_never_304() {
    let service = Service::new();
    let tag = service.ask(&question("/v1/sweep")).await.etag().to_owned();
    for (document, code) in [
        (with(&spelled_out(), "/drive/teeth/radius_mm", json!(0.0)), "impossible_design"),
        (with(&spelled_out(), "/drive/teeth/installed", json!(4)), "no_tooth_in_mesh"),
        (with(&spelled_out(), "/sweep/samples", json!(10_000_000)), "too_many_states"),
        (with(&spelled_out(), "/colour", json!("red")), "invalid_document"),
    ] {
        for condition in ["*", tag.as_str()] {
            let question = Question::post("/v1/sweep", document.to_string()).with("if-none-match", condition);
            service.ask(&question).await.refused(422, code);
        }
    }
}

#[tokio::test]
async fn refused_design_stays_refused() {
    let service = Service::new();
    let unloaded = with(&spelled_out(), "/drive/teeth/installed", json!(4));
    for _ in 0..3 {
        service.post("/v1/sweep", &unloaded).await.refused(422, "no_tooth_in_mesh");
    }
}

#[tokio::test]
async fn uncached_answer_is_solved_again_to_same_bytes() {
    let service = Service::within(Limits { cache_max_bytes: 0, ..LIMITS });
    let (first, second) = (service.ask(&question("/v1/sweep")).await, service.ask(&question("/v1/sweep")).await);
    assert!(first.is_miss());
    assert_eq!((first.etag(), &first.body), (second.etag(), &second.body));
}

#[tokio::test]
async fn empty_cache_reports_nothing_stored() {
    let service = Service::within(Limits { cache_max_bytes: 0, ..LIMITS });
    let answer = service.ask(&question("/v1/sweep")).await;
    assert!(!answer.header("cache-status").contains("stored"), "{}", answer.header("cache-status"));
}

/// Sends equal requests that are spelled differently.
fn equal_requests(service: &Service, count: usize) -> Vec<TcpStream> {
    let document = with(&spelled_out(), "/sweep/samples", json!(200)).to_string();
    let spelled = |spaces| Question::post("/v1/sweep", format!("{document}{}", " ".repeat(spaces)));
    (0..count).map(|spaces| service.send(&spelled(spaces))).collect()
}

#[test]
fn equal_requests_are_computed_once() {
    let service = Service::new();
    let answers: Vec<_> = equal_requests(&service, 100).into_iter().map(answer_on).collect();
    assert!(answers.iter().all(|answer| answer.status == 200));
    assert_eq!(answers.iter().filter(|answer| answer.is_miss()).count(), 1);
    assert_eq!(answers.iter().filter(|answer| answer.is_hit() || answer.is_collapsed()).count(), 99);
    assert!(answers.iter().all(|answer| answer.body == answers[0].body && answer.etag() == answers[0].etag()));
}

#[test]
fn equal_requests_take_one_queue_place() {
    let service = Service::within(Limits { max_concurrent_solves: 1, ..ENDLESS });
    let occupied = service.occupied_by(1);
    // The queue holds 32 requests, and these are more.
    let mut equal = equal_requests(&service, 50);
    service.until("toothwave_solves_queued", 1.0);
    // The first client leaves, but the others share its computation.
    drop(equal.remove(0));
    drop(occupied);
    let answers: Vec<_> = equal.into_iter().map(answer_on).collect();
    assert!(answers.iter().all(|answer| answer.status == 200), "{}", answers[0].text());
}

#[test]
fn all_waiting_requests_get_the_failure() {
    let service = Service::within(Limits { max_concurrent_solves: 1, ..ENDLESS });
    let occupied = service.occupied_by(1);
    let unloaded = with(&spelled_out(), "/drive/teeth/installed", json!(4)).to_string();
    let waiting: Vec<_> = (0..10).map(|_| service.send(&Question::post("/v1/sweep", unloaded.clone()))).collect();
    service.until("toothwave_solves_queued", 1.0);
    drop(occupied);
    for request in waiting {
        answer_on(request).refused(422, "no_tooth_in_mesh");
    }
}
