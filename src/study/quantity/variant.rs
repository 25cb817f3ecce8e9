//! A variant as its quantities see it.

use toothwave_calculation::sweep::CheckedSweep;
use toothwave_solver::backlash::Backlash;
use toothwave_solver::fingers::FingerStress;
use toothwave_solver::losses::duty::LossTotals;
use toothwave_solver::losses::period::RadialForces;
use toothwave_solver::sweep::{ContactPeaks, Peak, SweepPeaks};
use toothwave_solver::{Contact, Drive, PerContact};

/// Results of a variant, as far as its quantities need them.
#[derive(Debug)]
pub(crate) struct Variant<'a> {
    pub(crate) drive: &'a Drive,
    /// Outer radius of the ring as drawn.
    pub(crate) ring_outer_radius_mm: f64,
    pub(crate) loaded: Option<Loaded<'a>>,
}

/// Results under load.
#[derive(Debug)]
pub(crate) struct Loaded<'a> {
    pub(crate) checked: &'a CheckedSweep,
    pub(crate) peaks: SweepPeaks,
    /// Peaks with the stresses that are means along the teeth.
    pub(crate) mean_peaks: PerContact<ContactPeaks>,
    /// Over all points of a duty; the rest is of its hardest.
    pub(crate) losses: Option<LossTotals>,
    pub(crate) radial_forces: Option<RadialForces>,
    pub(crate) backlash: Option<Backlash>,
}

impl<'a> Loaded<'a> {
    /// Builds the results from the peaks of a sweep, whose stresses are means along the teeth.
    pub(crate) fn new(checked: &'a CheckedSweep, peaks: SweepPeaks, backlash: Option<Backlash>) -> Self {
        let mean_peaks = peaks.contacts;
        Self { checked, peaks: checked.summary_along(peaks), mean_peaks, losses: None, radial_forces: None, backlash }
    }
}

impl Variant<'_> {
    /// Returns a value under load. `Evaluator` has computed it if a quantity needs it.
    pub(super) fn loaded(&self, of: impl Fn(&Loaded<'_>) -> f64) -> f64 {
        self.loaded.as_ref().map_or(f64::NAN, of)
    }

    pub(super) fn peaks(&self, contact: Contact, of: impl Fn(&ContactPeaks) -> f64) -> f64 {
        self.loaded(|loaded| of(loaded.peaks.contacts.get(contact)))
    }

    pub(super) fn greatest(&self, of: impl Fn(&ContactPeaks) -> f64) -> f64 {
        self.loaded(|loaded| loaded.peaks.contacts.iter().map(|(_, peaks)| of(peaks)).fold(f64::NEG_INFINITY, f64::max))
    }

    pub(super) fn capacity(&self, of: impl Fn(f64, f64) -> f64) -> f64 {
        self.loaded(|loaded| {
            let capacity = loaded.peaks.torque_capacity.as_ref();
            capacity.map_or(f64::NAN, |capacity| of(capacity.input_torque_nm, capacity.output_torque_nm))
        })
    }

    /// Returns a value of the carrier's fingers, NaN if they are not calculated.
    pub(super) fn fingers(&self, of: impl Fn(&FingerStress) -> Option<f64>) -> f64 {
        self.loaded(|loaded| {
            loaded.checked.finger_stress(&loaded.mean_peaks).as_ref().and_then(&of).unwrap_or(f64::NAN)
        })
    }

    pub(super) fn losses(&self, of: impl Fn(&LossTotals) -> f64) -> f64 {
        self.loaded(|loaded| loaded.losses.as_ref().map_or(f64::NAN, &of))
    }

    pub(super) fn backlash(&self, of: impl Fn(&Backlash) -> f64) -> f64 {
        self.loaded(|loaded| loaded.backlash.as_ref().map_or(f64::NAN, &of))
    }

    pub(super) fn pressure_velocity(&self, contact: Contact) -> f64 {
        let value = |peaks: PerContact<Peak>| peaks.get(contact).value;
        self.losses(|losses| losses.pressure_velocity_mpa_m_per_s.map_or(f64::NAN, value))
    }
}

pub(super) fn most(column: &[f64]) -> f64 {
    column.iter().copied().fold(f64::NEG_INFINITY, f64::max)
}
