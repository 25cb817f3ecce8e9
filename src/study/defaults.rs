//! Designs with their defaults written out.

use toothwave_calculation::design::Design;
use toothwave_calculation::json::{self, Tree, path};
use toothwave_calculation::no_answer::NoAnswer;

/// Returns a design with all defaults, or the document itself if it is not a design.
pub(crate) fn complete(design: &Tree) -> Result<Tree, NoAnswer> {
    match design.read::<Design>() {
        Ok(read) => tree_of(&read.normalised().with_defaults()),
        Err(_) => Ok(design.clone()),
    }
}

/// Returns the base with the default of each number that it leaves out at these pointers, and of the law that has it.
pub(crate) fn with_defaults_at<'a>(base: &Tree, pointers: impl Iterator<Item = &'a String>) -> Result<Tree, NoAnswer> {
    let (complete, mut written) = (complete(base)?, base.clone());
    let law = ["model", "stiffness", "law"].map(String::from);
    for place in pointers.filter_map(|pointer| path(pointer)).filter(|place| base.at(place).is_none()) {
        if let Some(default @ Tree::Number(_)) = complete.at(&place) {
            written.set(&place, default.clone());
            if let (Some(name), true) = (complete.at(&law), place.starts_with(&law[..2])) {
                written.set(&law, name.clone());
            }
        }
    }
    Ok(written)
}

/// Returns a document as a tree.
pub(crate) fn tree_of(document: &impl serde::Serialize) -> Result<Tree, NoAnswer> {
    let text = serde_json::to_vec(document).map_err(NoAnswer::internal)?;
    json::tree(&text)
}
