//! Whole numbers of documents.

use serde::{Deserialize, Deserializer, Serialize, Serializer};

/// A whole number of any size, written as `28`, `28.0` or `2.8e1`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Whole(pub(super) f64);

/// Writes an integer if it is small enough for every reader to be exact.
impl Serialize for Whole {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        const MOST: f64 = (1_u64 << f64::MANTISSA_DIGITS) as f64;
        if self.0.abs() <= MOST { serializer.serialize_i64(self.count()) } else { serializer.serialize_f64(self.0) }
    }
}

impl Whole {
    /// Returns a small number, as in a document.
    pub const fn of(count: u32) -> Self {
        Self(count as f64)
    }

    /// Returns the number.
    pub const fn value(self) -> f64 {
        self.0
    }

    /// Returns the number as the solver's type. A number beyond it is beyond every range too.
    #[expect(clippy::cast_possible_truncation, reason = "whole, and saturating")]
    pub(super) const fn count(self) -> i64 {
        self.0 as i64
    }
}

impl<'de> Deserialize<'de> for Whole {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let value = f64::deserialize(deserializer)?;
        if value.fract() == 0.0 {
            Ok(Self(value))
        } else {
            let message = format_args!("a whole number is wanted here, not {value}").to_string();
            Err(serde::de::Error::custom(message))
        }
    }
}
