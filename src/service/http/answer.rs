//! Answers a request with a design document: bytes, document, key, cache, checked parameters, answer, bytes.

use std::io::{self, Write};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use axum::body::Body;
use axum::extract::Request;
use axum::http::request::Parts;
use axum::http::{HeaderMap, HeaderName, HeaderValue, StatusCode, header};
use axum::response::{IntoResponse, Response};
use bytes::{Bytes, BytesMut};
use flate2::Compression;
use flate2::write::GzEncoder;
use futures_util::StreamExt as _;
use toothwave_calculation::design::Design;
use toothwave_calculation::forms::Forms;
use toothwave_calculation::no_answer::NoAnswer;
use toothwave_calculation::question::Question;
use utoipa::IntoResponses;

use super::negotiation::{self, Representation};
use super::problem::{Problem, ProblemCode};
use crate::app::App;
use crate::compute::budget::{Budget, FREE_BYTES, Reservation};
use crate::compute::cache::{Answer, CacheStatus, MAX_BODY_BYTES, RequestHash};
use crate::compute::pool::{Deadline, within};

/// Largest document that is parsed on the executor. This takes some 0.1 ms.
const SHORT_DOCUMENT_BYTES: usize = 8 << 10;

/// Bytes of a refused body that are still read. The client then gets the refusal instead of a connection reset.
const MAX_DISCARDED_BYTES: usize = 1 << 20;

/// Header with the time of the computation.
pub const SERVER_TIMING: HeaderName = HeaderName::from_static("server-timing");

/// Header with the source of the answer (RFC 9211).
pub const CACHE_STATUS: HeaderName = HeaderName::from_static("cache-status");

/// Problem responses of every endpoint for design documents.
#[derive(IntoResponses)]
pub enum Problems {
    /// The body is not JSON.
    #[response(status = 400, content_type = "application/problem+json")]
    Malformed(#[to_schema] Problem),
    /// The client accepts no available representation.
    #[response(status = 406, content_type = "application/problem+json")]
    NotAcceptable(#[to_schema] Problem),
    /// The body did not arrive within the time limit.
    #[response(status = 408, content_type = "application/problem+json")]
    RequestTimeout(#[to_schema] Problem),
    /// The body exceeds `max_body_bytes`.
    #[response(status = 413, content_type = "application/problem+json")]
    BodyTooLarge(#[to_schema] Problem),
    /// The body is not plain `application/json`.
    #[response(status = 415, content_type = "application/problem+json")]
    UnsupportedMediaType(#[to_schema] Problem),
    /// The JSON is not a design document, or the drive, load or request is impossible.
    #[response(status = 422, content_type = "application/problem+json")]
    Unprocessable(#[to_schema] Problem),
    /// The service has an internal error.
    #[response(status = 500, content_type = "application/problem+json")]
    Internal(#[to_schema] Problem),
    /// The service is full, or the deadline stopped the computation. `Retry-After` has the seconds until a retry.
    #[response(status = 503, content_type = "application/problem+json", headers(("Retry-After" = u32, description = "Seconds")))]
    Unavailable(#[to_schema] Problem),
}

/// Source of an answer. The response carries it as an extension for log and metrics.
#[derive(Debug, Clone, Copy)]
pub struct Provenance {
    /// Cache or computation.
    pub status: CacheStatus,
    /// Time of the computation.
    pub solve: Duration,
}

/// Answers a request, from the cache if possible.
pub async fn respond<Q: Question>(question: Q, app: Arc<App>, request: Request) -> Response {
    let deadline = app.deadline();
    within(deadline, answer_request(question, app, deadline, request)).await.unwrap_or_else(IntoResponse::into_response)
}

async fn answer_request<Q: Question>(
    question: Q,
    app: Arc<App>,
    deadline: Deadline,
    request: Request,
) -> Result<Response, Problem> {
    let DocumentRequest { headers, body, representation } = DocumentRequest::read::<Q>(&app, deadline, request).await?;
    let hash = RequestHash::new(&question.name(), representation, &body);
    let known = app.cache.key(hash).and_then(|key| app.cache.get(key).map(|answer| (key, answer)));
    let (key, answer, status) = match known {
        Some((key, answer)) => (key, answer, CacheStatus::Hit),
        None => {
            let (design, (question, key)) = read_design(&app, body, move |design| {
                let key = question.key(design, &representation);
                (question, key)
            })
            .await?;
            let (answer, status) = match app.cache.get(key) {
                Some(answer) => (answer, CacheStatus::Hit),
                None => {
                    let checked = question.check(&design, &app.limits.of_calculation())?;
                    let compute = compute::<Q>(Arc::clone(&app), checked, representation);
                    app.cache.get_or_compute(key, compute).await?
                }
            };
            app.cache.remember(hash, key);
            (key, answer, status)
        }
    };
    tracing::Span::current().record("design", tracing::field::display(key));
    let etag = format!("\"{key}\"");
    let solve = answer.solve;
    let mut response = if negotiation::is_not_modified(&headers, &etag) {
        StatusCode::NOT_MODIFIED.into_response()
    } else {
        with_body(&app.budget, answer, representation).await?
    };
    response.extensions_mut().insert(Provenance { status, solve });
    let headers = response.headers_mut();
    // Hexadecimal digits and quotes are always a valid header value.
    headers.insert(header::ETAG, HeaderValue::from_str(&etag).unwrap_or(HeaderValue::from_static("")));
    headers.insert(header::VARY, HeaderValue::from_static("accept, accept-encoding"));
    headers.insert(CACHE_STATUS, HeaderValue::from_static(status.header()));
    Ok(response)
}

/// Answers a request without the cache, because the answer contains measured times.
pub async fn respond_uncached<Q: Question>(question: Q, app: Arc<App>, request: Request) -> Response {
    let deadline = app.deadline();
    let answer = async {
        let DocumentRequest { body, representation, .. } = DocumentRequest::read::<Q>(&app, deadline, request).await?;
        let (design, ()) = read_design(&app, body, |_| ()).await?;
        let checked = question.check(&design, &app.limits.of_calculation())?;
        let answer = compute::<Q>(Arc::clone(&app), checked, representation).await?;
        with_body(&app.budget, answer, representation).await
    };
    let mut response = within(deadline, answer).await.unwrap_or_else(IntoResponse::into_response);
    response.headers_mut().insert(header::CACHE_CONTROL, HeaderValue::from_static("no-store"));
    response
}

/// A request with a design document.
struct DocumentRequest {
    headers: HeaderMap,
    body: Bytes,
    representation: Representation,
}

impl DocumentRequest {
    async fn read<Q: Question>(app: &App, deadline: Deadline, request: Request) -> Result<Self, Problem> {
        let (Parts { headers, uri, .. }, body) = request.into_parts();
        let formats = negotiation::formats::<Q::Answer>(&uri)?;
        negotiation::require_json(&headers)?;
        let representation = Representation::negotiate(&headers, formats)?;
        let body = read_body(app, deadline, &headers, body).await?;
        Ok(Self { headers, body, representation })
    }
}

/// Reads the body of a request, at most `max_body_bytes` long. Fails with `body_too_large`, `broken_body`,
/// `request_timeout` or `shutting_down`.
pub async fn read_body(app: &App, deadline: Deadline, headers: &HeaderMap, body: Body) -> Result<Bytes, Problem> {
    let limit = app.limits.max_body_bytes;
    let announced = headers.get(header::CONTENT_LENGTH).and_then(|length| length.to_str().ok()?.parse::<usize>().ok());
    let mut pieces = body.into_data_stream();
    let (mut whole, mut length) = (BytesMut::new(), 0);
    let reading = async {
        while let Some(piece) = pieces.next().await {
            let piece = piece.map_err(|error| broken_body(&error))?;
            length += piece.len();
            if length <= limit {
                whole.extend_from_slice(&piece);
            } else if length > limit + MAX_DISCARDED_BYTES {
                break;
            }
        }
        Ok::<_, Problem>(())
    };
    let in_time = tokio::select! {
        in_time = tokio::time::timeout_at(deadline.at, reading) => in_time,
        () = app.pool.stopped() => return Err(Problem::new(ProblemCode::ShuttingDown, "the service is stopping. Retry")),
    };
    match in_time {
        Ok(read) => read?,
        Err(_) => {
            let detail =
                format!("the body did not arrive within `deadline_ms` ({} ms). Send it faster", app.limits.deadline_ms);
            return Err(Problem::new(ProblemCode::RequestTimeout, detail));
        }
    }
    if length > limit {
        let length = announced.map_or_else(|| format!("more than {limit}"), |announced| announced.to_string());
        let detail = format!("the body has {length} bytes. Send at most {limit} bytes (`max_body_bytes`)");
        return Err(Problem::new(ProblemCode::BodyTooLarge, detail));
    }
    Ok(whole.freeze())
}

/// Returns the problem of an incomplete body.
pub fn broken_body(error: &dyn std::fmt::Display) -> Problem {
    Problem::new(ProblemCode::BrokenBody, format!("the body is incomplete or damaged: {error}. Send it again"))
}

/// Parses the design and computes a value from it. The pool parses long documents, not the executor.
async fn read_design<T: Send + 'static>(
    app: &App,
    body: Bytes,
    view: impl FnOnce(&Design) -> T + Send + 'static,
) -> Result<(Design, T), Problem> {
    let is_short = body.len() <= SHORT_DOCUMENT_BYTES;
    let read = move || {
        let design = Design::read(&body)?;
        let value = view(&design);
        Ok((design, value))
    };
    if is_short { read() } else { app.pool.run(move |_| read()).await }
}

/// Reserves bytes, waits for a permit, and computes an answer.
async fn compute<Q: Question>(
    app: Arc<App>,
    checked: Q::Checked,
    representation: Representation,
) -> Result<Answer, Problem> {
    let bytes = app.budget.bound(Q::max_bytes(&checked, representation.format));
    let reservation = app.budget.reserve(bytes).await?;
    let is_short = representation == Representation::JSON && reservation.is_none() && Q::is_short(&checked);
    let job = move |stop: &AtomicBool| solve::<Q>(&checked, representation, reservation, stop);
    if is_short { app.pool.run_inline(job).await } else { app.pool.run(job).await }
}

/// Computes an answer and writes its body, which holds the rest of the reservation. Fails with `too_many_states` if the
/// answer exceeds its reservation.
fn solve<Q: Question>(
    checked: &Q::Checked,
    representation: Representation,
    reservation: Option<Reservation>,
    stop: &AtomicBool,
) -> Result<Answer, Problem> {
    let started = Instant::now();
    let answer = Q::answer(checked, stop)?;
    let solve = started.elapsed();
    if let Some(reservation) = &reservation {
        require_within(reservation, answer.bytes(representation.format))?;
    }
    let body = write(&answer, representation, stop)?;
    drop(answer);
    let server_timing = format!("solve;dur={:.3}", 1e3 * solve.as_secs_f64());
    let server_timing = HeaderValue::try_from(server_timing).map_err(|error| Problem::internal(&error))?;
    Ok(Answer { reservation: shrink_to_body(reservation, body.len()), body, solve, server_timing })
}

/// Checks that an answer fits into its reservation.
pub fn require_within(reservation: &Reservation, bytes: u64) -> Result<(), Problem> {
    if bytes <= reservation.bytes() {
        return Ok(());
    }
    let detail = format!(
        "the answer needs {bytes} bytes, but a sweep with a tolerance may take at most {}. Use a larger tolerance",
        reservation.bytes()
    );
    Err(Problem::new(ProblemCode::TooManyStates, detail))
}

/// Returns the bytes that a body does not need to the budget. A small body returns all.
pub fn shrink_to_body(reservation: Option<Reservation>, bytes: usize) -> Option<Arc<Reservation>> {
    let mut reservation = reservation.filter(|_| bytes as u64 > FREE_BYTES)?;
    reservation.shrink_to(bytes as u64);
    Some(Arc::new(reservation))
}

/// Writes an answer in its representation. Fails with `deadline_exceeded` if the stop flag is set.
pub fn write<A: Forms>(
    answer: &A,
    Representation { format, gzip }: Representation,
    stop: &AtomicBool,
) -> Result<Bytes, Problem> {
    let is_long = !gzip && format.writes_all_numbers();
    let buffer = Vec::with_capacity(if is_long { answer.expected_bytes() } else { 0 });
    let written = if gzip {
        let mut writer = StoppableWriter::new(GzEncoder::new(buffer, Compression::fast()), stop);
        answer.write(format, &mut writer).and_then(|()| writer.inner.finish())
    } else {
        let mut writer = StoppableWriter::new(buffer, stop);
        answer.write(format, &mut writer).map(|()| writer.inner)
    };
    written.map(without_spare).map_err(|error| write_problem(&error, stop))
}

/// Returns the bytes without spare capacity. Bytes for the cache are copied: the buffer is reused at once.
fn without_spare(bytes: Vec<u8>) -> Bytes {
    if bytes.len() <= MAX_BODY_BYTES { Bytes::copy_from_slice(&bytes) } else { bytes.into_boxed_slice().into() }
}

/// Returns the problem of an answer that could not be written.
pub fn write_problem(error: &io::Error, stop: &AtomicBool) -> Problem {
    if stop.load(Ordering::Relaxed) { NoAnswer::stopped().into() } else { Problem::internal(error) }
}

/// Bytes written between two checks of the stop flag.
const STOP_CHECK_BYTES: usize = 1 << 16;

/// A writer that fails once the stop flag is set.
pub struct StoppableWriter<'a, W> {
    /// The target of the bytes.
    pub inner: W,
    bytes_until_check: usize,
    stop: &'a AtomicBool,
}

impl<'a, W> StoppableWriter<'a, W> {
    /// Writes to `inner` until `stop` is set.
    pub const fn new(inner: W, stop: &'a AtomicBool) -> Self {
        Self { inner, bytes_until_check: STOP_CHECK_BYTES, stop }
    }

    #[cold]
    fn check_stop(&mut self) -> io::Result<()> {
        self.bytes_until_check = STOP_CHECK_BYTES;
        if self.stop.load(Ordering::Relaxed) { Err(io::Error::other("stopped")) } else { Ok(()) }
    }
}

impl<W: Write> Write for StoppableWriter<'_, W> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.write_all(bytes).map(|()| bytes.len())
    }

    // Inlined, because every number calls it.
    #[inline]
    fn write_all(&mut self, bytes: &[u8]) -> io::Result<()> {
        match self.bytes_until_check.checked_sub(bytes.len()) {
            Some(rest) => self.bytes_until_check = rest,
            None => self.check_stop()?,
        }
        self.inner.write_all(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.check_stop()?;
        self.inner.flush()
    }
}

async fn with_body(budget: &Budget, answer: Answer, representation: Representation) -> Result<Response, Problem> {
    let Answer { body, reservation, server_timing, .. } = answer;
    // A large answer may leave the cache while a slow client still reads it.
    let reservation = match reservation {
        None => shrink_to_body(budget.reserve(body.len() as u64).await?, body.len()),
        reservation => reservation,
    };
    let mut response = body_response(Reservation::hold(reservation, body), representation);
    response.headers_mut().insert(SERVER_TIMING, server_timing);
    Ok(response)
}

/// Returns the response with this body.
pub fn body_response(body: Bytes, Representation { format, gzip }: Representation) -> Response {
    let mut response = (StatusCode::OK, body).into_response();
    let headers = response.headers_mut();
    // Space for these headers and those of the middleware.
    headers.reserve(12);
    headers.insert(header::CONTENT_TYPE, HeaderValue::from_static(format.media_type()));
    if gzip {
        headers.insert(header::CONTENT_ENCODING, HeaderValue::from_static("gzip"));
    }
    response
}

#[cfg(test)]
mod tests {
    use std::io::Write as _;
    use std::sync::atomic::AtomicBool;

    use flate2::Compression;
    use flate2::write::GzEncoder;

    use super::{STOP_CHECK_BYTES, StoppableWriter};

    /// Compressed output may be tiny (1 KB for 1 MB of zeros), so the check counts input bytes.
    #[test]
    fn stops_while_compressing() {
        let stop = AtomicBool::new(true);
        let mut writer = StoppableWriter::new(GzEncoder::new(Vec::new(), Compression::fast()), &stop);
        let written = (0..STOP_CHECK_BYTES).take_while(|_| writer.write_all(&[0; 1024]).is_ok()).count();
        assert!(written * 1024 <= STOP_CHECK_BYTES, "{written} KiB");
    }
}
