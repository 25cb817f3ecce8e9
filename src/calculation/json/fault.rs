//! What is wrong in a document, and where.

use serde::de::{self, Unexpected};

use crate::field::{FieldCode, FieldError};
use crate::no_answer::{NoAnswer, NoAnswerCode};

/// A structural error: the first one in the document.
#[derive(Debug, Clone, PartialEq)]
pub struct Fault {
    /// JSON pointer to the field.
    pub pointer: String,
    /// Kind of error.
    pub code: FieldCode,
    /// Message: what is wrong and what to do.
    pub detail: String,
}

impl Fault {
    /// Returns the same error, seen from the object that has it under `key`.
    pub fn within(mut self, key: &str) -> Self {
        self.pointer.insert_str(0, &format!("/{}", escaped(key)));
        self
    }

    /// Makes an error at this pointer.
    pub fn at(pointer: &str, code: FieldCode, detail: impl Into<String>) -> Self {
        Self { pointer: pointer.into(), code, detail: detail.into() }
    }

    /// Makes the error of fields that must not stand together.
    pub fn conflict(pointer: &str, detail: impl Into<String>) -> Self {
        Self::at(pointer, FieldCode::ConflictingFields, detail)
    }

    /// Makes the error of a field, seen from its object.
    pub fn of_field(code: FieldCode, field: &str, detail: String) -> Self {
        Self { pointer: format!("/{}", escaped(field)), code, detail }
    }
}

impl From<Fault> for NoAnswer {
    fn from(Fault { pointer, code, detail }: Fault) -> Self {
        let text = if pointer.is_empty() { detail.clone() } else { format!("{pointer}: {detail}") };
        let error = FieldError { pointer, code, detail, value: None, limit: None };
        Self::at_fields(NoAnswerCode::InvalidDocument, text, vec![error])
    }
}

/// Escapes a key for a JSON pointer (RFC 6901).
pub fn escaped(key: &str) -> String {
    key.replace('~', "~0").replace('/', "~1")
}

/// Joins names by commas.
fn listed(names: &[&str]) -> String {
    names.iter().map(|name| format!("`{name}`")).collect::<Vec<_>>().join(", ")
}

impl de::Error for Fault {
    fn custom<T: std::fmt::Display>(message: T) -> Self {
        Self { pointer: String::new(), code: FieldCode::WrongType, detail: message.to_string() }
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
        Self::of_field(FieldCode::UnknownField, field, detail)
    }

    fn missing_field(field: &'static str) -> Self {
        Self::of_field(FieldCode::MissingField, field, format!("the field `{field}` is required here"))
    }

    fn duplicate_field(field: &'static str) -> Self {
        Self::of_field(FieldCode::DuplicateField, field, format!("the field `{field}` is given twice. Remove one"))
    }

    fn unknown_variant(word: &str, known: &'static [&'static str]) -> Self {
        Self {
            pointer: String::new(),
            code: FieldCode::UnknownChoice,
            detail: format!("`{word}` is not a valid choice here. Use one of: {}", listed(known)),
        }
    }
}

impl std::fmt::Display for Fault {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}: {}", self.pointer, self.detail)
    }
}

impl std::error::Error for Fault {}
