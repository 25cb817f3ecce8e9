//! Variants of a document: what is free in it, over which values, and the document with values put in.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use toothwave_calculation::design::Design;
use toothwave_calculation::field::FieldCode;
use toothwave_calculation::json::{Fault, Tree, path};
use toothwave_calculation::no_answer::NoAnswer;

use crate::ask::{beyond, escaped, fault};

/// Combinations of choices at most: each is a document of its own, which is kept.
const MOST_FORMS: usize = 256;

/// What all of them may take together: some three hundred thousand numbers.
const MOST_FORMS_BYTES: usize = 8 << 20;

/// Fields that a form may leave out because only other kinds, shapes or laws have them: each is found by reading the whole form again, and
/// all that there are have fewer.
const MOST_LEFT_OUT: usize = 64;

/// What is taken of memory comes in steps: a text or a list takes so much more than it has.
pub(crate) const GRAIN_BYTES: usize = 16;

/// What a clone's own copies take, at most, beside the one that it fills.
const OWN_BYTES: usize = 1 << 18;

const RING_TEETH: [&str; 3] = ["drive", "ring", "teeth"];

/// The values that a free field may have.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Domain {
    /// Any number of a range, both ends included.
    Real {
        /// Its least.
        min: f64,
        /// Its largest.
        max: f64,
    },
    /// Any whole number of a range, both ends included.
    Whole {
        /// Its least.
        min: f64,
        /// Its largest.
        max: f64,
    },
    /// One of several.
    OneOf(usize),
}

/// A free field.
#[derive(Debug, Clone)]
pub(crate) struct Variable {
    pub(crate) pointer: String,
    path: Vec<String>,
    pub(crate) domain: Domain,
    choices: Vec<Tree>,
}

/// What is asked of a free field: a range, or a choice.
#[derive(Debug, Clone)]
pub(crate) enum Asked {
    Range { min: f64, max: f64 },
    OneOf(Vec<Tree>),
}

/// The value of a free field in one variant.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Value {
    Number(f64),
    /// Which of the choices.
    Choice(usize),
}

/// Documents with free fields: one for each combination of choices. Clones share them, but for those that a clone has filled.
#[derive(Debug, Clone)]
pub(crate) struct Template {
    /// What the study's document calls the list of the variables.
    list: &'static str,
    variables: Arc<Vec<Variable>>,
    forms: Arc<Vec<Form>>,
    /// Copies of forms that are shared, by their index, to be filled.
    own: BTreeMap<usize, Form>,
}

#[derive(Debug, Clone)]
struct Form {
    tree: Tree,
    /// Of the variables, whether this form takes it.
    takes: Vec<bool>,
    derives_ring_teeth: bool,
}

fn too_many_forms(list: &str) -> NoAnswer {
    let detail = format!("the choices have more than {MOST_FORMS} combinations");
    fault(&format!("/{list}"), FieldCode::OutOfRange, detail)
}

impl Template {
    /// The documents of a base with these free fields, of which `list` is the name in the study's document.
    ///
    /// # Errors
    /// Where a document cannot be read, whatever the values; where a range is empty, or no document takes a free field.
    pub(crate) fn new(base: &Tree, free: &[(String, Asked)], list: &'static str) -> Result<Self, NoAnswer> {
        let at = |pointer: &str| format!("/{list}/{}", escaped(pointer));
        let mut paths = Vec::new();
        for (pointer, _) in free {
            let Some(path) = path(pointer) else {
                let detail = format!(
                    "`{pointer}` is no JSON pointer into a design document: one begins with `/`, and none leads deeper than 128 levels"
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
            let has_fields = matches!(base.at(&path), Some(Tree::Object(_) | Tree::Array(_)));
            if has_fields || all_above.contains(&**pointer) {
                let detail = format!("`{pointer}` is no value but holds fields: name one of these");
                return Err(fault(&at(pointer), FieldCode::WrongType, detail));
            }
            let (domain, choices) = match asked {
                Asked::Range { min, max } => (Domain::Real { min: *min, max: *max }, Vec::new()),
                Asked::OneOf(choices) => (Domain::OneOf(choices.len()), choices.clone()),
            };
            match domain {
                Domain::Real { min, max } if min > max => {
                    let detail = format!("the range is empty: its least value {min:?} is above its largest {max:?}");
                    return Err(beyond(&format!("{}/min", at(pointer)), FieldCode::OutOfRange, detail, min, max));
                }
                Domain::Real { min, max } if !(max - min).is_finite() => {
                    let detail =
                        format!("the range from {min:?} to {max:?} is wider than numbers go: choose a narrower one");
                    return Err(beyond(&at(pointer), FieldCode::OutOfRange, detail, max, min));
                }
                Domain::OneOf(0) => {
                    let detail = "a choice of nothing: name at least one value";
                    return Err(fault(&format!("{}/one_of", at(pointer)), FieldCode::OutOfRange, detail));
                }
                _ => {}
            }
            // Before each is compared with the others: of twelve thousand that took a second.
            if choices.len() > MOST_FORMS {
                return Err(too_many_forms(list));
            }
            if let Some(twice) = (1..choices.len()).find(|&index| choices[..index].contains(&choices[index])) {
                let detail = "it is one of the choices already";
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
                "each of the {combinations} combinations of choices is a document of its own: of this base they take {bytes} bytes, more than {MOST_FORMS_BYTES}"
            );
            return Err(fault(&format!("/{list}"), FieldCode::OutOfRange, detail));
        }
        let mut left_out = BTreeMap::new();
        for combination in 0..combinations {
            let form = template.form(base, combination, &mut left_out).map_err(|mut found| {
                if found.code == FieldCode::MissingField {
                    found.detail = format!("{}: neither the base has it nor `{list}`", found.detail);
                }
                // Beyond the end of a list, or below a value: what is put there is at fault, not what the base has.
                let has_fields =
                    path(&found.pointer).is_some_and(|path| matches!(base.at(&path), Some(Tree::Object(_))));
                let leads_on = |variable: &&Variable| {
                    variable.pointer != found.pointer && is_within(&variable.pointer, &found.pointer)
                };
                let leading = template.variables.iter().find(leads_on);
                found.pointer = match leading.filter(|_| !has_fields && found.code != FieldCode::MissingField) {
                    Some(variable) => {
                        found.code = FieldCode::UnknownField;
                        found.detail = format!("no document of this base has such a field within `{}`", found.pointer);
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
                let detail = format!("no variant takes `{}`", variable.pointer);
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
                let detail = "the range holds no whole number";
                return Err(beyond(&format!("{}/min", at(&variable.pointer)), FieldCode::OutOfRange, detail, min, max));
            }
        }
        // Until it was known which numbers are whole, any had to be: from here on each form is a variant of its own.
        for form in Arc::make_mut(&mut template.forms) {
            form.put_least(&template.variables);
        }
        Ok(template)
    }

    /// That where fields are put in the place of a value, as of one stress for all contacts, the value could have stood there too.
    fn require_possible_values_above(&self, base: &Tree) -> Result<(), NoAnswer> {
        let ring_teeth = RING_TEETH.map(String::from);
        let derives = self.forms.iter().any(|form| form.derives_ring_teeth);
        let mut put_in: Vec<&[String]> = self.variables.iter().map(Variable::path).collect();
        put_in.extend(derives.then_some(&ring_teeth[..]));
        let value_above = |path: &&[String]| {
            let is_value = |length: &usize| match base.at(&path[..*length]) {
                None | Some(Tree::Object(_)) => false,
                // An entry that is there is a field of it.
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

    /// Where in the study's document that stands which a design has at a place.
    pub(crate) fn blamed(&self, pointer: &str) -> String {
        if self.variables.iter().any(|variable| variable.pointer == pointer) {
            format!("/{}/{}", self.list, escaped(pointer))
        } else {
            format!("/base{pointer}")
        }
    }

    /// Whether variants differ in what stands at a place.
    pub(crate) fn is_varied(&self, pointer: &str) -> bool {
        let derives = self.forms.iter().any(|form| form.derives_ring_teeth);
        self.variables.iter().any(|variable| variable.pointer == pointer)
            || derives
                && path(pointer).is_some_and(|path| path == RING_TEETH)
                && self.varies_within(&["/drive/teeth/count", "/drive/wave_generator"])
    }

    /// Whether variants may differ in what stands at any of these places or within it.
    pub(crate) fn varies_within(&self, places: &[&str]) -> bool {
        let varies = |variable: &&Variable| match variable.domain {
            Domain::Real { min, max } | Domain::Whole { min, max } => min < max,
            Domain::OneOf(count) => count > 1,
        };
        let is_there = |variable: &Variable| places.iter().any(|place| is_within(&variable.pointer, place));
        self.variables.iter().filter(varies).any(is_there)
    }

    /// The variables that the form takes to which these values lead, one for each variable.
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

    /// What a form takes at most: the base, and whatever is put into it.
    fn form_bytes(&self, base: &Tree) -> usize {
        /// Of an object that is made for a name on the way, beside the name.
        const LEVEL_BYTES: usize = 96;
        let put_in = |variable: &Variable| {
            let on_the_way: usize = variable.path.iter().map(|name| LEVEL_BYTES + name.len()).sum();
            on_the_way + variable.choices.iter().map(Tree::bytes).max().unwrap_or_default()
        };
        base.bytes() + self.variables.iter().map(put_in).sum::<usize>()
    }

    /// About what the template takes in memory.
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

    /// About what its longest document takes.
    pub(crate) fn longest_bytes(&self) -> usize {
        self.examples().map(Tree::bytes).max().unwrap_or_default()
    }

    /// The document of a combination of choices, in which everything else stands at some value, and what of the base it does not know is left out.
    fn form(
        &self,
        base: &Tree,
        combination: usize,
        all_left_out: &mut BTreeMap<Vec<String>, Fault>,
    ) -> Result<Form, Fault> {
        let mut form = Form {
            tree: base.clone(),
            takes: vec![true; self.variables.len()],
            derives_ring_teeth: base.at(&RING_TEETH.map(String::from)).is_none()
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
            let Err(found) = form.tree.read::<Design>() else { return Ok(form) };
            // What another kind, shape or law has; whether one has it is known when all forms are.
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

    /// Which form the choices lead to.
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

    /// The document with these values, one for each variable. What the form does not take stays out.
    pub(crate) fn filled(&mut self, values: &[Value]) -> &Tree {
        let index = self.form_index(values);
        let form = if Arc::strong_count(&self.forms) == 1 {
            // Nobody else has them, so that nothing is copied.
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

    /// Some document of each form.
    pub(crate) fn examples(&self) -> impl Iterator<Item = &Tree> {
        self.forms.iter().map(|form| &form.tree)
    }

    /// A document in which a free number has a value, and everything else some value.
    pub(crate) fn example_at(&self, index: usize, value: f64) -> Option<Tree> {
        let mut tree = self.forms.iter().find(|form| form.takes[index])?.tree.clone();
        tree.set(&self.variables[index].path, Tree::Number(value));
        Some(tree)
    }

    /// A document of each form in which every free number has the value that it is given.
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

    /// Puts the same value at a place in every form.
    pub(crate) fn set(&mut self, place: &[String], value: &Tree) {
        self.own.clear();
        for form in Arc::make_mut(&mut self.forms) {
            form.tree.set(place, value.clone());
        }
    }

    /// Takes away what stands at a place in every form.
    pub(crate) fn remove(&mut self, place: &[String]) {
        self.own.clear();
        for form in Arc::make_mut(&mut self.forms) {
            form.tree.remove(place);
        }
    }
}

/// Whether a pointer leads to a place or to what it holds.
fn is_within(pointer: &str, place: &str) -> bool {
    pointer.strip_prefix(place).is_some_and(|rest| rest.is_empty() || rest.starts_with('/'))
}

impl Form {
    /// The ring's teeth, where they are left out: one fewer than the carrier's for each lobe.
    fn derive(&mut self) {
        if !self.derives_ring_teeth {
            return;
        }
        let number = |place: &[&str]| {
            let place: Vec<_> = place.iter().map(|&name| name.to_owned()).collect();
            match self.tree.at(&place) {
                Some(Tree::Number(number)) => Some(*number),
                _ => None,
            }
        };
        let kind = self.tree.at(&["drive", "wave_generator", "kind"].map(String::from));
        let lobes = match kind {
            Some(Tree::Text(kind)) if kind == "eccentric" => Some(1.0),
            Some(Tree::Text(kind)) if kind == "ellipse" => Some(2.0),
            Some(_) => number(&["drive", "wave_generator", "lobes"]),
            None => Some(2.0),
        };
        if let (Some(lobes), Some(count)) = (lobes, number(&["drive", "teeth", "count"])) {
            self.tree.set(&RING_TEETH.map(String::from), Tree::Number(count - lobes));
        }
    }

    /// Puts the least value of every free number there.
    fn put_least(&mut self, variables: &[Variable]) {
        for (variable, _) in variables.iter().zip(&self.takes).filter(|(_, takes)| **takes) {
            if let Domain::Real { min, .. } | Domain::Whole { min, .. } = variable.domain {
                self.tree.set(&variable.path, Tree::Number(min));
            }
        }
        self.derive();
    }

    /// Finds which of these variables are whole as this form reads them: a number between two whole ones is none. All are tried at once, as there may be thousands.
    fn find_whole(&self, variables: &mut [Variable], indices: &[usize]) {
        let mut tree = self.tree.clone();
        let mut real = BTreeMap::new();
        for &index in indices {
            let Variable { pointer, path, domain, .. } = &variables[index];
            if let Domain::Real { min, .. } = domain {
                tree.set(path, Tree::Number(min.floor() + 0.5));
                real.insert(pointer.clone(), index);
            }
        }
        while let Err(found) = tree.read::<Design>()
            && found.code == FieldCode::WrongType
            && let Some(index) = real.remove(&found.pointer)
        {
            let Variable { path, domain, .. } = &mut variables[index];
            if let Domain::Real { min, max } = *domain {
                *domain = Domain::Whole { min: min.ceil(), max: max.floor() };
                tree.set(path, Tree::Number(min.ceil()));
            }
        }
    }
}

impl Variable {
    /// About what it takes in memory.
    fn bytes(&self) -> usize {
        let path = self.path.iter().map(|name| size_of::<String>() + GRAIN_BYTES + name.len());
        let choices = self.choices.iter().map(|choice| GRAIN_BYTES + choice.bytes());
        size_of::<Self>() + GRAIN_BYTES + self.pointer.len() + path.sum::<usize>() + choices.sum::<usize>()
    }

    /// The value at a share of the domain, 0 to 1; every whole number and every choice has an equal part of it.
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "below the number of choices")]
    pub(crate) fn at_share(&self, share: f64) -> Value {
        match self.domain {
            Domain::Real { min, max } => Value::Number((min + share * (max - min)).clamp(min, max)),
            Domain::Whole { min, max } => Value::Number((min + (share * (max - min + 1.0)).floor()).min(max)),
            Domain::OneOf(count) => Value::Choice(((share * count as f64) as usize).min(count - 1)),
        }
    }

    /// Where it stands in a design.
    pub(crate) fn path(&self) -> &[String] {
        &self.path
    }

    /// The choices, where it is one.
    pub(crate) fn choices(&self) -> &[Tree] {
        &self.choices
    }

    /// A value as documents spell it.
    pub(crate) fn spelled(&self, value: Value) -> Tree {
        match value {
            Value::Number(number) => Tree::Number(number),
            Value::Choice(chosen) => self.choices[chosen].clone(),
        }
    }
}
