//! Limits on quantities.

use std::collections::BTreeMap;

use serde::Serialize;
use toothwave_calculation::field::FieldCode;
use toothwave_calculation::no_answer::NoAnswer;
use utoipa::ToSchema;

use crate::ask::{beyond, escaped, fault, index_of, named};
use crate::document::{RangeDocument, RequireDocument};
use crate::quantity::Quantity;

/// A limit on a quantity: one end of a range, or the required value of a flag.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Limit {
    /// Index into the quantities of the study.
    pub(crate) quantity: usize,
    pub(crate) bound: Bound,
    pub(crate) limit: f64,
}

/// Side of a limit.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum Bound {
    /// At least the limit.
    Min,
    /// At most the limit.
    Max,
    /// Required value of a flag: 1 for true, 0 for false.
    Is,
}

impl Limit {
    /// Returns the excess of a value as a fraction of the limit; 0 within the limit, 1 for an absent value.
    pub(crate) fn violation(&self, value: f64) -> f64 {
        if value.is_nan() {
            return 1.0;
        }
        let beyond = match self.bound {
            Bound::Min => self.limit - value,
            Bound::Max => value - self.limit,
            Bound::Is => (value - self.limit).abs(),
        };
        let scale = if self.limit == 0.0 { 1.0 } else { self.limit.abs() };
        // Finite, so that JSON can keep it.
        (beyond.max(0.0) / scale).min(f64::MAX)
    }

    /// True if a value is within 1 % of the limit.
    pub(crate) fn binds(&self, value: f64) -> bool {
        const HARDLY: f64 = 0.01;
        let scale = if self.limit == 0.0 { 1.0 } else { self.limit.abs() };
        self.bound != Bound::Is && (value - self.limit).abs() <= HARDLY * scale
    }
}

/// Returns the limits of a study, and appends their quantities to `quantities`.
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
                let detail = format!("`{name}` is a number. Use an object with `min` or `max`");
                return Err(fault(&at, FieldCode::WrongType, detail));
            }
            (RequireDocument::Range(_), true) => {
                let detail = format!("`{name}` is a flag and has no range. Use `true` or `false`");
                return Err(fault(&at, FieldCode::WrongType, detail));
            }
            (RequireDocument::Range(RangeDocument { min: None, max: None }), false) => {
                return Err(fault(&at, FieldCode::MissingField, "the range has no ends. Add `min` or `max`"));
            }
            (RequireDocument::Range(RangeDocument { min: Some(min), max: Some(max) }), false) if min > max => {
                let detail = format!("the range is empty: `min` {min:?} is above `max` {max:?}. Use a smaller `min`");
                return Err(beyond(&format!("{at}/min"), FieldCode::OutOfRange, detail, *min, *max));
            }
            (RequireDocument::Range(RangeDocument { min: Some(min), .. }), false) if *min > quantity.most => {
                let most = quantity.most;
                let detail = format!("no drive has a `{name}` of {min:?} or more. Use at most {most:?}");
                return Err(beyond(&format!("{at}/min"), FieldCode::OutOfRange, detail, *min, most));
            }
            (RequireDocument::Range(RangeDocument { max: Some(max), .. }), false) if *max < quantity.least => {
                let least = quantity.least;
                let detail = format!("no drive has a `{name}` of {max:?} or less. Use a value above zero");
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
