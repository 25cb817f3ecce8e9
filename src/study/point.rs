//! A point of the optimiser with its evaluation.

use serde::{Deserialize, Serialize};

/// Evaluation of a point.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Judged {
    /// Objectives, all to be minimised.
    pub objectives: Vec<f64>,
    /// Violation of each limit as a fraction of it; 0 if the limit is met.
    pub violations: Vec<f64>,
}

/// A point with its evaluation.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Point {
    /// Position in the unit cube.
    pub place: Vec<f64>,
    /// Evaluation.
    pub judged: Judged,
    /// Further values of the caller.
    pub values: Vec<f64>,
}

impl Point {
    /// Estimated heap memory in bytes.
    pub(crate) fn bytes(&self) -> usize {
        let Judged { violations, objectives } = &self.judged;
        [&self.place, violations, objectives, &self.values].iter().map(|of| size_of_val(of.as_slice())).sum()
    }
}

impl Judged {
    pub(crate) fn is_good(&self) -> bool {
        self.violations.iter().all(|&violation| violation <= 0.0)
    }

    /// Returns the sum of the violations without the relaxed limit, and the violation of the relaxed limit.
    pub(crate) fn beyond(&self, relaxed: Option<usize>) -> (f64, f64) {
        let own = relaxed.map_or(0.0, |limit| self.violations[limit]);
        let others = self.violations.iter().enumerate().filter(|&(limit, _)| Some(limit) != relaxed);
        (others.map(|(_, violation)| violation).sum(), own)
    }

    /// True if no objective is worse.
    pub(crate) fn covers(&self, other: &Self) -> bool {
        self.objectives.iter().zip(&other.objectives).all(|(one, other)| one <= other)
    }

    /// True if it may replace the other one.
    pub(crate) fn is_no_worse(&self, other: &Self, relaxed: Option<usize>) -> bool {
        let (own, others) = (self.beyond(relaxed), other.beyond(relaxed));
        if own > (0.0, 0.0) || others > (0.0, 0.0) { own <= others } else { !other.covers(self) || self.covers(other) }
    }
}
