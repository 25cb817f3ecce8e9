//! What every request gets: an id, a log line, metrics, and the headers of every answer.

use std::cell::RefCell;
use std::collections::HashMap;
use std::hash::{BuildHasher, RandomState};
use std::pin::Pin;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, LazyLock, OnceLock};
use std::task::{Context, Poll, ready};
use std::time::{Duration, Instant};

use axum::body::{Body, Bytes, HttpBody};
use axum::extract::{MatchedPath, Request, State};
use axum::http::{HeaderMap, HeaderName, HeaderValue, Method, header};
use axum::middleware::Next;
use axum::response::Response;
use http_body::{Frame, SizeHint};
use metrics::{Counter, Histogram, counter, describe_counter, describe_gauge, describe_histogram, gauge, histogram};
use metrics_exporter_prometheus::{Matcher, PrometheusBuilder, PrometheusHandle};
use metrics_process::Collector;
use toothwave_calculation::BUILD;
use toothwave_calculation::json::word;
use tracing::{Instrument, Span};

use crate::app::App;
use crate::cache::Provenance;
use crate::problem::{Problem, ProblemCode};
use crate::{log, socket};

/// Upper bounds of the histograms' buckets in seconds: from a cache hit to the longest deadline.
const BUCKETS_S: [f64; 12] = [1e-4, 2.5e-4, 5e-4, 1e-3, 2.5e-3, 5e-3, 1e-2, 5e-2, 0.1, 0.5, 1.0, 10.0];

static RECORDER: OnceLock<Option<PrometheusHandle>> = OnceLock::new();

/// Installs the recorder of this process, once.
pub fn install_recorder() {
    RECORDER.get_or_init(|| {
        PrometheusBuilder::new()
            .set_buckets_for_metric(Matcher::Suffix("_seconds".into()), &BUCKETS_S)
            .and_then(PrometheusBuilder::install_recorder)
            .inspect(|_| describe())
            .inspect_err(|error| tracing::error!(%error, "no metrics"))
            .ok()
    });
}

/// What each series says, for whoever reads the metrics themselves.
fn describe() {
    Collector::default().describe();
    describe_counter!("toothwave_http_requests_total", "Requests answered.");
    describe_histogram!("toothwave_http_request_duration_seconds", "Time to an answer's head.");
    describe_histogram!(
        "toothwave_http_request_completion_seconds",
        "Time until an answer was handed to the network, or broken off."
    );
    describe_counter!("toothwave_cache_requests_total", "Answers that may be kept, by where they came from.");
    describe_gauge!("toothwave_cache_bytes", "Bytes that the cache holds.");
    describe_gauge!("toothwave_cache_entries", "Answers that the cache holds.");
    describe_histogram!("toothwave_solve_duration_seconds", "Time of each solve, without waiting.");
    describe_gauge!("toothwave_solves_running", "Solves that run.");
    describe_gauge!("toothwave_solves_queued", "Single solves that wait.");
    describe_gauge!("toothwave_batches_running", "Batches that run.");
    describe_counter!("toothwave_batch_documents_total", "Documents of batches answered.");
    describe_gauge!("toothwave_studies_running", "Studies that run.");
    describe_counter!("toothwave_study_variants_total", "Variants of studies looked at.");
    describe_counter!("toothwave_refusals_total", "Requests that were not taken on, by the reason.");
    describe_counter!("toothwave_cancellations_total", "Computations that were stopped.");
    describe_gauge!("toothwave_connections", "Connections that are open.");
    describe_gauge!("toothwave_unread_bytes", "Bytes taken of max_unread_bytes.");
    describe_counter!("toothwave_sent_bytes_total", "Bytes handed to the network.");
    describe_counter!("toothwave_log_lines_lost_total", "Lines of the log that nobody will read.");
    describe_gauge!("toothwave_build_info", "1; its labels say what runs.");
    // A rate of what is not there yet misses the first one.
    for name in ["toothwave_cancellations_total", "toothwave_study_variants_total"] {
        counter!(name).increment(0);
    }
    for code in ProblemCode::REFUSALS {
        refused(code).increment(0);
    }
}

/// What counts the refusals of this code.
fn refused(code: ProblemCode) -> Counter {
    counter!("toothwave_refusals_total", "reason" => word(&code))
}

/// The metrics as text; levels are read at this moment.
pub fn render(app: &App) -> String {
    let size = app.cache.size();
    #[expect(clippy::cast_precision_loss, reason = "a gauge")]
    {
        gauge!("toothwave_cache_bytes").set(size.bytes as f64);
        gauge!("toothwave_cache_entries").set(size.entries as f64);
        gauge!("toothwave_batches_running").set(app.pool.batches() as f64);
        gauge!("toothwave_studies_running").set(app.studies.running() as f64);
        gauge!("toothwave_solves_running").set(app.pool.running() as f64);
        gauge!("toothwave_solves_queued").set(app.pool.waiting() as f64);
        gauge!("toothwave_connections").set(socket::open() as f64);
        gauge!("toothwave_unread_bytes").set(app.room.taken_bytes() as f64);
    }
    gauge!("toothwave_build_info", "version" => env!("CARGO_PKG_VERSION"), "build" => BUILD).set(1.0);
    counter!("toothwave_sent_bytes_total").absolute(socket::sent_bytes());
    counter!("toothwave_log_lines_lost_total").absolute(log::lost_lines());
    Collector::default().collect();
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
    completion: Histogram,
    from_cache: Option<Counter>,
}

/// What tells the series of one route apart: method, status and cache status.
type Labels = (&'static str, u16, Option<&'static str>);

thread_local! {
    /// The series by route and labels: to have the recorder look one up takes longer than to count in it.
    static SERIES: RefCell<HashMap<String, HashMap<Labels, Series>>> = RefCell::default();
}

/// Counts a request; routes, methods and statuses are few, so that there are few series. Returns where its completion counts.
fn count(route: &str, labels: Labels, elapsed: Duration) -> Histogram {
    // What is found before there is a recorder would lead nowhere for ever.
    if RECORDER.get().is_none() {
        return Histogram::noop();
    }
    SERIES.with_borrow_mut(|series| {
        if !series.contains_key(route) {
            series.insert(route.to_owned(), HashMap::new());
        }
        let Some(of_route) = series.get_mut(route) else { return Histogram::noop() };
        let Series { requests, duration, completion, from_cache } = of_route.entry(labels).or_insert_with(|| {
            let (method, status, cache) = labels;
            let route = route.to_owned();
            Series {
                requests: counter!("toothwave_http_requests_total", "route" => route.clone(), "method" => method, "status" => status.to_string()),
                duration: histogram!("toothwave_http_request_duration_seconds", "route" => route.clone()),
                completion: histogram!("toothwave_http_request_completion_seconds", "route" => route),
                from_cache: cache.map(|cache| counter!("toothwave_cache_requests_total", "status" => cache)),
            }
        });
        requests.increment(1);
        duration.record(elapsed);
        if let Some(counter) = from_cache {
            counter.increment(1);
        }
        completion.clone()
    })
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

/// Characters of an id at most: what others than ourselves wrote stands in the log and in the answer.
const LONGEST_ID: usize = 128;

/// The client's id, where it is one.
fn given_id(headers: &HeaderMap) -> Option<HeaderValue> {
    let id = headers.get(X_REQUEST_ID)?;
    let is_id = (1..=LONGEST_ID).contains(&id.len()) && id.as_bytes().iter().all(u8::is_ascii_graphic);
    is_id.then(|| id.clone())
}

/// What W3C Trace Context calls the caller: version, trace, parent and flags in hexadecimal.
const TRACEPARENT: HeaderName = HeaderName::from_static("traceparent");

fn traceparent(headers: &HeaderMap) -> Option<&str> {
    let value = headers.get(TRACEPARENT)?.to_str().ok()?;
    let is_hexadecimal = |part: &str| part.bytes().all(|byte| matches!(byte, b'0'..=b'9' | b'a'..=b'f'));
    let parts: Vec<_> = value.split('-').collect();
    let lengths: Vec<_> = parts.iter().map(|part| part.len()).collect();
    let is_one = lengths == [2, 32, 16, 2] && parts.iter().all(|part| is_hexadecimal(part));
    // No version, and no ids (W3C Trace Context, section 3.2.2).
    let is_void = || parts[0] == "ff" || parts[1..3].iter().any(|id| id.bytes().all(|byte| byte == b'0'));
    (is_one && !is_void()).then_some(value)
}

/// The middleware: a request's id and a span with it; when the answer's head is ready, the metrics and the headers that every answer
/// has; and one line when its body is on its way or broken off.
pub async fn observe(State(app): State<Arc<App>>, request: Request, next: Next) -> Response {
    let started = Instant::now();
    // The route and not the path: labels must stay few.
    let route = request.extensions().get::<MatchedPath>().cloned();
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
    let id = given_id(request.headers()).unwrap_or_else(new_id);
    let span = tracing::info_span!(
        "request",
        id = id.to_str().unwrap_or_default(),
        design = tracing::field::Empty,
        key = tracing::field::Empty,
        traceparent = traceparent(request.headers())
    );
    let left_unread = Arc::new(AtomicBool::new(false));
    let request = request.map(|body| {
        if body.is_end_stream() {
            body
        } else {
            Body::new(Asked { body, is_over: false, left_unread: Arc::clone(&left_unread) })
        }
    });
    let mut unanswered = Unanswered { span: span.clone(), method, route: route.clone(), started, is_answered: false };
    let mut response = next.run(request).instrument(span.clone()).await;
    unanswered.is_answered = true;
    let elapsed = started.elapsed();
    let problem = response.extensions().get::<Problem>().map(|problem| {
        span.in_scope(|| note_problem(problem));
        problem.code
    });
    let status = response.status().as_u16();
    let provenance = response.extensions().get::<Provenance>();
    let cache = provenance.map(|provenance| provenance.served.label());
    let solve_ms = provenance.map(|provenance| 1e3 * provenance.solve.as_secs_f64());
    let histogram = count(route.as_ref().map_or("none", MatchedPath::as_str), (method, status, cache), elapsed);
    complete(response.headers_mut(), id);
    // A connection on which the rest of a body would come is not used again: who has sent the next request on it gets no answer to that.
    if left_unread.load(Ordering::Relaxed) || !app.ready.load(Ordering::Relaxed) {
        response.headers_mut().insert(header::CONNECTION, HeaderValue::from_static("close"));
    }
    let elapsed_ms = 1e3 * elapsed.as_secs_f64();
    response.map(|body| {
        // Of HEAD nobody asks for the body.
        let is_whole = method == "HEAD" || body.is_end_stream();
        let sent_bytes = 0;
        let completion = Completion {
            span,
            method,
            route,
            status,
            cache,
            problem,
            solve_ms,
            started,
            elapsed_ms,
            sent_bytes,
            is_whole,
            histogram,
        };
        Body::new(Observed { body, rest: Bytes::new(), completion })
    })
}

/// A request's body, which tells when whoever answers does not want its end.
struct Asked {
    body: Body,
    /// One in chunks says so only by giving nothing more.
    is_over: bool,
    left_unread: Arc<AtomicBool>,
}

impl HttpBody for Asked {
    type Data = Bytes;
    type Error = axum::Error;

    fn poll_frame(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
    ) -> Poll<Option<Result<Frame<Bytes>, axum::Error>>> {
        let polled = Pin::new(&mut self.body).poll_frame(context);
        self.is_over |= matches!(polled, Poll::Ready(None));
        polled
    }

    fn is_end_stream(&self) -> bool {
        self.is_over || self.body.is_end_stream()
    }

    fn size_hint(&self) -> SizeHint {
        self.body.size_hint()
    }
}

impl Drop for Asked {
    fn drop(&mut self) {
        if !self.is_end_stream() {
            self.left_unread.store(true, Ordering::Relaxed);
        }
    }
}

/// What is known of a request whose client may leave before there is an answer.
struct Unanswered {
    span: Span,
    method: &'static str,
    route: Option<MatchedPath>,
    started: Instant,
    is_answered: bool,
}

impl Drop for Unanswered {
    fn drop(&mut self) {
        if self.is_answered {
            return;
        }
        let (method, route) = (self.method, self.route.as_ref().map_or("none", MatchedPath::as_str));
        let completed_ms = 1e3 * self.started.elapsed().as_secs_f64();
        self.span.in_scope(|| {
            tracing::info!(method, route, completed_ms, sent_bytes = 0, is_whole = false, "request");
        });
    }
}

/// What is known of a request when the last of its answer is handed over, or will never be.
struct Completion {
    span: Span,
    method: &'static str,
    route: Option<MatchedPath>,
    status: u16,
    cache: Option<&'static str>,
    problem: Option<ProblemCode>,
    solve_ms: Option<f64>,
    started: Instant,
    elapsed_ms: f64,
    sent_bytes: u64,
    is_whole: bool,
    histogram: Histogram,
}

impl Drop for Completion {
    fn drop(&mut self) {
        let Self { method, status, cache, solve_ms, elapsed_ms, sent_bytes, is_whole, .. } = *self;
        let completed = self.started.elapsed();
        self.histogram.record(completed);
        let completed_ms = 1e3 * completed.as_secs_f64();
        let route = self.route.as_ref().map_or("none", MatchedPath::as_str);
        let problem = self.problem.map(|code| word(&code));
        self.span.in_scope(|| {
            tracing::info!(
                method,
                route,
                status,
                problem,
                cache,
                solve_ms,
                elapsed_ms,
                completed_ms,
                sent_bytes,
                is_whole,
                "request"
            );
        });
    }
}

/// So much of a body is handed over at once: what is left of a large one is known to be on its way only when it is asked for.
const PART_BYTES: usize = 1 << 18;

/// A body, in parts, that tells what became of it.
struct Observed {
    body: Body,
    /// Of what the body gave last.
    rest: Bytes,
    completion: Completion,
}

impl HttpBody for Observed {
    type Data = Bytes;
    type Error = axum::Error;

    fn poll_frame(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
    ) -> Poll<Option<Result<Frame<Bytes>, axum::Error>>> {
        let this = &mut *self;
        if this.rest.is_empty() {
            match ready!(Pin::new(&mut this.body).poll_frame(context)) {
                Some(Ok(frame)) => match frame.into_data() {
                    Ok(bytes) => this.rest = bytes,
                    Err(trailers) => return Poll::Ready(Some(Ok(trailers))),
                },
                Some(Err(error)) => return Poll::Ready(Some(Err(error))),
                None => {
                    this.completion.is_whole = true;
                    return Poll::Ready(None);
                }
            }
        }
        let part = this.rest.split_to(this.rest.len().min(PART_BYTES));
        this.completion.sent_bytes += part.len() as u64;
        this.completion.is_whole = this.is_end_stream();
        Poll::Ready(Some(Ok(Frame::data(part))))
    }

    fn is_end_stream(&self) -> bool {
        self.rest.is_empty() && self.body.is_end_stream()
    }

    fn size_hint(&self) -> SizeHint {
        let (mut hint, rest) = (self.body.size_hint(), self.rest.len() as u64);
        if let Some(upper) = hint.upper() {
            hint.set_upper(upper + rest);
        }
        hint.set_lower(hint.lower() + rest);
        hint
    }
}

/// Logs why an internal error happened, and counts refusals by their code: here alone, where a problem is about to be told.
pub fn note_problem(problem: &Problem) {
    if let Some(cause) = &problem.cause {
        tracing::error!(cause, "internal error");
    }
    if ProblemCode::REFUSALS.contains(&problem.code) {
        refused(problem.code).increment(1);
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
