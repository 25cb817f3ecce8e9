//! Free fields of a search from the space that a drive may fill.

use std::collections::BTreeMap;

use toothwave_calculation::field::FieldCode;
use toothwave_calculation::json::{Tree, path};
use toothwave_calculation::no_answer::NoAnswer;
use toothwave_solver::Parameter;
use toothwave_solver::parts::RIM;

use super::{KIND, LARGEST_COUNT, LEAST_COUNT, TOOTH_COUNT};
use crate::ask::{beyond, fault};
use crate::document::{FreeDocument, RangeDocument, RequireDocument, SearchDocument};
use crate::quantity::{OUTER_DIAMETER_MM, TRANSMISSION_RATIO};
use crate::variant::{Domain, Template, Value, Variable};

/// Derives the free fields if the document names none. They are the wave generator (two lobes by default), the teeth
/// and their number, within the limits on outer diameter and transmission ratio. Fields of the base stay fixed.
pub(super) fn from_envelope(
    document: &SearchDocument,
    base: &mut Tree,
    free: &mut BTreeMap<String, FreeDocument>,
) -> Result<(), NoAnswer> {
    let range = |name: &str| match document.require.get(name) {
        Some(RequireDocument::Range(RangeDocument { min, max })) => (*min, *max),
        _ => (None, None),
    };
    let missing = |what: &str| {
        let detail = format!(
            "nothing is free, and `require` is not sufficient to derive free fields. In `require`, {what}; or name free fields with their ranges here"
        );
        fault("/free", FieldCode::MissingField, detail)
    };
    let lobes = with_wave_generator(base)?;
    let is_missing = |base: &Tree, pointer: &str| base.at(&path(pointer).unwrap_or_default()).is_none();
    if is_missing(base, TOOTH_COUNT) {
        if let Some(Tree::Number(ring_teeth)) = base.at(&path("/drive/ring/teeth").unwrap_or_default()) {
            let count = ring_teeth + lobes;
            put_in(base, &path(TOOTH_COUNT).unwrap_or_default(), Tree::Number(count));
        } else {
            let (Some(least_ratio), Some(largest_ratio)) = range(TRANSMISSION_RATIO) else {
                return Err(missing("set `min` and `max` of `transmission_ratio`"));
            };
            let (min, max) = ((lobes * least_ratio).ceil(), (lobes * largest_ratio).floor());
            if min.max(LEAST_COUNT) > max.min(LARGEST_COUNT) {
                let detail = format!(
                    "no number of teeth gives this transmission ratio with a ring of fewer teeth. The ratio is the number of teeth ({LEAST_COUNT:?} to {LARGEST_COUNT:?}) over the number of lobes ({lobes:?})"
                );
                let nearest = min.clamp(LEAST_COUNT, LARGEST_COUNT) / lobes;
                return Err(beyond("/require/transmission_ratio", FieldCode::OutOfRange, detail, least_ratio, nearest));
            }
            let range =
                FreeDocument { min: Some(min.max(LEAST_COUNT)), max: Some(max.min(LARGEST_COUNT)), one_of: None };
            free.insert(TOOTH_COUNT.into(), range);
        }
    }
    let lengths = lengths_over_root_radius(base);
    let lengths: Vec<_> = lengths.into_iter().filter(|(pointer, ..)| is_missing(base, pointer)).collect();
    if !lengths.is_empty() {
        let Some(diameter_mm) = range(OUTER_DIAMETER_MM).1 else {
            return Err(missing("set `max` of `outer_diameter_mm`"));
        };
        // Half of the outer diameter without the rim of the drawn ring.
        let root_mm = 0.5 * diameter_mm / RIM;
        let range = Parameter::ToothRadius.range();
        for &(_, least, largest) in &lengths {
            let (smallest_mm, largest_mm) = (least * root_mm, largest * root_mm);
            if let (Some(limit_mm), Some(_)) =
                (range.limit_exceeded_by(smallest_mm), range.limit_exceeded_by(largest_mm))
            {
                let scale = if limit_mm > smallest_mm { largest } else { least };
                let limit_mm = 2.0 * RIM * limit_mm / scale;
                let detail = format!(
                    "a drive with an outer diameter of {diameter_mm:?} mm has lengths outside their allowed ranges. Change this limit"
                );
                return Err(beyond(
                    "/require/outer_diameter_mm/max",
                    FieldCode::OutOfRange,
                    detail,
                    diameter_mm,
                    limit_mm,
                ));
            }
        }
        free.extend(lengths.into_iter().map(|(pointer, least, largest)| {
            let range = FreeDocument { min: Some(least * root_mm), max: Some(largest * root_mm), one_of: None };
            (pointer.to_owned(), range)
        }));
    }
    if free.is_empty() {
        let detail = "nothing is free: the base sets all fields that could be free. Remove some from the base, or name them here with their ranges";
        return Err(fault("/free", FieldCode::MissingField, detail));
    }
    Ok(())
}

/// Sets a value in the base, unless a parent is not an object. Parsing will report that.
pub(super) fn put_in(base: &mut Tree, place: &[String], value: Tree) {
    let has_fields = |length: usize| base.at(&place[..length]).is_none_or(|tree| matches!(tree, Tree::Object(_)));
    if (0..place.len()).all(has_fields) {
        base.set(place, value);
    }
}

/// Returns the number of lobes of the base's wave generator. A missing wave generator becomes a harmonic path; a
/// missing number of lobes becomes two.
pub(super) fn with_wave_generator(base: &mut Tree) -> Result<f64, NoAnswer> {
    const LOBES: &str = "/drive/wave_generator/lobes";
    const TWO: f64 = 2.0;
    const MOST: f64 = 1000.0;
    let place = |pointer: &str| path(pointer).unwrap_or_default();
    if base.at(&place("/drive/wave_generator")).is_none() {
        put_in(base, &place(KIND), Tree::Text("harmonic_path".into()));
    }
    match (word_at(base, KIND), base.at(&place(LOBES))) {
        (Some("eccentric"), _) => Ok(1.0),
        (Some(kind), Some(Tree::Number(lobes))) if kind != "ellipse" => {
            if (1.0..=MOST).contains(lobes) {
                return Ok(*lobes);
            }
            let limit = if *lobes < 1.0 { 1.0 } else { MOST };
            let detail = format!("{lobes:?} lobes are out of range. Use 1 to {MOST:?}");
            Err(beyond(&format!("/base{LOBES}"), FieldCode::OutOfRange, detail, *lobes, limit))
        }
        (Some("harmonic" | "harmonic_path"), None) => {
            put_in(base, &place(LOBES), Tree::Number(TWO));
            Ok(TWO)
        }
        // An ellipse, or a kind that parsing the base will refuse.
        _ => Ok(TWO),
    }
}

/// Returns the lengths of the base's wave generator and teeth, with their ranges over the ring's root radius.
fn lengths_over_root_radius(base: &Tree) -> Vec<(&'static str, f64, f64)> {
    let mut lengths = match word_at(base, KIND) {
        None | Some("ellipse") => {
            vec![("/drive/wave_generator/semi_major_mm", 0.3, 1.0), ("/drive/wave_generator/semi_minor_mm", 0.25, 1.0)]
        }
        Some("eccentric") => {
            vec![("/drive/wave_generator/radius_mm", 0.3, 1.0), ("/drive/wave_generator/eccentricity_mm", 0.002, 0.08)]
        }
        Some("harmonic") => vec![
            ("/drive/wave_generator/mean_radius_mm", 0.3, 1.0),
            ("/drive/wave_generator/amplitude_mm", 0.002, 0.08),
        ],
        Some("harmonic_path") => vec![
            ("/drive/wave_generator/mean_path_radius_mm", 0.4, 1.0),
            ("/drive/wave_generator/amplitude_mm", 0.002, 0.08),
        ],
        // Parsing the base refuses it.
        Some(_) => Vec::new(),
    };
    lengths.push(("/drive/teeth/radius_mm", 0.02, 0.15));
    let width = ("/drive/teeth/width_mm", 0.1, 0.6);
    match word_at(base, "/drive/teeth/shape") {
        None | Some("cylinder") => lengths.push(width),
        Some("flat_sided") => lengths.extend([width, ("/drive/teeth/flat_length_mm", 0.01, 0.2)]),
        Some(_) => {}
    }
    lengths
}

fn word_at<'a>(tree: &'a Tree, pointer: &str) -> Option<&'a str> {
    match tree.at(&path(pointer).unwrap_or_default()) {
        Some(Tree::Text(word)) => Some(word),
        _ => None,
    }
}

/// Returns the place of a design in the unit cube of the free fields.
pub(super) fn place_of(design: &Tree, template: &Template, index: usize) -> Result<Vec<f64>, NoAnswer> {
    let at = |variable: &Variable| format!("/start/{index}{}", variable.pointer);
    let mut values = Vec::new();
    let mut place = Vec::new();
    for variable in template.variables() {
        let stands = design.at(variable.path());
        let (value, share) = match (&variable.domain, stands) {
            (Domain::Real { min, max } | Domain::Whole { min, max }, Some(Tree::Number(number))) => {
                if !(*min..=*max).contains(number) {
                    let limit = if number < min { *min } else { *max };
                    let detail = format!("{number:?} is outside the free range. Use {min:?} to {max:?}");
                    return Err(beyond(&at(variable), FieldCode::OutOfRange, detail, *number, limit));
                }
                let is_whole = matches!(variable.domain, Domain::Whole { .. });
                if is_whole && number.fract() != 0.0 {
                    let detail = format!("{number:?} is not a whole number. Use a whole number");
                    return Err(fault(&at(variable), FieldCode::WrongType, detail));
                }
                let share = match (is_whole, max > min) {
                    (true, _) => (number - min + 0.5) / (max - min + 1.0),
                    (false, true) => (number - min) / (max - min),
                    (false, false) => 0.5,
                };
                (Value::Number(*number), share)
            }
            (Domain::OneOf(count), Some(chosen)) => {
                let Some(choice) = variable.choices().iter().position(|choice| choice == chosen) else {
                    let detail = "the value is not in the free list. Use a value of `one_of`";
                    return Err(fault(&at(variable), FieldCode::UnknownChoice, detail));
                };
                (Value::Choice(choice), (choice as f64 + 0.5) / *count as f64)
            }
            (Domain::Real { .. } | Domain::Whole { .. }, Some(_)) => {
                return Err(fault(&at(variable), FieldCode::WrongType, "the value is not a number. Use a number"));
            }
            // A field that the kind does not have can have any place.
            (Domain::Real { min, .. } | Domain::Whole { min, .. }, None) => (Value::Number(*min), 0.5),
            (Domain::OneOf(_), None) => {
                let detail = "the field is free, but this design has no value for it. Add a value";
                return Err(fault(&at(variable), FieldCode::MissingField, detail));
            }
        };
        values.push(value);
        place.push(share);
    }
    let missing = template.taken(&values).find(|variable| design.at(variable.path()).is_none());
    match missing {
        Some(variable) => {
            let detail = "the field is free, but this design has no value for it. Add a value";
            Err(fault(&at(variable), FieldCode::MissingField, detail))
        }
        None => Ok(place),
    }
}
