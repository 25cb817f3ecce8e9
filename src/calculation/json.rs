//! Parser from JSON text to document types, with errors that name a code and a place.
//!
//! serde_json alone accepts an array for an object, keeps no place, and has no kinds of error. So the text first
//! becomes a tree (malformed JSON fails here). The tree then feeds serde through a deserializer with the error type
//! [`FieldError`].

mod deserializer;
mod tree;

use serde::{Deserialize, Serialize, de};

use crate::field::{FieldCode, FieldError, escaped};
use crate::no_answer::{NoAnswer, NoAnswerCode};

pub use tree::{Tree, path};

/// Byte order mark of some editors. RFC 8259 allows a reader to ignore it.
const BYTE_ORDER_MARK: &[u8] = b"\xEF\xBB\xBF";

/// Reads a document.
pub fn read<'de, T: Deserialize<'de>>(text: &[u8]) -> Result<T, NoAnswer> {
    Ok(tree(text)?.read()?)
}

/// Parses a text to a tree.
pub fn tree(text: &[u8]) -> Result<Tree, NoAnswer> {
    if matches!(text, [0xFF, 0xFE, ..] | [0xFE, 0xFF, ..] | [0, _, ..] | [_, 0, ..]) {
        // In UTF-16 every ASCII letter has a byte that is zero.
        let detail =
            "the document is UTF-16; save it as UTF-8 (in Windows PowerShell `| Out-File -Encoding utf8`, not `>`)";
        return Err(malformed(detail));
    }
    let text = text.strip_prefix(BYTE_ORDER_MARK).unwrap_or(text);
    if text.trim_ascii().is_empty() {
        return Err(malformed("the body is empty. Send a design document"));
    }
    let mut parser = serde_json::Deserializer::from_slice(text);
    let tree: Tree = serde_path_to_error::deserialize(&mut parser).map_err(|error| {
        // serde_json reports a number beyond doubles, or deep nesting, as bad syntax. If the rest is valid, the text is
        // JSON.
        let fault = match error.inner().to_string() {
            text if text.starts_with("number out of range") => {
                Some((FieldCode::NumberTooLarge, "the number is too large for a double. Use a smaller one"))
            }
            text if text.starts_with("recursion limit exceeded") => {
                Some((FieldCode::WrongType, "the document has too many nested levels. Remove some"))
            }
            _ => None,
        };
        match (fault, serde_json::from_slice::<de::IgnoredAny>(text)) {
            (Some((code, detail)), Ok(_)) => {
                let pointer = error.path().iter().filter_map(|segment| match segment {
                    serde_path_to_error::Segment::Map { key } => Some(format!("/{}", escaped(key))),
                    serde_path_to_error::Segment::Seq { index } => Some(format!("/{index}")),
                    _ => None,
                });
                FieldError::at(&pointer.collect::<String>(), code, detail).into()
            }
            (_, Err(error)) => malformed(format!("{error}. Send one complete JSON document")),
            (None, Ok(_)) => malformed(error.inner().to_string()),
        }
    })?;
    parser.end().map_err(|error| malformed(error.to_string()))?;
    Ok(tree)
}

/// Deserializes a number that may be null.
pub(crate) fn or_null<'de, D: de::Deserializer<'de>>(deserializer: D) -> Result<Option<f64>, D::Error> {
    match Tree::deserialize(deserializer)? {
        Tree::Null => Ok(None),
        number => number.read().map(Some).map_err(|fault| de::Error::custom(fault.detail)),
    }
}

fn malformed(detail: impl Into<String>) -> NoAnswer {
    NoAnswer::new(NoAnswerCode::MalformedJson, detail)
}

/// Returns a word of the API, as in JSON.
pub fn word(value: &impl Serialize) -> String {
    serde_json::to_value(value).ok().and_then(|value| Some(value.as_str()?.to_owned())).unwrap_or_default()
}
