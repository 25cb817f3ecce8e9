//! What bad input and trouble get: RFC 9457 problems, and the one map to them from the reasons why the calculation has no answer.
//!
//! Making a problem neither counts nor logs it: it goes along with the response that tells it, and `http/observe.rs` does both there.

use std::any::Any;

use axum::http::{HeaderValue, StatusCode, header};
use axum::response::{IntoResponse, Response};
use serde::{Deserialize, Serialize};
use toothwave_calculation::field::FieldError;
use toothwave_calculation::json;
use toothwave_calculation::no_answer::{NoAnswer, NoAnswerCode, clip};
use utoipa::ToSchema;

/// The media type of problems.
pub const PROBLEM_JSON: &str = "application/problem+json";

/// Seconds after which a refused request may be worth trying again.
pub const RETRY_AFTER_S: u32 = 1;

/// A problem as it goes over the wire (RFC 9457).
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
#[schema(example = json!({
    "type": "urn:toothwave:problem:impossible_design",
    "title": "Values that no design can have",
    "status": 422,
    "detail": "/drive/wave_generator/semi_major_mm: the semi-major axis (56.0 mm) must exceed the semi-minor axis (56.0 mm): a round cam moves no tooth",
    "code": "impossible_design",
    "errors": [{
        "pointer": "/drive/wave_generator/semi_major_mm",
        "code": "cam_not_elongated",
        "detail": "the semi-major axis (56.0 mm) must exceed the semi-minor axis (56.0 mm): a round cam moves no tooth",
        "value": 56.0,
        "limit": 56.0
    }]
}))]
pub struct Problem {
    /// `urn:toothwave:problem:` and the code.
    #[serde(rename = "type")]
    pub kind: String,
    /// The kind of problem in words.
    pub title: &'static str,
    /// HTTP status.
    #[schema(minimum = 400, maximum = 599)]
    pub status: u16,
    /// What happened, and what to do about it.
    pub detail: String,
    /// The kind of problem, a stable word.
    pub code: ProblemCode,
    /// Where fields are at fault: each of them, of more than 100 the first.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    #[schema(required = false, max_items = 100)]
    pub errors: Vec<FieldError>,
    /// Of an internal error, why: for the log alone.
    #[serde(skip)]
    pub cause: Option<String>,
}

/// Kinds of problem.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum ProblemCode {
    /// 400: the body is no JSON.
    MalformedJson,
    /// 400: the body broke off, or is not coded as its head says.
    BrokenBody,
    /// 400: a query that the path does not know.
    InvalidQuery,
    /// 401: no key, or one that opens nothing.
    Unauthorized,
    /// 404: nothing stands at this path.
    NotFound,
    /// 405: the path knows other methods.
    MethodNotAllowed,
    /// 406: no representation that the client accepts.
    NotAcceptable,
    /// 408: the body did not arrive in time.
    RequestTimeout,
    /// 413: the body exceeds `max_body_bytes`.
    BodyTooLarge,
    /// 415: the body is not sent as plain JSON.
    UnsupportedMediaType,
    /// 421: a service that listens on this machine alone was asked under another name.
    MisdirectedRequest,
    /// 422: JSON of another form than the design document's.
    InvalidDocument,
    /// 422: values that no drive, load or request can have.
    ImpossibleDesign,
    /// 422: at some input angle no tooth has a lever arm.
    NoToothInMesh,
    /// 422: a `projection` whose stiffnesses give a tooth a compliance that is not positive.
    ComplianceNotPositive,
    /// 422: a part is too full for a tooth that is to carry.
    Interference,
    /// 422: the sweep has more states than `max_states`.
    TooManyStates,
    /// 422: the profiles have more points than `max_profile_points`.
    TooManyPoints,
    /// 422: the study has more variants, or takes more bytes, than the service admits.
    TooManyVariants,
    /// 503: as many solves run and wait as the service admits.
    QueueFull,
    /// 503: the deadline stopped the computation.
    DeadlineExceeded,
    /// 503: the service is stopping, and the computation with it.
    ShuttingDown,
    /// 503: as many connections are open as the service admits.
    TooManyConnections,
    /// 503: so many bytes of answers are on their way to clients that there is no room for another.
    TooManyUnreadBytes,
    /// 501: the service was started without studies.
    StudiesOff,
    /// 503: the file of studies cannot be read or written, for instance because the disk is full.
    StoreUnavailable,
    /// 500: a fault of the service itself.
    InternalError,
}

impl ProblemCode {
    /// Its HTTP status and its title.
    const fn status_and_title(self) -> (u16, &'static str) {
        match self {
            Self::MalformedJson => (400, "The body is no JSON"),
            Self::BrokenBody => (400, "The body broke off"),
            Self::InvalidQuery => (400, "The path takes no such query"),
            Self::Unauthorized => (401, "A key is needed"),
            Self::NotFound => (404, "Nothing is at this path"),
            Self::MethodNotAllowed => (405, "The path takes other methods"),
            Self::NotAcceptable => (406, "No representation that the client accepts"),
            Self::RequestTimeout => (408, "The body did not arrive in time"),
            Self::BodyTooLarge => (413, "The body is too large"),
            Self::UnsupportedMediaType => (415, "The body is not sent as plain JSON"),
            Self::MisdirectedRequest => (421, "Unknown host name"),
            Self::InvalidDocument => (422, "The document has another form than is read here"),
            Self::ImpossibleDesign => (422, "Values that no design can have"),
            Self::NoToothInMesh => (422, "At some input angle no tooth carries load"),
            Self::ComplianceNotPositive => (422, "The projection form has no solution"),
            Self::Interference => (422, "A part is too full"),
            Self::TooManyStates => (422, "The sweep has too many states"),
            Self::TooManyPoints => (422, "The profiles have too many points"),
            Self::TooManyVariants => (422, "The study is too large"),
            Self::InternalError => (500, "The service failed"),
            Self::StudiesOff => (501, "This service takes no studies"),
            Self::QueueFull => (503, "The service is full"),
            Self::DeadlineExceeded => (503, "The deadline stopped the computation"),
            Self::ShuttingDown => (503, "The service is stopping"),
            Self::TooManyConnections => (503, "Too many connections are open"),
            Self::TooManyUnreadBytes => (503, "Clients have too many bytes of answers to read"),
            Self::StoreUnavailable => (503, "The file of studies cannot be used now"),
        }
    }

    /// Its HTTP status.
    pub fn status(self) -> StatusCode {
        StatusCode::from_u16(self.status_and_title().0).unwrap_or(StatusCode::INTERNAL_SERVER_ERROR)
    }

    /// Requests that the service could answer but refuses now, or to this client.
    pub const REFUSALS: [Self; 9] = [
        Self::Unauthorized,
        Self::QueueFull,
        Self::DeadlineExceeded,
        Self::ShuttingDown,
        Self::TooManyConnections,
        Self::TooManyUnreadBytes,
        Self::MisdirectedRequest,
        Self::StudiesOff,
        Self::StoreUnavailable,
    ];
}

impl From<NoAnswerCode> for ProblemCode {
    fn from(code: NoAnswerCode) -> Self {
        match code {
            NoAnswerCode::MalformedJson => Self::MalformedJson,
            NoAnswerCode::InvalidDocument => Self::InvalidDocument,
            NoAnswerCode::ImpossibleDesign => Self::ImpossibleDesign,
            NoAnswerCode::NoToothInMesh => Self::NoToothInMesh,
            NoAnswerCode::ComplianceNotPositive => Self::ComplianceNotPositive,
            NoAnswerCode::Interference => Self::Interference,
            NoAnswerCode::TooManyStates => Self::TooManyStates,
            NoAnswerCode::TooManyPoints => Self::TooManyPoints,
            NoAnswerCode::TooManyVariants => Self::TooManyVariants,
            NoAnswerCode::Stopped => Self::DeadlineExceeded,
            NoAnswerCode::InternalError => Self::InternalError,
        }
    }
}

impl From<NoAnswer> for Problem {
    fn from(NoAnswer { code, detail, errors }: NoAnswer) -> Self {
        match code {
            NoAnswerCode::InternalError => Self::internal(&detail),
            _ => Self::at_fields(code.into(), detail, errors),
        }
    }
}

impl Problem {
    /// A problem without fields.
    pub fn new(code: ProblemCode, detail: impl Into<String>) -> Self {
        Self::at_fields(code, detail, Vec::new())
    }

    /// A problem of these fields.
    fn at_fields(code: ProblemCode, detail: impl Into<String>, errors: Vec<FieldError>) -> Self {
        let mut detail = detail.into();
        // Of a request's line too there may be very much to repeat.
        clip(&mut detail);
        Self {
            kind: format!("urn:toothwave:problem:{}", json::word(&code)),
            title: code.status_and_title().1,
            status: code.status().as_u16(),
            detail,
            code,
            errors,
            cause: None,
        }
    }

    /// A panic, with its text for the log.
    pub fn panicked(panic: &(dyn Any + Send)) -> Self {
        let text = panic.downcast_ref::<String>().map(String::as_str);
        let text = text.or_else(|| panic.downcast_ref::<&str>().copied()).unwrap_or("without a text");
        Self::internal(&format_args!("a panic: {text}"))
    }

    /// An internal fault: the client learns only that there was one.
    pub fn internal(cause: &dyn std::fmt::Display) -> Self {
        let detail = "the service failed at this request; its log says why";
        Self { cause: Some(cause.to_string()), ..Self::new(ProblemCode::InternalError, detail) }
    }
}

/// For people: every error where there are several.
impl std::fmt::Display for Problem {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self { title, detail, errors, .. } = self;
        if errors.len() < 2 {
            return write!(f, "{title}: {detail}");
        }
        write!(f, "{title}:")?;
        errors.iter().try_for_each(|error| write!(f, "\n  {}: {}", error.pointer, error.detail))
    }
}

impl IntoResponse for Problem {
    fn into_response(self) -> Response {
        let status = self.code.status();
        let body = serde_json::to_vec(&self).unwrap_or_default();
        let mut response = (status, [(header::CONTENT_TYPE, PROBLEM_JSON)], body).into_response();
        if status == StatusCode::SERVICE_UNAVAILABLE {
            response.headers_mut().insert(header::RETRY_AFTER, HeaderValue::from(RETRY_AFTER_S));
        }
        response.extensions_mut().insert(self);
        response
    }
}
