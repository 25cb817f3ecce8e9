//! Where a sweep looks.

use crate::mesh::Samples;
use crate::violation::{Parameter, Violation};

/// Where a sweep looks.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Points {
    /// So many equal intervals of one period, both ends included.
    Samples(Samples),
    /// Wherever it takes to find the true extremes to a tolerance.
    Tolerance(Tolerance),
}

impl Points {
    /// So many equal intervals of one period.
    ///
    /// # Errors
    /// As [`Samples::new`].
    pub fn samples(count: u64) -> Result<Self, Violation> {
        Samples::new(count).map(Self::Samples)
    }

    /// Wherever it takes to find the true extremes to a tolerance, with so many states worked out on the way at most.
    ///
    /// # Errors
    /// As [`Tolerance::new`].
    pub fn tolerance(relative: f64, max_states: u64) -> Result<Self, Violation> {
        Tolerance::new(relative, max_states).map(Self::Tolerance)
    }

    /// The same to the finest tolerance that there is.
    pub const fn finest(max_states: u64) -> Self {
        let relative = Parameter::SweepTolerance.range().low;
        Self::Tolerance(Tolerance { relative, max_states, looks_without_load: false })
    }

    /// The same, where a tolerance is given also with the input angles at which the wind-up without load is least and largest.
    #[must_use]
    pub const fn also_without_load(self) -> Self {
        match self {
            Self::Samples(_) => self,
            Self::Tolerance(tolerance) => Self::Tolerance(Tolerance { looks_without_load: true, ..tolerance }),
        }
    }
}

/// How true the extremes of a sweep are to be.
///
/// The relative tolerance holds for the largest value of every force and stress, for the least and the largest of wind-up and torsional
/// stiffness and for the torque capacity; its root for the places where they stand and for half-widths; of the transmission error the
/// tolerance times the wind-up; the same without load, where it is looked for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Tolerance {
    relative: f64,
    max_states: u64,
    looks_without_load: bool,
}

impl Tolerance {
    /// Checks the tolerance.
    ///
    /// # Errors
    /// A tolerance out of its range.
    pub fn new(relative: f64, max_states: u64) -> Result<Self, Violation> {
        Parameter::SweepTolerance
            .check(relative)
            .map_or(Ok(Self { relative, max_states, looks_without_load: false }), Err)
    }

    /// The relative tolerance.
    pub const fn relative(&self) -> f64 {
        self.relative
    }

    /// Whether the extremes of the wind-up without load are looked for too.
    pub(crate) const fn looks_without_load(&self) -> bool {
        self.looks_without_load
    }

    /// Most states that may be worked out.
    pub const fn max_states(&self) -> u64 {
        self.max_states
    }
}
