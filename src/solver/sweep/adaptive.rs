//! Where a sweep must look to see the true extremes.
//!
//! Over a period one tooth may enter: there, at a flank that is cut short, every load jumps. Between such instants loads are smooth (with
//! clearance: continuous). Each smooth piece is halved until straight lines between its input angles are true to a
//! resolution, so that no peak hides between them; then every peak that may be the largest of its kind is closed in on.

use std::ops::Range;

use crate::contact::PerContact;
use crate::load_sharing::{LoadCase, LoadedDrive, ToothState};
use crate::mesh::{Mesh, PlacedTooth};
use crate::position::Position;
use crate::ring::FlankEnd;
use crate::sweep::points::Tolerance;
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
    /// Laps before; none where all laps are alike.
    lap: u64,
    /// Share of the lap that has passed.
    pub(crate) fraction: f64,
    first: u64,
    last: u64,
    /// The place that stands exactly where the flank ends.
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

/// Quantities of a tooth that have peaks: three forces, three stresses.
const LOADS: usize = 6;

/// Quantities of all teeth together: wind-up and torsional stiffness with their reciprocals, because their least values are wanted too, and the
/// reciprocal of the torque that the allowable stress admits, or nothing where there is none.
const TOTALS: usize = 5;

const QUANTITIES: usize = LOADS + TOTALS;

/// The totals that are continuous between two entries. With clearance the stiffness jumps where a tooth begins or ceases to carry.
const CONTINUOUS_TOTALS: [usize; 3] = [0, 1, 4];

/// Loads of a tooth.
type Loads = [f64; LOADS];

/// A moment with what is known of it. The teeth are numbered from place to place, and keep their numbers while they mesh.
#[derive(Debug, Clone)]
struct Seen {
    moment: Moment,
    first: u64,
    loads: Vec<Loads>,
    totals: [f64; TOTALS],
}

impl Seen {
    /// The loads of a tooth; one that does not mesh yet or any more has none.
    fn of(&self, number: u64) -> Loads {
        let index = number.checked_sub(self.first).and_then(|index| usize::try_from(index).ok());
        index.and_then(|index| self.loads.get(index)).copied().unwrap_or_default()
    }

    fn numbers(&self) -> Range<u64> {
        self.first..self.first + self.loads.len() as u64
    }

    /// How many teeth carry here or there, but not at both.
    fn teeth_changed(&self, other: &Self) -> usize {
        let (own, others) = (self.numbers(), other.numbers());
        let numbers = own.start.min(others.start)..own.end.max(others.end);
        numbers.filter(|&number| (self.of(number)[0] > 0.0) != (other.of(number)[0] > 0.0)).count()
    }
}

/// The largest values of a moment.
fn peaks_of(seen: &Seen) -> [f64; QUANTITIES] {
    let mut peaks = [0.0; QUANTITIES];
    for loads in &seen.loads {
        raise(&mut peaks[..LOADS], loads);
    }
    peaks[LOADS..].copy_from_slice(&seen.totals);
    peaks
}

fn raise(peaks: &mut [f64], values: &[f64]) {
    for (peak, value) in peaks.iter_mut().zip(values) {
        *peak = peak.max(*value);
    }
}

/// A moment on the long track: tooth i past the end of the period is tooth i - 1 from its start, so that one period of all teeth is one pass
/// of a single tooth, without a seam. The track runs from one entry, `entry - 1`, to the next, `entry`; on it a tooth keeps its number.
#[derive(Debug, Clone, Copy)]
struct Link<'a> {
    /// Fraction of the lap, below 0 for what stands in the answer a lap later.
    at: f64,
    /// What a tooth's number there exceeds its number on the track by.
    shift: u64,
    seen: &'a Seen,
}

impl Link<'_> {
    fn value(&self, Sought { quantity, number }: Sought) -> f64 {
        match quantity.checked_sub(LOADS) {
            None => self.seen.of(number + self.shift)[quantity],
            Some(total) => self.seen.totals[total],
        }
    }

    /// The same moment on the track of the lap after it.
    fn before(self, teeth_at_each_place: u64) -> Self {
        Self { at: self.at - 1.0, shift: self.shift + teeth_at_each_place, ..self }
    }
}

/// The track that ends at the entry of a lap.
struct Track<'a> {
    lap: u64,
    links: Vec<Link<'a>>,
}

/// A quantity whose largest value is looked for; of a load, the tooth by its number on the track.
#[derive(Debug, Clone, Copy)]
struct Sought {
    quantity: usize,
    number: u64,
}

/// A moment that stands above those beside it, and what the quantity may rise to between them.
#[derive(Debug, Clone, Copy)]
struct Candidate<'a> {
    lap: u64,
    sought: Sought,
    before: Link<'a>,
    top: Link<'a>,
    after: Link<'a>,
    bound: f64,
}

struct Search<'a> {
    /// With one tooth at each place of the mesh, which stands for all that carry alike; where items deviate, with every tooth.
    loaded: LoadedDrive<'a>,
    mesh: Mesh,
    /// Teeth that are told apart at each place.
    teeth_at_each_place: u64,
    /// Laps that are unlike each other.
    laps: u64,
    allowable_stress_mpa: Option<PerContact<f64>>,
    /// Whether teeth begin and cease to carry between their entry and their exit.
    has_gaps: bool,
    /// Whether loads are smooth between two entries.
    is_smooth: bool,
    tolerance: Tolerance,
    stop: &'a dyn Stop,
    states: u64,
    /// The largest values seen.
    peaks: [f64; QUANTITIES],
}

/// The input angles of a sweep to a tolerance, in order, by lap: one that stands for all where items are alike. Where loads jump the same
/// angle stands twice, first without the tooth that enters and then with it.
pub(crate) fn moments(
    loaded: &LoadedDrive<'_>,
    load: &LoadCase,
    tolerance: Tolerance,
    stop: &dyn Stop,
) -> Result<Vec<Vec<Moment>>, SolveError> {
    let mesh = *loaded.mesh();
    let tells_items_apart = mesh.tells_items_apart();
    let mut search = Search {
        loaded: if tells_items_apart { *loaded } else { loaded.with_zones(mesh.teeth_at_each_place()) },
        mesh,
        teeth_at_each_place: if tells_items_apart { mesh.listed_at_each_place() } else { 1 },
        laps: if tells_items_apart { mesh.laps() } else { 1 },
        allowable_stress_mpa: load.parameters().allowable_stress_mpa,
        has_gaps: load.has_gaps() || tells_items_apart,
        is_smooth: loaded.is_linear(),
        tolerance,
        stop,
        states: 0,
        peaks: [0.0; QUANTITIES],
    };
    let mut to_entry = Vec::new();
    let mut from_entry = Vec::new();
    for lap in 0..search.laps {
        let (to, from) = pieces(&mesh, lap);
        to_entry.push(search.resolve(to)?);
        from_entry.push(from.map(|piece| search.resolve(piece)).transpose()?.unwrap_or_default());
    }
    // What follows the entry of the lap before stands ahead of the lap's start on the track. Both hold that start.
    let befores = from_entry.iter().cycle().skip(from_entry.len() - 1);
    let tracks: Vec<_> = (0..search.laps)
        .zip(befores.zip(&to_entry))
        .map(|(lap, (before, own))| {
            let followers = before.iter().take(before.len().saturating_sub(1));
            let shift = search.teeth_at_each_place;
            let followers = followers.map(|seen| Link { at: seen.moment.fraction - 1.0, shift, seen });
            let leaders = own.iter().map(|seen| Link { at: seen.moment.fraction, shift: 0, seen });
            Track { lap, links: followers.chain(leaders).collect() }
        })
        .collect();
    let extremes = search.extremes(&tracks)?;

    let mut by_lap = Vec::new();
    for lap in 0..search.laps {
        let seen = to_entry.iter().chain(&from_entry).flatten().chain(&extremes);
        let mut moments: Vec<_> = seen.map(|seen| seen.moment).filter(|moment| moment.lap == lap).collect();
        if mesh.spacings_are_whole() && search.loads_jump() {
            moments.push(search.at_end_with_entering(lap));
        }
        moments.sort_by(|one, other| one.fraction.total_cmp(&other.fraction).then(one.last.cmp(&other.last)));
        moments.dedup();
        by_lap.push(moments);
    }
    Ok(by_lap)
}

/// A stretch of the period in which no tooth enters, by its ends.
#[derive(Debug, Clone, Copy)]
struct Piece {
    start: Moment,
    end: Moment,
}

/// A lap up to the entry of a tooth, and what is left of it then.
fn pieces(mesh: &Mesh, lap: u64) -> (Piece, Option<Piece>) {
    let (whole, entry) = (mesh.whole_spacings(), mesh.entry_fraction());
    let at = |fraction, first, last, entering| Moment { lap, fraction, first, last, entering };
    if mesh.spacings_are_whole() {
        let loads_jump = mesh.flank_limit().end != FlankEnd::RegularTip;
        let end = if loads_jump { at(1.0, 2, whole, None) } else { at(1.0, 2, whole + 1, Some(whole + 1)) };
        return (Piece { start: at(0.0, 1, whole, Some(whole)), end }, None);
    }
    let to_entry = Piece { start: at(0.0, 1, whole, None), end: at(entry, 1, whole, None) };
    let from_entry = Piece { start: at(entry, 1, whole + 1, Some(whole + 1)), end: at(1.0, 2, whole + 1, None) };
    (to_entry, Some(from_entry))
}

impl Search<'_> {
    fn loads_jump(&self) -> bool {
        self.mesh.flank_limit().end != FlankEnd::RegularTip
    }

    /// The end of a lap at which a tooth enters, with that tooth.
    fn at_end_with_entering(&self, lap: u64) -> Moment {
        let last = self.mesh.whole_spacings() + 1;
        Moment { lap, fraction: 1.0, first: 2, last, entering: Some(last) }
    }

    /// The teeth of a moment, place by place.
    fn teeth(&self, moment: Moment) -> Result<Vec<ToothState>, SolveError> {
        if !self.mesh.tells_items_apart() {
            let places = moment.first..=moment.last;
            return places.map(|place| self.loaded.tooth(moment.position(&self.mesh, place))).collect();
        }
        let mut placed: Vec<_> = moment.placed(&self.mesh, moment.lap).collect();
        // Those at one place stay in the order of their slots.
        placed.sort_by(|one, other| one.position.from_lobe_rad.total_cmp(&other.position.from_lobe_rad));
        placed.iter().map(|tooth| self.loaded.tooth_at(&tooth.place, tooth.position)).collect()
    }

    fn see(&mut self, moment: Moment) -> Result<Seen, SolveError> {
        if self.stop.stopped() {
            return Err(SolveError::Stopped);
        }
        self.states += moment.places() * self.teeth_at_each_place;
        let limit = self.tolerance.max_states();
        if self.states > limit {
            return Err(SolveError::TooManyStates { limit });
        }
        let lap_deg = self.mesh.sweep_period_deg() / self.mesh.laps() as f64;
        let input_angle_deg = (moment.lap as f64 + moment.fraction) * lap_deg;
        let teeth = self.teeth(moment).map_err(|error| error.at_input_angle(input_angle_deg))?;
        let wind_up = self.loaded.wind_up(&teeth)?;
        let loads: Result<Vec<_>, _> = teeth.iter().map(|tooth| self.loaded.loads(tooth, &wind_up)).collect();
        let (rotation_rad, stiffness) = (wind_up.rotation_rad(), wind_up.stiffness_nmm_per_rad);
        let per_capacity = match &self.allowable_stress_mpa {
            Some(allowable_mpa) => 1.0 / self.loaded.torque_limit(&teeth, allowable_mpa)?.input_torque_nmm,
            None => 0.0,
        };
        let totals = [rotation_rad, 1.0 / rotation_rad, stiffness, 1.0 / stiffness, per_capacity];
        let first = moment.first * self.teeth_at_each_place;
        let seen = Seen { moment, first, loads: loads?, totals };
        raise(&mut self.peaks, &peaks_of(&seen));
        Ok(seen)
    }

    /// A moment inside a piece.
    fn see_inside(&mut self, fraction: f64, Piece { start, end }: &Piece) -> Result<Seen, SolveError> {
        // Inside a piece mesh all teeth that mesh at either end.
        let (first, last) = (start.first.min(end.first), start.last.min(end.last));
        self.see(Moment { lap: start.lap, fraction, first, last, entering: None })
    }

    /// A moment of the track that ends in a lap: how much larger a tooth's number is there, and what is seen there.
    fn see_on_track(&mut self, lap: u64, at: f64) -> Result<(u64, Seen), SolveError> {
        let (mut fraction, mut back) = (at, 0);
        while fraction < 0.0 {
            (fraction, back) = (fraction + 1.0, back + 1);
        }
        // At most two laps back.
        let lap = (lap + 2 * self.laps - back) % self.laps;
        let entry = self.mesh.entry_fraction();
        let has_entered = fraction > entry || back > 0 && fraction >= entry;
        let last = self.mesh.whole_spacings() + u64::from(has_entered);
        let first = if fraction < 1.0 { 1 } else { 2 };
        // Only at the track's start does a tooth stand at the very end of the flank.
        let is_start = at.total_cmp(&(entry - 1.0)).is_eq();
        let entering = is_start.then_some(last);
        Ok((back * self.teeth_at_each_place, self.see(Moment { lap, fraction, first, last, entering })?))
    }

    /// The moments of a piece, halved until straight lines between them are true to the resolution, and until no more than one tooth begins or
    /// ceases to carry from one to the next.
    fn resolve(&mut self, piece: Piece) -> Result<Vec<Seen>, SolveError> {
        let Piece { start, end } = piece;
        let resolution = self.tolerance.relative().clamp(FINEST_RESOLUTION, COARSEST_RESOLUTION);
        let mut seen = vec![self.see(start)?];
        // The last to be looked at stands first, so that the piece is walked from its start.
        let mut pending = vec![(self.see(end)?, 0)];
        for interval in (1..FIRST_INTERVALS).rev() {
            let share = f64::from(interval) / f64::from(FIRST_INTERVALS);
            let fraction = start.fraction + share * (end.fraction - start.fraction);
            pending.push((self.see_inside(fraction, &piece)?, 0));
        }
        let mut from = seen[0].clone();
        while let Some((to, depth)) = pending.pop() {
            let fraction = 0.5 * (from.moment.fraction + to.moment.fraction);
            let middle = self.see_inside(fraction, &piece)?;
            let width = to.moment.fraction - from.moment.fraction;
            let is_told_apart = !self.has_gaps
                || width < 0.1 * self.tolerance.relative()
                || from.teeth_changed(&middle) + middle.teeth_changed(&to) < 2;
            if depth < MAX_DEPTH && (self.bend(&from, &middle, &to) > resolution || !is_told_apart) {
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
        let mut see = |quantity: usize, [from, middle, to]: [f64; 3]| {
            bend = bend.max((middle - 0.5 * (from + to)).abs() / self.peaks[quantity]);
        };
        for number in middle.numbers() {
            let (from, middle, to) = (from.of(number), middle.of(number), to.of(number));
            for quantity in 0..LOADS {
                see(quantity, [from[quantity], middle[quantity], to[quantity]]);
            }
        }
        for total in CONTINUOUS_TOTALS {
            // Without an allowable stress there is no capacity, and 0/0 is no bend.
            see(LOADS + total, [from.totals[total], middle.totals[total], to.totals[total]]);
        }
        bend
    }

    /// Closes in on every extreme that may be the largest of its kind by more than the tolerance, the most promising first.
    fn extremes(&mut self, tracks: &[Track<'_>]) -> Result<Vec<Seen>, SolveError> {
        let mut kept = [0.0; QUANTITIES];
        for link in tracks.iter().flat_map(|track| &track.links) {
            raise(&mut kept, &peaks_of(link.seen));
        }
        let befores = tracks.iter().cycle().skip(tracks.len() - 1);
        let mut candidates: Vec<_> =
            befores.zip(tracks).flat_map(|(before, track)| self.candidates(before, track, &kept)).collect();
        candidates.sort_by(|one, other| other.bound.total_cmp(&one.bound));
        let mut extremes = Vec::new();
        for candidate in candidates {
            let quantity = candidate.sought.quantity;
            if candidate.bound > kept[quantity] * (1.0 + 0.25 * self.tolerance.relative()) {
                let extreme = self.close_in(&candidate)?;
                raise(&mut kept, &peaks_of(&extreme));
                extremes.push(extreme);
            }
        }
        Ok(extremes)
    }

    /// Those on a track; where no load jumps its end is the start of the next one, and its start the end of the one before.
    fn candidates<'t>(
        &self,
        track_before: &Track<'t>,
        &Track { lap, links: ref track }: &Track<'t>,
        peaks: &[f64; QUANTITIES],
    ) -> Vec<Candidate<'t>> {
        let mut candidates = Vec::new();
        let own = if self.loads_jump() { track } else { &track[..track.len() - 1] };
        for (index, top) in own.iter().enumerate() {
            let Some([before, after]) = self.beside(&track_before.links, track, index) else { continue };
            let numbers = top.seen.numbers();
            let numbers = numbers.start.saturating_sub(top.shift)..numbers.end - top.shift;
            let of_teeth = numbers.flat_map(|number| (0..LOADS).map(move |quantity| Sought { quantity, number }));
            let of_all = (LOADS..QUANTITIES).map(|quantity| Sought { quantity, number: 0 });
            for sought in of_teeth.chain(of_all) {
                let bound = match Self::at_open_end(track, index) {
                    Some(inwards) if self.loads_jump() => self.bound_at_end(sought, inwards),
                    _ => self.bound(sought, [&before, top, &after]),
                };
                if let Some(bound) = bound
                    && bound > peaks[sought.quantity]
                {
                    candidates.push(Candidate { lap, sought, before, top: *top, after, bound });
                }
            }
        }
        candidates
    }

    /// The moments beside one of the track, which goes on from the one before it where no load jumps. At an open end they are that one itself
    /// and the next.
    fn beside<'t>(&self, track_before: &[Link<'t>], track: &[Link<'t>], index: usize) -> Option<[Link<'t>; 2]> {
        let last = track.len().checked_sub(1)?;
        let before = match index {
            0 if self.loads_jump() => track[0],
            0 => track_before[track_before.len().checked_sub(2)?].before(self.teeth_at_each_place),
            _ => track[index - 1],
        };
        Some([before, track[last.min(index + 1)]])
    }

    /// What a quantity may rise to beside a moment that stands above its neighbours: as far as the slope on one side leads on the other. That
    /// holds wherever it is concave; a corner may stand above it, and is allowed for by as much again.
    fn bound(&self, sought: Sought, links: [&Link<'_>; 3]) -> Option<f64> {
        let [low, value, high] = links.map(|link| link.value(sought));
        let [before, at, after] = links.map(|link| link.at);
        let (left, right) = (at - before, after - at);
        let (rise_left, rise_right) = (value - low, value - high);
        if value <= 0.0 || rise_left < 0.0 || rise_right < 0.0 {
            return None;
        }
        let excess = (rise_left * (right / left)).max(rise_right * (left / right));
        Some(value + if self.is_smooth { excess } else { 2.0 * excess.max(rise_left).max(rise_right) })
    }

    /// The three moments at an end of the track, from that end inwards.
    fn at_open_end<'s, 't>(track: &'s [Link<'t>], index: usize) -> Option<[&'s Link<'t>; 3]> {
        match (track, index) {
            ([end, next, third, ..], 0) => Some([end, next, third]),
            ([.., third, next, end], index) if index + 1 == track.len() => Some([end, next, third]),
            _ => None,
        }
    }

    /// The same at an end of a track that loads jump at, where the other side is empty: as far as the slope there leads inwards.
    fn bound_at_end(&self, sought: Sought, links: [&Link<'_>; 3]) -> Option<f64> {
        let [value, next, third] = links.map(|link| link.value(sought));
        let [to_next, to_third] = [1, 2].map(|index| (links[index].at - links[0].at).abs());
        if value <= 0.0 || next > value {
            return None;
        }
        let (slope, slope_beyond) = ((next - value) / to_next, (third - next) / (to_third - to_next));
        let excess = to_next * (slope - to_next * (slope_beyond - slope) / to_third);
        let excess = if self.is_smooth { excess } else { 2.0 * excess.max(value - next) };
        (excess > 0.0).then_some(value + excess)
    }

    /// The moment of a quantity's largest value between two moments, to a relative tolerance of the value: parabolas where they are
    /// safe, golden sections elsewhere (Brent 1973).
    fn close_in(&mut self, candidate: &Candidate<'_>) -> Result<Seen, SolveError> {
        let Candidate { lap, sought, before, top, after, .. } = *candidate;
        let golden = 0.5 * (3.0 - 5.0_f64.sqrt());
        let (mut low, mut high) = (before.at, after.at);
        let (mut x, mut value) = (top.at, top.value(sought));
        let mut best = top.seen.clone();
        let (mut second, mut third, mut at_second, mut at_third) = (x, x, value, value);
        let (mut step, mut last_step) = (0.0_f64, 0.0_f64);
        // Around a smooth peak the value is off by the square of this, times what it varies by over the bracket; with clearance a peak
        // may be a corner, where another tooth begins to carry, and the value is off by as much as the place.
        let tolerance = self.tolerance.relative();
        let share = if self.is_smooth { tolerance.sqrt() } else { tolerance };
        let nearest = (0.1 * share * (high - low)).max(f64::EPSILON);
        for _ in 0..MAX_STEPS {
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
            let u = (x + moved).clamp(low, high);
            let (shift, seen) = self.see_on_track(lap, u)?;
            let at_u = Link { at: u, shift, seen: &seen }.value(sought);
            if at_u >= value {
                if u < x {
                    high = x
                } else {
                    low = x
                }
                (third, at_third, second, at_second) = (second, at_second, x, value);
                (x, value, best) = (u, at_u, seen);
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
