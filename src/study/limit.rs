//! Limits on quantities.

use std::collections::BTreeMap;

use serde::Serialize;
use toothwave_calculation::field::FieldCode;
use toothwave_calculation::no_answer::NoAnswer;
use utoipa::ToSchema;

use crate::ask::{beyond, escaped, fault, index_of, named};
use crate::document::{RangeDocument, RequireDocument};
use crate::quantity::Quantity;

/// A limit on a quantity: one end of a range, or what a flag has to be.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Limit {
    /// Which of the quantities asked for.
    pub(crate) quantity: usize,
    pub(crate) bound: Bound,
    pub(crate) limit: f64,
}

/// On which side of a limit a quantity has to be.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum Bound {
    /// At or above it.
    Min,
    /// At or below it.
    Max,
    /// Of a flag: 1 where it has to be true, 0 where it has not.
    Is,
}

impl Limit {
    /// How far a value is beyond the limit, as a share of it; 0 where it is not.
    pub(crate) fn violation(&self, value: f64) -> f64 {
        let beyond = match self.bound {
            Bound::Min => self.limit - value,
            Bound::Max => value - self.limit,
            Bound::Is => (value - self.limit).abs(),
        };
        let scale = if self.limit == 0.0 { 1.0 } else { self.limit.abs() };
        beyond.max(0.0) / scale
    }

    /// Whether a value keeps the limit, but hardly.
    pub(crate) fn binds(&self, value: f64) -> bool {
        const HARDLY: f64 = 0.01;
        let scale = if self.limit == 0.0 { 1.0 } else { self.limit.abs() };
        self.bound != Bound::Is && (value - self.limit).abs() <= HARDLY * scale
    }
}

/// The limits of a study; quantities that are not asked for yet are appended to those that are.
pub(crate) fn limits(
    require: &BTreeMap<String, RequireDocument>,
    quantities: &mut Vec<&'static Quantity>,
) -> Result<Vec<Limit>, NoAnswer> {
    let mut limits = Vec::new();
    for (name, required) in require {
        let at = format!("/require/{}", escaped(name));
        let quantity = named(name, &at)?;
        let index = index_of(quantity, quantities);
        match (required, quantity.is_flag) {
            (RequireDocument::Flag(flag), true) => {
                limits.push(Limit { quantity: index, bound: Bound::Is, limit: f64::from(u8::from(*flag)) });
            }
            (RequireDocument::Flag(_), false) => {
                let detail = format!("`{name}` is a number: give it a `min` or a `max`");
                return Err(fault(&at, FieldCode::WrongType, detail));
            }
            (RequireDocument::Range(_), true) => {
                let detail = format!("`{name}` is `true` or `false`, and has no range");
                return Err(fault(&at, FieldCode::WrongType, detail));
            }
            (RequireDocument::Range(RangeDocument { min: None, max: None }), false) => {
                return Err(fault(&at, FieldCode::MissingField, "a `min` or a `max` is required here"));
            }
            (RequireDocument::Range(RangeDocument { min: Some(min), max: Some(max) }), false) if min > max => {
                let detail = format!("the range is empty: {min:?} is above {max:?}");
                return Err(beyond(&format!("{at}/min"), FieldCode::OutOfRange, detail, *min, *max));
            }
            (RequireDocument::Range(RangeDocument { min: Some(min), .. }), false) if *min > quantity.most => {
                let most = quantity.most;
                let detail = format!("no drive has a `{name}` of {min:?} or more: it is {most:?} at most");
                return Err(beyond(&format!("{at}/min"), FieldCode::OutOfRange, detail, *min, most));
            }
            (RequireDocument::Range(RangeDocument { max: Some(max), .. }), false) if *max < quantity.least => {
                let least = quantity.least;
                let detail = format!("allow values above zero: no drive has a `{name}` of {max:?} or less");
                return Err(beyond(&format!("{at}/max"), FieldCode::OutOfRange, detail, *max, least));
            }
            (RequireDocument::Range(RangeDocument { min, max }), false) => {
                limits.extend(min.map(|limit| Limit { quantity: index, bound: Bound::Min, limit }));
                limits.extend(max.map(|limit| Limit { quantity: index, bound: Bound::Max, limit }));
            }
        }
    }
    Ok(limits)
}
