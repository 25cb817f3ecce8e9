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

use crate::strengths::{STRENGTHS, StrengthPreset};

/// Strength of the carrier's material: a name from `GET /v1/materials`, or numbers.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum StrengthDocument {
    /// A material by name.
    Named(&'static StrengthPreset),
    /// Numbers.
    Given(Strength),
}

impl StrengthDocument {
    /// Returns the numbers.
    pub(super) const fn numbers(self) -> Strength {
        match self {
            Self::Named(preset) => Strength {
                yield_mpa: preset.yield_strength_mpa,
                tensile_mpa: preset.tensile_strength_mpa,
                endurance_mpa: preset.endurance_limit_mpa,
                is_hardened: preset.hardened,
            },
            Self::Given(strength) => strength,
        }
    }

    /// Returns the numbers with their parameters.
    pub(super) const fn parameters(&self) -> [(Parameter, f64); 3] {
        let Strength { yield_mpa, tensile_mpa, endurance_mpa, .. } = self.numbers();
        [
            (Parameter::YieldStrength, yield_mpa),
            (Parameter::TensileStrength, tensile_mpa),
            (Parameter::EnduranceLimit, endurance_mpa),
        ]
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
                Strength::deserialize(deserializer).map(StrengthDocument::Given)
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
            .item(Ref::from_schema_name(Strength::name()))
            .into()
    }
}

impl ToSchema for StrengthDocument {
    fn name() -> Cow<'static, str> {
        Cow::Borrowed("Strength")
    }

    fn schemas(schemas: &mut Vec<(String, RefOr<Schema>)>) {
        schemas.push((Strength::name().into(), Strength::schema()));
    }
}
