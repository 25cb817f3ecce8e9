//! An island: a search of its own, whose front is merged with the others.

use serde::{Deserialize, Serialize};
use toothwave_solver::Stop;

use super::{SCAN_SHARE, Search, TRUE_EVALUATIONS};
use crate::evaluate::{Evaluator, Outcome, Stopped};
use crate::optimise::{Optimiser, Plan};
use crate::point::{Judged, Point};
use crate::rows::{RefusalNoted, note};
use crate::variant::{Template, Value};

/// Result of an island.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct IslandPart {
    pub(super) evaluated: u64,
    pub(super) front: Vec<Point>,
    pub(super) relaxations: Vec<Option<Point>>,
    pub(super) nearest: Option<Point>,
    pub(super) scan: Scan,
}

/// Counts of the scan.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct Scan {
    pub(super) variants: u64,
    pub(super) good: u64,
    /// For each limit, the variants that violate it, and those that violate it alone.
    pub(super) fell: Vec<u64>,
    pub(super) fell_alone: Vec<u64>,
    pub(super) refused: u64,
    pub(super) refusals: Vec<RefusalNoted>,
}

impl Scan {
    pub(super) fn new(limits: usize) -> Self {
        Self { fell: vec![0; limits], fell_alone: vec![0; limits], ..Self::default() }
    }

    fn add(&mut self, judged: &Judged) {
        let beyond = || judged.violations.iter().enumerate().filter(|(_, violation)| **violation > 0.0);
        let count = beyond().count();
        self.good += u64::from(count == 0);
        for (limit, _) in beyond() {
            self.fell[limit] += 1;
            self.fell_alone[limit] += u64::from(count == 1);
        }
    }

    pub(super) fn append(&mut self, other: &Self) {
        self.variants += other.variants;
        self.good += other.good;
        self.refused += other.refused;
        for (sum, count) in self.fell.iter_mut().zip(&other.fell) {
            *sum += count;
        }
        for (sum, count) in self.fell_alone.iter_mut().zip(&other.fell_alone) {
            *sum += count;
        }
        for RefusalNoted { reason, detail, first, count } in &other.refusals {
            let refusal = crate::evaluate::Refusal { reason: reason.clone(), detail: detail.clone() };
            note(&mut self.refusals, *first, *count, refusal);
        }
    }
}

/// An island that is being computed.
#[derive(Debug)]
pub(crate) struct Island {
    optimiser: Optimiser,
    template: Template,
    is_true: bool,
    /// A proposed point, and true if it belongs to the scan.
    pending: Option<(Vec<f64>, bool)>,
    evaluated: u64,
    scan: Scan,
    scan_from: u64,
}

impl Island {
    pub(crate) fn new(search: &Search, template: Template, island: u64) -> Self {
        // The first islands have one more evaluation each, so that the sum is the requested number.
        let evaluations = search.evaluations / search.islands + u64::from(island < search.evaluations % search.islands);
        let scan = evaluations / SCAN_SHARE;
        let scan_from = island * (search.evaluations.div_ceil(search.islands) / SCAN_SHARE + 1);
        let plan =
            Plan { dimensions: template.variables().len(), limits: search.limits.len(), scan_from, scan, evaluations };
        Self {
            optimiser: Optimiser::new(plan, search.start.clone(), search.seed, island),
            template,
            is_true: false,
            pending: None,
            evaluated: 0,
            scan: Scan::new(search.limits.len()),
            scan_from,
        }
    }

    /// Computes one variant. Returns true if it was the last one.
    pub(crate) fn step(&mut self, search: &Search, evaluator: &Evaluator, stop: &dyn Stop) -> Result<bool, Stopped> {
        // A point that was interrupted is computed again.
        let (place, is_scanning) = match self.pending.take() {
            Some(pending) => pending,
            None => {
                let is_scanning = self.optimiser.is_scanning();
                (self.optimiser.ask(), is_scanning)
            }
        };
        let values: Vec<Value> = variable_values(&self.template, &place);
        // The scan counts the violations of all limits.
        let cannot_improve = |values: &dyn Fn() -> Vec<f64>| {
            !is_scanning && self.optimiser.cannot_improve(&search.least_judged(&values()))
        };
        let outcome = match evaluator.outcome_unless(cannot_improve, self.template.filled(&values), stop) {
            Ok(outcome) => outcome.with_all(&evaluator.quantities),
            Err(interrupted) => {
                self.pending = Some((place, is_scanning));
                return Err(interrupted);
            }
        };
        self.evaluated += 1;
        let variant = self.scan_from + self.scan.variants;
        self.scan.variants += u64::from(is_scanning);
        match outcome {
            Outcome::Answered(values) => {
                let judged = search.judged(&values);
                if is_scanning {
                    self.scan.add(&judged);
                }
                self.optimiser.tell(Some(Point { place, judged, values }));
            }
            Outcome::Refused(refusal) => {
                if is_scanning {
                    self.scan.refused += 1;
                    note(&mut self.scan.refusals, variant, 1, refusal);
                }
                self.optimiser.tell(None);
            }
        }
        if !self.optimiser.is_over() {
            return Ok(false);
        }
        match &search.at_true_peaks {
            Some(template) if !self.is_true && evaluator.takes_sweep => {
                self.is_true = true;
                self.template = template.clone();
                self.optimiser.judge_anew(TRUE_EVALUATIONS);
                Ok(self.optimiser.is_over())
            }
            _ => Ok(true),
        }
    }

    pub(crate) fn finish(self) -> IslandPart {
        IslandPart {
            evaluated: self.evaluated,
            front: self.optimiser.front().to_vec(),
            relaxations: self.optimiser.relaxations().to_vec(),
            nearest: self.optimiser.nearest().cloned(),
            scan: self.scan,
        }
    }
}

pub(super) fn variable_values(template: &Template, place: &[f64]) -> Vec<Value> {
    template.variables().iter().zip(place).map(|(variable, &share)| variable.at_share(share)).collect()
}

impl IslandPart {
    /// Estimated memory in bytes.
    pub(crate) fn bytes(&self) -> usize {
        let points = self.front.iter().chain(self.relaxations.iter().flatten()).chain(&self.nearest);
        let places = size_of_val(self.relaxations.as_slice()) + size_of_val(self.front.as_slice());
        places
            + points.map(Point::bytes).sum::<usize>()
            + self.scan.refusals.iter().map(RefusalNoted::bytes).sum::<usize>()
    }

    pub(crate) const fn evaluated(&self) -> u64 {
        self.evaluated
    }

    pub(crate) const fn refused(&self) -> u64 {
        self.scan.refused
    }
}
