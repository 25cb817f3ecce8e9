//! The model of load sharing.

use serde::{Deserialize, Serialize};
use toothwave_solver::{Compatibility, ContactLaw, PerContact};
use utoipa::ToSchema;

use super::drive::LengthsByContactDocument;
use super::number::given;
use super::refinements::RefinementsDocument;
use crate::key::encoded;
use crate::union::union;

/// The model of load sharing.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields, expecting = "an object")]
pub struct ModelDocument {
    /// How the approaches at a tooth's contacts add up.
    #[serde(default)]
    pub compatibility: CompatibilityDocument,
    /// The contact law; left out, `hertz` of balls, of other teeth `johnson`, and `linear` beside `projection`.
    #[serde(default, deserialize_with = "given", skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    pub stiffness: Option<StiffnessDocument>,
    /// What stands behind each contact and gives way too, with `virtual_work` alone.
    #[serde(default)]
    pub series_compliance_mm_per_n: CompliancesDocument,
    /// Which refinements the model has, with `virtual_work` alone.
    #[serde(default)]
    pub refinements: RefinementsDocument,
    /// Use `refinements`. Overrides it for `ring_teeth_bend`.
    #[serde(default, deserialize_with = "given", skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false, deprecated)]
    pub ring_teeth_bend: Option<bool>,
    /// Use `refinements`. Overrides it for `wave_generator_moves`.
    #[serde(default, deserialize_with = "given", skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false, deprecated)]
    pub wave_generator_moves: Option<bool>,
    /// Use `refinements`. Overrides it for `corner_contact`.
    #[serde(default, deserialize_with = "given", skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false, deprecated)]
    pub corner_contact: Option<bool>,
    /// Use `clearance_um` of the `parts`. A gap at a contact is given to the part that the teeth touch there, unless its parts have the same gap already.
    #[serde(default, deserialize_with = "given", skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false, deprecated)]
    pub clearance: Option<ClearanceDocument>,
}

/// Uniform gaps along the normals: a tooth carries load only where they are closed.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields, default, expecting = "an object")]
pub struct ClearanceDocument {
    /// At the wave generator.
    #[schema(minimum = 0.0, maximum = 1e6, default = 0.0)]
    pub wave_generator_um: f64,
    /// At the ring.
    #[schema(minimum = 0.0, maximum = 1e6, default = 0.0)]
    pub ring_um: f64,
    /// At the carrier.
    #[schema(minimum = 0.0, maximum = 1e6, default = 0.0)]
    pub carrier_um: f64,
}

/// How the approaches at a tooth's contacts add up to the rotation of the wave generator.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum CompatibilityDocument {
    /// The paper's: each projected on the direction of the wave generator's force.
    Projection,
    /// Virtual work: the frictionless solution for a tooth whose centre is free to move.
    #[default]
    VirtualWork,
}

/// A compliance for each contact, in mm/N.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields, default, expecting = "an object")]
pub struct CompliancesDocument {
    /// At the wave generator.
    #[schema(minimum = 0.0, maximum = 1e3, default = 0.0)]
    pub wave_generator: f64,
    /// At the ring.
    #[schema(minimum = 0.0, maximum = 1e3, default = 0.0)]
    pub ring: f64,
    /// At the carrier.
    #[schema(minimum = 0.0, maximum = 1e3, default = 0.0)]
    pub carrier: f64,
}

union! {
    /// The contact law.
    pub enum StiffnessDocument as "Stiffness" by "law" read "by:law" {
        /// k = (π/2) L1 E* at each contact.
        Linear(LinearDocument) = "linear",
        /// Given stiffnesses.
        Fixed(FixedDocument) = "fixed",
        /// Palmgren's law.
        Palmgren(PalmgrenDocument) = "palmgren",
        /// Johnson's law.
        Johnson(JohnsonDocument) = "johnson",
        /// Hertz's law.
        Hertz(HertzDocument) = "hertz",
    }
}

/// k = (π/2) L1 E* at each contact: several times too stiff, but the paper's.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields, expecting = "an object")]
pub struct LinearDocument {}

/// Given stiffnesses at the wave generator, the ring and the carrier.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields, expecting = "an object")]
pub struct FixedDocument {
    /// At the wave generator.
    #[schema(minimum = 1e-3, maximum = 1e15)]
    pub wave_generator_n_per_mm: f64,
    /// At the ring.
    #[schema(minimum = 1e-3, maximum = 1e15)]
    pub ring_n_per_mm: f64,
    /// At the carrier.
    #[schema(minimum = 1e-3, maximum = 1e15)]
    pub carrier_n_per_mm: f64,
}

/// Palmgren's δ = 3.84e-5 F^0.9/L1^0.8 (N, mm), steel on steel.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields, expecting = "an object")]
pub struct PalmgrenDocument {}

/// The logarithmic approach of a cylinder between two bodies (Johnson, Contact Mechanics, section 5.6).
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields, expecting = "an object")]
pub struct JohnsonDocument {
    /// How deep below each contact the body stands still; left out, the tooth's radius.
    #[serde(default)]
    pub depth_mm: LengthsByContactDocument,
}

/// Hertz's law of point contacts, δ = q F^(2/3): that of balls.
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

/// A contact law.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum LawName {
    /// `k = π L1 E*/2`.
    Linear,
    /// Given stiffnesses.
    Fixed,
    /// Palmgren's.
    Palmgren,
    /// Johnson's.
    Johnson,
    /// Hertz's.
    Hertz,
}

impl From<ContactLaw> for LawName {
    fn from(law: ContactLaw) -> Self {
        match law {
            ContactLaw::Linear => Self::Linear,
            ContactLaw::Fixed(_) => Self::Fixed,
            ContactLaw::Palmgren => Self::Palmgren,
            ContactLaw::Johnson { .. } => Self::Johnson,
            ContactLaw::Hertz => Self::Hertz,
        }
    }
}

impl From<Compatibility> for CompatibilityDocument {
    fn from(compatibility: Compatibility) -> Self {
        match compatibility {
            Compatibility::Projection => Self::Projection,
            Compatibility::VirtualWork => Self::VirtualWork,
        }
    }
}

impl From<&CompliancesDocument> for PerContact<f64> {
    fn from(document: &CompliancesDocument) -> Self {
        let CompliancesDocument { wave_generator, ring, carrier } = *document;
        Self { wave_generator, ring, carrier }
    }
}

encoded! {
    struct ModelDocument {
        compatibility, stiffness, series_compliance_mm_per_n, refinements, ring_teeth_bend, wave_generator_moves, corner_contact, clearance
    }
    struct ClearanceDocument { wave_generator_um, ring_um, carrier_um }
    struct CompliancesDocument { wave_generator, ring, carrier }
    struct LinearDocument {}
    struct FixedDocument { wave_generator_n_per_mm, ring_n_per_mm, carrier_n_per_mm }
    struct PalmgrenDocument {}
    struct JohnsonDocument { depth_mm }
    struct HertzDocument {}
}

encoded!(enum CompatibilityDocument);
