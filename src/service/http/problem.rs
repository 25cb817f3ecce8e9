//! Problems (RFC 9457), and the one map from the calculation's errors to them.
//!
//! Making a problem does not count or log it. `http/observe.rs` does both when the response leaves.

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

/// Seconds until a retry of a refused request.
pub const RETRY_AFTER_S: u32 = 1;

/// A problem as it is sent (RFC 9457).
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
#[schema(example = json!({
    "type": "urn:toothwave:problem:impossible_design",
    "title": "The design is impossible",
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
    /// Short text for the kind of problem.
    pub title: &'static str,
    /// HTTP status.
    #[schema(minimum = 400, maximum = 599)]
    pub status: u16,
    /// Message: what is wrong, where, and what to do.
    pub detail: String,
    /// Kind of problem, as a stable word.
    pub code: ProblemCode,
    /// The wrong fields, at most the first 100.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    #[schema(required = false, max_items = 100)]
    pub errors: Vec<FieldError>,
    /// Cause of an internal error, for the log alone.
    #[serde(skip)]
    pub cause: Option<String>,
}

/// Kinds of problem.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum ProblemCode {
    /// 400: the body is not JSON.
    MalformedJson,
    /// 400: the body is incomplete, or its coding differs from its headers.
    BrokenBody,
    /// 400: the query is unknown or invalid.
    InvalidQuery,
    /// 401: the key is missing or unknown.
    Unauthorized,
    /// 404: the path or the resource does not exist.
    NotFound,
    /// 405: the path does not support this method.
    MethodNotAllowed,
    /// 406: the client accepts no available representation.
    NotAcceptable,
    /// 408: the body did not arrive within the time limit.
    RequestTimeout,
    /// 413: the body exceeds `max_body_bytes`.
    BodyTooLarge,
    /// 415: the body is not plain JSON.
    UnsupportedMediaType,
    /// 421: the service listens on the loopback address, and the request has another host name.
    MisdirectedRequest,
    /// 422: the JSON does not have the form of the document.
    InvalidDocument,
    /// 422: a value is impossible for a drive, a load or a request.
    ImpossibleDesign,
    /// 422: at some input angle no tooth carries load.
    NoToothInMesh,
    /// 422: with these stiffnesses the `projection` form gives a tooth a compliance that is not positive.
    ComplianceNotPositive,
    /// 422: teeth interfere with a part.
    Interference,
    /// 422: the sweep has more states than `max_states`, or the answer exceeds the byte limit.
    TooManyStates,
    /// 422: the profiles have more points than `max_profile_points`.
    TooManyPoints,
    /// 422: the study has more variants or bytes than the limits.
    TooManyVariants,
    /// 503: the limit of running and waiting computations is reached.
    QueueFull,
    /// 503: the deadline stopped the computation.
    DeadlineExceeded,
    /// 503: the service is stopping.
    ShuttingDown,
    /// 503: the limit of open connections is reached.
    TooManyConnections,
    /// 503: answers that clients have not read yet hold the byte budget.
    TooManyUnreadBytes,
    /// 501: the service was started without studies.
    StudiesOff,
    /// 503: the database file of the studies cannot be read or written, for example because the disk is full.
    StoreUnavailable,
    /// 500: the service has an internal error.
    InternalError,
}

impl ProblemCode {
    /// Returns the HTTP status and the title.
    const fn status_and_title(self) -> (u16, &'static str) {
        match self {
            Self::MalformedJson => (400, "The body is not JSON"),
            Self::BrokenBody => (400, "The body is incomplete"),
            Self::InvalidQuery => (400, "Invalid query"),
            Self::Unauthorized => (401, "A valid key is required"),
            Self::NotFound => (404, "Not found"),
            Self::MethodNotAllowed => (405, "The path does not support this method"),
            Self::NotAcceptable => (406, "No acceptable representation"),
            Self::RequestTimeout => (408, "The body did not arrive in time"),
            Self::BodyTooLarge => (413, "The body is too large"),
            Self::UnsupportedMediaType => (415, "Unsupported media type"),
            Self::MisdirectedRequest => (421, "Unknown host name"),
            Self::InvalidDocument => (422, "The document has the wrong form"),
            Self::ImpossibleDesign => (422, "The design is impossible"),
            Self::NoToothInMesh => (422, "At some input angle no tooth carries load"),
            Self::ComplianceNotPositive => (422, "The projection form has no solution"),
            Self::Interference => (422, "Teeth interfere with a part"),
            Self::TooManyStates => (422, "The sweep has too many states"),
            Self::TooManyPoints => (422, "The profiles have too many points"),
            Self::TooManyVariants => (422, "The study is too large"),
            Self::InternalError => (500, "Internal error"),
            Self::StudiesOff => (501, "This service has no studies"),
            Self::QueueFull => (503, "The service is full"),
            Self::DeadlineExceeded => (503, "The deadline stopped the computation"),
            Self::ShuttingDown => (503, "The service is stopping"),
            Self::TooManyConnections => (503, "Too many connections are open"),
            Self::TooManyUnreadBytes => (503, "Too many unread bytes"),
            Self::StoreUnavailable => (503, "The study database is not available"),
        }
    }

    /// Returns the HTTP status.
    pub fn status(self) -> StatusCode {
        StatusCode::from_u16(self.status_and_title().0).unwrap_or(StatusCode::INTERNAL_SERVER_ERROR)
    }

    /// Refusals: the request is valid, but the service does not answer it now, or not to this client.
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
    /// Makes a problem without fields.
    pub fn new(code: ProblemCode, detail: impl Into<String>) -> Self {
        Self::at_fields(code, detail, Vec::new())
    }

    /// Makes a problem of these fields.
    fn at_fields(code: ProblemCode, detail: impl Into<String>, errors: Vec<FieldError>) -> Self {
        let mut detail = detail.into();
        // The detail may quote a long request.
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

    /// Makes the problem of a panic. The log gets its text.
    pub fn panicked(panic: &(dyn Any + Send)) -> Self {
        let text = panic.downcast_ref::<String>().map(String::as_str);
        let text = text.or_else(|| panic.downcast_ref::<&str>().copied()).unwrap_or("no text");
        Self::internal(&format_args!("a panic: {text}"))
    }

    /// Makes an internal error. The client does not see the cause.
    pub fn internal(cause: &dyn std::fmt::Display) -> Self {
        let detail = "the service failed. Its log has the cause";
        Self { cause: Some(cause.to_string()), ..Self::new(ProblemCode::InternalError, detail) }
    }
}

/// Text for people. Several errors are listed one a line.
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
