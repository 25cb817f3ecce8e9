//! Strength of the carrier's fingers in the answer of a sweep.

use toothwave_solver::fingers::{CarrierFingers, FingerStress};
use toothwave_solver::losses::duty::LossTotals;
use toothwave_solver::sweep::{ContactPeaks, SweepPeaks, TorqueCapacity};
use toothwave_solver::{Contact, LoadCase, PerContact, SolveError};

use crate::sweep::CheckedSweep;

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
