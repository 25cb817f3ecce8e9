//! Load.

use std::borrow::Cow;

use serde::de::value::MapAccessDeserializer;
use serde::de::{MapAccess, Visitor};
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use toothwave_solver::PerContact;
use toothwave_solver::fingers::LoadCycle;
use utoipa::openapi::schema::{ObjectBuilder, OneOfBuilder, Schema, Type};
use utoipa::openapi::{Ref, RefOr};
use utoipa::{PartialSchema, ToSchema};

/// Load and allowable stress. The load is exactly one of: torque at the wave generator, torque at the carrier, or duty;
/// ring fixed.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields, expecting = "an object")]
pub struct LoadDocument {
    /// Torque M0 at the wave generator, in N·m.
    #[serde(default, deserialize_with = "toothwave_solver::given", skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    pub input_torque_nm: Option<f64>,
    /// Torque at the carrier, in N·m, without losses.
    #[serde(default, deserialize_with = "toothwave_solver::given", skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    pub output_torque_nm: Option<f64>,
    /// Allowable contact stress, in MPa, for the torque capacity. A finding reports if it is exceeded. Default: no
    /// torque capacity.
    #[serde(default, deserialize_with = "toothwave_solver::given", skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    pub allowable_stress_mpa: Option<AllowableStressDocument>,
    /// Speed of the wave generator, in 1/min. With `friction` it gives powers and sliding speeds. The points of a duty
    /// have their own speeds.
    #[serde(default, deserialize_with = "toothwave_solver::given", skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    pub input_speed_rpm: Option<f64>,
    /// Course of the load on the carrier's fingers, for their fatigue. Default: pulsating.
    #[serde(default)]
    pub cycle: LoadCycle,
    /// Load spectrum: one to 100 loads, whose shares of the running time add up to one.
    #[serde(default, deserialize_with = "toothwave_solver::given", skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    pub duty: Option<Vec<DutyPointDocument>>,
}

/// One load of a duty: exactly one torque, a speed, and a share of the running time.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields, expecting = "an object")]
pub struct DutyPointDocument {
    /// Torque M0 at the wave generator, in N·m.
    #[serde(default, deserialize_with = "toothwave_solver::given", skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    pub input_torque_nm: Option<f64>,
    /// Torque at the carrier, in N·m, without losses.
    #[serde(default, deserialize_with = "toothwave_solver::given", skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    pub output_torque_nm: Option<f64>,
    /// Speed of the wave generator, in 1/min.
    pub input_speed_rpm: f64,
    /// Share of the running time, from 0 to 1.
    pub share_of_time: f64,
}

/// Allowable contact stress, in MPa: one number for all contacts, or one for each.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum AllowableStressDocument {
    /// One stress for all contacts.
    Everywhere(f64),
    /// One stress for each contact.
    ByContact(StressByContactDocument),
}

/// Stress for each contact, in MPa.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields, expecting = "an object")]
pub struct StressByContactDocument {
    /// Between teeth and wave generator, in MPa.
    pub wave_generator: f64,
    /// Between teeth and ring, in MPa.
    pub ring: f64,
    /// Between teeth and carrier, in MPa.
    pub carrier: f64,
}

impl AllowableStressDocument {
    /// Returns one number for three equal ones.
    pub(super) fn normalised(self) -> Self {
        let PerContact { wave_generator, ring, carrier } = self.into();
        let is_one = [ring, carrier].iter().all(|stress_mpa| stress_mpa.total_cmp(&wave_generator).is_eq());
        if is_one { Self::Everywhere(ring) } else { self }
    }
}

impl Serialize for AllowableStressDocument {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self {
            Self::Everywhere(stress_mpa) => serializer.serialize_f64(*stress_mpa),
            Self::ByContact(stresses) => stresses.serialize(serializer),
        }
    }
}

/// Distinguishes number and object by the JSON type, so that an error keeps its location.
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
        OneOfBuilder::new()
            .description(Some("Allowable contact stress, in MPa: one number for all contacts, or one for each."))
            .item(ObjectBuilder::new().schema_type(Type::Number))
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
