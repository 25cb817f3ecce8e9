//! Evaluation of one variant: from its document to its quantities, or to the reason why it has none.

use std::panic::{self, AssertUnwindSafe};

use serde::{Deserialize, Serialize};
use toothwave_calculation::coincidence_degree::CoincidenceDegree;
use toothwave_calculation::design::Design;
use toothwave_calculation::json::{Tree, word};
use toothwave_calculation::no_answer::{NoAnswer, NoAnswerCode};
use toothwave_calculation::question::{Limits, Question as _};
use toothwave_calculation::sweep::{CheckedSweep, Sweep};
use toothwave_solver::parts::{LEAST_WALL, RIM};
use toothwave_solver::{Drive, Parameter, Part, SolveError, Stop, Violation};
use utoipa::ToSchema;

use crate::quantity::{Loaded, OUTER_DIAMETER_MM, Quantity, Takes, Variant};

/// Reason for a variant without an answer.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize, ToSchema)]
pub struct Reason {
    /// Code of the field's error, code of the problem if no field is wrong, `not_calculated` or `panic`.
    pub code: String,
    /// JSON pointer to the wrong field. For an entry of a list it is the list; without a field it is empty.
    pub pointer: String,
}

/// A variant without an answer.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Refusal {
    pub(crate) reason: Reason,
    pub(crate) detail: String,
}

/// Outcome of a variant.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Outcome {
    /// The quantities, in the requested order; NaN for one that this drive does not have.
    Answered(Vec<f64>),
    /// The reason why there are none.
    Refused(Refusal),
}

impl Refusal {
    fn not_calculated(detail: String) -> Self {
        Self { reason: Reason { code: "not_calculated".into(), pointer: String::new() }, detail }
    }
}

impl Outcome {
    /// Refuses a drive that lacks one of these quantities.
    pub(crate) fn with_all(self, quantities: &[&'static Quantity]) -> Self {
        let Self::Answered(values) = &self else { return self };
        let Some((_, quantity)) = values.iter().zip(quantities).find(|(value, _)| value.is_nan()) else { return self };
        let detail = format!("this drive has no `{}`: {}", quantity.name, quantity.meaning);
        Self::Refused(Refusal::not_calculated(detail))
    }
}

/// The stop flag was set before a variant was computed. The state is the same as before.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Stopped;

/// Reason for missing values.
enum NoValues {
    Stopped,
    CannotImprove,
    NoAnswer(NoAnswer),
}

impl<E: Into<NoAnswer>> From<E> for NoValues {
    fn from(error: E) -> Self {
        match error.into() {
            NoAnswer { code: NoAnswerCode::Stopped, .. } => Self::Stopped,
            reason => Self::NoAnswer(reason),
        }
    }
}

/// The quantities of a study, with the computations that they need.
#[derive(Debug, Clone)]
pub(crate) struct Evaluator {
    pub(crate) quantities: Vec<&'static Quantity>,
    takes_outer_diameter: bool,
    pub(crate) takes_sweep: bool,
    takes_losses: bool,
    takes_radial_forces: bool,
    takes_backlash: bool,
    limits: Limits,
}

impl Evaluator {
    pub(crate) fn new(quantities: Vec<&'static Quantity>, limits: Limits) -> Self {
        let takes = |takes| quantities.iter().any(|quantity| quantity.takes == takes);
        Self {
            takes_outer_diameter: quantities.iter().any(|quantity| quantity.name == OUTER_DIAMETER_MM),
            takes_sweep: quantities.iter().any(|quantity| quantity.takes != Takes::Drive),
            takes_losses: takes(Takes::Losses),
            takes_radial_forces: takes(Takes::RadialForces),
            takes_backlash: takes(Takes::Backlash),
            quantities,
            limits,
        }
    }

    /// Returns the outcome of a document. A panic is an outcome too.
    pub(crate) fn outcome(&self, document: &Tree, stop: &dyn Stop) -> Result<Outcome, Stopped> {
        self.outcome_unless(|_| false, document, stop)
    }

    /// Returns the outcome of a document. If its drive cannot improve the search, it is refused before the load is calculated.
    /// `cannot_improve` can ask for the quantities, NaN for those that need a load.
    pub(crate) fn outcome_unless(
        &self,
        cannot_improve: impl Fn(&dyn Fn() -> Vec<f64>) -> bool,
        document: &Tree,
        stop: &dyn Stop,
    ) -> Result<Outcome, Stopped> {
        caught(|| match self.answer(&cannot_improve, document, stop) {
            Ok(values) => Ok(Outcome::Answered(values)),
            Err(NoValues::Stopped) => Err(Stopped),
            Err(NoValues::CannotImprove) => Ok(Outcome::Refused(Refusal::not_calculated(String::new()))),
            Err(NoValues::NoAnswer(reason)) => Ok(Outcome::Refused(reason.into())),
        })
    }

    fn answer(
        &self,
        cannot_improve: &impl Fn(&dyn Fn() -> Vec<f64>) -> bool,
        document: &Tree,
        stop: &dyn Stop,
    ) -> Result<Vec<f64>, NoValues> {
        let design = document.read::<Design>()?.normalised();
        if !self.takes_sweep {
            let drive = CoincidenceDegree.check(&design, &self.limits)?;
            let ring_outer_radius_mm = self.ring_outer_radius_mm(&design, &drive)?;
            return Ok(self.values(&Variant { drive: &drive, ring_outer_radius_mm, loaded: None })?);
        }
        let checked = Sweep.check(&design, &self.limits)?.without_wear();
        let drive = checked.drive();
        let ring_outer_radius_mm = self.ring_outer_radius_mm(&design, drive)?;
        if cannot_improve(&|| self.values_of_drive(&Variant { drive, ring_outer_radius_mm, loaded: None })) {
            return Err(NoValues::CannotImprove);
        }
        let takes_columns = self.takes_losses || self.takes_radial_forces;
        let loaded = self.loaded(&checked, takes_columns, stop)?;
        Ok(self.values(&Variant { drive, ring_outer_radius_mm, loaded: Some(loaded) })?)
    }

    fn loaded<'a>(
        &self,
        checked: &'a CheckedSweep,
        takes_columns: bool,
        stop: &dyn Stop,
    ) -> Result<Loaded<'a>, NoAnswer> {
        let backlash = self.takes_backlash.then(|| checked.backlash(stop)).transpose()?;
        if !takes_columns {
            return Ok(Loaded::new(checked, checked.peaks(stop)?, backlash));
        }
        let sweep = checked.solve(stop)?;
        let losses = if self.takes_losses { checked.loss_totals(&sweep, stop)? } else { None };
        let radial_forces = if self.takes_radial_forces { checked.radial_forces(&sweep, stop)? } else { None };
        Ok(Loaded { losses, radial_forces, ..Loaded::new(checked, (&sweep).into(), backlash) })
    }

    /// Outer radius of the ring as it is drawn (docs/explanation/theory.md section 8). An impossible ring has no outer diameter.
    fn ring_outer_radius_mm(&self, design: &Design, drive: &Drive) -> Result<f64, NoAnswer> {
        let parts = design.parts_parameters()?;
        let root_radius_mm = drive.root_radius_mm() + 1e-3 * parts.ring_clearance_um;
        let value = parts.ring_outer_radius_mm.unwrap_or(RIM * root_radius_mm);
        let limit = root_radius_mm * (1.0 + LEAST_WALL);
        if !self.takes_outer_diameter {
            return Ok(value);
        }
        let out_of_range = Parameter::PartClearance(Part::Ring).check(parts.ring_clearance_um);
        let out_of_range = out_of_range
            .or_else(|| parts.ring_outer_radius_mm.and_then(|radius| Parameter::RingOuterRadius.check(radius)));
        match out_of_range.or_else(|| (value <= limit).then(|| Violation::ring_without_rim(value, limit))) {
            Some(violation) => Err(NoAnswer::impossible(&[violation])),
            None => Ok(value),
        }
    }

    /// Returns the quantities that need no load, NaN for all others.
    fn values_of_drive(&self, variant: &Variant<'_>) -> Vec<f64> {
        let value = |quantity: &Quantity| match quantity.takes {
            Takes::Drive => quantity.of(variant).unwrap_or(f64::NAN),
            _ => f64::NAN,
        };
        self.quantities.iter().map(|quantity| value(quantity)).collect()
    }

    fn values(&self, variant: &Variant<'_>) -> Result<Vec<f64>, NoAnswer> {
        let value = |quantity: &&Quantity| match quantity.of(variant).map_err(SolveError::from) {
            Ok(value) if value.is_finite() || (value.is_nan() && quantity.may_be_absent) => Ok(value),
            Ok(_) => Err(NoAnswer::internal(format_args!("`{}` is not finite", quantity.name))),
            Err(error) => Err(error.into()),
        };
        self.quantities.iter().map(value).collect()
    }
}

impl From<NoAnswer> for Refusal {
    fn from(NoAnswer { code, detail, errors }: NoAnswer) -> Self {
        let reason = match errors.first() {
            Some(error) => Reason { code: word(&error.code), pointer: without_entry(&error.pointer).into() },
            None => Reason { code: word(&code), pointer: String::new() },
        };
        let detail = errors.into_iter().next().map_or(detail, |error| error.detail);
        Self { reason, detail }
    }
}

/// Removes the index of a list entry. Otherwise each of thousands of teeth would be a separate reason.
fn without_entry(pointer: &str) -> &str {
    match pointer.rsplit_once('/') {
        Some((list, entry)) if entry.parse::<u64>().is_ok() => list,
        _ => pointer,
    }
}

/// Catches a panic, so that the other variants still get answers.
fn caught(job: impl FnOnce() -> Result<Outcome, Stopped>) -> Result<Outcome, Stopped> {
    panic::catch_unwind(AssertUnwindSafe(job)).unwrap_or_else(|panic| {
        let text = panic.downcast_ref::<String>().map(String::as_str);
        let text = text.or_else(|| panic.downcast_ref::<&str>().copied()).unwrap_or("no text");
        let reason = Reason { code: "panic".into(), pointer: String::new() };
        Ok(Outcome::Refused(Refusal { reason, detail: text.into() }))
    })
}

#[cfg(test)]
mod tests {
    use super::{Outcome, caught};

    #[test]
    fn panic_of_variant_is_its_reason() {
        let outcome = caught(|| panic!("on purpose"));
        assert!(
            matches!(outcome, Ok(Outcome::Refused(refusal)) if refusal.reason.code == "panic" && refusal.detail == "on purpose")
        );
    }
}
