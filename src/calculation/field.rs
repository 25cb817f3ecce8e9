//! Errors of fields, and the ranges of their numbers.

use serde::Serialize;
use toothwave_solver::Parameter;
pub use toothwave_solver::violation::FieldCode;
use toothwave_solver::violation::{Range, Violation};
use utoipa::ToSchema;

/// Error of a field.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
pub struct FieldError {
    /// JSON pointer (RFC 6901) to the field.
    pub pointer: String,
    /// Kind of error, as a stable word.
    pub code: FieldCode,
    /// Message: what is wrong and what to do.
    pub detail: String,
    /// Value of the field, if it is a number.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub value: Option<f64>,
    /// The violated limit. For a number of teeth or entries, the nearest valid number.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub limit: Option<f64>,
}

/// Converts a violation to the error of its field.
impl From<&Violation> for FieldError {
    fn from(violation: &Violation) -> Self {
        let Violation { code, parameter, value, limit, .. } = *violation;
        Self { pointer: parameter.to_string(), code, detail: violation.to_string(), value, limit }
    }
}

/// Returns the pointer and the range of each number of the design document, of a list's entries those of the first.
pub fn ranges() -> impl Iterator<Item = (String, Range)> {
    let with_range = |parameter: Parameter| (parameter.to_string(), parameter.range());
    Parameter::all().into_iter().map(with_range).filter(|(_, range)| range.low.is_finite())
}
