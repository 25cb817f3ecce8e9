//! Search for the extremes of a sweep (docs/explanation/theory.md section 9, *True extremes*).
//!
//! A lap is cut where a tooth enters. Between two cuts, every load of every tooth and every total is a smooth curve
//! over the input angle. With gaps, the curves are smooth between two changes of the set of carrying teeth. A few
//! evaluated moments bound the curves: polynomials through six of them estimate the maximum between two, and their own
//! error. Only intervals that may exceed the largest value seen are evaluated again, all quantities together.

mod judge;
mod piece;
mod seen;
mod summit;

use judge::Judge;

use crate::load_sharing::LoadedDrive;
use crate::root::NotConverged;
use crate::sweep::points::Tolerance;
use crate::{SolveError, Stop};

pub(crate) use piece::{AtPlace, Piece};
pub(crate) use seen::Seen;

/// Number of quantities of a tooth that have peaks: three forces, three stresses.
pub(crate) const LOADS: usize = 6;

/// Number of quantities of all teeth together: wind-up, torsional stiffness and the reciprocals of both, since their
/// minima are needed too, and the reciprocal of the torque capacity (0 if there is none).
pub(crate) const TOTALS: usize = 5;

pub(crate) const QUANTITIES: usize = LOADS + TOTALS;

/// Initial number of intervals of a piece.
const FIRST_INTERVALS: u32 = 16;

/// Pieces shorter than this part of a lap are evaluated at both ends only.
const SHORTEST_PIECE: f64 = 1e-12;

/// Number of moments that bound a curve.
const NODES: usize = 6;

/// Largest number of rounds. Bisection alone reaches the last digit of a fraction in as many.
const MAX_ROUNDS: u32 = 60;

/// Relative uncertainty that rounding may leave when the rounds are over.
const OPEN: f64 = 1e-10;

/// Number of rounding errors in a bend, each counted as often as [`COARSE_MARGIN`].
const ROUNDINGS: f64 = 1024.0;

/// A tooth that closes within this part of the rotation has no gap.
const CLOSED: f64 = 1e-12;

/// An interval that bends by more than this part of a quantity's largest value may contain more than its ends show.
const COARSE_BEND: f64 = 1e-2;

/// The same for the capacity, whose kinks cancel in a bend if they have opposite signs. A smaller bend may be rounding.
const COARSE_CORNER: f64 = 1e-6;

/// Factor on the bend for the rise of such an interval above its ends.
const COARSE_MARGIN: f64 = 8.0;

/// Factor for all other intervals: a parabola rises by a quarter of its bend, two lines meeting in a kink by at most
/// all.
const MARGIN: f64 = 1.0;

/// Torsional stiffness and its reciprocal.
const STIFFNESSES: [usize; 2] = [LOADS + 2, LOADS + 3];

/// Reciprocal of the capacity. Its curve has a kink where another tooth becomes limiting, or a tooth begins to carry
/// under the limit. No polynomial models that, so it is bounded by its second differences alone.
const CAPACITY: usize = LOADS + TOTALS - 1;

/// Error of a polynomial in multiples of its last term, for a smooth curve and for one that begins or ends like a power
/// or a logarithm. The term before the last counts for an eighth, because one term alone may vanish.
const OFF_SMOOTH: f64 = 4.0;

const OFF_BY_POWERS: f64 = 32.0;

const OF_TERM_BEFORE: f64 = 0.125;

/// Relative length of a lap below which an interval next to a change of carrying teeth is short. There the stiffness
/// takes all values between its ends: that of the changing tooth grows from zero, under a power law with infinite
/// slope.
const SHORT: f64 = 1e-3;

/// Rounds after which an uncertain interval is cut into four: it then contains a kink.
const SMOOTH_ROUNDS: u32 = 8;

/// Number of such intervals cut in a round for each quantity. Isolating a kink takes about 17 rounds.
const CORNERS_AT_ONCE: usize = 4;

/// Newton steps to the maximum of a polynomial. It need not be exact: it is evaluated and bounded again.
const SUMMIT_STEPS: u32 = 4;

/// If a polynomial's error is below this part of the largest value, its maximum is evaluated. Other intervals are cut.
const SURE: f64 = 1e-3;

/// Evaluated points of an interval without a usable polynomial. Next to the end of a run they are denser, because there
/// the slope of a power or a logarithm may change within any distance.
const QUARTERS: [f64; 3] = [0.25, 0.5, 0.75];

const TOWARDS_START: [f64; 3] = [1.0 / 64.0, 1.0 / 16.0, 0.25];

/// What a search needs to know of a drive under its load.
pub(crate) struct SearchedDrive<'a> {
    pub(crate) loaded: &'a LoadedDrive<'a>,
    /// True if teeth begin and cease to carry between their entry and their exit.
    pub(crate) has_gaps: bool,
    /// True if forces are proportional to the teeth's displacements. Every curve is then smooth up to its ends.
    pub(crate) is_linear: bool,
    /// True if the stiffness is proportional to the reciprocal of the rotation, so that they share their extremes.
    pub(crate) is_in_proportion: bool,
    /// Number of teeth that are distinguished at each place.
    pub(crate) teeth_at_each_place: u64,
}

/// Largest value of a quantity.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Best {
    pub(crate) value: f64,
    /// Index of the piece, and of its moment.
    pub(crate) piece: usize,
    pub(crate) moment: usize,
    /// Index of the tooth, for a load.
    pub(crate) tooth: usize,
}

/// Result of the search.
#[derive(Debug, Default)]
pub(crate) struct Found {
    pub(crate) seen: Vec<Seen>,
    pub(crate) best: [Best; QUANTITIES],
}

/// Searches for the largest value of every quantity. `look` appends moments of a piece, or returns false if it does not
/// support the drive; then the result is none.
///
/// # Errors
/// Errors of the evaluation; [`SolveError::TooManyStates`] beyond the tolerance's limit, [`SolveError::Stopped`] if
/// stopped.
pub(crate) fn search(
    drive: &SearchedDrive<'_>,
    pieces: impl Iterator<Item = Piece>,
    tolerance: Tolerance,
    lines: Option<f64>,
    stop: &dyn Stop,
    mut look: impl FnMut(&[f64], &mut Seen) -> Result<bool, SolveError>,
) -> Result<Option<Found>, SolveError> {
    let limit = tolerance.max_states;
    let mut found = Found::default();
    let mut states = 0_u64;
    // Pieces are evaluated one by one: deviating items may need millions of laps, more than fit in memory.
    for piece in pieces {
        let teeth = usize::try_from(piece.places * drive.teeth_at_each_place).unwrap_or(usize::MAX);
        let of_piece = Seen::new(piece, teeth);
        states = states.saturating_add((of_piece.wanted.len() * teeth) as u64);
        if states > limit {
            return Err(SolveError::TooManyStates { limit });
        }
        if stop.stopped() {
            return Err(SolveError::Stopped);
        }
        found.seen.push(of_piece);
    }
    states = 0;
    let mut excess = 0.0;
    for round in 0..MAX_ROUNDS {
        for (piece, seen) in found.seen.iter_mut().enumerate().filter(|(_, seen)| !seen.wanted.is_empty()) {
            let wanted = std::mem::take(&mut seen.wanted);
            states += (wanted.len() * seen.teeth) as u64;
            if states > limit {
                return Err(SolveError::TooManyStates { limit });
            }
            let first = seen.fractions.len();
            if !look(&wanted, seen)? {
                return Ok(None);
            }
            seen.put_in_order();
            for (quantity, best) in found.best.iter_mut().enumerate() {
                best.update(seen, piece, first, quantity);
            }
        }
        let best = found.best.map(|best| best.value);
        excess = Judge { drive, best, relative: tolerance.relative(), lines, round }.want(&mut found.seen);
        if found.seen.iter().all(|seen| seen.wanted.is_empty()) {
            return Ok(Some(found));
        }
    }
    // The remaining excess is more than rounding only if the curves are not smooth.
    if excess > tolerance.relative().max(OPEN).max(drive.rounding(&found.best)?) {
        return Err(NotConverged { what: "extremes of a sweep", iterations: MAX_ROUNDS, bracket_width: excess }.into());
    }
    Ok(Some(found))
}

impl Best {
    /// Includes the moments of a piece from the one with this index on.
    fn update(&mut self, seen: &Seen, piece: usize, first: usize, quantity: usize) {
        for moment in first..seen.fractions.len() {
            let values = &seen.values(moment)[seen.curves(quantity)];
            let most = values.iter().fold(0.0_f64, |most, &value| most.max(value));
            if most > self.value {
                let tooth = values.iter().position(|&value| value >= most).unwrap_or(0);
                *self = Self { value: most, piece, moment, tooth };
            }
        }
    }
}

impl SearchedDrive<'_> {
    /// Returns the effect of rounding of closing angles on the loads, including a bend counted several times. The
    /// amplification is `Δφ K/M`, with M the given or the allowed torque. If teeth press against corners, Δφ is at
    /// least the rotation that has the rounding error of a tooth's gap there.
    fn rounding(&self, best: &[Best; QUANTITIES]) -> Result<f64, NotConverged> {
        let [rotation_rad, stiffness_nmm_per_rad] = [LOADS, STIFFNESSES[0]].map(|quantity| best[quantity].value);
        let per_torque = best[CAPACITY].value.max(1.0 / self.loaded.input_torque_nmm());
        let rotation_rad = rotation_rad.max(self.loaded.distance_at_corner_rad()?);
        Ok(ROUNDINGS * f64::EPSILON * (rotation_rad * stiffness_nmm_per_rad * per_torque))
    }
}

#[cfg(test)]
mod tests {
    use super::summit::{Nodes, Run, margins};
    use super::*;

    /// Returns a lap of sixteen intervals with one tooth, each moment filled in by the function.
    fn seen_by(put_down: impl Fn(&mut Seen, f64)) -> Seen {
        let piece = Piece { lap: 0, start: 0.0, end: 1.0, places: 1, at_start: None, at_end: None };
        let mut seen = Seen::new(piece, 1);
        for fraction in std::mem::take(&mut seen.wanted) {
            put_down(&mut seen, fraction);
        }
        seen.put_in_order();
        seen
    }

    /// Returns a curve as the first load of the tooth.
    fn seen_of(curve: impl Fn(f64) -> f64) -> Seen {
        seen_by(|seen, fraction| seen.push(fraction)[0] = curve(fraction))
    }

    /// Asserts that on every interval the bound is not below the curve's maximum. Returns the largest excess of the
    /// bound.
    fn assert_bounded(curve: impl Fn(f64) -> f64, off: Option<f64>) -> f64 {
        let seen = seen_of(&curve);
        let run = Run { seen: &seen, moments: &seen.order, is_first: true, is_last: true };
        let mut above = 0.0_f64;
        for at in 0..16_u32 {
            let stretch = at as usize;
            let dense = (0..=1000).map(|step| curve((f64::from(at) + f64::from(step) * 1e-3) / 16.0));
            let most = dense.fold(0.0_f64, f64::max);
            if let Some(off) = off {
                let bound = Nodes::of(&run, stretch).expect("seventeen moments").summit(&seen, 0, off).bound;
                assert!(bound >= most * (1.0 - 1e-14), "{bound} is below {most} on stretch {at}");
                above = above.max(bound - most);
            }
            let (mut bends, mut bounds) = ([0.0], [0.0]);
            margins(&run, stretch, &[f64::INFINITY], &mut bends, &mut bounds);
            let [margin] = bounds;
            assert!(margin >= most * (1.0 - 1e-14), "{margin} is below {most} on stretch {at}");
        }
        above
    }

    #[test]
    fn smooth_curves_stay_below_close_bounds() {
        for step in 0..50 {
            let summit = f64::from(step) * 0.02;
            let above = assert_bounded(|x| 1.0 + (1.5 * (x - summit)).cos(), Some(OFF_SMOOTH));
            assert!(above < 1e-5, "{above:e}");
        }
    }

    #[test]
    fn curves_starting_with_power_stay_below_bounds() {
        for step in 0..50 {
            let summit = f64::from(step) * 0.002;
            for power in [2.11, 2.5] {
                assert_bounded(|x| 2.0 + (x - summit).cos() + 0.05 * x.powf(power) - 0.05 * x, Some(OFF_BY_POWERS));
            }
        }
    }

    #[test]
    fn curves_with_corner_stay_below_bounds() {
        for step in 0..400 {
            let corner = f64::from(step) * 0.002_47;
            for (before, after) in [(1.0, 1.0), (0.1, 3.0), (2.0, 0.2)] {
                assert_bounded(|x| 10.0 - if x < corner { before } else { after } * (x - corner).abs(), None);
            }
        }
    }

    /// Error estimate from the polynomials through the first four, five and six nodes, in Lagrange's form, in the
    /// middle.
    #[test]
    fn polynomial_error_follows_from_last_lagrange_terms() {
        let curve = |x: f64| (40.0 * x).sin() + (7.0 * x).exp();
        let seen = seen_of(curve);
        let run = Run { seen: &seen, moments: &seen.order, is_first: true, is_last: true };
        for at in 0..16 {
            let nodes = Nodes::of(&run, at).expect("seventeen moments");
            let through = |count: usize| -> f64 {
                let of_node = |i: usize| {
                    let others = (0..count).filter(|&j| j != i);
                    let share: f64 =
                        others.map(|j| (0.5 - nodes.places[j]) / (nodes.places[i] - nodes.places[j])).product();
                    share * curve(seen.fractions[nodes.moments[i]])
                };
                (0..count).map(of_node).sum()
            };
            let [fourth, fifth] = [4, 5].map(|count| (through(count + 1) - through(count)).abs());
            let expected = 3.0 * fifth.max(0.125 * fourth);
            let found = nodes.summit(&seen, 0, 3.0).error;
            assert!((found / expected - 1.0).abs() < 1e-9, "{found:e} is not {expected:e}");
        }
    }

    /// Returns a tooth whose rotation beyond closure is the given curve.
    fn seen_of_a_tooth(pressed: impl Fn(f64) -> f64) -> Seen {
        seen_by(|seen, fraction| {
            seen.push(fraction)[LOADS] = 2.0;
            seen.pressed.push(pressed(fraction));
        })
    }

    #[test]
    fn does_not_suspect_tooth_far_from_zero() {
        for step in 0..100 {
            let phase = 0.07 * f64::from(step);
            for sign in [1.0, -1.0] {
                let seen = seen_of_a_tooth(|x| sign * (1.2 + (6.0 * x + phase).cos()));
                assert!((0..16).all(|at| seen.suspected_change(at).is_none()), "{phase}");
            }
        }
    }

    #[test]
    fn finds_maximum_of_polynomial_at_any_position() {
        for step in 1..200 {
            let summit = f64::from(step) * 0.005;
            let seen = seen_of(|x| 3.0 - (x - summit) * (x - summit));
            let run = Run { seen: &seen, moments: &seen.order, is_first: true, is_last: true };
            let found =
                (0..16).map(|at| Nodes::of(&run, at).expect("seventeen moments").summit(&seen, 0, OFF_SMOOTH).top);
            assert!((found.fold(0.0_f64, f64::max) - 3.0).abs() < 1e-13, "at {summit}");
        }
    }
}
