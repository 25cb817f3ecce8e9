//! Contact of the flat of a flat-sided tooth with the wall of its slot (docs/explanation/theory.md sections 4.3 and 5).

use std::f64::consts::PI;

/// Rectangle of contact of a flat.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FlatContact {
    /// Length along the slot, above 0.
    pub length_mm: f64,
    /// Width along the axis, above 0.
    pub width_mm: f64,
}

impl FlatContact {
    /// Returns the mean pressure under a force. The higher pressure at the edges is not modelled.
    pub fn stress_mpa(&self, force_n: f64) -> f64 {
        force_n / (self.length_mm * self.width_mm)
    }

    /// Returns the force that makes the mean pressure `stress_mpa`.
    pub fn force_n(&self, stress_mpa: f64) -> f64 {
        stress_mpa * (self.length_mm * self.width_mm)
    }

    /// Returns the mean approach of two half-spaces under uniform pressure on the rectangle, for 1 N: `I/(π E* (l L)²)`
    /// with `I = (2/3)(3l²L asinh(L/l) + 3lL² asinh(l/L) + l³ + L³ - (l² + L²)^(3/2))`.
    pub fn compliance_mm_per_n(&self, modulus_mpa: f64) -> f64 {
        let (long, short) = (self.length_mm.max(self.width_mm), self.length_mm.min(self.width_mm));
        // Over the cube of the long side, with t = short/long: 1 + t³ - (1 + t²)^(3/2) without a difference of nearly
        // equal numbers.
        let t = short / long;
        let squared = t * t;
        let root = (1.0 + squared).sqrt();
        // (1 + t²)^(3/2) - 1 = t² (root² + root + 1)/(root + 1)
        let corners = squared * (t - (squared + 1.0 + root + 1.0) / (root + 1.0));
        let integral = (2.0 / 3.0) * (3.0 * t * t.recip().asinh() * t + 3.0 * t * t.asinh() + corners);
        // long³ · integral/(l L)², and l L = t long².
        integral / (PI * modulus_mpa * squared * long)
    }
}
