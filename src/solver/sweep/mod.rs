//! One period of the input angle: columns of tooth states, peaks, residuals, wind-up, capacity.

mod adaptive;
mod columns;
mod fast;
mod plain;
mod points;

use crate::contact::PerContact;
use crate::drive::Drive;
use crate::load_sharing::{LoadCase, LoadedDrive};
use crate::mesh::Samples;
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
    if let Some(samples) = fast_samples(&loaded, load, points)
        && let Some(columns) = fast::sweep(&loaded, samples, stop)?
    {
        let mut sweep = columns::finished(&loaded, points, columns, None)?;
        sweep.torque_capacity = capacity_in_proportion(&loaded, load, &sweep.peaks);
        return Ok(sweep);
    }
    plain::sweep(&loaded, load, points, stop)
}

/// What the sweep over one period comes to, without its states: the same peaks, in less time. That the period closes is not looked at.
///
/// # Errors
/// As [`sweep`].
pub fn peaks(drive: &Drive, load: &LoadCase, points: Points, stop: &impl Stop) -> Result<SweepPeaks, SolveError> {
    let loaded = LoadedDrive::new(drive, load)?;
    if let Some(samples) = fast_samples(&loaded, load, points)
        && let Some(mut peaks) = fast::peaks(&loaded, samples, stop)?
    {
        columns::check("torque balance", peaks.torque_balance_residual)?;
        peaks.torque_capacity = capacity_in_proportion(&loaded, load, &peaks.contacts);
        return Ok(peaks);
    }
    plain::sweep(&loaded, load, points, stop).map(|sweep| SweepPeaks::from(&sweep))
}

/// The intervals of a sweep that the fast path may make: a capacity, where one is asked for, is to follow from the peaks.
fn fast_samples(loaded: &LoadedDrive<'_>, load: &LoadCase, points: Points) -> Option<Samples> {
    match points {
        Points::Samples(samples) if load.parameters().allowable_stress_mpa.is_none() || loaded.is_in_proportion() => {
            Some(samples)
        }
        Points::Samples(_) | Points::Tolerance(_) => None,
    }
}

/// The capacity where all loads are in proportion (docs/theory.md section 6): that of the largest stress.
fn capacity_in_proportion(
    loaded: &LoadedDrive<'_>,
    load: &LoadCase,
    peaks: &PerContact<ContactPeaks>,
) -> Option<TorqueCapacity> {
    let allowable_mpa = load.parameters().allowable_stress_mpa?;
    Some(TorqueCapacity::in_proportion(loaded.drive(), 1e-3 * loaded.input_torque_nmm(), allowable_mpa, peaks))
}

/// The same sweep, state by state: what the fast path is held against, and what is left where it does not reach.
///
/// # Errors
/// As [`sweep`].
pub fn sweep_plain(drive: &Drive, load: &LoadCase, points: Points, stop: &impl Stop) -> Result<Sweep, SolveError> {
    plain::sweep(&LoadedDrive::new(drive, load)?, load, points, stop)
}
