//! Documents of earlier versions, without their deprecated fields.

use serde::{Serialize, Serializer};
use toothwave_solver::drive::Draft;
use toothwave_solver::{Contact, model_error};

use crate::design::{DEPRECATED_SWITCHES, Design};
use crate::field::FieldError;
use crate::json::{self, Tree};
use crate::no_answer::NoAnswer;

/// The design document that means the same without deprecated fields.
pub fn converted(text: &[u8]) -> Result<String, NoAnswer> {
    let mut tree = json::tree(text)?;
    convert_design(&mut tree)?;
    written(&tree)
}

/// Returns a document as people write it: indented, whole numbers without a point. Fails if a number is not finite.
pub fn written(tree: &Tree) -> Result<String, NoAnswer> {
    serde_json::to_string_pretty(&Written(tree)).map_err(NoAnswer::internal)
}

fn number(tree: &Tree, names: &[&str]) -> f64 {
    match tree.at(names) {
        Some(Tree::Number(number)) => *number,
        _ => 0.0,
    }
}

fn convert_design(tree: &mut Tree) -> Result<(), NoAnswer> {
    let design: Design = tree.read()?;
    design.require_one_clearance()?;
    design.require_one_choice_of_refinements()?;
    move_clearance(tree);
    if design.deprecated_fields().iter().any(|field| DEPRECATED_SWITCHES.contains(field)) {
        let draft = Draft::new(&design.drive_parameters())?;
        let drive = draft.drive().ok_or_else(|| NoAnswer::impossible(&design.as_written(draft.violations())))?;
        let has_pointed_tips = model_error::has_pointed_tips(&drive);
        for path in DEPRECATED_SWITCHES.into_iter().filter_map(json::path) {
            tree.remove(&path);
        }
        let by_default: Design = tree.read()?;
        let refinements = design.refinements(has_pointed_tips);
        if by_default.refinements(has_pointed_tips) != refinements {
            let text = serde_json::to_vec(&refinements).map_err(NoAnswer::internal)?;
            tree.set(&["model", "refinements"], json::tree(&text)?);
        }
    }
    remove_if_empty(tree, "model");
    Ok(())
}

/// Gives the gaps of `model.clearance` to the parts that teeth touch there, unless the parts have them.
fn move_clearance(tree: &mut Tree) {
    let teeth_um = number(tree, &["parts", "teeth", "clearance_um"]);
    for contact in Contact::all().map(|contact| contact.to_string()) {
        let gap_um = number(tree, &["model", "clearance", &format!("{contact}_um")]);
        let part = ["parts", &contact, "clearance_um"];
        if gap_um != 0.0 && number(tree, &part) + teeth_um == 0.0 {
            tree.set(&part, Tree::Number(gap_um));
        }
    }
    tree.remove(&["model", "clearance"]);
}

fn remove_if_empty(tree: &mut Tree, name: &str) {
    if matches!(tree.at(&[name]), Some(Tree::Object(fields)) if fields.is_empty()) {
        tree.remove(&[name]);
    }
}

/// Moves the gaps of `model.clearance` in the base of a study that does not contradict itself. Fails if the base has a
/// switch of refinements: they depend on the geometry, which may vary.
pub fn convert_base(base: &mut Tree) -> Result<(), FieldError> {
    let is_in = |pointer: &str| json::path(pointer).is_some_and(|path| base.at(&path).is_some());
    if let Some(switch) = DEPRECATED_SWITCHES.into_iter().find(|switch| is_in(switch)) {
        return Err(no_replacement(switch));
    }
    move_clearance(base);
    remove_if_empty(base, "model");
    Ok(())
}

/// Returns the pointer of the field that replaces a deprecated one, or the pointer itself. Fails if the field is a
/// switch of refinements.
pub fn converted_pointer(pointer: &str) -> Result<String, FieldError> {
    if let Some(switch) = DEPRECATED_SWITCHES.into_iter().find(|&switch| switch == pointer) {
        return Err(no_replacement(switch));
    }
    let contact = pointer.strip_prefix("/model/clearance/").and_then(|name| name.strip_suffix("_um"));
    Ok(contact.map_or_else(|| pointer.into(), |contact| format!("/parts/{contact}/clearance_um")))
}

fn no_replacement(switch: &str) -> FieldError {
    let detail = "what takes its place depends on the geometry, which may vary; choose `model.refinements` instead";
    FieldError::conflict(switch, detail)
}

struct Written<'a>(&'a Tree);

impl Serialize for Written<'_> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        const MOST: f64 = (1_u64 << f64::MANTISSA_DIGITS) as f64;
        match self.0 {
            #[expect(clippy::cast_possible_truncation, reason = "whole, and below 2^53")]
            Tree::Number(number) if number.fract() == 0.0 && number.abs() < MOST => {
                serializer.serialize_i64(*number as i64)
            }
            Tree::Array(items) => serializer.collect_seq(items.iter().map(Written)),
            Tree::Object(fields) => serializer.collect_map(fields.iter().map(|(name, value)| (name, Written(value)))),
            other => other.serialize(serializer),
        }
    }
}
