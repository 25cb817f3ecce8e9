//! Sensitivity study: each input is decreased and increased by a small step.

use std::collections::BTreeMap;

use serde::Serialize;
use toothwave_calculation::field::FieldCode;
use toothwave_calculation::json::{Tree, path};
use toothwave_calculation::no_answer::NoAnswer;
use utoipa::ToSchema;

use crate::ask::{beyond, escaped, fault};
use crate::defaults::{complete, with_defaults_at};
use crate::document::{InputDocument, SensitivityDocument};
use crate::evaluate::Evaluator;
use crate::rows::{ReasonAnswer, Rows, RowsPart};
use crate::table::{Cell, Column, Content, Table};
use crate::variant::{Asked, Domain, GRAIN_BYTES, Template, Value};

/// Default step of an input, as a fraction of its value.
const RELATIVE: f64 = 0.01;

/// Smallest step of an input, as a fraction of its value. The rounding of a quantity is then some millionths of its
/// change.
const LEAST_RELATIVE: f64 = 1e-9;

/// A quantity is smooth if both one-sided differences agree within this fraction.
const SMOOTH: f64 = 0.1;

/// The variants of a sensitivity study: the base, then each input decreased and increased.
#[derive(Debug, Clone)]
pub(crate) struct Sensitivity {
    inputs: Vec<Input>,
}

#[derive(Debug, Clone)]
struct Input {
    pointer: String,
    value: f64,
    plus_minus: f64,
}

impl Sensitivity {
    pub(crate) fn new(document: &SensitivityDocument) -> Result<(Self, Template), NoAnswer> {
        let (base, inputs) = if document.inputs.is_empty() {
            inputs_by_default(&document.base.0)?
        } else {
            (with_defaults_at(&document.base.0, document.inputs.keys())?, document.inputs.clone())
        };
        let (mut moved, template) = moves(&base, &inputs)?;
        for (input, variable) in moved.iter_mut().zip(template.variables()) {
            if matches!(variable.domain, Domain::Whole { .. }) {
                if inputs[&input.pointer].plus_minus.is_some_and(|by| by.fract() != 0.0) {
                    let at = format!("/inputs/{}/plus_minus", escaped(&input.pointer));
                    return Err(fault(&at, FieldCode::WrongType, "the step is not a whole number. Use a whole number"));
                }
                input.plus_minus = input.plus_minus.ceil();
            }
        }
        Ok((Self { inputs: moved }, template))
    }

    /// Each input with its value and its step, in one form for all spellings.
    pub(crate) fn asked(&self) -> Tree {
        let asked = |Input { pointer, value, plus_minus }: &Input| {
            [Tree::Text(pointer.clone()), Tree::Number(*value), Tree::Number(*plus_minus)]
        };
        Tree::Array(self.inputs.iter().flat_map(asked).collect())
    }

    /// Bytes of the answer: for each quantity an entry for each input.
    pub(crate) fn answer_bytes(&self, quantities: usize) -> u64 {
        // 16 bytes for the overhead of a string.
        let an_input = |input: &Input| size_of::<SensitivityToInput>() + input.pointer.len() + 16;
        (quantities * self.inputs.iter().map(an_input).sum::<usize>()) as u64
    }

    /// Estimated memory without its template, in bytes.
    pub(crate) fn bytes(&self) -> usize {
        self.inputs.iter().map(|input| size_of::<Input>() + GRAIN_BYTES + input.pointer.len()).sum()
    }

    pub(crate) const fn variants(&self) -> u64 {
        1 + 2 * self.inputs.len() as u64
    }
}

/// Completes the defaults of `drive`, `materials` and `load`, and collects their nonzero numbers except counts: another number
/// of teeth is another drive.
fn inputs_by_default(base: &Tree) -> Result<(Tree, BTreeMap<String, InputDocument>), NoAnswer> {
    let complete = complete(base)?;
    let (mut base, mut inputs) = (base.clone(), BTreeMap::new());
    for name in ["drive", "materials", "load"] {
        if let Some(tree) = complete.at(&[name]) {
            base.set(&[name], tree.clone());
            numbers(tree, &format!("/{name}"), &mut inputs);
        }
    }
    let (_, template) = moves(&base, &inputs)?;
    for variable in template.variables().iter().filter(|variable| matches!(variable.domain, Domain::Whole { .. })) {
        inputs.remove(&variable.pointer);
    }
    Ok((base, inputs))
}

/// Returns each input with its step, and the template of the variants.
fn moves(base: &Tree, inputs: &BTreeMap<String, InputDocument>) -> Result<(Vec<Input>, Template), NoAnswer> {
    let moved: Vec<_> =
        inputs.iter().map(|(pointer, input)| Input::new(base, pointer, input)).collect::<Result<_, _>>()?;
    let free = |input: &Input| {
        let range = Asked::Range { min: input.value - input.plus_minus, max: input.value + input.plus_minus };
        (input.pointer.clone(), range)
    };
    let free: Vec<_> = moved.iter().map(free).collect();
    let template = Template::new(base, &free, "inputs")?;
    Ok((moved, template))
}

/// Collects the nonzero numbers below a place, except a duty's time shares, which cannot change alone.
fn numbers(tree: &Tree, at: &str, found: &mut BTreeMap<String, InputDocument>) {
    match tree {
        Tree::Number(number) if *number != 0.0 => {
            found.insert(at.to_owned(), InputDocument::default());
        }
        Tree::Object(fields) => {
            for (name, tree) in fields.iter().filter(|(name, _)| name != "share_of_time") {
                numbers(tree, &format!("{at}/{}", escaped(name)), found);
            }
        }
        Tree::Array(items) => {
            for (index, tree) in items.iter().enumerate() {
                numbers(tree, &format!("{at}/{index}"), found);
            }
        }
        _ => {}
    }
}

impl Input {
    fn new(base: &Tree, pointer: &str, input: &InputDocument) -> Result<Self, NoAnswer> {
        let at = format!("/inputs/{}", escaped(pointer));
        let Some(Tree::Number(value)) = path(pointer).and_then(|path| base.at(&path)) else {
            let detail = "the base has no number here. Write it into the base";
            return Err(fault(&at, FieldCode::MissingField, detail));
        };
        let plus_minus = match (input.plus_minus, input.relative) {
            (Some(_), Some(_)) => {
                let detail = "both `plus_minus` and `relative` are given. Remove one";
                return Err(fault(&at, FieldCode::ConflictingFields, detail));
            }
            (Some(plus_minus), None) => plus_minus,
            (None, Some(relative)) if relative > 1.0 => {
                let detail = format!("`relative` is {relative:?}. Use at most 1");
                return Err(beyond(&format!("{at}/relative"), FieldCode::OutOfRange, detail, relative, 1.0));
            }
            (None, relative) => relative.unwrap_or(RELATIVE) * value.abs(),
        };
        if plus_minus.is_nan() || plus_minus <= 0.0 {
            let detail = format!("the step is {plus_minus:?}. Set `plus_minus` to a value above zero");
            return Err(fault(&at, FieldCode::OutOfRange, detail));
        }
        let least = LEAST_RELATIVE * value.abs();
        if plus_minus < least {
            let name = if input.relative.is_some() { "relative" } else { "plus_minus" };
            let detail = format!("a step of {plus_minus:?} at {value:?} is lost in rounding. Use {least:?} or more");
            return Err(beyond(&format!("{at}/{name}"), FieldCode::OutOfRange, detail, plus_minus, least));
        }
        Ok(Self { pointer: pointer.into(), value: *value, plus_minus })
    }
}

impl Sensitivity {
    /// Returns the values of the inputs in a variant.
    fn values(&self, variant: u64) -> impl Iterator<Item = f64> {
        let moved = variant.checked_sub(1).map(|moved| (moved / 2, moved % 2));
        (0..).zip(&self.inputs).map(move |(index, input)| match moved {
            Some((moved, 0)) if moved == index => input.value - input.plus_minus,
            Some((moved, _)) if moved == index => input.value + input.plus_minus,
            _ => input.value,
        })
    }
}

impl Rows for Sensitivity {
    fn document<'t>(&self, template: &'t mut Template, variant: u64) -> &'t Tree {
        template.filled(&self.values(variant).map(Value::Number).collect::<Vec<_>>())
    }

    fn places(&self) -> Vec<Column> {
        self.inputs.iter().map(|input| Column::new(input.pointer.as_str(), Content::Number)).collect()
    }

    fn place(&self, variant: u64) -> Vec<Cell> {
        self.values(variant).map(Cell::Number).collect()
    }
}

/// Result of a sensitivity study.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
pub struct SensitivityAnswer {
    /// Version of the solver.
    pub solver_version: &'static str,
    /// Build of the program. Equal builds on equal processors give equal bytes.
    pub build: &'static str,
    /// True if every variant is computed.
    pub is_complete: bool,
    /// The quantities, each with its inputs, the strongest first. A quantity is absent if the base has no answer.
    pub quantities: Vec<SensitivityOfQuantity>,
    /// Reasons for missing answers. Variant 0 is the base; input i decreased is 2i + 1, increased 2i + 2.
    pub reasons: Vec<ReasonAnswer>,
}

/// The effect of the inputs on one quantity.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
pub struct SensitivityOfQuantity {
    /// Name of the quantity.
    pub quantity: &'static str,
    /// Value at the base.
    pub value: f64,
    /// The inputs, the strongest first.
    pub inputs: Vec<SensitivityToInput>,
}

/// The effect of one input on one quantity.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
pub struct SensitivityToInput {
    /// JSON pointer into the design.
    pub pointer: String,
    /// Value of the input at the base.
    pub value: f64,
    /// Step in both directions.
    pub plus_minus: f64,
    /// The quantity with the input decreased. Absent if that variant has no answer.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub at_minus: Option<f64>,
    /// The quantity with the input increased. Absent if that variant has no answer.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub at_plus: Option<f64>,
    /// Largest change in either direction, or 0 if both variants have no answer.
    pub change: f64,
    /// Central difference quotient. Absent if one variant has no answer, or if the two one-sided differences differ by
    /// more than 10 % (a kink, a jump or curvature).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub derivative: Option<f64>,
    /// True if both one-sided differences agree, so that there is a derivative.
    pub is_smooth: bool,
}

impl SensitivityAnswer {
    pub(crate) fn new(sensitivity: &Sensitivity, evaluator: &Evaluator, rows: &RowsPart, is_complete: bool) -> Self {
        let row = |variant: u64| rows.answered.binary_search(&variant).ok();
        let quantities = evaluator.quantities.iter().zip(&rows.columns).filter_map(|(quantity, column)| {
            let at =
                |variant: u64| row(variant).and_then(|row| column.get(row).copied()).filter(|value| !value.is_nan());
            let value = at(0)?;
            let inputs = (0..)
                .zip(&sensitivity.inputs)
                .map(|(index, input)| SensitivityToInput::new(input, value, at(2 * index + 1), at(2 * index + 2)));
            let mut inputs: Vec<_> = inputs.collect();
            inputs.sort_by(|one, other| other.change.total_cmp(&one.change));
            Some(SensitivityOfQuantity { quantity: quantity.name, value, inputs })
        });
        Self {
            solver_version: toothwave_solver::VERSION,
            build: toothwave_calculation::BUILD,
            is_complete,
            quantities: quantities.collect(),
            reasons: rows.refusals.iter().map(ReasonAnswer::from).collect(),
        }
    }

    pub(crate) fn expected_bytes(&self) -> usize {
        let inputs = self.quantities.iter().flat_map(|of| &of.inputs);
        4096 + inputs.map(|input| 220 + input.pointer.len()).sum::<usize>()
    }

    /// Returns a table with one row for each quantity and input.
    pub(crate) fn table(&self) -> Table<'_> {
        let words = ["quantity", "pointer"].map(|name| Column::new(name, Content::Word));
        let numbers = ["value", "plus_minus", "at_minus", "at_base", "at_plus", "change", "derivative"];
        let columns = words.into_iter().chain(numbers.map(|name| Column::new(name, Content::Number))).collect();
        let rows = self.quantities.iter().flat_map(|of| {
            of.inputs.iter().map(|to| {
                let mut row = vec![Cell::Word(of.quantity.into()), Cell::Word(to.pointer.clone())];
                let numbers = [
                    Some(to.value),
                    Some(to.plus_minus),
                    to.at_minus,
                    Some(of.value),
                    to.at_plus,
                    Some(to.change),
                    to.derivative,
                ];
                row.extend(numbers.map(Cell::from));
                row
            })
        });
        let length = self.quantities.iter().map(|of| of.inputs.len()).sum();
        Table { columns, length, rows: Box::new(rows) }
    }
}

impl SensitivityToInput {
    fn new(input: &Input, value: f64, at_minus: Option<f64>, at_plus: Option<f64>) -> Self {
        let Input { pointer, value: input_value, plus_minus } = input.clone();
        let below = at_minus.map(|at_minus| value - at_minus);
        let above = at_plus.map(|at_plus| at_plus - value);
        let change = [below, above].into_iter().flatten().map(f64::abs).fold(0.0, f64::max);
        // Rounding of the value must not count as a kink.
        let rounding = 64.0 * f64::EPSILON * value.abs();
        let both = below.zip(above);
        let is_smooth = both
            .is_some_and(|(below, above)| (above - below).abs() <= SMOOTH * below.abs().max(above.abs()) + rounding);
        let derivative = both.filter(|_| is_smooth).map(|(below, above)| (above + below) / (2.0 * plus_minus));
        Self { pointer, value: input_value, plus_minus, at_minus, at_plus, change, derivative, is_smooth }
    }
}
