//! Why there is no answer, and the one map from the solver's errors to it.

use serde::Serialize;
use toothwave_solver::drive::DriveError;
use toothwave_solver::{SolveError, Violation};
use utoipa::ToSchema;

use crate::field::{FieldCode, FieldError};
use crate::json::{Fault, ReadError};

/// Why a document has no answer.
#[derive(Debug, Clone, PartialEq)]
pub struct NoAnswer {
    /// The kind of reason.
    pub code: NoAnswerCode,
    /// What happened, and what to do about it.
    pub detail: String,
    /// Where fields are at fault: each of them, of more than a hundred the first.
    pub errors: Vec<FieldError>,
}

/// So many fields at fault are named: of a list of thousands each would take a hundred times what it takes in the document.
const MOST_ERRORS: usize = 100;

/// So many bytes of a text are told: a name in a document may be as long as the document, and would stand in its problem many times.
const MOST_OF_A_TEXT: usize = 1000;

/// Ends a text that is longer than any that is meant to be read.
pub fn clip(text: &mut String) {
    if text.len() > MOST_OF_A_TEXT {
        text.truncate(text.floor_char_boundary(MOST_OF_A_TEXT));
        text.push('…');
    }
}

/// Kinds of reason, each a stable word.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum NoAnswerCode {
    /// The text is no JSON.
    MalformedJson,
    /// JSON of another form than the design document's.
    InvalidDocument,
    /// Values that no drive, load or request can have.
    ImpossibleDesign,
    /// At some input angle no tooth has a lever arm.
    NoToothInMesh,
    /// A `projection` whose stiffnesses give a tooth a compliance that is not positive.
    ComplianceNotPositive,
    /// A part is too full for a tooth that is to carry.
    Interference,
    /// The sweep has more states than `max_states`.
    TooManyStates,
    /// The profiles have more points than `max_profile_points`.
    TooManyPoints,
    /// The study has more variants, or takes more bytes, than the service admits.
    TooManyVariants,
    /// The stop signal was set.
    Stopped,
    /// A fault of the calculation itself; the detail says what, for whoever mends it.
    InternalError,
}

impl NoAnswer {
    /// A reason without fields.
    pub fn new(code: NoAnswerCode, detail: impl Into<String>) -> Self {
        Self::at_fields(code, detail, Vec::new())
    }

    /// A reason in these fields.
    pub fn at_fields(code: NoAnswerCode, detail: impl Into<String>, mut errors: Vec<FieldError>) -> Self {
        for error in &mut errors {
            clip(&mut error.pointer);
            clip(&mut error.detail);
        }
        let mut detail = detail.into();
        clip(&mut detail);
        Self { code, detail, errors }
    }

    /// The violations of a design.
    pub fn impossible(violations: &[Violation]) -> Self {
        let errors: Vec<_> = violations.iter().take(MOST_ERRORS).map(FieldError::from).collect();
        let detail = match (errors.as_slice(), violations.len()) {
            ([only], _) => format!("{}: {}", only.pointer, only.detail),
            (_, several @ ..=MOST_ERRORS) => format!("{several} values are impossible; `errors` names each"),
            (_, several) => format!("{several} values are impossible; `errors` names the first {MOST_ERRORS}"),
        };
        Self::at_fields(NoAnswerCode::ImpossibleDesign, detail, errors)
    }

    /// The stop signal was seen.
    pub fn stopped() -> Self {
        Self::new(NoAnswerCode::Stopped, "the computation was stopped")
    }

    /// A fault of the calculation itself.
    pub fn internal(cause: impl std::fmt::Display) -> Self {
        Self::new(NoAnswerCode::InternalError, cause.to_string())
    }
}

/// For people: every field at fault where there are several.
impl std::fmt::Display for NoAnswer {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self { detail, errors, .. } = self;
        f.write_str(detail)?;
        let several = if errors.len() < 2 { &[] } else { errors.as_slice() };
        several.iter().try_for_each(|error| write!(f, "\n  {}: {}", error.pointer, error.detail))
    }
}

impl std::error::Error for NoAnswer {}

impl From<ReadError> for NoAnswer {
    fn from(error: ReadError) -> Self {
        match error {
            ReadError::Malformed { detail } => Self::new(NoAnswerCode::MalformedJson, detail),
            ReadError::Fault(fault) => fault.into(),
        }
    }
}

impl From<Fault> for NoAnswer {
    fn from(Fault { pointer, code, detail }: Fault) -> Self {
        let text = if pointer.is_empty() { detail.clone() } else { format!("{pointer}: {detail}") };
        let error = FieldError { pointer, code, detail, value: None, limit: None };
        Self::at_fields(NoAnswerCode::InvalidDocument, text, vec![error])
    }
}

impl From<DriveError> for NoAnswer {
    fn from(error: DriveError) -> Self {
        match error {
            DriveError::Impossible(violations) => Self::impossible(&violations),
            DriveError::NotConverged(error) => Self::internal(error),
        }
    }
}

impl From<SolveError> for NoAnswer {
    fn from(error: SolveError) -> Self {
        let detail = error.to_string();
        match error {
            SolveError::NoToothInMesh { .. } => Self::new(
                NoAnswerCode::NoToothInMesh,
                format!("{detail}. Install more teeth, or lengthen the flank: less undercut, a smaller bore"),
            ),
            SolveError::ComplianceNotPositive { .. } => Self::new(
                NoAnswerCode::ComplianceNotPositive,
                format!("{detail}. Choose `virtual_work`, or stiffnesses that differ less"),
            ),
            SolveError::Impossible(violations) => Self::impossible(&violations),
            SolveError::Interference { .. } => Self::new(
                NoAnswerCode::Interference,
                format!(
                    "{detail}: a part is too full there. Make `parts.*.clearance_um` larger, or `modification` and `deviations` smaller"
                ),
            ),
            SolveError::JohnsonBeyondHalfWidth { is_of_capacity: false, .. } => {
                Self::new(NoAnswerCode::ImpossibleDesign, detail)
            }
            SolveError::JohnsonBeyondHalfWidth { is_of_capacity: true, .. } => Self::new(
                NoAnswerCode::ImpossibleDesign,
                format!("{detail}. Make `load.allowable_stress_mpa` smaller, or leave it out"),
            ),
            SolveError::FlatOffCarrier { .. } => Self::new(
                NoAnswerCode::ImpossibleDesign,
                format!("{detail}. Make the flats longer, or the carrier wider by `parts.carrier`"),
            ),
            SolveError::NoLeverArm => Self::new(NoAnswerCode::NoToothInMesh, detail),
            SolveError::TurnedPastTeeth => Self::new(
                NoAnswerCode::ImpossibleDesign,
                format!(
                    "{detail}. Lower the torque or close the gaps, or leave `wave_generator_moves` out of `model.refinements`"
                ),
            ),
            SolveError::TooManyPoints { points, limit } => {
                let detail = format!("{detail} by `max_profile_points`; widen the chord tolerance");
                let pointer = "/profile/chord_tolerance_mm";
                too_many(NoAnswerCode::TooManyPoints, FieldCode::TooManyPoints, pointer, &detail, Some(points), limit)
            }
            SolveError::TooManyStates { limit } => {
                let detail = format!("{detail} by `max_states`; widen the tolerance");
                let pointer = "/sweep/tolerance";
                too_many(NoAnswerCode::TooManyStates, FieldCode::TooManyStates, pointer, &detail, None, limit)
            }
            SolveError::Stopped => Self::stopped(),
            SolveError::Inconsistent { .. } => Self::internal(detail),
            SolveError::NotConverged(error) => Self::internal(error),
        }
    }
}

/// The reason of a request that is larger than a limit, which it names with its own value, where that is known.
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
