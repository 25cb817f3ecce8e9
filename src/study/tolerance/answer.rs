//! Answer of a tolerance study: spread, limits and contributors of each quantity.

use serde::Serialize;
use utoipa::ToSchema;

use super::{SHARES, Tolerance};
use crate::evaluate::Evaluator;
use crate::limit::{Bound, Limit};
use crate::rank::{QuantileAnswer, ShareAnswer, quantile, share};
use crate::rows::{ReasonAnswer, RowsPart, RowsParts};
use crate::table::{Cell, Column, Content, Table};

/// Result of a tolerance study.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
pub struct ToleranceAnswer {
    /// Version of the solver.
    pub solver_version: &'static str,
    /// Build of the program. Equal builds on equal processors give equal bytes.
    pub build: &'static str,
    /// True if every drive is computed.
    pub is_complete: bool,
    /// Number of computed random drives.
    pub samples: u64,
    /// Random drives that cannot be assembled because teeth interfere with a part. They are in no quantile.
    pub interference: u64,
    /// Random drives without an answer for another reason. They are in no quantile.
    pub impossible: u64,
    /// Reasons for missing answers.
    pub reasons: Vec<ReasonAnswer>,
    /// Fraction of all random drives that can be assembled and meet every limit. Absent without `require`.
    #[serde(rename = "yield", skip_serializing_if = "Option::is_none")]
    pub yield_share: Option<ShareAnswer>,
    /// The limits, each with the number of drives that violate it.
    pub limits: Vec<ToleranceLimitAnswer>,
    /// The quantities, each with its distribution.
    pub quantities: Vec<ToleranceQuantityAnswer>,
}

/// A limit with the number of drives that violate it.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
pub struct ToleranceLimitAnswer {
    /// Name of the quantity.
    pub quantity: &'static str,
    /// Side of the limit.
    pub bound: Bound,
    /// Value of the limit.
    pub limit: f64,
    /// Drives that violate it.
    pub failed: u64,
}

/// Distribution of a quantity.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
pub struct ToleranceQuantityAnswer {
    /// Name of the quantity.
    pub quantity: &'static str,
    /// Value without deviations. Absent if that drive has no answer.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub nominal: Option<f64>,
    /// Mean.
    pub mean: f64,
    /// Standard deviation.
    pub standard_deviation: f64,
    /// Smallest value of the sample.
    pub least: f64,
    /// Largest value of the sample.
    pub largest: f64,
    /// Quantiles.
    pub quantiles: Vec<QuantileAnswer>,
    /// Histogram from the smallest to the largest value.
    pub histogram: HistogramAnswer,
    /// Effect of each kind of deviation alone, the largest first. Empty with a single kind.
    pub contributors: Vec<ContributorAnswer>,
}

/// Histogram with bins of equal width.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
pub struct HistogramAnswer {
    /// Edges of the bins, one more than there are bins. A value at an edge is in the bin above it; the largest value is
    /// in the last bin.
    pub edges: Vec<f64>,
    /// Number of drives in each bin.
    pub drives: Vec<u64>,
}

/// Effect of one kind of deviation alone.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
pub struct ContributorAnswer {
    /// Kind of deviation: its name in `deviations`, or a JSON pointer.
    pub deviation: String,
    /// Standard deviation of the quantity in drives with this deviation alone.
    pub standard_deviation: f64,
    /// Variance as a fraction of the sum over all kinds.
    pub share: f64,
}

/// Mean and standard deviation.
#[derive(Debug, Clone, Copy)]
struct Spread {
    mean: f64,
    standard_deviation: f64,
}

/// Computes mean and standard deviation in two passes, so that a large mean costs no digits.
fn spread(values: &[f64]) -> Spread {
    let count = values.len().max(1) as f64;
    let mean = values.iter().sum::<f64>() / count;
    let squares: f64 = values.iter().map(|value| (value - mean) * (value - mean)).sum();
    Spread { mean, standard_deviation: (squares / (count - 1.0).max(1.0)).sqrt() }
}

impl HistogramAnswer {
    /// Makes the histogram of a sorted sample. It has twice the cube root of its size bins (Rice's rule), or one if all
    /// values are equal.
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a small whole number, not negative")]
    pub(super) fn of(sorted: &[f64]) -> Self {
        let (least, largest) = match sorted {
            [] => return Self { edges: Vec::new(), drives: Vec::new() },
            [one] => (*one, *one),
            [first, .., last] => (*first, *last),
        };
        let bins = if largest > least { (2.0 * (sorted.len() as f64).cbrt()).ceil() as usize } else { 1 };
        let edge = |index: usize| {
            if index == bins { largest } else { least + (largest - least) * (index as f64 / bins as f64) }
        };
        let below = |index: usize| {
            if index == bins { sorted.len() } else { sorted.partition_point(|&value| value < edge(index)) }
        };
        Self {
            edges: (0..=bins).map(edge).collect(),
            drives: (0..bins).map(|index| (below(index + 1) - below(index)) as u64).collect(),
        }
    }
}

impl ToleranceAnswer {
    pub(crate) fn new(tolerance: &Tolerance, evaluator: &Evaluator, rows: &RowsParts<'_>, is_complete: bool) -> Self {
        let samples = 1..=tolerance.samples;
        let (mut interference, mut impossible) = (0, 0);
        for reason in rows.reasons(samples.clone()) {
            if reason.code == "interference" { interference += 1 } else { impossible += 1 }
        }
        let fails =
            |limit: &Limit, part: &RowsPart, row: usize| limit.violation(part.columns[limit.quantity][row]) > 0.0;
        let sampled = || rows.within(samples.clone()).flat_map(|(part, rows)| rows.map(move |row| (part, row)));
        let is_good = |&(part, row): &(&RowsPart, usize)| !tolerance.limits.iter().any(|limit| fails(limit, part, row));
        let good = sampled().filter(is_good).count() as u64;
        let answered: usize = rows.within(samples.clone()).map(|(_, rows)| rows.len()).sum();
        let looked_at = answered as u64 + interference + impossible;
        let limits = tolerance.limits.iter().map(|limit| ToleranceLimitAnswer {
            quantity: evaluator.quantities[limit.quantity].name,
            bound: limit.bound,
            limit: limit.limit,
            failed: sampled().filter(|&(part, row)| fails(limit, part, row)).count() as u64,
        });
        let alone = tolerance.alone();
        let quantities = evaluator.quantities.iter().enumerate().filter_map(|(column, quantity)| {
            let mut sorted = rows.values(column, samples.clone());
            if sorted.is_empty() {
                return None;
            }
            let Spread { mean, standard_deviation } = spread(&sorted);
            // An unstable sort gives the same result, because equal values have equal bits.
            sorted.sort_unstable_by(f64::total_cmp);
            let kinds = (0..).zip(&tolerance.kinds).filter(|_| alone > 0).map(|(index, kind)| {
                let first = 1 + tolerance.samples + index * alone;
                let Spread { standard_deviation, .. } = spread(&rows.values(column, first..=first + alone - 1));
                ContributorAnswer { deviation: kind.name.clone(), standard_deviation, share: 0.0 }
            });
            let mut contributors: Vec<_> = kinds.collect();
            let variance: f64 = contributors.iter().map(|kind| kind.standard_deviation.powi(2)).sum();
            for kind in &mut contributors {
                kind.share = if variance > 0.0 { kind.standard_deviation.powi(2) / variance } else { 0.0 };
            }
            contributors.sort_by(|one, other| other.standard_deviation.total_cmp(&one.standard_deviation));
            Some(ToleranceQuantityAnswer {
                quantity: quantity.name,
                nominal: rows.values(column, 0..=0).first().copied(),
                mean,
                standard_deviation,
                least: sorted.first().copied().unwrap_or_default(),
                largest: sorted.last().copied().unwrap_or_default(),
                quantiles: SHARES.iter().filter_map(|&share| quantile(&sorted, share)).collect(),
                histogram: HistogramAnswer::of(&sorted),
                contributors,
            })
        });
        Self {
            solver_version: toothwave_solver::VERSION,
            build: toothwave_calculation::BUILD,
            is_complete,
            samples: looked_at,
            interference,
            impossible,
            reasons: rows.refusals().iter().map(ReasonAnswer::from).collect(),
            yield_share: if tolerance.limits.is_empty() { None } else { share(good, looked_at) },
            limits: limits.collect(),
            quantities: quantities.collect(),
        }
    }

    pub(crate) fn expected_bytes(&self) -> usize {
        let of_quantity = |of: &ToleranceQuantityAnswer| {
            let contributors = of.contributors.iter().map(|kind| 100 + kind.deviation.len());
            1000 + 26 * of.histogram.drives.len() + contributors.sum::<usize>()
        };
        2048 + self.quantities.iter().map(of_quantity).sum::<usize>()
    }

    /// Returns a table with one row for each quantity and quantile.
    pub(crate) fn table(&self) -> Table<'_> {
        let mut columns = vec![Column::new("quantity", Content::Word)];
        columns.extend(["share", "value", "low", "high"].map(|name| Column::new(name, Content::Number)));
        let rows = self.quantities.iter().flat_map(|of| {
            of.quantiles.iter().map(|&QuantileAnswer { share, value, low, high }| {
                let mut row = vec![Cell::Word(of.quantity.into())];
                row.extend([Some(share), Some(value), low, high].map(Cell::from));
                row
            })
        });
        let length = self.quantities.iter().map(|of| of.quantiles.len()).sum();
        Table { columns, length, rows: Box::new(rows) }
    }
}
