//! The contact law. A law is a variant of the union and an arm of each match.

use toothwave_solver::{ContactLaw, Parameter, PerContact};

use super::drive::LengthsByContactDocument;
use crate::union;

union! {
    /// The contact law.
    #[schema(as = Stiffness)]
    pub enum StiffnessDocument by "law" read "by:law" {
        /// The paper's stiffness k = (π/2) L1 E* at each contact, several times too high.
        Linear {},
        /// Given stiffnesses at the wave generator, the ring and the carrier, in N/mm.
        Fixed {
            /// Stiffness at the wave generator, in N/mm.
            wave_generator_n_per_mm: f64,
            /// Stiffness at the ring, in N/mm.
            ring_n_per_mm: f64,
            /// Stiffness at the carrier, in N/mm.
            carrier_n_per_mm: f64,
        },
        /// Palmgren's law δ = 3.84e-5 F^0.9/L1^0.8 (N, mm) for steel on steel.
        Palmgren {},
        /// Logarithmic approach of a cylinder between two bodies (Johnson, Contact Mechanics, section 5.6).
        Johnson {
            /// Depth below each contact at which the body is fixed, in mm. Default: the tooth's radius.
            #[serde(default)]
            depth_mm: LengthsByContactDocument,
        },
        /// Hertz's law of point contacts, δ = q F^(2/3), for balls.
        Hertz {},
    }
}

impl From<&StiffnessDocument> for ContactLaw {
    fn from(document: &StiffnessDocument) -> Self {
        match *document {
            StiffnessDocument::Linear {} => Self::Linear,
            StiffnessDocument::Palmgren {} => Self::Palmgren,
            StiffnessDocument::Fixed { wave_generator_n_per_mm, ring_n_per_mm, carrier_n_per_mm } => {
                Self::Fixed(PerContact {
                    wave_generator: wave_generator_n_per_mm,
                    ring: ring_n_per_mm,
                    carrier: carrier_n_per_mm,
                })
            }
            StiffnessDocument::Johnson { ref depth_mm } => Self::Johnson { depth_mm: depth_mm.by_contact() },
            StiffnessDocument::Hertz {} => Self::Hertz,
        }
    }
}

impl StiffnessDocument {
    /// Writes out the numbers that are left out. An impossible radius has its own error, so that it is not copied.
    pub(super) fn fill_in(&mut self, tooth_radius_mm: f64) {
        if let Self::Johnson { depth_mm } = self
            && Parameter::ToothRadius.check(tooth_radius_mm).is_none()
        {
            for depth_mm in [&mut depth_mm.wave_generator, &mut depth_mm.ring, &mut depth_mm.carrier] {
                depth_mm.get_or_insert(tooth_radius_mm);
            }
        }
    }
}
