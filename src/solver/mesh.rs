//! Mesh: the teeth that carry load at an input angle (docs/explanation/theory.md section 3).

mod place;

use std::f64::consts::PI;
use std::ops::RangeInclusive;

use crate::drive::Drive;
use crate::position::Position;
use crate::ring::{FlankEnd, FlankLimit};
use crate::violation::{Parameter, Violation};

pub(crate) use place::Neighbours;
pub use place::{Place, PlacedTooth, TeethInMesh};

/// Number of equal intervals of one period, within its range.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Samples(u64);

impl Samples {
    /// Checks the number.
    ///
    /// # Errors
    /// Fails for zero, or for more than [`MAX_SAMPLES`](crate::violation::MAX_SAMPLES).
    pub fn new(count: u64) -> Result<Self, Violation> {
        Parameter::Samples.check(count as f64).map_or(Ok(Self(count)), Err)
    }

    /// Returns the number.
    pub const fn count(self) -> u64 {
        self.0
    }
}

/// Mesh over the input angle.
///
/// In the wave generator's frame tooth i is at `ψ_i(j) = 2π i/Z'_G - j Z_K/Z_G`, less the angle of its lobe. At the
/// sample `n` of `N` over one period that is the fraction `q/(U N Z'_G)` of a turn, `q = U (iN - n) - u N Z'_G` for the
/// lobe u. The set of meshing teeth is therefore decided in whole numbers.
///
/// If `U` divides `Z'_G`, the zones are alike and one of them represents all. Its tooth numbers continue past the last
/// slot. Otherwise, and whenever individual items deviate, the teeth of all zones are listed, by slot. With
/// `g = gcd(U, Z'_G)` their places are `2π g/(U Z'_G)` apart, with g teeth at each.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Mesh {
    installed: u64,
    removal: u64,
    ring_teeth: u64,
    /// True if the carrier has more teeth than the ring.
    is_forward: bool,
    lobes: u32,
    limit: FlankLimit,
    /// `ε/g`, rounded once. All questions about the flank's end use this number and take it as exact.
    engaged_spacings: f64,
    /// The same up to the end of the listed teeth: equal, or up to the valley.
    listed_spacings: f64,
    /// Load periods after which all items are back in their positions; none if all items are alike.
    told_apart: Option<u64>,
}

pub(crate) const fn greatest_common_divisor(one: u64, other: u64) -> u64 {
    let (mut a, mut b) = (one, other);
    while b > 0 {
        (a, b) = (b, a % b);
    }
    a
}

impl Mesh {
    /// Returns the mesh of a drive whose items are all alike.
    ///
    /// ```
    /// use toothwave_solver::mesh::Mesh;
    /// use toothwave_solver::{Drive, DriveParameters};
    ///
    /// let mesh = Mesh::new(&Drive::new(&DriveParameters::default()).unwrap());
    /// println!("contact ratio {:.2}, {} teeth of a lobe", mesh.coincidence_degree(), mesh.teeth_in_mesh());
    /// ```
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

    /// Returns the mesh of a drive with deviating items, which are back in their positions after this many load
    /// periods.
    pub(crate) fn of_items(drive: &Drive, load_periods: u64) -> Self {
        Self { told_apart: Some(load_periods), ..Self::new(drive) }
    }

    /// Returns the mesh with the teeth before the flank listed too, up to the valley, as at a regular tip.
    pub(crate) fn with_teeth_before_flank(self) -> Self {
        Self { listed_spacings: 0.5 * self.installed as f64 / self.lobes_loaded_alike() as f64, ..self }
    }

    pub(crate) fn lists_teeth_before_flank(&self) -> bool {
        self.listed_spacings > self.engaged_spacings
    }

    /// Returns true if individual items are distinguished, because they deviate.
    pub const fn tells_items_apart(&self) -> bool {
        self.told_apart.is_some()
    }

    /// Returns the number of load periods in a sweep.
    pub fn load_periods(&self) -> u64 {
        self.told_apart.unwrap_or(1)
    }

    /// Returns the end of the flank, and its cause.
    pub const fn flank_limit(&self) -> &FlankLimit {
        &self.limit
    }

    /// Returns `U`.
    pub(crate) const fn lobe_count(&self) -> u32 {
        self.lobes
    }

    fn lobes(&self) -> u64 {
        u64::from(self.lobes)
    }

    /// Returns `g = gcd(U, Z'_G)`: the number of teeth at each place, each on its own lobe.
    pub fn lobes_loaded_alike(&self) -> u64 {
        greatest_common_divisor(self.lobes(), self.installed)
    }

    /// Returns true if all zones are alike: `U` divides `Z'_G`, and no item deviates.
    pub fn zones_are_alike(&self) -> bool {
        !self.tells_items_apart() && self.installed.is_multiple_of(self.lobes())
    }

    /// Returns the factor from the sum over the listed teeth to the sum over all teeth.
    pub fn zones_in_torque(&self) -> f64 {
        if self.zones_are_alike() { f64::from(self.lobes) } else { 1.0 }
    }

    /// Returns the number of listed teeth at each place.
    pub(crate) fn listed_at_each_place(&self) -> u64 {
        if self.zones_are_alike() { 1 } else { self.lobes_loaded_alike() }
    }

    /// Returns the contact ratio (the paper's coincidence degree) `ε = U ψ_e Z'_G/2π`, counted over all zones.
    pub fn coincidence_degree(&self) -> f64 {
        self.lobes_loaded_alike() as f64 * self.engaged_spacings
    }

    /// Returns the load period: the input angle after which the load pattern repeats, teeth renumbered, `2π m/Z_K` with
    /// m = Z_G/Z'_G. If items deviate, only the tooth positions repeat.
    pub fn period_deg(&self) -> f64 {
        360.0 * self.removal as f64 / self.ring_teeth as f64
    }

    /// Returns the input angle of a sweep: one load period, or as many as deviating items need to return to their
    /// positions.
    pub fn sweep_period_deg(&self) -> f64 {
        360.0 * (self.removal * self.load_periods()) as f64 / self.ring_teeth as f64
    }

    /// Returns the number of places of a whole turn: `U Z'_G/g`.
    fn places(&self) -> u64 {
        self.lobes() / self.lobes_loaded_alike() * self.installed
    }

    /// Returns the angle between neighbouring places. If zones are alike, it is the angle between installed teeth.
    pub fn spacing_deg(&self) -> f64 {
        360.0 / self.places() as f64
    }

    /// Returns the number of teeth in mesh: the whole spacings in the engagement, and at times one more at each place.
    pub fn teeth_in_mesh(&self) -> TeethInMesh {
        let at_each_place = self.listed_at_each_place();
        let min = floor_of_product(self.engaged_spacings, 1);
        let max = min + u64::from(self.engaged_spacings.fract() > 0.0);
        TeethInMesh { min, max }.times(at_each_place)
    }

    /// Returns true if at every input angle a tooth has a lever arm: `ψ_e > 2π g/(U Z'_G)`.
    pub fn always_carries(&self) -> bool {
        self.engaged_spacings > 1.0
    }

    /// Returns the whole spacings of the listed range, which are the places of teeth at j = 0.
    pub(crate) fn whole_spacings(&self) -> u64 {
        floor_of_product(self.listed_spacings, 1)
    }

    /// Returns true if a tooth is at the end of the listed range at j = 0.
    pub(crate) fn spacings_are_whole(&self) -> bool {
        self.listed_spacings.fract() == 0.0
    }

    /// Returns the elapsed fraction of a lap when a tooth enters, above 0; 1 at the end of the lap. Exact.
    pub(crate) fn entry_fraction(&self) -> f64 {
        1.0 - self.listed_spacings.fract()
    }

    /// Returns the elapsed fraction of a lap when a tooth is at a position, above 0.
    pub(crate) fn fraction_at_deg(&self, from_lobe_deg: f64) -> f64 {
        1.0 - (from_lobe_deg / self.spacing_deg()).fract()
    }

    /// Returns the place that reaches the flank within a lap, and the elapsed fraction then, above 0.
    pub(crate) fn flank_fraction(&self) -> (u64, f64) {
        (floor_of_product(self.engaged_spacings, 1) + 1, 1.0 - self.engaged_spacings.fract())
    }

    /// Returns the end of the listed range: the end of the flank, or the valley.
    pub(crate) fn last_position(&self) -> Position {
        if self.lists_teeth_before_flank() { Position::valley(self.lobes) } else { self.limit.position }
    }

    /// Returns true if loads jump when a tooth enters: at the end of a shortened flank, if no teeth before it are
    /// listed.
    pub(crate) fn loads_jump_at_entry(&self) -> bool {
        self.limit.end != FlankEnd::RegularTip && !self.lists_teeth_before_flank()
    }

    /// Returns the largest integer p with `2π p/(N places) ≤ ψ_e`, or up to the valley.
    pub fn last_step(&self, samples: Samples) -> u64 {
        floor_of_product(self.listed_spacings, samples.0)
    }

    /// Returns the number of states of a sweep: one for each listed tooth at each input angle.
    pub fn state_count(&self, samples: Samples) -> u64 {
        if self.zones_are_alike() {
            let last_step = self.last_step(samples);
            // Every step from 1 on belongs to one sample below N. Sample N repeats sample 0.
            return last_step + last_step / samples.0;
        }
        // The steps that occur, `U p` modulo `N Z'_G`, are the multiples of their greatest common divisor, all equally
        // often.
        let last_step = self.last_listed_step(samples);
        let alike = greatest_common_divisor(self.lobes(), self.steps(samples));
        let at_end = self.lobes_loaded_alike() * (last_step / (self.lobes_loaded_alike() * samples.0));
        self.load_periods().saturating_mul(alike * (last_step / alike)).saturating_add(at_end)
    }

    /// Returns the last sample of a sweep.
    pub fn last_sample(&self, samples: Samples) -> u64 {
        self.load_periods().saturating_mul(samples.0)
    }

    /// Returns the largest q in mesh.
    fn last_listed_step(&self, samples: Samples) -> u64 {
        floor_of_product(self.listed_spacings, self.lobes_loaded_alike() * samples.0)
    }

    /// Returns the listed teeth at sample `sample`, at most the last.
    pub fn placed_at(self, sample: u64, samples: Samples) -> impl Iterator<Item = PlacedTooth> {
        let sample = sample.min(self.last_sample(samples));
        let is_one_zone = self.zones_are_alike();
        let numbers = if is_one_zone { self.teeth_at(sample, samples) } else { 0..=self.installed - 1 };
        let last_step = self.last_listed_step(samples);
        let (lobes, steps) = (self.lobes(), self.steps(samples));
        // Whole turns are added so that nothing is negative: the tooth in slot 0 soon is behind its first lobe.
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

    /// Returns the place of the tooth that started `slot` slots from lobe 0 and is pushed by the lobe with this number,
    /// counted backwards, both counted on over turns. The ring space is `l = m i - s u`, modulo the ring's teeth.
    pub fn place(&self, slot: u64, lobe: u64) -> Place {
        let spaces = self.removal * slot % self.ring_teeth;
        let turned = lobe % self.ring_teeth;
        let ring_space = if self.is_forward { spaces + self.ring_teeth - turned } else { spaces + turned };
        Place { slot: slot % self.installed, ring_space: ring_space % self.ring_teeth, lobe: lobe % self.lobes() }
    }

    /// Returns the place of the tooth at a position on a lobe. Its slot is a whole number, so rounding has no effect.
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

    /// Returns the teeth in mesh at sample `sample`, at most the last, by number. Needs zones that are alike.
    pub fn teeth_at(&self, sample: u64, samples: Samples) -> RangeInclusive<u64> {
        let sample = sample.min(samples.0);
        let first = if sample < samples.0 { 1 } else { 2 };
        first..=(self.last_step(samples) + sample) / samples.0
    }

    /// Returns the first later sample at which more teeth mesh, or the last sample.
    pub(crate) fn same_teeth_until(&self, sample: u64, samples: Samples) -> u64 {
        let next_tooth = self.teeth_at(sample, samples).end() + 1;
        samples.0.min(next_tooth * samples.0 - self.last_step(samples))
    }

    /// Returns the steps of a whole turn, for a sweep with this many samples.
    pub(crate) const fn steps(&self, samples: Samples) -> u64 {
        samples.0 * self.installed
    }

    /// Returns the change of the phase `Uψ/2` of every tooth between samples.
    pub(crate) fn phase_step_rad(&self, samples: Samples) -> f64 {
        0.5 * f64::from(self.lobes) * (2.0 * PI / self.steps(samples) as f64)
    }

    /// Returns the position of a tooth in mesh at a sample. Needs zones that are alike.
    pub(crate) fn position_in_mesh(&self, tooth: u64, sample: u64, samples: Samples) -> Position {
        Position::of_lobe(self.lobes() * (tooth * samples.0 - sample), self.steps(samples), self.lobes)
    }

    /// Returns the number of laps in a load period, in each of which the places repeat: `U/g`, 1 if zones are alike.
    pub(crate) fn laps_of_load_period(&self) -> u64 {
        self.lobes() / self.lobes_loaded_alike()
    }

    /// Returns the number of laps in a sweep.
    pub fn laps(&self) -> u64 {
        self.laps_of_load_period() * self.load_periods()
    }

    /// Returns the number of spacings of the engagement, `ε/g`.
    pub const fn engaged_spacings(&self) -> f64 {
        self.engaged_spacings
    }

    /// Returns the mesh with all zones superposed as one zone with that many more slots, whose period is a lap.
    /// Deviations are left out. If zones are alike, it is the same mesh.
    pub(crate) fn as_one_zone(&self) -> Self {
        Self {
            installed: self.places(),
            ring_teeth: self.ring_teeth * self.laps_of_load_period(),
            told_apart: None,
            ..*self
        }
    }

    /// Returns the samples of a sweep within a lap, which repeat in each lap, as equal intervals.
    pub(crate) fn samples_of_lap(&self, samples: Samples) -> Samples {
        Samples(samples.0 / greatest_common_divisor(samples.0, self.laps_of_load_period()))
    }

    /// Returns the position at a place after a fraction of a lap: `place - fraction` spacings from the lobe. Both are
    /// exact, so the distance to the valley keeps its digits too.
    pub fn position_between(&self, place: u64, fraction: f64) -> Position {
        let spacing_rad = 2.0 * PI / self.places() as f64;
        let from_lobe_rad = (place as f64 - fraction) * spacing_rad;
        let to_valley = 0.5 * self.installed as f64 / self.lobes_loaded_alike() as f64;
        let from_valley_rad = ((to_valley - place as f64) + fraction) * spacing_rad;
        if from_lobe_rad < from_valley_rad {
            Position::from_lobe(from_lobe_rad, self.lobes)
        } else {
            Position::from_valley(from_valley_rad.max(0.0), self.lobes)
        }
    }

    /// Returns the position at a place at the end of a lap, where the place before was at the start.
    pub(crate) fn position_after_lap(&self, place: u64) -> Position {
        Position::of_lobe(self.lobes() * (place - 1), self.places(), self.lobes)
    }

    /// Returns the teeth at these places during a lap, in the order of [`Self::placed_at`].
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
                // `U i - g lap = g place + u Z'_G`, plus whole turns.
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

    /// Lists the teeth of each zone at the places from 1 on during a lap, in the order of [`Self::placed_at`], if the
    /// teeth of all zones are listed. Each run contains neighbours in a zone, and is cut where the slot numbers
    /// restart.
    pub(crate) fn list(&self, places: u64, lap: u64, runs: &mut Vec<Neighbours>) {
        let (apart, pitch) = (self.laps_of_load_period(), self.installed / self.lobes_loaded_alike());
        runs.clear();
        let (mut end_of_turn, mut begins_anew) = (None, 0);
        for lobe in 0..self.lobes() {
            // `U i - g lap = g place + u Z'_G`, divided by g.
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

    /// Returns the places of the teeth of such a run among the items. Sums are faster than divisions for each tooth.
    pub(crate) fn places_of(&self, run: &Neighbours) -> impl Iterator<Item = Place> + use<> {
        let Self { installed, ring_teeth, removal, .. } = *self;
        let wrapped = |sum: u64, count: u64| if sum < count { sum } else { sum - count };
        let spaces = removal % ring_teeth;
        let next = move |&Place { slot, ring_space, lobe }: &Place| {
            let (slot, ring_space) = (wrapped(slot + 1, installed), wrapped(ring_space + spaces, ring_teeth));
            Some(Place { slot, ring_space, lobe })
        };
        std::iter::successors(Some(self.place(run.first_slot, run.lobe)), next)
    }

    /// Returns the input angle of a sample, rounded once.
    pub fn input_angle_deg(&self, sample: u64, samples: Samples) -> f64 {
        (360 * self.removal * sample) as f64 / (self.ring_teeth * samples.0) as f64
    }
}

/// Returns ψ_e in spacings, of which a whole turn has `places` and half a lobe `to_valley`. It is computed from the
/// nearer end and is at most `to_valley`.
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

/// Returns the whole part of a product, exactly. Digits of the value below 2^-52 are ignored; only a factor above 2^52
/// would need them.
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "whole numbers below 2^53; not negative")]
fn floor_of_product(value: f64, factor: u64) -> u64 {
    const BITS: u32 = 52;
    let (whole, fraction) = (value.floor() as u64, (value.fract() * (1_u64 << BITS) as f64) as u64);
    whole * factor + ((u128::from(fraction) * u128::from(factor)) >> BITS) as u64
}
