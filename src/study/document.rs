//! The study document.

use std::collections::BTreeMap;

use serde::{Deserialize, Deserializer, Serialize, de};
use toothwave_calculation::design::Whole;
use toothwave_calculation::json::Tree;
use toothwave_calculation::{either, union};
use utoipa::ToSchema;

union! {
    /// Study document: a question about many variants of one design.
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
    pub enum StudyDocument by "study" read "by:study" {
        /// Map: quantities over one or several parameters.
        Map(MapDocument),
        /// Search: the best designs within limits.
        Search(SearchDocument),
        /// Sensitivity: the effect of each input on each quantity.
        Sensitivity(SensitivityDocument),
        /// Tolerance study: the effect of deviations on each quantity.
        Tolerance(ToleranceDocument),
    }
}

/// A design document without the fields that the study sets. It is read as a design only with these fields.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(transparent)]
pub struct Base(pub Tree);

impl utoipa::PartialSchema for Base {
    fn schema() -> utoipa::openapi::RefOr<utoipa::openapi::schema::Schema> {
        utoipa::openapi::ObjectBuilder::new()
            .schema_type(utoipa::openapi::schema::Type::Object)
            .description(Some("A design document. The study sets the fields that it varies."))
            .additional_properties(Some(utoipa::openapi::schema::AdditionalProperties::FreeForm(true)))
            .into()
    }
}

impl ToSchema for Base {}

impl<'de> Deserialize<'de> for Base {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        match Tree::deserialize(deserializer)? {
            object @ Tree::Object(_) => Ok(Self(object)),
            other => Err(de::Error::invalid_type(other.unexpected(), &"an object")),
        }
    }
}

/// Map: quantities over a grid of one or several parameters.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields, expecting = "an object")]
pub struct MapDocument {
    /// The design that is varied. Its values of the varied fields are ignored.
    pub base: Base,
    /// The varied fields, by JSON pointer into the design.
    pub over: BTreeMap<String, OverDocument>,
    /// Names of the quantities. Default: all quantities for which the base has the required fields.
    #[serde(default)]
    pub quantities: Vec<String>,
}

/// Values of a field in a map: a range with steps, or a list.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields, default, expecting = "an object")]
pub struct OverDocument {
    /// Smallest value.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub min: Option<f64>,
    /// Largest value.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub max: Option<f64>,
    /// Number of equidistant values, both ends included. Default for a whole number: every value.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(value_type = i64, minimum = 1, maximum = 1000000, required = false)]
    pub steps: Option<Whole>,
    /// List of values, instead of a range.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub one_of: Option<Vec<ChoiceDocument>>,
}

/// A value of a list: a word, a number, `true` or `false`.
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
        match Tree::deserialize(deserializer)? {
            Tree::Text(word) => Ok(Self::Word(word)),
            Tree::Number(number) => Ok(Self::Number(number)),
            Tree::Bool(flag) => Ok(Self::Flag(flag)),
            other => Err(de::Error::invalid_type(other.unexpected(), &"a word, a number, `true` or `false`")),
        }
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

/// Search: the best designs within limits.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields, expecting = "an object")]
pub struct SearchDocument {
    /// The design. Its values of the free fields are ignored. Default of `sweep.samples`: 16.
    pub base: Base,
    /// The free fields, by JSON pointer into the design. Default: derived from the limits on the transmission ratio and
    /// the outer diameter.
    #[serde(default)]
    pub free: BTreeMap<String, FreeDocument>,
    /// Limits on quantities, by name. Default: none, but a `finger_safety` of at least 1.5 if the base gives
    /// `parts.carrier.strength`; `"finger_safety": { "min": 0 }` removes it.
    #[serde(default)]
    pub require: BTreeMap<String, RequireDocument>,
    /// The objectives: one to four quantities that are minimised or maximised.
    pub objectives: Vec<ObjectiveDocument>,
    /// Approximate number of evaluated variants.
    #[serde(default = "default_evaluations")]
    #[schema(value_type = i64, minimum = 100, maximum = 100000000, default = 50000, required = false)]
    pub evaluations: Whole,
    /// Seed of the random numbers.
    #[serde(default = "default_seed")]
    #[schema(value_type = i64, minimum = 0, maximum = 9007199254740991_i64, default = 1, required = false)]
    pub seed: Whole,
    /// Designs that the search evaluates first. Each has a value for every free field; its other fields are ignored.
    #[serde(default)]
    #[schema(inline)] // Generators for C++ lose the type of a referenced map in a list.
    pub start: Vec<Base>,
}

/// Values of a free field: a range or a list.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields, default, expecting = "an object")]
pub struct FreeDocument {
    /// Smallest value.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub min: Option<f64>,
    /// Largest value.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub max: Option<f64>,
    /// List of values, instead of a range.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub one_of: Option<Vec<ChoiceDocument>>,
}

/// A limit on a quantity: a range with one or two ends or, for a flag, the required value.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
#[serde(untagged)]
#[schema(as = Require)]
pub enum RequireDocument {
    /// Required value of a flag.
    Flag(bool),
    /// Allowed range.
    Range(RangeDocument),
}

/// A range with one or two ends.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields, default, expecting = "an object")]
pub struct RangeDocument {
    /// Smallest allowed value.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub min: Option<f64>,
    /// Largest allowed value.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub max: Option<f64>,
}

either! {
    RequireDocument expects "`true`, `false` or an object with `min` or `max`":
    visit_bool(flag: bool) => Ok(RequireDocument::Flag(flag)),
    RangeDocument => RequireDocument::Range,
}

/// An objective: a quantity to minimise or maximise.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields, expecting = "an object")]
pub struct ObjectiveDocument {
    /// Name of the quantity.
    pub quantity: String,
    /// Direction.
    pub goal: Goal,
}

/// Direction of an objective.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum Goal {
    /// Minimise.
    Min,
    /// Maximise.
    Max,
}

/// Sensitivity study: the effect of each input on each quantity.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields, expecting = "an object")]
pub struct SensitivityDocument {
    /// The design.
    pub base: Base,
    /// The inputs, by JSON pointer into the design. Default: every nonzero number of `drive`, `materials` and `load`,
    /// their defaults included, except counts and time shares, each by 1 %.
    #[serde(default)]
    pub inputs: BTreeMap<String, InputDocument>,
    /// Names of the quantities. Default: all quantities for which the base has the required fields.
    #[serde(default)]
    pub quantities: Vec<String>,
}

/// Step of an input in both directions. Default: 1 % of its value.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields, default, expecting = "an object")]
pub struct InputDocument {
    /// Step in the unit of the input.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(exclusive_minimum = 0.0)]
    pub plus_minus: Option<f64>,
    /// Step as a fraction of the value, instead of `plus_minus`.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(exclusive_minimum = 0.0, maximum = 1.0)]
    pub relative: Option<f64>,
}

/// Tolerance study: the effect of deviations on each quantity.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields, expecting = "an object")]
pub struct ToleranceDocument {
    /// The design without deviations.
    pub base: Base,
    /// Deviations of single items, by their names in the design's `deviations`. Each item gets its own random value.
    /// For a runout the distribution applies to its two components, in µm.
    #[serde(default)]
    pub deviations: BTreeMap<String, DistributionDocument>,
    /// Deviations of a whole drive, by JSON pointer into the design. They are added to the base's value.
    #[serde(default)]
    pub inputs: BTreeMap<String, DistributionDocument>,
    /// Names of the quantities. Default: all quantities for which the base has the required fields.
    #[serde(default)]
    pub quantities: Vec<String>,
    /// Limits on quantities, by name. A drive is good if it meets all of them.
    #[serde(default)]
    pub require: BTreeMap<String, RequireDocument>,
    /// Number of random drives.
    #[serde(default = "default_samples")]
    #[schema(value_type = i64, minimum = 10, maximum = 100000000, default = 10000, required = false)]
    pub samples: Whole,
    /// Seed of the random numbers.
    #[serde(default = "default_seed")]
    #[schema(value_type = i64, minimum = 0, maximum = 9007199254740991_i64, default = 1, required = false)]
    pub seed: Whole,
}

/// Distribution of a deviation, centred at zero.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields, expecting = "an object")]
pub struct DistributionDocument {
    /// Kind of distribution.
    pub distribution: DistributionKind,
    /// Standard deviation of the normal distribution before truncation.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(exclusive_minimum = 0.0)]
    pub sigma: Option<f64>,
    /// Largest deviation: the normal distribution is truncated here, the uniform one ends here.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(exclusive_minimum = 0.0)]
    pub limit: Option<f64>,
}

/// A kind of distribution.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum DistributionKind {
    /// Normal with standard deviation `sigma`, truncated at `limit` if that is given.
    Normal,
    /// Uniform from `-limit` to `limit`.
    Uniform,
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
