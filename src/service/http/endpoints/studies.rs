//! `/v1/studies`: many variants of one design. `/v1/quantities`: the quantities that a study can return.

use std::convert::Infallible;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::Duration;

use axum::Json;
use axum::extract::rejection::PathRejection;
use axum::extract::{Path, Request, State};
use axum::http::request::Parts;
use axum::http::{HeaderMap, HeaderName, HeaderValue, StatusCode, Uri, header};
use axum::response::sse::{Event, KeepAlive, Sse};
use axum::response::{IntoResponse, Response};
use futures_util::stream;
use serde::Serialize;
use toothwave_calculation::forms::{CsvOptions, Form, Format, Forms};
use toothwave_calculation::json::word;
use toothwave_study::{QUANTITIES, Quantity, Study, StudyAnswer, StudyDocument};
use tracing::Instrument as _;
use utoipa::ToSchema;

use crate::app::App;
use crate::compute::budget::Reservation;
use crate::compute::pool::within;
use crate::http::answer::{Problems, body_response, read_body, shrink_to_body, write};
use crate::http::negotiation::{self, Representation};
use crate::http::problem::{Problem, ProblemCode};
use crate::studies::{StudyRecord, StudyResource, StudyState};

/// Request header with preferences (RFC 7240).
const PREFER: HeaderName = HeaderName::from_static("prefer");
/// Response header with the applied preference (RFC 7240).
pub const PREFERENCE_APPLIED: HeaderName = HeaderName::from_static("preference-applied");

/// Shortest time between two events of a study.
const EVENT_PAUSE: Duration = Duration::from_millis(100);

/// Interval of keep-alive comments. A chunk may take minutes, and proxies close silent connections.
const KEEP_ALIVE: Duration = Duration::from_secs(5);

/// List of the quantities of studies.
#[derive(Debug, Serialize, ToSchema)]
pub struct QuantitiesAnswer {
    /// The quantities.
    pub quantities: &'static [Quantity],
}

/// Lists the quantities that a study can return, with unit, meaning and source.
#[utoipa::path(get, path = "/v1/quantities", tag = "studies", responses((status = 200, description = "The quantities.", body = QuantitiesAnswer)))]
pub async fn quantities() -> Json<QuantitiesAnswer> {
    Json(QuantitiesAnswer { quantities: &QUANTITIES })
}

/// Starts a study: many variants of one design, computed in the background.
#[utoipa::path(
    post,
    path = "/v1/studies",
    tag = "studies",
    request_body(content = StudyDocument, description = "A study document. The same document is the same study: a finished one is returned, a cancelled one continues."),
    params(("Prefer" = Option<String>, Header, description = "RFC 7240: with `wait=N` the response waits for the end of the study, at most N seconds and at most the service's deadline.")),
    responses(
        (status = 200, description = "The study has ended. The response has its result, which may be partial.", body = StudyResource),
        (status = 202, description = "The study runs. `Location` has its path.", body = StudyResource, headers(("Location" = String, description = "Path of the study, relative to this path."))),
        Problems,
        (status = 404, description = "The study was removed before the response: by a client, or to free memory for another study. Request it again.", body = Problem, content_type = "application/problem+json"),
        (status = 501, description = "The service was started without studies.", body = Problem, content_type = "application/problem+json")
    )
)]
pub async fn begin(State(app): State<Arc<App>>, request: Request) -> Response {
    respond_with_study(&app, request).await.unwrap_or_else(IntoResponse::into_response)
}

/// Returns the state of a study.
#[utoipa::path(
    get,
    path = "/v1/studies/{id}",
    tag = "studies",
    params(("id" = String, Path, description = "The `id` of the study.")),
    responses(
        (status = 200, description = "The study.", body = StudyResource),
        (status = 404, description = "There is no study with this id.", body = Problem, content_type = "application/problem+json"),
        (status = 501, description = "The service was started without studies.", body = Problem, content_type = "application/problem+json"),
    )
)]
pub async fn study(State(app): State<Arc<App>>, id: Result<Path<String>, PathRejection>) -> Response {
    match find(&app, id) {
        Ok(record) => no_store(Json(record.resource()).into_response()),
        Err(problem) => problem.into_response(),
    }
}

/// Cancels a running study, or removes one that has ended.
/// A cancelled study keeps its parts. The same study document continues it.
#[utoipa::path(
    delete,
    path = "/v1/studies/{id}",
    tag = "studies",
    params(("id" = String, Path, description = "The `id` of the study.")),
    responses(
        (status = 204, description = "The study is cancelled or removed."),
        (status = 404, description = "There is no study with this id.", body = Problem, content_type = "application/problem+json"),
        (status = 501, description = "The service was started without studies.", body = Problem, content_type = "application/problem+json"),
        (status = 503, description = "The database file of the studies cannot be written. `Retry-After` has the seconds until a retry.", body = Problem, content_type = "application/problem+json", headers(("Retry-After" = u32, description = "Seconds")))
    )
)]
pub async fn cancel(State(app): State<Arc<App>>, id: Result<Path<String>, PathRejection>) -> Response {
    let id = id_of(id);
    let own = id.clone();
    match complete_change(&app, async move |app| app.studies.cancel_or_remove(&own).await).await {
        Ok(true) => StatusCode::NO_CONTENT.into_response(),
        Ok(false) => no_such_study(&id).into_response(),
        Err(problem) => problem.into_response(),
    }
}

/// Returns the result of a study. It is partial if the study has not finished.
#[utoipa::path(
    get,
    path = "/v1/studies/{id}/result",
    tag = "studies",
    params(CsvOptions, ("id" = String, Path, description = "The `id` of the study.")),
    responses(
        (status = 200, description = "The result. `is_complete` is true if all variants are computed. CSV has one line for each row of the study; Apache Parquet has the same columns.",
            content((StudyAnswer = "application/json"), (String = "text/csv"), (String = "application/vnd.apache.parquet"))),
        (status = 404, description = "There is no study with this id.", body = Problem, content_type = "application/problem+json"),
        (status = 501, description = "The service was started without studies.", body = Problem, content_type = "application/problem+json"),
        (status = 406, description = "The client accepts no available representation.", body = Problem, content_type = "application/problem+json"),
        (status = 500, description = "The stored study is damaged, or the service has an internal error.", body = Problem, content_type = "application/problem+json"),
        (status = 503, description = "The service is full, the deadline stopped the computation, or the database file of the studies cannot be read. `Retry-After` has the seconds until a retry.", body = Problem, content_type = "application/problem+json", headers(("Retry-After" = u32, description = "Seconds")))
    )
)]
pub async fn result(
    State(app): State<Arc<App>>,
    id: Result<Path<String>, PathRejection>,
    uri: Uri,
    headers: HeaderMap,
) -> Response {
    let answer = async {
        let formats = negotiation::formats::<StudyAnswer>(&uri)?;
        let record = find(&app, id)?;
        let representation = Representation::negotiate(&headers, formats)?;
        answer_response(&app, &record, representation, |answer| answer).await
    };
    no_store(answer.await.unwrap_or_else(IntoResponse::into_response))
}

/// A server-sent event of a study.
#[derive(Debug, ToSchema)]
#[expect(dead_code, reason = "for the API document: axum writes its lines")]
pub struct StudyEvent {
    /// `progress` while the study runs, then `end`.
    event: EventName,
    /// The current state of the study, as JSON.
    data: String,
}

/// The name of an event.
#[derive(Debug, Clone, Copy, Serialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum EventName {
    /// The study runs.
    Progress,
    /// The study has ended.
    End,
}

/// Streams the progress of a study as server-sent events.
/// The events are `progress` while the study runs, then `end`. Each has the current state of the study.
#[utoipa::path(
    get,
    path = "/v1/studies/{id}/events",
    tag = "studies",
    params(("id" = String, Path, description = "The `id` of the study.")),
    responses(
        (status = 200, description = "The events. The stream ends with the study.", body = StudyEvent, content_type = "text/event-stream"),
        (status = 404, description = "There is no study with this id.", body = Problem, content_type = "application/problem+json"),
        (status = 501, description = "The service was started without studies.", body = Problem, content_type = "application/problem+json"),
    )
)]
pub async fn events(State(app): State<Arc<App>>, id: Result<Path<String>, PathRejection>) -> Response {
    let record = match find(&app, id) {
        Ok(record) => record,
        Err(problem) => return problem.into_response(),
    };
    // The first event has the current state; each further one follows a change.
    let events = stream::unfold(Some((record, None)), move |next| {
        let app = Arc::clone(&app);
        async move {
            let (record, changed) = next?;
            if let Some(changed) = changed {
                let changed = async {
                    changed.await;
                    tokio::time::sleep(EVENT_PAUSE).await;
                    app.studies.touch(&record);
                };
                tokio::select! {
                    () = changed => {}
                    () = app.studies.closing().cancelled() => return None,
                }
            }
            // Subscribed before the state is read, so that no change is missed.
            let changed = record.changed();
            let resource = record.resource();
            let is_running = resource.state == StudyState::Running;
            let name = if is_running { EventName::Progress } else { EventName::End };
            let event = Event::default().event(word(&name)).json_data(&resource).unwrap_or_default();
            Some((Ok::<_, Infallible>(event), is_running.then_some((record, Some(changed)))))
        }
    });
    no_store(Sse::new(events).keep_alive(KeepAlive::new().interval(KEEP_ALIVE)).into_response())
}

fn no_store(mut response: Response) -> Response {
    response.headers_mut().insert(header::CACHE_CONTROL, HeaderValue::from_static("no-store"));
    response
}

fn find(app: &App, id: Result<Path<String>, PathRejection>) -> Result<Arc<StudyRecord>, Problem> {
    let id = id_of(id);
    app.studies.find(&id)?.ok_or_else(|| no_such_study(&id))
}

/// Returns the id of a path. An id that is not UTF-8 becomes the empty id, which is unknown.
fn id_of(id: Result<Path<String>, PathRejection>) -> String {
    id.map(|Path(id)| id).unwrap_or_default()
}

/// Completes a change even if the client leaves.
async fn complete_change<T: Send + 'static, F: Future<Output = Result<T, Problem>> + Send + 'static>(
    app: &Arc<App>,
    change: impl FnOnce(Arc<App>) -> F,
) -> Result<T, Problem> {
    let changing = tokio::spawn(change(Arc::clone(app)).in_current_span());
    changing.await.unwrap_or_else(|error| Err(Problem::internal(&error)))
}

fn no_such_study(id: &str) -> Problem {
    let detail = format!("there is no study `{id}`: it was never requested here, or was removed. Request it again");
    Problem::new(ProblemCode::NotFound, detail)
}

async fn respond_with_study(app: &Arc<App>, request: Request) -> Result<Response, Problem> {
    let deadline = app.deadline();
    let (Parts { headers, uri, .. }, body) = request.into_parts();
    negotiation::require_no_query(&uri)?;
    negotiation::require_json(&headers)?;
    let representation = Representation::negotiate(&headers, std::iter::empty())?;
    let text = read_body(app, deadline, &headers, body).await?.to_vec();
    let limits = app.limits.of_studies();
    // A document of 64 KB can take long to parse, because its choices are hundreds of designs.
    let read = move |_: &AtomicBool| Ok((Study::read(&text, &limits)?, text));
    let (study, text) = within(deadline, app.pool.run(read)).await?;
    let record = complete_change(app, async move |app| app.studies.begin(study, &text).await).await?;
    let wait = wait_wanted(&headers);
    if let Some(wait) = wait {
        let wait_until = deadline.at.min(tokio::time::Instant::now() + wait);
        tokio::select! {
            _ = tokio::time::timeout_at(wait_until, record.ended()) => {}
            () = app.studies.closing().cancelled() => {}
        }
    }
    let resource = record.resource();
    let mut response = if resource.state == StudyState::Running {
        // Relative, because a proxy may strip a prefix from the path.
        let location = format!("studies/{}", resource.id);
        (StatusCode::ACCEPTED, [(header::LOCATION, location)], Json(resource)).into_response()
    } else {
        let with_result = move |answer| StudyResource { result: Some(answer), ..resource };
        answer_response(app, &record, representation, with_result).await?
    };
    if let Some(wait) = wait {
        let applied = format!("wait={}", wait.as_secs());
        let applied = HeaderValue::try_from(applied).map_err(|error| Problem::internal(&error))?;
        response.headers_mut().insert(PREFERENCE_APPLIED, applied);
    }
    Ok(no_store(response))
}

/// Returns the time of the preference `wait=N`.
fn wait_wanted(headers: &HeaderMap) -> Option<Duration> {
    let preferences = headers.get_all(PREFER).iter().filter_map(|value| value.to_str().ok());
    preferences.flat_map(|list| list.split([',', ';'])).find_map(|preference| {
        let (name, value) = preference.split_once('=')?;
        let seconds = value.trim().trim_matches('"');
        let is_number = !seconds.is_empty() && seconds.bytes().all(|byte| byte.is_ascii_digit());
        let seconds = is_number.then(|| seconds.parse::<u64>().unwrap_or(u64::MAX))?;
        // The cap fits into every time type and exceeds every deadline.
        let seconds = seconds.min(u64::from(u32::MAX));
        name.trim().eq_ignore_ascii_case("wait").then(|| Duration::from_secs(seconds))
    })
}

/// Returns the response with a study's answer, wrapped by `view`.
async fn answer_response<A: Forms + Send>(
    app: &Arc<App>,
    record: &Arc<StudyRecord>,
    representation: Representation,
    view: impl FnOnce(StudyAnswer) -> A + Send + 'static,
) -> Result<Response, Problem> {
    let reservation = app.budget.reserve(representation.format.bytes_with_text(record.bytes())).await?;
    let (own, record) = (Arc::clone(app), Arc::clone(record));
    let job = move |stop: &AtomicBool| {
        let body = write(&view(own.studies.answer(&record, stop)?), representation, stop)?;
        Ok((shrink_to_body(reservation, body.len()), body))
    };
    let (reservation, body) = within(app.deadline(), app.pool.run(job)).await?;
    Ok(body_response(Reservation::hold(reservation, body), representation))
}

impl Forms for StudyResource {
    const FORMS: &'static [(Format, Form<Self>)] = &[];

    fn expected_bytes(&self) -> usize {
        1024 + self.result.as_ref().map_or(0, Forms::expected_bytes)
    }
}
