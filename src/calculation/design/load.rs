//! Materials, load and the model of load sharing.

use serde::{Deserialize, Serialize};
use toothwave_solver::{ContactLaw, Material, PerContact};
use utoipa::ToSchema;

use super::drive::LengthsByContactDocument;
use super::number::given;
use crate::key::encoded;
use crate::union::union;

/// Materials by part.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields, default, expecting = "an object")]
pub struct MaterialsDocument {
    /// Of the wave generator.
    pub wave_generator: MaterialDocument,
    /// Of the teeth.
    pub teeth: MaterialDocument,
    /// Of the ring.
    pub ring: MaterialDocument,
    /// Of the carrier.
    pub carrier: MaterialDocument,
}

/// An isotropic elastic material.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields, default, expecting = "an object")]
pub struct MaterialDocument {
    /// Young's modulus E.
    #[schema(minimum = 1e-3, maximum = 1e5, default = 210.0)]
    pub youngs_modulus_gpa: f64,
    /// Poisson's ratio ν.
    #[schema(exclusive_minimum = -1.0, exclusive_maximum = 0.5, default = 0.3)]
    pub poissons_ratio: f64,
}

impl Default for MaterialDocument {
    fn default() -> Self {
        let Material { youngs_modulus_gpa, poissons_ratio } = Material::STEEL;
        Self { youngs_modulus_gpa, poissons_ratio }
    }
}

/// The torque: exactly one of the two, at the wave generator or at the carrier, ring fixed; and the stress that may be.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields, expecting = "an object")]
pub struct LoadDocument {
    /// Torque M0 at the wave generator.
    #[serde(default, deserialize_with = "given", skip_serializing_if = "Option::is_none")]
    #[schema(minimum = 1e-12, maximum = 1e15, nullable = false)]
    pub input_torque_nm: Option<f64>,
    /// Torque at the carrier, losses neglected.
    #[serde(default, deserialize_with = "given", skip_serializing_if = "Option::is_none")]
    #[schema(minimum = 1e-12, maximum = 1e15, nullable = false)]
    pub output_torque_nm: Option<f64>,
    /// The contact stress that the torque capacity is asked for.
    #[serde(default, deserialize_with = "given", skip_serializing_if = "Option::is_none")]
    #[schema(minimum = 1e-3, maximum = 1e6, nullable = false)]
    pub allowable_stress_mpa: Option<f64>,
    /// Speed of the wave generator; given `friction`, powers and sliding speeds follow from it.
    #[serde(default, deserialize_with = "given", skip_serializing_if = "Option::is_none")]
    #[schema(minimum = 1e-6, maximum = 1e6, nullable = false)]
    pub input_speed_rpm: Option<f64>,
}

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
    /// Gaps at the contacts; left out, there are none.
    #[serde(default, deserialize_with = "given", skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
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
        /// k = π L1 E*/2 at each contact.
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

/// k = π L1 E*/2 at each contact: several times too stiff, but the paper's.
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

impl From<&CompliancesDocument> for PerContact<f64> {
    fn from(document: &CompliancesDocument) -> Self {
        let CompliancesDocument { wave_generator, ring, carrier } = *document;
        Self { wave_generator, ring, carrier }
    }
}

encoded! {
    struct MaterialsDocument { wave_generator, teeth, ring, carrier }
    struct MaterialDocument { youngs_modulus_gpa, poissons_ratio }
    struct LoadDocument { input_torque_nm, output_torque_nm, allowable_stress_mpa, input_speed_rpm }
    struct ModelDocument { compatibility, stiffness, series_compliance_mm_per_n, clearance }
    struct ClearanceDocument { wave_generator_um, ring_um, carrier_um }
    struct CompliancesDocument { wave_generator, ring, carrier }
    struct LinearDocument {}
    struct FixedDocument { wave_generator_n_per_mm, ring_n_per_mm, carrier_n_per_mm }
    struct PalmgrenDocument {}
    struct JohnsonDocument { depth_mm }
    struct HertzDocument {}
}

encoded!(enum CompatibilityDocument);
