//! One period of the input angle: columns of tooth states, peaks, residuals, wind-up, capacity.

mod adaptive;
mod columns;
pub(crate) mod fast;
mod limited_by;
pub(crate) mod mean;
mod plain;
mod plain_look;
mod points;
mod search;
mod unloaded;

use crate::drive::Drive;
use crate::gaps::Deviations;
use crate::load_sharing::{LoadCase, LoadedDrive};
use crate::{SolveError, Stop};
use adaptive::Looking;

pub use columns::{
    ContactPeaks, Extremes, InputAngles, Peak, States, Sweep, SweepPeaks, TorqueBalance, TorqueCapacity,
};
pub use limited_by::LimitedBy;
pub use points::{Points, Tolerance};
pub use unloaded::unloaded_wind_up_deg;

/// Runs the sweep over one period.
///
/// ```
/// use toothwave_solver::sweep::{Points, sweep};
/// # use toothwave_solver::{Drive, DriveParameters, LoadCase, LoadParameters, Never};
/// let drive = Drive::new(&DriveParameters::default()).unwrap();
/// let load = LoadCase::new(&LoadParameters::default()).unwrap();
///
/// let sweep = sweep(&drive, &load, Points::samples(100).unwrap(), &Never).unwrap();
/// // The teeth in mesh at the first input angle, with their forces at the ring.
/// for state in (0..sweep.states.len()).take_while(|&state| sweep.states.input_angle_deg[state] == 0.0) {
///     println!("tooth {}: {:.0} N", sweep.states.tooth[state], sweep.states.force_n.ring[state]);
/// }
/// let stiffness_nm_per_rad = &sweep.input_angles.torsional_stiffness_nm_per_rad;
/// assert_eq!(stiffness_nm_per_rad.len(), 101);
/// ```
///
/// # Errors
/// [`SolveError::NoToothInMesh`] and [`SolveError::ComplianceNotPositive`] if no finite forces exist,
/// [`SolveError::TooManyStates`] if a tolerance needs more states than allowed, [`SolveError::Inconsistent`] if the
/// answer's own checks fail, [`SolveError::Stopped`] if `stop` is set.
pub fn sweep(drive: &Drive, load: &LoadCase, points: Points, stop: &dyn Stop) -> Result<Sweep, SolveError> {
    swept(&LoadedDrive::new(drive, load)?, points, stop)
}

fn swept(loaded: &LoadedDrive<'_>, points: Points, stop: &dyn Stop) -> Result<Sweep, SolveError> {
    if let Points::Samples(samples) = points
        && let Some(sweep) = fast::sweep(loaded, samples, stop)?
    {
        return Ok(sweep);
    }
    plain::sweep(loaded, points, Looking::Fast, stop)
}

/// Runs the sweep of a drive with deviations of individual items. States are listed by slot and lobe. The sweep covers
/// the load periods after which all items are back in their positions ([`Deviations::mesh`]).
///
/// ```
/// use toothwave_solver::sweep::{Points, sweep_with_deviations};
/// # use toothwave_solver::Deviations;
/// # use toothwave_solver::{Drive, DriveParameters, LoadCase, LoadParameters, Never};
/// let drive = Drive::new(&DriveParameters::default()).unwrap();
/// let load = LoadCase::new(&LoadParameters::default()).unwrap();
///
/// // One tooth of 28 is 20 µm too thin.
/// let mut tooth_radius_um = vec![0.0; 28];
/// tooth_radius_um[3] = 20.0;
/// let deviations = Deviations { tooth_radius_um, ..Deviations::default() };
/// let sweep = sweep_with_deviations(&drive, &load, &deviations, Points::samples(100).unwrap(), &Never).unwrap();
/// assert!(sweep.transmission_error_peak_to_peak_deg(&drive) > 0.0);
/// ```
///
/// # Errors
/// As [`sweep`]; [`SolveError::Impossible`] for deviations that this drive or this load cannot have,
/// [`SolveError::Interference`] if a tooth is pressed without load.
pub fn sweep_with_deviations(
    drive: &Drive,
    load: &LoadCase,
    deviations: &Deviations,
    points: Points,
    stop: &dyn Stop,
) -> Result<Sweep, SolveError> {
    swept(&LoadedDrive::deviating(drive, load, deviations)?, points, stop)
}

/// Returns the peaks of the sweep over one period without its states, in less time. Period closure is not checked. If
/// zones are not alike, they are evaluated superposed: what the states would show in successive laps is reported for
/// the first.
///
/// ```
/// use toothwave_solver::sweep::{Points, peaks};
/// # use toothwave_solver::{Drive, DriveParameters, LoadCase, LoadParameters, Never};
/// let drive = Drive::new(&DriveParameters::default()).unwrap();
/// let load = LoadCase::new(&LoadParameters::default()).unwrap();
///
/// let peaks = peaks(&drive, &load, Points::samples(100).unwrap(), &Never).unwrap();
/// assert!(peaks.contacts.wave_generator.stress_mpa.value > 0.0);
/// ```
///
/// # Errors
/// As [`sweep`].
pub fn peaks(drive: &Drive, load: &LoadCase, points: Points, stop: &dyn Stop) -> Result<SweepPeaks, SolveError> {
    let loaded = LoadedDrive::new(drive, load)?;
    let (mesh, one_zone) = (loaded.mesh(), loaded.as_one_zone());
    let peaks = match points {
        Points::Samples(samples) => fast::peaks(&one_zone, mesh.samples_of_lap(samples), stop)?,
        Points::Tolerance(tolerance) => fast::true_peaks(&one_zone, tolerance, stop)?,
    };
    if let Some(peaks) = peaks {
        return Ok(SweepPeaks { loaded_teeth: peaks.loaded_teeth.times(mesh.listed_at_each_place()), ..peaks });
    }
    match points {
        Points::Samples(samples) => plain::peaks(&loaded, samples, stop),
        Points::Tolerance(_) => {
            plain::sweep(&loaded, points, Looking::Fast, stop).map(|sweep| SweepPeaks::from(&sweep))
        }
    }
}

/// Runs the same sweep state by state: the reference for the fast path, and the fallback for drives it does not
/// support.
///
/// # Errors
/// As [`sweep`].
#[doc(hidden)]
pub fn sweep_plain(drive: &Drive, load: &LoadCase, points: Points, stop: &dyn Stop) -> Result<Sweep, SolveError> {
    plain::sweep(&LoadedDrive::new(drive, load)?, points, Looking::Plain, stop)
}

/// Runs the same for a drive with deviations of individual items.
///
/// # Errors
/// As [`sweep_with_deviations`].
#[doc(hidden)]
pub fn sweep_plain_with_deviations(
    drive: &Drive,
    load: &LoadCase,
    deviations: &Deviations,
    points: Points,
    stop: &dyn Stop,
) -> Result<Sweep, SolveError> {
    plain::sweep(&LoadedDrive::deviating(drive, load, deviations)?, points, Looking::Plain, stop)
}
