//! One period of the input angle: columns of tooth states, peaks, residuals, wind-up, capacity.

mod adaptive;
mod columns;
mod fast;
mod plain;
mod points;

use crate::drive::Drive;
use crate::load_sharing::{LoadCase, LoadedDrive};
use crate::{SolveError, Stop};

pub use columns::{
    ContactPeaks, Extremes, InputAngles, Peak, PeakShear, States, Sweep, SweepPeaks, TorqueBalance, TorqueCapacity,
};
pub use points::{Points, Tolerance};

/// The sweep over one period.
///
/// # Errors
/// [`SolveError::NoToothInMesh`] and [`SolveError::ComplianceNotPositive`] where no finite forces exist,
/// [`SolveError::TooManyStates`] at a tolerance that takes more of them than allowed,
/// [`SolveError::Inconsistent`] where the answer's own checks say that it is wrong,
/// [`SolveError::Stopped`] when `stop` says so.
pub fn sweep(drive: &Drive, load: &LoadCase, points: Points, stop: &impl Stop) -> Result<Sweep, SolveError> {
    let loaded = LoadedDrive::new(drive, load)?;
    // The capacity is worked out tooth by tooth.
    if let (Points::Samples(samples), None) = (points, load.parameters().allowable_stress_mpa)
        && let Some(columns) = fast::sweep(&loaded, samples, stop)?
    {
        return columns::finished(&loaded, points, columns, None);
    }
    plain::sweep(&loaded, load, points, stop)
}

/// What the sweep over one period comes to, without its states: the same peaks, in less time.
///
/// # Errors
/// As [`sweep`].
pub fn peaks(drive: &Drive, load: &LoadCase, points: Points, stop: &impl Stop) -> Result<SweepPeaks, SolveError> {
    sweep(drive, load, points, stop).map(|sweep| SweepPeaks::from(&sweep))
}

/// The same sweep, state by state: what the fast path is held against, and what is left where it does not reach.
///
/// # Errors
/// As [`sweep`].
pub fn sweep_plain(drive: &Drive, load: &LoadCase, points: Points, stop: &impl Stop) -> Result<Sweep, SolveError> {
    plain::sweep(&LoadedDrive::new(drive, load)?, load, points, stop)
}
