//! `POST /v1/batch`: many design documents for one endpoint, one a line. Answers keep the order of the lines.
//!
//! Lines are answered in slices of 5 ms; each slice is one background computation. As many computations run at once as
//! there are permits. If the client does not read, no further line is computed.

use std::io::{self, Write as _};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use axum::body::Body;
use axum::extract::{Request, State};
use axum::http::{HeaderValue, StatusCode, header};
use axum::response::{IntoResponse, Response};
use bytes::Bytes;
use clap::ValueEnum;
use futures_util::{Stream, StreamExt as _, TryStreamExt as _, stream};
use metrics::counter;
use parking_lot::Mutex;
use serde::{Deserialize, Serialize};
use tokio_util::codec::{AnyDelimiterCodec, AnyDelimiterCodecError, FramedRead};
use tokio_util::io::StreamReader;
use tokio_util::task::AbortOnDropHandle;
use toothwave_calculation::coincidence_degree::CoincidenceDegree;
use toothwave_calculation::columns;
use toothwave_calculation::design::Design;
use toothwave_calculation::forms::{Format, Forms};
use toothwave_calculation::geometry::Geometry;
use toothwave_calculation::question::{Limits, Question};
use toothwave_calculation::sweep::Sweep;
use toothwave_calculation::sweep::answer::SweepAnswer;
use toothwave_calculation::sweep::peaks_only::PeaksOnly;
use utoipa::ToSchema;

use crate::app::App;
use crate::compute::budget::{FREE_BYTES, Reservation};
use crate::compute::pool::catch_panic;
use crate::http::answer::{StoppableWriter, broken_body, require_within, shrink_to_body, write_problem};
use crate::http::negotiation;
use crate::http::observe::note_problem;
use crate::http::problem::{Problem, ProblemCode};
use crate::ops::config::CLIENT_TIMEOUT_MS;

/// Bytes that are read before the response begins, behind a proxy. nginx forwards no more of a request after its
/// response has begun.
const READ_AHEAD_BYTES: usize = 8 << 20;

/// Most lines in one slice.
const CHUNK_LINES: usize = 64;

/// Time after which a slice computes no further line.
const SLICE: Duration = Duration::from_millis(5);

/// Bytes of answers after which a slice computes no further line.
const SLICE_BYTES: usize = 1 << 20;

/// Media type of a batch and of its answers.
const NDJSON: &str = "application/x-ndjson";

/// Calculation that a batch runs for each document.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize, ToSchema, ValueEnum)]
#[serde(rename_all = "kebab-case")]
pub enum BatchEndpoint {
    /// Profiles of the mating parts
    Geometry,
    /// Contact ratio (coincidence degree): how many teeth share the load
    CoincidenceDegree,
    /// Forces and contact stresses over one period
    #[default]
    Sweep,
}

/// Query parameters of a batch.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize, utoipa::IntoParams)]
#[serde(deny_unknown_fields, default)]
#[into_params(parameter_in = Query)]
pub struct BatchQuery {
    /// The calculation for every document.
    #[param(inline, required = false)]
    pub endpoint: BatchEndpoint,
    /// For sweeps: return the peaks and the totals of the losses, without the states and all other columns.
    #[param(required = false)]
    pub peaks_only: bool,
}

impl BatchQuery {
    /// Checks that `peaks_only` is used with sweeps alone.
    pub fn require_possible(self) -> Result<(), Problem> {
        if self.peaks_only && self.endpoint != BatchEndpoint::Sweep {
            let detail = "`peaks_only` needs the endpoint `sweep`. Leave out `peaks_only`, or set `endpoint=sweep`";
            return Err(Problem::new(ProblemCode::InvalidQuery, detail));
        }
        Ok(())
    }
}

/// One line of the response: the answer or the problem of one document.
#[derive(Debug, Serialize, ToSchema)]
pub struct BatchLine<A> {
    /// Index of the document, from 0. Blank lines do not count.
    pub index: u64,
    /// HTTP status that a single request with this document would get.
    pub status: u16,
    /// The answer of the endpoint.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub answer: Option<A>,
    /// The problem, if there is no answer.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub problem: Option<Problem>,
}

/// The last line. It shows that the response is complete.
#[derive(Debug, Default, Clone, Serialize, ToSchema)]
pub struct BatchEnd {
    /// Documents that were received.
    pub asked: u64,
    /// Documents that were answered.
    pub answered: u64,
    /// The problem that ended the batch early.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub problem: Option<Problem>,
}

/// Returns a value as a line of JSON.
pub fn json_line(value: &impl Serialize) -> Vec<u8> {
    let mut line = serde_json::to_vec(value).unwrap_or_default();
    line.push(b'\n');
    line
}

/// Returns the line of a document without an answer, counts it, and logs the cause of an internal error.
fn problem_line(index: u64, problem: Problem) -> Vec<u8> {
    count(problem.status);
    note_problem(&problem);
    json_line(&BatchLine::<()> { index, status: problem.status, answer: None, problem: Some(problem) })
}

fn count(status: u16) {
    counter!("toothwave_batch_documents_total", "status" => status.to_string()).increment(1);
}

/// Returns the line of an answer.
fn answer_line<A: Forms>(index: u64, answer: &A, stop: &AtomicBool) -> Result<Vec<u8>, Problem> {
    let status = StatusCode::OK.as_u16();
    let line = BatchLine { index, status, answer: Some(answer), problem: None };
    let mut writer = StoppableWriter::new(Vec::with_capacity(answer.expected_bytes()), stop);
    let written = columns::write(&line, &mut writer).and_then(|()| writer.write_all(b"\n"));
    written.map_err(|error| write_problem(&error, stop))?;
    count(status);
    Ok(writer.inner)
}

/// Index and content of a line, or the reason for a missing content.
type Line = (u64, Result<Bytes, Problem>);

/// Computes the line of an answer, which must fit into its reservation.
type Compute = Box<dyn FnOnce(Option<&Reservation>, &AtomicBool) -> Result<Vec<u8>, Problem> + Send>;

/// Checks a document. Returns the upper bound of the answer's bytes, if it is known, and the computation.
fn checked<Q: Question, A: Forms>(
    question: &Q,
    index: u64,
    document: &[u8],
    limits: &Limits,
    view: fn(Q::Answer) -> A,
) -> Result<(Option<u64>, Compute), Problem> {
    let checked = question.check(&Design::read(document)?, limits)?;
    let bytes = Q::max_bytes(&checked, Format::Json);
    let compute = move |reservation: Option<&Reservation>, stop: &AtomicBool| {
        let answer = view(Q::answer(&checked, stop)?);
        if let Some(reservation) = reservation {
            require_within(reservation, answer.bytes(Format::Json))?;
        }
        answer_line(index, &answer, stop)
    };
    Ok((bytes, Box::new(compute)))
}

impl BatchQuery {
    fn check(self, index: u64, document: &[u8], limits: &Limits) -> Result<(Option<u64>, Compute), Problem> {
        match self.endpoint {
            BatchEndpoint::Geometry => checked(&Geometry, index, document, limits, |answer| answer),
            BatchEndpoint::CoincidenceDegree => checked(&CoincidenceDegree, index, document, limits, |answer| answer),
            BatchEndpoint::Sweep if self.peaks_only => checked(&Sweep, index, document, limits, PeaksOnly),
            BatchEndpoint::Sweep => checked(&Sweep, index, document, limits, |answer| answer),
        }
    }
}

/// Computes the line of one document at once.
pub fn computed_line(query: BatchQuery, index: u64, document: &[u8], limits: &Limits) -> Vec<u8> {
    let line = catch_panic(|| query.check(index, document, limits)?.1(None, &AtomicBool::new(false)));
    line.unwrap_or_else(|problem| problem_line(index, problem))
}

/// A part of the response: finished lines and their number, or a large answer that must reserve bytes first.
enum Part {
    Lines(Vec<u8>, u64),
    Large { index: u64, bytes: u64, compute: Compute },
}

/// Progress of one slice. It remains if the deadline ends the slice.
#[derive(Default)]
struct Progress {
    current: Option<u64>,
    done: usize,
    parts: Vec<Part>,
}

impl Progress {
    /// Adds the part of one document. Lines are joined.
    fn push(&mut self, part: Part) {
        self.done += 1;
        match (part, self.parts.last_mut()) {
            (Part::Lines(line, added), Some(Part::Lines(lines, count))) => {
                lines.extend_from_slice(&line);
                *count += added;
            }
            (part, _) => self.parts.push(part),
        }
    }
}

/// Answers lines until the slice has used its time or its bytes.
fn answer_lines(app: &App, query: BatchQuery, lines: Vec<Line>, progress: &Mutex<Progress>, stop: &AtomicBool) {
    let (started, mut bytes) = (Instant::now(), 0);
    for (index, document) in lines {
        progress.lock().current = Some(index);
        let part = catch_panic(|| {
            let (bound, compute) = query.check(index, &document?, &app.limits.of_calculation())?;
            let bytes = app.budget.bound(bound);
            if bytes > FREE_BYTES {
                return Ok(Part::Large { index, bytes, compute });
            }
            Ok(Part::Lines(compute(None, stop)?, 1))
        });
        let mut progress = progress.lock();
        // `slice` reports a line that the deadline has ended.
        if stop.load(Ordering::Relaxed) || progress.current.take() != Some(index) {
            return;
        }
        let part = part.unwrap_or_else(|problem| Part::Lines(problem_line(index, problem), 1));
        bytes += if let Part::Lines(line, _) = &part { line.len() } else { 0 };
        progress.push(part);
        if started.elapsed() >= SLICE || bytes >= SLICE_BYTES {
            return;
        }
    }
}

/// Runs a computation in its own task, which goes on while the client does not read. Otherwise it would keep its permit
/// from other requests for as long as the client likes.
async fn in_task<T: Send + 'static>(
    computation: impl Future<Output = Result<T, Problem>> + Send + 'static,
) -> Result<T, Problem> {
    let task = AbortOnDropHandle::new(tokio::spawn(computation));
    task.await.unwrap_or_else(|panic| Err(Problem::internal(&panic)))
}

/// Computes one slice. Returns the parts of its lines (at least one) and the remaining lines.
async fn slice(app: Arc<App>, query: BatchQuery, mut lines: Vec<Line>) -> (Vec<Part>, Vec<Line>) {
    let progress = Arc::new(Mutex::new(Progress::default()));
    let (shared, waiting) = (Arc::clone(&progress), lines.clone());
    let computation = async move {
        let (pool, time) = (app.pool.clone(), app.deadline_span() + SLICE);
        let job = move |stop: &AtomicBool| {
            answer_lines(&app, query, waiting, &shared, stop);
            Ok(())
        };
        pool.run_in_background(time, job).await
    };
    let result = in_task(computation).await;
    let mut progress = progress.lock();
    if let Err(problem) = result {
        // The problem belongs to the current line, or to the first line if none has begun, as when the service stops.
        // So every slice answers at least one line, and every batch ends.
        let next = lines.first().map(|(index, _)| *index).filter(|_| progress.done == 0);
        if let Some(index) = progress.current.take().or(next) {
            progress.push(Part::Lines(problem_line(index, problem), 1));
        }
    }
    // Lines are answered in order: the parts are those of the first lines.
    lines.drain(..progress.done);
    (std::mem::take(&mut progress.parts), lines)
}

/// Computes the line of a large answer. The line holds its reservation.
async fn answer_large_line(app: Arc<App>, index: u64, bytes: u64, compute: Compute) -> Bytes {
    let line = in_task(async move {
        let reservation = app.budget.reserve(bytes).await?;
        let job = move |stop: &AtomicBool| {
            let line = compute(reservation.as_ref(), stop)?;
            Ok((shrink_to_body(reservation, line.len()), line))
        };
        let (reservation, line) = app.pool.run_in_background(app.deadline_span(), job).await?;
        Ok(Reservation::hold(reservation, line.into()))
    });
    line.await.unwrap_or_else(|problem| problem_line(index, problem).into())
}

/// Returns the lines of a body that are not blank. If the body ends early, the problem goes to `end`.
fn lines(app: Arc<App>, body: Body, end: Arc<Mutex<BatchEnd>>) -> impl Stream<Item = Line> {
    let limit = app.limits.max_body_bytes;
    let reader = StreamReader::new(body.into_data_stream().map_err(io::Error::other));
    // One byte more, for a carriage return.
    let codec = AnyDelimiterCodec::new_with_max_length(b"\n".to_vec(), Vec::new(), limit + 1);
    stream::unfold(FramedRead::new(reader, codec), move |mut framed| {
        let (app, end) = (Arc::clone(&app), Arc::clone(&end));
        async move {
            let line = loop {
                let problem = tokio::select! {
                    next = tokio::time::timeout(Duration::from_millis(CLIENT_TIMEOUT_MS), framed.next()) => match next {
                        Ok(None) => return None,
                        Ok(Some(Ok(line))) if line.trim_ascii().is_empty() => continue,
                        Ok(Some(Ok(line))) => break Ok(Bytes::copy_from_slice(line.trim_ascii())),
                        Ok(Some(Err(AnyDelimiterCodecError::MaxChunkLengthExceeded))) => {
                            // After this error the stream ends once; the next poll continues after the line.
                            framed.next().await;
                            let detail = format!("the line has more than {limit} bytes (`max_body_bytes`). Shorten it");
                            break Err(Problem::new(ProblemCode::BodyTooLarge, detail));
                        }
                        Ok(Some(Err(AnyDelimiterCodecError::Io(error)))) => broken_body(&error),
                        Err(_) => {
                            let detail = format!("no line arrived for {CLIENT_TIMEOUT_MS} ms. Send the remaining lines again");
                            Problem::new(ProblemCode::RequestTimeout, detail)
                        }
                    },
                    () = app.pool.stopped() => {
                        Problem::new(ProblemCode::ShuttingDown, "the service is stopping. Send the remaining lines again")
                    }
                };
                end.lock().problem = Some(problem);
                return None;
            };
            let index = end.lock().asked;
            end.lock().asked += 1;
            Some(((index, line), framed))
        }
    })
}

/// Returns the answers in the order of the lines, then the last line.
fn answers(app: Arc<App>, query: BatchQuery, body: Body) -> impl Stream<Item = Bytes> {
    let end = Arc::new(Mutex::new(BatchEnd::default()));
    let at_once = app.pool.permits();
    let (counted, ending) = (Arc::clone(&end), Arc::clone(&end));
    let chunks = lines(Arc::clone(&app), body, end).ready_chunks(CHUNK_LINES);
    let (first_app, next_app, large_app) = (Arc::clone(&app), Arc::clone(&app), app);
    // The first slices of several chunks run in parallel. The next slice of a chunk begins when the stream is polled for it.
    let first = chunks.map(move |lines| slice(Arc::clone(&first_app), query, lines)).buffered(at_once);
    let slices = first.flat_map(move |first| {
        let app = Arc::clone(&next_app);
        stream::unfold((first, app), move |((mut parts, mut rest), app)| async move {
            if parts.is_empty() && !rest.is_empty() {
                (parts, rest) = slice(Arc::clone(&app), query, rest).await;
            }
            (!parts.is_empty()).then(|| (parts, ((Vec::new(), rest), app)))
        })
    });
    let finished = slices.flat_map(stream::iter).map(move |part| {
        let app = Arc::clone(&large_app);
        async move {
            match part {
                Part::Lines(lines, count) => (count, lines.into()),
                Part::Large { index, bytes, compute } => (1, answer_large_line(app, index, bytes, compute).await),
            }
        }
    });
    let parts = finished.buffered(at_once).map(move |(count, part)| {
        counted.lock().answered += count;
        part
    });
    // The last line is made after all other lines were sent.
    parts.chain(stream::once(async move { json_line(&*ending.lock()).into() }))
}

/// Reads the first bytes of a body, or all of it.
async fn read_ahead(app: &App, body: Body) -> Result<Body, Problem> {
    let mut pieces = body.into_data_stream();
    let (mut read, mut bytes) = (Vec::new(), 0);
    let deadline = app.deadline();
    while bytes < READ_AHEAD_BYTES {
        let next = tokio::select! {
            next = tokio::time::timeout_at(deadline.at, pieces.next()) => next,
            () = app.pool.stopped() => break,
        };
        // A timeout or a broken body appears again when the batch reads on.
        let Ok(Some(piece)) = next else { break };
        bytes += piece.as_ref().map_or(0, Bytes::len);
        read.push(piece);
    }
    Ok(Body::from_stream(stream::iter(read).chain(pieces)))
}

/// Answers many design documents, one a line, in the same order.
#[utoipa::path(
    post,
    path = "/v1/batch",
    tag = "drive",
    params(BatchQuery),
    request_body(content = String, content_type = "application/x-ndjson", description = "One design document a line. The response begins before the request ends: read answers while you send, or send at most 8 MiB ahead of them."),
    responses(
        (status = 200, description = "One line for each document, in the same order: `{\"index\", \"status\", \"answer\"}` or `{\"index\", \"status\", \"problem\"}`. The last line is `{\"asked\", \"answered\"}`, with a `problem` if the batch ended early.", body = BatchLine<SweepAnswer>, content_type = "application/x-ndjson"),
        (status = 400, description = "The query parameter is unknown or invalid.", body = Problem, content_type = "application/problem+json"),
        (status = 415, description = "The body is not `application/x-ndjson`.", body = Problem, content_type = "application/problem+json"),
        (status = 503, description = "The limit of running batches is reached. `Retry-After` has the seconds until a retry.", body = Problem, content_type = "application/problem+json", headers(("Retry-After" = u32, description = "Seconds")))
    )
)]
pub async fn batch(State(app): State<Arc<App>>, request: Request) -> Response {
    begin(app, request).await.unwrap_or_else(IntoResponse::into_response)
}

async fn begin(app: Arc<App>, request: Request) -> Result<Response, Problem> {
    let query: BatchQuery = negotiation::query(request.uri())?;
    query.require_possible()?;
    negotiation::require_ndjson(request.headers())?;
    let place = app.pool.begin_batch()?;
    let is_behind_proxy = request.headers().contains_key("x-forwarded-for");
    let body = request.into_body();
    let body = if is_behind_proxy { read_ahead(&app, body).await? } else { body };
    let answers = answers(app, query, body).map(move |line| {
        // The permit is held until the last line is sent or the client leaves.
        let _held = &place;
        Ok::<_, io::Error>(line)
    });
    let mut response = Body::from_stream(answers).into_response();
    response.headers_mut().insert(header::CONTENT_TYPE, HeaderValue::from_static(NDJSON));
    response.headers_mut().insert(header::CACHE_CONTROL, HeaderValue::from_static("no-store"));
    Ok(response)
}
