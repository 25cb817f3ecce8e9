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
    /// Compatibility: relation of the approaches at a tooth's contacts. Default: `virtual_work`.
    #[serde(default)]
    pub compatibility: CompatibilityDocument,
    /// Contact law. If left out: `hertz` for balls, `linear` for other teeth with `projection`, otherwise `johnson`.
    #[serde(default, deserialize_with = "given", skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    pub stiffness: Option<StiffnessDocument>,
    /// Compliance of the supports, in series with each contact, in mm/N. Needs `virtual_work`. Default: 0 mm/N.
    #[serde(default)]
    pub series_compliance_mm_per_n: CompliancesDocument,
    /// Refinements of the model. Need `virtual_work`. Default: `auto`.
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
    /// Use `clearance_um` of the `parts`. A gap at a contact is assigned to the part that the teeth touch there, unless
    /// `parts` already gives the same gap.
    #[serde(default, deserialize_with = "given", skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false, deprecated)]
    pub clearance: Option<ClearanceDocument>,
}

/// Uniform gaps along the normals, in µm. A tooth carries load only if they are closed.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields, default, expecting = "an object")]
pub struct ClearanceDocument {
    /// Gap at the wave generator, in µm. Default: 0 µm.
    #[schema(minimum = 0.0, maximum = 1e6, default = 0.0)]
    pub wave_generator_um: f64,
    /// Gap at the ring, in µm. Default: 0 µm.
    #[schema(minimum = 0.0, maximum = 1e6, default = 0.0)]
    pub ring_um: f64,
    /// Gap at the carrier, in µm. Default: 0 µm.
    #[schema(minimum = 0.0, maximum = 1e6, default = 0.0)]
    pub carrier_um: f64,
}

/// Compatibility: relation of the approaches at a tooth's contacts to the rotation of the wave generator.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum CompatibilityDocument {
    /// The paper's form: each approach projected on the direction of the wave generator's force.
    Projection,
    /// Virtual work: the frictionless solution for a tooth whose centre can move freely.
    #[default]
    VirtualWork,
}

/// Compliance for each contact, in mm/N.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields, default, expecting = "an object")]
pub struct CompliancesDocument {
    /// At the wave generator, in mm/N. Default: 0 mm/N.
    #[schema(minimum = 0.0, maximum = 1e3, default = 0.0)]
    pub wave_generator: f64,
    /// At the ring, in mm/N. Default: 0 mm/N.
    #[schema(minimum = 0.0, maximum = 1e3, default = 0.0)]
    pub ring: f64,
    /// At the carrier, in mm/N. Default: 0 mm/N.
    #[schema(minimum = 0.0, maximum = 1e3, default = 0.0)]
    pub carrier: f64,
}

union! {
    /// The contact law.
    pub enum StiffnessDocument as "Stiffness" by "law" read "by:law" {
        /// The paper's stiffness k = (π/2) L1 E* at each contact.
        Linear(LinearDocument) = "linear",
        /// Given stiffnesses.
        Fixed(FixedDocument) = "fixed",
        /// Palmgren's law for steel cylinders.
        Palmgren(PalmgrenDocument) = "palmgren",
        /// Johnson's law for line contacts.
        Johnson(JohnsonDocument) = "johnson",
        /// Hertz's law for balls.
        Hertz(HertzDocument) = "hertz",
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
    #[schema(minimum = 1e-3, maximum = 1e15)]
    pub wave_generator_n_per_mm: f64,
    /// Stiffness at the ring, in N/mm.
    #[schema(minimum = 1e-3, maximum = 1e15)]
    pub ring_n_per_mm: f64,
    /// Stiffness at the carrier, in N/mm.
    #[schema(minimum = 1e-3, maximum = 1e15)]
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

/// Name of a contact law.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum LawName {
    /// The paper's `k = π L1 E*/2`.
    Linear,
    /// Given stiffnesses.
    Fixed,
    /// Palmgren's law.
    Palmgren,
    /// Johnson's law.
    Johnson,
    /// Hertz's law.
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
