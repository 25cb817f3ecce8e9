//! `POST /v1/batch`: many design documents for one endpoint, a line each, answered in their order while they are read.
//!
//! Lines are gathered into chunks; a chunk is worked on in slices of a few milliseconds, each a job of the pool that waits for its turn behind
//! single requests. Chunks run side by side, but only the one whose answers are due runs beyond its first slice: so memory stays
//! bounded however long a batch is, by lines that wait to be answered and by answers that wait to be sent.

use std::collections::VecDeque;
use std::io;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::{Duration, Instant};

use axum::body::{Body, BodyDataStream};
use axum::extract::rejection::QueryRejection;
use axum::extract::{Query, Request, State};
use axum::http::{HeaderValue, StatusCode, header};
use axum::response::{IntoResponse, Response};
use bytes::{Bytes, BytesMut};
use clap::ValueEnum;
use futures_util::{Stream, StreamExt as _, stream};
use metrics::{counter, histogram};
use parking_lot::Mutex;
use serde::{Deserialize, Serialize};
use tokio::sync::{OwnedSemaphorePermit, Semaphore, mpsc};
use tokio_util::task::AbortOnDropHandle;
use toothwave_calculation::coincidence_degree::CoincidenceDegree;
use toothwave_calculation::columns;
use toothwave_calculation::findings::FindingAnswer;
use toothwave_calculation::geometry::Geometry;
use toothwave_calculation::question::{self, Question};
use toothwave_calculation::sweep::Sweep;
use toothwave_calculation::sweep::answer::{ChecksAnswer, PeaksAnswer, SweepAnswer, TorqueCapacityAnswer};
use utoipa::ToSchema;

use super::App;
use crate::compute::{self, Pool};
use crate::config::Limits;
use crate::problem::{Problem, ProblemCode};
use crate::{negotiation, observe};

/// Lines of a chunk at most.
const CHUNK_LINES: usize = 64;

/// A slice begins no line after this time: so long at most does a single request wait behind short ones.
const SLICE: Duration = Duration::from_millis(5);

/// A slice begins no line when it holds so many bytes of answers.
const SLICE_BYTES: usize = 1 << 20;

/// Bytes of lines that are read ahead of their answers, so that a client may send a whole batch before it reads.
const AHEAD_BYTES: usize = 8 << 20;

/// What a line takes beside its bytes.
const LINE_OVERHEAD_BYTES: usize = 256;

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
    /// Of sweeps, the peaks without the states and without the columns of the wind-up.
    #[param(required = false)]
    pub peaks_only: bool,
}

impl BatchQuery {
    /// That what is asked can be asked.
    ///
    /// # Errors
    /// `invalid_query`.
    pub fn require_possible(self) -> Result<(), Problem> {
        if self.peaks_only && self.endpoint != BatchEndpoint::Sweep {
            let detail = "`peaks_only` is for the endpoint `sweep`: nothing else has peaks";
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

/// A sweep without its columns.
#[derive(Serialize)]
struct PeaksOnly<'a> {
    solver_version: &'static str,
    coincidence_degree: f64,
    period_deg: f64,
    peaks: &'a PeaksAnswer,
    #[serde(skip_serializing_if = "Option::is_none")]
    torque_capacity: &'a Option<TorqueCapacityAnswer>,
    checks: &'a ChecksAnswer,
    findings: &'a [FindingAnswer],
}

/// Appends the line that answers one document.
pub fn answer_line(
    query: BatchQuery,
    index: u64,
    document: &[u8],
    limits: &question::Limits,
    stop: &AtomicBool,
    out: &mut Vec<u8>,
) {
    match query.endpoint {
        BatchEndpoint::Geometry => append(out, index, solved(&Geometry, document, limits, stop).as_ref()),
        BatchEndpoint::CoincidenceDegree => {
            append(out, index, solved(&CoincidenceDegree, document, limits, stop).as_ref())
        }
        BatchEndpoint::Sweep => {
            let sweep = solved(&Sweep, document, limits, stop);
            if query.peaks_only {
                let peaks = sweep.as_ref().map(|sweep| PeaksOnly {
                    solver_version: sweep.solver_version,
                    coincidence_degree: sweep.coincidence_degree,
                    period_deg: sweep.period_deg,
                    peaks: &sweep.peaks,
                    torque_capacity: &sweep.torque_capacity,
                    checks: &sweep.checks,
                    findings: &sweep.findings,
                });
                append(out, index, peaks.as_ref().map_err(|problem| *problem));
            } else {
                append(out, index, sweep.as_ref());
            }
        }
    }
}

fn solved<Q: Question>(
    question: &Q,
    document: &[u8],
    limits: &question::Limits,
    stop: &AtomicBool,
) -> Result<Q::Answer, Problem> {
    let started = Instant::now();
    // A fault at one document is no reason to leave the others without an answer.
    let answered = compute::caught(|| {
        #[cfg(feature = "fault-injection")]
        fail::fail_point!("solve");
        Ok(question.ask(document, limits, stop)?)
    });
    histogram!("toothwave_solve_duration_seconds").record(started.elapsed());
    answered
}

fn append<A: Serialize>(out: &mut Vec<u8>, index: u64, answer: Result<&A, &Problem>) {
    let status = answer.map_or_else(|problem| problem.status, |_| StatusCode::OK.as_u16());
    counter!("toothwave_batch_documents_total", "status" => status.to_string()).increment(1);
    if let Err(problem) = answer {
        observe::problem_is_told(problem);
    }
    let line = BatchLine { index, status, answer: answer.ok(), problem: answer.err().cloned() };
    // Numbers and words alone, into memory: this does not fail.
    if columns::write(&line, out).is_ok() {
        out.push(b'\n');
    }
}

/// A document that waits, or what stands in its place.
struct Line {
    index: u64,
    document: Result<Bytes, Problem>,
    /// Its share of what may be read ahead.
    _ahead: OwnedSemaphorePermit,
}

/// Splits a body into lines as it arrives.
struct Lines {
    body: BodyDataStream,
    buffer: BytesMut,
    max_line_bytes: usize,
    patience: Duration,
    /// Whether the rest of a line that was too long is being passed over.
    is_skipping: bool,
    is_over: bool,
}

impl Lines {
    /// The next line, or what was wrong with it; nothing at the end.
    async fn next(&mut self) -> Option<Result<Bytes, Problem>> {
        loop {
            if let Some(end) = self.buffer.iter().position(|&byte| byte == b'\n') {
                let line = self.buffer.split_to(end + 1).freeze().slice(..end);
                if std::mem::take(&mut self.is_skipping) {
                    continue;
                }
                if line.len() > self.max_line_bytes {
                    return Some(Err(self.too_long()));
                }
                if !line.trim_ascii().is_empty() {
                    return Some(Ok(line));
                }
            } else if self.is_skipping {
                self.buffer.clear();
            } else if self.buffer.len() > self.max_line_bytes {
                self.buffer.clear();
                self.is_skipping = true;
                return Some(Err(self.too_long()));
            }
            if self.buffer.contains(&b'\n') {
                continue;
            }
            if self.is_over {
                let rest = self.buffer.split().freeze();
                return (!self.is_skipping && !rest.trim_ascii().is_empty()).then_some(Ok(rest));
            }
            match tokio::time::timeout(self.patience, self.body.next()).await {
                Ok(Some(Ok(bytes))) => self.buffer.extend_from_slice(&bytes),
                // A client that left, which nobody is told of.
                Ok(Some(Err(_))) => return None,
                Ok(None) => self.is_over = true,
                Err(_) => {
                    self.is_over = true;
                    self.buffer.clear();
                    let detail = format!("nothing more of the batch arrived within {} ms", self.patience.as_millis());
                    return Some(Err(Problem::new(ProblemCode::RequestTimeout, detail)));
                }
            }
        }
    }

    fn too_long(&self) -> Problem {
        let detail = format!("the line has more than the {} bytes of `max_body_bytes`", self.max_line_bytes);
        Problem::new(ProblemCode::BodyTooLarge, detail)
    }
}

/// Reads lines ahead of their answers, as far as [`AHEAD_BYTES`] go, until the body ends or nobody wants answers any more.
async fn read_ahead(mut lines: Lines, to: mpsc::UnboundedSender<Line>) {
    let ahead = Arc::new(Semaphore::new(AHEAD_BYTES));
    let mut index = 0;
    while let Some(document) = lines.next().await {
        let bytes = (document.as_ref().map_or(0, Bytes::len) + LINE_OVERHEAD_BYTES).min(AHEAD_BYTES);
        let Ok(permits) = Arc::clone(&ahead).acquire_many_owned(u32::try_from(bytes).unwrap_or(u32::MAX)).await else {
            return;
        };
        if to.send(Line { index, document, _ahead: permits }).is_err() {
            return;
        }
        index += 1;
    }
}

/// Lines that are answered together, as far as they are.
struct Chunk {
    pool: Pool,
    query: BatchQuery,
    limits: Limits,
    waiting: VecDeque<Line>,
    answers: Vec<u8>,
}

/// What a slice works on; it outlives the slice where the deadline stops that.
#[derive(Default)]
struct Slice {
    waiting: VecDeque<Line>,
    current: Option<u64>,
    answers: Vec<u8>,
}

impl Chunk {
    /// One slice further, in a task that ends with this future.
    async fn advance_apart(self) -> Self {
        let Self { pool, query, limits, .. } = &self;
        let rest =
            Self { pool: pool.clone(), query: *query, limits: *limits, waiting: VecDeque::new(), answers: Vec::new() };
        let task = AbortOnDropHandle::new(tokio::spawn(self.advance()));
        // Solves that panic are caught one by one; should the task itself, the batch ends early and the log says why.
        task.await.unwrap_or_else(|panic| {
            tracing::error!(%panic, "a batch broke off");
            rest
        })
    }

    /// One slice further: at least one line is answered.
    async fn advance(mut self) -> Self {
        let slice = Arc::new(Mutex::new(Slice { waiting: std::mem::take(&mut self.waiting), ..Slice::default() }));
        let (shared, query, limits) = (Arc::clone(&slice), self.query, self.limits);
        let result = self.pool.run_in_turn(move |stop| {
            work(&shared, query, &limits, stop);
            Ok(())
        });
        let result = result.await;
        let mut slice = slice.lock();
        self.waiting = std::mem::take(&mut slice.waiting);
        self.answers.append(&mut slice.answers);
        if let Err(problem) = result {
            // Of the line that was being answered, or of the next one, so that there is an end.
            let index = slice.current.take().or_else(|| self.waiting.pop_front().map(|line| line.index));
            if let Some(index) = index {
                append::<()>(&mut self.answers, index, Err(&problem));
            }
        }
        self
    }
}

/// Answers lines until the slice's time or room is over.
fn work(slice: &Mutex<Slice>, query: BatchQuery, limits: &Limits, stop: &AtomicBool) {
    let started = Instant::now();
    loop {
        let line = {
            let mut slice = slice.lock();
            let line = slice.waiting.pop_front();
            slice.current = line.as_ref().map(|line| line.index);
            line
        };
        let Some(Line { index, document, _ahead }) = line else { return };
        let mut answer = Vec::new();
        match document {
            Ok(document) => answer_line(query, index, &document, &limits.of_calculation(), stop, &mut answer),
            Err(problem) => append::<()>(&mut answer, index, Err(&problem)),
        }
        let mut slice = slice.lock();
        if slice.current.take() != Some(index) {
            // The deadline came first, and the line has its problem.
            return;
        }
        slice.answers.append(&mut answer);
        if started.elapsed() >= SLICE || slice.answers.len() >= SLICE_BYTES {
            return;
        }
    }
}

/// The answers as they become ready, in the order of the lines.
fn answers(
    pool: Pool,
    query: BatchQuery,
    limits: Limits,
    from: mpsc::UnboundedReceiver<Line>,
) -> impl Stream<Item = Bytes> {
    let side_by_side = limits.max_concurrent_solves;
    let chunks = stream::unfold(from, |mut from| async move {
        let mut waiting = Vec::with_capacity(CHUNK_LINES);
        let received = from.recv_many(&mut waiting, CHUNK_LINES).await;
        (received > 0).then_some((VecDeque::from(waiting), from))
    });
    // A task of its own for each slice: a future that waits for a permit must be polled when it gets one, or the permit is lost to
    // everybody while this stream gives out another chunk.
    let started = chunks
        .map(move |waiting| Chunk { pool: pool.clone(), query, limits, waiting, answers: Vec::new() }.advance_apart());
    started.buffered(side_by_side).flat_map(|chunk| {
        stream::unfold(chunk, |mut chunk| async move {
            if chunk.answers.is_empty() {
                if chunk.waiting.is_empty() {
                    return None;
                }
                chunk = chunk.advance_apart().await;
            }
            Some((Bytes::from(std::mem::take(&mut chunk.answers)), chunk))
        })
    })
}

/// Many design documents, a line each, answered in their order.
#[utoipa::path(
    post,
    path = "/v1/batch",
    tag = "drive",
    params(BatchQuery),
    request_body(content = String, content_type = "application/x-ndjson", description = "A design document a line. Lines are answered while others are still sent: read answers while you send, or send no more than 8 MiB ahead of them."),
    responses(
        (status = 200, description = "A line a document, in their order, each `{\"index\", \"status\", \"answer\"}` or `{\"index\", \"status\", \"problem\"}`.", body = BatchLine<SweepAnswer>, content_type = "application/x-ndjson"),
        (status = 400, description = "A query that the batch does not know.", body = Problem, content_type = "application/problem+json"),
        (status = 415, description = "The body is not sent as NDJSON.", body = Problem, content_type = "application/problem+json"),
        (status = 503, description = "As many batches run as the service admits; `Retry-After` says when to try again.", body = Problem, content_type = "application/problem+json", headers(("Retry-After" = u32, description = "Seconds")))
    )
)]
pub async fn batch(
    State(app): State<Arc<App>>,
    query: Result<Query<BatchQuery>, QueryRejection>,
    request: Request,
) -> Response {
    match begin(&app, query, request) {
        Ok(response) => response,
        Err(problem) => problem.into_response(),
    }
}

fn begin(app: &App, query: Result<Query<BatchQuery>, QueryRejection>, request: Request) -> Result<Response, Problem> {
    let Query(query) = query.map_err(|error| Problem::new(ProblemCode::InvalidQuery, error.body_text()))?;
    query.require_possible()?;
    negotiation::require_ndjson(request.headers())?;
    let place = app.pool.batch_place()?;
    let lines = Lines {
        body: request.into_body().into_data_stream(),
        buffer: BytesMut::new(),
        max_line_bytes: app.limits.max_body_bytes,
        patience: Duration::from_millis(app.limits.header_timeout_ms),
        is_skipping: false,
        is_over: false,
    };
    // Bounded by bytes.
    let (to, from) = mpsc::unbounded_channel();
    tokio::spawn(read_ahead(lines, to));
    let answers = answers(app.pool.clone(), query, app.limits, from).map(move |bytes| {
        // The place is held until the last answer is sent or the client has left.
        let _held = &place;
        Ok::<_, io::Error>(bytes)
    });
    let mut response = Body::from_stream(answers).into_response();
    response.headers_mut().insert(header::CONTENT_TYPE, HeaderValue::from_static(NDJSON));
    response.headers_mut().insert(header::CACHE_CONTROL, HeaderValue::from_static("no-store"));
    Ok(response)
}
