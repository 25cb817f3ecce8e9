//! Materials, load and the model of load sharing.

use std::borrow::Cow;

use serde::de::value::MapAccessDeserializer;
use serde::de::{MapAccess, Visitor};
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use toothwave_solver::violation::Range;
use toothwave_solver::{Compatibility, ContactLaw, Material, Parameter, PerContact};
use utoipa::openapi::schema::{ObjectBuilder, OneOfBuilder, Schema, Type};
use utoipa::openapi::{Ref, RefOr};
use utoipa::{PartialSchema, ToSchema};

use super::drive::LengthsByContactDocument;
use super::number::given;
use crate::key::{Encode, Encoder, encoded};
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

/// The torque, at the wave generator or at the carrier, ring fixed, or a duty: exactly one of the three; and the stress that may be.
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
    /// The contact stress that the torque capacity is asked for, and above which a finding says so.
    #[serde(default, deserialize_with = "given", skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    pub allowable_stress_mpa: Option<AllowableStressDocument>,
    /// Speed of the wave generator; given `friction`, powers and sliding speeds follow from it. The points of a duty have their own.
    #[serde(default, deserialize_with = "given", skip_serializing_if = "Option::is_none")]
    #[schema(minimum = 1e-6, maximum = 1e6, nullable = false)]
    pub input_speed_rpm: Option<f64>,
    /// Several loads in turn, whose shares of the time add up to one.
    #[serde(default, deserialize_with = "given", skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false, min_items = 1, max_items = 100)]
    pub duty: Option<Vec<DutyPointDocument>>,
}

/// One load of a duty: exactly one torque, a speed, and how much of the running time it takes.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields, expecting = "an object")]
pub struct DutyPointDocument {
    /// Torque M0 at the wave generator.
    #[serde(default, deserialize_with = "given", skip_serializing_if = "Option::is_none")]
    #[schema(minimum = 1e-12, maximum = 1e15, nullable = false)]
    pub input_torque_nm: Option<f64>,
    /// Torque at the carrier, losses neglected.
    #[serde(default, deserialize_with = "given", skip_serializing_if = "Option::is_none")]
    #[schema(minimum = 1e-12, maximum = 1e15, nullable = false)]
    pub output_torque_nm: Option<f64>,
    /// Speed of the wave generator.
    #[schema(minimum = 1e-6, maximum = 1e6)]
    pub input_speed_rpm: f64,
    /// Share of the running time.
    #[schema(minimum = 1e-9, maximum = 1.0)]
    pub share_of_time: f64,
}

/// The stress that the contacts may have: one number for all, or one for each.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum AllowableStressDocument {
    /// For all.
    Everywhere(f64),
    /// For each.
    ByContact(StressByContactDocument),
}

/// A stress for each contact, in MPa.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields, expecting = "an object")]
pub struct StressByContactDocument {
    /// Between teeth and wave generator.
    #[schema(minimum = 1e-3, maximum = 1e6)]
    pub wave_generator: f64,
    /// Between teeth and ring.
    #[schema(minimum = 1e-3, maximum = 1e6)]
    pub ring: f64,
    /// Between teeth and carrier.
    #[schema(minimum = 1e-3, maximum = 1e6)]
    pub carrier: f64,
}

impl Serialize for AllowableStressDocument {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self {
            Self::Everywhere(stress_mpa) => serializer.serialize_f64(*stress_mpa),
            Self::ByContact(stresses) => stresses.serialize(serializer),
        }
    }
}

/// Told apart by what stands there, so that a fault keeps its place.
impl<'de> Deserialize<'de> for AllowableStressDocument {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct NumberOrObject;

        impl<'de> Visitor<'de> for NumberOrObject {
            type Value = AllowableStressDocument;

            fn expecting(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
                f.write_str("a number, or an object with one for each contact")
            }

            fn visit_f64<E>(self, stress_mpa: f64) -> Result<Self::Value, E> {
                Ok(AllowableStressDocument::Everywhere(stress_mpa))
            }

            fn visit_map<A: MapAccess<'de>>(self, fields: A) -> Result<Self::Value, A::Error> {
                let deserializer = MapAccessDeserializer::new(fields);
                StressByContactDocument::deserialize(deserializer).map(AllowableStressDocument::ByContact)
            }
        }

        deserializer.deserialize_any(NumberOrObject)
    }
}

impl PartialSchema for AllowableStressDocument {
    fn schema() -> RefOr<Schema> {
        let Range { low, high, .. } = Parameter::AllowableStress.range();
        let number = ObjectBuilder::new().schema_type(Type::Number).minimum(Some(low)).maximum(Some(high));
        OneOfBuilder::new()
            .description(Some("The stress that the contacts may have: one number for all, or one for each."))
            .item(number)
            .item(Ref::from_schema_name(StressByContactDocument::name()))
            .into()
    }
}

impl ToSchema for AllowableStressDocument {
    fn name() -> Cow<'static, str> {
        Cow::Borrowed("AllowableStress")
    }

    fn schemas(schemas: &mut Vec<(String, RefOr<Schema>)>) {
        schemas.push((StressByContactDocument::name().into(), StressByContactDocument::schema()));
    }
}

impl From<AllowableStressDocument> for PerContact<f64> {
    fn from(document: AllowableStressDocument) -> Self {
        match document {
            AllowableStressDocument::Everywhere(stress_mpa) => Self::of(|_| stress_mpa),
            AllowableStressDocument::ByContact(StressByContactDocument { wave_generator, ring, carrier }) => {
                Self { wave_generator, ring, carrier }
            }
        }
    }
}

/// A number or an object, never the one for the other.
impl Encode for AllowableStressDocument {
    fn encode(&self, encoder: &mut Encoder) {
        match self {
            Self::Everywhere(stress_mpa) => {
                encoder.byte(0);
                stress_mpa.encode(encoder);
            }
            Self::ByContact(stresses) => {
                encoder.byte(1);
                stresses.encode(encoder);
            }
        }
    }
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
    /// Whether the ring's teeth bend, the more the nearer to their tips they are pressed, with `virtual_work` alone. Left out, those of cylinders do where
    /// `stiffness` is left out too and the ring's tips are pointed or bored: elsewhere it hardly matters, and it takes time.
    #[serde(default, deserialize_with = "given", skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    pub ring_teeth_bend: Option<bool>,
    /// Whether the wave generator moves on under its teeth as it winds up, with `virtual_work` alone; otherwise its arms are those of the positions without
    /// load. Left out, it does where the ring's teeth bend because `ring_teeth_bend` is left out, and there are gaps.
    #[serde(default, deserialize_with = "given", skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    pub wave_generator_moves: Option<bool>,
    /// Whether teeth that come to a pointed or bored tip are pressed against its corner before they come to the flank, as elastic ones are, with `virtual_work`
    /// alone. They are listed then, up to the valley, and no stress of the ring is told of them. Left out, no teeth are; balls never.
    #[serde(default, deserialize_with = "given", skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    pub corner_contact: Option<bool>,
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
    struct MaterialsDocument { wave_generator, teeth, ring, carrier }
    struct MaterialDocument { youngs_modulus_gpa, poissons_ratio }
    struct LoadDocument { input_torque_nm, output_torque_nm, allowable_stress_mpa, input_speed_rpm, duty }
    struct DutyPointDocument { input_torque_nm, output_torque_nm, input_speed_rpm, share_of_time }
    struct StressByContactDocument { wave_generator, ring, carrier }
    struct ModelDocument { compatibility, stiffness, series_compliance_mm_per_n, ring_teeth_bend, wave_generator_moves, corner_contact, clearance }
    struct ClearanceDocument { wave_generator_um, ring_um, carrier_um }
    struct CompliancesDocument { wave_generator, ring, carrier }
    struct LinearDocument {}
    struct FixedDocument { wave_generator_n_per_mm, ring_n_per_mm, carrier_n_per_mm }
    struct PalmgrenDocument {}
    struct JohnsonDocument { depth_mm }
    struct HertzDocument {}
}

encoded!(enum CompatibilityDocument);
