//! Variants in rows: what maps, sensitivities and tolerances have in common. Each variant follows from its number alone.

use std::collections::hash_map::Entry;
use std::collections::{BTreeMap, HashMap};
use std::iter;
use std::ops::{Range, RangeInclusive};

use serde::{Deserialize, Serialize};
use toothwave_calculation::json::Tree;
use toothwave_solver::Stop;
use utoipa::ToSchema;

use crate::evaluate::{Evaluator, Outcome, Reason, Refusal, Stopped};
use crate::table::{Cell, Column, Content, Table};
use crate::variant::{GRAIN_BYTES, Template};

/// What tells the documents of the variants.
pub(crate) trait Rows {
    /// The document of a variant, put into the template.
    fn document<'t>(&self, template: &'t mut Template, variant: u64) -> &'t Tree;
}

/// Rows of consecutive variants.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct RowsPart {
    /// Variants that have quantities.
    pub(crate) answered: Vec<u64>,
    /// A column for each quantity.
    pub(crate) columns: Vec<Vec<f64>>,
    /// Variants that have none.
    pub(crate) refused: Vec<u64>,
    /// Which of the refusals each has.
    pub(crate) reasons: Vec<u32>,
    pub(crate) refusals: Vec<RefusalNoted>,
}

/// A kind of refusal with the first of its kind.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct RefusalNoted {
    pub(crate) reason: Reason,
    pub(crate) detail: String,
    pub(crate) first: u64,
    pub(crate) count: u64,
}

impl RefusalNoted {
    /// Counts more of its kind.
    fn add(&mut self, first: u64, count: u64, detail: &str) {
        self.count += count;
        if first < self.first {
            (self.first, self.detail) = (first, detail.into());
        }
    }

    /// About what it takes in memory.
    pub(crate) fn bytes(&self) -> usize {
        let Reason { code, pointer } = &self.reason;
        size_of::<Self>()
            + [code, pointer, &self.detail].iter().map(|text| GRAIN_BYTES + text.capacity()).sum::<usize>()
    }
}

/// Rows as a table wants them, of a part or of an answer.
#[derive(Debug)]
pub(crate) struct RowsView<'a> {
    pub(crate) answered: &'a [u64],
    /// Each quantity by its name.
    pub(crate) columns: Vec<(&'a str, &'a [f64])>,
    pub(crate) refused: &'a [u64],
    pub(crate) reasons: &'a [u32],
    /// Of each reason.
    pub(crate) codes: Vec<&'a str>,
}

impl<'a> RowsView<'a> {
    /// A row a variant, in their order: its number, its place, its quantities or the code of its reason.
    pub(crate) fn table(self, places: Vec<Column>, place: impl Fn(u64) -> Vec<Cell> + 'a) -> Table<'a> {
        let mut columns = vec![Column::new("variant", Content::Count)];
        columns.extend(places);
        columns.extend(self.columns.iter().map(|(name, _)| Column::new(*name, Content::Number)));
        columns.push(Column::new("reason", Content::Word));
        let length = self.answered.len() + self.refused.len();
        let (mut possible, mut impossible) = (0, 0);
        let rows = iter::from_fn(move || {
            let (answered, refused) = (self.answered.get(possible), self.refused.get(impossible));
            let is_answered = match (answered, refused) {
                (None, None) => return None,
                (Some(answered), Some(refused)) => answered < refused,
                (answered, None) => answered.is_some(),
                (None, Some(_)) => false,
            };
            let variant = if is_answered { answered } else { refused }.copied().unwrap_or_default();
            let mut row = vec![Cell::Count(variant)];
            row.extend(place(variant));
            row.extend(self.columns.iter().map(|(_, values)| {
                let value = is_answered.then(|| values.get(possible)).flatten();
                Cell::from(value.copied())
            }));
            let code = (!is_answered).then(|| self.codes.get(*self.reasons.get(impossible)? as usize));
            row.push(code.flatten().map_or(Cell::Empty, |code| Cell::Word((*code).into())));
            if is_answered {
                possible += 1
            } else {
                impossible += 1
            }
            Some(row)
        });
        Table { columns, length, rows: Box::new(rows) }
    }
}

/// Rows as they are worked out.
#[derive(Debug)]
pub(crate) struct RowsWork {
    template: Template,
    next: u64,
    end: u64,
    part: RowsPart,
}

impl RowsPart {
    pub(crate) fn new(quantities: usize) -> Self {
        Self { columns: vec![Vec::new(); quantities], ..Self::default() }
    }

    pub(crate) fn shrink(&mut self) {
        self.answered.shrink_to_fit();
        self.columns.iter_mut().for_each(Vec::shrink_to_fit);
        self.refused.shrink_to_fit();
        self.reasons.shrink_to_fit();
        self.refusals.shrink_to_fit();
    }

    /// About what it takes in memory.
    pub(crate) fn bytes(&self) -> usize {
        let columns = self.columns.iter().map(|column| size_of::<Vec<f64>>() + size_of_val(column.as_slice()));
        let refusals = self.refusals.iter().map(RefusalNoted::bytes);
        let variants = size_of_val(self.answered.as_slice()) + size_of_val(self.refused.as_slice());
        variants + size_of_val(self.reasons.as_slice()) + columns.sum::<usize>() + refusals.sum::<usize>()
    }

    fn push(&mut self, variant: u64, outcome: Outcome) {
        match outcome {
            Outcome::Answered(values) => {
                self.answered.push(variant);
                for (column, value) in self.columns.iter_mut().zip(values) {
                    column.push(value);
                }
            }
            Outcome::Refused(refusal) => {
                let reason = note(&mut self.refusals, variant, 1, refusal);
                self.refused.push(variant);
                self.reasons.push(reason);
            }
        }
    }

    /// Appends the rows of later variants.
    pub(crate) fn append(&mut self, other: &Self) {
        self.answered.extend_from_slice(&other.answered);
        for (column, values) in self.columns.iter_mut().zip(&other.columns) {
            column.extend_from_slice(values);
        }
        let renumbered: Vec<_> = other
            .refusals
            .iter()
            .map(|noted| {
                let refusal = Refusal { reason: noted.reason.clone(), detail: noted.detail.clone() };
                note(&mut self.refusals, noted.first, noted.count, refusal)
            })
            .collect();
        self.refused.extend_from_slice(&other.refused);
        self.reasons.extend(other.reasons.iter().map(|&reason| renumbered[reason as usize]));
    }
}

/// The rows of a study that have come, in the order of their variants and as they came: of many there is no room for a copy.
#[derive(Debug)]
pub(crate) struct RowsParts<'a>(pub(crate) Vec<&'a RowsPart>);

impl RowsParts<'_> {
    /// All of them in one.
    pub(crate) fn joined(&self, quantities: usize) -> RowsPart {
        let mut rows = RowsPart::new(quantities);
        let (answered, refused): (Vec<_>, Vec<_>) =
            self.0.iter().map(|part| (part.answered.len(), part.refused.len())).unzip();
        let (answered, refused) = (answered.iter().sum(), refused.iter().sum());
        rows.answered.reserve_exact(answered);
        rows.columns.iter_mut().for_each(|column| column.reserve_exact(answered));
        rows.refused.reserve_exact(refused);
        rows.reasons.reserve_exact(refused);
        for part in &self.0 {
            rows.append(part);
        }
        rows
    }

    /// The rows of these variants: each part with those that it has of them.
    pub(crate) fn within(&self, variants: RangeInclusive<u64>) -> impl Iterator<Item = (&RowsPart, Range<usize>)> {
        self.0.iter().map(move |part| {
            let first = part.answered.partition_point(|variant| variant < variants.start());
            (*part, first..part.answered.partition_point(|variant| variant <= variants.end()))
        })
    }

    /// A quantity's values in these variants.
    pub(crate) fn values(&self, quantity: usize, variants: RangeInclusive<u64>) -> Vec<f64> {
        let mut values = Vec::with_capacity(self.within(variants.clone()).map(|(_, rows)| rows.len()).sum());
        for (part, rows) in self.within(variants) {
            values.extend_from_slice(&part.columns[quantity][rows]);
        }
        values
    }

    /// Why those of these variants that have no quantities have none.
    pub(crate) fn reasons(&self, variants: RangeInclusive<u64>) -> impl Iterator<Item = &Reason> {
        self.0.iter().flat_map(move |part| {
            let first = part.refused.partition_point(|variant| variant < variants.start());
            let reasons = &part.reasons[first..part.refused.partition_point(|variant| variant <= variants.end())];
            reasons.iter().map(|&reason| &part.refusals[reason as usize].reason)
        })
    }

    /// Every reason with how many variants have it.
    pub(crate) fn refusals(&self) -> Vec<RefusalNoted> {
        let mut refusals: Vec<RefusalNoted> = Vec::new();
        // There may be as many as inputs, in each of a hundred thousand parts.
        let mut places = HashMap::new();
        for noted in self.0.iter().flat_map(|part| &part.refusals) {
            match places.entry(&noted.reason) {
                Entry::Vacant(place) => {
                    place.insert(refusals.len());
                    refusals.push(noted.clone());
                }
                Entry::Occupied(place) => refusals[*place.get()].add(noted.first, noted.count, &noted.detail),
            }
        }
        refusals
    }
}

/// Counts refusals under their reason, and returns its number.
pub(crate) fn note(refusals: &mut Vec<RefusalNoted>, first: u64, count: u64, refusal: Refusal) -> u32 {
    let index = refusals.iter().position(|noted| noted.reason == refusal.reason).unwrap_or_else(|| {
        refusals.push(RefusalNoted { reason: refusal.reason, detail: refusal.detail.clone(), first, count: 0 });
        refusals.len() - 1
    });
    refusals[index].add(first, count, &refusal.detail);
    u32::try_from(index).unwrap_or(u32::MAX)
}

impl RowsWork {
    pub(crate) fn new(template: Template, quantities: usize, variants: Range<u64>) -> Self {
        Self { template, next: variants.start, end: variants.end, part: RowsPart::new(quantities) }
    }

    /// One variant further; whether that was the last one.
    pub(crate) fn step(&mut self, rows: &impl Rows, evaluator: &Evaluator, stop: &dyn Stop) -> Result<bool, Stopped> {
        if self.next < self.end {
            let document = rows.document(&mut self.template, self.next);
            let outcome = evaluator.outcome(document, stop)?;
            self.part.push(self.next, outcome);
            self.next += 1;
        }
        Ok(self.next == self.end)
    }

    pub(crate) fn finish(self) -> RowsPart {
        self.part
    }
}

/// Why variants are impossible, and how many.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
pub struct ReasonAnswer {
    /// The code of the field at fault, or of the problem where no field is.
    pub code: String,
    /// The field at fault, by JSON pointer into the design, of a list's entries the list; empty where none is.
    pub pointer: String,
    /// Variants that have no answer for this reason.
    pub variants: u64,
    /// The first of them.
    pub first_variant: u64,
    /// What was wrong with that one.
    pub detail: String,
}

impl From<&RefusalNoted> for ReasonAnswer {
    fn from(RefusalNoted { reason, detail, first, count }: &RefusalNoted) -> Self {
        let Reason { code, pointer } = reason.clone();
        Self { code, pointer, variants: *count, first_variant: *first, detail: detail.clone() }
    }
}

/// Quantities in columns of equal length, one entry a variant.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
pub struct PossibleAnswer {
    /// Which variants.
    pub variant: Vec<u64>,
    /// A column for each quantity, by its name.
    pub quantities: BTreeMap<&'static str, Vec<f64>>,
}

/// Variants without an answer, in columns of equal length.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
pub struct ImpossibleAnswer {
    /// Which variants.
    pub variant: Vec<u64>,
    /// Which of the reasons, from 0.
    pub reason: Vec<u32>,
}
