//! A tooth's position ψ from the major axis, kept exact at both ends of the quarter turn.

use std::f64::consts::{FRAC_PI_2, PI};

/// A position ψ in `[0, π/2]`, with its distance to either axis and its sine and cosine, each to full relative
/// precision: near the major axis ψ itself is small, near the minor axis `π/2 - ψ` is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Position {
    /// ψ, from the major axis.
    pub from_major_rad: f64,
    /// `x = π/2 - ψ`, from the minor axis.
    pub from_minor_rad: f64,
    /// cos ψ.
    pub cos: f64,
    /// sin ψ.
    pub sin: f64,
}

impl Position {
    /// On the major axis: the root of the ring's tooth space.
    pub const ROOT: Self = Self { from_major_rad: 0.0, from_minor_rad: FRAC_PI_2, cos: 1.0, sin: 0.0 };

    /// On the minor axis: the tip of the ring's tooth.
    pub const TIP: Self = Self { from_major_rad: FRAC_PI_2, from_minor_rad: 0.0, cos: 0.0, sin: 1.0 };

    /// At `ψ` in `[0, π/2]`; exact towards the major axis.
    pub fn from_major(from_major_rad: f64) -> Self {
        let (sin, cos) = from_major_rad.sin_cos();
        Self { from_major_rad, from_minor_rad: FRAC_PI_2 - from_major_rad, cos, sin }
    }

    /// At `x = π/2 - ψ` in `[0, π/2]`; exact towards the minor axis.
    pub fn from_minor(from_minor_rad: f64) -> Self {
        let (cos, sin) = from_minor_rad.sin_cos();
        Self { from_major_rad: FRAC_PI_2 - from_minor_rad, from_minor_rad, cos, sin }
    }

    /// At the whole fraction `numerator / denominator` of a turn; exact towards both axes. None beyond a quarter.
    pub fn of_turn(numerator: u64, denominator: u64) -> Option<Self> {
        let is_in_quarter = denominator > 0 && 4 * u128::from(numerator) <= u128::from(denominator);
        is_in_quarter.then(|| Self::of_quarter(numerator, denominator))
    }

    /// The same of a fraction that is known to be at most a quarter.
    pub(crate) fn of_quarter(numerator: u64, denominator: u64) -> Self {
        // Below 2^53 for every sweep (samples × installed teeth), so that the conversions are exact.
        let whole = denominator as f64;
        let from_major_rad = 2.0 * PI * (numerator as f64 / whole);
        let from_minor_rad = FRAC_PI_2 * ((denominator - 4 * numerator) as f64 / whole);
        let (sin, cos) = if from_major_rad < from_minor_rad {
            from_major_rad.sin_cos()
        } else {
            let (cos, sin) = from_minor_rad.sin_cos();
            (sin, cos)
        };
        Self { from_major_rad, from_minor_rad, cos, sin }
    }

    /// ψ in degrees.
    pub fn from_major_deg(&self) -> f64 {
        if self.from_minor_rad < self.from_major_rad {
            90.0 - self.from_minor_rad.to_degrees()
        } else {
            self.from_major_rad.to_degrees()
        }
    }
}
