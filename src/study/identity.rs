//! Identity of a study.

use toothwave_calculation::design::Design;
use toothwave_calculation::json::Tree;
use toothwave_calculation::key::Key;
use toothwave_calculation::no_answer::NoAnswer;
use toothwave_calculation::question;

use crate::defaults::tree_of;
use crate::document::StudyDocument;
use crate::quantity::Quantity;
use crate::variant::{Domain, Template, Variable};

/// Computes the id: a hash of the question and of the limits. Order of fields, spelling of numbers and explicit
/// defaults do not change it. `resolved` are fields of the document in one form for all spellings.
pub(crate) fn id(
    document: &StudyDocument,
    template: &Template,
    quantities: &[&'static Quantity],
    resolved: Vec<(&str, Tree)>,
    limits: &question::Limits,
) -> Result<Key, NoAnswer> {
    let mut asked = tree_of(document)?;
    asked.remove(&["base"]);
    for (name, value) in resolved {
        asked.set(&[name], value);
    }
    if asked.at(&["quantities"]).is_some() {
        asked.set(
            &["quantities"],
            Tree::Array(quantities.iter().map(|quantity| Tree::Text(quantity.name.into())).collect()),
        );
    }
    // The base is hashed as the designs at both ends of all ranges. The values that the study replaces do not count.
    let spread = |variable: &Variable| match document {
        StudyDocument::Tolerance(study) => {
            study.inputs.get(&variable.pointer).and_then(|drawn| drawn.limit.or(drawn.sigma)).unwrap_or_default()
        }
        // The step of a count is a whole number at least, while its range is rounded inward.
        StudyDocument::Sensitivity(_) if matches!(variable.domain, Domain::Whole { .. }) => 1.0,
        _ => 0.0,
    };
    let end = |is_low: bool| {
        move |variable: &Variable| match variable.domain {
            Domain::Real { min, max } | Domain::Whole { min, max } => {
                Some(if is_low { min } else { max + spread(variable) })
            }
            Domain::OneOf(_) => None,
        }
    };
    let designs: Vec<_> = template.examples_at(end(true)).chain(template.examples_at(end(false))).collect();
    let draws_deviations = matches!(document, StudyDocument::Tolerance(study) if !study.deviations.is_empty());
    let is_same = |name: &str| designs.iter().all(|design| design.at(&[name]) == designs[0].at(&[name]));
    let of_drive = ["drive", "parts", "modification", "deviations", "model"];
    let is_only_drive = !draws_deviations && of_drive.into_iter().all(is_same);
    let in_one_spelling = |design: &Tree| match design.read::<Design>() {
        Ok(read) => tree_of(&read.normalised().with_defaults().in_one_spelling(is_only_drive)),
        Err(_) => Ok(design.clone()),
    };
    let mut parts = designs.iter().map(|design| hash_of(in_one_spelling(design)?)).collect::<Result<Vec<_>, _>>()?;
    parts.push(hash_of(asked)?);
    let within = format!("{} states, {} points", limits.max_states, limits.max_profile_points);
    Ok(Key::new("study", &parts.join(" ").as_str(), &within.as_str()))
}

fn hash_of(mut tree: Tree) -> Result<String, NoAnswer> {
    tree.sort();
    let text = serde_json::to_string(&tree).map_err(NoAnswer::internal)?;
    Ok(Key::new("study", &text.as_str(), &"").to_string())
}
