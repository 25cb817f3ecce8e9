//! Strength of the carrier's fingers in the answer of a sweep.

use std::io::{self, Write};

use serde::Serialize;
use toothwave_solver::backing::Backings;
use toothwave_solver::fingers::{CarrierFingers, FingerStress, Fingers, Limited, Safety};
use toothwave_solver::losses::duty::LossTotals;
use toothwave_solver::sweep::{ContactPeaks, SweepPeaks};
use toothwave_solver::{Contact, Drive, LoadCase, PerContact, SolveError};
use utoipa::ToSchema;

use crate::design::Design;
use crate::json::word;
use crate::no_answer::NoAnswer;
use crate::sweep::CheckedSweep;

/// Strength of the carrier's fingers, under the largest force of a tooth (docs/explanation/theory.md section 4.12).
#[derive(Debug, Clone, Copy, PartialEq, Serialize, ToSchema)]
pub struct FingersAnswer {
    /// Support of the fingers.
    pub fingers: Fingers,
    /// Thickness of a finger across the slots, at the middle of its height, in mm.
    pub thickness_mm: f64,
    /// Height of a finger along the radius, in mm.
    pub height_mm: f64,
    /// Radius of the fillet at its foot, in mm.
    pub fillet_radius_mm: f64,
    /// Largest load per length along a tooth over its mean. Contact stresses grow with its square root.
    pub load_peak_over_mean: f64,
    /// Bending moment at the foot, in N·mm.
    pub moment_nmm: f64,
    /// Bending stress without the notch, in MPa.
    pub nominal_stress_mpa: f64,
    /// Largest stress in the fillet, in MPa.
    pub stress_mpa: f64,
    /// The lesser of both safeties. Only with `parts.carrier.strength`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub safety: Option<f64>,
    /// Safety against yield, or against breaking if the material is hardened. Only with `parts.carrier.strength`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub yield_safety: Option<f64>,
    /// Safety against fatigue. Only with `parts.carrier.strength`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub fatigue_safety: Option<f64>,
}

impl FingersAnswer {
    pub(super) fn new(fingers: &CarrierFingers, stress: &FingerStress) -> Self {
        let beam = fingers.beam();
        Self {
            fingers: fingers.fingers(),
            thickness_mm: beam.thickness_mm,
            height_mm: beam.height_mm,
            fillet_radius_mm: fingers.fillet_radius_mm(),
            load_peak_over_mean: fingers.load_peak_over_mean(),
            moment_nmm: stress.moment_nmm,
            nominal_stress_mpa: stress.nominal_mpa,
            stress_mpa: stress.largest_mpa,
            safety: stress.safety.as_ref().map(Safety::least),
            yield_safety: stress.safety.map(|safety| safety.yielding),
            fatigue_safety: stress.safety.map(|safety| safety.fatigue),
        }
    }

    pub(super) fn write_text(&self, writer: &mut dyn Write) -> io::Result<()> {
        let support = word(&self.fingers).replace('_', " ");
        writeln!(writer, "\nfingers of the carrier              {support}")?;
        writeln!(writer, "stress at their feet                {:.1} MPa", self.stress_mpa)?;
        if let Some((yielding, fatigue)) = self.yield_safety.zip(self.fatigue_safety) {
            writeln!(writer, "safety against yield, fatigue       {yielding:.2}, {fatigue:.2}")?;
        }
        Ok(())
    }
}

impl CheckedSweep {
    /// Runs a sweep whose torque capacity respects the fingers of the carrier.
    pub(super) fn limited<S: Limited>(
        &self,
        run: impl Fn(&LoadCase) -> Result<S, SolveError>,
    ) -> Result<S, SolveError> {
        match &self.fingers {
            Some(fingers) => fingers.limited(self.load(), run),
            None => run(self.load()),
        }
    }

    /// Returns the stress of the carrier's fingers, if they are calculated.
    pub fn finger_stress(&self, peaks: &PerContact<ContactPeaks>) -> Option<FingerStress> {
        let output_torque_nm = self.load().output_torque_nm(&self.drive);
        self.fingers.as_ref().map(|fingers| fingers.stress(peaks.carrier.force_n.value, output_torque_nm))
    }

    /// Returns the largest load per length along a tooth over its mean.
    pub(super) fn load_peak_over_mean(&self) -> f64 {
        self.fingers.as_ref().map_or(1.0, CarrierFingers::load_peak_over_mean)
    }

    /// Returns the summary of a sweep with the stresses at the most loaded place along the teeth.
    pub fn summary_along(&self, peaks: SweepPeaks) -> SweepPeaks {
        match &self.fingers {
            Some(fingers) => fingers.summary_along(peaks),
            None => peaks,
        }
    }

    pub(super) fn losses_along(&self, totals: LossTotals) -> LossTotals {
        match &self.fingers {
            Some(fingers) => losses_along(fingers, totals),
            None => totals,
        }
    }
}

/// Returns the fingers of the carrier, if they are calculated.
pub(super) fn checked(
    design: &Design,
    drive: &Drive,
    backings: &Backings,
    load: &LoadCase,
) -> Result<Option<CarrierFingers>, NoAnswer> {
    let parameters = design.finger_parameters().map_err(|violations| NoAnswer::impossible(&violations))?;
    let fingers = backings.finger().map(|&beam| CarrierFingers::new(drive, beam, parameters, load.parameters()));
    Ok(fingers.transpose().map_err(SolveError::from)?)
}

/// Returns losses with pressure and wear at the most loaded place along the teeth.
fn losses_along(fingers: &CarrierFingers, mut totals: LossTotals) -> LossTotals {
    for contact in Contact::all() {
        if let Some(products) = &mut totals.pressure_velocity_mpa_m_per_s {
            products.get_mut(contact).value *= fingers.stress_factor(contact);
        }
        if let Some(worn) = &mut totals.wear_mm_per_hour {
            worn.get_mut(contact).value *= fingers.load_peak_over_mean();
        }
    }
    totals
}
