//! Errors of fields, and the ranges of their numbers.

use serde::Serialize;
use serde::de::{self, Unexpected};
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

impl FieldError {
    /// Makes an error at this pointer.
    pub fn at(pointer: &str, code: FieldCode, detail: impl Into<String>) -> Self {
        Self { pointer: pointer.into(), code, detail: detail.into(), value: None, limit: None }
    }

    /// Makes the error of fields that must not stand together.
    pub fn conflict(pointer: &str, detail: impl Into<String>) -> Self {
        Self::at(pointer, FieldCode::ConflictingFields, detail)
    }

    /// Returns the same error, seen from the object that has it under `key`.
    pub fn within(mut self, key: &str) -> Self {
        self.pointer.insert_str(0, &format!("/{}", escaped(key)));
        self
    }
}

/// Escapes a key for a JSON pointer (RFC 6901).
pub fn escaped(key: &str) -> String {
    key.replace('~', "~0").replace('/', "~1")
}

fn listed(names: &[&str]) -> String {
    names.iter().map(|name| format!("`{name}`")).collect::<Vec<_>>().join(", ")
}

impl de::Error for FieldError {
    fn custom<T: std::fmt::Display>(message: T) -> Self {
        Self::at("", FieldCode::WrongType, message.to_string())
    }

    fn invalid_type(unexpected: Unexpected<'_>, expected: &dyn de::Expected) -> Self {
        let found = match unexpected {
            Unexpected::Unit => "null".into(),
            Unexpected::Seq => "an array".into(),
            Unexpected::Map => "an object".into(),
            Unexpected::Float(value) => format!("the number {value}"),
            Unexpected::Str(value) => format!("the text {value:?}"),
            other => other.to_string(),
        };
        let expected = match expected.to_string() {
            name if name == "f64" => "a number".into(),
            // serde's derive gives the Rust type here. Readers of the message know only objects.
            name if name.starts_with("struct ") => "an object".into(),
            name => name,
        };
        Self::custom(format_args!("the value is {found}, but {expected} is expected here"))
    }

    fn unknown_field(field: &str, known: &'static [&'static str]) -> Self {
        let known = if known.is_empty() { "no other".into() } else { listed(known) };
        let detail = format!("the field `{field}` is unknown here. Use: {known}");
        Self::at("", FieldCode::UnknownField, detail).within(field)
    }

    fn missing_field(field: &'static str) -> Self {
        Self::at("", FieldCode::MissingField, format!("the field `{field}` is required here")).within(field)
    }

    fn duplicate_field(field: &'static str) -> Self {
        let detail = format!("the field `{field}` is given twice. Remove one");
        Self::at("", FieldCode::DuplicateField, detail).within(field)
    }

    fn unknown_variant(word: &str, known: &'static [&'static str]) -> Self {
        let detail = format!("`{word}` is not a valid choice here. Use one of: {}", listed(known));
        Self::at("", FieldCode::UnknownChoice, detail)
    }
}

impl std::fmt::Display for FieldError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}: {}", self.pointer, self.detail)
    }
}

impl std::error::Error for FieldError {}

/// Returns the pointer and the range of each number of the design document, of a list's entries those of the first.
pub fn ranges() -> impl Iterator<Item = (String, Range)> {
    let with_range = |parameter: Parameter| (parameter.to_string(), parameter.range());
    Parameter::all().into_iter().map(with_range).filter(|(_, range)| range.low.is_finite())
}
