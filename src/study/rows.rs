//! Variants in rows, for maps, sensitivity and tolerance studies. Each variant depends on its number alone.

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

/// Source of the documents of the variants.
pub(crate) trait Rows {
    /// Fills the template with the values of a variant.
    fn document<'t>(&self, template: &'t mut Template, variant: u64) -> &'t Tree;

    /// The columns that tell a variant from others, beside its number.
    fn places(&self) -> Vec<Column>;

    /// The cells of these columns.
    fn place(&self, variant: u64) -> Vec<Cell>;
}

/// Rows of consecutive variants.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct RowsPart {
    /// Variants with quantities.
    pub(crate) answered: Vec<u64>,
    /// One column for each quantity; NaN for a drive that does not have it.
    pub(crate) columns: Vec<Vec<f64>>,
    /// Variants without quantities.
    pub(crate) refused: Vec<u64>,
    /// Index into `refusals` for each refused variant.
    pub(crate) reasons: Vec<u32>,
    pub(crate) refusals: Vec<RefusalNoted>,
}

/// A reason with its number of variants and the first of them.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct RefusalNoted {
    pub(crate) reason: Reason,
    pub(crate) detail: String,
    pub(crate) first: u64,
    pub(crate) count: u64,
}

impl RefusalNoted {
    /// Counts further variants with this reason.
    fn add(&mut self, first: u64, count: u64, detail: &str) {
        self.count += count;
        if first < self.first {
            (self.first, self.detail) = (first, detail.into());
        }
    }

    /// Estimated memory in bytes.
    pub(crate) fn bytes(&self) -> usize {
        let Reason { code, pointer } = &self.reason;
        size_of::<Self>()
            + [code, pointer, &self.detail].iter().map(|text| GRAIN_BYTES + text.capacity()).sum::<usize>()
    }
}

/// Rows of a part or an answer, as a table needs them.
#[derive(Debug)]
pub(crate) struct RowsView<'a> {
    pub(crate) answered: &'a [u64],
    /// The quantities with their names.
    pub(crate) columns: Vec<(&'a str, &'a [f64])>,
    pub(crate) refused: &'a [u64],
    pub(crate) reasons: &'a [u32],
    /// The code of each reason.
    pub(crate) codes: Vec<&'a str>,
}

impl<'a> RowsView<'a> {
    /// Returns a table with one row for each variant: number, place, quantities or the reason's code.
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

/// Rows that are being computed.
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

    /// Estimated memory in bytes.
    pub(crate) fn bytes(&self) -> usize {
        let columns = self.columns.iter().map(|column| size_of::<Vec<f64>>() + size_of_val(column.as_slice()));
        let refusals = self.refusals.iter().map(RefusalNoted::bytes);
        let variants = size_of_val(self.answered.as_slice()) + size_of_val(self.refused.as_slice());
        variants + size_of_val(self.reasons.as_slice()) + columns.sum::<usize>() + refusals.sum::<usize>()
    }

    /// The same without what a table of its rows holds.
    pub(crate) fn without_columns(&self) -> Self {
        let Self { reasons, refusals, .. } = self.clone();
        Self { reasons, refusals, ..Self::new(self.columns.len()) }
    }

    /// A row a variant.
    pub(crate) fn table<'a>(
        &'a self,
        rows: &'a impl Rows,
        quantities: impl Iterator<Item = &'static str>,
    ) -> Table<'a> {
        let view = RowsView {
            answered: &self.answered,
            columns: quantities.zip(self.columns.iter().map(Vec::as_slice)).collect(),
            refused: &self.refused,
            reasons: &self.reasons,
            codes: self.refusals.iter().map(|noted| noted.reason.code.as_str()).collect(),
        };
        view.table(rows.places(), |variant| rows.place(variant))
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

/// The computed rows of a study, in the order of their variants. They are borrowed, because a copy may exceed memory.
#[derive(Debug)]
pub(crate) struct RowsParts<'a>(pub(crate) Vec<&'a RowsPart>);

impl RowsParts<'_> {
    /// Joins all rows.
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

    /// Returns the rows of these variants: each part with its range of rows.
    pub(crate) fn within(&self, variants: RangeInclusive<u64>) -> impl Iterator<Item = (&RowsPart, Range<usize>)> {
        self.0.iter().map(move |part| {
            let first = part.answered.partition_point(|variant| variant < variants.start());
            (*part, first..part.answered.partition_point(|variant| variant <= variants.end()))
        })
    }

    /// Returns the values of a quantity in those of these variants that have it.
    pub(crate) fn values(&self, quantity: usize, variants: RangeInclusive<u64>) -> Vec<f64> {
        let mut values = Vec::with_capacity(self.within(variants.clone()).map(|(_, rows)| rows.len()).sum());
        for (part, rows) in self.within(variants) {
            values.extend(part.columns[quantity][rows].iter().filter(|value| !value.is_nan()));
        }
        values
    }

    /// Returns the reasons of those variants that have no quantities.
    pub(crate) fn reasons(&self, variants: RangeInclusive<u64>) -> impl Iterator<Item = &Reason> {
        self.0.iter().flat_map(move |part| {
            let first = part.refused.partition_point(|variant| variant < variants.start());
            let reasons = &part.reasons[first..part.refused.partition_point(|variant| variant <= variants.end())];
            reasons.iter().map(|&reason| &part.refusals[reason as usize].reason)
        })
    }

    /// Returns every reason with its number of variants.
    pub(crate) fn refusals(&self) -> Vec<RefusalNoted> {
        let mut refusals: Vec<RefusalNoted> = Vec::new();
        // A hash map, because each of 100 000 parts may have as many reasons as there are inputs.
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

/// Counts variants with a refusal, and returns the index of its reason.
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

    /// Computes one variant. Returns true if it was the last one.
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

/// Reason for missing answers, with the number of variants.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
pub struct ReasonAnswer {
    /// Code of the field's error, or of the problem if no field is wrong.
    pub code: String,
    /// JSON pointer to the wrong field in the design. For an entry of a list it is the list; without a field it is
    /// empty.
    pub pointer: String,
    /// Number of variants with this reason.
    pub variants: u64,
    /// The first of these variants.
    pub first_variant: u64,
    /// Message for the first variant.
    pub detail: String,
}

impl From<&RefusalNoted> for ReasonAnswer {
    fn from(RefusalNoted { reason, detail, first, count }: &RefusalNoted) -> Self {
        let Reason { code, pointer } = reason.clone();
        Self { code, pointer, variants: *count, first_variant: *first, detail: detail.clone() }
    }
}

/// Variants with an answer, in columns of equal length.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
pub struct PossibleAnswer {
    /// Numbers of the variants.
    pub variant: Vec<u64>,
    /// One column for each quantity, by name; null for a drive that does not have it.
    #[schema(value_type = BTreeMap<String, Vec<Option<f64>>>)]
    pub quantities: BTreeMap<&'static str, Vec<f64>>,
}

/// Variants without an answer, in columns of equal length.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
pub struct ImpossibleAnswer {
    /// Numbers of the variants.
    pub variant: Vec<u64>,
    /// Index into `reasons` for each variant, from 0.
    pub reason: Vec<u32>,
}
