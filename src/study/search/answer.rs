//! Answer of a search: designs found, limits, and what would relax them.

use std::collections::BTreeMap;

use serde::Serialize;
use toothwave_calculation::design::Design;
use utoipa::ToSchema;

use super::Search;
use super::island::{IslandPart, Scan, variable_values};
use crate::evaluate::Evaluator;
use crate::limit::{Bound, Limit};
use crate::optimise::merged;
use crate::point::Point;
use crate::rows::ReasonAnswer;
use crate::table::{Cell, Column, Content, Table};
use crate::variant::{Domain, Template, Variable};

/// Result of a search: the best designs within limits, and the limits that prevent better ones.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
pub struct SearchAnswer {
    /// Version of the solver.
    pub solver_version: &'static str,
    /// Build of the program. Equal builds on equal processors give equal bytes.
    pub build: &'static str,
    /// True if every variant is computed.
    pub is_complete: bool,
    /// Number of evaluated variants. If a variant is worse than known ones by its geometry alone, its load is not
    /// calculated.
    pub evaluated: u64,
    /// The free fields.
    pub free: Vec<FreeAnswer>,
    /// Pareto front, ordered by the first objective. Its figures are accurate peaks.
    pub front: Vec<FoundAnswer>,
    /// The limits, with the numbers of variants that violate them.
    pub limits: Vec<LimitAnswer>,
    /// Counts of the even scan of all free fields.
    pub scan: ScanAnswer,
    /// If no design meets all limits: the design with the smallest sum of violations.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub nearest_miss: Option<FoundAnswer>,
    /// If no design meets all limits: for each limit that can be relaxed alone, the needed value.
    pub relaxations: Vec<RelaxationAnswer>,
    /// Names of the quantities in the order of the columns.
    #[serde(skip)]
    quantities: Vec<&'static str>,
}

/// A free field.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
pub struct FreeAnswer {
    /// JSON pointer into the design.
    pub pointer: String,
    /// Smallest value of a range.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub min: Option<f64>,
    /// Largest value of a range.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub max: Option<f64>,
    /// Number of values of a list.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub choices: Option<u64>,
}

/// A design that the search found.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
pub struct FoundAnswer {
    /// The complete design document. Every endpoint accepts it.
    pub design: Design,
    /// The quantities of objectives and limits.
    pub quantities: BTreeMap<&'static str, f64>,
}

/// A limit, with the numbers of variants that violate it.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
pub struct LimitAnswer {
    /// Name of the quantity.
    pub quantity: &'static str,
    /// Side of the limit.
    pub bound: Bound,
    /// Value of the limit.
    pub limit: f64,
    /// Variants of the scan that violate it.
    pub fell: u64,
    /// Variants of the scan that violate it alone.
    pub fell_alone: u64,
    /// Designs of the front that are within 1 % of it.
    pub binds: u64,
}

/// Counts of the even scan of all free fields.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
pub struct ScanAnswer {
    /// Number of variants.
    pub variants: u64,
    /// Variants that meet all limits.
    pub good: u64,
    /// Variants that are impossible drives.
    pub impossible: u64,
    /// Reasons for the impossible variants.
    pub reasons: Vec<ReasonAnswer>,
}

/// Needed relaxation of one limit, with all other limits met.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
pub struct RelaxationAnswer {
    /// Name of the quantity.
    pub quantity: &'static str,
    /// Side of the limit.
    pub bound: Bound,
    /// Value of the limit.
    pub limit: f64,
    /// Value nearest to the limit for which a design was found.
    pub needed: f64,
    /// The design with this value.
    pub found: FoundAnswer,
}

impl SearchAnswer {
    pub(crate) fn new<'a>(
        search: &Search,
        template: &Template,
        evaluator: &Evaluator,
        parts: impl Iterator<Item = &'a IslandPart>,
        is_complete: bool,
    ) -> Self {
        let mut scan = Scan::new(search.limits.len());
        let (mut evaluated, mut points) = (0, Vec::new());
        let mut relaxations: Vec<Option<&Point>> = vec![None; search.limits.len()];
        let mut nearest: Option<&Point> = None;
        let beyond = |point: &Point| point.judged.violations.iter().sum::<f64>();
        for part in parts {
            scan.append(&part.scan);
            evaluated += part.evaluated;
            points.extend(part.front.iter().cloned());
            for (limit, (least, own)) in relaxations.iter_mut().zip(&part.relaxations).enumerate() {
                if let Some(own) = own
                    && least.is_none_or(|least| own.judged.violations[limit] < least.judged.violations[limit])
                {
                    *least = Some(own);
                }
            }
            if let Some(own) = &part.nearest
                && nearest.is_none_or(|nearest| beyond(own) < beyond(nearest))
            {
                nearest = Some(own);
            }
        }
        let front = merged(points);
        let mut quantities: Vec<_> = evaluator.quantities.iter().map(|quantity| quantity.name).collect();
        quantities.sort_unstable();
        let name = |limit: &Limit| evaluator.quantities[limit.quantity].name;
        let mut template = search.at_true_peaks.as_ref().unwrap_or(template).clone();
        let free = template.variables().iter().map(FreeAnswer::from).collect();
        let mut found = |point: &Point| FoundAnswer::new(&mut template, evaluator, point);
        let limit_answers = search.limits.iter().zip(scan.fell.iter().zip(&scan.fell_alone));
        let limits = limit_answers.map(|(limit, (&fell, &fell_alone))| LimitAnswer {
            quantity: name(limit),
            bound: limit.bound,
            limit: limit.limit,
            fell,
            fell_alone,
            binds: front.iter().filter(|point| limit.binds(point.values[limit.quantity])).count() as u64,
        });
        let limits = limits.collect();
        let is_impossible = front.is_empty();
        let relaxed = search.limits.iter().zip(&relaxations).filter(|_| is_impossible).filter_map(|(limit, point)| {
            let point = (*point)?;
            let needed = point.values[limit.quantity];
            Some(RelaxationAnswer {
                quantity: name(limit),
                bound: limit.bound,
                limit: limit.limit,
                needed,
                found: found(point)?,
            })
        });
        let relaxations = relaxed.collect();
        let nearest_miss = nearest.filter(|_| is_impossible).and_then(&mut found);
        Self {
            solver_version: toothwave_solver::VERSION,
            build: toothwave_calculation::BUILD,
            is_complete,
            evaluated,
            free,
            front: front.iter().filter_map(&mut found).collect(),
            limits,
            scan: ScanAnswer {
                variants: scan.variants,
                good: scan.good,
                impossible: scan.refused,
                reasons: scan.refusals.iter().map(ReasonAnswer::from).collect(),
            },
            nearest_miss,
            relaxations,
            quantities,
        }
    }

    /// Returns a table with one row for each design of the front: quantities, then the free fields.
    pub(crate) fn table(&self) -> Table<'_> {
        let mut columns: Vec<_> = self.quantities.iter().map(|name| Column::new(*name, Content::Number)).collect();
        columns.extend(self.free.iter().map(|free| {
            let kind = if free.choices.is_some() { Content::Word } else { Content::Number };
            Column::new(free.pointer.as_str(), kind)
        }));
        let rows = self.front.iter().map(|found| {
            let mut row: Vec<_> =
                self.quantities.iter().map(|name| Cell::from(found.quantities.get(name).copied())).collect();
            let design = serde_json::to_value(&found.design).unwrap_or_default();
            row.extend(self.free.iter().map(|free| match design.pointer(&free.pointer) {
                None => Cell::Empty,
                Some(value) => match (value.as_str(), value.as_u64(), value.as_f64()) {
                    (Some(word), ..) => Cell::Word(word.to_owned()),
                    (_, Some(count), _) => Cell::Count(count),
                    (_, _, Some(number)) => Cell::Number(number),
                    _ => Cell::Word(value.to_string()),
                },
            }));
            row
        });
        let length = self.front.len();
        Table { columns, length, rows: Box::new(rows) }
    }
}

impl From<&Variable> for FreeAnswer {
    fn from(variable: &Variable) -> Self {
        let (range, choices) = match variable.domain {
            Domain::Real { min, max } | Domain::Whole { min, max } => (Some((min, max)), None),
            Domain::OneOf(count) => (None, Some(count as u64)),
        };
        let (min, max) = range.unzip();
        Self { pointer: variable.pointer.clone(), min, max, choices }
    }
}

impl FoundAnswer {
    /// Reads the design of a point again, with its quantities.
    pub(super) fn new(template: &mut Template, evaluator: &Evaluator, point: &Point) -> Option<Self> {
        let values = variable_values(template, &point.place);
        let design = template.filled(&values).read::<Design>().ok()?.normalised();
        let quantities = evaluator.quantities.iter().map(|quantity| quantity.name);
        Some(Self { design, quantities: quantities.zip(point.values.iter().copied()).collect() })
    }
}
