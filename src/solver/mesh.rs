//! Which teeth carry load at an input angle (docs/theory.md section 3).

use std::f64::consts::PI;
use std::ops::RangeInclusive;

use crate::drive::Drive;
use crate::position::Position;
use crate::ring::{FlankEnd, FlankLimit};

/// The mesh over the input angle.
///
/// In the wave generator's frame tooth i stands at `ψ_i(j) = 2π i/Z'_G - j Z_K/Z_G`, less the lobe that it is on. At the sample `n` of `N`
/// over one period that is the whole fraction `q/(U N Z'_G)` of a turn, `q = U (iN - n) - u N Z'_G` for the lobe u: which teeth mesh is
/// decided in whole numbers.
///
/// Where `U` divides `Z'_G` the zones are alike and one of them stands for all; its teeth are numbered on, past the last slot. Elsewhere
/// the teeth of all zones are listed, by slot. With `g = gcd(U, Z'_G)` they stand at places `2π g/(U Z'_G)` apart, g at each.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Mesh {
    installed: u64,
    removal: u64,
    ring_teeth: u64,
    lobes: u32,
    limit: FlankLimit,
}

/// How many teeth mesh, over the input angle: of a zone where all are alike, of all zones elsewhere.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct TeethInMesh {
    /// At least.
    pub min: u64,
    /// At most.
    pub max: u64,
}

/// A tooth in mesh at an input angle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PlacedTooth {
    /// Its slot; where zones are alike, the slots of a zone counted on.
    pub number: u64,
    /// The lobe that it is on, counted from the one where tooth 0 stands at the start.
    pub lobe: u32,
    /// Where it stands on it.
    pub position: Position,
    /// The same in degrees, rounded once where it is a whole fraction of a turn.
    pub position_deg: f64,
}

const fn greatest_common_divisor(one: u64, other: u64) -> u64 {
    let (mut a, mut b) = (one, other);
    while b > 0 {
        (a, b) = (b, a % b);
    }
    a
}

impl Mesh {
    /// The mesh of a drive.
    pub fn new(drive: &Drive) -> Self {
        let p = drive.parameters();
        // Counts of a checked drive are positive and small.
        let whole = |count: i64| count.unsigned_abs();
        Self {
            installed: whole(p.installed),
            removal: whole(p.teeth / p.installed),
            ring_teeth: whole(p.ring_teeth),
            lobes: drive.lobes(),
            limit: *drive.flank_limit(),
        }
    }

    /// Where and why the flank ends.
    pub const fn flank_limit(&self) -> &FlankLimit {
        &self.limit
    }

    /// `U`.
    fn lobes(&self) -> u64 {
        u64::from(self.lobes)
    }

    /// `g = gcd(U, Z'_G)`: for every tooth so many stand alike, each on a lobe of its own.
    pub fn lobes_loaded_alike(&self) -> u64 {
        greatest_common_divisor(self.lobes(), self.installed)
    }

    /// Whether each zone looks like every other: `U` divides `Z'_G`.
    pub fn zones_are_alike(&self) -> bool {
        self.installed.is_multiple_of(self.lobes())
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
        match self.limit.end {
            FlankEnd::RegularTip => self.installed as f64 / 2.0,
            FlankEnd::Undercut | FlankEnd::Bore => {
                0.5 * f64::from(self.lobes) * self.limit.position.from_lobe_rad * self.installed as f64 / PI
            }
        }
    }

    /// The input angle after which the load pattern repeats, teeth renumbered: `2π m/Z_K`, m = Z_G/Z'_G.
    pub fn period_deg(&self) -> f64 {
        360.0 * self.removal as f64 / self.ring_teeth as f64
    }

    /// Places of a whole turn: `U Z'_G/g`.
    fn places(&self) -> u64 {
        self.lobes() / self.lobes_loaded_alike() * self.installed
    }

    /// Angle between neighbouring places: that between installed teeth where zones are alike.
    pub fn spacing_deg(&self) -> f64 {
        360.0 / self.places() as f64
    }

    /// Whether ψ_e is a whole number of spacings.
    fn spacings_are_whole(&self) -> bool {
        match self.limit.end {
            FlankEnd::RegularTip => self.installed.is_multiple_of(2 * self.lobes_loaded_alike()),
            FlankEnd::Undercut | FlankEnd::Bore => false,
        }
    }

    /// How many teeth mesh.
    pub fn teeth_in_mesh(&self) -> TeethInMesh {
        let at_each_place = self.listed_at_each_place();
        let min = self.last_step(1);
        let max = if self.spacings_are_whole() { min } else { min + 1 };
        TeethInMesh { min: at_each_place * min, max: at_each_place * max }
    }

    /// Whether at every input angle a tooth has a lever arm: `ψ_e > 2π g/(U Z'_G)`.
    pub fn always_carries(&self) -> bool {
        let least = self.last_step(1);
        least > 1 || least == 1 && !self.spacings_are_whole()
    }

    /// The largest whole p with `2π p/(N places) ≤ ψ_e`, N = `samples`.
    pub fn last_step(&self, samples: u64) -> u64 {
        self.last_of(samples * self.places())
    }

    /// The largest whole p with `2π p/steps ≤ ψ_e`.
    fn last_of(&self, steps: u64) -> u64 {
        let halves = 2 * self.lobes();
        let (to_valley, rest) = (steps / halves, steps % halves);
        let position = &self.limit.position;
        // Whole numbers of steps below 2^53; floor and ceil leave nothing for the conversion to cut.
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "bounded by half a lobe's share of the steps"
        )]
        match self.limit.end {
            FlankEnd::RegularTip => to_valley,
            FlankEnd::Undercut | FlankEnd::Bore if position.from_valley_rad < position.from_lobe_rad => {
                let missing = position.from_valley_rad * steps as f64 / (2.0 * PI);
                to_valley.saturating_sub((missing - rest as f64 / halves as f64).ceil().max(0.0) as u64)
            }
            FlankEnd::Undercut | FlankEnd::Bore => (position.from_lobe_rad * steps as f64 / (2.0 * PI)).floor() as u64,
        }
    }

    /// States of a sweep: one for each of its input angles and teeth that are listed there.
    pub fn state_count(&self, samples: u64) -> u64 {
        if self.zones_are_alike() {
            let last_step = self.last_step(samples);
            // Every step from 1 on belongs to one sample below N; the sample N repeats the sample 0.
            return last_step + last_step / samples;
        }
        // The steps that occur, `U p` modulo `N Z'_G`, are the multiples of their greatest common divisor, each as many times.
        let last_step = self.last_listed_step(samples);
        let alike = greatest_common_divisor(self.lobes(), samples * self.installed);
        alike * (last_step / alike) + self.lobes_loaded_alike() * (last_step / (self.lobes_loaded_alike() * samples))
    }

    /// The largest q in mesh.
    fn last_listed_step(&self, samples: u64) -> u64 {
        self.last_of(self.lobes() * self.steps(samples))
    }

    /// The teeth that are listed at sample `sample` of `samples`.
    pub fn placed_at(self, sample: u64, samples: u64) -> impl Iterator<Item = PlacedTooth> {
        let is_one_zone = self.zones_are_alike();
        let numbers = if is_one_zone { self.teeth_at(sample, samples) } else { 0..=self.installed - 1 };
        let last_step = self.last_listed_step(samples);
        let (lobes, steps) = (self.lobes(), self.steps(samples));
        numbers.filter_map(move |number| {
            // A turn ahead, so that nothing falls below zero: the tooth in slot 0 soon stands behind the lobe where it began.
            let ahead = lobes * (number * samples + steps - sample);
            let lobe = (ahead - 1) / steps;
            let step = ahead - lobe * steps;
            (is_one_zone || step <= last_step).then(|| PlacedTooth {
                number,
                lobe: u32::try_from(lobe % lobes).unwrap_or_default(),
                position: Position::of_lobe(step, steps, self.lobes),
                position_deg: (360 * step) as f64 / (lobes * steps) as f64,
            })
        })
    }

    /// The teeth in mesh at sample `sample` of `samples`, by number, where zones are alike.
    pub fn teeth_at(&self, sample: u64, samples: u64) -> RangeInclusive<u64> {
        let first = if sample < samples { 1 } else { 2 };
        first..=(self.last_step(samples) + sample) / samples
    }

    /// The first sample after this one at which more teeth mesh; the last one, where none does.
    pub(crate) fn same_teeth_until(&self, sample: u64, samples: u64) -> u64 {
        let next_tooth = self.teeth_at(sample, samples).end() + 1;
        samples.min(next_tooth * samples - self.last_step(samples))
    }

    /// Steps of a whole turn, for a sweep of so many samples.
    pub(crate) const fn steps(&self, samples: u64) -> u64 {
        samples * self.installed
    }

    /// The position of a tooth in mesh at a sample, where zones are alike.
    pub fn position(&self, tooth: u64, sample: u64, samples: u64) -> Position {
        Position::of_lobe(self.lobes() * (tooth * samples - sample), self.steps(samples), self.lobes)
    }

    /// How many times the pattern of places repeats in a period: `U/g`, once where zones are alike.
    pub(crate) fn laps(&self) -> u64 {
        self.lobes() / self.lobes_loaded_alike()
    }

    /// How many spacings the engagement spans, `ε/g`.
    pub fn engaged_spacings(&self) -> f64 {
        self.coincidence_degree() / self.teeth_at_each_place()
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
        numbers.filter_map(move |number| {
            let (place, lobe) = if is_one_zone {
                (number, 0)
            } else {
                // `U i - g lap = g place + u Z'_G`, a turn ahead.
                let ahead = lobes * (number + turn) - alike * lap;
                let lobe = (ahead - 1) / turn;
                ((ahead - lobe * turn) / alike, lobe % lobes)
            };
            places.contains(&place).then(|| {
                let position = position(place);
                let lobe = u32::try_from(lobe).unwrap_or_default();
                PlacedTooth { number, lobe, position, position_deg: position.from_lobe_deg() }
            })
        })
    }

    /// The input angle of a sample, rounded once.
    pub fn input_angle_deg(&self, sample: u64, samples: u64) -> f64 {
        (360 * self.removal * sample) as f64 / (self.ring_teeth * samples) as f64
    }
}
