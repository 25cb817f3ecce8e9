//! Means over the period of a sweep to a tolerance. They do not depend on the sweep's input angles.

use std::cmp::Ordering;
use std::collections::BinaryHeap;

use crate::load_sharing::{LoadedDrive, ToothState};
use crate::mesh::PlacedTooth;
use crate::root::NotConverged;
use crate::springs::WindUp;
use crate::sweep::adaptive::Moment;
use crate::sweep::search::Piece;
use crate::{SolveError, Stop};

/// Initial number of intervals for each piece between two jumps.
const FIRST_STRETCHES: u32 = 4;

/// Enough for the finest tolerance if the values are not rounded more than that.
const ENOUGH_MOMENTS: usize = 4096;

/// If twice as many moments leave this share of the error, further refinement does not help.
const STAGNATION: f64 = 0.75;

/// Finest tolerance that rounding leaves reachable.
const FINEST: f64 = 1e-10;

/// Largest number of moments in each lap.
const MOST_MOMENTS: u32 = 100_000;

/// Interval of a lap with the values at its ends, its middle and its quarters.
struct Stretch<const N: usize> {
    piece: usize,
    start: f64,
    end: f64,
    values: [[f64; N]; 5],
    /// Difference of Simpson's rule over the whole and over the halves, summed over all quantities.
    error: f64,
}

impl<const N: usize> Stretch<N> {
    fn new(piece: usize, start: f64, end: f64, values: [[f64; N]; 5]) -> Self {
        let mut stretch = Self { piece, start, end, values, error: 0.0 };
        // For smooth curves the error over the halves is 1/15 of the difference. Kinks are not smooth: count the full
        // difference.
        let [low, lower, middle, upper, high] = &stretch.values;
        let differs = |n: usize| (low[n] - 4.0 * lower[n] + 6.0 * middle[n] - 4.0 * upper[n] + high[n]).abs();
        stretch.error = (end - start) / 12.0 * (0..N).map(differs).sum::<f64>();
        stretch
    }

    /// Returns the integral over the halves.
    fn area(&self, n: usize) -> f64 {
        let [low, lower, middle, upper, high] = &self.values;
        (self.end - self.start) / 12.0 * (low[n] + 4.0 * lower[n] + 2.0 * middle[n] + 4.0 * upper[n] + high[n])
    }
}

/// Orders by error.
impl<const N: usize> Ord for Stretch<N> {
    fn cmp(&self, other: &Self) -> Ordering {
        self.error.total_cmp(&other.error)
    }
}

impl<const N: usize> PartialOrd for Stretch<N> {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl<const N: usize> PartialEq for Stretch<N> {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other).is_eq()
    }
}

impl<const N: usize> Eq for Stretch<N> {}

/// Returns the means of non-negative quantities to a tolerance relative to their sum, but at least 1e-10. The method is
/// adaptive quadrature between the jumps, largest error first.
///
/// # Errors
/// Those of the load sharing, and [`SolveError::Stopped`].
pub(crate) fn means<const N: usize>(
    loaded: &LoadedDrive<'_>,
    tolerance: f64,
    mut of: impl FnMut(&[PlacedTooth], &[ToothState], &WindUp) -> Result<[f64; N], SolveError>,
    stop: &dyn Stop,
) -> Result<[f64; N], SolveError> {
    let mesh = *loaded.mesh();
    let laps = if mesh.tells_items_apart() { mesh.laps() } else { 1 };
    let pieces: Vec<_> = (0..laps).flat_map(|lap| Piece::of(loaded, lap)).collect();
    let (mut placed, mut teeth) = (Vec::new(), Vec::new());
    let mut look = |piece: usize, fraction: f64| {
        if stop.stopped() {
            return Err(SolveError::Stopped);
        }
        let piece = &pieces[piece];
        placed.clear();
        placed.extend(Moment::of(piece, fraction).placed(&mesh, piece.lap));
        teeth.clear();
        for PlacedTooth { place, position, .. } in &placed {
            teeth.push(loaded.tooth_at(place, *position)?);
        }
        of(&placed, &teeth, &loaded.wind_up(&teeth)?)
    };
    let mut stretches = BinaryHeap::new();
    for (at, piece) in pieces.iter().enumerate() {
        let fraction = |step: u32| {
            let share = f64::from(step) / f64::from(4 * FIRST_STRETCHES);
            if step == 4 * FIRST_STRETCHES { piece.end } else { piece.start + share * (piece.end - piece.start) }
        };
        let mut values = Vec::new();
        for step in 0..=4 * FIRST_STRETCHES {
            values.push(look(at, fraction(step))?);
        }
        for stretch in 0..FIRST_STRETCHES {
            let first = 4 * stretch;
            let values = std::array::from_fn(|step| values[first as usize + step]);
            stretches.push(Stretch::new(at, fraction(first), fraction(first + 4), values));
        }
    }
    let (enough, most) = (ENOUGH_MOMENTS * pieces.len(), MOST_MOMENTS as usize * pieces.len());
    let (mut before, mut error_before) = (enough / 2, f64::INFINITY);
    // The sum is recomputed regularly, so that rounding errors do not accumulate.
    loop {
        let error = errors(&stretches);
        let areas = total(&stretches);
        let allowed = tolerance.max(FINEST) * areas.iter().sum::<f64>();
        if error <= allowed {
            return Ok(areas.map(|area| area / laps as f64));
        }
        let mut excess = error - 0.5 * allowed;
        while excess > 0.0 {
            let Some(Stretch { piece, start, end, values: [low, lower, middle, upper, high], error }) = stretches.pop()
            else {
                break;
            };
            let at = |quarter: f64| start + 0.25 * quarter * (end - start);
            let (first, second) = (look(piece, at(0.5))?, look(piece, at(1.5))?);
            let (third, fourth) = (look(piece, at(2.5))?, look(piece, at(3.5))?);
            let halves = [
                Stretch::new(piece, start, at(2.0), [low, first, lower, second, middle]),
                Stretch::new(piece, at(2.0), end, [middle, third, upper, fourth, high]),
            ];
            excess -= error;
            for half in halves {
                excess += half.error;
                stretches.push(half);
            }
            // Each piece begins with one moment, and each of its intervals has four more.
            let looked = pieces.len() + 4 * stretches.len();
            // Twice as many moments at least halve the error of kinks. If they do not, the values themselves are
            // rounded.
            if looked >= 2 * before {
                let error = errors(&stretches);
                if error > STAGNATION * error_before {
                    return Ok(total(&stretches).map(|area| area / laps as f64));
                }
                (before, error_before) = (looked, error);
            }
            if looked > most {
                let not_converged =
                    NotConverged { what: "mean over the period", iterations: MOST_MOMENTS, bracket_width: error };
                return Err(not_converged.into());
            }
        }
    }
}

/// Returns the sum of the errors of all intervals.
fn errors<const N: usize>(stretches: &BinaryHeap<Stretch<N>>) -> f64 {
    stretches.iter().map(|stretch| stretch.error).sum()
}

/// Returns the integrals over all intervals.
fn total<const N: usize>(stretches: &BinaryHeap<Stretch<N>>) -> [f64; N] {
    std::array::from_fn(|n| stretches.iter().map(|stretch| stretch.area(n)).sum())
}
