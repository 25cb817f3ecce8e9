//! Variants of a document: its free fields, their ranges, and the document with values filled in.

mod form;
mod variable;

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use form::{Form, is_within};
use toothwave_calculation::design::Design;
use toothwave_calculation::field::{FieldCode, FieldError};
use toothwave_calculation::json::{Tree, path};
use toothwave_calculation::no_answer::NoAnswer;

use crate::ask::{beyond, escaped, fault};

pub(crate) use variable::{Asked, Domain, Value, Variable};

/// Most combinations of choices. Each is a stored document.
const MOST_FORMS: usize = 256;

/// Most bytes of all these documents: some 300 000 numbers.
const MOST_FORMS_BYTES: usize = 8 << 20;

/// Most fields that a form may drop because they belong to other kinds, shapes or laws. Each costs parsing the form
/// again. No document has so many.
const MOST_LEFT_OUT: usize = 64;

/// Assumed allocation overhead of a string or a list, in bytes.
pub(crate) const GRAIN_BYTES: usize = 16;

/// Most bytes of a clone's private copies, in addition to the one that it fills.
const OWN_BYTES: usize = 1 << 18;

const RING_TEETH: [&str; 3] = ["drive", "ring", "teeth"];

const LAW: [&str; 3] = ["model", "stiffness", "law"];

/// Documents with free fields, one for each combination of choices. Clones share those that they have not filled.
#[derive(Debug, Clone)]
pub(crate) struct Template {
    /// Name of the list of variables in the study document.
    list: &'static str,
    variables: Arc<Vec<Variable>>,
    forms: Arc<Vec<Form>>,
    /// Private copies of shared forms, by index.
    own: BTreeMap<usize, Form>,
}

fn too_many_forms(list: &str) -> NoAnswer {
    let detail = format!("the lists have more than {MOST_FORMS} combinations. Use fewer values");
    fault(&format!("/{list}"), FieldCode::OutOfRange, detail)
}

impl Template {
    /// Makes the documents of a base with these free fields. `list` is their name in the study document. Fails if a
    /// document is invalid for all values, if a range is empty, or if no document has a free field.
    pub(crate) fn new(base: &Tree, free: &[(String, Asked)], list: &'static str) -> Result<Self, NoAnswer> {
        let at = |pointer: &str| format!("/{list}/{}", escaped(pointer));
        let mut paths = Vec::new();
        for (pointer, _) in free {
            let Some(path) = path(pointer) else {
                let detail = format!(
                    "`{pointer}` is not a JSON pointer into a design document. Begin it with `/`, and use at most 128 levels"
                );
                return Err(fault(&at(pointer), FieldCode::UnknownField, detail));
            };
            paths.push(path);
        }
        let above = |(pointer, _): &'_ (String, Asked)| {
            pointer.match_indices('/').skip(1).map(|(end, _)| end).collect::<Vec<_>>()
        };
        let all_above: BTreeSet<&str> =
            free.iter().flat_map(|one| above(one).into_iter().map(|end| &one.0[..end])).collect();
        let mut variables = Vec::new();
        for ((pointer, asked), path) in free.iter().zip(paths) {
            if all_above.contains(&**pointer) {
                let detail = format!("`{pointer}` is an object or a list. Name one of its fields");
                return Err(fault(&at(pointer), FieldCode::WrongType, detail));
            }
            // A strength by its name, or estimated compliances.
            if (2..path.len()).any(|depth| matches!(base.at(&path[..depth]), Some(Tree::Text(_)))) {
                let detail = format!("the base gives a word instead of the object with `{pointer}`. Give the object");
                return Err(fault(&at(pointer), FieldCode::ConflictingFields, detail));
            }
            let (domain, choices) = match asked {
                Asked::Range { min, max } => (Domain::Real { min: *min, max: *max }, Vec::new()),
                Asked::OneOf(choices) => (Domain::OneOf(choices.len()), choices.clone()),
            };
            match domain {
                Domain::Real { min, max } if min > max => {
                    let detail =
                        format!("the range is empty: `min` {min:?} is above `max` {max:?}. Use a smaller `min`");
                    return Err(beyond(&format!("{}/min", at(pointer)), FieldCode::OutOfRange, detail, min, max));
                }
                Domain::Real { min, max } if !(max - min).is_finite() => {
                    let detail = format!(
                        "the range from {min:?} to {max:?} is wider than the largest number. Use a narrower one"
                    );
                    return Err(beyond(&at(pointer), FieldCode::OutOfRange, detail, max, min));
                }
                Domain::OneOf(0) => {
                    let detail = "`one_of` is empty. Name at least one value";
                    return Err(fault(&format!("{}/one_of", at(pointer)), FieldCode::OutOfRange, detail));
                }
                _ => {}
            }
            // Checked first, because the next check compares all pairs.
            if choices.len() > MOST_FORMS {
                return Err(too_many_forms(list));
            }
            if let Some(twice) = (1..choices.len()).find(|&index| choices[..index].contains(&choices[index])) {
                let detail = "the value is listed twice. Remove one";
                return Err(fault(&format!("{}/one_of/{twice}", at(pointer)), FieldCode::ConflictingFields, detail));
            }
            variables.push(Variable { pointer: pointer.clone(), path, domain, choices });
        }
        let mut template = Self { list, variables: Arc::new(variables), forms: Arc::default(), own: BTreeMap::new() };
        let mut combinations = template.variables.iter().map(|variable| variable.choices.len().max(1));
        let combinations = combinations.try_fold(1_usize, usize::checked_mul).filter(|&count| count <= MOST_FORMS);
        let combinations = combinations.ok_or_else(|| too_many_forms(list))?;
        let bytes = combinations.saturating_mul(template.form_bytes(base));
        if combinations > 1 && bytes > MOST_FORMS_BYTES {
            let detail = format!(
                "the lists have {combinations} combinations, and their documents need {bytes} bytes. Use fewer values or a shorter base, for at most {MOST_FORMS_BYTES} bytes"
            );
            return Err(fault(&format!("/{list}"), FieldCode::OutOfRange, detail));
        }
        let mut left_out = BTreeMap::new();
        for combination in 0..combinations {
            let form = template.form(base, combination, &mut left_out).map_err(|mut found| {
                if found.code == FieldCode::MissingField {
                    found.detail = format!("{}: it is neither in the base nor in `{list}`", found.detail);
                }
                // Past the end of a list, or below a value: the error is the free field's, not the base's.
                let has_fields =
                    path(&found.pointer).is_some_and(|path| matches!(base.at(&path), Some(Tree::Object(_))));
                let leads_on = |variable: &&Variable| {
                    variable.pointer != found.pointer && is_within(&variable.pointer, &found.pointer)
                };
                let leading = template.variables.iter().find(leads_on);
                found.pointer = match leading.filter(|_| !has_fields && found.code != FieldCode::MissingField) {
                    Some(variable) => {
                        found.code = FieldCode::UnknownField;
                        found.detail =
                            format!("a document of this base has no such field within `{}`. Remove it", found.pointer);
                        at(&variable.pointer)
                    }
                    None => template.blamed(&found.pointer),
                };
                found
            })?;
            Arc::make_mut(&mut template.forms).push(form);
        }
        template.require_possible_values_above(base)?;
        let is_taken = |place: &[String]| template.forms.iter().any(|form| form.tree.at(place).is_some());
        let is_unknown = |place: &[String]| base.at(place).is_some() && !is_taken(place);
        if let Some(found) = left_out.into_iter().find_map(|(place, found)| is_unknown(&place).then_some(found)) {
            return Err(fault(&format!("/base{}", found.pointer), found.code, found.detail));
        }
        let mut of_forms = vec![Vec::new(); template.forms.len()];
        for (index, variable) in template.variables.iter().enumerate() {
            let Some(form) = template.forms.iter().position(|form| form.takes[index]) else {
                let detail = format!("no variant has the field `{}`. Remove it", variable.pointer);
                return Err(fault(&at(&variable.pointer), FieldCode::UnknownField, detail));
            };
            of_forms[form].push(index);
        }
        let variables: &mut Vec<Variable> = Arc::make_mut(&mut template.variables);
        for (form, indices) in template.forms.iter().zip(of_forms) {
            form.find_whole(variables, &indices);
        }
        for variable in template.variables.iter() {
            if let Domain::Whole { min, max } = variable.domain
                && min > max
            {
                let detail = "the range has no whole number. Widen it";
                return Err(beyond(&format!("{}/min", at(&variable.pointer)), FieldCode::OutOfRange, detail, min, max));
            }
        }
        // All numbers were whole until the types were known. From here on each form is a valid variant.
        for form in Arc::make_mut(&mut template.forms) {
            form.put_least(&template.variables);
        }
        Ok(template)
    }

    /// Checks values of the base that free fields replace, for example one stress by one for each contact. The value
    /// must be valid too.
    fn require_possible_values_above(&self, base: &Tree) -> Result<(), NoAnswer> {
        let ring_teeth = RING_TEETH.map(String::from);
        let derives = self.forms.iter().any(|form| form.derives_ring_teeth);
        let mut put_in: Vec<&[String]> = self.variables.iter().map(Variable::path).collect();
        put_in.extend(derives.then_some(&ring_teeth[..]));
        let value_above = |path: &&[String]| {
            let is_value = |length: &usize| match base.at(&path[..*length]) {
                None | Some(Tree::Object(_)) => false,
                // An existing entry of a list is a field of it.
                Some(Tree::Array(_)) => base.at(&path[..=*length]).is_none(),
                Some(_) => true,
            };
            (0..path.len()).find(is_value).map(|length| path[..length].to_vec())
        };
        let places: BTreeSet<Vec<String>> = put_in.iter().filter_map(value_above).collect();
        for place in places {
            let fields_there = |form: &&Form| matches!(form.tree.at(&place), Some(Tree::Object(_)));
            let (Some(form), Some(value)) = (self.forms.iter().find(fields_there), base.at(&place)) else { continue };
            let mut tree = form.tree.clone();
            tree.set(&place, value.clone());
            if let Err(found) = tree.read::<Design>()
                && path(&found.pointer).is_some_and(|at| at == place)
            {
                return Err(fault(&format!("/base{}", found.pointer), found.code, found.detail));
            }
        }
        Ok(())
    }

    /// Returns the place in the study document of a field of the design.
    pub(crate) fn blamed(&self, pointer: &str) -> String {
        if self.variables.iter().any(|variable| variable.pointer == pointer) {
            format!("/{}/{}", self.list, escaped(pointer))
        } else {
            format!("/base{pointer}")
        }
    }

    /// True if variants differ in the field at this pointer.
    pub(crate) fn is_varied(&self, pointer: &str) -> bool {
        let derives = self.forms.iter().any(|form| form.derives_ring_teeth);
        self.variables.iter().any(|variable| variable.pointer == pointer)
            || derives
                && path(pointer).is_some_and(|path| path == RING_TEETH)
                && self.varies_within(&["/drive/teeth/count", "/drive/wave_generator"])
    }

    /// True if variants may differ at one of these places or within it.
    pub(crate) fn varies_within(&self, places: &[&str]) -> bool {
        let varies = |variable: &&Variable| match variable.domain {
            Domain::Real { min, max } | Domain::Whole { min, max } => min < max,
            Domain::OneOf(count) => count > 1,
        };
        let is_there = |variable: &Variable| places.iter().any(|place| is_within(&variable.pointer, place));
        self.variables.iter().filter(varies).any(is_there)
    }

    /// Returns the variables of the form that these values select. There is one value for each variable.
    pub(crate) fn taken(&self, values: &[Value]) -> impl Iterator<Item = &Variable> {
        let takes = &self.forms[self.form_index(values)].takes;
        self.variables.iter().zip(takes).filter(|(_, takes)| **takes).map(|(variable, _)| variable)
    }

    pub(crate) fn variables(&self) -> &[Variable] {
        &self.variables
    }

    pub(crate) fn shared_variables(&self) -> Arc<Vec<Variable>> {
        Arc::clone(&self.variables)
    }

    /// The free fields with their values, in one form for all spellings.
    pub(crate) fn asked(&self) -> Tree {
        let values = |variable: &Variable| match variable.domain {
            Domain::Real { min, max } | Domain::Whole { min, max } => {
                Tree::Object([("min", min), ("max", max)].map(|(end, value)| (end.into(), Tree::Number(value))).into())
            }
            Domain::OneOf(_) => Tree::Array(variable.choices.clone()),
        };
        let named = |variable: &Variable| [Tree::Text(variable.pointer.clone()), values(variable)];
        Tree::Array(self.variables.iter().flat_map(named).collect())
    }

    /// Largest size of a form in bytes: the base and the filled fields.
    fn form_bytes(&self, base: &Tree) -> usize {
        /// Bytes of an object that a path creates, without its name.
        const LEVEL_BYTES: usize = 96;
        let put_in = |variable: &Variable| {
            let on_the_way: usize = variable.path.iter().map(|name| LEVEL_BYTES + name.len()).sum();
            on_the_way + variable.choices.iter().map(Tree::bytes).max().unwrap_or_default()
        };
        base.bytes() + self.variables.iter().map(put_in).sum::<usize>()
    }

    /// Estimated memory of the template in bytes.
    pub(crate) fn bytes(&self) -> usize {
        let takes = self.forms.iter().map(|form| GRAIN_BYTES + form.takes.len());
        self.forms_bytes() + takes.sum::<usize>() + self.variables.iter().map(Variable::bytes).sum::<usize>()
    }

    fn forms_bytes(&self) -> usize {
        self.examples().map(Tree::bytes).sum()
    }

    fn own_bytes(&self) -> usize {
        self.own.values().map(|form| form.tree.bytes()).sum()
    }

    /// Estimated bytes of its longest document.
    pub(crate) fn longest_bytes(&self) -> usize {
        self.examples().map(Tree::bytes).max().unwrap_or_default()
    }

    /// Makes the document of a combination of choices, with some value for each free number. Fields of the base that
    /// this combination does not have are removed.
    fn form(
        &self,
        base: &Tree,
        combination: usize,
        all_left_out: &mut BTreeMap<Vec<String>, FieldError>,
    ) -> Result<Form, FieldError> {
        let mut form = Form {
            tree: base.clone(),
            takes: vec![true; self.variables.len()],
            derives_ring_teeth: base.at(&RING_TEETH).is_none()
                && self.variables.iter().all(|variable| variable.path != RING_TEETH),
        };
        let mut rest = combination;
        for variable in self.variables.iter() {
            let value = match variable.domain {
                Domain::OneOf(count) => {
                    let chosen = variable.choices[rest % count].clone();
                    rest /= count;
                    chosen
                }
                Domain::Real { min, .. } | Domain::Whole { min, .. } => Tree::Number(min.ceil()),
            };
            form.tree.set(&variable.path, value);
        }
        let mut left_out = 0;
        loop {
            form.derive();
            if base.at(&LAW[..2]).is_none() {
                form.name_law_of_numbers();
            }
            let Err(found) = form.tree.read::<Design>() else { return Ok(form) };
            // A field of another kind, shape or law. Whether it exists at all is known after all forms are made.
            let is_of_choice = self.variables.iter().filter(|variable| !variable.choices.is_empty()).any(|variable| {
                let parent = variable.pointer.rsplit_once('/').map_or("", |(parent, _)| parent);
                found.pointer.strip_prefix(parent).is_some_and(|rest| rest.starts_with('/'))
            });
            let is_left_out = left_out < MOST_LEFT_OUT && found.code == FieldCode::UnknownField && is_of_choice;
            let place = path(&found.pointer).filter(|_| is_left_out);
            let Some(place) = place else { return Err(found) };
            left_out += 1;
            if form.tree.remove(&place).is_none() {
                return Err(found);
            }
            for (takes, variable) in form.takes.iter_mut().zip(self.variables.iter()) {
                *takes &= !variable.path.starts_with(&place);
            }
            all_left_out.entry(place).or_insert(found);
        }
    }

    /// Returns the index of the form that these choices select.
    fn form_index(&self, values: &[Value]) -> usize {
        let (mut index, mut weight) = (0, 1);
        for (variable, value) in self.variables.iter().zip(values) {
            if let (Domain::OneOf(count), Value::Choice(chosen)) = (&variable.domain, value) {
                index += weight * chosen;
                weight *= count;
            }
        }
        index
    }

    /// Returns the document with these values, one for each variable. Fields that the form does not have are skipped.
    pub(crate) fn filled(&mut self, values: &[Value]) -> &Tree {
        let index = self.form_index(values);
        let form = if Arc::strong_count(&self.forms) == 1 {
            // Sole owner: no copy.
            &mut Arc::make_mut(&mut self.forms)[index]
        } else {
            if !self.own.contains_key(&index) && self.own_bytes() + self.forms[index].tree.bytes() > OWN_BYTES {
                self.own.clear();
            }
            self.own.entry(index).or_insert_with(|| self.forms[index].clone())
        };
        for ((variable, value), takes) in self.variables.iter().zip(values).zip(&form.takes) {
            if let (Value::Number(number), true) = (value, takes) {
                form.tree.set(&variable.path, Tree::Number(*number));
            }
        }
        form.derive();
        &form.tree
    }

    /// Returns one document of each form.
    pub(crate) fn examples(&self) -> impl Iterator<Item = &Tree> {
        self.forms.iter().map(|form| &form.tree)
    }

    /// Returns a document with this value for one free number, and some value for all other fields.
    pub(crate) fn example_at(&self, index: usize, value: f64) -> Option<Tree> {
        let mut tree = self.forms.iter().find(|form| form.takes[index])?.tree.clone();
        tree.set(&self.variables[index].path, Tree::Number(value));
        Some(tree)
    }

    /// Returns a document of each form, with the given values for its free numbers.
    pub(crate) fn examples_at(&self, value: impl Fn(&Variable) -> Option<f64>) -> impl Iterator<Item = Tree> {
        self.forms.iter().map(move |form| {
            let mut form = form.clone();
            for (variable, _) in self.variables.iter().zip(&form.takes).filter(|(_, takes)| **takes) {
                if let Some(number) = value(variable) {
                    form.tree.set(&variable.path, Tree::Number(number));
                }
            }
            form.derive();
            form.tree
        })
    }

    /// Sets a value at a place in every form.
    pub(crate) fn set(&mut self, place: &[String], value: &Tree) {
        self.own.clear();
        for form in Arc::make_mut(&mut self.forms) {
            form.tree.set(place, value.clone());
        }
    }

    /// Removes a place from every form.
    pub(crate) fn remove(&mut self, place: &[String]) {
        self.own.clear();
        for form in Arc::make_mut(&mut self.forms) {
            form.tree.remove(place);
        }
    }
}
