//! Ranges in the API document, from the solver's table of parameters.

use serde_json::{Value, json};

use crate::field::ranges;

/// Writes the range of each parameter to the numbers at its place in the design document, and to a list that of its
/// length. `design` is the pointer to the schema of the design document. A bound that a schema has already stays: two
/// kinds of wave generator have different ranges at one place.
pub fn put_ranges(document: &mut Value, design: &str) {
    for (pointer, range) in ranges() {
        let mut places = vec![design.to_owned()];
        for name in pointer.split('/').skip(1) {
            places = places.iter().flat_map(|place| fields(document, place, name)).collect();
        }
        let of_number = if range.closed { ["minimum", "maximum"] } else { ["exclusiveMinimum", "exclusiveMaximum"] };
        for place in places.iter().flat_map(|place| alternatives(document, place)).collect::<Vec<_>>() {
            let Some(schema) = document.pointer_mut(&place).and_then(Value::as_object_mut) else { continue };
            let bounds = match schema.get("type").map(Value::to_string) {
                Some(kind) if kind.contains("number") || kind.contains("integer") => of_number,
                Some(kind) if kind.contains("array") => ["minItems", "maxItems"],
                _ => continue,
            };
            for (bound, end) in bounds.into_iter().zip([range.low, range.high]) {
                schema.entry(bound).or_insert_with(|| number(end));
            }
        }
    }
}

/// Writes a whole number without a point.
#[expect(clippy::cast_possible_truncation, reason = "whole ends are below 2^53")]
fn number(end: f64) -> Value {
    if end.fract() == 0.0 { json!(end as i64) } else { json!(end) }
}

/// Returns the places of a schema and of all that it refers to or chooses from.
fn alternatives(document: &Value, place: &str) -> Vec<String> {
    let mut places = vec![place.to_owned()];
    let Some(schema) = document.pointer(place) else { return places };
    if let Some(reference) = schema["$ref"].as_str() {
        places.extend(alternatives(document, reference.trim_start_matches('#')));
    }
    for choice in ["oneOf", "anyOf", "allOf"] {
        let count = schema[choice].as_array().map_or(0, Vec::len);
        places.extend((0..count).flat_map(|at| alternatives(document, &format!("{place}/{choice}/{at}"))));
    }
    places
}

/// Returns the places of a field of a schema. The first entry stands for a list.
fn fields(document: &Value, place: &str, name: &str) -> Vec<String> {
    let field = if name == "0" { "items".into() } else { format!("properties/{name}") };
    let of = |place: String| format!("{place}/{field}");
    alternatives(document, place).into_iter().map(of).filter(|at| document.pointer(at).is_some()).collect()
}
