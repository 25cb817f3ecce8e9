//! Checks that a sweep has to pass: torque balance, and closure of the period.

use super::peaks::ContactPeaks;
use super::states::{InputAngles, States, Sweep};
use crate::SolveError;
use crate::contact::PerContact;
use crate::drive::Drive;
use crate::load_sharing::LoadedDrive;
use crate::root::NotConverged;
use crate::sweep::points::Points;

/// Largest allowed residual of torque balance (share of the torque) and of period closure (share of a peak). It is
/// about ten thousand times the rounding error of the worst known design.
const MOST_RESIDUAL: f64 = 1e-9;

/// Expected torques: `M0` at the wave generator, `M0 Z_K/U` at the ring, `M0 Z_G/U` at the carrier.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TorqueBalance {
    per_nmm: PerContact<f64>,
}

impl TorqueBalance {
    /// Returns the torques of a drive under an input torque.
    pub fn new(drive: &Drive, input_torque_nmm: f64) -> Self {
        let per_nmm = PerContact {
            wave_generator: 1.0 / input_torque_nmm,
            ring: 1.0 / (input_torque_nmm * drive.flank().teeth_per_wave()),
            carrier: 1.0 / (input_torque_nmm * drive.teeth_per_wave()),
        };
        Self { per_nmm }
    }

    /// Returns the largest relative deviation of computed torques; NaN if one of them is NaN.
    #[inline(always)]
    pub fn residual(&self, torque_nmm: &PerContact<f64>) -> f64 {
        let off_cam = (torque_nmm.wave_generator * self.per_nmm.wave_generator - 1.0).abs();
        let off_ring = (torque_nmm.ring * self.per_nmm.ring - 1.0).abs();
        let off_carrier = (torque_nmm.carrier * self.per_nmm.carrier - 1.0).abs();
        let most = if off_ring > off_carrier { off_ring } else { off_carrier };
        let most = if off_cam > most { off_cam } else { most };
        let all = off_cam + off_ring + off_carrier;
        if all.is_nan() { all } else { most }
    }
}

/// Returns the larger of a residual and the earlier ones. NaN counts as the largest.
#[inline(always)]
pub(crate) fn worse(residual: f64, before: f64) -> f64 {
    if residual.is_nan() || residual > before { residual } else { before }
}

/// Returns a sweep with its closure, or an error if a check fails.
pub(crate) fn checked(sweep: Sweep, loaded: &LoadedDrive<'_>, points: Points) -> Result<Sweep, SolveError> {
    let Sweep { input_angles, torque_balance_residual, .. } = &sweep;
    let mut period_closure_residual = period_closure(loaded, points, &sweep.states, &sweep.peaks)?;
    if loaded.mesh().tells_items_apart() {
        // The wind-up shows whether all items are back in their positions.
        let wind_up_deg = &input_angles.wind_up_deg;
        let ends_deg = [wind_up_deg.first(), wind_up_deg.last()].map(|end| end.copied().unwrap_or(f64::NAN));
        let [first_deg, last_deg] = ends_deg;
        period_closure_residual = worse((last_deg - first_deg).abs() / last_deg, period_closure_residual);
    }
    check("torque balance", *torque_balance_residual)?;
    // Light loads across wide gaps, or at corners, keep fewer digits. The residual in the answer shows how many.
    if let Err(inconsistent) = check("period closure", period_closure_residual) {
        let of_rounding = ROUNDINGS * f64::EPSILON * input_angles.amplification(loaded)?;
        if period_closure_residual.is_nan() || period_closure_residual > of_rounding {
            return Err(inconsistent);
        }
    }
    Ok(Sweep { period_closure_residual, ..sweep })
}

/// Number of rounding errors of closing angles by which two paths to the same loads may differ.
const ROUNDINGS: f64 = 32.0;

impl InputAngles {
    /// Returns the largest amplification of a relative error of a closing angle in the rotation beyond it: `Δφ K/M0`,
    /// about 1 without gaps. The gap of a tooth at a corner is a difference of two distances and has their rounding
    /// error.
    fn amplification(&self, loaded: &LoadedDrive<'_>) -> Result<f64, NotConverged> {
        let ratio = loaded.drive().teeth_per_wave();
        let per_torque = 1e3 / (loaded.input_torque_nmm() * ratio * ratio);
        let to_corner_rad = loaded.distance_at_corner_rad()?;
        let angles = self.wind_up_deg.iter().zip(&self.torsional_stiffness_nm_per_rad);
        let beyond = |(wind_up_deg, stiffness): (&f64, &f64)| {
            wind_up_deg.to_radians().max(to_corner_rad) * stiffness * per_torque
        };
        Ok(angles.map(beyond).fold(1.0, f64::max))
    }
}

/// Checks that a residual is only rounding.
pub(super) fn check(check: &'static str, residual: f64) -> Result<(), SolveError> {
    if residual.is_nan() || residual > MOST_RESIDUAL {
        return Err(SolveError::Inconsistent { check, residual });
    }
    Ok(())
}

/// Returns the largest difference of a load at the last input angle from its recalculation. The recalculation is state
/// by state and finds positions by the other method: by angles if the sweep uses whole numbers, and vice versa.
fn period_closure(
    loaded: &LoadedDrive<'_>,
    points: Points,
    states: &States,
    peaks: &PerContact<ContactPeaks>,
) -> Result<f64, SolveError> {
    let mesh = *loaded.mesh();
    let position = |place| match points {
        Points::Samples(_) => mesh.position_between(place, 1.0),
        Points::Tolerance(_) => mesh.position_after_lap(place),
    };
    let placed: Vec<_> = mesh.placed_between(2..=mesh.whole_spacings() + 1, mesh.laps() - 1, position).collect();
    let teeth = placed.iter().map(|placed| loaded.tooth_at(&placed.place, placed.position));
    let teeth = teeth.collect::<Result<Vec<_>, _>>()?;
    let wind_up = loaded.wind_up(&teeth)?;
    let last_angle_deg = states.input_angle_deg.last();
    let first = states.len().checked_sub(teeth.len());
    let Some(first) = first.filter(|&first| states.input_angle_deg.get(first) == last_angle_deg) else {
        return Ok(f64::INFINITY);
    };
    let mut residual = 0.0;
    for ((state, placed), tooth) in (first..).zip(&placed).zip(&teeth) {
        if u64::from(states.tooth[state]) != placed.number {
            return Ok(f64::INFINITY);
        }
        let loads = loaded.loads(tooth, &wind_up)?;
        for ((contact, peaks), (force_n, stress_mpa)) in peaks.iter().zip(loads[..3].iter().zip(&loads[3..])) {
            // If only corners press the teeth, there is no stress at the ring.
            let off = |found: f64, anew: f64, peak: f64| {
                let off = (found - anew).abs();
                if off > 0.0 { off / peak } else { off }
            };
            let off_force = off(states.force_n.get(contact)[state], *force_n, peaks.force_n.value);
            let off_stress = off(states.stress_mpa.get(contact)[state], *stress_mpa, peaks.stress_mpa.value);
            residual = worse(off_stress, worse(off_force, residual));
        }
    }
    Ok(residual)
}
