//! Johnson's approach of a cylinder between two bodies, each fixed at a depth.

use std::f64::consts::{LN_2, PI};

use super::{Law, LawName, LogarithmicTerm, Suits, Term, ToothSize};
use crate::contact::{Contact, Materials, PerContact};
use crate::violation::Parameter;

/// Half-width of a line contact over the lesser of tooth radius and depth, above which the law gets a finding.
pub(crate) const WIDE_SHARE: f64 = 0.1;

/// The same ratio at which the law ends.
pub(crate) const WIDEST_SHARE: f64 = 0.5;

pub(super) struct Johnson {
    pub(super) depth_mm: PerContact<Option<f64>>,
}

impl Law for Johnson {
    fn name(&self) -> LawName {
        LawName::Johnson
    }

    fn suits(&self) -> Suits {
        Suits::Lines
    }

    fn term(&self, contact: Contact, materials: &Materials, tooth: ToothSize) -> Term {
        let mate = materials.partner(contact);
        let per_width = |compliance_per_mpa: f64| compliance_per_mpa / (PI * tooth.width_mm);
        let of_tooth = per_width(materials.teeth.compliance_per_mpa());
        let of_mate = per_width(mate.compliance_per_mpa());
        let depth_mm = self.depth_mm.get(contact).unwrap_or(tooth.radius_mm);
        // The reference is the lesser length, which exceeds the half-width, so every logarithm is positive.
        let length_mm = depth_mm.min(tooth.radius_mm);
        let nu = mate.poissons_ratio;
        let compliance_mm_per_n = of_tooth * (4.0 * LN_2 - 1.0 + 2.0 * (tooth.radius_mm / length_mm).ln())
            + of_mate * (2.0 * LN_2 - nu / (1.0 - nu) + 2.0 * (depth_mm / length_mm).ln());
        Term::Logarithmic(LogarithmicTerm { compliance_mm_per_n, growth_mm_per_n: of_tooth + of_mate, length_mm })
    }

    fn parameters(&self) -> Vec<(Parameter, f64)> {
        self.depth_mm
            .iter()
            .filter_map(|(contact, depth_mm)| depth_mm.map(|value| (Parameter::Depth(contact), value)))
            .collect()
    }

    fn depth_mm(&self, tooth_radius_mm: f64) -> Option<PerContact<f64>> {
        Some(PerContact::of(|contact| self.depth_mm.get(contact).unwrap_or(tooth_radius_mm)))
    }
}
