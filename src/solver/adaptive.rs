//! Where a sweep must look to see the true extremes.
//!
//! Over a period one tooth may enter: there, at a flank that is cut short, every load jumps. Between such instants loads are smooth (with
//! clearance: continuous). Each smooth piece is halved until straight lines between its input angles are true to a
//! resolution, so that no peak hides between them; then every peak that may be the largest of its kind is closed in on.

use crate::load_sharing::LoadedDrive;
use crate::mesh::{Mesh, PlacedTooth};
use crate::position::Position;
use crate::ring::FlankEnd;
use crate::{SolveError, Stop};

/// Intervals that a smooth piece starts with.
const FIRST_INTERVALS: u32 = 8;

/// How true straight lines between the input angles are at least, over each column's peak: a plot that looks smooth.
const COARSEST_RESOLUTION: f64 = 1e-2;

/// The finest resolution by halving; beyond it extremes are closed in on one by one.
const FINEST_RESOLUTION: f64 = 1e-3;

/// Halvings of an interval at most: below 2^-44 of a period doubles cannot place a point.
const MAX_DEPTH: u32 = 44;

/// Steps towards one extreme at most; golden sections alone shrink a bracket by 1e-20 in as many.
const MAX_STEPS: u32 = 100;

/// An input angle, and which teeth mesh there.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Moment {
    /// Share of the lap that has passed.
    pub(crate) fraction: f64,
    first: u64,
    last: u64,
    /// The tooth that stands exactly where the flank ends.
    entering: Option<u64>,
}

impl Moment {
    /// The teeth that are listed when so many laps have passed before.
    pub(crate) fn placed(self, mesh: &Mesh, lap: u64) -> impl Iterator<Item = PlacedTooth> {
        let mesh = *mesh;
        mesh.placed_between(self.first..=self.last, lap, move |place| self.position(&mesh, place))
    }

    /// Places where teeth mesh.
    pub(crate) const fn places(&self) -> u64 {
        self.last + 1 - self.first
    }

    fn position(&self, mesh: &Mesh, place: u64) -> Position {
        if self.entering == Some(place) {
            mesh.flank_limit().position
        } else {
            mesh.position_between(place, self.fraction)
        }
    }
}

/// Forces and stresses of a tooth: three of each.
type Loads = [f64; 6];

/// A moment with the loads of its teeth, the first of which has the number `moment.first`.
#[derive(Debug, Clone)]
struct Seen {
    moment: Moment,
    loads: Vec<Loads>,
}

impl Seen {
    /// The loads of a tooth; one that does not mesh yet or any more has none.
    fn of(&self, number: u64) -> Loads {
        let index = number.checked_sub(self.moment.first).and_then(|index| usize::try_from(index).ok());
        index.and_then(|index| self.loads.get(index)).copied().unwrap_or_default()
    }
}

struct Search<'a, S> {
    /// With one tooth at each place of the mesh, which stands for all that carry alike.
    loaded: LoadedDrive<'a>,
    mesh: Mesh,
    stop: &'a S,
    max_states: u64,
    states: u64,
    /// The largest loads seen.
    peaks: Loads,
}

/// The input angles of a sweep to a tolerance, in order; where loads jump the same angle stands twice, first without the tooth that
/// enters and then with it.
pub(crate) fn moments(
    loaded: &LoadedDrive<'_>,
    tolerance: f64,
    max_states: u64,
    stop: &impl Stop,
) -> Result<Vec<Moment>, SolveError> {
    let mesh = Mesh::new(loaded.drive());
    let loaded = loaded.with_zones(mesh.teeth_at_each_place());
    let mut search = Search { loaded, mesh, stop, max_states, states: 0, peaks: Loads::default() };
    let mut moments = Vec::new();
    for piece in smooth_pieces(&mesh) {
        let seen = search.resolve(piece, tolerance.clamp(FINEST_RESOLUTION, COARSEST_RESOLUTION))?;
        moments.push(seen);
    }
    for seen in &mut moments {
        let mut extremes = Vec::new();
        for [before, middle, after] in neighbours(seen) {
            search.extremes_around(before, middle, after, tolerance, &mut extremes)?;
        }
        seen.extend(extremes);
        seen.sort_by(|one, other| one.moment.fraction.total_cmp(&other.moment.fraction));
        seen.dedup_by(|one, other| one.moment == other.moment);
    }
    let mut moments: Vec<_> = moments.into_iter().flatten().map(|seen| seen.moment).collect();
    // Two pieces share the instant between them where nothing jumps.
    moments.dedup();
    Ok(moments)
}

/// A stretch of the period in which no tooth enters, by its ends.
#[derive(Debug, Clone, Copy)]
struct Piece {
    start: Moment,
    end: Moment,
}

fn smooth_pieces(mesh: &Mesh) -> Vec<Piece> {
    let spacings = mesh.engaged_spacings();
    let whole = mesh.last_step(1);
    let at = |fraction, first, last, entering| Moment { fraction, first, last, entering };
    // When the next tooth enters. Rounding may put it a hair outside the period: then it enters at its end.
    let entry = (whole as f64 + 1.0 - spacings).clamp(0.0, 1.0);
    let loads_jump = mesh.flank_limit().end != FlankEnd::RegularTip;
    if entry > 0.0 && entry < 1.0 {
        let before = Piece { start: at(0.0, 1, whole, None), end: at(entry, 1, whole, None) };
        let after = Piece { start: at(entry, 1, whole + 1, Some(whole + 1)), end: at(1.0, 2, whole + 1, None) };
        if loads_jump {
            return vec![before, after];
        }
        // At a regular tip the entering tooth carries nothing: the instant belongs to both pieces and is wanted once.
        return vec![Piece { start: before.start, end: after.start }, Piece { start: after.start, end: after.end }];
    }
    let start = at(0.0, 1, whole, Some(whole));
    let end = at(1.0, 2, whole + 1, Some(whole + 1));
    if loads_jump {
        vec![Piece { start, end: at(1.0, 2, whole, None) }, Piece { start: end, end }]
    } else {
        vec![Piece { start, end }]
    }
}

/// Each moment of a piece between its neighbours; those at the ends are their own, so that an extreme beside an end is seen too.
fn neighbours(seen: &[Seen]) -> impl Iterator<Item = [&Seen; 3]> {
    let last = seen.len() - 1;
    (0..seen.len()).map(move |index| [&seen[index.saturating_sub(1)], &seen[index], &seen[(index + 1).min(last)]])
}

impl<S: Stop> Search<'_, S> {
    fn see(&mut self, moment: Moment) -> Result<Seen, SolveError> {
        if self.stop.stopped() {
            return Err(SolveError::Stopped);
        }
        self.states += moment.places();
        if self.states > self.max_states {
            return Err(SolveError::TooManyStates { limit: self.max_states });
        }
        let places = moment.first..=moment.last;
        let teeth: Result<Vec<_>, _> =
            places.map(|place| self.loaded.tooth(moment.position(&self.mesh, place))).collect();
        let teeth = teeth?;
        let wind_up = self.loaded.wind_up(&teeth)?;
        let loads: Result<Vec<_>, _> = teeth.iter().map(|tooth| self.loaded.loads(tooth, &wind_up)).collect();
        let loads = loads?;
        for loads in &loads {
            for (peak, load) in self.peaks.iter_mut().zip(loads) {
                *peak = peak.max(*load);
            }
        }
        Ok(Seen { moment, loads })
    }

    /// A moment inside a piece.
    fn see_at(&mut self, fraction: f64, from: &Moment, to: &Moment) -> Result<Seen, SolveError> {
        // Inside a piece mesh all teeth that mesh at either end.
        let (first, last) = (from.first.min(to.first), from.last.min(to.last));
        self.see(Moment { fraction, first, last, entering: None })
    }

    /// The moments of a piece, halved until straight lines between them are true to `resolution`.
    fn resolve(&mut self, Piece { start, end }: Piece, resolution: f64) -> Result<Vec<Seen>, SolveError> {
        let mut seen = vec![self.see(start)?];
        if start == end {
            return Ok(seen);
        }
        // The last to be looked at stands first, so that the piece is walked from its start.
        let mut pending = vec![(self.see(end)?, 0)];
        for interval in (1..FIRST_INTERVALS).rev() {
            let share = f64::from(interval) / f64::from(FIRST_INTERVALS);
            let fraction = start.fraction + share * (end.fraction - start.fraction);
            pending.push((self.see_at(fraction, &start, &end)?, 0));
        }
        let mut from = seen[0].clone();
        while let Some((to, depth)) = pending.pop() {
            let fraction = 0.5 * (from.moment.fraction + to.moment.fraction);
            let middle = self.see_at(fraction, &start, &end)?;
            if depth < MAX_DEPTH && self.bend(&from, &middle, &to) > resolution {
                pending.push((to, depth + 1));
                pending.push((middle, depth + 1));
            } else {
                seen.push(middle);
                seen.push(to.clone());
                from = to;
            }
        }
        Ok(seen)
    }

    /// How far a middle moment is off the straight line between its neighbours, over the peaks.
    fn bend(&self, from: &Seen, middle: &Seen, to: &Seen) -> f64 {
        let mut bend = 0.0_f64;
        for number in middle.moment.first..=middle.moment.last {
            let (from, middle, to) = (from.of(number), middle.of(number), to.of(number));
            for (kind, peak) in self.peaks.iter().enumerate() {
                bend = bend.max((middle[kind] - 0.5 * (from[kind] + to[kind])).abs() / peak);
            }
        }
        bend
    }

    /// Closes in on every extreme around the middle one of three moments that may be the largest of its kind.
    fn extremes_around(
        &mut self,
        before: &Seen,
        middle: &Seen,
        after: &Seen,
        tolerance: f64,
        extremes: &mut Vec<Seen>,
    ) -> Result<(), SolveError> {
        for number in middle.moment.first..=middle.moment.last {
            let (low, top, high) = (before.of(number), middle.of(number), after.of(number));
            for kind in 0..top.len() {
                // A straight line is at most a resolution off, so a lower peak than this stays below the largest.
                let may_be_largest = top[kind] >= (1.0 - 2.0 * COARSEST_RESOLUTION) * self.peaks[kind];
                if may_be_largest && top[kind] > 0.0 && top[kind] >= low[kind] && top[kind] >= high[kind] {
                    extremes.push(self.close_in(before, middle, after, number, kind, tolerance)?);
                }
            }
        }
        Ok(())
    }

    /// The moment of a load's largest value between two moments, to a relative tolerance of the value: parabolas where they are
    /// safe, golden sections elsewhere (Brent 1973).
    fn close_in(
        &mut self,
        before: &Seen,
        middle: &Seen,
        after: &Seen,
        number: u64,
        kind: usize,
        tolerance: f64,
    ) -> Result<Seen, SolveError> {
        let golden = 0.5 * (3.0 - 5.0_f64.sqrt());
        let (start, end) = (before.moment, after.moment);
        let (mut low, mut high) = (start.fraction, end.fraction);
        let mut best = middle.clone();
        let (mut second, mut third) = (best.moment.fraction, best.moment.fraction);
        let (mut at_second, mut at_third) = (best.of(number)[kind], best.of(number)[kind]);
        let (mut step, mut last_step) = (0.0_f64, 0.0_f64);
        // Around a smooth peak the value is off by the square of this, times what it varies by over the bracket; with clearance a peak
        // may be a kink, where another tooth begins to carry, and the value is off by as much as the place.
        let share = if self.loaded.linear_compliance_mm_per_n().is_some() { tolerance.sqrt() } else { tolerance };
        let nearest = (0.1 * share * (high - low)).max(f64::EPSILON);
        for _ in 0..MAX_STEPS {
            let x = best.moment.fraction;
            let value = best.of(number)[kind];
            let center = 0.5 * (low + high);
            if (x - center).abs() + 0.5 * (high - low) <= 2.0 * nearest {
                break;
            }
            let r = (x - second) * (at_third - value);
            let q = (x - third) * (at_second - value);
            let denominator = 2.0 * (q - r);
            let shift = ((x - third) * q - (x - second) * r) / denominator;
            let is_safe =
                shift.is_finite() && shift.abs() < 0.5 * last_step.abs() && x - shift > low && x - shift < high;
            last_step = step;
            if is_safe {
                step = -shift;
            } else {
                last_step = if x < center { high - x } else { low - x };
                step = golden * last_step;
            }
            let moved = if step.abs() < nearest { nearest.copysign(step) } else { step };
            let seen = self.see_at((x + moved).clamp(low, high), &start, &end)?;
            let (u, at_u) = (seen.moment.fraction, seen.of(number)[kind]);
            if at_u >= value {
                if u < x {
                    high = x
                } else {
                    low = x
                }
                (third, at_third, second, at_second) = (second, at_second, x, value);
                best = seen;
            } else {
                if u < x {
                    low = u
                } else {
                    high = u
                }
                if at_u >= at_second || second.total_cmp(&x).is_eq() {
                    (third, at_third, second, at_second) = (second, at_second, u, at_u);
                } else if at_u >= at_third || third.total_cmp(&x).is_eq() || third.total_cmp(&second).is_eq() {
                    (third, at_third) = (u, at_u);
                }
            }
        }
        Ok(best)
    }
}
