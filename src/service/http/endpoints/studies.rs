//! `/v1/studies`: many variants of one design, and `/v1/quantities`, what can be asked of them.

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

/// A header of the request (RFC 7240).
const PREFER: HeaderName = HeaderName::from_static("prefer");
/// The header of the response that says which preference was followed (RFC 7240).
pub const PREFERENCE_APPLIED: HeaderName = HeaderName::from_static("preference-applied");

/// Time between two events of a study.
const EVENT_PAUSE: Duration = Duration::from_millis(100);

/// After this time without an event a comment is sent. A chunk may take minutes, and proxies close silent connections.
const KEEP_ALIVE: Duration = Duration::from_secs(5);

/// Every quantity that a study can be asked for.
#[derive(Debug, Serialize, ToSchema)]
pub struct QuantitiesAnswer {
    /// All of them.
    pub quantities: &'static [Quantity],
}

/// Every quantity that a study can be asked for, with unit, meaning and where it comes from.
#[utoipa::path(get, path = "/v1/quantities", tag = "studies", responses((status = 200, description = "The quantities.", body = QuantitiesAnswer)))]
pub async fn quantities() -> Json<QuantitiesAnswer> {
    Json(QuantitiesAnswer { quantities: &QUANTITIES })
}

/// A study: many variants of one design, looked at in the background.
#[utoipa::path(
    post,
    path = "/v1/studies",
    tag = "studies",
    request_body(content = StudyDocument, description = "What is asked. The same question is the same study: it is found again, or goes on where it was cancelled."),
    params(("Prefer" = Option<String>, Header, description = "RFC 7240: `wait=N` to be answered when the study is done, if that is within N seconds and within the service's deadline.")),
    responses(
        (status = 200, description = "The study does not run any more; with its result, as far as it has come.", body = StudyResource),
        (status = 202, description = "It runs; `Location` says where it stands, relative to this path.", body = StudyResource, headers(("Location" = String, description = "The study."))),
        Problems,
        (status = 404, description = "It was forgotten before it was answered: others took its room, or deleted it. Ask again.", body = Problem, content_type = "application/problem+json"),
        (status = 501, description = "The service was started without studies.", body = Problem, content_type = "application/problem+json")
    )
)]
pub async fn begin(State(app): State<Arc<App>>, request: Request) -> Response {
    respond_with_study(&app, request).await.unwrap_or_else(IntoResponse::into_response)
}

/// How a study stands.
#[utoipa::path(
    get,
    path = "/v1/studies/{id}",
    tag = "studies",
    params(("id" = String, Path, description = "As the study's `id`.")),
    responses(
        (status = 200, description = "It.", body = StudyResource),
        (status = 404, description = "No such study is kept.", body = Problem, content_type = "application/problem+json"),
        (status = 501, description = "The service was started without studies.", body = Problem, content_type = "application/problem+json"),
    )
)]
pub async fn study(State(app): State<Arc<App>>, id: Result<Path<String>, PathRejection>) -> Response {
    match find(&app, id) {
        Ok(record) => no_store(Json(record.resource()).into_response()),
        Err(problem) => problem.into_response(),
    }
}

/// Cancels a study that runs: what it has come to is kept, and the same question lets it go on. One that does not run is forgotten.
#[utoipa::path(
    delete,
    path = "/v1/studies/{id}",
    tag = "studies",
    params(("id" = String, Path, description = "As the study's `id`.")),
    responses(
        (status = 204, description = "It does not run any more, or is forgotten."),
        (status = 404, description = "No such study is kept.", body = Problem, content_type = "application/problem+json"),
        (status = 501, description = "The service was started without studies.", body = Problem, content_type = "application/problem+json"),
        (status = 503, description = "The file of studies cannot be written now; `Retry-After` says when to try again.", body = Problem, content_type = "application/problem+json", headers(("Retry-After" = u32, description = "Seconds")))
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

/// What a study has come to: whole, or as far as it has come.
#[utoipa::path(
    get,
    path = "/v1/studies/{id}/result",
    tag = "studies",
    params(CsvOptions, ("id" = String, Path, description = "As the study's `id`.")),
    responses(
        (status = 200, description = "The result; `is_complete` says whether it is whole. As CSV a line each of what the study is about; as Apache Parquet the same columns.",
            content((StudyAnswer = "application/json"), (String = "text/csv"), (String = "application/vnd.apache.parquet"))),
        (status = 404, description = "No such study is kept.", body = Problem, content_type = "application/problem+json"),
        (status = 501, description = "The service was started without studies.", body = Problem, content_type = "application/problem+json"),
        (status = 406, description = "No representation that the client accepts.", body = Problem, content_type = "application/problem+json"),
        (status = 500, description = "What is kept of the study is damaged, or the service itself failed.", body = Problem, content_type = "application/problem+json"),
        (status = 503, description = "The service is full, the deadline stopped the computation, or the file of studies cannot be read now; `Retry-After` says when to try again.", body = Problem, content_type = "application/problem+json", headers(("Retry-After" = u32, description = "Seconds")))
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
    /// `progress` while it runs, then `end`.
    event: EventName,
    /// The study as it stands, as JSON.
    data: String,
}

/// The name of an event.
#[derive(Debug, Clone, Copy, Serialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum EventName {
    /// It runs.
    Progress,
    /// It is over.
    End,
}

/// A study's progress as server-sent events: `progress` while it runs, then `end`. Each holds the study as it stands.
#[utoipa::path(
    get,
    path = "/v1/studies/{id}/events",
    tag = "studies",
    params(("id" = String, Path, description = "As the study's `id`.")),
    responses(
        (status = 200, description = "The events; they end when the study does.", body = StudyEvent, content_type = "text/event-stream"),
        (status = 404, description = "No such study is kept.", body = Problem, content_type = "application/problem+json"),
        (status = 501, description = "The service was started without studies.", body = Problem, content_type = "application/problem+json"),
    )
)]
pub async fn events(State(app): State<Arc<App>>, id: Result<Path<String>, PathRejection>) -> Response {
    let record = match find(&app, id) {
        Ok(record) => record,
        Err(problem) => return problem.into_response(),
    };
    // The state at once, and then after each change.
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

/// The id of a path. One that is no text is as unknown as the empty one.
fn id_of(id: Result<Path<String>, PathRejection>) -> String {
    id.map(|Path(id)| id).unwrap_or_default()
}

/// Completes a change even if the client leaves meanwhile.
async fn complete_change<T: Send + 'static, F: Future<Output = Result<T, Problem>> + Send + 'static>(
    app: &Arc<App>,
    change: impl FnOnce(Arc<App>) -> F,
) -> Result<T, Problem> {
    let changing = tokio::spawn(change(Arc::clone(app)).in_current_span());
    changing.await.unwrap_or_else(|error| Err(Problem::internal(&error)))
}

fn no_such_study(id: &str) -> Problem {
    let detail =
        format!("this service has no study `{id}`: it was never requested here, or was removed. Request it again");
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
    // A document of 64 KB can take long to read, because its choices are hundreds of designs.
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

/// The seconds of `wait=N`, where the request has that.
fn wait_wanted(headers: &HeaderMap) -> Option<Duration> {
    let preferences = headers.get_all(PREFER).iter().filter_map(|value| value.to_str().ok());
    preferences.flat_map(|list| list.split([',', ';'])).find_map(|preference| {
        let (name, value) = preference.split_once('=')?;
        let seconds = value.trim().trim_matches('"');
        let is_number = !seconds.is_empty() && seconds.bytes().all(|byte| byte.is_ascii_digit());
        let seconds = is_number.then(|| seconds.parse::<u64>().unwrap_or(u64::MAX))?;
        // So long that nothing is waited for longer, so short that it can be added to any time.
        let seconds = seconds.min(u64::from(u32::MAX));
        name.trim().eq_ignore_ascii_case("wait").then(|| Duration::from_secs(seconds))
    })
}

/// The response with a study's answer, in the view of it that the request wants.
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
