//! Map: quantities over a grid.

use std::sync::Arc;

use serde::Serialize;
use toothwave_calculation::field::FieldCode;
use toothwave_calculation::json::Tree;
use toothwave_calculation::no_answer::NoAnswer;
use utoipa::ToSchema;

use crate::ask::{beyond, escaped, fault};
use crate::document::{ChoiceDocument, MapDocument, OverDocument};
use crate::evaluate::Evaluator;
use crate::rows::{ImpossibleAnswer, PossibleAnswer, ReasonAnswer, Rows, RowsPart, RowsView};
use crate::table::{Cell, Column, Content, Table};
use crate::variant::{Asked, Domain, Template, Value, Variable};

/// The grid of a map. The last axis varies fastest.
#[derive(Debug, Clone)]
pub(crate) struct Map {
    variables: Arc<Vec<Variable>>,
    /// One axis for each variable.
    axes: Vec<Axis>,
}

#[derive(Debug, Clone, Copy)]
struct Axis {
    values: Values,
    /// True if all values are numbers.
    is_number: bool,
}

/// The values of an axis, computed on demand. A document may name hundreds of axes with a million values each before
/// their combinations are counted.
#[derive(Debug, Clone, Copy)]
enum Values {
    /// This many words of a list.
    Choices(u32),
    /// This many whole numbers from `min`, each `by` above the one before.
    Whole { min: f64, by: f64, count: u32 },
    /// This many equidistant values, both ends included.
    Steps { min: f64, max: f64, steps: u32 },
}

impl Values {
    const fn count(&self) -> u32 {
        match *self {
            Self::Choices(count) | Self::Whole { count, .. } | Self::Steps { steps: count, .. } => count,
        }
    }

    fn at(&self, index: u32) -> Value {
        match *self {
            Self::Choices(_) => Value::Choice(index as usize),
            Self::Whole { min, by, .. } => Value::Number(min + by * f64::from(index)),
            Self::Steps { min, max, steps } => {
                let share = f64::from(index) / (f64::from(steps) - 1.0).max(1.0);
                // Both ends are exact.
                Value::Number(if index + 1 == steps && index > 0 { max } else { min + share * (max - min) })
            }
        }
    }

    fn all(&self) -> impl Iterator<Item = Value> {
        (0..self.count()).map(|index| self.at(index))
    }
}

/// Reads `min` and `max`, or `one_of`.
pub(crate) fn asked(
    at: &str,
    min: Option<f64>,
    max: Option<f64>,
    one_of: Option<&[ChoiceDocument]>,
) -> Result<Asked, NoAnswer> {
    match (min, max, one_of) {
        (None, None, Some(choices)) => Ok(Asked::OneOf(choices.iter().map(Tree::from).collect())),
        (Some(min), Some(max), None) => Ok(Asked::Range { min, max }),
        (_, _, Some(_)) => {
            Err(fault(at, FieldCode::ConflictingFields, "both a range and `one_of` are given. Remove one"))
        }
        _ => Err(fault(at, FieldCode::MissingField, "the values are missing. Add `min` and `max`, or `one_of`")),
    }
}

impl Map {
    pub(crate) fn new(document: &MapDocument) -> Result<(Self, Template), NoAnswer> {
        if document.over.is_empty() {
            return Err(fault("/over", FieldCode::MissingField, "`over` is empty. Name at least one field"));
        }
        let mut free = Vec::new();
        for (pointer, OverDocument { min, max, one_of, .. }) in &document.over {
            let at = format!("/over/{}", escaped(pointer));
            free.push((pointer.clone(), asked(&at, *min, *max, one_of.as_deref())?));
        }
        let template = Template::new(&document.base.0, &free, "over")?;
        let axes = template.variables().iter().zip(document.over.values());
        let axes = axes.map(|(variable, over)| Axis::new(variable, over)).collect::<Result<_, _>>()?;
        Ok((Self { variables: template.shared_variables(), axes }, template))
    }

    /// Estimated memory without its template, in bytes.
    pub(crate) const fn bytes(&self) -> usize {
        self.axes.len() * size_of::<Axis>()
    }

    fn variables_with_axes(&self) -> impl Iterator<Item = (&Variable, &Axis)> {
        self.variables.iter().zip(&self.axes)
    }

    /// Number of variants of the grid, or none if it exceeds 64 bits.
    pub(crate) fn variants(&self) -> Option<u64> {
        self.axes.iter().try_fold(1_u64, |product, axis| product.checked_mul(u64::from(axis.values.count())))
    }

    /// Number of values of each axis.
    pub(crate) fn counts(&self) -> Tree {
        Tree::Array(self.axes.iter().map(|axis| Tree::Number(axis.values.count().into())).collect())
    }

    fn values(&self, mut variant: u64) -> Vec<Value> {
        let mut values: Vec<_> = self
            .axes
            .iter()
            .rev()
            .map(|axis| {
                let count = u64::from(axis.values.count());
                // The remainder is below the number of values, a `u32`.
                let value = axis.values.at(u32::try_from(variant % count).unwrap_or_default());
                variant /= count;
                value
            })
            .collect();
        values.reverse();
        values
    }
}

impl Axis {
    fn new(variable: &Variable, over: &OverDocument) -> Result<Self, NoAnswer> {
        const MOST_STEPS: f64 = 1e6;
        let at = format!("/over/{}", escaped(&variable.pointer));
        let steps = over.steps.map(|steps| steps.value());
        if let Some(steps) = steps.filter(|steps| !(1.0..=MOST_STEPS).contains(steps)) {
            let limit = if steps < 1.0 { 1.0 } else { MOST_STEPS };
            let detail = format!("`steps` is {steps:?}. Use a value from 1 to {MOST_STEPS:?}");
            return Err(beyond(&format!("{at}/steps"), FieldCode::OutOfRange, detail, steps, limit));
        }
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "within the bounds above")]
        let count = |steps: f64| steps as u32;
        let values = match (&variable.domain, steps) {
            (Domain::OneOf(_), Some(_)) => {
                let detail = "both `steps` and `one_of` are given. Remove `steps`";
                return Err(fault(&at, FieldCode::ConflictingFields, detail));
            }
            // The document limits the number of choices.
            (Domain::OneOf(count), None) => Values::Choices(u32::try_from(*count).unwrap_or(u32::MAX)),
            (Domain::Real { .. }, None) => {
                return Err(fault(
                    &at,
                    FieldCode::MissingField,
                    "`steps` is missing. Add the number of values in the range",
                ));
            }
            (Domain::Whole { min, max }, None) => {
                let all = max - min + 1.0;
                if all > MOST_STEPS {
                    let detail = format!("the range has {all:?} whole numbers. Use at most {MOST_STEPS:?}");
                    return Err(beyond(&at, FieldCode::OutOfRange, detail, all, MOST_STEPS));
                }
                Values::Whole { min: *min, by: 1.0, count: count(all) }
            }
            (Domain::Real { min, max } | Domain::Whole { min, max }, Some(steps)) if min >= max && steps > 1.0 => {
                let detail = format!("the range has one value, {min:?}, but `steps` is {steps:?}. Use 1");
                return Err(beyond(&format!("{at}/steps"), FieldCode::OutOfRange, detail, steps, 1.0));
            }
            (Domain::Real { min, max } | Domain::Whole { min, max }, Some(1.0)) if min < max => {
                let detail = "the range has two ends, but `steps` is 1. Use 2 or more";
                return Err(beyond(&format!("{at}/steps"), FieldCode::OutOfRange, detail, 1.0, 2.0));
            }
            (Domain::Whole { min, max }, Some(steps)) => {
                // A whole quotient of whole numbers below 2^53 is exact.
                let by = (max - min) / (steps - 1.0).max(1.0);
                if by.fract() != 0.0 {
                    let detail =
                        format!("the field needs whole numbers, but these steps are {by:?} apart. Change `steps`");
                    return Err(fault(&format!("{at}/steps"), FieldCode::WrongType, detail));
                }
                Values::Whole { min: *min, by, count: count(steps) }
            }
            (Domain::Real { min, max }, Some(steps)) => Values::Steps { min: *min, max: *max, steps: count(steps) },
        };
        let is_number = match values {
            Values::Choices(_) => values.all().all(|value| matches!(variable.spelled(value), Tree::Number(_))),
            Values::Whole { .. } | Values::Steps { .. } => true,
        };
        Ok(Self { values, is_number })
    }

    fn answer(&self, variable: &Variable) -> AxisAnswer {
        let cells = || self.values.all().map(|value| self.cell(variable, value));
        let number = |cell| if let Cell::Number(number) = cell { Some(number) } else { None };
        let (values, choices) = if self.is_number {
            (Some(cells().filter_map(number).collect()), None)
        } else {
            (None, Some(cells().map(|cell| cell.text()).collect()))
        };
        AxisAnswer { pointer: variable.pointer.clone(), values, choices }
    }

    fn cell(&self, variable: &Variable, value: Value) -> Cell {
        match variable.spelled(value) {
            Tree::Number(number) if self.is_number => Cell::Number(number),
            other => Cell::Word(spelled(&other)),
        }
    }
}

/// Returns a value as text.
fn spelled(tree: &Tree) -> String {
    match tree {
        Tree::Text(text) => text.clone(),
        other => serde_json::to_string(other).unwrap_or_default(),
    }
}

impl Rows for Map {
    fn document<'t>(&self, template: &'t mut Template, variant: u64) -> &'t Tree {
        template.filled(&self.values(variant))
    }

    fn places(&self) -> Vec<Column> {
        let kind = |axis: &Axis| if axis.is_number { Content::Number } else { Content::Word };
        let column = |(variable, axis): (&Variable, &Axis)| Column::new(variable.pointer.as_str(), kind(axis));
        self.variables_with_axes().map(column).collect()
    }

    fn place(&self, variant: u64) -> Vec<Cell> {
        let values = self.values(variant);
        self.variables_with_axes().zip(values).map(|((variable, axis), value)| axis.cell(variable, value)).collect()
    }
}

/// Map: quantities over a grid. Variants are numbered from 0; the last field of `over` varies fastest.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
pub struct MapAnswer {
    /// Version of the solver.
    pub solver_version: &'static str,
    /// Build of the program. Equal builds on equal processors give equal bytes.
    pub build: &'static str,
    /// True if every variant is computed.
    pub is_complete: bool,
    /// Number of variants of the grid.
    pub variants: u64,
    /// The axes of the grid.
    pub over: Vec<AxisAnswer>,
    /// Variants with an answer.
    pub possible: PossibleAnswer,
    /// Variants without an answer.
    pub impossible: ImpossibleAnswer,
    /// Reasons for missing answers.
    pub reasons: Vec<ReasonAnswer>,
    #[serde(skip)]
    quantities: Vec<&'static str>,
}

/// An axis of a grid: `values`, or `choices` if they are not numbers.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
pub struct AxisAnswer {
    /// JSON pointer into the design.
    pub pointer: String,
    /// Values, if they are numbers.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub values: Option<Vec<f64>>,
    /// Values, if they are words.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub choices: Option<Vec<String>>,
}

impl MapAnswer {
    pub(crate) fn new(map: &Map, evaluator: &Evaluator, rows: RowsPart, is_complete: bool) -> Self {
        let quantities: Vec<_> = evaluator.quantities.iter().map(|quantity| quantity.name).collect();
        Self {
            solver_version: toothwave_solver::VERSION,
            build: toothwave_calculation::BUILD,
            is_complete,
            variants: map.variants().unwrap_or(u64::MAX),
            over: map.variables_with_axes().map(|(variable, axis)| axis.answer(variable)).collect(),
            possible: PossibleAnswer {
                variant: rows.answered,
                quantities: quantities.iter().copied().zip(rows.columns).collect(),
            },
            impossible: ImpossibleAnswer { variant: rows.refused, reason: rows.reasons },
            reasons: rows.refusals.iter().map(ReasonAnswer::from).collect(),
            quantities,
        }
    }

    /// Returns a table with one row for each variant: number, values of the axes, quantities or the reason's code.
    pub(crate) fn table(&self) -> Table<'_> {
        let axis = |axis: &AxisAnswer| {
            let kind = if axis.values.is_some() { Content::Number } else { Content::Word };
            Column::new(axis.pointer.as_str(), kind)
        };
        let column = |&name: &&'static str| Some((name, self.possible.quantities.get(name)?.as_slice()));
        let view = RowsView {
            answered: &self.possible.variant,
            columns: self.quantities.iter().filter_map(column).collect(),
            refused: &self.impossible.variant,
            reasons: &self.impossible.reason,
            codes: self.reasons.iter().map(|reason| reason.code.as_str()).collect(),
        };
        view.table(self.over.iter().map(axis).collect(), |variant| self.places(variant))
    }

    fn places(&self, mut variant: u64) -> Vec<Cell> {
        let mut places: Vec<_> = self
            .over
            .iter()
            .rev()
            .map(|axis| {
                let count = axis.values.as_ref().map_or(0, Vec::len) + axis.choices.as_ref().map_or(0, Vec::len);
                let index = usize::try_from(variant % count.max(1) as u64).unwrap_or_default();
                variant /= count.max(1) as u64;
                let number = axis.values.as_ref().and_then(|values| values.get(index).copied()).map(Cell::Number);
                let word = axis.choices.as_ref().and_then(|choices| choices.get(index).cloned()).map(Cell::Word);
                number.or(word).unwrap_or(Cell::Empty)
            })
            .collect();
        places.reverse();
        places
    }

    /// Estimated bytes of the columns.
    pub(crate) fn held_bytes(&self) -> u64 {
        let of_possible = 8 * (self.quantities.len() + 1) * self.possible.variant.len();
        (of_possible + 12 * self.impossible.variant.len()) as u64
    }

    pub(crate) fn expected_bytes(&self) -> usize {
        4096 + (20 * self.quantities.len() + 8) * self.possible.variant.len() + 12 * self.impossible.variant.len()
    }
}
