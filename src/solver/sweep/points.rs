//! Input angles of a sweep.

use crate::mesh::Samples;
use crate::violation::{Parameter, Violation};

/// Input angles of a sweep.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Points {
    /// Equal intervals of one period, both ends included.
    Samples(Samples),
    /// Input angles chosen so that the true extremes are found to a tolerance.
    Tolerance(Tolerance),
}

impl Points {
    /// Returns equal intervals of one period.
    ///
    /// # Errors
    /// As [`Samples::new`].
    pub fn samples(count: u64) -> Result<Self, Violation> {
        Samples::new(count).map(Self::Samples)
    }

    /// Returns a tolerance for the true extremes, with a limit of evaluated states.
    ///
    /// ```
    /// use toothwave_solver::sweep::{Points, sweep};
    /// # use toothwave_solver::{Drive, DriveParameters, LoadCase, LoadParameters, Never};
    /// let drive = Drive::new(&DriveParameters::default()).unwrap();
    /// let load = LoadCase::new(&LoadParameters::default()).unwrap();
    ///
    /// let points = Points::tolerance(1e-6, 1_000_000).unwrap();
    /// let peak = sweep(&drive, &load, points, &Never).unwrap().peaks.ring.force_n;
    /// let sampled = sweep(&drive, &load, Points::samples(100).unwrap(), &Never).unwrap().peaks.ring.force_n;
    /// assert!(peak.value >= (1.0 - 1e-6) * sampled.value);
    /// ```
    ///
    /// # Errors
    /// As [`Tolerance::new`].
    pub fn tolerance(relative: f64, max_states: u64) -> Result<Self, Violation> {
        Tolerance::new(relative, max_states).map(Self::Tolerance)
    }

    /// Returns the finest tolerance.
    pub const fn finest(max_states: u64) -> Self {
        let relative = Parameter::SweepTolerance.range().low;
        Self::Tolerance(Tolerance { relative, max_states, looks_without_load: false })
    }

    /// Also searches for the input angles with the least and the largest wind-up without load. Needs a tolerance.
    #[must_use]
    pub const fn also_without_load(self) -> Self {
        match self {
            Self::Samples(_) => self,
            Self::Tolerance(tolerance) => Self::Tolerance(Tolerance { looks_without_load: true, ..tolerance }),
        }
    }
}

/// Accuracy of the extremes of a sweep.
///
/// The relative tolerance applies to the largest value of every force and stress, and to the torque capacity. It also
/// applies to the least and the largest wind-up and torsional stiffness. Its square root applies to the positions of
/// the extremes and to half-widths. The error of the transmission error is the tolerance times the wind-up. The same
/// holds without load, if that is searched for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Tolerance {
    relative: f64,
    /// Largest number of states that may be evaluated.
    pub(crate) max_states: u64,
    /// True if the extremes of the wind-up without load are searched for too.
    pub(crate) looks_without_load: bool,
}

impl Tolerance {
    /// Checks the tolerance.
    ///
    /// # Errors
    /// Fails if the tolerance is out of its range.
    pub fn new(relative: f64, max_states: u64) -> Result<Self, Violation> {
        Parameter::SweepTolerance
            .check(relative)
            .map_or(Ok(Self { relative, max_states, looks_without_load: false }), Err)
    }

    /// Returns the relative tolerance.
    pub const fn relative(&self) -> f64 {
        self.relative
    }
}
