//! Position ψ of a tooth on its lobe, exact at both ends of half a lobe (docs/explanation/theory.md section 3).

use std::f64::consts::PI;

/// Position ψ in `[0, π/U]`, from the middle of a lobe to the adjacent valley. Its distance to either end and its phase
/// have full relative precision: ψ is small near the lobe, `π/U - ψ` near the valley. The phase covers a quarter turn
/// for any number of lobes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Position {
    /// ψ, from the middle of the lobe.
    pub from_lobe_rad: f64,
    /// `x = π/U - ψ`, from the valley.
    pub from_valley_rad: f64,
    /// cos of the phase `Uψ/2`; of an ellipse, cos ψ.
    pub phase_cos: f64,
    /// sin of the phase.
    pub phase_sin: f64,
    /// `U`: lobes of the wave generator.
    pub lobes: u32,
}

/// Returns half the angle of a lobe, `π/U`.
pub fn half_lobe_rad(lobes: u32) -> f64 {
    PI / f64::from(lobes)
}

impl Position {
    /// Returns the position in the middle of the lobe: the root of the ring's tooth space.
    pub fn lobe(lobes: u32) -> Self {
        Self { from_lobe_rad: 0.0, from_valley_rad: half_lobe_rad(lobes), phase_cos: 1.0, phase_sin: 0.0, lobes }
    }

    /// Returns the position in the valley: the tip of the ring's tooth.
    pub fn valley(lobes: u32) -> Self {
        Self { from_lobe_rad: half_lobe_rad(lobes), from_valley_rad: 0.0, phase_cos: 0.0, phase_sin: 1.0, lobes }
    }

    /// Returns the position `ψ` in `[0, π/U]`; exact towards the lobe.
    pub fn from_lobe(from_lobe_rad: f64, lobes: u32) -> Self {
        let (phase_sin, phase_cos) = (0.5 * f64::from(lobes) * from_lobe_rad).sin_cos();
        Self { from_lobe_rad, from_valley_rad: half_lobe_rad(lobes) - from_lobe_rad, phase_cos, phase_sin, lobes }
    }

    /// Returns the position `x = π/U - ψ` in `[0, π/U]`; exact towards the valley.
    pub fn from_valley(from_valley_rad: f64, lobes: u32) -> Self {
        let (phase_cos, phase_sin) = (0.5 * f64::from(lobes) * from_valley_rad).sin_cos();
        Self { from_lobe_rad: half_lobe_rad(lobes) - from_valley_rad, from_valley_rad, phase_cos, phase_sin, lobes }
    }

    /// Returns the position at two distances that add up to `π/U`, each exact.
    pub(crate) fn between(from_lobe_rad: f64, from_valley_rad: f64, lobes: u32) -> Self {
        let phase = |rad: f64| (0.5 * f64::from(lobes) * rad).sin_cos();
        let (phase_sin, phase_cos) = if from_lobe_rad < from_valley_rad {
            phase(from_lobe_rad)
        } else {
            let (cos, sin) = phase(from_valley_rad);
            (sin, cos)
        };
        Self { from_lobe_rad, from_valley_rad, phase_cos, phase_sin, lobes }
    }

    /// Returns the position at the fraction `numerator / denominator` of a lobe, at most half of it; exact towards both
    /// ends.
    ///
    /// # Panics
    /// If the fraction exceeds one half.
    pub fn of_lobe(numerator: u64, denominator: u64, lobes: u32) -> Self {
        assert!(2 * u128::from(numerator) <= u128::from(denominator), "more than half a lobe");
        // Below 2^53 for every sweep (lobes × samples × installed teeth), so that the conversions are exact.
        let whole = denominator as f64;
        let from_lobe_rad = 2.0 * PI * (numerator as f64 / (f64::from(lobes) * whole));
        let from_valley_rad = half_lobe_rad(lobes) * ((denominator - 2 * numerator) as f64 / whole);
        Self::between(from_lobe_rad, from_valley_rad, lobes)
    }

    /// Returns ψ in degrees.
    pub fn from_lobe_deg(&self) -> f64 {
        if self.from_valley_rad < self.from_lobe_rad {
            180.0 / f64::from(self.lobes) - self.from_valley_rad.to_degrees()
        } else {
            self.from_lobe_rad.to_degrees()
        }
    }
}
