//! Materials and load.

use std::borrow::Cow;

use serde::de::value::MapAccessDeserializer;
use serde::de::{MapAccess, Visitor};
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use toothwave_solver::violation::Range;
use toothwave_solver::{Material, Parameter, PerContact};
use utoipa::openapi::schema::{ObjectBuilder, OneOfBuilder, Schema, Type};
use utoipa::openapi::{Ref, RefOr};
use utoipa::{PartialSchema, ToSchema};

use super::number::given;
use crate::key::{Encode, Encoder, encoded};

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

encoded! {
    struct MaterialsDocument { wave_generator, teeth, ring, carrier }
    struct MaterialDocument { youngs_modulus_gpa, poissons_ratio }
    struct LoadDocument { input_torque_nm, output_torque_nm, allowable_stress_mpa, input_speed_rpm, duty }
    struct DutyPointDocument { input_torque_nm, output_torque_nm, input_speed_rpm, share_of_time }
    struct StressByContactDocument { wave_generator, ring, carrier }
}
