//! Line contact: Hertz pressure, and the approach of a cylinder between two bodies (docs/explanation/theory.md sections
//! 4.3 and 5).

use std::f64::consts::{LN_2, PI};

use crate::contact::{Contact, Materials, PerContact};

/// Half-width of a line contact over the lesser of tooth radius and depth, above which Johnson's law gets a finding.
pub(crate) const WIDE_SHARE: f64 = 0.1;

/// The same ratio at which Johnson's law ends.
pub(crate) const WIDEST_SHARE: f64 = 0.5;

/// Johnson's `δ = F (A + B ln(F_r/F))` at one contact. At the force `F_r` half the contact's width is `length_mm`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct JohnsonLine {
    /// `A`.
    pub(crate) compliance_mm_per_n: f64,
    /// `B`.
    pub(crate) growth_mm_per_n: f64,
    /// Upper bound of the half-width.
    pub(crate) length_mm: f64,
}

/// Coefficients of [`JohnsonLine`] at a place.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct JohnsonAt {
    /// `A`.
    pub(crate) compliance_mm_per_n: f64,
    /// `B`.
    pub(crate) growth_mm_per_n: f64,
    /// `F_r`.
    pub(crate) reference_n: f64,
}

/// Returns the reference length of Johnson's law: the lesser of the tooth's radius and the other body's depth, by
/// default equal.
pub(crate) fn least_length_mm(depth_mm: &PerContact<Option<f64>>, contact: Contact, tooth_radius_mm: f64) -> f64 {
    depth_mm.get(contact).map_or(tooth_radius_mm, |depth_mm| depth_mm.min(tooth_radius_mm))
}

impl JohnsonLine {
    /// Coefficients of a contact with another law.
    pub(crate) const NONE: Self = Self { compliance_mm_per_n: 0.0, growth_mm_per_n: 0.0, length_mm: 0.0 };

    /// Builds the law between a tooth of this radius and width and a body that is fixed at the depth `depth_mm`.
    pub(crate) fn new(
        materials: &Materials,
        contact: Contact,
        tooth_radius_mm: f64,
        tooth_width_mm: f64,
        depth_mm: Option<f64>,
    ) -> Self {
        let mate = materials.partner(contact);
        let per_width = |compliance_per_mpa: f64| compliance_per_mpa / (PI * tooth_width_mm);
        let of_tooth = per_width(materials.teeth.compliance_per_mpa());
        let of_mate = per_width(mate.compliance_per_mpa());
        let depth_mm = depth_mm.unwrap_or(tooth_radius_mm);
        // The reference is the lesser length, which exceeds the half-width, so every logarithm is positive.
        let length_mm = depth_mm.min(tooth_radius_mm);
        let nu = mate.poissons_ratio;
        let compliance_mm_per_n = of_tooth * (4.0 * LN_2 - 1.0 + 2.0 * (tooth_radius_mm / length_mm).ln())
            + of_mate * (2.0 * LN_2 - nu / (1.0 - nu) + 2.0 * (depth_mm / length_mm).ln());
        Self { compliance_mm_per_n, growth_mm_per_n: of_tooth + of_mate, length_mm }
    }

    /// Returns the law for curvatures that sum to `curvature_per_mm`: `b² = 4 B F/Σ`.
    pub(crate) fn at(&self, curvature_per_mm: f64) -> JohnsonAt {
        let reference_n = self.length_mm * (self.length_mm * curvature_per_mm) / (4.0 * self.growth_mm_per_n);
        JohnsonAt { compliance_mm_per_n: self.compliance_mm_per_n, growth_mm_per_n: self.growth_mm_per_n, reference_n }
    }
}
