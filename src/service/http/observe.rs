//! The middleware around all routes: request id, log line, metrics, common headers.

use std::hash::{BuildHasher, RandomState};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, LazyLock};
use std::time::Instant;

use axum::extract::{MatchedPath, Request, State};
use axum::http::{HeaderMap, HeaderName, HeaderValue, Method, header};
use axum::middleware::Next;
use axum::response::Response;
use toothwave_calculation::json::word;
use tracing::{Instrument, Span};

use super::answer::Provenance;
use super::problem::{Problem, ProblemCode};
use crate::app::App;
use crate::ops::metrics;

/// Header with the id of a request: the client's own, or a new one.
pub(crate) const X_REQUEST_ID: HeaderName = HeaderName::from_static("x-request-id");

/// Header with the caller's trace ids (W3C Trace Context).
const TRACEPARENT: HeaderName = HeaderName::from_static("traceparent");

/// Longest id that is accepted from a client, in bytes.
const MAX_ID_BYTES: usize = 128;

/// Returns a unique id.
fn new_id() -> HeaderValue {
    static PROCESS: LazyLock<u64> = LazyLock::new(|| RandomState::new().hash_one(std::process::id()));
    static REQUESTS: AtomicU64 = AtomicU64::new(0);
    let id = format!("{:016x}-{:x}", *PROCESS, REQUESTS.fetch_add(1, Ordering::Relaxed));
    HeaderValue::try_from(id).unwrap_or(HeaderValue::from_static("none"))
}

/// Returns a header if it is one short word.
fn given(headers: &HeaderMap, name: HeaderName) -> Option<&HeaderValue> {
    let value = headers.get(name)?;
    let is_word = (1..=MAX_ID_BYTES).contains(&value.len()) && value.as_bytes().iter().all(u8::is_ascii_graphic);
    is_word.then_some(value)
}

/// A running request. Dropping it writes its log line: after the response, or because the client has left.
struct Line {
    span: Span,
    method: &'static str,
    route: Option<MatchedPath>,
    started: Instant,
    status: Option<u16>,
    problem: Option<ProblemCode>,
    provenance: Option<Provenance>,
}

impl Line {
    fn route(&self) -> &str {
        self.route.as_ref().map_or("none", MatchedPath::as_str)
    }
}

impl Drop for Line {
    fn drop(&mut self) {
        let elapsed = self.started.elapsed();
        let cache = self.provenance.map(|provenance| provenance.status.label());
        let solve_ms = self.provenance.map(|provenance| 1e3 * provenance.solve.as_secs_f64());
        let problem = self.problem.map(|code| word(&code));
        let elapsed_ms = 1e3 * elapsed.as_secs_f64();
        let Self { method, status, .. } = *self;
        metrics::count_request(self.route(), method, status, cache, elapsed);
        let left = status.is_none().then_some("client left");
        self.span.in_scope(|| {
            tracing::info!(method, route = self.route(), status, left, problem, cache, solve_ms, elapsed_ms, "request");
        });
    }
}

/// The middleware around all routes.
pub(crate) async fn observe(State(app): State<Arc<App>>, request: Request, next: Next) -> Response {
    // Labels must stay few: the route instead of the path, and known methods alone.
    let route = request.extensions().get::<MatchedPath>().cloned();
    let method = match *request.method() {
        Method::GET => "GET",
        Method::HEAD => "HEAD",
        Method::POST => "POST",
        Method::PUT => "PUT",
        Method::PATCH => "PATCH",
        Method::DELETE => "DELETE",
        Method::OPTIONS => "OPTIONS",
        _ => "other",
    };
    let id = given(request.headers(), X_REQUEST_ID).cloned().unwrap_or_else(new_id);
    let span = tracing::info_span!(
        "request",
        id = id.to_str().unwrap_or_default(),
        design = tracing::field::Empty,
        key = tracing::field::Empty,
        traceparent = given(request.headers(), TRACEPARENT).and_then(|value| value.to_str().ok())
    );
    let started = Instant::now();
    let mut line = Line { span: span.clone(), method, route, started, status: None, problem: None, provenance: None };
    let mut response = next.run(request).instrument(span.clone()).await;
    line.status = Some(response.status().as_u16());
    line.provenance = response.extensions().get::<Provenance>().copied();
    line.problem = response.extensions().get::<Problem>().map(|problem| {
        span.in_scope(|| note_problem(problem));
        problem.code
    });
    drop(line);
    let headers = response.headers_mut();
    add_common_headers(headers, id);
    // Clients with kept-alive connections learn that the service is stopping.
    if !app.ready.load(Ordering::Relaxed) {
        headers.insert(header::CONNECTION, HeaderValue::from_static("close"));
    }
    response
}

/// Logs the cause of an internal error, and counts refusals.
pub(crate) fn note_problem(problem: &Problem) {
    if let Some(cause) = &problem.cause {
        tracing::error!(cause, "internal error");
    }
    if ProblemCode::REFUSALS.contains(&problem.code) {
        metrics::refusals(problem.code).increment(1);
    }
}

fn add_common_headers(headers: &mut HeaderMap, id: HeaderValue) {
    headers.insert(X_REQUEST_ID, id);
    headers.insert(header::X_CONTENT_TYPE_OPTIONS, HeaderValue::from_static("nosniff"));
    headers.entry(header::REFERRER_POLICY).or_insert(HeaderValue::from_static("no-referrer"));
    // The page and the documentation have their own policies.
    headers
        .entry(header::CONTENT_SECURITY_POLICY)
        .or_insert(HeaderValue::from_static("default-src 'none'; frame-ancestors 'none'"));
}
