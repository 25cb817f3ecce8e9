//! Search for the extremes of a sweep (docs/explanation/theory.md section 9, *True extremes*).
//!
//! A lap is cut where a tooth enters. Between two cuts, every load of every tooth and every total is a smooth curve
//! over the input angle. With gaps, the curves are smooth between two changes of the set of carrying teeth. A few
//! evaluated moments bound the curves: polynomials through six of them estimate the maximum between two, and their own
//! error. Only intervals that may exceed the largest value seen are evaluated again, all quantities together.

use std::cell::OnceCell;
use std::ops::Range;

use crate::load_sharing::LoadedDrive;
use crate::mesh::Mesh;
use crate::position::Position;
use crate::ring::TipCorner;
use crate::root::NotConverged;
use crate::sweep::points::Tolerance;
use crate::{SolveError, Stop};

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

/// Part of a lap in which no tooth enters. Teeth are at the places from 1 on.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Piece {
    /// Number of laps before; 0 if all laps are alike.
    pub(crate) lap: u64,
    /// Elapsed shares of the lap.
    pub(crate) start: f64,
    pub(crate) end: f64,
    /// Number of places where teeth are listed.
    pub(crate) places: u64,
    /// The tooth at the end of the flank, or entering, at the start.
    pub(crate) at_start: Option<AtPlace>,
    /// The tooth just before the flank at the end.
    pub(crate) at_end: Option<AtPlace>,
}

/// Exact position of the tooth at a place.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct AtPlace {
    pub(crate) place: u64,
    pub(crate) position: Position,
}

impl Piece {
    /// Returns the pieces of a lap.
    pub(crate) fn of(loaded: &LoadedDrive<'_>, lap: u64) -> impl Iterator<Item = Self> + use<> {
        let mesh = *loaded.mesh();
        let relieved_fraction =
            loaded.gaps().modification().ring_tip_relief.map(|relief| mesh.fraction_at_deg(relief.start_deg));
        let (places, entry) = (mesh.whole_spacings(), mesh.entry_fraction());
        let is_whole = mesh.spacings_are_whole();
        let entering = |place| Some(AtPlace { place, position: mesh.last_position() });
        let at_start = if is_whole { entering(places) } else { None };
        let first = Self { lap, start: 0.0, end: if is_whole { 1.0 } else { entry }, places, at_start, at_end: None };
        let rest =
            Self { lap, start: entry, end: 1.0, places: places + 1, at_start: entering(places + 1), at_end: None };
        let pieces = std::iter::once(first).chain((!is_whole).then_some(rest));
        let pieces = pieces.flat_map(move |piece| piece.cut_where_a_tooth_comes_to_the_flank(&mesh));
        pieces.flat_map(move |piece| piece.cut_where_a_tooth_comes_to_the_relief(relieved_fraction))
    }

    /// Cuts the piece where a tooth reaches the flank: loads have a kink there, and the ring's stress begins.
    fn cut_where_a_tooth_comes_to_the_flank(self, mesh: &Mesh) -> impl Iterator<Item = Self> + use<> {
        let (place, fraction) = mesh.flank_fraction();
        let limit = *mesh.flank_limit();
        let on_flank = Some(AtPlace { place, position: limit.position });
        let before = Some(AtPlace { place, position: TipCorner::last_before_flank(&limit) });
        self.cut_at(mesh.lists_teeth_before_flank().then_some(fraction), [before, on_flank])
    }

    /// Cuts the piece where a tooth reaches the tip relief. Its gap has a kink there for power 1, otherwise it grows
    /// smoothly.
    fn cut_where_a_tooth_comes_to_the_relief(self, fraction: Option<f64>) -> impl Iterator<Item = Self> + use<> {
        self.cut_at(fraction, [None, None])
    }

    /// Returns the pieces before and after a fraction within, with the exactly known tooth at the cut.
    fn cut_at(
        self,
        fraction: Option<f64>,
        [at_end, at_start]: [Option<AtPlace>; 2],
    ) -> impl Iterator<Item = Self> + use<> {
        let cut = fraction.filter(|&fraction| fraction > self.start && fraction < self.end);
        let before = cut.map_or(self, |end| Self { end, at_end, ..self });
        std::iter::once(before).chain(cut.map(|start| Self { start, at_start, ..self }))
    }

    /// Returns the position at a place.
    pub(crate) fn position(&self, mesh: &Mesh, place: u64, fraction: f64) -> Position {
        self.exactly_at(fraction)
            .find(|at| at.place == place)
            .map_or_else(|| mesh.position_between(place, fraction), |at| at.position)
    }

    /// Returns the teeth with exactly known positions.
    pub(crate) fn exactly_at(&self, fraction: f64) -> impl Iterator<Item = AtPlace> + use<> {
        let at_start = self.at_start.filter(|_| fraction <= self.start);
        at_start.into_iter().chain(self.at_end.filter(|_| fraction >= self.end))
    }
}

/// Evaluated moments of a piece.
#[derive(Debug)]
pub(crate) struct Seen {
    pub(crate) piece: Piece,
    /// Number of teeth in it, place by place.
    pub(crate) teeth: usize,
    /// Elapsed shares of the lap, in order of evaluation.
    pub(crate) fractions: Vec<f64>,
    /// For each moment the loads, by quantity and then tooth, and then the totals.
    values: Vec<f64>,
    /// For each moment the rotation of every tooth beyond closure; negative if a gap is open. Empty without gaps.
    pressed: Vec<f64>,
    /// Indices of the moments in order of their fractions.
    order: Vec<usize>,
    /// For each moment, true if the interval up to the next one needs no further evaluation.
    is_settled: Vec<bool>,
    /// Fractions to evaluate next.
    wanted: Vec<f64>,
}

impl Seen {
    pub(crate) fn new(piece: Piece, teeth: usize) -> Self {
        let intervals = if piece.end - piece.start < SHORTEST_PIECE { 1 } else { FIRST_INTERVALS };
        let share = |interval| f64::from(interval) / f64::from(intervals);
        let inside = (1..intervals).map(|interval| piece.start + share(interval) * (piece.end - piece.start));
        let wanted = std::iter::once(piece.start).chain(inside).chain([piece.end]).collect();
        Self {
            piece,
            teeth,
            fractions: Vec::new(),
            values: Vec::new(),
            pressed: Vec::new(),
            order: Vec::new(),
            is_settled: Vec::new(),
            wanted,
        }
    }

    const fn stride(&self) -> usize {
        LOADS * self.teeth + TOTALS
    }

    /// Appends a moment and returns its values, to be filled in.
    pub(crate) fn push(&mut self, fraction: f64) -> &mut [f64] {
        self.fractions.push(fraction);
        self.is_settled.push(false);
        let (start, stride) = (self.values.len(), self.stride());
        self.values.resize(start + stride, 0.0);
        &mut self.values[start..]
    }

    /// Appends the rotation beyond closure of the teeth of the last moment.
    pub(crate) fn push_pressed(&mut self, pressed: impl Iterator<Item = f64>) {
        self.pressed.extend(pressed);
    }

    /// Returns the values of a moment.
    pub(crate) fn values(&self, moment: usize) -> &[f64] {
        &self.values[moment * self.stride()..][..self.stride()]
    }

    /// Returns a load of a tooth at a moment.
    pub(crate) fn load(&self, moment: usize, quantity: usize, tooth: usize) -> f64 {
        self.values(moment)[quantity * self.teeth + tooth]
    }

    /// Returns the range of a quantity's curves among a moment's values: one for each tooth, one for a total.
    const fn curves(&self, quantity: usize) -> Range<usize> {
        if quantity < LOADS {
            quantity * self.teeth..(quantity + 1) * self.teeth
        } else {
            let at = LOADS * self.teeth + quantity - LOADS;
            at..at + 1
        }
    }

    fn value(&self, moment: usize, curve: usize) -> f64 {
        self.values[moment * self.stride() + curve]
    }

    pub(crate) fn pressed(&self, moment: usize) -> &[f64] {
        &self.pressed[moment * self.teeth..][..self.teeth]
    }

    /// Returns the first tooth that carries at only one of two moments.
    fn tooth_changed(&self, one: usize, other: usize) -> Option<usize> {
        if self.pressed.is_empty() {
            return None;
        }
        let (one_rad, other_rad) = (self.rotation_rad(one), self.rotation_rad(other));
        self.pressed(one).iter().zip(self.pressed(other)).position(|(&one, &other)| {
            // No rotation closes the gap of a tooth without a lever arm. A tooth there without a gap carries.
            let has_gap = |pressed: f64, rotation_rad: f64| rotation_rad - pressed > CLOSED * rotation_rad;
            (one > 0.0) != (other > 0.0)
                && (one.is_finite() || has_gap(other, other_rad))
                && (other.is_finite() || has_gap(one, one_rad))
        })
    }

    /// Returns a fraction between two successive moments at which some tooth may carry although it is open at both, or
    /// may be open although it carries at both. The lines through the neighbouring moments, extended, then meet beyond
    /// zero. A curve that bends towards zero stays on this side of both lines.
    fn suspected_change(&self, at: usize) -> Option<f64> {
        let moments = [at.checked_sub(1), Some(at), Some(at + 1), Some(at + 2)];
        let [before, one, other, after] = moments.map(|at| self.order.get(at?).copied());
        let (one, other) = (one?, other?);
        let (low, high) = (self.fractions[one], self.fractions[other]);
        let slope = |from: usize, to: usize, tooth: usize| {
            (self.pressed(to)[tooth] - self.pressed(from)[tooth]) / (self.fractions[to] - self.fractions[from])
        };
        let nothing = CLOSED * self.rotation_rad(one);
        let meeting = |tooth: usize| {
            // Treat it as not carrying: a curve below zero.
            let sign = if self.pressed(one)[tooth] > 0.0 { -1.0 } else { 1.0 };
            let [start, end] = [one, other].map(|moment| sign * self.pressed(moment)[tooth]);
            let own = (end - start) / (high - low);
            let beside = |from: Option<usize>, to: Option<usize>| Some(sign * slope(from?, to?, tooth));
            // At the end of a piece, the curve is assumed to bend as on the known side.
            let (rise, fall) = match (beside(before, Some(one)), beside(Some(other), after)) {
                (Some(rise), Some(fall)) => (rise, fall),
                (Some(rise), None) => (rise, 2.0 * own - rise),
                (None, Some(fall)) => (2.0 * own - fall, fall),
                (None, None) => return None,
            };
            let share = (own - fall) / (rise - fall);
            let top = start + rise * share * (high - low);
            let is_on_one_side = start <= 0.0 && end <= 0.0;
            (is_on_one_side && rise > own && own > fall && top > nothing)
                .then_some(low + share.clamp(0.125, 0.875) * (high - low))
        };
        (0..self.teeth).find_map(meeting)
    }

    fn rotation_rad(&self, moment: usize) -> f64 {
        self.value(moment, LOADS * self.teeth)
    }

    /// Sorts the new moments into the order.
    fn put_in_order(&mut self) {
        let fractions = &self.fractions;
        self.order.extend(self.order.len()..fractions.len());
        self.order.sort_by(|&one, &other| fractions[one].total_cmp(&fractions[other]));
    }
}

/// Evaluates moments.
pub(crate) trait Look {
    /// Returns true if teeth begin and cease to carry between their entry and their exit.
    fn has_gaps(&self) -> bool;

    /// Returns true if forces are proportional to the teeth's displacements. Every curve is then smooth up to its ends.
    fn is_linear(&self) -> bool;

    /// Returns true if the stiffness is proportional to the reciprocal of the rotation, so that they share their
    /// extremes.
    fn is_in_proportion(&self) -> bool;

    /// Returns `M0` in N·mm.
    fn input_torque_nmm(&self) -> f64;

    /// Returns a rotation that has the rounding error of a tooth's gap at a corner, if teeth press against corners.
    ///
    /// # Errors
    /// [`NotConverged`] from the path.
    fn distance_at_corner_rad(&self) -> Result<f64, NotConverged> {
        Ok(0.0)
    }

    /// Returns the number of teeth that are distinguished at each place.
    fn teeth_at_each_place(&self) -> u64;

    /// Appends moments of a piece. Returns false if this method does not support the drive.
    ///
    /// # Errors
    /// The reason why there is no answer.
    fn look(&mut self, fractions: &[f64], seen: &mut Seen) -> Result<bool, SolveError>;
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

struct Search {
    tolerance: Tolerance,
    /// Largest error of linear interpolation between the moments, over the peaks. None if only the peaks are needed.
    lines: Option<f64>,
    is_sought: [bool; QUANTITIES],
    seen: Vec<Seen>,
    best: [Best; QUANTITIES],
    states: u64,
}

/// Searches for the largest value of every quantity. Returns none if this evaluation method does not support the drive.
///
/// # Errors
/// Errors of the evaluation; [`SolveError::TooManyStates`] beyond the tolerance's limit, [`SolveError::Stopped`] if
/// stopped.
pub(crate) fn search(
    look: &mut impl Look,
    pieces: impl Iterator<Item = Piece>,
    tolerance: Tolerance,
    lines: Option<f64>,
    stop: &dyn Stop,
) -> Result<Option<Found>, SolveError> {
    let teeth = |piece: &Piece| usize::try_from(piece.places * look.teeth_at_each_place()).unwrap_or(usize::MAX);
    let mut is_sought = [true; QUANTITIES];
    if look.is_in_proportion() {
        STIFFNESSES.iter().for_each(|&quantity| is_sought[quantity] = false);
    }
    let (mut seen, mut states) = (Vec::new(), 0_u64);
    // Pieces are evaluated one by one: deviating items may need millions of laps, more than fit in memory.
    for piece in pieces {
        let of_piece = Seen::new(piece, teeth(&piece));
        states = states.saturating_add((of_piece.wanted.len() * of_piece.teeth) as u64);
        if states > tolerance.max_states() {
            return Err(SolveError::TooManyStates { limit: tolerance.max_states() });
        }
        if stop.stopped() {
            return Err(SolveError::Stopped);
        }
        seen.push(of_piece);
    }
    let mut search = Search { tolerance, lines, is_sought, seen, best: [Best::default(); QUANTITIES], states: 0 };
    let mut excess = 0.0;
    for round in 0..MAX_ROUNDS {
        if !search.look(look)? {
            return Ok(None);
        }
        excess = search.want(round, look.has_gaps(), look.is_linear());
        let wanted: usize = search.seen.iter().map(|seen| seen.wanted.len()).sum();
        if wanted == 0 {
            return Ok(Some(Found { seen: search.seen, best: search.best }));
        }
    }
    // The remaining excess is more than rounding only if the curves are not smooth.
    let rounding = search.rounding(look.input_torque_nmm(), look.distance_at_corner_rad()?);
    if excess > tolerance.relative().max(OPEN).max(rounding) {
        return Err(NotConverged { what: "extremes of a sweep", iterations: MAX_ROUNDS, bracket_width: excess }.into());
    }
    Ok(Some(Found { seen: search.seen, best: search.best }))
}

impl Search {
    /// Returns the effect of rounding of closing angles on the loads, including a bend counted several times. The
    /// amplification is `Δφ K/M`, with M the given or the allowed torque. If teeth press against corners, Δφ is at
    /// least [`Look::distance_at_corner_rad`].
    fn rounding(&self, input_torque_nmm: f64, distance_at_corner_rad: f64) -> f64 {
        let [rotation_rad, stiffness_nmm_per_rad] = [LOADS, STIFFNESSES[0]].map(|quantity| self.best[quantity].value);
        let per_torque = self.best[CAPACITY].value.max(1.0 / input_torque_nmm);
        ROUNDINGS * f64::EPSILON * (rotation_rad.max(distance_at_corner_rad) * stiffness_nmm_per_rad * per_torque)
    }

    /// Evaluates the wanted moments.
    fn look(&mut self, look: &mut impl Look) -> Result<bool, SolveError> {
        for (piece, seen) in self.seen.iter_mut().enumerate() {
            let wanted = std::mem::take(&mut seen.wanted);
            if wanted.is_empty() {
                continue;
            }
            self.states += (wanted.len() * seen.teeth) as u64;
            let limit = self.tolerance.max_states();
            if self.states > limit {
                return Err(SolveError::TooManyStates { limit });
            }
            let first = seen.fractions.len();
            if !look.look(&wanted, seen)? {
                return Ok(false);
            }
            seen.put_in_order();
            for moment in first..seen.fractions.len() {
                for (quantity, best) in self.best.iter_mut().enumerate() {
                    let curves = seen.curves(quantity);
                    let values = &seen.values(moment)[curves];
                    let most = values.iter().fold(0.0_f64, |most, &value| most.max(value));
                    if most > best.value {
                        let tooth = values.iter().position(|&value| value >= most).unwrap_or(0);
                        *best = Best { value: most, piece, moment, tooth };
                    }
                }
            }
        }
        Ok(true)
    }

    /// Records the fractions to evaluate next. Returns the relative amount by which a quantity may still rise.
    fn want(&mut self, round: u32, has_gaps: bool, is_linear: bool) -> f64 {
        let relative = self.tolerance.relative();
        let nearest = (1e-3 * relative).max(16.0 * f64::EPSILON);
        let judge = Judge {
            best: std::array::from_fn(|quantity| self.best[quantity].value),
            relative,
            nearest,
            is_late: round >= SMOOTH_ROUNDS,
            is_linear,
            lines: self.lines,
            is_sought: self.is_sought,
        };
        let mut most = 0.0_f64;
        for seen in &mut self.seen {
            if has_gaps {
                judge.close_in_on_changes(seen, round);
            }
            most = most.max(judge.want(seen));
            seen.wanted.sort_by(f64::total_cmp);
            seen.wanted.dedup_by(|one, other| (*one - *other).abs() <= f64::EPSILON);
        }
        most
    }
}

/// Criteria for the intervals between moments.
struct Judge {
    best: [f64; QUANTITIES],
    relative: f64,
    /// Intervals shorter than this part of a lap need no evaluation.
    nearest: f64,
    is_late: bool,
    is_linear: bool,
    lines: Option<f64>,
    is_sought: [bool; QUANTITIES],
}

impl Judge {
    /// Narrows the intervals in which the set of carrying teeth changes. For the first tooth that changes, it
    /// extrapolates the line through the two moments on one side.
    fn close_in_on_changes(&self, seen: &mut Seen, round: u32) {
        for at in 1..seen.order.len() {
            let (one, other) = (seen.order[at - 1], seen.order[at]);
            let Some(tooth) = seen.tooth_changed(one, other) else {
                if seen.fractions[other] - seen.fractions[one] > self.nearest {
                    let suspected = seen.suspected_change(at - 1);
                    seen.wanted.extend(suspected);
                }
                continue;
            };
            let (low, high) = (seen.fractions[one], seen.fractions[other]);
            if !self.change_matters(seen, one, other) {
                continue;
            }
            let pressed = |moment: usize| (seen.fractions[moment], seen.pressed(moment)[tooth]);
            let by_line = |(x, y): (f64, f64), (from, to): (f64, f64)| x - y * (x - from) / (y - to);
            let from_side = |near: usize, beyond: Option<usize>| {
                let far = beyond.filter(|&far| seen.tooth_changed(far, near).is_none())?;
                Some(by_line(pressed(near), pressed(far))).filter(|&root| root > low && root < high)
            };
            let before = from_side(one, at.checked_sub(2).map(|before| seen.order[before]));
            let after = from_side(other, seen.order.get(at + 1).copied());
            let is_low_nearer = pressed(one).1.abs() < pressed(other).1.abs();
            let by_side = if is_low_nearer { before.or(after) } else { after.or(before) };
            let root = by_side.unwrap_or_else(|| by_line(pressed(one), pressed(other)));
            let root = Some(root).filter(|root| root.is_finite());
            // Every third round bisects, and finally every round, so that no kink prevents convergence.
            let halves = self.is_late || round % 3 == 2 || root.is_none();
            seen.wanted.extend(halves.then_some(0.5 * (low + high)));
            let step = (0.25 * self.nearest).min(0.25 * (high - low));
            seen.wanted
                .extend(root.filter(|_| self.is_late || !halves).map(|root| root.clamp(low + step, high - step)));
        }
    }

    /// Returns true if two moments at a change are far enough apart for a value between them to matter.
    fn change_matters(&self, seen: &Seen, one: usize, other: usize) -> bool {
        let width = seen.fractions[other] - seen.fractions[one];
        if width <= 16.0 * f64::EPSILON {
            return false;
        }
        if width > self.nearest {
            return true;
        }
        // The stiffness may jump there.
        (0..QUANTITIES).filter(|quantity| !STIFFNESSES.contains(quantity)).any(|quantity| {
            let most = self.best[quantity];
            seen.curves(quantity).any(|curve| {
                let (one, other) = (seen.value(one, curve), seen.value(other, curve));
                let rise = (one - other).abs();
                rise > 0.125 * self.relative * most && one.max(other) + rise > most
            })
        })
    }

    /// Records the fractions of a piece to evaluate. Returns the relative amount by which a quantity may still rise.
    fn want(&self, seen: &mut Seen) -> f64 {
        let mut candidates: [Vec<Candidate>; QUANTITIES] = Default::default();
        let (mut wanted, mut settled) = (std::mem::take(&mut seen.wanted), Vec::new());
        let mut start = 0;
        for end in 1..=seen.order.len() {
            let goes_on = end < seen.order.len() && seen.tooth_changed(seen.order[end - 1], seen.order[end]).is_none();
            if !goes_on {
                let (is_first, is_last) = (start == 0, end == seen.order.len());
                let run = Run { seen, moments: &seen.order[start..end], is_first, is_last };
                self.judge(&run, &mut candidates, &mut wanted, &mut settled);
                start = end;
            }
        }
        let mut most = 0.0_f64;
        let at_once = if self.is_late { CORNERS_AT_ONCE } else { 1 };
        for (candidates, best) in candidates.iter_mut().zip(self.best) {
            candidates.sort_by(|one, other| other.bound.total_cmp(&one.bound));
            most = candidates.first().map_or(most, |highest| most.max(highest.bound / best - 1.0));
            for Candidate { cuts, ends: [low, high], .. } in candidates.iter().take(at_once) {
                wanted.extend(cuts.map(|cut| low + cut * (high - low)));
            }
        }
        settled.into_iter().for_each(|moment: usize| seen.is_settled[moment] = true);
        seen.wanted = wanted;
        most
    }

    /// Judges the intervals of a run against the peaks so far.
    fn judge(
        &self,
        run: &Run<'_>,
        candidates: &mut [Vec<Candidate>; QUANTITIES],
        wanted: &mut Vec<f64>,
        settled: &mut Vec<usize>,
    ) {
        let seen = run.seen;
        let count = run.moments.len();
        if count < 2 || run.fraction(count - 1) - run.fraction(0) <= self.nearest {
            return;
        }
        if count < NODES {
            // Too few moments for a bound.
            let cuts: &[f64] = if count < 3 { &[0.25, 0.5, 0.75] } else { &[0.5] };
            for [low, high] in (1..count).map(|at| [run.fraction(at - 1), run.fraction(at)]) {
                if high - low > self.nearest {
                    wanted.extend(cuts.iter().map(|cut| low + cut * (high - low)));
                }
            }
            return;
        }
        let mut coarse = vec![0.0; seen.stride()];
        for (quantity, best) in self.best.iter().enumerate() {
            let share = if quantity == CAPACITY { COARSE_CORNER } else { COARSE_BEND };
            coarse[seen.curves(quantity)].fill(share * best);
        }
        let (mut curve_bends, mut curve_bounds) = (coarse.clone(), coarse.clone());
        for at in 0..count - 1 {
            let moment = run.moments[at];
            let ends = [run.fraction(at), run.fraction(at + 1)];
            if seen.is_settled[moment] || ends[1] - ends[0] <= self.nearest {
                continue;
            }
            Bends::new(run, at).margins(&coarse, &mut curve_bends, &mut curve_bounds);
            let nodes = OnceCell::new();
            let may_leave_by_powers = !self.is_linear && (at < 2 || at + 3 >= count);
            let off = if may_leave_by_powers { OFF_BY_POWERS } else { OFF_SMOOTH };
            let towards_end = match (at == 0, at + 2 == count) {
                _ if self.is_linear => None,
                (true, _) => Some(TOWARDS_START),
                (_, true) => Some(TOWARDS_START.map(|cut| 1.0 - cut)),
                _ => None,
            };
            let is_beside_change =
                (at == 0 && !run.is_first || at + 2 == count && !run.is_last) && ends[1] - ends[0] <= SHORT;
            let (mut is_settled, mut bends_too_much) = (true, false);
            for quantity in (0..QUANTITIES).filter(|&quantity| self.is_sought[quantity] && self.best[quantity] > 0.0) {
                if is_beside_change && STIFFNESSES.contains(&quantity) {
                    continue;
                }
                let best = self.best[quantity];
                let limit = best * (1.0 + 0.25 * self.relative);
                let curves = seen.curves(quantity);
                bends_too_much |=
                    self.lines.is_some_and(|lines| curve_bends[curves.clone()].iter().any(|&bend| bend > lines * best));
                for curve in curves {
                    let of_curve = curve_bounds[curve];
                    if of_curve <= limit {
                        continue;
                    }
                    let (bound, cuts) = match towards_end {
                        Some(cuts) => (of_curve, cuts),
                        None if quantity == CAPACITY => (of_curve, QUARTERS),
                        None => match nodes.get_or_init(|| Nodes::of(run, at)) {
                            None => (f64::INFINITY, QUARTERS),
                            Some(nodes) => match nodes.summit(seen, curve, off) {
                                Summit { bound, .. } if bound <= limit => continue,
                                Summit { bound, error, .. } if error > SURE * best || self.is_late => (bound, QUARTERS),
                                Summit { bound, top, at, .. } => {
                                    let is_seen = top <= best * (1.0 + 0.125 * self.relative);
                                    (bound, [if is_seen { 0.5 } else { at.clamp(1e-3, 1.0 - 1e-3) }; 3])
                                }
                            },
                        },
                    };
                    is_settled = false;
                    candidates[quantity].push(Candidate { bound, cuts, ends });
                }
            }
            if bends_too_much {
                wanted.push(0.5 * (ends[0] + ends[1]));
            } else if is_settled {
                settled.push(moment);
            }
        }
    }
}

/// Upper bound of a quantity on an interval.
#[derive(Clone, Copy)]
struct Candidate {
    bound: f64,
    /// Points to evaluate, from 0 to 1 along the interval.
    cuts: [f64; 3],
    ends: [f64; 2],
}

/// Successive moments at which the same teeth carry.
struct Run<'a> {
    seen: &'a Seen,
    moments: &'a [usize],
    /// True if the piece, and not a change of these teeth, bounds the run at its start or its end.
    is_first: bool,
    is_last: bool,
}

impl Run<'_> {
    fn fraction(&self, at: usize) -> f64 {
        self.seen.fractions[self.moments[at]]
    }
}

/// Second differences at both ends of an interval, from the neighbouring moments. At an end of the run both are those
/// of the moment next to it.
struct Bends<'a> {
    ends: [&'a [f64]; 2],
    beside: [[&'a [f64]; 3]; 2],
    /// Weights of three moments that give the bend of this interval.
    weights: [[f64; 3]; 2],
}

impl<'a> Bends<'a> {
    /// Returns the bends in a run of three moments or more.
    fn new(run: &Run<'a>, at: usize) -> Self {
        let last = run.moments.len() - 3;
        let starts = [at.saturating_sub(1).min(last), at.min(last)];
        let width = run.fraction(at + 1) - run.fraction(at);
        let is_at_end = at == 0 || at == last + 1;
        let weights = starts.map(|start| {
            let [x, y, z] = [0, 1, 2].map(|step| run.fraction(start + step));
            // By curvature for smooth curves. For two lines by the difference of slopes, of which one end shows only a
            // part.
            let scale = (width * width / (z - x)).max(if is_at_end { width } else { 0.5 * width });
            let (before, after) = (scale / (y - x), scale / (z - y));
            [before, -(before + after), after]
        });
        let values = |at: usize| run.seen.values(run.moments[at]);
        Self {
            ends: [values(at), values(at + 1)],
            beside: starts.map(|start| [values(start), values(start + 1), values(start + 2)]),
            weights,
        }
    }

    /// Computes the bend of each curve, a quarter of which is the rise of a parabola, and its bound. `coarse` is by
    /// curve.
    fn margins(&self, coarse: &[f64], bends: &mut [f64], bounds: &mut [f64]) {
        let count = coarse.len();
        let [[a, b, c], [d, e, f]] = self.weights;
        let of = |values: &'a [f64]| &values[..count];
        let [[x, y, z], [u, v, w]] = self.beside.map(|beside| beside.map(of));
        let [low, high] = self.ends.map(of);
        let (bends, bounds) = (&mut bends[..count], &mut bounds[..count]);
        for i in 0..count {
            let one = (a * x[i] + b * y[i] + c * z[i]).abs();
            let other = (d * u[i] + e * v[i] + f * w[i]).abs();
            let bend = if one > other { one } else { other };
            let end = if low[i] > high[i] { low[i] } else { high[i] };
            bends[i] = bend;
            bounds[i] = end + bend * if bend > coarse[i] { COARSE_MARGIN } else { MARGIN };
        }
    }
}

/// Moments that bound a curve on an interval, in units of its length. Its ends are at 0 and 1; the others follow by
/// distance.
struct Nodes {
    moments: [usize; NODES],
    places: [f64; NODES],
    /// Reciprocals of the distance of each node from the one this many before it.
    reciprocals: [[f64; NODES]; NODES],
}

/// Maximum of a curve on an interval, by the polynomial through its nodes.
struct Summit {
    /// Value.
    top: f64,
    /// Place, from 0 to 1.
    at: f64,
    /// Error estimate of the polynomial.
    error: f64,
    /// Upper bound of the curve.
    bound: f64,
}

impl Nodes {
    /// Returns the nodes of a run; none if there are too few. Nodes closer than a quarter of the interval only show
    /// rounding.
    fn of(run: &Run<'_>, at: usize) -> Option<Self> {
        const APART: f64 = 0.25;
        let origin = run.fraction(at);
        let width = run.fraction(at + 1) - origin;
        let place = |at: usize| (run.fraction(at) - origin) / width;
        let mut nodes =
            Self { moments: [run.moments[at]; NODES], places: [0.0; NODES], reciprocals: [[0.0; NODES]; NODES] };
        (nodes.moments[1], nodes.places[1]) = (run.moments[at + 1], 1.0);
        let (mut low, mut high) = (0.0, 1.0);
        let mut before = (0..at).rev().map(|at| (at, place(at))).peekable();
        let mut after = (at + 2..run.moments.len()).map(|at| (at, place(at))).peekable();
        for node in 2..NODES {
            while before.next_if(|&(_, place)| place > low - APART).is_some() {}
            while after.next_if(|&(_, place)| place < high + APART).is_some() {}
            let is_before_nearer = match (before.peek(), after.peek()) {
                (None, None) => return None,
                (Some(_), None) => true,
                (None, Some(_)) => false,
                (Some((_, before)), Some((_, after))) => -before < after - 1.0,
            };
            let (at, place) = if is_before_nearer { before.next()? } else { after.next()? };
            if is_before_nearer {
                low = place
            } else {
                high = place
            }
            (nodes.moments[node], nodes.places[node]) = (run.moments[at], place);
        }
        for order in 1..NODES {
            for node in order..NODES {
                nodes.reciprocals[order][node] = 1.0 / (nodes.places[node] - nodes.places[node - order]);
            }
        }
        Some(nodes)
    }

    /// Returns the maximum of a curve whose polynomial may be off by this multiple of its last term.
    fn summit(&self, seen: &Seen, curve: usize, off: f64) -> Summit {
        let u = &self.places;
        let values = self.moments.map(|moment| seen.value(moment, curve));
        // Newton's divided differences.
        let mut c = values;
        for order in 1..NODES {
            for node in (order..NODES).rev() {
                c[node] = (c[node] - c[node - 1]) * self.reciprocals[order][node];
            }
        }
        // The last two terms in the middle.
        let fourth = c[4].abs() * 0.25 * ((0.5 - u[2]) * (0.5 - u[3])).abs();
        let fifth = c[5].abs() * 0.25 * ((0.5 - u[2]) * (0.5 - u[3]) * (0.5 - u[4])).abs();
        let error = off * fifth.max(OF_TERM_BEFORE * fourth);
        // Coefficients of powers of the place.
        let mut a = [0.0; NODES];
        a[0] = c[NODES - 1];
        for node in (0..NODES - 1).rev() {
            for power in (1..NODES).rev() {
                a[power] = a[power - 1] - u[node] * a[power];
            }
            a[0] = c[node] - u[node] * a[0];
        }
        let value = |x: f64| a[0] + x * (a[1] + x * (a[2] + x * (a[3] + x * (a[4] + x * a[5]))));
        let slope = |x: f64| a[1] + x * (2.0 * a[2] + x * (3.0 * a[3] + x * (4.0 * a[4] + x * 5.0 * a[5])));
        let bend = |x: f64| 2.0 * a[2] + x * (6.0 * a[3] + x * (12.0 * a[4] + x * 20.0 * a[5]));
        let higher = values[0].max(values[1]);
        // Effect of the error on the slope: nodes are at least a quarter apart.
        let slope_error = 8.0 * error;
        let slopes = [0.0, 0.5, 1.0].map(slope);
        let is_steep =
            slopes.iter().all(|&slope| slope > slope_error) || slopes.iter().all(|&slope| slope < -slope_error);
        if is_steep {
            return Summit { top: higher, at: 0.5, error, bound: higher };
        }
        let (mut top, mut at, mut from_end) = (higher, 0.5_f64, 0.0);
        if slopes[0] > 0.0 && slopes[2] < 0.0 {
            let (mut low, mut high) = (0.0, 1.0);
            for _ in 0..SUMMIT_STEPS {
                let found = slope(at);
                if found > 0.0 {
                    low = at
                } else {
                    high = at
                }
                let newton = at - found / bend(at);
                // After convergence it is at an end.
                at = if newton >= low && newton <= high { newton } else { 0.5 * (low + high) };
            }
            top = higher.max(value(at));
            from_end = at.min(1.0 - at);
        }
        // At its nodes the polynomial is exact. An error of the slope changes the maximum by at most the error times
        // the distance from the nearer end. It shifts the maximum of a concave curve only slightly.
        let least_bend = [0.0, 0.5, 1.0].map(|x| -bend(x)).into_iter().fold(f64::INFINITY, f64::min);
        let above =
            if least_bend > 0.0 { error.min(slope_error * (0.5 * slope_error / least_bend + from_end)) } else { error };
        Summit { top, at, error, bound: top + above }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Drive;
    use crate::sweep::tried::PAPER_5_1;

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
            Bends::new(&run, stretch).margins(&[f64::INFINITY], &mut bends, &mut bounds);
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
            seen.push_pressed(std::iter::once(pressed(fraction)));
        })
    }

    #[test]
    fn splits_piece_where_tooth_reaches_relief_start() {
        let mesh = Mesh::new(&Drive::new(&PAPER_5_1).expect("a possible drive"));
        let whole = Piece { lap: 0, start: 0.0, end: 1.0, places: 7, at_start: None, at_end: None };
        for start_deg in [1.0, 13.4, 20.0, 31.0, 50.0, 89.0] {
            let fraction = mesh.fraction_at_deg(start_deg);
            let [before, behind] = whole.cut_where_a_tooth_comes_to_the_relief(Some(fraction)).collect::<Vec<_>>()[..]
            else {
                panic!("{start_deg} deg: no cut at {fraction}")
            };
            assert_eq!((before.start, before.end, behind.start, behind.end), (0.0, fraction, fraction, 1.0));
            let off_deg = |place| (before.position(&mesh, place, fraction).from_lobe_deg() - start_deg).abs();
            assert!((1..=7).any(|place| off_deg(place) < 1e-12), "{start_deg} deg: cut at {fraction}");
        }
    }

    /// The secants on both sides of a parabola's interval meet in its middle.
    #[test]
    fn suspects_change_between_moments_at_interval_middle() {
        let judge = Judge {
            best: [1.0; QUANTITIES],
            relative: 1e-6,
            nearest: 1e-9,
            is_late: false,
            is_linear: false,
            lines: None,
            is_sought: [true; QUANTITIES],
        };
        for step in 0..1000 {
            let (summit, sign) = (0.001 * f64::from(step), if step % 2 == 0 { 1.0 } else { -1.0 });
            // It is above zero over half of an interval.
            let half = 0.25 / 16.0;
            let mut seen = seen_of_a_tooth(|x| sign * (half * half - (x - summit) * (x - summit)));
            let beside = (1..17).find(|&at| seen.fractions[at] > summit).unwrap_or(16);
            let interval = [seen.fractions[beside - 1], seen.fractions[beside]];
            if interval.iter().all(|end| (end - summit).abs() > half) {
                let is_halfway = |place: f64| (place - interval[0].midpoint(interval[1])).abs() < 1e-9;
                let place = seen.suspected_change(beside - 1).expect("it changes within the interval");
                assert!(is_halfway(place), "{place} of {interval:?}");
                judge.close_in_on_changes(&mut seen, 0);
                assert!(seen.wanted.iter().any(|&place| is_halfway(place)), "{:?} for {interval:?}", seen.wanted);
            }
        }
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
