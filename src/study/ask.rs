//! Shared parsing of study documents: errors, names of quantities, whole numbers.

pub(crate) use toothwave_calculation::field::escaped;
use toothwave_calculation::field::{FieldCode, FieldError};
use toothwave_calculation::no_answer::NoAnswer;

use crate::quantity::Quantity;

/// Returns an error of the study document.
pub(crate) fn fault(pointer: &str, code: FieldCode, detail: impl Into<String>) -> NoAnswer {
    FieldError::at(pointer, code, detail).into()
}

/// Returns an error of a value beyond a limit.
pub(crate) fn beyond(pointer: &str, code: FieldCode, detail: impl Into<String>, value: f64, limit: f64) -> NoAnswer {
    FieldError { value: Some(value), limit: Some(limit), ..FieldError::at(pointer, code, detail) }.into()
}

/// Checks that a value lies within a range, and converts it to a whole number.
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "whole, and within the range")]
pub(crate) fn whole(at: &str, value: f64, low: f64, high: f64) -> Result<u64, NoAnswer> {
    if (low..=high).contains(&value) {
        return Ok(value as u64);
    }
    let limit = if value < low { low } else { high };
    let detail = format!("{value:?} is out of range. Use a value from {low:?} to {high:?}");
    Err(beyond(at, FieldCode::OutOfRange, detail, value, limit))
}

/// Returns the index of a quantity, and appends it if it is new.
pub(crate) fn index_of(quantity: &'static Quantity, quantities: &mut Vec<&'static Quantity>) -> usize {
    quantities.iter().position(|known| *known == quantity).unwrap_or_else(|| {
        quantities.push(quantity);
        quantities.len() - 1
    })
}

/// Returns the quantities with these names, each at most once.
pub(crate) fn all_named(names: &[String]) -> Result<Vec<&'static Quantity>, NoAnswer> {
    let mut quantities = Vec::new();
    for (index, name) in names.iter().enumerate() {
        let at = format!("/quantities/{index}");
        let quantity = named(name, &at)?;
        if quantities.contains(&quantity) {
            return Err(fault(&at, FieldCode::ConflictingFields, format!("`{name}` is listed twice. Remove one")));
        }
        quantities.push(quantity);
    }
    Ok(quantities)
}

/// Returns the quantity with this name at this place of the study document.
pub(crate) fn named(name: &str, at: &str) -> Result<&'static Quantity, NoAnswer> {
    Quantity::named(name).ok_or_else(|| {
        let detail = format!("there is no quantity `{name}`. `/v1/quantities` lists all");
        fault(at, FieldCode::UnknownChoice, detail)
    })
}
