//! The reasons for missing answers, and the one map from the solver's errors to them.

use serde::Serialize;
use toothwave_solver::drive::DriveError;
use toothwave_solver::root::NotConverged;
use toothwave_solver::{SolveError, Violation};
use utoipa::ToSchema;

use crate::field::{FieldCode, FieldError};

/// Reason why a document has no answer.
#[derive(Debug, Clone, PartialEq)]
pub struct NoAnswer {
    /// Kind of reason.
    pub code: NoAnswerCode,
    /// Message: what is wrong, where, and what to do.
    pub detail: String,
    /// The wrong fields, at most the first 100.
    pub errors: Vec<FieldError>,
}

/// Most reported fields. An error takes a hundred times the bytes of a list entry.
const MOST_ERRORS: usize = 100;

/// Most bytes of a text in a message. A name can be as long as the document, and would be repeated many times.
const MOST_OF_A_TEXT: usize = 1000;

/// Shortens a text that is too long for a message.
pub fn clip(text: &mut String) {
    if text.len() > MOST_OF_A_TEXT {
        text.truncate(text.floor_char_boundary(MOST_OF_A_TEXT));
        text.push('…');
    }
}

/// Kinds of reason, as stable words.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum NoAnswerCode {
    /// The text is not JSON.
    MalformedJson,
    /// The JSON does not have the form of the document.
    InvalidDocument,
    /// A value is impossible for a drive, a load or a request.
    ImpossibleDesign,
    /// At some input angle no tooth carries load.
    NoToothInMesh,
    /// With these stiffnesses the `projection` form gives a tooth a compliance that is not positive.
    ComplianceNotPositive,
    /// Teeth interfere with a part.
    Interference,
    /// The sweep has more states than `max_states`.
    TooManyStates,
    /// The profiles have more points than `max_profile_points`.
    TooManyPoints,
    /// The study has more variants or bytes than the limits.
    TooManyVariants,
    /// The stop flag was set.
    Stopped,
    /// Internal error of the calculation. The detail has the cause for developers.
    InternalError,
}

impl NoAnswer {
    /// Makes a reason without fields.
    pub fn new(code: NoAnswerCode, detail: impl Into<String>) -> Self {
        Self::at_fields(code, detail, Vec::new())
    }

    /// Makes a reason with these fields.
    pub fn at_fields(code: NoAnswerCode, detail: impl Into<String>, mut errors: Vec<FieldError>) -> Self {
        for error in &mut errors {
            clip(&mut error.pointer);
            clip(&mut error.detail);
        }
        let mut detail = detail.into();
        clip(&mut detail);
        Self { code, detail, errors }
    }

    /// Makes the reason of these violations.
    pub fn impossible(violations: &[Violation]) -> Self {
        let errors: Vec<_> = violations.iter().take(MOST_ERRORS).map(FieldError::from).collect();
        let detail = match (errors.as_slice(), violations.len()) {
            ([only], _) => format!("{}: {}", only.pointer, only.detail),
            (_, several @ ..=MOST_ERRORS) => format!("{several} values are impossible. `errors` lists all of them"),
            (_, several) => format!("{several} values are impossible. `errors` lists the first {MOST_ERRORS}"),
        };
        Self::at_fields(NoAnswerCode::ImpossibleDesign, detail, errors)
    }

    /// Makes the reason of a stopped computation.
    pub fn stopped() -> Self {
        Self::new(NoAnswerCode::Stopped, "the computation was stopped")
    }

    /// Makes an internal error.
    pub fn internal(cause: impl std::fmt::Display) -> Self {
        Self::new(NoAnswerCode::InternalError, cause.to_string())
    }
}

/// Text for people. Several fields are listed one a line.
impl std::fmt::Display for NoAnswer {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self { detail, errors, .. } = self;
        f.write_str(detail)?;
        let several = if errors.len() < 2 { &[] } else { errors.as_slice() };
        several.iter().try_for_each(|error| write!(f, "\n  {error}"))
    }
}

impl std::error::Error for NoAnswer {}

/// Makes the reason of a structural error: the first one in the document.
impl From<FieldError> for NoAnswer {
    fn from(error: FieldError) -> Self {
        let detail = if error.pointer.is_empty() { error.detail.clone() } else { error.to_string() };
        Self::at_fields(NoAnswerCode::InvalidDocument, detail, vec![error])
    }
}

impl From<DriveError> for NoAnswer {
    fn from(error: DriveError) -> Self {
        match error {
            DriveError::Impossible(violations) => Self::impossible(&violations),
            DriveError::NotConverged(error) => error.into(),
        }
    }
}

impl From<NotConverged> for NoAnswer {
    fn from(error: NotConverged) -> Self {
        Self::internal(error)
    }
}

impl From<SolveError> for NoAnswer {
    fn from(error: SolveError) -> Self {
        use NoAnswerCode as Code;
        let detail = error.to_string();
        let (code, advice) = match error {
            SolveError::NoToothInMesh { .. } => (
                Code::NoToothInMesh,
                ". Install more teeth, or make the flank longer: use less undercut or a smaller bore",
            ),
            SolveError::NoLeverArm => (Code::NoToothInMesh, ""),
            SolveError::ComplianceNotPositive { .. } => {
                (Code::ComplianceNotPositive, ". Use `virtual_work`, or stiffnesses that differ less")
            }
            SolveError::Interference { .. } => (
                Code::Interference,
                ": teeth interfere with a part there. Use a larger `parts.*.clearance_um`, or smaller `modification` and `deviations`",
            ),
            SolveError::JohnsonBeyondHalfWidth { is_of_capacity: false, .. } => (Code::ImpossibleDesign, ""),
            SolveError::JohnsonBeyondHalfWidth { is_of_capacity: true, .. } => {
                (Code::ImpossibleDesign, ". Use a smaller `load.allowable_stress_mpa`, or leave it out")
            }
            SolveError::FlatOffCarrier { .. } => {
                (Code::ImpossibleDesign, ". Use longer flats, or a wider carrier (`parts.carrier`)")
            }
            SolveError::TurnedPastTeeth => (
                Code::ImpossibleDesign,
                ". Use a lower torque or smaller gaps, or remove `wave_generator_moves` from `model.refinements`",
            ),
            SolveError::TooManyPoints { points, limit } => {
                let detail = format!("{detail} by `max_profile_points`. Use a larger chord tolerance");
                let pointer = "/profile/chord_tolerance_mm";
                return too_many(Code::TooManyPoints, FieldCode::TooManyPoints, pointer, &detail, Some(points), limit);
            }
            SolveError::TooManyStates { limit } => {
                let detail = format!("{detail} by `max_states`. Use a larger tolerance");
                let pointer = "/sweep/tolerance";
                return too_many(Code::TooManyStates, FieldCode::TooManyStates, pointer, &detail, None, limit);
            }
            SolveError::Impossible(violations) => return Self::impossible(&violations),
            SolveError::Stopped => return Self::stopped(),
            SolveError::Inconsistent { .. } | SolveError::NotConverged(_) => (Code::InternalError, ""),
        };
        Self::new(code, detail + advice)
    }
}

/// Makes the reason of a request above a limit. The error has the requested value, if it is known, and the limit.
#[expect(clippy::cast_precision_loss, reason = "counts far below 2^53")]
pub(crate) fn too_many(
    code: NoAnswerCode,
    field_code: FieldCode,
    pointer: &str,
    detail: &str,
    value: Option<u64>,
    limit: u64,
) -> NoAnswer {
    let error = FieldError {
        pointer: pointer.into(),
        code: field_code,
        detail: detail.into(),
        value: value.map(|value| value as f64),
        limit: Some(limit as f64),
    };
    NoAnswer::at_fields(code, detail, vec![error])
}
