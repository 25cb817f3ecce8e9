//! `POST /v1/batch`: many design documents for one endpoint, a line each, answered in their order while they are read.
//!
//! Lines are gathered into chunks; a chunk is worked on in slices of a few milliseconds, each a job of the pool that waits for its turn behind
//! single requests. Chunks run side by side, but only the one whose answers are due runs beyond its first slice: so memory stays
//! bounded however long a batch is, by lines that wait to be answered and by answers that wait to be sent.

use std::collections::VecDeque;
use std::io::{self, Write as _};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use axum::body::{Body, BodyDataStream};
use axum::extract::rejection::QueryRejection;
use axum::extract::{Query, Request, State};
use axum::http::{HeaderValue, StatusCode, header};
use axum::response::{IntoResponse, Response};
use bytes::{Bytes, BytesMut};
use clap::ValueEnum;
use futures_util::{FutureExt as _, Stream, StreamExt as _, stream};
use metrics::{counter, histogram};
use parking_lot::Mutex;
use serde::{Deserialize, Serialize};
use tokio::sync::{OwnedSemaphorePermit, Semaphore, mpsc, oneshot};
use tokio_util::task::AbortOnDropHandle;
use toothwave_calculation::coincidence_degree::CoincidenceDegree;
use toothwave_calculation::coincidence_degree::TeethInMeshAnswer;
use toothwave_calculation::columns;
use toothwave_calculation::design::Design;
use toothwave_calculation::findings::FindingAnswer;
use toothwave_calculation::forms::{Format, Forms as _};
use toothwave_calculation::geometry::Geometry;
use toothwave_calculation::question::{self, Question};
use toothwave_calculation::sweep::Sweep;
use toothwave_calculation::sweep::answer::{ChecksAnswer, LoadAnswer, PeaksAnswer, SweepAnswer, TorqueCapacityAnswer};
use toothwave_calculation::sweep::backing::EstimateAnswer;
use toothwave_calculation::sweep::duty::DutyAnswer;
use toothwave_calculation::sweep::losses::LossTotalsAnswer;
use toothwave_calculation::sweep::model_error::ModelErrorAnswer;
use utoipa::ToSchema;

use super::{Growing, Read, Stoppable, Taking, answered, broken_body, tree_bytes, write_problem};
use crate::app::App;
use crate::compute::{self, Lane, Pool};
use crate::config::Limits;
use crate::problem::{Problem, ProblemCode};
use crate::room::{Reserved, Room, SMALL_BYTES, Sent};
use crate::turns::Had;
use crate::{negotiation, observe};

/// Lines of a chunk at most.
const CHUNK_LINES: usize = 64;

/// A slice begins no line when it holds so many bytes of answers.
const SLICE_BYTES: usize = 1 << 20;

/// Bytes of lines that are read ahead of their answers, so that a client may send a whole batch before it reads.
const AHEAD_BYTES: usize = 8 << 20;

/// What a line takes beside its bytes.
const LINE_OVERHEAD_BYTES: usize = 256;

/// Lines from here on go out by themselves.
const LONG_LINE_BYTES: usize = 1 << 16;

/// What has to arrive of a batch on the average while it is waited for: a batch holds one of few places.
const LEAST_ARRIVING_BYTES_PER_S: u64 = 32;

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
    build: &'static str,
    coincidence_degree: f64,
    period_deg: f64,
    #[serde(skip_serializing_if = "Option::is_none")]
    sweep_period_deg: Option<f64>,
    load: &'a LoadAnswer,
    enters_under_load: bool,
    peaks: &'a PeaksAnswer,
    model_error: &'a ModelErrorAnswer,
    series_compliance_estimates: &'a [EstimateAnswer],
    teeth_in_mesh_per_zone: &'a TeethInMeshAnswer,
    loaded_teeth_per_zone: &'a TeethInMeshAnswer,
    #[serde(skip_serializing_if = "Option::is_none")]
    torque_capacity: &'a Option<TorqueCapacityAnswer>,
    #[serde(skip_serializing_if = "Option::is_none")]
    duty: &'a Option<DutyAnswer>,
    #[serde(skip_serializing_if = "Option::is_none")]
    losses: Option<&'a LossTotalsAnswer>,
    checks: &'a ChecksAnswer,
    findings: &'a [FindingAnswer],
}

/// The last line: whoever finds it has all the others.
#[derive(Debug, Serialize, ToSchema)]
pub struct BatchEnd {
    /// Documents that arrived.
    pub asked: u64,
    /// Lines that answer them.
    pub answered: u64,
    /// Why no more arrived, where the batch broke off.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    pub problem: Option<Problem>,
}

impl BatchEnd {
    /// The line.
    pub fn line(&self) -> Vec<u8> {
        let mut line = Vec::new();
        // Numbers and words alone, into memory: this does not fail.
        if columns::write(self, &mut line).is_ok() {
            line.push(b'\n');
        }
        line
    }
}

/// The line that answers one document, with the room that it takes.
#[derive(Debug)]
pub struct AnsweredLine {
    /// The line.
    pub text: Vec<u8>,
    room: Option<Reserved>,
    /// Why there is no answer.
    problem: Option<Problem>,
}

impl AnsweredLine {
    /// Counts it, and logs why an internal error happened: it is about to be told.
    pub fn note_told(&self) {
        let status = self.problem.as_ref().map_or(StatusCode::OK.as_u16(), |problem| problem.status);
        counter!("toothwave_batch_documents_total", "status" => status.to_string()).increment(1);
        if let Some(problem) = &self.problem {
            observe::note_problem(problem);
        }
    }

    fn of_problem(index: u64, problem: Problem) -> Self {
        let line = BatchLine::<()> { index, status: problem.status, answer: None, problem: Some(problem) };
        let mut text = Vec::new();
        // Numbers and words alone, into memory: this does not fail.
        if columns::write(&line, &mut text).is_ok() {
            text.push(b'\n');
        }
        Self { text, room: None, problem: line.problem }
    }
}

/// Answers one document.
pub fn answer_line(
    query: BatchQuery,
    index: u64,
    document: &[u8],
    limits: &question::Limits,
    room: &Room,
    stop: &AtomicBool,
) -> AnsweredLine {
    let answered = match query.endpoint {
        BatchEndpoint::Geometry => whole_line(&Geometry, index, document, limits, room, stop),
        BatchEndpoint::CoincidenceDegree => whole_line(&CoincidenceDegree, index, document, limits, room, stop),
        BatchEndpoint::Sweep if query.peaks_only => peaks_line(index, document, limits, room, stop),
        BatchEndpoint::Sweep => whole_line(&Sweep, index, document, limits, room, stop),
    };
    answered.unwrap_or_else(|problem| AnsweredLine::of_problem(index, problem))
}

fn whole_line<Q: Question>(
    question: &Q,
    index: u64,
    document: &[u8],
    limits: &question::Limits,
    room: &Room,
    stop: &AtomicBool,
) -> Result<AnsweredLine, Problem> {
    let Solved { answer, held_bytes, reserved } = solved(question, document, limits, room, stop)?;
    let buffer = Growing::new(reserved, held_bytes, answer.expected_bytes())?;
    line(index, &answer, buffer, stop)
}

fn peaks_line(
    index: u64,
    document: &[u8],
    limits: &question::Limits,
    room: &Room,
    stop: &AtomicBool,
) -> Result<AnsweredLine, Problem> {
    let Solved { answer: sweep, held_bytes, reserved } = solved(&Sweep, document, limits, room, stop)?;
    let peaks = PeaksOnly {
        solver_version: sweep.solver_version,
        build: sweep.build,
        coincidence_degree: sweep.coincidence_degree,
        period_deg: sweep.period_deg,
        sweep_period_deg: sweep.sweep_period_deg,
        load: &sweep.load,
        enters_under_load: sweep.enters_under_load,
        peaks: &sweep.peaks,
        model_error: &sweep.model_error,
        series_compliance_estimates: &sweep.series_compliance_estimates,
        teeth_in_mesh_per_zone: &sweep.teeth_in_mesh_per_zone,
        loaded_teeth_per_zone: &sweep.loaded_teeth_per_zone,
        torque_capacity: &sweep.torque_capacity,
        duty: &sweep.duty,
        losses: sweep.losses.as_ref().map(|losses| &losses.totals),
        checks: &sweep.checks,
        findings: &sweep.findings,
    };
    line(index, &peaks, Growing::new(reserved, held_bytes, 0)?, stop)
}

/// What a document comes to, and the memory that it takes.
struct Solved<A> {
    answer: A,
    held_bytes: u64,
    reserved: Reserved,
}

fn solved<Q: Question>(
    question: &Q,
    document: &[u8],
    limits: &question::Limits,
    room: &Room,
    stop: &AtomicBool,
) -> Result<Solved<Q::Answer>, Problem> {
    let started = Instant::now();
    // A fault at one document is no reason to leave the others without an answer.
    let solved = compute::caught(|| {
        #[cfg(feature = "fault-injection")]
        fail::fail_point!("solve");
        let mut tree = room.nothing();
        tree.hold_at_least(tree_bytes(document))?;
        let checked = question.check(&Design::read(document)?, limits)?;
        drop(tree);
        let columns_bytes = Q::columns_bytes(&checked);
        let reserved = room.reserve(columns_bytes + Q::working_bytes(&checked))?;
        let (answer, mut reserved) = answered::<Q>(&checked, reserved, stop)?;
        let held_bytes = columns_bytes.max(answer.held_bytes(Format::Json));
        reserved.hold_at_most(held_bytes);
        Ok(Solved { answer, held_bytes, reserved })
    });
    histogram!("toothwave_solve_duration_seconds").record(started.elapsed());
    solved
}

fn line<A: Serialize>(index: u64, answer: &A, buffer: Growing, stop: &AtomicBool) -> Result<AnsweredLine, Problem> {
    let status = StatusCode::OK.as_u16();
    let line = BatchLine { index, status, answer: Some(answer), problem: None };
    let taking = Taking::new(stop, &buffer.reserved);
    let mut writer = Stoppable::new(buffer, &taking);
    let written = columns::write(&line, &mut writer).and_then(|()| writer.write_all(b"\n"));
    written.map_err(|error| write_problem(error, &taking))?;
    let Growing { bytes: text, mut reserved, .. } = writer.inner;
    reserved.hold_at_most(text.capacity() as u64);
    Ok(AnsweredLine { text, room: Some(reserved), problem: None })
}

/// Lines as they go out: short ones together, each long one by itself with its room, none of them copied again.
#[derive(Debug, Default)]
struct Answers {
    parts: VecDeque<Bytes>,
    tail: Vec<u8>,
    bytes: usize,
    lines: u64,
}

impl Answers {
    fn push(&mut self, line: AnsweredLine) {
        line.note_told();
        let AnsweredLine { text, room, .. } = line;
        self.lines += 1;
        self.bytes += text.len();
        if text.len() < LONG_LINE_BYTES {
            self.tail.extend_from_slice(&text);
            return;
        }
        self.end_part();
        let text = Bytes::from(text);
        self.parts.push_back(match room {
            Some(room) => room.send(text, &Sent::default()),
            None => text,
        });
    }

    fn append(&mut self, mut other: Self) {
        other.end_part();
        self.end_part();
        self.parts.append(&mut other.parts);
        self.lines += other.lines;
    }

    fn end_part(&mut self) {
        if !self.tail.is_empty() {
            self.parts.push_back(std::mem::take(&mut self.tail).into());
        }
    }
}

/// A document that waits, or what stands in its place.
struct Line {
    index: u64,
    document: Result<Read, Problem>,
    /// Its share of what may be read ahead.
    _ahead: OwnedSemaphorePermit,
}

/// A line without the rest of an end as other systems write it.
fn unended(line: &[u8]) -> &[u8] {
    line.strip_suffix(b"\r").unwrap_or(line)
}

/// Splits a body into lines as it arrives.
struct Lines {
    body: BodyDataStream,
    buffer: BytesMut,
    /// What it takes, where lines are long.
    held: Reserved,
    room: Room,
    /// So much of it holds no end of a line.
    searched_bytes: usize,
    max_line_bytes: usize,
    patience: Duration,
    /// Of the patience, used up, and what arrived meanwhile.
    waited: Duration,
    arrived_bytes: u64,
    /// Why the body has no end of its own.
    broken: Option<Problem>,
    /// Whether the rest of a line that was too long is being passed over.
    is_skipping: bool,
    is_over: bool,
}

impl Lines {
    fn new(body: Body, max_line_bytes: usize, patience: Duration, room: &Room) -> Self {
        Self {
            body: body.into_data_stream(),
            buffer: BytesMut::new(),
            held: room.nothing(),
            room: room.clone(),
            searched_bytes: 0,
            max_line_bytes,
            patience,
            waited: Duration::ZERO,
            arrived_bytes: 0,
            broken: None,
            is_skipping: false,
            is_over: false,
        }
    }

    /// The next line, or what was wrong with it; nothing at the end.
    async fn next(&mut self) -> Option<Result<Read, Problem>> {
        loop {
            let unsearched = &self.buffer[self.searched_bytes..];
            if let Some(end) = unsearched.iter().position(|&byte| byte == b'\n') {
                let end = std::mem::take(&mut self.searched_bytes) + end;
                let line = self.buffer.split_to(end + 1);
                let line = unended(&line[..end]);
                let read = if std::mem::take(&mut self.is_skipping) {
                    None
                } else if line.len() > self.max_line_bytes {
                    Some(Err(self.too_long()))
                } else {
                    self.by_itself(line)
                };
                if 2 * end as u64 > SMALL_BYTES {
                    // What came behind it must not hold all that it took.
                    self.buffer = BytesMut::from(&self.buffer[..]);
                    self.held.hold_at_most(0);
                }
                if read.is_some() {
                    return read;
                }
                continue;
            }
            self.searched_bytes = self.buffer.len();
            if self.is_skipping {
                self.forget();
            } else if unended(&self.buffer).len() > self.max_line_bytes {
                self.forget();
                self.is_skipping = true;
                return Some(Err(self.too_long()));
            }
            if self.is_over {
                self.searched_bytes = 0;
                let rest = std::mem::take(&mut self.buffer);
                return self.by_itself(&rest);
            }
            // It grows by doubling.
            if !self.is_skipping
                && let Err(no_room) = self.held.hold_at_least(2 * self.buffer.len() as u64)
            {
                self.forget();
                self.is_skipping = true;
                return Some(Err(no_room.into()));
            }
            self.receive().await;
        }
    }

    /// A line that is not blank: it may wait long, and must not hold all that was received with it.
    fn by_itself(&self, line: &[u8]) -> Option<Result<Read, Problem>> {
        if line.trim_ascii().is_empty() {
            return None;
        }
        let read = || {
            let mut room = self.room.nothing();
            room.hold_at_least(line.len() as u64)?;
            Ok(Read { bytes: Bytes::copy_from_slice(line), room })
        };
        Some(read())
    }

    /// Takes what arrives next, or finds that nothing more will, or too little.
    async fn receive(&mut self) {
        let began = tokio::time::Instant::now();
        let arrived = tokio::time::timeout(self.patience.saturating_sub(self.waited), self.body.next()).await;
        self.waited += began.elapsed();
        match arrived {
            Ok(Some(Ok(bytes))) => {
                self.buffer.extend_from_slice(&bytes);
                // Blank lines ask nothing.
                self.arrived_bytes += bytes.iter().filter(|byte| !byte.is_ascii_whitespace()).count() as u64;
                if u128::from(self.arrived_bytes) >= self.least_bytes() {
                    (self.waited, self.arrived_bytes) = (Duration::ZERO, 0);
                }
            }
            Ok(Some(Err(error))) => self.break_off(broken_body(&error)),
            Ok(None) => self.is_over = true,
            Err(_) => {
                let detail = format!(
                    "within {} ms of waiting less than {} bytes of the batch arrived, blank ones not counted",
                    self.patience.as_millis(),
                    self.least_bytes()
                );
                self.break_off(Problem::new(ProblemCode::RequestTimeout, detail));
            }
        }
    }

    fn least_bytes(&self) -> u128 {
        (u128::from(LEAST_ARRIVING_BYTES_PER_S) * self.patience.as_millis()).div_ceil(1000)
    }

    /// The line that is not whole counts for nothing.
    fn break_off(&mut self, problem: Problem) {
        self.is_over = true;
        self.broken = Some(problem);
        self.forget();
    }

    fn forget(&mut self) {
        self.buffer = BytesMut::new();
        self.held.hold_at_most(0);
        self.searched_bytes = 0;
    }

    fn too_long(&self) -> Problem {
        let detail = format!("the line has more than the {} bytes of `max_body_bytes`", self.max_line_bytes);
        Problem::new(ProblemCode::BodyTooLarge, detail)
    }
}

/// How the batch has ended.
type End = Arc<Mutex<BatchEnd>>;

/// Reads lines ahead of their answers, as far as [`AHEAD_BYTES`] go, until the body ends or nobody wants answers any more. `reading` is dropped when no more is read before
/// an answer.
async fn read_ahead(
    pool: Pool,
    mut lines: Lines,
    to: mpsc::UnboundedSender<Line>,
    end: End,
    reading: oneshot::Sender<()>,
) {
    let mut reading = Some(reading);
    let ahead = Arc::new(Semaphore::new(AHEAD_BYTES));
    let mut index = 0;
    loop {
        let document = match pool.until_closed(lines.next().map(Ok)).await {
            Ok(Some(document)) => document,
            Ok(None) => break,
            Err(stopping) => {
                end.lock().problem = Some(stopping);
                return;
            }
        };
        let bytes = (document.as_ref().map_or(0, |read| read.len()) + LINE_OVERHEAD_BYTES).min(AHEAD_BYTES);
        let wanted = u32::try_from(bytes).unwrap_or(u32::MAX);
        if ahead.available_permits() < bytes {
            drop(reading.take());
        }
        let Ok(permits) = Arc::clone(&ahead).acquire_many_owned(wanted).await else {
            return;
        };
        if to.send(Line { index, document, _ahead: permits }).is_err() {
            return;
        }
        index += 1;
        end.lock().asked = index;
    }
    end.lock().problem = lines.broken;
}

/// Lines that are answered together, as far as they are.
struct Chunk {
    batch: Batch,
    waiting: VecDeque<Line>,
    answers: Answers,
}

/// What all chunks of a batch share.
#[derive(Clone)]
struct Batch {
    pool: Pool,
    /// Where turns are long and no permit is free its chunks have them in common, one after the other: each would wait for its own, and the one that is kept would
    /// go unused.
    lane: Arc<tokio::sync::Mutex<Lane>>,
    /// What all of them have had of the time.
    had: Arc<Mutex<Had>>,
    room: Room,
    query: BatchQuery,
    limits: Limits,
}

impl Batch {
    fn new(pool: Pool, room: Room, query: BatchQuery, limits: Limits) -> Self {
        let had = Arc::default();
        let lane = Arc::new(tokio::sync::Mutex::new(Lane::companion(&had)));
        Self { pool, lane, had, room, query, limits }
    }
}

/// What a slice works on; it outlives the slice where the deadline stops that.
#[derive(Default)]
struct Slice {
    waiting: VecDeque<Line>,
    current: Option<u64>,
    answers: Answers,
}

impl Chunk {
    /// One slice further, in a task that ends with this future.
    async fn advance_apart(self) -> Self {
        let rest = Self { batch: self.batch.clone(), waiting: VecDeque::new(), answers: Answers::default() };
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
        let (shared, batch) = (Arc::clone(&slice), self.batch.clone());
        let (mut own, mut common) = (Lane::companion(&self.batch.had), None);
        let pool = &self.batch.pool;
        let lane = match self.batch.lane.try_lock() {
            _ if !pool.are_turns_long() => &mut own,
            Ok(lane) => &mut **common.insert(lane),
            Err(_) if pool.has_free_permit() => &mut own,
            Err(_) => &mut **common.insert(self.batch.lane.lock().await),
        };
        let result = self.batch.pool.run_steps(lane, move |time, stop| {
            work(&shared, &batch, time, stop);
            Ok(())
        });
        let result = result.await;
        drop(common);
        let mut slice = slice.lock();
        self.waiting = std::mem::take(&mut slice.waiting);
        self.answers.append(std::mem::take(&mut slice.answers));
        if let Err(problem) = result {
            // Of the line that was being answered; where nothing was, of the next one, so that there is an end.
            let index = slice.current.take().or_else(|| self.next_to_blame());
            if let Some(index) = index {
                self.answers.push(AnsweredLine::of_problem(index, problem));
            }
        }
        self.answers.end_part();
        self
    }

    /// A line that has no turn because the service stops, say; none where the slice has answered some before.
    fn next_to_blame(&mut self) -> Option<u64> {
        let next = if self.answers.lines == 0 { self.waiting.pop_front() } else { None };
        next.map(|line| line.index)
    }
}

/// Answers lines until the slice's time or room is over.
fn work(slice: &Mutex<Slice>, batch: &Batch, time: &mut compute::Slice, stop: &AtomicBool) {
    loop {
        let line = {
            let mut slice = slice.lock();
            let line = slice.waiting.pop_front();
            slice.current = line.as_ref().map(|line| line.index);
            line
        };
        let Some(Line { index, document, _ahead }) = line else { return };
        let answer = match document {
            Ok(document) => {
                answer_line(batch.query, index, &document, &batch.limits.of_calculation(), &batch.room, stop)
            }
            Err(problem) => AnsweredLine::of_problem(index, problem),
        };
        let mut slice = slice.lock();
        // Whoever stops it says what becomes of the line, if anybody still waits for that.
        if stop.load(Ordering::Relaxed) || slice.current.take() != Some(index) {
            return;
        }
        slice.answers.push(answer);
        if time.is_over() || slice.answers.bytes >= SLICE_BYTES {
            return;
        }
    }
}

/// The answers as they become ready, in the order of the lines, and the last line.
fn answers(batch: Batch, from: mpsc::UnboundedReceiver<Line>, end: End) -> impl Stream<Item = Bytes> {
    let side_by_side = batch.limits.max_concurrent_solves;
    let chunks = stream::unfold(from, |mut from| async move {
        let mut waiting = Vec::with_capacity(CHUNK_LINES);
        let received = from.recv_many(&mut waiting, CHUNK_LINES).await;
        (received > 0).then_some((VecDeque::from(waiting), from))
    });
    // A task of its own for each slice: a future that waits for a permit must be polled when it gets one, or the permit is lost to
    // everybody while this stream gives out another chunk.
    let started =
        chunks.map(move |waiting| Chunk { batch: batch.clone(), waiting, answers: Answers::default() }.advance_apart());
    let ending = Arc::clone(&end);
    let answered = started.buffered(side_by_side).flat_map(move |chunk| {
        let end = Arc::clone(&end);
        stream::unfold((chunk, end), |(mut chunk, end)| async move {
            if chunk.answers.parts.is_empty() {
                if chunk.waiting.is_empty() {
                    return None;
                }
                chunk = chunk.advance_apart().await;
            }
            end.lock().answered += std::mem::take(&mut chunk.answers.lines);
            let part = chunk.answers.parts.pop_front().unwrap_or_default();
            Some((part, (chunk, end)))
        })
    });
    // Nothing stands after the last line, so it is made when all else has been given out.
    answered.chain(stream::once(async move { ending.lock().line().into() }))
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
pub async fn batch(
    State(app): State<Arc<App>>,
    query: Result<Query<BatchQuery>, QueryRejection>,
    request: Request,
) -> Response {
    // Proxies such as nginx pass on no more of a request once its answer has begun.
    let has_proxy = request.headers().contains_key("x-forwarded-for");
    match begin(&app, query, request).await {
        Ok((response, read)) => {
            if has_proxy {
                // An error, as nothing is sent; or the service stops, and says so line by line.
                let _ = app.pool.until_closed(read.map(Ok)).await;
            }
            response
        }
        Err(problem) => problem.into_response(),
    }
}

/// The answer, and what ends when the body is read, or as much of it as is before an answer.
async fn begin(
    app: &App,
    query: Result<Query<BatchQuery>, QueryRejection>,
    request: Request,
) -> Result<(Response, oneshot::Receiver<()>), Problem> {
    let Query(query) = query.map_err(|error| Problem::new(ProblemCode::InvalidQuery, error.body_text()))?;
    query.require_possible()?;
    negotiation::require_ndjson(request.headers())?;
    // Lines that wait, and of each chunk that is worked on its short answers; a long one has room of its own.
    let held_bytes = AHEAD_BYTES + app.limits.max_concurrent_solves * SLICE_BYTES;
    // Refused at once where all places are taken; none is held by who waits for room.
    drop(app.pool.batch_place()?);
    let waited = async { Ok(app.room.reserve_in_time(app.pool.deadline(), held_bytes as u64).await?) };
    let room = app.pool.until_closed(waited).await?;
    let place = app.pool.batch_place()?;
    let patience = Duration::from_millis(app.limits.header_timeout_ms);
    let beside = app.room.beside(held_bytes as u64);
    let lines = Lines::new(request.into_body(), app.limits.max_body_bytes, patience, &beside);
    // Bounded by bytes.
    let (to, from) = mpsc::unbounded_channel();
    let end = End::new(Mutex::new(BatchEnd { asked: 0, answered: 0, problem: None }));
    let (reading, read) = oneshot::channel();
    tokio::spawn(read_ahead(app.pool.clone(), lines, to, Arc::clone(&end), reading));
    let batch = Batch::new(app.pool.clone(), beside, query, app.limits);
    let answers = answers(batch, from, end).map(move |bytes| {
        // Place and room are held until the last answer is sent or the client has left.
        let _held = (&place, &room);
        Ok::<_, io::Error>(bytes)
    });
    let mut response = Body::from_stream(answers).into_response();
    response.headers_mut().insert(header::CONTENT_TYPE, HeaderValue::from_static(NDJSON));
    response.headers_mut().insert(header::CACHE_CONTROL, HeaderValue::from_static("no-store"));
    Ok((response, read))
}

#[cfg(test)]
mod tests {
    use std::io;
    use std::sync::Arc;
    use std::sync::atomic::AtomicBool;
    use std::time::Duration;

    use axum::body::{Body, Bytes};
    use futures_util::stream;
    use parking_lot::Mutex;
    use serde_json::{Value, json};
    use tokio::sync::Semaphore;

    use super::{
        Answers, Batch, BatchEndpoint, BatchQuery, Chunk, Growing, Line, Lines, Pool, Room, SLICE_BYTES, Slice, line,
        work,
    };
    use crate::compute;
    use crate::config::Limits;
    use crate::problem::{Problem, ProblemCode};

    /// Two megabytes of an answer that was computed in time.
    #[test]
    fn a_line_that_nobody_waits_for_is_not_written_to_its_end() {
        let room = Room::new(1 << 30);
        let written = |is_stopped| {
            let buffer = Growing::new(room.reserve(0).expect("room"), 0, 0).expect("room");
            line(0, &vec![0.5; 500_000], buffer, &AtomicBool::new(is_stopped))
        };
        assert!(written(false).is_ok_and(|line| line.text.ends_with(b"\n")));
        assert_eq!(written(true).err().map(|problem| problem.code), Some(ProblemCode::DeadlineExceeded));
    }

    /// A line of two bytes among blank ones of sixty thousand.
    #[tokio::test]
    async fn a_line_that_waits_holds_no_more_than_itself() {
        let text = format!("{}\n{{}}\n{}\n[]", " ".repeat(60_000), " ".repeat(60_000));
        let mut lines = Lines::new(Body::from(text), 65_536, Duration::MAX, &Room::new(0));
        let mut read = Vec::new();
        while let Some(line) = lines.next().await {
            read.push(line.expect("a line").bytes);
        }
        assert_eq!(read, ["{}", "[]"]);
        for line in read {
            assert!(line.try_into_mut().expect("its bytes are its own").capacity() <= 2);
        }
    }

    /// Nine batches of lines of sixteen megabytes ended a process of 256 MiB.
    #[tokio::test]
    async fn long_lines_take_room_until_they_are_answered() {
        const LINE: usize = 1 << 20;
        let room = Room::new(5 << 20);
        let text = format!("{}\n{}\n{}\n[]", "1".repeat(LINE), "2".repeat(LINE), "3".repeat(LINE));
        let pieces =
            text.into_bytes().chunks(10_000).map(|piece| Ok::<_, io::Error>(piece.to_vec())).collect::<Vec<_>>();
        let mut lines = Lines::new(Body::from_stream(stream::iter(pieces)), LINE, Duration::MAX, &room);
        let first = lines.next().await.expect("a line").expect("room");
        let second = lines.next().await.expect("a line").expect("room");
        assert!(room.taken_bytes() >= 2 * LINE as u64);
        // Two wait, and while it arrives it may take twice its length.
        let kept = room.reserve(2 << 20).expect("room");
        let refused = lines.next().await.expect("a line").map(|read| read.bytes);
        assert_eq!(refused.map_err(|problem| problem.code), Err(ProblemCode::TooManyUnreadBytes));
        assert_eq!(lines.next().await.expect("the next line").expect("room").bytes, "[]");
        drop((first, second, kept));
        assert_eq!(room.taken_bytes(), 0);
    }

    /// The lines of a body that arrives in these pieces, those of more than five bytes as what is wrong with them.
    async fn read(pieces: &[&'static str]) -> Vec<Result<Bytes, ProblemCode>> {
        let pieces: Vec<_> =
            pieces.iter().map(|piece| Ok::<_, io::Error>(Bytes::from_static(piece.as_bytes()))).collect();
        let mut lines = Lines::new(Body::from_stream(stream::iter(pieces)), 5, Duration::MAX, &Room::new(0));
        let mut read = Vec::new();
        while let Some(line) = lines.next().await {
            read.push(line.map(|read| read.bytes).map_err(|problem| problem.code));
        }
        read
    }

    #[tokio::test]
    async fn a_line_as_long_as_may_be_is_read_and_one_a_byte_longer_is_not() {
        let (whole, too_long) = (Ok(Bytes::from("12345")), Err(ProblemCode::BodyTooLarge));
        let next = Ok(Bytes::from("[]"));
        for pieces in [&["12345\n[]"][..], &["12345", "\n[]"], &["1", "2345", "\n", "[", "]"]] {
            assert_eq!(read(pieces).await, [whole.clone(), next.clone()], "{pieces:?}");
        }
        // As other systems end them.
        for pieces in [&["12345\r\n[]"][..], &["12345\r", "\n[]\r\n"], &["12345", "\r\n[]"]] {
            assert_eq!(read(pieces).await, [whole.clone(), next.clone()], "{pieces:?}");
        }
        for pieces in [
            &["123456\n[]"][..],
            &["123456\r", "\n[]"],
            &["123456", "\n[]"],
            &["123", "456", "7\n[]"],
            &["123456", "7", "8\n", "[]"],
        ] {
            assert_eq!(read(pieces).await, [too_long.clone(), next.clone()], "{pieces:?}");
        }
        assert_eq!((read(&["12345"]).await, read(&["123456"]).await), (vec![whole], vec![too_long]));
    }

    const LIMITS: Limits = Limits {
        max_states: 1_000_000,
        max_profile_points: 0,
        max_body_bytes: 0,
        max_concurrent_solves: 1,
        max_queued_solves: 0,
        max_concurrent_batches: 1,
        deadline_ms: 0,
        cache_max_bytes: 0,
        max_unread_bytes: 0,
        max_study_variants: 0,
        max_study_bytes: 0,
        max_concurrent_studies: 0,
        study_deadline_ms: 0,
        max_connections: 0,
        max_header_bytes: 0,
        header_timeout_ms: 0,
    };

    fn read_of(bytes: Bytes) -> super::Read {
        super::Read { bytes, room: Room::new(0).nothing() }
    }

    /// How many of three such lines one slice answers.
    fn answered_in_a_slice(document: &Result<Bytes, Problem>) -> u64 {
        let query = BatchQuery { endpoint: BatchEndpoint::Sweep, peaks_only: true };
        let batch = Batch::new(Pool::new(LIMITS), Room::new(1 << 30), query, LIMITS);
        let ahead = Arc::new(Semaphore::new(3));
        let waiting = (0..3).map(|index| Line {
            index,
            document: document.clone().map(read_of),
            _ahead: Arc::clone(&ahead).try_acquire_owned().expect("a permit"),
        });
        let slice = Mutex::new(Slice { waiting: waiting.collect(), ..Slice::default() });
        work(&slice, &batch, &mut compute::Slice::default(), &AtomicBool::new(false));
        let slice = slice.into_inner();
        assert_eq!(slice.answers.lines + slice.waiting.len() as u64, 3);
        slice.answers.lines
    }

    /// The deadline may come between a slice's last line and its end.
    #[test]
    fn a_slice_that_has_answered_blames_no_line_that_it_has_not_begun() {
        let query = BatchQuery { endpoint: BatchEndpoint::Sweep, peaks_only: true };
        let batch = Batch::new(Pool::new(LIMITS), Room::new(1 << 30), query, LIMITS);
        let ahead = Arc::new(Semaphore::new(1)).try_acquire_owned().expect("a permit");
        let line = Line { index: 7, document: Ok(read_of(Bytes::from("{}"))), _ahead: ahead };
        let mut chunk = Chunk { batch, waiting: [line].into(), answers: Answers { lines: 1, ..Answers::default() } };
        assert_eq!((chunk.next_to_blame(), chunk.waiting.len()), (None, 1));
        chunk.answers.lines = 0;
        assert_eq!((chunk.next_to_blame(), chunk.waiting.len()), (Some(7), 0));
    }

    /// It is told neither as an answer nor as one that came too late.
    #[test]
    fn a_line_of_a_client_that_has_left_is_left_as_it_was() {
        let query = BatchQuery { endpoint: BatchEndpoint::Sweep, peaks_only: true };
        let batch = Batch::new(Pool::new(LIMITS), Room::new(1 << 30), query, LIMITS);
        let ahead = Arc::new(Semaphore::new(1)).try_acquire_owned().expect("a permit");
        let line = Line { index: 7, document: Ok(read_of(Bytes::from("{"))), _ahead: ahead };
        let slice = Mutex::new(Slice { waiting: [line].into(), ..Slice::default() });
        work(&slice, &batch, &mut compute::Slice::default(), &AtomicBool::new(true));
        let slice = slice.into_inner();
        assert_eq!((slice.answers.lines, slice.current), (0, Some(7)));
    }

    /// Single requests wait for it.
    #[test]
    fn a_slice_that_has_had_its_time_begins_no_further_line() {
        let mut document: Value =
            serde_json::from_str(include_str!("../../../examples/paper-5.1.json")).expect("a document");
        // 714 thousand states.
        document["sweep"] = json!({ "samples": 100_000 });
        assert_eq!(answered_in_a_slice(&Ok(document.to_string().into())), 1);
    }

    #[test]
    fn a_slice_that_has_its_bytes_begins_no_further_line() {
        let detail = "x".repeat(SLICE_BYTES);
        let long = Problem { detail, ..Problem::new(ProblemCode::BodyTooLarge, "") };
        assert_eq!(answered_in_a_slice(&Err(long)), 1);
    }

    /// Unless it is held up for milliseconds, which it is not each time.
    #[test]
    fn a_slice_answers_short_lines_together() {
        assert!((0..100).any(|_| answered_in_a_slice(&Ok(Bytes::from("{"))) == 3));
    }
}
