//! Forms of an approach that load sharing knows.

/// Approach δ of one contact under its force F. It is zero at zero force, increasing, and linear or concave.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Term {
    /// `δ = F/k`.
    Linear { compliance_mm_per_n: f64 },
    /// `δ = q F^p`, p < 1 the same at all contacts of a law. The fast path has Palmgren's p only.
    Power { exponent: f64, coefficient: f64 },
    /// `δ = F (A + B ln(F_r/F))`.
    Logarithmic(LogarithmicTerm),
    /// Hertz's ellipse, whose coefficient depends on the place.
    Ellipse,
    /// A flat, whose compliance depends on the place.
    Flat,
}

/// `δ = F (A + B ln(F_r/F))` at one contact. At the force `F_r` half the contact's width is `length_mm`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct LogarithmicTerm {
    /// `A`.
    pub(crate) compliance_mm_per_n: f64,
    /// `B`.
    pub(crate) growth_mm_per_n: f64,
    /// Upper bound of the half-width.
    pub(crate) length_mm: f64,
}

impl LogarithmicTerm {
    /// Coefficients of a contact with another law.
    pub(crate) const NONE: Self = Self { compliance_mm_per_n: 0.0, growth_mm_per_n: 0.0, length_mm: 0.0 };

    /// Returns `F_r` for curvatures that sum to `curvature_per_mm`: `b² = 4 B F/Σ`.
    pub(crate) fn reference_n(&self, curvature_per_mm: f64) -> f64 {
        self.length_mm * (self.length_mm * curvature_per_mm) / (4.0 * self.growth_mm_per_n)
    }
}
