//! The study document: what is asked, as it is read.

use std::collections::BTreeMap;

use serde::de::{self, MapAccess, Visitor};
use serde::{Deserialize, Deserializer, Serialize};
use toothwave_calculation::design::Whole;
use toothwave_calculation::json::Tree;
use utoipa::ToSchema;

/// A question about many variants of one design.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
#[serde(tag = "study", rename_all = "snake_case")]
#[schema(as = Study, example = json!({
    "study": "map",
    "base": {
        "drive": {
            "wave_generator": { "semi_major_mm": 58.0, "semi_minor_mm": 56.0 },
            "teeth": { "count": 28, "radius_mm": 5.0, "width_mm": 15.0 },
            "ring": { "teeth": 26 }
        },
        "load": { "input_torque_nm": 20.0 }
    },
    "over": { "/drive/teeth/radius_mm": { "min": 3.0, "max": 7.0, "steps": 5 } },
    "quantities": ["peak_stress_ring_mpa"]
}))]
pub enum StudyDocument {
    /// Quantities over one parameter or several.
    Map(MapDocument),
    /// The best designs within limits.
    Search(SearchDocument),
    /// What each input does to each quantity.
    Sensitivity(SensitivityDocument),
    /// What deviations do to each quantity.
    Tolerance(ToleranceDocument),
}

impl<'de> Deserialize<'de> for StudyDocument {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        #[derive(Deserialize)]
        #[serde(rename = "by:study")]
        enum Read {
            #[serde(rename = "map")]
            Map(MapDocument),
            #[serde(rename = "search")]
            Search(SearchDocument),
            #[serde(rename = "sensitivity")]
            Sensitivity(SensitivityDocument),
            #[serde(rename = "tolerance")]
            Tolerance(ToleranceDocument),
        }
        Ok(match Read::deserialize(deserializer)? {
            Read::Map(document) => Self::Map(document),
            Read::Search(document) => Self::Search(document),
            Read::Sensitivity(document) => Self::Sensitivity(document),
            Read::Tolerance(document) => Self::Tolerance(document),
        })
    }
}

/// A design document without what the study puts in. It is read as a design only then.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(transparent)]
pub struct Base(pub Tree);

impl utoipa::PartialSchema for Base {
    fn schema() -> utoipa::openapi::RefOr<utoipa::openapi::schema::Schema> {
        utoipa::openapi::ObjectBuilder::new()
            .schema_type(utoipa::openapi::schema::Type::Object)
            .description(Some("A design document without what the study puts in."))
            .additional_properties(Some(utoipa::openapi::schema::AdditionalProperties::FreeForm(true)))
            .into()
    }
}

impl ToSchema for Base {}

impl<'de> Deserialize<'de> for Base {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct AnyObject;
        impl<'de> Visitor<'de> for AnyObject {
            type Value = Tree;

            fn expecting(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
                f.write_str("an object")
            }

            fn visit_map<A: MapAccess<'de>>(self, mut entries: A) -> Result<Tree, A::Error> {
                let mut fields = Vec::new();
                while let Some(entry) = entries.next_entry::<String, Tree>()? {
                    fields.push(entry);
                }
                Ok(Tree::Object(fields))
            }
        }
        deserializer.deserialize_map(AnyObject).map(Self)
    }
}

/// Quantities over one parameter or several: a grid.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields, expecting = "an object")]
pub struct MapDocument {
    /// The design that is varied.
    pub base: Base,
    /// The fields that vary, by JSON pointer into the design.
    pub over: BTreeMap<String, OverDocument>,
    /// The quantities that are asked for, by name; all that the base has what they need for, where left out.
    #[serde(default)]
    pub quantities: Vec<String>,
}

/// The values of a field in a map: a range in steps, or a choice.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields, default, expecting = "an object")]
pub struct OverDocument {
    /// The least value.
    #[serde(deserialize_with = "given", skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    pub min: Option<f64>,
    /// The largest value.
    #[serde(deserialize_with = "given", skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    pub max: Option<f64>,
    /// So many values, equally far apart, both ends among them; of a whole number every one where left out.
    #[serde(deserialize_with = "given", skip_serializing_if = "Option::is_none")]
    #[schema(value_type = i64, minimum = 1, maximum = 1000000, required = false)]
    pub steps: Option<Whole>,
    /// Instead of a range these values.
    #[serde(deserialize_with = "given", skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    pub one_of: Option<Vec<ChoiceDocument>>,
}

/// A value of a choice: a word, a number, `true` or `false`.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
#[serde(untagged)]
#[schema(as = ChoiceValue)]
pub enum ChoiceDocument {
    /// A word, such as a `kind` or a `shape`.
    Word(String),
    /// A number.
    Number(f64),
    /// `true` or `false`.
    Flag(bool),
}

impl<'de> Deserialize<'de> for ChoiceDocument {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Any;
        impl Visitor<'_> for Any {
            type Value = ChoiceDocument;

            fn expecting(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
                f.write_str("a word, a number, `true` or `false`")
            }

            fn visit_str<E>(self, word: &str) -> Result<ChoiceDocument, E> {
                Ok(ChoiceDocument::Word(word.into()))
            }

            fn visit_f64<E>(self, number: f64) -> Result<ChoiceDocument, E> {
                Ok(ChoiceDocument::Number(number))
            }

            fn visit_bool<E>(self, flag: bool) -> Result<ChoiceDocument, E> {
                Ok(ChoiceDocument::Flag(flag))
            }
        }
        deserializer.deserialize_any(Any)
    }
}

impl From<&ChoiceDocument> for Tree {
    fn from(choice: &ChoiceDocument) -> Self {
        match choice {
            ChoiceDocument::Word(word) => Self::Text(word.clone()),
            ChoiceDocument::Number(number) => Self::Number(*number),
            ChoiceDocument::Flag(flag) => Self::Bool(*flag),
        }
    }
}

/// The best designs within limits.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields, expecting = "an object")]
pub struct SearchDocument {
    /// The design without what is free.
    pub base: Base,
    /// The fields that are free, by JSON pointer into the design. Left out, they follow from the limits on the transmission ratio and the
    /// outer diameter.
    #[serde(default)]
    pub free: BTreeMap<String, FreeDocument>,
    /// Limits on quantities, by name.
    #[serde(default)]
    pub require: BTreeMap<String, RequireDocument>,
    /// What is to be least or greatest: one to four quantities.
    pub objectives: Vec<ObjectiveDocument>,
    /// Variants that are looked at, about.
    #[serde(default = "default_evaluations")]
    #[schema(value_type = i64, minimum = 100, maximum = 100000000, default = 50000, required = false)]
    pub evaluations: Whole,
    /// What chance begins with.
    #[serde(default = "default_seed")]
    #[schema(value_type = i64, minimum = 0, maximum = 9007199254740991_i64, default = 1, required = false)]
    pub seed: Whole,
    /// Designs to begin with, each with a value for everything that is free: nothing else of it is read.
    #[serde(default)]
    pub start: Vec<Base>,
}

/// The values of a free field: a range, or a choice.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields, default, expecting = "an object")]
pub struct FreeDocument {
    /// The least value.
    #[serde(deserialize_with = "given", skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    pub min: Option<f64>,
    /// The largest value.
    #[serde(deserialize_with = "given", skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    pub max: Option<f64>,
    /// Instead of a range these values.
    #[serde(deserialize_with = "given", skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    pub one_of: Option<Vec<ChoiceDocument>>,
}

/// A limit on a quantity: a range of which one end may be left out, or, of a flag, what it has to be.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
#[serde(untagged)]
#[schema(as = Require)]
pub enum RequireDocument {
    /// Whether it has to be.
    Flag(bool),
    /// Where it has to lie.
    Range(RangeDocument),
}

/// A range of which one end may be left out.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields, default, expecting = "an object")]
pub struct RangeDocument {
    /// At least.
    #[serde(deserialize_with = "given", skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    pub min: Option<f64>,
    /// At most.
    #[serde(deserialize_with = "given", skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    pub max: Option<f64>,
}

impl<'de> Deserialize<'de> for RequireDocument {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct FlagOrRange;
        impl<'de> Visitor<'de> for FlagOrRange {
            type Value = RequireDocument;

            fn expecting(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
                f.write_str("`true`, `false` or an object with `min` or `max`")
            }

            fn visit_bool<E>(self, flag: bool) -> Result<RequireDocument, E> {
                Ok(RequireDocument::Flag(flag))
            }

            fn visit_map<A: MapAccess<'de>>(self, entries: A) -> Result<RequireDocument, A::Error> {
                RangeDocument::deserialize(de::value::MapAccessDeserializer::new(entries)).map(RequireDocument::Range)
            }
        }
        deserializer.deserialize_any(FlagOrRange)
    }
}

/// A quantity that is to be least or greatest.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields, expecting = "an object")]
pub struct ObjectiveDocument {
    /// Its name.
    pub quantity: String,
    /// Which of the two.
    pub goal: Goal,
}

/// Least or greatest.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum Goal {
    /// As small as can be.
    Min,
    /// As great as can be.
    Max,
}

/// What each input does to each quantity.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields, expecting = "an object")]
pub struct SensitivityDocument {
    /// The design.
    pub base: Base,
    /// The inputs, by JSON pointer into the design. Left out, every number of `drive`, `materials` and `load` but counts, shares of the time and
    /// zeros, by 1 %.
    #[serde(default)]
    pub inputs: BTreeMap<String, InputDocument>,
    /// The quantities that are asked for, by name; all that the base has what they need for, where left out.
    #[serde(default)]
    pub quantities: Vec<String>,
}

/// How far an input is moved either way; 1 % of its value where nothing is said.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields, default, expecting = "an object")]
pub struct InputDocument {
    /// So far, in the input's unit.
    #[serde(deserialize_with = "given", skip_serializing_if = "Option::is_none")]
    #[schema(exclusive_minimum = 0.0, nullable = false)]
    pub plus_minus: Option<f64>,
    /// Instead, by this share of its value.
    #[serde(deserialize_with = "given", skip_serializing_if = "Option::is_none")]
    #[schema(exclusive_minimum = 0.0, maximum = 1.0, nullable = false)]
    pub relative: Option<f64>,
}

/// What deviations do to each quantity.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields, expecting = "an object")]
pub struct ToleranceDocument {
    /// The design without deviations.
    pub base: Base,
    /// Deviations of single items, by their names in the design's `deviations`: each item has one of its own. Of a runout the distribution
    /// is that of its two components, in µm.
    #[serde(default)]
    pub deviations: BTreeMap<String, DistributionDocument>,
    /// What deviates in a whole drive, by JSON pointer into the design: added to the base's value.
    #[serde(default)]
    pub inputs: BTreeMap<String, DistributionDocument>,
    /// The quantities that are asked for, by name; all that the base has what they need for, where left out.
    #[serde(default)]
    pub quantities: Vec<String>,
    /// Limits on quantities, by name: a drive that keeps all of them is good.
    #[serde(default)]
    pub require: BTreeMap<String, RequireDocument>,
    /// Drives that are drawn.
    #[serde(default = "default_samples")]
    #[schema(value_type = i64, minimum = 10, maximum = 100000000, default = 10000, required = false)]
    pub samples: Whole,
    /// What chance begins with.
    #[serde(default = "default_seed")]
    #[schema(value_type = i64, minimum = 0, maximum = 9007199254740991_i64, default = 1, required = false)]
    pub seed: Whole,
}

/// How a deviation is distributed, around zero.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields, expecting = "an object")]
pub struct DistributionDocument {
    /// Its kind.
    pub distribution: DistributionKind,
    /// Standard deviation of the whole normal distribution.
    #[serde(default, deserialize_with = "given", skip_serializing_if = "Option::is_none")]
    #[schema(exclusive_minimum = 0.0, nullable = false)]
    pub sigma: Option<f64>,
    /// Nothing deviates further: the normal distribution is cut off here, the uniform one ends here.
    #[serde(default, deserialize_with = "given", skip_serializing_if = "Option::is_none")]
    #[schema(exclusive_minimum = 0.0, nullable = false)]
    pub limit: Option<f64>,
}

/// A kind of distribution.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum DistributionKind {
    /// Normal, of `sigma`, cut off at `limit` where that is given.
    Normal,
    /// Uniform from `-limit` to `limit`.
    Uniform,
}

/// For fields that may be left out but not be null.
fn given<'de, D: Deserializer<'de>, T: Deserialize<'de>>(deserializer: D) -> Result<Option<T>, D::Error> {
    T::deserialize(deserializer).map(Some)
}

const fn default_evaluations() -> Whole {
    Whole::of(50_000)
}

const fn default_samples() -> Whole {
    Whole::of(10_000)
}

const fn default_seed() -> Whole {
    Whole::of(1)
}
