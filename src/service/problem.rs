//! What bad input and trouble get: RFC 9457 problems, and the one map from the solver's errors to them.

use std::any::Any;

use axum::http::{HeaderValue, StatusCode, header};
use axum::response::{IntoResponse, Response};
use metrics::counter;
use serde::Serialize;
use toothwave_solver::drive::DriveError;
use toothwave_solver::violation::{Misfit, Violation};
use toothwave_solver::{Contact, Parameter, Part, SolveError};
use utoipa::ToSchema;

use crate::json::{self, Fault, ReadError};

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
    pub title: String,
    /// HTTP status.
    #[schema(minimum = 400, maximum = 599)]
    pub status: u16,
    /// What happened, and what to do about it.
    pub detail: String,
    /// The kind of problem, a stable word.
    pub code: ProblemCode,
    /// Where fields are at fault: each of them.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    #[schema(required = false)]
    pub errors: Vec<FieldError>,
}

/// A field at fault.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
pub struct FieldError {
    /// JSON pointer (RFC 6901) to the field.
    pub pointer: String,
    /// The kind of fault, a stable word.
    pub code: FieldCode,
    /// What is wrong and what would be right.
    pub detail: String,
    /// The field's value, where it is a number.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    pub value: Option<f64>,
    /// The limit that the value is beyond, or, of a number of teeth, the nearest one that would do.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    pub limit: Option<f64>,
}

/// Kinds of problem.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum ProblemCode {
    /// 400: the body is no JSON.
    MalformedJson,
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
    /// 422: JSON of another form than the design document's.
    InvalidDocument,
    /// 422: values that no drive, load or request can have.
    ImpossibleDesign,
    /// 422: at some input angle no tooth has a lever arm.
    NoToothInMesh,
    /// 422: a `projection` whose stiffnesses give a tooth a compliance that is not positive.
    ComplianceNotPositive,
    /// 422: the sweep has more states than `max_states`.
    TooManyStates,
    /// 422: the profiles have more points than `max_profile_points`.
    TooManyPoints,
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
    /// 500: a fault of the service itself.
    InternalError,
}

/// Kinds of fault of a field.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum FieldCode {
    /// A field that the document does not know.
    UnknownField,
    /// A required field that is not there.
    MissingField,
    /// The same field twice.
    DuplicateField,
    /// A value of another type.
    WrongType,
    /// A word that is not one of the choices.
    UnknownChoice,
    /// A number that no double can hold.
    NumberTooLarge,
    /// Two fields of which only one may be there.
    ConflictingFields,
    /// A value outside its range.
    OutOfRange,
    /// The semi-major axis does not exceed the semi-minor one.
    CamNotElongated,
    /// The wave generator is too small for its stroke.
    CamTooSmall,
    /// Carrier and ring do not differ by a tooth for each lobe.
    ToothDifference,
    /// Installed teeth that do not divide the theoretical ones.
    InstalledNoDivisor,
    /// A groove that is no wider than the ball in it.
    GrooveTooTight,
    /// A flat as long as the tooth is thick.
    FlatTooLong,
    /// Neighbouring teeth touch somewhere on their path.
    TeethTouch,
    /// The ring's tips reach in to the wave generator.
    NoCarrierAnnulus,
    /// The bore takes the whole flank away.
    BoreLeavesNoFlank,
    /// A clearance under `projection` that would load a tooth instead of freeing it.
    ClearanceNotMonotone,
    /// The ring's outer radius does not exceed its root radius.
    RingWithoutRim,
    /// The carrier's inner radius does not exceed the semi-major axis.
    CarrierMeetsCam,
    /// The carrier's outer radius reaches the ring's tips.
    CarrierMeetsRing,
    /// The carrier's outer radius does not exceed its inner one.
    CarrierWithoutWall,
    /// The slots run into each other all the way to the carrier's outer radius.
    SlotsTakeCarrier,
    /// The wave generator's bore cuts it open.
    BoreTakesCam,
    /// The wave generator's clearance gives it a cusp.
    ClearanceTakesCam,
    /// The teeth's clearance reaches their radius.
    ClearanceTakesTooth,
    /// More states than `max_states`.
    TooManyStates,
    /// More profile points than `max_profile_points`.
    TooManyPoints,
}

impl ProblemCode {
    /// Its HTTP status.
    pub const fn status(self) -> StatusCode {
        match self {
            Self::MalformedJson | Self::InvalidQuery => StatusCode::BAD_REQUEST,
            Self::Unauthorized => StatusCode::UNAUTHORIZED,
            Self::NotFound => StatusCode::NOT_FOUND,
            Self::MethodNotAllowed => StatusCode::METHOD_NOT_ALLOWED,
            Self::NotAcceptable => StatusCode::NOT_ACCEPTABLE,
            Self::RequestTimeout => StatusCode::REQUEST_TIMEOUT,
            Self::BodyTooLarge => StatusCode::PAYLOAD_TOO_LARGE,
            Self::UnsupportedMediaType => StatusCode::UNSUPPORTED_MEDIA_TYPE,
            Self::InvalidDocument
            | Self::ImpossibleDesign
            | Self::NoToothInMesh
            | Self::ComplianceNotPositive
            | Self::TooManyStates
            | Self::TooManyPoints => StatusCode::UNPROCESSABLE_ENTITY,
            Self::QueueFull
            | Self::DeadlineExceeded
            | Self::ShuttingDown
            | Self::TooManyConnections
            | Self::TooManyUnreadBytes => StatusCode::SERVICE_UNAVAILABLE,
            Self::InternalError => StatusCode::INTERNAL_SERVER_ERROR,
        }
    }

    const fn title(self) -> &'static str {
        match self {
            Self::MalformedJson => "The body is no JSON",
            Self::InvalidQuery => "The query is not one of this path",
            Self::Unauthorized => "A key is wanted",
            Self::NotFound => "Nothing stands at this path",
            Self::MethodNotAllowed => "The path knows other methods",
            Self::NotAcceptable => "No representation that the client accepts",
            Self::RequestTimeout => "The body did not arrive in time",
            Self::BodyTooLarge => "The body is too large",
            Self::UnsupportedMediaType => "The body is not sent as plain JSON",
            Self::InvalidDocument => "The document is no design document",
            Self::ImpossibleDesign => "Values that no design can have",
            Self::NoToothInMesh => "At some input angle no tooth carries load",
            Self::ComplianceNotPositive => "The projection form has no solution",
            Self::TooManyStates => "The sweep has too many states",
            Self::TooManyPoints => "The profiles have too many points",
            Self::QueueFull => "The service is full",
            Self::DeadlineExceeded => "The deadline stopped the computation",
            Self::ShuttingDown => "The service is stopping",
            Self::TooManyConnections => "Too many connections are open",
            Self::TooManyUnreadBytes => "Clients have too many bytes of answers to read",
            Self::InternalError => "The service failed",
        }
    }
}

impl Problem {
    /// A problem without fields.
    pub fn new(code: ProblemCode, detail: impl Into<String>) -> Self {
        Self::at_fields(code, detail, Vec::new())
    }

    /// A problem of these fields.
    pub fn at_fields(code: ProblemCode, detail: impl Into<String>, errors: Vec<FieldError>) -> Self {
        Self {
            kind: format!("urn:toothwave:problem:{}", json::word(&code)),
            title: code.title().into(),
            status: code.status().as_u16(),
            detail: detail.into(),
            code,
            errors,
        }
    }

    /// All violations of a design.
    pub fn impossible(violations: &[Violation]) -> Self {
        let errors: Vec<_> = violations.iter().map(field_error).collect();
        let detail = match errors.as_slice() {
            [only] => format!("{}: {}", only.pointer, only.detail),
            several => format!("{} values are impossible; `errors` names each", several.len()),
        };
        Self::at_fields(ProblemCode::ImpossibleDesign, detail, errors)
    }

    /// What the service could answer but does not take on now, or not for everybody; counted by its code.
    pub fn refusal(code: ProblemCode, detail: impl Into<String>) -> Self {
        counter!("toothwave_refusals_total", "reason" => json::word(&code)).increment(1);
        Self::new(code, detail)
    }

    /// A panic, logged with its text.
    pub fn panicked(panic: &(dyn Any + Send)) -> Self {
        let text = panic.downcast_ref::<String>().map(String::as_str);
        let text = text.or_else(|| panic.downcast_ref::<&str>().copied()).unwrap_or("without a text");
        Self::internal(&format_args!("a panic: {text}"))
    }

    /// An internal fault, logged here once; the client learns only that there was one.
    pub fn internal(cause: &dyn std::fmt::Display) -> Self {
        tracing::error!(%cause, "internal error");
        Self::new(ProblemCode::InternalError, "the service failed at this request; its log says why")
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
        response
    }
}

impl From<ReadError> for Problem {
    fn from(error: ReadError) -> Self {
        match error {
            ReadError::Malformed { detail } => Self::new(ProblemCode::MalformedJson, detail),
            ReadError::Fault(fault) => fault.into(),
        }
    }
}

impl From<Fault> for Problem {
    fn from(Fault { pointer, code, detail }: Fault) -> Self {
        let text = if pointer.is_empty() { detail.clone() } else { format!("{pointer}: {detail}") };
        let error = FieldError { pointer, code, detail, value: None, limit: None };
        Self::at_fields(ProblemCode::InvalidDocument, text, vec![error])
    }
}

impl From<DriveError> for Problem {
    fn from(error: DriveError) -> Self {
        match error {
            DriveError::Impossible(violations) => Self::impossible(&violations),
            DriveError::NotConverged(error) => Self::internal(&error),
        }
    }
}

impl From<SolveError> for Problem {
    fn from(error: SolveError) -> Self {
        let detail = error.to_string();
        match error {
            SolveError::NoToothInMesh { .. } => Self::new(
                ProblemCode::NoToothInMesh,
                format!("{detail}. Install more teeth, or lengthen the flank: less undercut, a smaller bore"),
            ),
            SolveError::ComplianceNotPositive { .. } => Self::new(
                ProblemCode::ComplianceNotPositive,
                format!("{detail}. Choose `virtual_work`, or stiffnesses that differ less"),
            ),
            SolveError::TooManyPoints { points, limit } => {
                let detail = format!("{detail} by `max_profile_points`; widen the chord tolerance");
                let pointer = "/profile/chord_tolerance_mm";
                too_many(ProblemCode::TooManyPoints, FieldCode::TooManyPoints, pointer, &detail, Some(points), limit)
            }
            SolveError::TooManyStates { limit } => {
                let detail = format!("{detail} by `max_states`; widen the tolerance");
                let pointer = "/sweep/tolerance";
                too_many(ProblemCode::TooManyStates, FieldCode::TooManyStates, pointer, &detail, None, limit)
            }
            SolveError::Stopped => {
                Self::new(ProblemCode::DeadlineExceeded, "the computation took longer than the service allows")
            }
            SolveError::NotConverged(error) => Self::internal(&error),
        }
    }
}

/// The problem of a request that is larger than a limit, which it names with its own value, where that is known.
#[expect(clippy::cast_precision_loss, reason = "counts far below 2^53")]
pub fn too_many(
    code: ProblemCode,
    field_code: FieldCode,
    pointer: &str,
    detail: &str,
    value: Option<u64>,
    limit: u64,
) -> Problem {
    let error = FieldError {
        pointer: pointer.into(),
        code: field_code,
        detail: detail.into(),
        value: value.map(|value| value as f64),
        limit: Some(limit as f64),
    };
    Problem::at_fields(code, detail, vec![error])
}

/// A violation as the field that it is about.
fn field_error(violation: &Violation) -> FieldError {
    use Parameter::{InstalledTeeth, RingTeeth, SemiMajor, TipRadius, ToothRadius};
    let (code, parameter, value, limit) = match *violation {
        Violation::OutOfRange { parameter, value, limit } => (FieldCode::OutOfRange, parameter, value, limit),
        Violation::CamNotElongated { semi_major_mm, semi_minor_mm } => {
            (FieldCode::CamNotElongated, SemiMajor, semi_major_mm, semi_minor_mm)
        }
        Violation::CamTooSmall { parameter, radius_mm, least_mm } => {
            (FieldCode::CamTooSmall, parameter, radius_mm, least_mm)
        }
        Violation::GrooveTooTight { contact, groove_radius_mm, tooth_radius_mm } => {
            (FieldCode::GrooveTooTight, Parameter::GrooveRadius(contact), groove_radius_mm, tooth_radius_mm)
        }
        Violation::FlatTooLong { flat_length_mm, tooth_diameter_mm } => {
            (FieldCode::FlatTooLong, Parameter::FlatLength, flat_length_mm, tooth_diameter_mm)
        }
        Violation::ToothDifference { ring_teeth, instead, .. } => {
            (FieldCode::ToothDifference, RingTeeth, ring_teeth as f64, instead.nearest_to(ring_teeth) as f64)
        }
        Violation::InstalledNoDivisor { installed, instead, .. } => {
            (FieldCode::InstalledNoDivisor, InstalledTeeth, installed as f64, instead.nearest_to(installed) as f64)
        }
        Violation::TeethTouch { tooth_diameter_mm, touching_radius_mm, .. } => {
            (FieldCode::TeethTouch, ToothRadius, 0.5 * tooth_diameter_mm, touching_radius_mm)
        }
        Violation::NoCarrierAnnulus { parameter, value_mm, limit_mm, .. } => {
            (FieldCode::NoCarrierAnnulus, parameter, value_mm, limit_mm)
        }
        Violation::ClearanceNotMonotone { contact, clearance_um } => {
            (FieldCode::ClearanceNotMonotone, Parameter::Clearance(contact), clearance_um, 0.0)
        }
        Violation::BoreLeavesNoFlank { tip_radius_mm, root_radius_mm } => {
            (FieldCode::BoreLeavesNoFlank, TipRadius, tip_radius_mm, root_radius_mm)
        }
        Violation::PartDoesNotFit { misfit, value, limit } => {
            let code = match misfit {
                Misfit::RingWithoutRim => FieldCode::RingWithoutRim,
                Misfit::CarrierMeetsCam => FieldCode::CarrierMeetsCam,
                Misfit::CarrierMeetsRing => FieldCode::CarrierMeetsRing,
                Misfit::CarrierWithoutWall => FieldCode::CarrierWithoutWall,
                Misfit::SlotsTakeCarrier => FieldCode::SlotsTakeCarrier,
                Misfit::BoreTakesCam => FieldCode::BoreTakesCam,
                Misfit::ClearanceTakesCam => FieldCode::ClearanceTakesCam,
                Misfit::ClearanceTakesTooth => FieldCode::ClearanceTakesTooth,
            };
            (code, misfit.parameter(), value, limit)
        }
    };
    FieldError {
        pointer: pointer(parameter),
        code,
        detail: violation.to_string(),
        value: Some(value),
        limit: Some(limit),
    }
}

/// Where a parameter stands in the design document.
pub fn pointer(parameter: Parameter) -> String {
    match parameter {
        Parameter::SemiMajor => "/drive/wave_generator/semi_major_mm".into(),
        Parameter::SemiMinor => "/drive/wave_generator/semi_minor_mm".into(),
        Parameter::EccentricRadius => "/drive/wave_generator/radius_mm".into(),
        Parameter::Eccentricity => "/drive/wave_generator/eccentricity_mm".into(),
        Parameter::Lobes => "/drive/wave_generator/lobes".into(),
        Parameter::MeanRadius => "/drive/wave_generator/mean_radius_mm".into(),
        Parameter::MeanPathRadius => "/drive/wave_generator/mean_path_radius_mm".into(),
        Parameter::Amplitude => "/drive/wave_generator/amplitude_mm".into(),
        Parameter::ToothCount => "/drive/teeth/count".into(),
        Parameter::InstalledTeeth => "/drive/teeth/installed".into(),
        Parameter::ToothRadius => "/drive/teeth/radius_mm".into(),
        Parameter::ToothWidth => "/drive/teeth/width_mm".into(),
        Parameter::GrooveRadius(contact) => format!("/drive/teeth/groove_radius_mm/{}", contact_name(contact)),
        Parameter::FlatLength => "/drive/teeth/flat_length_mm".into(),
        Parameter::RingTeeth => "/drive/ring/teeth".into(),
        Parameter::TipRadius => "/drive/ring/tip_radius_mm".into(),
        Parameter::YoungsModulus(part) => format!("/materials/{}/youngs_modulus_gpa", part_name(part)),
        Parameter::PoissonsRatio(part) => format!("/materials/{}/poissons_ratio", part_name(part)),
        Parameter::InputTorque => "/load/input_torque_nm".into(),
        Parameter::OutputTorque => "/load/output_torque_nm".into(),
        Parameter::Stiffness(contact) => format!("/model/stiffness/{}_n_per_mm", contact_name(contact)),
        Parameter::Clearance(contact) => format!("/model/clearance/{}_um", contact_name(contact)),
        Parameter::AllowableStress => "/load/allowable_stress_mpa".into(),
        Parameter::Samples => "/sweep/samples".into(),
        Parameter::RequestedError => "/accuracy/requested_error".into(),
        Parameter::SweepTolerance => "/sweep/tolerance".into(),
        Parameter::ChordTolerance => "/profile/chord_tolerance_mm".into(),
        Parameter::RingOuterRadius => "/parts/ring/outer_radius_mm".into(),
        Parameter::CarrierInnerRadius => "/parts/carrier/inner_radius_mm".into(),
        Parameter::CarrierOuterRadius => "/parts/carrier/outer_radius_mm".into(),
        Parameter::BoreRadius => "/parts/wave_generator/bore_radius_mm".into(),
        Parameter::PartClearance(part) => format!("/parts/{}/clearance_um", part_name(part)),
        Parameter::InputAngle => "/assembly/input_angle_deg".into(),
    }
}

/// A part as documents spell it.
pub const fn part_name(part: Part) -> &'static str {
    match part {
        Part::WaveGenerator => "wave_generator",
        Part::Teeth => "teeth",
        Part::Ring => "ring",
        Part::Carrier => "carrier",
    }
}

/// A contact as documents spell it.
pub const fn contact_name(contact: Contact) -> &'static str {
    match contact {
        Contact::WaveGenerator => "wave_generator",
        Contact::Ring => "ring",
        Contact::Carrier => "carrier",
    }
}
