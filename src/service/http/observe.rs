//! What every request gets: an id, one line in the log, metrics, and the headers of every answer.

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
use crate::ops::metrics::{self, Labels};

/// The id of a request, the client's own or ours.
pub(crate) const X_REQUEST_ID: HeaderName = HeaderName::from_static("x-request-id");

/// The caller's ids (W3C Trace Context).
const TRACEPARENT: HeaderName = HeaderName::from_static("traceparent");

/// Longest id that is taken over from a client.
const MAX_ID_BYTES: usize = 128;

/// An id that no other request has.
fn new_id() -> HeaderValue {
    static PROCESS: LazyLock<u64> = LazyLock::new(|| RandomState::new().hash_one(std::process::id()));
    static REQUESTS: AtomicU64 = AtomicU64::new(0);
    let id = format!("{:016x}-{:x}", *PROCESS, REQUESTS.fetch_add(1, Ordering::Relaxed));
    HeaderValue::try_from(id).unwrap_or(HeaderValue::from_static("none"))
}

/// A header that is one short word.
fn given(headers: &HeaderMap, name: HeaderName) -> Option<&HeaderValue> {
    let value = headers.get(name)?;
    let is_word = (1..=MAX_ID_BYTES).contains(&value.len()) && value.as_bytes().iter().all(u8::is_ascii_graphic);
    is_word.then_some(value)
}

/// A request on its way. Its line is logged when it is dropped: with the answer, or because the client has left.
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
        metrics::count_request(self.route(), Labels { method, status, cache }, elapsed);
        let left = status.is_none().then_some("client left");
        self.span.in_scope(|| {
            tracing::info!(method, route = self.route(), status, left, problem, cache, solve_ms, elapsed_ms, "request");
        });
    }
}

/// The middleware around all paths.
pub(crate) async fn observe(State(app): State<Arc<App>>, request: Request, next: Next) -> Response {
    // The route and not the path: labels must stay few. So must methods, which clients can invent.
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
    // Clients that keep their connection learn that the service stops.
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
    // The page and the documentation have policies of their own; nothing else is a document.
    headers
        .entry(header::CONTENT_SECURITY_POLICY)
        .or_insert(HeaderValue::from_static("default-src 'none'; frame-ancestors 'none'"));
}
