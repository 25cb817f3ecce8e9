//! Which teeth carry load at an input angle (docs/theory.md section 3).

use std::f64::consts::PI;

use crate::drive::Drive;
use crate::position::Position;
use crate::ring::{FlankEnd, FlankLimit};

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
        Self {
            installed: whole(p.installed),
            removal: whole(p.teeth / p.installed),
            ring_teeth: whole(p.ring_teeth),
            limit: *drive.flank_limit(),
        }
    }

    /// Where and why the flank ends.
    pub const fn flank_limit(&self) -> &FlankLimit {
        &self.limit
    }

    /// `ε = ψ_e Z'_G/π`, counted over both zones.
    pub fn coincidence_degree(&self) -> f64 {
        match self.limit.end {
            FlankEnd::RegularTip => self.installed as f64 / 2.0,
            FlankEnd::Undercut | FlankEnd::Bore => self.limit.position.from_major_rad * self.installed as f64 / PI,
        }
    }

    /// The input angle after which the load pattern repeats, teeth renumbered: `2π m/Z_K`, m = Z_G/Z'_G.
    pub fn period_deg(&self) -> f64 {
        360.0 * self.removal as f64 / self.ring_teeth as f64
    }

    /// Angle between neighbouring installed teeth.
    pub fn spacing_deg(&self) -> f64 {
        360.0 / self.installed as f64
    }

    /// How many teeth of a zone mesh.
    pub fn teeth_in_mesh(&self) -> TeethInMesh {
        let min = self.last_step(1);
        let spacings_are_whole = match self.limit.end {
            FlankEnd::RegularTip => self.installed.is_multiple_of(4),
            FlankEnd::Undercut | FlankEnd::Bore => false,
        };
        TeethInMesh { min, max: if spacings_are_whole { min } else { min + 1 } }
    }

    /// Whether at every input angle a tooth has a lever arm: `ψ_e > 2π/Z'_G`.
    pub fn always_carries(&self) -> bool {
        let teeth = self.teeth_in_mesh();
        teeth.min > 1 || teeth.min == 1 && teeth.max == 2
    }

    /// The largest whole p with `2π p/(N Z'_G) ≤ ψ_e`, N = `samples`.
    pub fn last_step(&self, samples: u64) -> u64 {
        let steps = samples * self.installed;
        let (quarter, rest) = (steps / 4, steps % 4);
        let position = &self.limit.position;
        // Whole numbers of steps below 2^53; floor and ceil leave nothing for the conversion to cut.
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "bounded by a quarter of the steps"
        )]
        match self.limit.end {
            FlankEnd::RegularTip => quarter,
            FlankEnd::Undercut | FlankEnd::Bore if position.from_minor_rad < position.from_major_rad => {
                let missing = position.from_minor_rad * steps as f64 / (2.0 * PI);
                quarter.saturating_sub((missing - rest as f64 / 4.0).ceil().max(0.0) as u64)
            }
            FlankEnd::Undercut | FlankEnd::Bore => (position.from_major_rad * steps as f64 / (2.0 * PI)).floor() as u64,
        }
    }

    /// States of a sweep: one for each of its input angles and tooth in mesh.
    pub fn state_count(&self, samples: u64) -> u64 {
        let last_step = self.last_step(samples);
        // Every step from 1 on belongs to one sample below N; the sample N repeats the sample 0.
        last_step + last_step / samples
    }

    /// The teeth in mesh at sample `sample` of `samples`, by number.
    pub fn teeth_at(&self, sample: u64, samples: u64) -> std::ops::RangeInclusive<u64> {
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

    /// The position of a tooth in mesh at a sample.
    pub fn position(&self, tooth: u64, sample: u64, samples: u64) -> Position {
        Position::of_turn(tooth * samples - sample, samples * self.installed)
    }

    /// The same position in degrees, rounded once.
    pub fn position_deg(&self, tooth: u64, sample: u64, samples: u64) -> f64 {
        (360 * (tooth * samples - sample)) as f64 / (samples * self.installed) as f64
    }

    /// How many spacings of the installed teeth the engagement spans, `ψ_e Z'_G/2π`.
    pub fn engaged_spacings(&self) -> f64 {
        0.5 * self.coincidence_degree()
    }

    /// The position of a tooth when a fraction of the period has passed: `tooth - fraction` spacings from the major axis. Both are
    /// exact, so the distance to the minor axis keeps its digits too.
    pub fn position_between(&self, tooth: u64, fraction: f64) -> Position {
        let spacing_rad = 2.0 * PI / self.installed as f64;
        let from_major_rad = (tooth as f64 - fraction) * spacing_rad;
        let from_minor_rad = ((0.25 * self.installed as f64 - tooth as f64) + fraction) * spacing_rad;
        if from_major_rad < from_minor_rad {
            Position::from_major(from_major_rad)
        } else {
            Position::from_minor(from_minor_rad.max(0.0))
        }
    }

    /// The input angle of a sample, rounded once.
    pub fn input_angle_deg(&self, sample: u64, samples: u64) -> f64 {
        (360 * self.removal * sample) as f64 / (self.ring_teeth * samples) as f64
    }
}
