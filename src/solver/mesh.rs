//! Which teeth carry load at an input angle (docs/explanation/theory.md section 3).

use std::f64::consts::PI;
use std::ops::RangeInclusive;

use crate::drive::Drive;
use crate::position::Position;
use crate::ring::{FlankEnd, FlankLimit};
use crate::violation::{Parameter, Violation};

/// A number of equal intervals of one period, within its range.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Samples(u64);

impl Samples {
    /// Checks the number.
    ///
    /// # Errors
    /// None, or more than [`MAX_SAMPLES`](crate::violation::MAX_SAMPLES).
    pub fn new(count: u64) -> Result<Self, Violation> {
        Parameter::Samples.check(count as f64).map_or(Ok(Self(count)), Err)
    }

    /// The number.
    pub const fn count(self) -> u64 {
        self.0
    }
}

/// The mesh over the input angle.
///
/// In the wave generator's frame tooth i stands at `ψ_i(j) = 2π i/Z'_G - j Z_K/Z_G`, less the lobe that it is on. At the sample `n` of `N`
/// over one period that is the whole fraction `q/(U N Z'_G)` of a turn, `q = U (iN - n) - u N Z'_G` for the lobe u: which teeth mesh is
/// decided in whole numbers.
///
/// Where `U` divides `Z'_G` the zones are alike and one of them stands for all; its teeth are numbered on, past the last slot. Elsewhere,
/// and wherever single items deviate, the teeth of all zones are listed, by slot. With `g = gcd(U, Z'_G)` they stand at places
/// `2π g/(U Z'_G)` apart, g at each.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Mesh {
    installed: u64,
    removal: u64,
    ring_teeth: u64,
    /// Whether the carrier has more teeth than the ring.
    is_forward: bool,
    lobes: u32,
    limit: FlankLimit,
    /// `ε/g`, rounded once: whoever asks when a tooth comes to the flank asks this number, and takes it as exact.
    engaged_spacings: f64,
    /// The same up to where teeth are listed: as far, or to the valley.
    listed_spacings: f64,
    /// Load periods after which single items meet again as they did; none where all items are alike.
    told_apart: Option<u64>,
}

/// How many teeth mesh, over the input angle: of a zone where all are alike, of all zones elsewhere.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct TeethInMesh {
    /// At least.
    pub min: u64,
    /// At most.
    pub max: u64,
}

impl TeethInMesh {
    /// The same of so many at each place.
    pub(crate) const fn times(self, at_each_place: u64) -> Self {
        Self { min: at_each_place * self.min, max: at_each_place * self.max }
    }
}

/// Where a tooth is among the items of the parts.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Place {
    /// Its slot.
    pub slot: u64,
    /// The ring's space that it stands in.
    pub ring_space: u64,
    /// The lobe of the wave generator that pushes it.
    pub lobe: u64,
}

impl Place {
    /// Of the tooth that started `slot` slots from lobe 0 and is pushed by the lobe that is so many behind it: `l = m i - s u`, modulo the ring's
    /// teeth.
    pub fn new(drive: &Drive, slot: u64, lobe: u64) -> Self {
        Mesh::new(drive).place(slot, lobe)
    }
}

/// Teeth in neighbouring slots on one lobe, their places so far apart as lobes divide the load period.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Neighbours {
    /// The slot of the first, counted on over turns of the carrier.
    pub(crate) first_slot: u64,
    pub(crate) count: u64,
    /// The place of the first.
    pub(crate) first_place: u64,
    pub(crate) lobe: u64,
}

/// A tooth in mesh at an input angle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PlacedTooth {
    /// Its slot; where zones are alike, the slots of a zone counted on.
    pub number: u64,
    /// The lobe that it is on, counted from the one where tooth 0 stands at the start.
    pub lobe: u32,
    /// Where it is among the items that may deviate.
    pub place: Place,
    /// Where it stands on it.
    pub position: Position,
    /// The same in degrees, rounded once where it is a whole fraction of a turn.
    pub position_deg: f64,
}

pub(crate) const fn greatest_common_divisor(one: u64, other: u64) -> u64 {
    let (mut a, mut b) = (one, other);
    while b > 0 {
        (a, b) = (b, a % b);
    }
    a
}

impl Mesh {
    /// The mesh of a drive whose items are all alike.
    pub fn new(drive: &Drive) -> Self {
        let p = drive.parameters();
        // Counts of a checked drive are positive and small.
        let whole = |count: i64| count.unsigned_abs();
        let (installed, limit) = (whole(p.installed), *drive.flank_limit());
        let alike = greatest_common_divisor(u64::from(drive.lobes()), installed);
        let places = u64::from(drive.lobes()) / alike * installed;
        let engaged_spacings = engaged_spacings(&limit, 0.5 * installed as f64 / alike as f64, places);
        Self {
            installed,
            removal: whole(p.teeth / p.installed),
            ring_teeth: whole(p.ring_teeth),
            is_forward: p.teeth > p.ring_teeth,
            lobes: drive.lobes(),
            limit,
            engaged_spacings,
            listed_spacings: engaged_spacings,
            told_apart: None,
        }
    }

    /// The mesh of a drive in which single items deviate, which meet again as they did after so many load periods.
    pub(crate) fn of_items(drive: &Drive, load_periods: u64) -> Self {
        Self { told_apart: Some(load_periods), ..Self::new(drive) }
    }

    /// The same with the teeth before the flank listed too, up to the valley, as at a regular tip.
    pub(crate) fn with_teeth_before_flank(self) -> Self {
        Self { listed_spacings: 0.5 * self.installed as f64 / self.teeth_at_each_place(), ..self }
    }

    /// Whether teeth before the flank are listed.
    pub(crate) fn lists_teeth_before_flank(&self) -> bool {
        self.listed_spacings > self.engaged_spacings
    }

    /// Whether single items are told apart, since they deviate.
    pub const fn tells_items_apart(&self) -> bool {
        self.told_apart.is_some()
    }

    /// How many load periods a sweep has.
    pub fn load_periods(&self) -> u64 {
        self.told_apart.unwrap_or(1)
    }

    /// Where and why the flank ends.
    pub const fn flank_limit(&self) -> &FlankLimit {
        &self.limit
    }

    /// `U`.
    pub(crate) const fn lobe_count(&self) -> u32 {
        self.lobes
    }

    fn lobes(&self) -> u64 {
        u64::from(self.lobes)
    }

    /// `g = gcd(U, Z'_G)`: for every tooth so many stand alike, each on a lobe of its own.
    pub fn lobes_loaded_alike(&self) -> u64 {
        greatest_common_divisor(self.lobes(), self.installed)
    }

    /// Whether each zone looks like every other: `U` divides `Z'_G`, and all items are alike.
    pub fn zones_are_alike(&self) -> bool {
        !self.tells_items_apart() && self.installed.is_multiple_of(self.lobes())
    }

    /// What the sum over the teeth listed has to be multiplied by to be that over all teeth.
    pub fn zones_in_torque(&self) -> f64 {
        if self.zones_are_alike() { f64::from(self.lobes) } else { 1.0 }
    }

    /// How many of the teeth that are listed stand at each place.
    pub(crate) fn listed_at_each_place(&self) -> u64 {
        if self.zones_are_alike() { 1 } else { self.lobes_loaded_alike() }
    }

    /// How many teeth carry alike: what a sum over one tooth at each place has to be multiplied by.
    pub(crate) fn teeth_at_each_place(&self) -> f64 {
        self.lobes_loaded_alike() as f64
    }

    /// `ε = U ψ_e Z'_G/2π`, counted over all zones.
    pub fn coincidence_degree(&self) -> f64 {
        self.teeth_at_each_place() * self.engaged_spacings
    }

    /// The input angle after which the load pattern repeats, teeth renumbered: `2π m/Z_K`, m = Z_G/Z'_G. Where items deviate only their places repeat.
    pub fn period_deg(&self) -> f64 {
        360.0 * self.removal as f64 / self.ring_teeth as f64
    }

    /// The input angle that a sweep goes over: one load period, where items deviate so many as it takes until they meet again as they did.
    pub fn sweep_period_deg(&self) -> f64 {
        360.0 * (self.removal * self.load_periods()) as f64 / self.ring_teeth as f64
    }

    /// Places of a whole turn: `U Z'_G/g`.
    fn places(&self) -> u64 {
        self.lobes() / self.lobes_loaded_alike() * self.installed
    }

    /// Angle between neighbouring places: that between installed teeth where zones are alike.
    pub fn spacing_deg(&self) -> f64 {
        360.0 / self.places() as f64
    }

    /// How many teeth mesh: always as many as the engagement spans whole spacings, or at times one more at each place.
    pub fn teeth_in_mesh(&self) -> TeethInMesh {
        let at_each_place = self.listed_at_each_place();
        let min = floor_of_product(self.engaged_spacings, 1);
        let max = min + u64::from(self.engaged_spacings.fract() > 0.0);
        TeethInMesh { min, max }.times(at_each_place)
    }

    /// Whether at every input angle a tooth has a lever arm: `ψ_e > 2π g/(U Z'_G)`.
    pub fn always_carries(&self) -> bool {
        self.engaged_spacings > 1.0
    }

    /// Whole spacings within which teeth are listed: their places at j = 0.
    pub(crate) fn whole_spacings(&self) -> u64 {
        floor_of_product(self.listed_spacings, 1)
    }

    /// Whether a tooth stands at the last place where one is listed at j = 0.
    pub(crate) fn spacings_are_whole(&self) -> bool {
        self.listed_spacings.fract() == 0.0
    }

    /// The fraction of a lap that has passed when a tooth enters, above 0; 1 where that is at its end. Exact.
    pub(crate) fn entry_fraction(&self) -> f64 {
        1.0 - self.listed_spacings.fract()
    }

    /// The fraction of a lap that has passed when a tooth stands at a position, above 0.
    pub(crate) fn fraction_at_deg(&self, from_lobe_deg: f64) -> f64 {
        1.0 - (from_lobe_deg / self.spacing_deg()).fract()
    }

    /// The place that comes to the flank within a lap, and the fraction that has passed then, above 0.
    pub(crate) fn flank_fraction(&self) -> (u64, f64) {
        (floor_of_product(self.engaged_spacings, 1) + 1, 1.0 - self.engaged_spacings.fract())
    }

    /// Where the last place is at which teeth are listed: the end of the flank, or the valley.
    pub(crate) fn last_position(&self) -> Position {
        if self.lists_teeth_before_flank() { Position::valley(self.lobes) } else { self.limit.position }
    }

    /// Whether loads jump where a tooth enters: at the end of a flank that is cut short, if none is listed before.
    pub(crate) fn loads_jump_at_entry(&self) -> bool {
        self.limit.end != FlankEnd::RegularTip && !self.lists_teeth_before_flank()
    }

    /// The largest whole p with `2π p/(N places) ≤ ψ_e`, or the same to the valley.
    pub fn last_step(&self, samples: Samples) -> u64 {
        floor_of_product(self.listed_spacings, samples.0)
    }

    /// States of a sweep: one for each of its input angles and teeth that are listed there.
    pub fn state_count(&self, samples: Samples) -> u64 {
        if self.zones_are_alike() {
            let last_step = self.last_step(samples);
            // Every step from 1 on belongs to one sample below N; the sample N repeats the sample 0.
            return last_step + last_step / samples.0;
        }
        // The steps that occur, `U p` modulo `N Z'_G`, are the multiples of their greatest common divisor, each as many times.
        let last_step = self.last_listed_step(samples);
        let alike = greatest_common_divisor(self.lobes(), self.steps(samples));
        let at_end = self.lobes_loaded_alike() * (last_step / (self.lobes_loaded_alike() * samples.0));
        self.load_periods().saturating_mul(alike * (last_step / alike)).saturating_add(at_end)
    }

    /// The last sample of a sweep.
    pub fn last_sample(&self, samples: Samples) -> u64 {
        self.load_periods().saturating_mul(samples.0)
    }

    /// The largest q in mesh.
    fn last_listed_step(&self, samples: Samples) -> u64 {
        floor_of_product(self.listed_spacings, self.lobes_loaded_alike() * samples.0)
    }

    /// The teeth that are listed at sample `sample`, at most the last.
    pub fn placed_at(self, sample: u64, samples: Samples) -> impl Iterator<Item = PlacedTooth> {
        let sample = sample.min(self.last_sample(samples));
        let is_one_zone = self.zones_are_alike();
        let numbers = if is_one_zone { self.teeth_at(sample, samples) } else { 0..=self.installed - 1 };
        let last_step = self.last_listed_step(samples);
        let (lobes, steps) = (self.lobes(), self.steps(samples));
        // Turns ahead, so that nothing falls below zero: the tooth in slot 0 soon stands behind the lobe where it began.
        let turns = 1 + sample / steps;
        numbers.filter_map(move |number| {
            let ahead = lobes * (number * samples.0 + turns * steps - sample);
            let lobe = (ahead - 1) / steps;
            let step = ahead - lobe * steps;
            (is_one_zone || step <= last_step).then(|| PlacedTooth {
                number,
                lobe: u32::try_from(lobe % lobes).unwrap_or_default(),
                place: self.place(number + turns * self.installed, lobe),
                position: Position::of_lobe(step, steps, self.lobes),
                position_deg: (360 * step) as f64 / (lobes * steps) as f64,
            })
        })
    }

    /// Where the tooth is that started so many slots from lobe 0, counted on over turns of the carrier, as the lobe that pushes it is.
    fn place(&self, slot: u64, lobe: u64) -> Place {
        let spaces = self.removal * slot % self.ring_teeth;
        let turned = lobe % self.ring_teeth;
        let ring_space = if self.is_forward { spaces + self.ring_teeth - turned } else { spaces + turned };
        Place { slot: slot % self.installed, ring_space: ring_space % self.ring_teeth, lobe: lobe % self.lobes() }
    }

    /// Where the tooth is that stands at a position on a lobe: its slot is a whole number, which rounding does not reach.
    pub(crate) fn place_at(&self, input_angle_deg: f64, lobe: u32, position_deg: f64) -> Place {
        let from_lobe_0 = position_deg / 360.0 + f64::from(lobe) / f64::from(self.lobes);
        let slots_passed = input_angle_deg / self.period_deg();
        let slot = (from_lobe_0 * self.installed as f64 + slots_passed).round();
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "whole, not negative, far below 2^53"
        )]
        let slot = slot as u64;
        self.place(slot, u64::from(lobe))
    }

    /// The teeth in mesh at sample `sample`, at most the last, by number, where zones are alike.
    pub fn teeth_at(&self, sample: u64, samples: Samples) -> RangeInclusive<u64> {
        let sample = sample.min(samples.0);
        let first = if sample < samples.0 { 1 } else { 2 };
        first..=(self.last_step(samples) + sample) / samples.0
    }

    /// The first sample after this one at which more teeth mesh; the last one, where none does.
    pub(crate) fn same_teeth_until(&self, sample: u64, samples: Samples) -> u64 {
        let next_tooth = self.teeth_at(sample, samples).end() + 1;
        samples.0.min(next_tooth * samples.0 - self.last_step(samples))
    }

    /// Steps of a whole turn, for a sweep of so many samples.
    pub(crate) const fn steps(&self, samples: Samples) -> u64 {
        samples.0 * self.installed
    }

    /// How far the phase `Uψ/2` of every tooth moves from one sample to the next.
    pub(crate) fn phase_step_rad(&self, samples: Samples) -> f64 {
        0.5 * f64::from(self.lobes) * (2.0 * PI / self.steps(samples) as f64)
    }

    /// The position of a tooth at a sample, where it stands between the lobe and the valley behind it; where zones are alike.
    pub fn position(&self, tooth: u64, sample: u64, samples: Samples) -> Option<Position> {
        let steps = tooth.checked_mul(samples.0)?.checked_sub(sample)?;
        Position::of_turn(steps, self.steps(samples), self.lobes)
    }

    /// The position of a tooth in mesh at a sample, where zones are alike.
    pub(crate) fn position_in_mesh(&self, tooth: u64, sample: u64, samples: Samples) -> Position {
        Position::of_lobe(self.lobes() * (tooth * samples.0 - sample), self.steps(samples), self.lobes)
    }

    /// How many times the pattern of places repeats in a load period: `U/g`, once where zones are alike.
    pub(crate) fn laps_of_load_period(&self) -> u64 {
        self.lobes() / self.lobes_loaded_alike()
    }

    /// The same in a sweep.
    pub fn laps(&self) -> u64 {
        self.laps_of_load_period() * self.load_periods()
    }

    /// How many spacings the engagement spans, `ε/g`.
    pub const fn engaged_spacings(&self) -> f64 {
        self.engaged_spacings
    }

    /// All places as those of one zone that has so many slots more, a period of which is a lap: what zones look like over each other, whatever deviates.
    /// Of zones that are alike it is the same mesh.
    pub(crate) fn as_one_zone(&self) -> Self {
        Self {
            installed: self.places(),
            ring_teeth: self.ring_teeth * self.laps_of_load_period(),
            told_apart: None,
            ..*self
        }
    }

    /// The places of a sweep's samples within a lap, which come again in each: so many of equal intervals.
    pub(crate) fn samples_of_lap(&self, samples: Samples) -> Samples {
        Samples(samples.0 / greatest_common_divisor(samples.0, self.laps_of_load_period()))
    }

    /// The position at a place when a fraction of a lap has passed: `place - fraction` spacings from the lobe. Both are exact, so the
    /// distance to the valley keeps its digits too.
    pub fn position_between(&self, place: u64, fraction: f64) -> Position {
        let spacing_rad = 2.0 * PI / self.places() as f64;
        let from_lobe_rad = (place as f64 - fraction) * spacing_rad;
        let to_valley = 0.5 * self.installed as f64 / self.teeth_at_each_place();
        let from_valley_rad = ((to_valley - place as f64) + fraction) * spacing_rad;
        if from_lobe_rad < from_valley_rad {
            Position::from_lobe(from_lobe_rad, self.lobes)
        } else {
            Position::from_valley(from_valley_rad.max(0.0), self.lobes)
        }
    }

    /// The position at a place at the end of a lap, where the one before it stood at its start.
    pub(crate) fn position_after_lap(&self, place: u64) -> Position {
        Position::of_lobe(self.lobes() * (place - 1), self.places(), self.lobes)
    }

    /// The teeth at these places during a lap, in the order of [`Self::placed_at`].
    pub(crate) fn placed_between(
        self,
        places: RangeInclusive<u64>,
        lap: u64,
        position: impl Fn(u64) -> Position,
    ) -> impl Iterator<Item = PlacedTooth> {
        let is_one_zone = self.zones_are_alike();
        let numbers = if is_one_zone { places.clone() } else { 0..=self.installed - 1 };
        let (lobes, alike, turn) = (self.lobes(), self.lobes_loaded_alike(), self.installed);
        let turns = 1 + alike * lap / (lobes * turn);
        numbers.filter_map(move |number| {
            let (place, slot, lobe) = if is_one_zone {
                (number, number, 0)
            } else {
                // `U i - g lap = g place + u Z'_G`, turns ahead.
                let slot = number + turns * turn;
                let ahead = lobes * slot - alike * lap;
                let lobe = (ahead - 1) / turn;
                ((ahead - lobe * turn) / alike, slot, lobe)
            };
            places.contains(&place).then(|| {
                let position = position(place);
                let place = self.place(slot, lobe);
                let lobe = u32::try_from(place.lobe).unwrap_or_default();
                PlacedTooth { number, lobe, place, position, position_deg: position.from_lobe_deg() }
            })
        })
    }

    /// The teeth of each zone at the places from 1 on during a lap, in the order of [`Self::placed_at`], where the teeth of all zones are listed: runs of
    /// neighbours in a zone, each cut where the slots begin anew.
    pub(crate) fn list(&self, places: u64, lap: u64, runs: &mut Vec<Neighbours>) {
        let (apart, pitch) = (self.laps_of_load_period(), self.installed / self.lobes_loaded_alike());
        runs.clear();
        let (mut end_of_turn, mut begins_anew) = (None, 0);
        for lobe in 0..self.lobes() {
            // `U i - g lap = g place + u Z'_G`, over g.
            let zone = lap + lobe * pitch;
            let (mut slot, end) = ((zone + 1).div_ceil(apart), (zone + places) / apart + 1);
            while slot < end {
                let turn = *end_of_turn.get_or_insert((slot / self.installed + 1) * self.installed);
                let next = if slot < turn { end.min(turn) } else { end };
                if slot >= turn && begins_anew == 0 {
                    begins_anew = runs.len();
                }
                runs.push(Neighbours { first_slot: slot, count: next - slot, first_place: apart * slot - zone, lobe });
                slot = next;
            }
        }
        runs.rotate_left(begins_anew);
    }

    /// Where a tooth of such a run is among the items.
    pub(crate) fn place_of(&self, run: &Neighbours, tooth: u64) -> Place {
        self.place(run.first_slot + tooth, run.lobe)
    }

    /// The input angle of a sample, rounded once.
    pub fn input_angle_deg(&self, sample: u64, samples: Samples) -> f64 {
        (360 * self.removal * sample) as f64 / (self.ring_teeth * samples.0) as f64
    }
}

/// ψ_e in spacings, of which a whole turn has `places` and half a lobe `to_valley`; from whichever end of it is nearer, never beyond the valley.
fn engaged_spacings(limit: &FlankLimit, to_valley: f64, places: u64) -> f64 {
    let position = &limit.position;
    let spacings = |angle_rad: f64| angle_rad * places as f64 / (2.0 * PI);
    match limit.end {
        FlankEnd::RegularTip => to_valley,
        FlankEnd::Undercut | FlankEnd::Bore if position.from_valley_rad < position.from_lobe_rad => {
            to_valley - spacings(position.from_valley_rad)
        }
        FlankEnd::Undercut | FlankEnd::Bore => spacings(position.from_lobe_rad),
    }
}

/// The whole part of a product, exactly. Of a value below 1 the digits beyond 2^-52 are left out, which only a factor beyond 2^52 would see.
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "whole numbers below 2^53; not negative")]
fn floor_of_product(value: f64, factor: u64) -> u64 {
    const BITS: u32 = 52;
    let (whole, fraction) = (value.floor() as u64, (value.fract() * (1_u64 << BITS) as f64) as u64);
    whole * factor + ((u128::from(fraction) * u128::from(factor)) >> BITS) as u64
}
