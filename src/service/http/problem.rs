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

/// Makes the enum of the kinds of problem from one table: word, HTTP status and title.
macro_rules! problem_codes {
    ($($code:ident = $status:tt $title:tt,)+) => {
        /// Kinds of problem.
        #[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
        #[serde(rename_all = "snake_case")]
        pub enum ProblemCode {
            $(#[doc = $title] $code,)+
        }

        impl ProblemCode {
            const fn status_and_title(self) -> (StatusCode, &'static str) {
                match self {
                    $(Self::$code => (StatusCode::$status, $title),)+
                }
            }
        }
    };
}

problem_codes! {
    MalformedJson = BAD_REQUEST "The body is not JSON",
    BrokenBody = BAD_REQUEST "The body is incomplete",
    InvalidQuery = BAD_REQUEST "Invalid query",
    Unauthorized = UNAUTHORIZED "A valid key is required",
    NotFound = NOT_FOUND "Not found",
    MethodNotAllowed = METHOD_NOT_ALLOWED "The path does not support this method",
    NotAcceptable = NOT_ACCEPTABLE "No acceptable representation",
    RequestTimeout = REQUEST_TIMEOUT "The body did not arrive in time",
    BodyTooLarge = PAYLOAD_TOO_LARGE "The body is too large",
    UnsupportedMediaType = UNSUPPORTED_MEDIA_TYPE "Unsupported media type",
    MisdirectedRequest = MISDIRECTED_REQUEST "Unknown host name",
    InvalidDocument = UNPROCESSABLE_ENTITY "The document has the wrong form",
    ImpossibleDesign = UNPROCESSABLE_ENTITY "The design is impossible",
    NoToothInMesh = UNPROCESSABLE_ENTITY "At some input angle no tooth carries load",
    ComplianceNotPositive = UNPROCESSABLE_ENTITY "The projection form has no solution",
    Interference = UNPROCESSABLE_ENTITY "Teeth interfere with a part",
    TooManyStates = UNPROCESSABLE_ENTITY "The sweep has too many states",
    TooManyPoints = UNPROCESSABLE_ENTITY "The profiles have too many points",
    TooManyVariants = UNPROCESSABLE_ENTITY "The study is too large",
    QueueFull = SERVICE_UNAVAILABLE "The service is full",
    DeadlineExceeded = SERVICE_UNAVAILABLE "The deadline stopped the computation",
    ShuttingDown = SERVICE_UNAVAILABLE "The service is stopping",
    TooManyConnections = SERVICE_UNAVAILABLE "Too many connections are open",
    TooManyUnreadBytes = SERVICE_UNAVAILABLE "Too many unread bytes",
    StudiesOff = NOT_IMPLEMENTED "This service has no studies",
    StoreUnavailable = SERVICE_UNAVAILABLE "The study database is not available",
    InternalError = INTERNAL_SERVER_ERROR "Internal error",
}

impl ProblemCode {
    /// Returns the HTTP status.
    pub const fn status(self) -> StatusCode {
        self.status_and_title().0
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
