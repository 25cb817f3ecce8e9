//! What every request gets: an id, a log line, metrics, and the headers of every answer.

use std::cell::RefCell;
use std::collections::HashMap;
use std::hash::{BuildHasher, RandomState};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{LazyLock, OnceLock};
use std::time::{Duration, Instant};

use axum::extract::{MatchedPath, Request};
use axum::http::{HeaderMap, HeaderName, HeaderValue, Method, header};
use axum::middleware::Next;
use axum::response::Response;
use metrics::{Counter, Histogram, counter, gauge, histogram};
use metrics_exporter_prometheus::{Matcher, PrometheusBuilder, PrometheusHandle};
use toothwave_calculation::json::word;
use tracing::Instrument;

use crate::api::App;
use crate::cache::Provenance;
use crate::problem::Problem;

/// Upper bounds of the histograms' buckets in seconds: from a cache hit to the longest deadline.
const BUCKETS_S: [f64; 12] = [1e-4, 2.5e-4, 5e-4, 1e-3, 2.5e-3, 5e-3, 1e-2, 5e-2, 0.1, 0.5, 1.0, 10.0];

static RECORDER: OnceLock<Option<PrometheusHandle>> = OnceLock::new();

/// Installs the recorder of this process, once.
pub fn install_recorder() {
    RECORDER.get_or_init(|| {
        PrometheusBuilder::new()
            .set_buckets_for_metric(Matcher::Suffix("_seconds".into()), &BUCKETS_S)
            .and_then(PrometheusBuilder::install_recorder)
            .inspect_err(|error| tracing::error!(%error, "no metrics"))
            .ok()
    });
}

/// The metrics as text; levels are read at this moment.
pub fn render(app: &App) -> String {
    let size = app.cache.size();
    let running = app.pool.running();
    #[expect(clippy::cast_precision_loss, reason = "a gauge")]
    {
        gauge!("toothwave_cache_bytes").set(size.bytes as f64);
        gauge!("toothwave_cache_entries").set(size.entries as f64);
        gauge!("toothwave_batches_running").set(app.pool.batches() as f64);
        gauge!("toothwave_solves_running").set(running as f64);
        gauge!("toothwave_solves_queued").set(app.pool.admitted().saturating_sub(running) as f64);
    }
    let handle = RECORDER.get().and_then(Option::as_ref);
    handle.map(PrometheusHandle::render).unwrap_or_default()
}

/// Folds what was recorded into the histograms' buckets; until then the recorder keeps every single value.
pub async fn keep_up() {
    /// A busy service records a megabyte in this time.
    const PAUSE: Duration = Duration::from_secs(1);
    loop {
        tokio::time::sleep(PAUSE).await;
        if let Some(handle) = RECORDER.get().and_then(Option::as_ref) {
            handle.run_upkeep();
        }
    }
}

/// What requests of one route, method, status and cache status count in.
struct Series {
    requests: Counter,
    duration: Histogram,
    from_cache: Option<Counter>,
}

/// What tells the series of one route apart: method, status and cache status.
type Labels = (&'static str, u16, Option<&'static str>);

thread_local! {
    /// The series by route and labels: to have the recorder look one up takes longer than to count in it.
    static SERIES: RefCell<HashMap<String, HashMap<Labels, Series>>> = RefCell::default();
}

/// Counts a request; routes, methods and statuses are few, so that there are few series.
fn count(route: &str, labels: Labels, elapsed: Duration) {
    // What is found before there is a recorder would lead nowhere for ever.
    if RECORDER.get().is_none() {
        return;
    }
    SERIES.with_borrow_mut(|series| {
        if !series.contains_key(route) {
            series.insert(route.to_owned(), HashMap::new());
        }
        let Some(of_route) = series.get_mut(route) else { return };
        let Series { requests, duration, from_cache } = of_route.entry(labels).or_insert_with(|| {
            let (method, status, cache) = labels;
            let route = route.to_owned();
            Series {
                requests: counter!("toothwave_http_requests_total", "route" => route.clone(), "method" => method, "status" => status.to_string()),
                duration: histogram!("toothwave_http_request_duration_seconds", "route" => route),
                from_cache: cache.map(|cache| counter!("toothwave_cache_requests_total", "status" => cache)),
            }
        });
        requests.increment(1);
        duration.record(elapsed);
        if let Some(counter) = from_cache {
            counter.increment(1);
        }
    });
}

/// The id of a request, the client's own or ours.
pub const X_REQUEST_ID: HeaderName = HeaderName::from_static("x-request-id");

/// An id that no other request of this process has, and none of another process by all odds.
fn new_id() -> HeaderValue {
    static PROCESS: LazyLock<u64> = LazyLock::new(|| RandomState::new().hash_one(std::process::id()));
    static REQUESTS: AtomicU64 = AtomicU64::new(0);
    let id = format!("{:016x}-{:x}", *PROCESS, REQUESTS.fetch_add(1, Ordering::Relaxed));
    HeaderValue::try_from(id).unwrap_or(HeaderValue::from_static("none"))
}

/// The middleware: a request's id and a span with it, then, when the answer's head is ready, one line, the metrics, and the headers
/// that every answer has.
pub async fn observe(request: Request, next: Next) -> Response {
    let started = Instant::now();
    // The route and not the path: labels must stay few.
    let route = request.extensions().get::<MatchedPath>().cloned();
    let route = route.as_ref().map_or("none", MatchedPath::as_str);
    let method = match *request.method() {
        Method::GET => "GET",
        Method::HEAD => "HEAD",
        Method::POST => "POST",
        Method::PUT => "PUT",
        Method::PATCH => "PATCH",
        Method::DELETE => "DELETE",
        Method::OPTIONS => "OPTIONS",
        // Clients can invent methods without end, and each would be a series of its own.
        _ => "other",
    };
    let id = request.headers().get(X_REQUEST_ID).cloned().unwrap_or_else(new_id);
    let span = tracing::info_span!("request", id = id.to_str().unwrap_or_default(), design = tracing::field::Empty);
    let mut response = next.run(request).instrument(span.clone()).await;
    let elapsed = started.elapsed();
    if let Some(problem) = response.extensions().get() {
        span.in_scope(|| problem_is_told(problem));
    }
    let status = response.status().as_u16();
    let provenance = response.extensions().get::<Provenance>();
    let cache = provenance.map(|provenance| provenance.served.label());
    let solve_ms = provenance.map(|provenance| 1e3 * provenance.solve.as_secs_f64());
    count(route, (method, status, cache), elapsed);
    let elapsed_ms = 1e3 * elapsed.as_secs_f64();
    span.in_scope(|| tracing::info!(method, route, status, cache, solve_ms, elapsed_ms, "request"));
    complete(response.headers_mut(), id);
    response
}

/// Logs why an internal error happened, and counts refusals by their code: here alone, where a problem is about to be told.
pub fn problem_is_told(problem: &Problem) {
    if let Some(cause) = &problem.cause {
        tracing::error!(cause, "internal error");
    }
    if problem.code.is_refusal() {
        counter!("toothwave_refusals_total", "reason" => word(&problem.code)).increment(1);
    }
}

/// The headers of every answer.
fn complete(headers: &mut HeaderMap, id: HeaderValue) {
    headers.insert(X_REQUEST_ID, id);
    headers.insert(header::X_CONTENT_TYPE_OPTIONS, HeaderValue::from_static("nosniff"));
    headers.entry(header::REFERRER_POLICY).or_insert(HeaderValue::from_static("no-referrer"));
    // The page and the documentation have policies of their own; nothing else is a document.
    headers
        .entry(header::CONTENT_SECURITY_POLICY)
        .or_insert(HeaderValue::from_static("default-src 'none'; frame-ancestors 'none'"));
}
