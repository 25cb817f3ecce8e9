//! A free field, its domain and its values.

use toothwave_calculation::json::Tree;

use super::GRAIN_BYTES;

/// Range of values of a free field.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Domain {
    /// Any number of a range, both ends included.
    Real {
        /// Smallest value.
        min: f64,
        /// Largest value.
        max: f64,
    },
    /// Any whole number of a range, both ends included.
    Whole {
        /// Smallest value.
        min: f64,
        /// Largest value.
        max: f64,
    },
    /// One of this many choices.
    OneOf(usize),
}

/// A free field.
#[derive(Debug, Clone)]
pub(crate) struct Variable {
    pub(crate) pointer: String,
    pub(super) path: Vec<String>,
    pub(crate) domain: Domain,
    pub(super) choices: Vec<Tree>,
}

/// Requested values of a free field: a range or a list.
#[derive(Debug, Clone)]
pub(crate) enum Asked {
    Range { min: f64, max: f64 },
    OneOf(Vec<Tree>),
}

/// The value of a free field in one variant.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Value {
    Number(f64),
    /// Index of the choice.
    Choice(usize),
}

impl Variable {
    /// Estimated memory in bytes.
    pub(super) fn bytes(&self) -> usize {
        let path = self.path.iter().map(|name| size_of::<String>() + GRAIN_BYTES + name.len());
        let choices = self.choices.iter().map(|choice| GRAIN_BYTES + choice.bytes());
        size_of::<Self>() + GRAIN_BYTES + self.pointer.len() + path.sum::<usize>() + choices.sum::<usize>()
    }

    /// Returns the value at a fraction of the domain, 0 to 1. Every whole number and every choice has an equal part.
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "below the number of choices")]
    pub(crate) fn at_share(&self, share: f64) -> Value {
        match self.domain {
            Domain::Real { min, max } => Value::Number((min + share * (max - min)).clamp(min, max)),
            Domain::Whole { min, max } => Value::Number((min + (share * (max - min + 1.0)).floor()).min(max)),
            Domain::OneOf(count) => Value::Choice(((share * count as f64) as usize).min(count - 1)),
        }
    }

    /// Path of the field in a design.
    pub(crate) fn path(&self) -> &[String] {
        &self.path
    }

    /// The choices, if it has a list.
    pub(crate) fn choices(&self) -> &[Tree] {
        &self.choices
    }

    /// Returns a value as in documents.
    pub(crate) fn spelled(&self, value: Value) -> Tree {
        match value {
            Value::Number(number) => Tree::Number(number),
            Value::Choice(chosen) => self.choices[chosen].clone(),
        }
    }
}
