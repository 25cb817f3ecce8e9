//! Wind-up without load: the rotation of the wave generator until the first tooth has closed its gaps
//! (docs/explanation/theory.md section 4.8), and the search for its extremes (section 9).

use std::ops::Range;

use crate::drive::Drive;
use crate::gaps::Deviations;
use crate::load_sharing::{LoadCase, LoadedDrive};
use crate::position::{Position, half_lobe_rad};
use crate::sweep::columns::{States, Sweep};
use crate::sweep::plain_look::PlainLook;
use crate::sweep::points::Tolerance;
use crate::sweep::search::{LOADS, Piece, SearchedDrive, Seen, TOTALS, search};
use crate::{SolveError, Stop};

/// Excluded length of a lap at either end of a piece, in units of the tolerance, and its minimum.
const MARGIN: f64 = 1e-3;
const LEAST_MARGIN: f64 = 1e-12;

/// Returns `Δφ_0 = min θ_i` at each input angle of a sweep of this drive, load and deviations. It is the limit of the
/// wind-up as the torque goes to zero, and 0 without gaps.
///
/// ```
/// use toothwave_solver::sweep::{Points, sweep, unloaded_wind_up_deg};
/// # use toothwave_solver::Deviations;
/// # use toothwave_solver::{Drive, DriveParameters, LoadCase, LoadParameters, Never};
/// let drive = Drive::new(&DriveParameters::default()).unwrap();
/// let load = LoadCase::new(&LoadParameters::default()).unwrap();
///
/// let sweep = sweep(&drive, &load, Points::samples(100).unwrap(), &Never).unwrap();
/// let unloaded_deg = unloaded_wind_up_deg(&drive, &load, &Deviations::default(), &sweep, &Never).unwrap();
/// assert!(unloaded_deg.iter().all(|&angle_deg| angle_deg == 0.0));
/// ```
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
        // Near the valley the position in degrees has lost digits, but there a tooth closes last of all.
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

/// Returns the ranges of states of each input angle. At a jump of the loads an angle occurs twice; tooth numbers
/// restart.
fn by_input_angle(states: &States) -> impl Iterator<Item = Range<usize>> {
    let mut start = 0;
    (1..=states.len()).filter_map(move |next| {
        let goes_on = next < states.len()
            && states.input_angle_deg[next].total_cmp(&states.input_angle_deg[next - 1]).is_eq()
            && states.tooth[next] > states.tooth[next - 1];
        (!goes_on).then(|| std::mem::replace(&mut start, next)..next)
    })
}

/// Returns the pieces and fractions with the least and the largest wind-up without load. The ends of pieces are
/// excluded, as they are evaluated anyway: a tooth on the lobe or in the valley closes no gap, but one next to it may.
pub(crate) fn extremes(
    plain: &PlainLook<'_>,
    pieces: impl Iterator<Item = Piece>,
    tolerance: Tolerance,
    stop: &dyn Stop,
) -> Result<Vec<(Piece, f64)>, SolveError> {
    let margin = (MARGIN * tolerance.relative()).max(LEAST_MARGIN);
    let within = |piece: Piece| Piece {
        start: piece.start + margin,
        end: piece.end - margin,
        at_start: None,
        at_end: None,
        ..piece
    };
    let pieces: Vec<_> = pieces.map(within).filter(|piece| piece.start < piece.end).collect();
    let Some(first) = pieces.first() else { return Ok(Vec::new()) };
    let scale_rad = first_of(&closings_rad(plain, first, first.start.midpoint(first.end))?);
    let scale_rad = if scale_rad > 0.0 { scale_rad } else { 1.0 };
    let look = |fractions: &[f64], seen: &mut Seen| {
        let (piece, count) = (seen.piece, seen.teeth);
        for &fraction in fractions {
            let closings_rad = closings_rad(plain, &piece, fraction)?;
            let first_rad = first_of(&closings_rad);
            if first_rad == f64::INFINITY {
                return Err(plain.loaded.carries_nothing(&plain.teeth(&piece, fraction)?));
            }
            let values = seen.push(fraction);
            for (tooth, closing_rad) in closings_rad.into_iter().enumerate() {
                values[EARLINESS * count + tooth] = scale_rad / (scale_rad + closing_rad);
            }
            values[LOADS * count + (FIRST - LOADS)] = first_rad;
        }
        Ok(true)
    };
    // The curves do not depend on the set of carrying teeth, and none ends like a power.
    let drive = SearchedDrive { has_gaps: false, is_linear: true, is_in_proportion: false, ..plain.searched() };
    // This method covers every moment.
    let found = search(&drive, pieces.into_iter(), tolerance, None, stop, look)?.unwrap_or_default();
    let sought = [EARLINESS, FIRST].map(|quantity| found.best[quantity]).into_iter();
    // If no gap is open, there is no largest value.
    let sought = sought.filter(|best| best.value > 0.0);
    Ok(sought.map(|best| (found.seen[best.piece].piece, found.seen[best.piece].fractions[best.moment])).collect())
}

/// Index of the quantity "how early a tooth closes": a smooth curve with its maximum at the least wind-up. It uses a
/// load's index.
const EARLINESS: usize = 0;

/// Index of the least closing angle: a curve with kinks where another tooth becomes the first. It uses the index of the
/// capacity, which has kinks too.
const FIRST: usize = LOADS + TOTALS - 1;

/// Returns the closing angles of a piece, place by place.
fn closings_rad(plain: &PlainLook<'_>, piece: &Piece, fraction: f64) -> Result<Vec<f64>, SolveError> {
    let lost_motion_rad = plain.loaded.lost_motion_rad();
    let teeth = plain.teeth(piece, fraction)?;
    // A gap that is taken up by lost motion may be closed up to rounding.
    Ok(teeth.iter().map(|tooth| (lost_motion_rad + tooth.spring.closing_rad).max(0.0)).collect())
}

/// Returns the least of the closing angles.
fn first_of(closings_rad: &[f64]) -> f64 {
    closings_rad.iter().copied().fold(f64::INFINITY, f64::min)
}
