//! The endpoints: one file each, with its handler and what the API document says of it. What they share, the walk of a request from
//! document to bytes, stands here.

use std::io::{self, Write};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

use axum::body::Body;
use axum::extract::Request;
use axum::http::request::Parts;
use axum::http::{HeaderMap, HeaderName, HeaderValue, StatusCode, header};
use axum::response::{IntoResponse, Response};
use flate2::Compression;
use flate2::write::GzEncoder;
use toothwave_calculation::design::Design;
use toothwave_calculation::forms::Forms;
use toothwave_calculation::key::Key;
use toothwave_calculation::no_answer::NoAnswer;
use toothwave_calculation::question::Question;
use utoipa::IntoResponses;

use crate::cache::{Cache, Provenance, Served, Spelling, Stored, etag};
use crate::compute::{Pool, Thread};
use crate::config::Limits;
use crate::negotiation::{self, Representation};
use crate::problem::{Problem, ProblemCode};
use crate::room::{Room, Sent};

pub mod accuracy;
pub mod batch;
pub mod coincidence_degree;
pub mod drawings;
pub mod geometry;
pub mod page;
pub mod side;
pub mod sweep;

/// What handlers share.
#[derive(Debug)]
pub struct App {
    /// Limits of the service.
    pub limits: Limits,
    /// Where solves run.
    pub pool: Pool,
    /// Finished answers.
    pub cache: Cache,
    /// For answers on their way to clients.
    pub room: Room,
    /// Whether the service wants requests: false while it drains.
    pub ready: AtomicBool,
}

impl App {
    /// An idle service within these limits.
    pub fn new(limits: Limits) -> Arc<Self> {
        Arc::new(Self {
            limits,
            pool: Pool::new(limits),
            cache: Cache::new(limits.cache_max_bytes),
            room: Room::new(limits.max_unread_bytes),
            ready: AtomicBool::new(true),
        })
    }
}

/// The statuses that every solving endpoint can answer with beside 200 and 304.
#[derive(IntoResponses)]
pub enum Problems {
    /// The body is no JSON.
    #[response(status = 400, content_type = "application/problem+json")]
    Malformed(#[to_schema] Problem),
    /// No representation that the client accepts.
    #[response(status = 406, content_type = "application/problem+json")]
    NotAcceptable(#[to_schema] Problem),
    /// The body did not arrive in time.
    #[response(status = 408, content_type = "application/problem+json")]
    RequestTimeout(#[to_schema] Problem),
    /// The body exceeds `max_body_bytes`.
    #[response(status = 413, content_type = "application/problem+json")]
    BodyTooLarge(#[to_schema] Problem),
    /// The body is not sent as plain JSON.
    #[response(status = 415, content_type = "application/problem+json")]
    UnsupportedMediaType(#[to_schema] Problem),
    /// JSON that is no design document, or describes no possible drive, load or request.
    #[response(status = 422, content_type = "application/problem+json")]
    Unprocessable(#[to_schema] Problem),
    /// A fault of the service itself.
    #[response(status = 500, content_type = "application/problem+json")]
    Internal(#[to_schema] Problem),
    /// The service is full, or the deadline stopped the computation; `Retry-After` says when to try again.
    #[response(status = 503, content_type = "application/problem+json", headers(("Retry-After" = u32, description = "Seconds")))]
    Unavailable(#[to_schema] Problem),
}

/// The walk of a request: document → key → cache → checked parameters → answer → bytes.
pub async fn respond<Q: Question>(question: Q, app: Arc<App>, request: Request) -> Response {
    match walk(question, app, request).await {
        Ok(response) => response,
        Err(problem) => problem.into_response(),
    }
}

async fn walk<Q: Question>(question: Q, app: Arc<App>, request: Request) -> Result<Response, Problem> {
    let Asked { headers, body, representation, deadline } = Asked::read::<Q>(&app, request).await?;
    let spelling = Spelling::new(question.name(), representation, &body);
    let known = app.cache.key(spelling).and_then(|key| app.cache.get(key).map(|stored| (key, stored)));
    let (key, stored, served) = match known {
        Some((key, stored)) => {
            log_design(key);
            (key, stored, Served::Hit)
        }
        None => {
            let design = Design::read(&body)?;
            let key = question.key(&design, &representation);
            log_design(key);
            let (stored, served) = match app.cache.get(key) {
                // What is kept was checked when it was solved.
                Some(stored) => (stored, Served::Hit),
                None => {
                    let checked = question.check(&design, &app.limits.of_calculation())?;
                    let pool = app.pool.clone();
                    let thread = match representation {
                        Representation::JSON if Q::is_short(&checked) => Thread::Executor,
                        _ => Thread::Blocking,
                    };
                    let solve = async move {
                        pool.run(deadline, thread, move |stop| solve::<Q>(&checked, representation, stop)).await
                    };
                    app.cache.solve_once(key, solve).await?
                }
            };
            app.cache.remember(spelling, key);
            (key, stored, served)
        }
    };
    let etag = etag(key);
    let provenance = Provenance { served, solve: stored.solve };
    if negotiation::is_not_modified(&headers, &etag) {
        return Ok(caching(StatusCode::NOT_MODIFIED.into_response(), provenance, &etag));
    }
    Ok(caching(with_body(&app.room, stored, representation)?, provenance, &etag))
}

/// The design's hash, for the request's log line.
fn log_design(key: Key) {
    tracing::Span::current().record("design", tracing::field::display(key));
}

/// A request as far as all endpoints read it alike.
struct Asked {
    headers: HeaderMap,
    body: bytes::Bytes,
    representation: Representation,
    deadline: tokio::time::Instant,
}

impl Asked {
    async fn read<Q: Question>(app: &App, request: Request) -> Result<Self, Problem> {
        let deadline = app.pool.deadline();
        let (Parts { headers, .. }, body) = request.into_parts();
        negotiation::require_json(&headers)?;
        let representation = Representation::negotiate(&headers, Q::Answer::FORMS.iter().map(|(format, _)| *format))?;
        let body = read_body(&headers, body, &app.limits, deadline).await?;
        Ok(Self { headers, body, representation, deadline })
    }
}

/// The same walk for an answer that is measured there and then: never cached.
async fn respond_afresh<Q: Question>(question: Q, app: Arc<App>, request: Request) -> Response {
    let walk = async {
        let Asked { body, representation, deadline, .. } = Asked::read::<Q>(&app, request).await?;
        let checked = question.check(&Design::read(&body)?, &app.limits.of_calculation())?;
        let job = move |stop: &AtomicBool| solve::<Q>(&checked, representation, stop);
        with_body(&app.room, app.pool.run(deadline, Thread::Blocking, job).await?, representation)
    };
    let mut response = walk.await.unwrap_or_else(IntoResponse::into_response);
    response.headers_mut().insert(header::CACHE_CONTROL, HeaderValue::from_static("no-store"));
    response
}

async fn read_body(
    headers: &HeaderMap,
    body: Body,
    limits: &Limits,
    deadline: tokio::time::Instant,
) -> Result<bytes::Bytes, Problem> {
    let limit = limits.max_body_bytes;
    let too_large = |length: &str| {
        let detail = format!("the body has {length}more than the {limit} bytes of `max_body_bytes`");
        Problem::new(ProblemCode::BodyTooLarge, detail)
    };
    let announced = headers.get(header::CONTENT_LENGTH).and_then(|value| value.to_str().ok()?.parse::<u64>().ok());
    if let Some(length) = announced.filter(|&length| length > limit as u64) {
        return Err(too_large(&format!("{length} bytes, ")));
    }
    let reading = axum::body::to_bytes(body, limit);
    let arrived = tokio::time::timeout_at(deadline, reading).await;
    let arrived = arrived.map_err(|_| {
        let detail = format!("the body did not arrive within {} ms", limits.deadline_ms);
        Problem::new(ProblemCode::RequestTimeout, detail)
    })?;
    // What else can go wrong here is a client that left, which nobody is told of.
    arrived.map_err(|_| too_large(""))
}

/// Solves and writes the final bytes.
fn solve<Q: Question>(
    checked: &Q::Checked,
    representation: Representation,
    stop: &AtomicBool,
) -> Result<Stored, Problem> {
    #[cfg(feature = "fault-injection")]
    fail::fail_point!("solve");
    let started = Instant::now();
    let answer = Q::answer(checked, stop)?;
    let solve = started.elapsed();
    let expected_bytes = if representation.gzip { 0 } else { answer.expected_bytes() };
    let writer = Stoppable { inner: Vec::with_capacity(expected_bytes), next_look: LOOK_EVERY_BYTES, stop };
    let written = if representation.gzip {
        let mut encoder = GzEncoder::new(writer, Compression::fast());
        answer.write(representation.format, &mut encoder).and_then(|()| encoder.finish())
    } else {
        let mut writer = writer;
        answer.write(representation.format, &mut writer).map(|()| writer)
    };
    match written {
        Ok(writer) => {
            let server_timing = format!("solve;dur={:.3}", 1e3 * solve.as_secs_f64());
            let server_timing = HeaderValue::try_from(server_timing).map_err(|error| Problem::internal(&error))?;
            // To its size: the cache keeps it, and weighs its length.
            Ok(Stored { body: writer.inner.into_boxed_slice().into(), sent: Sent::default(), solve, server_timing })
        }
        Err(_) if stop.load(Ordering::Relaxed) => Err(NoAnswer::stopped().into()),
        Err(error) => Err(Problem::internal(&error)),
    }
}

/// How much of a large answer is written between two looks at the stop signal.
const LOOK_EVERY_BYTES: usize = 1 << 16;

/// A buffer that fails once the stop signal is set, so that writing a large answer stops too.
struct Stoppable<'a> {
    inner: Vec<u8>,
    next_look: usize,
    stop: &'a AtomicBool,
}

impl Write for Stoppable<'_> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.write_all(bytes).map(|()| bytes.len())
    }

    // Numbers come one by one: this is called for each.
    #[inline]
    fn write_all(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.inner.extend_from_slice(bytes);
        if self.inner.len() >= self.next_look {
            self.next_look = self.inner.len() + LOOK_EVERY_BYTES;
            if self.stop.load(Ordering::Relaxed) {
                return Err(io::Error::other("stopped"));
            }
        }
        Ok(())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

/// How long a solve took.
pub const SERVER_TIMING: HeaderName = HeaderName::from_static("server-timing");
/// Where an answer came from (RFC 9211).
pub const CACHE_STATUS: HeaderName = HeaderName::from_static("cache-status");

fn with_body(room: &Room, stored: Stored, representation: Representation) -> Result<Response, Problem> {
    let mut response = (StatusCode::OK, room.take(stored.body, &stored.sent)?).into_response();
    let headers = response.headers_mut();
    // Those here and those of the layers around.
    headers.reserve(12);
    headers.insert(header::CONTENT_TYPE, HeaderValue::from_static(negotiation::content_type(representation.format)));
    if representation.gzip {
        headers.insert(header::CONTENT_ENCODING, HeaderValue::from_static("gzip"));
    }
    headers.insert(SERVER_TIMING, stored.server_timing);
    Ok(response)
}

/// The headers about caching that 200 and 304 share.
fn caching(mut response: Response, provenance: Provenance, etag: &str) -> Response {
    response.extensions_mut().insert(provenance);
    let headers = response.headers_mut();
    if let Ok(etag) = HeaderValue::from_str(etag) {
        headers.insert(header::ETAG, etag);
    }
    headers.insert(header::VARY, HeaderValue::from_static("accept, accept-encoding"));
    headers.insert(CACHE_STATUS, HeaderValue::from_static(provenance.served.cache_status()));
    response
}
