//! Parser from JSON text to document types, with errors that name a code and a place.
//!
//! serde_json alone accepts an array for an object, keeps no place, and has no kinds of error. So the text first
//! becomes a tree (malformed JSON fails here). The tree then feeds serde through a deserializer with the error type
//! [`Fault`].

mod deserializer;
mod fault;
mod tree;

use fault::escaped;
use serde::{Deserialize, Serialize, de};

use crate::field::FieldCode;

pub use fault::Fault;
pub(crate) use tree::ANY;
pub use tree::{Tree, path};

/// Reason why a text is not a document of the expected form.
#[derive(Debug, Clone, PartialEq)]
pub enum ReadError {
    /// The text is not JSON.
    Malformed {
        /// Message of the parser, with line and column.
        detail: String,
    },
    /// The JSON has another form.
    Fault(Fault),
}

/// Byte order mark of some editors. RFC 8259 allows a reader to ignore it.
const BYTE_ORDER_MARK: &[u8] = b"\xEF\xBB\xBF";

/// Reads a document.
///
/// # Errors
/// See [`ReadError`].
pub fn read<'de, T: Deserialize<'de>>(text: &[u8]) -> Result<T, ReadError> {
    tree(text)?.read().map_err(ReadError::Fault)
}

/// Parses a text to a tree.
///
/// # Errors
/// See [`ReadError`].
pub fn tree(text: &[u8]) -> Result<Tree, ReadError> {
    if matches!(text, [0xFF, 0xFE, ..] | [0xFE, 0xFF, ..] | [0, _, ..] | [_, 0, ..]) {
        // In UTF-16 every ASCII letter has a byte that is zero.
        let detail =
            "the document is UTF-16; save it as UTF-8 (in Windows PowerShell `| Out-File -Encoding utf8`, not `>`)";
        return Err(ReadError::Malformed { detail: detail.into() });
    }
    let text = text.strip_prefix(BYTE_ORDER_MARK).unwrap_or(text);
    if text.trim_ascii().is_empty() {
        return Err(ReadError::Malformed { detail: "the body is empty. Send a design document".into() });
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
                ReadError::Fault(Fault { pointer: pointer.collect(), code, detail: detail.into() })
            }
            (_, Err(malformed)) => {
                ReadError::Malformed { detail: format!("{malformed}. Send one complete JSON document") }
            }
            (None, Ok(_)) => ReadError::Malformed { detail: error.inner().to_string() },
        }
    })?;
    parser.end().map_err(|error| ReadError::Malformed { detail: error.to_string() })?;
    Ok(tree)
}

/// Returns a word of the API, as in JSON.
pub fn word(value: &impl Serialize) -> String {
    serde_json::to_value(value).ok().and_then(|value| Some(value.as_str()?.to_owned())).unwrap_or_default()
}
