//! `POST /v1/batch`: many design documents for one endpoint, a line each, answered in their order while they are read.
//!
//! Each line is one computation in the background. As many lines are computed at once as there are permits; the client reads their
//! answers, or no further line is begun.

use std::io::{self, Write as _};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::Duration;

use axum::body::Body;
use axum::extract::rejection::QueryRejection;
use axum::extract::{Query, Request, State};
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
use crate::compute::pool::caught;
use crate::http::answer::{Stoppable, bound, broken_body, require_within, settle, write_problem};
use crate::http::negotiation;
use crate::http::observe::note_problem;
use crate::http::problem::{Problem, ProblemCode};
use crate::ops::config::CLIENT_TIMEOUT_MS;

/// What is read of a batch before its answer begins, behind a proxy: nginx passes on no more of a request once its answer has begun.
const READ_AHEAD_BYTES: usize = 8 << 20;

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
    ///
    /// # Errors
    /// `invalid_query`.
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
    let mut writer = Stoppable::new(Vec::with_capacity(answer.expected_bytes()), stop);
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
    let line = caught(|| match query.endpoint {
        BatchEndpoint::Geometry => line(&Geometry, index, document, limits),
        BatchEndpoint::CoincidenceDegree => line(&CoincidenceDegree, index, document, limits),
        BatchEndpoint::Sweep if query.peaks_only => line(&PeaksOnly, index, document, limits),
        BatchEndpoint::Sweep => line(&Sweep, index, document, limits),
    });
    line.unwrap_or_else(|problem| problem_line(index, problem))
}

/// What comes of a document when it is read.
enum Read<C> {
    /// Its line: the answer is small.
    Line(Vec<u8>),
    /// Its answer has to reserve this many bytes.
    Large(C, u64),
}

async fn line<Q: Question>(app: &App, question: Q, index: u64, document: Bytes) -> Result<Bytes, Problem> {
    let limits = app.limits.of_calculation();
    let budget = app.budget.clone();
    let time = Duration::from_millis(app.limits.deadline_ms);
    let read = app.pool.run_in_background(time, move |stop| {
        let checked = question.check(&Design::read(&document)?, &limits)?;
        let bytes = bound::<Q>(&budget, &checked, Format::Json);
        if bytes > FREE_BYTES {
            return Ok(Read::Large(checked, bytes));
        }
        answered::<Q>(index, &checked, None, stop).map(Read::Line)
    });
    match read.await? {
        Read::Line(line) => Ok(line.into()),
        Read::Large(checked, bytes) => {
            let reservation = app.budget.reserve(bytes).await?;
            let job = move |stop: &AtomicBool| {
                let line = answered::<Q>(index, &checked, reservation.as_ref(), stop)?;
                Ok((settle(reservation, line.len()), line))
            };
            let (reservation, line) = app.pool.run_in_background(time, job).await?;
            Ok(match &reservation {
                Some(reservation) => Reservation::hold(reservation, line.into()),
                None => line.into(),
            })
        }
    }
}

fn answered<Q: Question>(
    index: u64,
    checked: &Q::Checked,
    reservation: Option<&Reservation>,
    stop: &AtomicBool,
) -> Result<Vec<u8>, Problem> {
    #[cfg(feature = "fault-injection")]
    fail::fail_point!("solve");
    let answer = Q::answer(checked, stop)?;
    if let Some(reservation) = reservation {
        require_within(reservation, answer.bytes(Format::Json))?;
    }
    answer_line(index, &answer, stop)
}

/// The lines of a body that are not blank, until it ends; what ends it otherwise goes to `end`.
fn lines(app: Arc<App>, body: Body, end: Arc<Mutex<BatchEnd>>) -> impl Stream<Item = (u64, Result<Bytes, Problem>)> {
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
    let computed = lines(Arc::clone(&app), body, end).map(move |(index, document)| {
        let app = Arc::clone(&app);
        async move {
            let line = match (document, query.endpoint) {
                (Err(problem), _) => Err(problem),
                (Ok(document), BatchEndpoint::Geometry) => line(&app, Geometry, index, document).await,
                (Ok(document), BatchEndpoint::CoincidenceDegree) => {
                    line(&app, CoincidenceDegree, index, document).await
                }
                (Ok(document), BatchEndpoint::Sweep) if query.peaks_only => {
                    line(&app, PeaksOnly, index, document).await
                }
                (Ok(document), BatchEndpoint::Sweep) => line(&app, Sweep, index, document).await,
            };
            line.unwrap_or_else(|problem| problem_line(index, problem).into())
        }
    });
    let computed = computed.buffered(at_once).inspect(move |_| counted.lock().answered += 1);
    // Made when all lines before it have been given out.
    computed.chain(stream::once(async move { ending.lock().line().into() }))
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
        // What is late or broken is told by the last line.
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
pub async fn batch(
    State(app): State<Arc<App>>,
    query: Result<Query<BatchQuery>, QueryRejection>,
    request: Request,
) -> Response {
    begin(app, query, request).await.unwrap_or_else(IntoResponse::into_response)
}

async fn begin(
    app: Arc<App>,
    query: Result<Query<BatchQuery>, QueryRejection>,
    request: Request,
) -> Result<Response, Problem> {
    let Query(query) = query.map_err(|error| Problem::new(ProblemCode::InvalidQuery, error.body_text()))?;
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
