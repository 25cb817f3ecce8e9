//! Unit loads of a tooth by contact law.

use crate::contact::PerContact;
use crate::load_sharing::{Compatibility, LoadedDrive};

/// Unit of the unit loads.
pub(super) trait Unit: Copy {
    /// Returns the divisor of a state's loads, from the squares of `h + r` and `h'`, which add up to `d²`.
    fn denominator(self, above2: f64, lever2: f64) -> f64;

    /// Returns `F_H` over `d²`, given the reciprocal of that divisor.
    fn load(self, lever: f64, per_denominator: f64) -> f64;

    /// Returns the value stored as stress.
    #[inline(always)]
    fn stress(self, force: f64, curvature: f64, hertz: f64) -> f64 {
        line_stress(force, curvature, hertz)
    }
}

impl Unit for Compliance {
    #[inline(always)]
    fn denominator(self, above2: f64, lever2: f64) -> f64 {
        self.of_above * above2 + self.of_lever * lever2
    }

    #[inline(always)]
    fn load(self, lever: f64, per_denominator: f64) -> f64 {
        lever * per_denominator
    }
}

/// 1 N at the wave generator. Balls, which have no line contacts, store curvatures in place of stresses.
#[derive(Clone, Copy)]
pub(super) struct Newton<const BALLS: bool>;

impl<const BALLS: bool> Unit for Newton<BALLS> {
    #[inline(always)]
    fn denominator(self, above2: f64, lever2: f64) -> f64 {
        above2 + lever2
    }

    #[inline(always)]
    fn load(self, _: f64, per_denominator: f64) -> f64 {
        per_denominator
    }

    #[inline(always)]
    fn stress(self, force: f64, curvature: f64, hertz: f64) -> f64 {
        if BALLS { curvature * hertz } else { line_stress(force, curvature, hertz) }
    }
}

/// `√(F Σ E*/(π L1))` of a line contact of relative curvature Σ.
#[inline(always)]
fn line_stress(force: f64, curvature: f64, hertz: f64) -> f64 {
    (force * curvature * hertz).sqrt()
}

/// `c d²` of a tooth under a linear law: coefficients of `(h + r)²` and `h'²`, which add up to `d²`.
#[derive(Clone, Copy)]
pub(super) struct Compliance {
    of_above: f64,
    of_lever: f64,
}

impl Compliance {
    pub(super) fn new(contact: &PerContact<f64>, loaded: &LoadedDrive<'_>) -> Self {
        let PerContact { wave_generator, ring, carrier } = *contact;
        let drive = loaded.drive();
        let ring_teeth_per_wave = drive.flank().teeth_per_wave();
        let of_above = wave_generator + ring;
        let of_lever = match loaded.compatibility() {
            // F_K²/F_H² = cos²γ/cos²β and F_S²/F_H² = sin²γ (Z_G/U)².
            Compatibility::VirtualWork => {
                wave_generator + ring * ring_teeth_per_wave.powi(2) + carrier * drive.teeth_per_wave().powi(2)
            }
            // 1/k_H + 1/k_K + (1 + sk) sin²γ (1/k_S - 1/k_K).
            Compatibility::Projection => of_above + (1.0 + drive.sense() * ring_teeth_per_wave) * (carrier - ring),
        };
        Self { of_above, of_lever }
    }
}
