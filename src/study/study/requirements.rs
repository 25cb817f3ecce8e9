//! What a study requires of its document before it starts.

use std::collections::HashSet;

use toothwave_calculation::coincidence_degree::CoincidenceDegree;
use toothwave_calculation::design::Design;
use toothwave_calculation::field::{FieldCode, FieldError};
use toothwave_calculation::json::{Tree, path};
use toothwave_calculation::no_answer::{NoAnswer, NoAnswerCode};
use toothwave_calculation::question::{self, Question as _};
use toothwave_calculation::sweep::Sweep;

use crate::ask::{all_named, beyond, fault};
use crate::quantity::{Needs, QUANTITIES, Quantity};
use crate::variant::{Domain, Template, Variable};

/// Checks that no object has a field twice. Otherwise one of two ranges or limits with the same name would be dropped
/// silently.
pub(super) fn require_each_field_once(tree: &Tree) -> Result<(), FieldError> {
    match tree {
        Tree::Object(fields) => {
            let mut names = HashSet::new();
            for (name, value) in fields {
                if !names.insert(name) {
                    let detail = format!("the field `{name}` is given twice. Remove one");
                    return Err(FieldError::at("", FieldCode::DuplicateField, detail).within(name));
                }
                require_each_field_once(value).map_err(|found| found.within(name))?;
            }
            Ok(())
        }
        Tree::Array(items) => {
            let mut items = items.iter().enumerate();
            items.try_for_each(|(index, item)| {
                require_each_field_once(item).map_err(|found| found.within(&index.to_string()))
            })
        }
        Tree::Null | Tree::Bool(_) | Tree::Number(_) | Tree::Text(_) => Ok(()),
    }
}

/// Returns the quantities with these names. Without names, returns all quantities for which every document has the
/// required fields.
pub(super) fn asked_quantities(names: &[String], template: &Template) -> Result<Vec<&'static Quantity>, NoAnswer> {
    if names.is_empty() {
        let has = template.examples().map(what_it_has).min().unwrap_or(Needs::Drive);
        let known = template.examples().all(has_allowable_stress);
        let has_strength = template.examples().all(has_carrier_strength);
        let is_had = |quantity: &&Quantity| match quantity.needs {
            Needs::AllowableStress => known,
            Needs::CarrierStrength => has_strength,
            needs => needs <= has,
        };
        return Ok(QUANTITIES.iter().filter(is_had).collect());
    }
    all_named(names)
}

fn has_allowable_stress(tree: &Tree) -> bool {
    tree.at(&["load", "allowable_stress_mpa"]).is_some()
}

fn has_carrier_strength(tree: &Tree) -> bool {
    tree.at(&["load"]).and(tree.at(&["parts", "carrier", "strength"])).is_some()
}

/// True if the document sets the speed of the wave generator. Every point of a duty does.
fn has_speed(tree: &Tree) -> bool {
    [["load", "input_speed_rpm"], ["load", "duty"]].iter().any(|place| tree.at(place).is_some())
}

/// Returns the highest need that the document meets, without allowable stresses.
fn what_it_has(tree: &Tree) -> Needs {
    let has = |place: &[&str]| tree.at(place).is_some();
    match (has(&["load"]), has(&["friction"]), has_speed(tree)) {
        (false, ..) => Needs::Drive,
        (true, false, _) => Needs::Load,
        (true, true, false) => Needs::Friction,
        (true, true, true) => Needs::FrictionAndSpeed,
    }
}

/// Checks that a document has the fields that its quantities need.
pub(super) fn require_what_quantities_need(quantities: &[&'static Quantity], tree: &Tree) -> Result<(), NoAnswer> {
    for quantity in quantities {
        let needed: &[(&[&str], &str)] = match quantity.needs {
            Needs::Drive => &[],
            Needs::Load => &[(&["load"], "a load")],
            Needs::AllowableStress => {
                &[(&["load"], "a load"), (&["load", "allowable_stress_mpa"], "an allowable stress")]
            }
            Needs::CarrierStrength => {
                &[(&["load"], "a load"), (&["parts", "carrier", "strength"], "the strength of the carrier")]
            }
            Needs::Friction => &[(&["load"], "a load"), (&["friction"], "friction")],
            Needs::FrictionAndSpeed if has_speed(tree) => &[(&["friction"], "friction")],
            Needs::FrictionAndSpeed => &[
                (&["load"], "a load"),
                (&["friction"], "friction"),
                (&["load", "input_speed_rpm"], "the speed of the wave generator"),
            ],
        };
        if let Some((place, what)) = needed.iter().find(|(place, _)| tree.at(place).is_none()) {
            let detail = format!("`{}` needs {what}, but the base has none. Add it", quantity.name);
            return Err(fault(&format!("/base/{}", place.join("/")), FieldCode::MissingField, detail));
        }
    }
    Ok(())
}

/// Checks a document without computing it.
pub(super) fn check(
    quantities: &[&'static Quantity],
    document: &Tree,
    limits: &question::Limits,
) -> Result<(), NoAnswer> {
    let design = document.read::<Design>()?.normalised();
    if let Some(conflict) = design.conflict() {
        return Err(conflict.into());
    }
    let rejected = design.projection_violations();
    if !rejected.is_empty() {
        return Err(NoAnswer::impossible(&rejected));
    }
    if quantities.iter().all(|quantity| quantity.needs == Needs::Drive) {
        CoincidenceDegree.check(&design, limits).map(|_| ())
    } else {
        Sweep.check(&design, limits).map(|_| ())
    }
}

/// True if no random drive can have an answer, for any amount of deviation.
pub(super) fn is_of_every_draw(refused: &NoAnswer) -> bool {
    refused.code == NoAnswerCode::TooManyStates
        || refused.errors.iter().any(|error| error.code == FieldCode::ConflictingFields)
}

/// Checks that no study varies the gap of a contact by one field while another field sets it. At 0 the varied field would
/// count as left out.
pub(super) fn require_one_field_of_each_gap(template: &Template) -> Result<(), NoAnswer> {
    let is_set = |pointer: &String| {
        let path = path(pointer).unwrap_or_default();
        let is_gap = |example: &Tree| matches!(example.at(&path), Some(Tree::Number(gap_um)) if *gap_um != 0.0);
        template.is_varied(pointer) || template.examples().any(is_gap)
    };
    for contact in ["wave_generator", "ring", "carrier"] {
        let deprecated = vec![format!("/model/clearance/{contact}_um")];
        let of_parts = vec![format!("/parts/{contact}/clearance_um"), "/parts/teeth/clearance_um".into()];
        for (fields, others) in [(&of_parts, &deprecated), (&deprecated, &of_parts)] {
            let varied = fields.iter().find(|pointer| template.is_varied(pointer));
            if let (Some(varied), Some(other)) = (varied, others.iter().find(|pointer| is_set(pointer))) {
                let detail = format!("`{other}` sets the same gap. Remove one");
                return Err(fault(&template.blamed(varied), FieldCode::ConflictingFields, detail));
            }
        }
    }
    Ok(())
}

/// Checks that every range of a free number overlaps the allowed range of its field.
pub(super) fn require_possible_ranges(
    quantities: &[&'static Quantity],
    template: &Template,
    limits: &question::Limits,
) -> Result<(), NoAnswer> {
    let errors_of =
        |example: &Tree| check(quantities, example, limits).err().map_or_else(Vec::new, |refused| refused.errors);
    // A range is impossible if its largest value is too small or its smallest value too large.
    for (end, is_below) in [("max", true), ("min", false)] {
        let value = |variable: &Variable| match variable.domain {
            Domain::Real { min, max } | Domain::Whole { min, max } => Some(if is_below { max } else { min }),
            Domain::OneOf(_) => None,
        };
        let is_outside = |error: &FieldError, pointer: &str, value: f64| {
            error.pointer == pointer
                && error.code == FieldCode::OutOfRange
                && error.limit.is_some_and(|limit| (value < limit) == is_below)
        };
        // All variables at once, because there may be thousands. Then each reported one alone.
        for example in template.examples_at(value) {
            for error in errors_of(&example) {
                let free = template.variables().iter().enumerate();
                let mut free = free.filter(|(_, variable)| variable.pointer == error.pointer);
                let Some((index, variable)) = free.next() else { continue };
                let Some(value) = value(variable).filter(|&value| is_outside(&error, &variable.pointer, value)) else {
                    continue;
                };
                let Some(alone) = template.example_at(index, value) else { continue };
                let errors = errors_of(&alone);
                let found = errors.iter().find(|error| is_outside(error, &variable.pointer, value));
                if let Some(FieldError { detail, limit, .. }) = found
                    && !OF_THE_DRIVE.contains(&variable.pointer.as_str())
                {
                    let at = format!("{}/{end}", template.blamed(&variable.pointer));
                    return Err(beyond(&at, FieldCode::OutOfRange, detail, value, limit.unwrap_or(value)));
                }
            }
        }
    }
    Ok(())
}

/// Checks that a document has the right form for all values, and that the base's own numbers are in range.
pub(super) fn require_possible_base(
    quantities: &[&'static Quantity],
    template: &Template,
    example: &Tree,
    limits: &question::Limits,
) -> Result<(), NoAnswer> {
    let Err(mut refused) = check(quantities, example, limits) else { return Ok(()) };
    if refused.code != NoAnswerCode::InvalidDocument {
        refused.errors.retain(|error| is_of_base(template, example, error));
        let Some(error) = refused.errors.first() else { return Ok(()) };
        refused.detail = format!("{}: {}", error.pointer, error.detail);
    }
    for error in &mut refused.errors {
        let blamed = template.blamed(&error.pointer);
        refused.detail = refused.detail.replacen(&error.pointer, &blamed, 1);
        error.pointer = blamed;
    }
    Err(refused)
}

/// Field whose range depends on the rest of the drive.
const OF_THE_DRIVE: [&str; 1] = ["/modification/ring_tip_relief/start_deg"];

/// True if every variant has this error: a value out of range, or values that contradict each other.
fn is_of_base(template: &Template, example: &Tree, error: &FieldError) -> bool {
    let stands = path(&error.pointer).and_then(|path| example.at(&path));
    match error.code {
        FieldCode::OutOfRange => match stands {
            Some(Tree::Number(_)) => {
                !template.is_varied(&error.pointer) && !OF_THE_DRIVE.contains(&error.pointer.as_str())
            }
            // For a list the error is about its sum or its length.
            Some(Tree::Array(_)) => !template.varies_within(&[&error.pointer]),
            _ => false,
        },
        // What `projection` rejects depends on the model, whose default law follows the teeth.
        FieldCode::ConflictingFields if error.pointer.starts_with("/model/") => {
            !template.varies_within(&["/model", "/drive/teeth/shape"])
        }
        FieldCode::ConflictingFields => !template.varies_within(&[
            "/drive",
            "/load",
            "/model",
            "/modification",
            "/deviations",
            "/friction",
            "/parts",
        ]),
        FieldCode::WrongLength => !template.varies_within(&["/drive", "/deviations"]),
        FieldCode::CamNotElongated => !template.varies_within(&["/drive/wave_generator"]),
        FieldCode::InstalledNoDivisor | FieldCode::GrooveTooTight | FieldCode::FlatTooLong => {
            !template.varies_within(&["/drive/teeth"])
        }
        FieldCode::CamTooSmall
        | FieldCode::ToothDifference
        | FieldCode::TeethTouch
        | FieldCode::NoCarrierAnnulus
        | FieldCode::BoreLeavesNoFlank => !template.varies_within(&["/drive"]),
        _ => false,
    }
}
