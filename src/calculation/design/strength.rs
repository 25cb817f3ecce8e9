//! Strength of the carrier's material: a name, or numbers.

use std::sync::LazyLock;

use serde::{Serialize, Serializer};
use toothwave_solver::fingers::Strength;
use utoipa::openapi::schema::{ObjectBuilder, Type};

use crate::either;
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
}

impl Serialize for StrengthDocument {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self {
            Self::Named(preset) => serializer.serialize_str(preset.name),
            Self::Given(numbers) => numbers.serialize(serializer),
        }
    }
}

static NAMES: LazyLock<[&str; STRENGTHS.len()]> = LazyLock::new(|| STRENGTHS.map(|preset| preset.name));

either! {
    StrengthDocument as "Strength" (
        "Strength of the carrier's material: a name from `GET /v1/materials`, or numbers.",
        ObjectBuilder::new().schema_type(Type::String).enum_values(Some(*NAMES))
    ) expects "the name of a material, or an object with its strength":
    visit_str(name: &str) => {
        let preset = STRENGTHS.iter().find(|preset| preset.name == name);
        preset.map(Self::Value::Named).ok_or_else(|| E::unknown_variant(name, &*NAMES))
    },
    Strength => StrengthDocument::Given,
}
