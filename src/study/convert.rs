//! Documents of earlier versions, without their deprecated fields.

use toothwave_calculation::convert::{self, convert_base, converted_pointer, written};
use toothwave_calculation::field::FieldError;
use toothwave_calculation::json::{self, Tree, path};
use toothwave_calculation::no_answer::NoAnswer;

use crate::study::{Limits, Study};

/// Names of the lists of pointers into the design, in a study document.
const LISTS_OF_POINTERS: [&str; 3] = ["over", "free", "inputs"];

/// The document that means the same without deprecated fields, of a design or of a study. Fails if a field has no
/// replacement for all variants of a study.
pub fn converted(text: &[u8]) -> Result<String, NoAnswer> {
    let mut tree = json::tree(text)?;
    if tree.at(&["study"]).is_none() {
        return convert::converted(text);
    }
    Study::read(text, &Limits::OFFLINE)?;
    convert_study(&mut tree)?;
    written(&tree)
}

/// Converts the base, the pointers to the varied fields, and the values of these fields in the designs to start with.
fn convert_study(tree: &mut Tree) -> Result<(), FieldError> {
    let Tree::Object(fields) = tree else { return Ok(()) };
    let mut renamed = Vec::new();
    for (list, pointers) in fields.iter_mut().filter(|(name, _)| LISTS_OF_POINTERS.contains(&&**name)) {
        let Tree::Object(pointers) = pointers else { continue };
        for (pointer, _) in pointers {
            let new = converted_pointer(pointer)
                .map_err(|found| FieldError { pointer: String::new(), ..found }.within(pointer).within(list))?;
            if new != *pointer {
                renamed.push((std::mem::replace(pointer, new.clone()), new));
            }
        }
    }
    for (name, value) in fields {
        match (name.as_str(), value) {
            ("base", base) => convert_base(base).map_err(|found| found.within(name))?,
            ("start", Tree::Array(designs)) => designs.iter_mut().for_each(|design| convert_start(design, &renamed)),
            _ => {}
        }
    }
    Ok(())
}

/// Moves the values of renamed fields. A search ignores the others.
fn convert_start(design: &mut Tree, renamed: &[(String, String)]) {
    for (old, new) in renamed {
        if let (Some(old), Some(new)) = (path(old), path(new))
            && let Some(value) = design.remove(&old)
        {
            design.set(&new, value);
        }
    }
    design.remove(&["model", "clearance"]);
}
