//! How far the wave generator turns before the first tooth has closed its gaps: the wind-up without load (docs/theory.md section 4.8).

use std::ops::Range;

use crate::drive::Drive;
use crate::gaps::Deviations;
use crate::load_sharing::{LoadCase, LoadedDrive};
use crate::position::{Position, half_lobe_rad};
use crate::sweep::columns::{States, Sweep};
use crate::{SolveError, Stop};

/// `Δφ_0 = min θ_i` at each input angle of a sweep of this drive under this load with these deviations: the wind-up as the torque goes to
/// nothing. Without gaps there is none.
///
/// # Errors
/// As the sweep itself.
pub fn unloaded_wind_up_deg(
    drive: &Drive,
    load: &LoadCase,
    deviations: &Deviations,
    sweep: &Sweep,
    stop: &dyn Stop,
) -> Result<Vec<f64>, SolveError> {
    let loaded = LoadedDrive::deviating(drive, load, deviations)?;
    let states = &sweep.states;
    let (lobes, half_rad) = (drive.lobes(), half_lobe_rad(drive.lobes()));
    let closing_rad = |state: usize| {
        let (input_angle_deg, position_deg) = (states.input_angle_deg[state], states.position_deg[state]);
        let lobe = states.lobe.get(state).copied().unwrap_or_default();
        let place = sweep.mesh.place_at(input_angle_deg, lobe, position_deg);
        // Near the valley the place in degrees has lost digits, but there a tooth closes last of all.
        let position = Position::from_lobe(position_deg.to_radians().min(half_rad), lobes);
        Ok::<_, SolveError>(loaded.tooth_at(&place, position)?.spring.closing_rad)
    };
    let mut wind_up_deg = Vec::with_capacity(sweep.input_angles.input_angle_deg.len());
    for teeth in by_input_angle(states) {
        if stop.stopped() {
            return Err(SolveError::Stopped);
        }
        let mut first_rad = f64::INFINITY;
        for state in teeth {
            first_rad = first_rad.min(closing_rad(state)?);
        }
        wind_up_deg.push((loaded.lost_motion_rad() + first_rad).to_degrees());
    }
    Ok(wind_up_deg)
}

/// The states of each input angle. Where loads jump an angle stands twice; by number the teeth then start anew.
fn by_input_angle(states: &States) -> impl Iterator<Item = Range<usize>> {
    let mut start = 0;
    (1..=states.len()).filter_map(move |next| {
        let goes_on = next < states.len()
            && states.input_angle_deg[next].total_cmp(&states.input_angle_deg[next - 1]).is_eq()
            && states.tooth[next] > states.tooth[next - 1];
        (!goes_on).then(|| std::mem::replace(&mut start, next)..next)
    })
}
