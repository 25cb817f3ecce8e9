//! Strength of the carrier's fingers in the answer of a sweep.

use std::io::{self, Write};

use toothwave_solver::backing::Backings;
use toothwave_solver::fingers::{CarrierFingers, FingerStress};
use toothwave_solver::losses::duty::LossTotals;
use toothwave_solver::sweep::{ContactPeaks, SweepPeaks, TorqueCapacity};
use toothwave_solver::{Contact, Drive, LoadCase, PerContact, SolveError};

use crate::design::Design;
use crate::json::word;
use crate::no_answer::NoAnswer;
use crate::sweep::CheckedSweep;

pub(super) fn write_text(stress: &FingerStress, writer: &mut dyn Write) -> io::Result<()> {
    let support = word(&stress.fingers).replace('_', " ");
    writeln!(writer, "\nfingers of the carrier              {support}")?;
    writeln!(writer, "stress at their feet                {:.1} MPa", stress.stress_mpa)?;
    if let Some((yielding, fatigue)) = stress.yield_safety.zip(stress.fatigue_safety) {
        writeln!(writer, "safety against yield, fatigue       {yielding:.2}, {fatigue:.2}")?;
    }
    Ok(())
}

impl CheckedSweep {
    /// Runs a sweep whose torque capacity respects the fingers of the carrier.
    pub(super) fn limited<S>(
        &self,
        run: impl Fn(&LoadCase) -> Result<S, SolveError>,
        capacity: fn(&mut S) -> &mut Option<TorqueCapacity>,
    ) -> Result<S, SolveError> {
        match &self.fingers {
            Some(fingers) => fingers.limited(self.load(), run, capacity),
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
    pub fn summary_along(&self, mut peaks: SweepPeaks) -> SweepPeaks {
        if let Some(fingers) = &self.fingers {
            peaks.contacts = fingers.peaks_along(&peaks.contacts);
        }
        peaks
    }

    /// Returns losses with pressure and wear at the most loaded place along the teeth.
    pub(super) fn losses_along(&self, mut totals: LossTotals) -> LossTotals {
        let Some(fingers) = &self.fingers else { return totals };
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
