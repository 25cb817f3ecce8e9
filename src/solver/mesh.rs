//! Which teeth carry load at an input angle (docs/theory.md section 3).

use std::f64::consts::PI;

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

/// The mesh of one zone over the input angle.
///
/// In the wave generator's frame tooth i stands at `ψ_i(j) = 2π i/Z'_G - j Z_K/Z_G`. At the sample `n` of `N` over one
/// period that is the whole fraction `(iN - n)/(N Z'_G)` of a turn: which teeth mesh is decided in whole numbers.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Mesh {
    installed: u64,
    removal: u64,
    ring_teeth: u64,
    limit: FlankLimit,
    /// `ψ_e Z'_G/2π`, rounded once: whoever asks when a tooth enters asks this number, and takes it as exact.
    engaged_spacings: f64,
}

/// How many teeth of a zone mesh, over the input angle.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct TeethInMesh {
    /// At least.
    pub min: u64,
    /// At most.
    pub max: u64,
}

impl Mesh {
    /// The mesh of a drive.
    pub fn new(drive: &Drive) -> Self {
        let p = drive.parameters();
        // Counts of a checked drive are positive and small.
        let whole = |count: i64| count.unsigned_abs();
        let (installed, limit) = (whole(p.installed), *drive.flank_limit());
        Self {
            installed,
            removal: whole(p.teeth / p.installed),
            ring_teeth: whole(p.ring_teeth),
            limit,
            engaged_spacings: engaged_spacings(&limit, installed),
        }
    }

    /// Where and why the flank ends.
    pub const fn flank_limit(&self) -> &FlankLimit {
        &self.limit
    }

    /// `ε = ψ_e Z'_G/π`, counted over both zones.
    pub const fn coincidence_degree(&self) -> f64 {
        2.0 * self.engaged_spacings
    }

    /// The input angle after which the load pattern repeats, teeth renumbered: `2π m/Z_K`, m = Z_G/Z'_G.
    pub fn period_deg(&self) -> f64 {
        360.0 * self.removal as f64 / self.ring_teeth as f64
    }

    /// Angle between neighbouring installed teeth.
    pub fn spacing_deg(&self) -> f64 {
        360.0 / self.installed as f64
    }

    /// How many teeth of a zone mesh: always as many as the engagement spans whole spacings, or at times one more.
    pub fn teeth_in_mesh(&self) -> TeethInMesh {
        let min = self.whole_spacings();
        TeethInMesh { min, max: min + u64::from(!self.spacings_are_whole()) }
    }

    /// Whether at every input angle a tooth has a lever arm: `ψ_e > 2π/Z'_G`.
    pub fn always_carries(&self) -> bool {
        self.engaged_spacings > 1.0
    }

    /// Whole spacings within the engagement: the teeth in mesh at j = 0.
    pub(crate) fn whole_spacings(&self) -> u64 {
        floor_of_product(self.engaged_spacings, 1)
    }

    /// Whether a tooth stands at the end of the flank at j = 0.
    pub(crate) fn spacings_are_whole(&self) -> bool {
        self.engaged_spacings.fract() == 0.0
    }

    /// The fraction of the period that has passed when a tooth enters, above 0; 1 where that is at its end. Exact.
    pub(crate) fn entry_fraction(&self) -> f64 {
        1.0 - self.engaged_spacings.fract()
    }

    /// The largest whole p with `2π p/(N Z'_G) ≤ ψ_e`.
    pub fn last_step(&self, samples: Samples) -> u64 {
        floor_of_product(self.engaged_spacings, samples.0)
    }

    /// States of a sweep: one for each of its input angles and tooth in mesh.
    pub fn state_count(&self, samples: Samples) -> u64 {
        let last_step = self.last_step(samples);
        // Every step from 1 on belongs to one sample below N; the sample N repeats the sample 0.
        last_step + last_step / samples.0
    }

    /// The teeth in mesh at sample `sample`, at most the last, by number.
    pub fn teeth_at(&self, sample: u64, samples: Samples) -> std::ops::RangeInclusive<u64> {
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

    /// The position of a tooth at a sample, where it stands in the quarter turn from the major to the minor axis.
    pub fn position(&self, tooth: u64, sample: u64, samples: Samples) -> Option<Position> {
        Position::of_turn(tooth.checked_mul(samples.0)?.checked_sub(sample)?, self.steps(samples))
    }

    /// The position of a tooth in mesh at a sample.
    pub(crate) fn position_in_mesh(&self, tooth: u64, sample: u64, samples: Samples) -> Position {
        Position::of_quarter(tooth * samples.0 - sample, self.steps(samples))
    }

    /// The same position in degrees, rounded once.
    pub(crate) fn position_deg(&self, tooth: u64, sample: u64, samples: Samples) -> f64 {
        (360 * (tooth * samples.0 - sample)) as f64 / self.steps(samples) as f64
    }

    /// How many spacings of the installed teeth the engagement spans, `ψ_e Z'_G/2π`.
    pub const fn engaged_spacings(&self) -> f64 {
        self.engaged_spacings
    }

    /// The position of a tooth when a fraction of the period has passed: `tooth - fraction` spacings from the major axis. Both are
    /// exact, so the distance to the minor axis keeps its digits too.
    pub(crate) fn position_between(&self, tooth: u64, fraction: f64) -> Position {
        let spacing_rad = 2.0 * PI / self.installed as f64;
        let from_major_rad = (tooth as f64 - fraction) * spacing_rad;
        let from_minor_rad = ((0.25 * self.installed as f64 - tooth as f64) + fraction) * spacing_rad;
        if from_major_rad < from_minor_rad {
            Position::from_major(from_major_rad)
        } else {
            Position::from_minor(from_minor_rad.max(0.0))
        }
    }

    /// The position of a tooth at the end of the period, where the one before it stood at its start.
    pub(crate) fn position_after_period(&self, tooth: u64) -> Position {
        Position::of_quarter(tooth - 1, self.installed)
    }

    /// The input angle of a sample, rounded once.
    pub fn input_angle_deg(&self, sample: u64, samples: Samples) -> f64 {
        (360 * self.removal * sample) as f64 / (self.ring_teeth * samples.0) as f64
    }
}

/// `ψ_e Z'_G/2π`, from whichever axis is nearer; never beyond the minor axis.
fn engaged_spacings(limit: &FlankLimit, installed: u64) -> f64 {
    let (quarter, position) = (0.25 * installed as f64, &limit.position);
    let spacings = |angle_rad: f64| angle_rad * installed as f64 / (2.0 * PI);
    match limit.end {
        FlankEnd::RegularTip => quarter,
        FlankEnd::Undercut | FlankEnd::Bore if position.from_minor_rad < position.from_major_rad => {
            quarter - spacings(position.from_minor_rad)
        }
        FlankEnd::Undercut | FlankEnd::Bore => spacings(position.from_major_rad),
    }
}

/// The whole part of a product, exactly. Of a value below 1 the digits beyond 2^-52 are left out, which only a factor beyond 2^52 would see.
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "whole numbers below 2^53; not negative")]
fn floor_of_product(value: f64, factor: u64) -> u64 {
    const BITS: u32 = 52;
    let (whole, fraction) = (value.floor() as u64, (value.fract() * (1_u64 << BITS) as f64) as u64);
    whole * factor + ((u128::from(fraction) * u128::from(factor)) >> BITS) as u64
}
