//! Unit loads of a tooth by contact law.

use crate::contact::PerContact;
use crate::load_sharing::{Compatibility, LoadedDrive};

/// Unit of the unit loads, by the divisor of a state's loads: coefficients of `(h + r)²` and `h'²`, which add up to
/// `d²`. Under a linear law the divisor is `c d²`.
#[derive(Clone, Copy)]
pub(super) struct Unit {
    of_above: f64,
    of_lever: f64,
    /// True for 1 N; otherwise the unit is a rotation of 1.
    is_newton: bool,
}

impl Unit {
    /// 1 N at the wave generator.
    pub(super) const NEWTON: Self = Self { of_above: 1.0, of_lever: 1.0, is_newton: true };

    /// A rotation of 1 under a linear law.
    pub(super) fn rotation(compliance_mm_per_n: &PerContact<f64>, loaded: &LoadedDrive<'_>) -> Self {
        let PerContact { wave_generator, ring, carrier } = *compliance_mm_per_n;
        let drive = loaded.drive();
        let ring_teeth_per_wave = drive.flank().teeth_per_wave();
        let of_above = wave_generator + ring;
        let of_lever = match loaded.load.compatibility {
            // F_K²/F_H² = cos²γ/cos²β and F_S²/F_H² = sin²γ (Z_G/U)².
            Compatibility::VirtualWork => {
                wave_generator + ring * ring_teeth_per_wave.powi(2) + carrier * drive.teeth_per_wave().powi(2)
            }
            // 1/k_H + 1/k_K + (1 + sk) sin²γ (1/k_S - 1/k_K).
            Compatibility::Projection => of_above + (1.0 + drive.sense() * ring_teeth_per_wave) * (carrier - ring),
        };
        Self { of_above, of_lever, is_newton: false }
    }

    #[inline(always)]
    pub(super) fn denominator(self, above2: f64, lever2: f64) -> f64 {
        self.of_above * above2 + self.of_lever * lever2
    }

    /// Returns `F_H` over `d²`, given the reciprocal of the divisor.
    #[inline(always)]
    pub(super) fn load(self, lever: f64, per_denominator: f64) -> f64 {
        if self.is_newton { per_denominator } else { lever * per_denominator }
    }
}

/// Returns `√(F Σ E*/(π L1))` of a line contact of relative curvature Σ. Balls, which have no line contacts, store
/// curvatures in place of stresses.
#[inline(always)]
pub(super) fn stress_of<const BALLS: bool>(force: f64, curvature: f64, hertz: f64) -> f64 {
    if BALLS { curvature * hertz } else { (force * curvature * hertz).sqrt() }
}
