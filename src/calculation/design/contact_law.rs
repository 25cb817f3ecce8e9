//! The contact law. A law is a structure of its fields, a line of the union and an arm of each match.

use serde::{Deserialize, Serialize};
use toothwave_solver::{ContactLaw, Parameter, PerContact};
use utoipa::ToSchema;

use super::drive::LengthsByContactDocument;
use crate::union;

union! {
    /// The contact law.
    #[schema(as = Stiffness)]
    pub enum StiffnessDocument by "law" read "by:law" {
        /// The paper's stiffness k = (π/2) L1 E* at each contact.
        Linear(LinearDocument),
        /// Given stiffnesses.
        Fixed(FixedDocument),
        /// Palmgren's law for steel cylinders.
        Palmgren(PalmgrenDocument),
        /// Johnson's law for line contacts.
        Johnson(JohnsonDocument),
        /// Hertz's law for balls.
        Hertz(HertzDocument),
    }
}

/// The paper's stiffness k = (π/2) L1 E* at each contact, several times too high.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields, expecting = "an object")]
pub struct LinearDocument {}

/// Given stiffnesses at the wave generator, the ring and the carrier, in N/mm.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields, expecting = "an object")]
pub struct FixedDocument {
    /// Stiffness at the wave generator, in N/mm.
    pub wave_generator_n_per_mm: f64,
    /// Stiffness at the ring, in N/mm.
    pub ring_n_per_mm: f64,
    /// Stiffness at the carrier, in N/mm.
    pub carrier_n_per_mm: f64,
}

/// Palmgren's law δ = 3.84e-5 F^0.9/L1^0.8 (N, mm) for steel on steel.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields, expecting = "an object")]
pub struct PalmgrenDocument {}

/// Logarithmic approach of a cylinder between two bodies (Johnson, Contact Mechanics, section 5.6).
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields, expecting = "an object")]
pub struct JohnsonDocument {
    /// Depth below each contact at which the body is fixed, in mm. Default: the tooth's radius.
    #[serde(default)]
    pub depth_mm: LengthsByContactDocument,
}

/// Hertz's law of point contacts, δ = q F^(2/3), for balls.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields, expecting = "an object")]
pub struct HertzDocument {}

impl From<&StiffnessDocument> for ContactLaw {
    fn from(document: &StiffnessDocument) -> Self {
        match document {
            StiffnessDocument::Linear(_) => Self::Linear,
            StiffnessDocument::Palmgren(_) => Self::Palmgren,
            StiffnessDocument::Fixed(stiffness) => Self::Fixed(PerContact {
                wave_generator: stiffness.wave_generator_n_per_mm,
                ring: stiffness.ring_n_per_mm,
                carrier: stiffness.carrier_n_per_mm,
            }),
            StiffnessDocument::Johnson(JohnsonDocument { depth_mm }) => {
                Self::Johnson { depth_mm: depth_mm.by_contact() }
            }
            StiffnessDocument::Hertz(_) => Self::Hertz,
        }
    }
}

impl StiffnessDocument {
    /// Writes out the numbers that are left out. An impossible radius has its own error, so that it is not copied.
    pub(super) fn fill_in(&mut self, tooth_radius_mm: f64) {
        if let Self::Johnson(JohnsonDocument { depth_mm }) = self
            && Parameter::ToothRadius.check(tooth_radius_mm).is_none()
        {
            for depth_mm in [&mut depth_mm.wave_generator, &mut depth_mm.ring, &mut depth_mm.carrier] {
                depth_mm.get_or_insert(tooth_radius_mm);
            }
        }
    }
}
