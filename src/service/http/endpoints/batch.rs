//! `POST /v1/batch`: many design documents for one endpoint, a line each, answered in their order while they are read.
//!
//! Lines that have arrived are answered together, 5 ms of them in one computation in the background. As many computations run at once as
//! there are permits. If the client does not read the answers, no further line is begun.

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
use utoipa::ToSchema;

use super::peaks::PeaksOnly;
use crate::app::App;
use crate::compute::budget::{FREE_BYTES, Reservation};
use crate::compute::pool::catch_panic;
use crate::http::answer::{StoppableWriter, bound, broken_body, require_within, shrink_to_body, write_problem};
use crate::http::negotiation;
use crate::http::observe::note_problem;
use crate::http::problem::{Problem, ProblemCode};
use crate::ops::config::CLIENT_TIMEOUT_MS;

/// What is read of a batch before its answer begins, behind a proxy: nginx passes on no more of a request once its answer has begun.
const READ_AHEAD_BYTES: usize = 8 << 20;

/// Lines that are answered together at most.
const CHUNK_LINES: usize = 64;

/// A computation begins no further line after this time.
const SLICE: Duration = Duration::from_millis(5);

/// A computation begins no further line after this many bytes of answers.
const SLICE_BYTES: usize = 1 << 20;

/// The media type of a batch and of its answers.
const NDJSON: &str = "application/x-ndjson";

/// What a batch asks of each document.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize, ToSchema, ValueEnum)]
#[serde(rename_all = "kebab-case")]
pub enum BatchEndpoint {
    /// Profiles of the mating parts
    Geometry,
    /// How many teeth share the load
    CoincidenceDegree,
    /// Forces and contact stresses over one period
    #[default]
    Sweep,
}

/// How a batch is answered.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize, utoipa::IntoParams)]
#[serde(deny_unknown_fields, default)]
#[into_params(parameter_in = Query)]
pub struct BatchQuery {
    /// The endpoint that every document is put to.
    #[param(inline, required = false)]
    pub endpoint: BatchEndpoint,
    /// Of sweeps, the peaks and the totals of the losses, without the states and all other columns.
    #[param(required = false)]
    pub peaks_only: bool,
}

impl BatchQuery {
    /// Checks that `peaks_only` is asked of sweeps.
    pub fn require_possible(self) -> Result<(), Problem> {
        if self.peaks_only && self.endpoint != BatchEndpoint::Sweep {
            let detail = "only sweeps have peaks. Leave out `peaks_only`, or ask the endpoint `sweep`";
            return Err(Problem::new(ProblemCode::InvalidQuery, detail));
        }
        Ok(())
    }
}

/// One line of the answer: that of the document with this index, with `answer` or `problem`.
#[derive(Debug, Serialize, ToSchema)]
pub struct BatchLine<A> {
    /// Which document, from 0; blank lines do not count.
    pub index: u64,
    /// The status that the document would have been answered with by itself.
    pub status: u16,
    /// The answer, as the endpoint has it.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    pub answer: Option<A>,
    /// Why there is none.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    pub problem: Option<Problem>,
}

/// The last line: whoever finds it has all the others.
#[derive(Debug, Default, Clone, Serialize, ToSchema)]
pub struct BatchEnd {
    /// Documents that arrived.
    pub asked: u64,
    /// Lines that answer them.
    pub answered: u64,
    /// Why no more arrived, if the batch broke off.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    pub problem: Option<Problem>,
}

impl BatchEnd {
    /// The line.
    pub fn line(&self) -> Vec<u8> {
        let mut line = serde_json::to_vec(self).unwrap_or_default();
        line.push(b'\n');
        line
    }
}

/// The line of a document that has no answer; counts it and logs the cause of an internal error.
fn problem_line(index: u64, problem: Problem) -> Vec<u8> {
    count(problem.status);
    note_problem(&problem);
    let line = BatchLine::<()> { index, status: problem.status, answer: None, problem: Some(problem) };
    let mut text = serde_json::to_vec(&line).unwrap_or_default();
    text.push(b'\n');
    text
}

fn count(status: u16) {
    counter!("toothwave_batch_documents_total", "status" => status.to_string()).increment(1);
}

/// The line of an answer.
fn answer_line<A: Forms>(index: u64, answer: &A, stop: &AtomicBool) -> Result<Vec<u8>, Problem> {
    let status = StatusCode::OK.as_u16();
    let line = BatchLine { index, status, answer: Some(answer), problem: None };
    let mut writer = StoppableWriter::new(Vec::with_capacity(answer.expected_bytes()), stop);
    let written = columns::write(&line, &mut writer).and_then(|()| writer.write_all(b"\n"));
    written.map_err(|error| write_problem(&error, stop))?;
    count(status);
    Ok(writer.inner)
}

/// The line that answers one document, computed at once.
pub fn computed_line(query: BatchQuery, index: u64, document: &[u8], limits: &Limits) -> Vec<u8> {
    fn line<Q: Question>(question: &Q, index: u64, document: &[u8], limits: &Limits) -> Result<Vec<u8>, Problem> {
        let never = AtomicBool::new(false);
        answer_line(index, &question.ask(document, limits, &never)?, &never)
    }
    let line = catch_panic(|| match query.endpoint {
        BatchEndpoint::Geometry => line(&Geometry, index, document, limits),
        BatchEndpoint::CoincidenceDegree => line(&CoincidenceDegree, index, document, limits),
        BatchEndpoint::Sweep if query.peaks_only => line(&PeaksOnly, index, document, limits),
        BatchEndpoint::Sweep => line(&Sweep, index, document, limits),
    });
    line.unwrap_or_else(|problem| problem_line(index, problem))
}

/// A document that waits for its answer, or the reason why there is none.
type Line = (u64, Result<Bytes, Problem>);

/// Computes the line of a large answer, which has to fit into its reservation.
type Compute = Box<dyn FnOnce(Option<&Reservation>, &AtomicBool) -> Result<Vec<u8>, Problem> + Send>;

/// The outcome of a document.
enum Outcome {
    /// Its line.
    Line(Vec<u8>),
    /// Its answer has to reserve this many bytes first.
    Large(u64, Compute),
}

/// The outcomes of one slice. They are kept if the deadline ends the slice.
#[derive(Default)]
struct Progress {
    current: Option<u64>,
    outcomes: Vec<(u64, Outcome)>,
}

fn outcome<Q: Question>(
    app: &App,
    question: &Q,
    index: u64,
    document: &[u8],
    stop: &AtomicBool,
) -> Result<Outcome, Problem> {
    let checked = question.check(&Design::read(document)?, &app.limits.of_calculation())?;
    let bytes = bound::<Q>(&app.budget, &checked, Format::Json);
    if bytes <= FREE_BYTES {
        return answered::<Q>(index, &checked, None, stop).map(Outcome::Line);
    }
    Ok(Outcome::Large(bytes, Box::new(move |reservation, stop| answered::<Q>(index, &checked, reservation, stop))))
}

fn answered<Q: Question>(
    index: u64,
    checked: &Q::Checked,
    reservation: Option<&Reservation>,
    stop: &AtomicBool,
) -> Result<Vec<u8>, Problem> {
    let answer = Q::answer(checked, stop)?;
    if let Some(reservation) = reservation {
        require_within(reservation, answer.bytes(Format::Json))?;
    }
    answer_line(index, &answer, stop)
}

/// Answers lines until the time or the bytes of a slice are used up.
fn answer_lines(app: &App, query: BatchQuery, lines: Vec<Line>, progress: &Mutex<Progress>, stop: &AtomicBool) {
    let (started, mut bytes) = (Instant::now(), 0);
    for (index, document) in lines {
        progress.lock().current = Some(index);
        let outcome = catch_panic(|| match (document, query.endpoint) {
            (Err(problem), _) => Err(problem),
            (Ok(document), BatchEndpoint::Geometry) => outcome(app, &Geometry, index, &document, stop),
            (Ok(document), BatchEndpoint::CoincidenceDegree) => {
                outcome(app, &CoincidenceDegree, index, &document, stop)
            }
            (Ok(document), BatchEndpoint::Sweep) if query.peaks_only => {
                outcome(app, &PeaksOnly, index, &document, stop)
            }
            (Ok(document), BatchEndpoint::Sweep) => outcome(app, &Sweep, index, &document, stop),
        });
        let mut progress = progress.lock();
        // If the deadline has ended this line, its problem is written already.
        if stop.load(Ordering::Relaxed) || progress.current.take() != Some(index) {
            return;
        }
        let outcome = outcome.unwrap_or_else(|problem| Outcome::Line(problem_line(index, problem)));
        bytes += if let Outcome::Line(line) = &outcome { line.len() } else { 0 };
        progress.outcomes.push((index, outcome));
        if started.elapsed() >= SLICE || bytes >= SLICE_BYTES {
            return;
        }
    }
}

/// Runs a computation in a task of its own: a future that got a permit must be polled, also while the client reads nothing.
async fn in_task<T: Send + 'static>(
    computation: impl Future<Output = Result<T, Problem>> + Send + 'static,
) -> Result<T, Problem> {
    let task = AbortOnDropHandle::new(tokio::spawn(computation));
    task.await.unwrap_or_else(|panic| Err(Problem::internal(&panic)))
}

/// Computes one slice: the outcomes of the first line and of as many others as fit, and the lines behind them.
async fn slice(app: Arc<App>, query: BatchQuery, mut lines: Vec<Line>) -> (Vec<(u64, Outcome)>, Vec<Line>) {
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
    let mut outcomes = std::mem::take(&mut progress.outcomes);
    if let Err(problem) = result {
        // Of the line that was computed. If none was, as when the service stops, of the next one: so every batch ends.
        let next = lines.get(outcomes.len()).map(|(index, _)| *index).filter(|_| outcomes.is_empty());
        if let Some(index) = progress.current.take().or(next) {
            outcomes.push((index, Outcome::Line(problem_line(index, problem))));
        }
    }
    lines.drain(..outcomes.len());
    (outcomes, lines)
}

/// The line of a large answer, with the bytes that it has reserved.
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

/// A part of the answer: lines that are written, or one that is to be computed.
enum Part {
    Lines(u64, Vec<u8>),
    Large(u64, u64, Compute),
}

/// Short lines together, large ones by themselves.
fn parts(outcomes: Vec<(u64, Outcome)>) -> Vec<Part> {
    let mut parts = Vec::new();
    for (index, outcome) in outcomes {
        match (outcome, parts.last_mut()) {
            (Outcome::Line(line), Some(Part::Lines(count, lines))) => {
                lines.extend_from_slice(&line);
                *count += 1;
            }
            (Outcome::Line(line), _) => parts.push(Part::Lines(1, line)),
            (Outcome::Large(bytes, compute), _) => parts.push(Part::Large(index, bytes, compute)),
        }
    }
    parts
}

/// The lines of a body that are not blank, until it ends; what ends it otherwise goes to `end`.
fn lines(app: Arc<App>, body: Body, end: Arc<Mutex<BatchEnd>>) -> impl Stream<Item = Line> {
    let limit = app.limits.max_body_bytes;
    let reader = StreamReader::new(body.into_data_stream().map_err(io::Error::other));
    // One byte more, for the carriage return of other systems.
    let codec = AnyDelimiterCodec::new_with_max_length(b"\n".to_vec(), Vec::new(), limit + 1);
    stream::unfold(FramedRead::new(reader, codec), move |mut framed| {
        let (app, end) = (Arc::clone(&app), Arc::clone(&end));
        async move {
            loop {
                let next = tokio::select! {
                    next = tokio::time::timeout(Duration::from_millis(CLIENT_TIMEOUT_MS), framed.next()) => next,
                    () = app.pool.stopped() => {
                        end.lock().problem = Some(Problem::new(ProblemCode::ShuttingDown, "the service is stopping. Send the rest again"));
                        return None;
                    }
                };
                let line = match next {
                    Ok(None) => return None,
                    Ok(Some(Ok(line))) if line.trim_ascii().is_empty() => continue,
                    Ok(Some(Ok(line))) => Ok(Bytes::copy_from_slice(line.trim_ascii())),
                    Ok(Some(Err(AnyDelimiterCodecError::MaxChunkLengthExceeded))) => {
                        // After an error the stream ends once, and goes on behind the line.
                        framed.next().await;
                        let detail =
                            format!("the line has more than the {limit} bytes of `max_body_bytes`. Shorten it");
                        Err(Problem::new(ProblemCode::BodyTooLarge, detail))
                    }
                    Ok(Some(Err(AnyDelimiterCodecError::Io(error)))) => {
                        end.lock().problem = Some(broken_body(&error));
                        return None;
                    }
                    Err(_) => {
                        let detail = format!("no line arrived for {CLIENT_TIMEOUT_MS} ms. Send the rest again");
                        end.lock().problem = Some(Problem::new(ProblemCode::RequestTimeout, detail));
                        return None;
                    }
                };
                let index = {
                    let mut end = end.lock();
                    end.asked += 1;
                    end.asked - 1
                };
                return Some(((index, line), framed));
            }
        }
    })
}

/// The answers in the order of the lines, and the last line.
fn answers(app: Arc<App>, query: BatchQuery, body: Body) -> impl Stream<Item = Bytes> {
    let end = Arc::new(Mutex::new(BatchEnd::default()));
    let at_once = app.pool.permits();
    let (counted, ending) = (Arc::clone(&end), Arc::clone(&end));
    let chunks = lines(Arc::clone(&app), body, end).ready_chunks(CHUNK_LINES);
    let (first_app, next_app, large_app) = (Arc::clone(&app), Arc::clone(&app), app);
    // The first slices of chunks are computed side by side; further ones when the client has read those before.
    let first = chunks.map(move |lines| slice(Arc::clone(&first_app), query, lines)).buffered(at_once);
    let slices = first.flat_map(move |first| {
        let app = Arc::clone(&next_app);
        stream::unfold((first, app), move |((mut outcomes, mut rest), app)| async move {
            if outcomes.is_empty() && !rest.is_empty() {
                (outcomes, rest) = slice(Arc::clone(&app), query, rest).await;
            }
            (!outcomes.is_empty()).then(|| (outcomes, ((Vec::new(), rest), app)))
        })
    });
    let finished = slices.flat_map(|outcomes| stream::iter(parts(outcomes))).map(move |part| {
        let app = Arc::clone(&large_app);
        async move {
            match part {
                Part::Lines(count, lines) => (count, lines.into()),
                Part::Large(index, bytes, compute) => (1, answer_large_line(app, index, bytes, compute).await),
            }
        }
    });
    let parts = finished.buffered(at_once).map(move |(count, part)| {
        counted.lock().answered += count;
        part
    });
    // Made when all lines before it have been given out.
    parts.chain(stream::once(async move { ending.lock().line().into() }))
}

/// A body whose beginning, or all of it, has arrived.
async fn read_ahead(app: &App, body: Body) -> Result<Body, Problem> {
    let mut pieces = body.into_data_stream();
    let (mut read, mut bytes) = (Vec::new(), 0);
    let deadline = app.deadline();
    while bytes < READ_AHEAD_BYTES {
        let next = tokio::select! {
            next = tokio::time::timeout_at(deadline.at, pieces.next()) => next,
            () = app.pool.stopped() => break,
        };
        // The last line reports what is late or broken.
        let Ok(Some(piece)) = next else { break };
        bytes += piece.as_ref().map_or(0, Bytes::len);
        read.push(piece);
    }
    Ok(Body::from_stream(stream::iter(read).chain(pieces)))
}

/// Many design documents, a line each, answered in their order.
#[utoipa::path(
    post,
    path = "/v1/batch",
    tag = "drive",
    params(BatchQuery),
    request_body(content = String, content_type = "application/x-ndjson", description = "A design document a line. Lines are answered while others are still sent: read answers while you send, or send no more than 8 MiB ahead of them."),
    responses(
        (status = 200, description = "A line a document, in their order, each `{\"index\", \"status\", \"answer\"}` or `{\"index\", \"status\", \"problem\"}`; then a last one, `{\"asked\", \"answered\"}`, with a `problem` where the batch broke off.", body = BatchLine<SweepAnswer>, content_type = "application/x-ndjson"),
        (status = 400, description = "A query that the batch does not know.", body = Problem, content_type = "application/problem+json"),
        (status = 415, description = "The body is not sent as NDJSON.", body = Problem, content_type = "application/problem+json"),
        (status = 503, description = "As many batches run as the service admits; `Retry-After` says when to try again.", body = Problem, content_type = "application/problem+json", headers(("Retry-After" = u32, description = "Seconds")))
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
        // Until the last line is sent or the client has left.
        let _held = &place;
        Ok::<_, io::Error>(line)
    });
    let mut response = Body::from_stream(answers).into_response();
    response.headers_mut().insert(header::CONTENT_TYPE, HeaderValue::from_static(NDJSON));
    response.headers_mut().insert(header::CACHE_CONTROL, HeaderValue::from_static("no-store"));
    Ok(response)
}
