//! Strength of the carrier's material: a name, or numbers.

use std::borrow::Cow;

use serde::de::value::MapAccessDeserializer;
use serde::de::{MapAccess, Visitor};
use serde::{Deserialize, Deserializer, Serialize, Serializer, de};
use toothwave_solver::Parameter;
use toothwave_solver::fingers::Strength;
use utoipa::openapi::schema::{ObjectBuilder, OneOfBuilder, Schema, Type};
use utoipa::openapi::{Ref, RefOr};
use utoipa::{PartialSchema, ToSchema};

use crate::key::{Encode, Encoder};
use crate::strengths::{STRENGTHS, StrengthPreset};

/// Strength of the carrier's material: a name from `GET /v1/materials`, or numbers.
#[derive(Debug, Clone, PartialEq)]
pub enum StrengthDocument {
    /// A material by name.
    Named(&'static StrengthPreset),
    /// Numbers.
    Given(StrengthNumbersDocument),
}

/// Strength of a material, in MPa.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields, expecting = "an object")]
pub struct StrengthNumbersDocument {
    /// Yield strength R_p0.2, in MPa.
    pub yield_strength_mpa: f64,
    /// Tensile strength R_m, in MPa.
    pub tensile_strength_mpa: f64,
    /// Endurance limit σ_W under reversed load, without a notch, in MPa.
    pub endurance_limit_mpa: f64,
    /// True if the material breaks at a notch before it yields there, as hardened steel does. Default: false.
    #[serde(default)]
    #[schema(default = false)]
    pub hardened: bool,
}

impl StrengthDocument {
    /// Returns the given numbers.
    pub(super) fn numbers(&self) -> impl Iterator<Item = (Parameter, f64)> + use<> {
        let numbers = match self {
            Self::Named(_) => None,
            Self::Given(numbers) => Some([
                (Parameter::YieldStrength, numbers.yield_strength_mpa),
                (Parameter::TensileStrength, numbers.tensile_strength_mpa),
                (Parameter::EnduranceLimit, numbers.endurance_limit_mpa),
            ]),
        };
        numbers.into_iter().flatten()
    }
}

impl From<&StrengthDocument> for Strength {
    fn from(document: &StrengthDocument) -> Self {
        let (yield_mpa, tensile_mpa, endurance_mpa, is_hardened) = match document {
            StrengthDocument::Named(preset) => {
                (preset.yield_strength_mpa, preset.tensile_strength_mpa, preset.endurance_limit_mpa, preset.hardened)
            }
            StrengthDocument::Given(numbers) => (
                numbers.yield_strength_mpa,
                numbers.tensile_strength_mpa,
                numbers.endurance_limit_mpa,
                numbers.hardened,
            ),
        };
        Self { yield_mpa, tensile_mpa, endurance_mpa, is_hardened }
    }
}

impl Serialize for StrengthDocument {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self {
            Self::Named(preset) => serializer.serialize_str(preset.name),
            Self::Given(numbers) => numbers.serialize(serializer),
        }
    }
}

/// Names of all strengths.
const NAMES: [&str; STRENGTHS.len()] = {
    let mut names = [""; STRENGTHS.len()];
    let mut at = 0;
    while at < names.len() {
        names[at] = STRENGTHS[at].name;
        at += 1;
    }
    names
};

/// Distinguishes name and object by the JSON type, so that an error keeps its location.
impl<'de> Deserialize<'de> for StrengthDocument {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct NameOrObject;

        impl<'de> Visitor<'de> for NameOrObject {
            type Value = StrengthDocument;

            fn expecting(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
                f.write_str("the name of a material, or an object with its strength")
            }

            fn visit_str<E: de::Error>(self, name: &str) -> Result<Self::Value, E> {
                const ALL: &[StrengthPreset] = &STRENGTHS;
                let preset = ALL.iter().find(|preset| preset.name == name);
                preset.map(StrengthDocument::Named).ok_or_else(|| E::unknown_variant(name, &NAMES))
            }

            fn visit_map<A: MapAccess<'de>>(self, fields: A) -> Result<Self::Value, A::Error> {
                let deserializer = MapAccessDeserializer::new(fields);
                StrengthNumbersDocument::deserialize(deserializer).map(StrengthDocument::Given)
            }
        }

        deserializer.deserialize_any(NameOrObject)
    }
}

impl PartialSchema for StrengthDocument {
    fn schema() -> RefOr<Schema> {
        OneOfBuilder::new()
            .description(Some("Strength of the carrier's material: a name from `GET /v1/materials`, or numbers."))
            .item(ObjectBuilder::new().schema_type(Type::String).enum_values(Some(NAMES)))
            .item(Ref::from_schema_name(StrengthNumbersDocument::name()))
            .into()
    }
}

impl ToSchema for StrengthDocument {
    fn name() -> Cow<'static, str> {
        Cow::Borrowed("Strength")
    }

    fn schemas(schemas: &mut Vec<(String, RefOr<Schema>)>) {
        schemas.push((StrengthNumbersDocument::name().into(), StrengthNumbersDocument::schema()));
    }
}

/// A name and its numbers give the same answers.
impl Encode for StrengthDocument {
    fn encode(&self, encoder: &mut Encoder) {
        let Strength { yield_mpa, tensile_mpa, endurance_mpa, is_hardened } = self.into();
        (yield_mpa, tensile_mpa, endurance_mpa, is_hardened).encode(encoder);
    }
}
