//! The model of load sharing.

use serde::{Deserialize, Serialize, Serializer};
use toothwave_solver::{Compatibility, PerContact};
use utoipa::ToSchema;
use utoipa::openapi::schema::{ObjectBuilder, Type};

use super::contact_law::StiffnessDocument;
use super::refinements::Refinements;
use crate::either;

/// The model of load sharing.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields, expecting = "an object")]
pub struct ModelDocument {
    /// Compatibility: relation of the approaches at a tooth's contacts. Default: `virtual_work`.
    #[serde(default)]
    pub compatibility: Compatibility,
    /// The contact law; the object names its `law`. Without the object: `hertz` for balls, `linear` for other teeth with
    /// `projection`, otherwise `johnson`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub stiffness: Option<StiffnessDocument>,
    /// Compliance of the supports, in series with each contact, in mm/N. Needs `virtual_work`. Default: 0 mm/N.
    #[serde(default)]
    pub series_compliance_mm_per_n: SeriesComplianceDocument,
    /// Which refinements the model has, with `virtual_work` alone.
    #[serde(default)]
    pub refinements: Refinements,
    /// Use `refinements`. Overrides it for `ring_teeth_bend`.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(deprecated)]
    pub ring_teeth_bend: Option<bool>,
    /// Use `refinements`. Overrides it for `wave_generator_moves`.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(deprecated)]
    pub wave_generator_moves: Option<bool>,
    /// Use `refinements`. Overrides it for `corner_contact`.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(deprecated)]
    pub corner_contact: Option<bool>,
    /// Use `clearance_um` of the `parts`. A gap at a contact is assigned to the part that the teeth touch there, unless
    /// `parts` already gives the same gap. A gap of 0 µm counts as left out.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(deprecated)]
    pub clearance: Option<ClearanceDocument>,
}

/// Uniform gaps along the normals, in µm. A tooth carries load only if they are closed.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields, default, expecting = "an object")]
pub struct ClearanceDocument {
    /// Gap at the wave generator, in µm. Default: 0 µm.
    #[schema(deprecated)]
    pub wave_generator_um: f64,
    /// Gap at the ring, in µm. Default: 0 µm.
    #[schema(deprecated)]
    pub ring_um: f64,
    /// Gap at the carrier, in µm. Default: 0 µm.
    #[schema(deprecated)]
    pub carrier_um: f64,
}

/// Compliance of the supports: numbers, or the estimates from the supports of the parts.
#[derive(Debug, Clone, PartialEq)]
pub enum SeriesComplianceDocument {
    /// The sweep's `series_compliance_estimates` for the supports in `parts`. A part without an estimate is rigid.
    Estimated,
    /// Numbers.
    Given(CompliancesDocument),
}

/// Compliance for each contact, in mm/N.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields, default, expecting = "an object")]
pub struct CompliancesDocument {
    /// At the wave generator, in mm/N. Default: 0 mm/N.
    pub wave_generator: f64,
    /// At the ring, in mm/N. Default: 0 mm/N.
    pub ring: f64,
    /// At the carrier, in mm/N. Default: 0 mm/N.
    pub carrier: f64,
}

/// The word that stands for the estimates.
const ESTIMATED: &str = "estimated";

impl SeriesComplianceDocument {
    /// The numbers, none of which stands for estimates.
    pub(crate) const fn given(&self) -> Option<PerContact<f64>> {
        match *self {
            Self::Estimated => None,
            Self::Given(CompliancesDocument { wave_generator, ring, carrier }) => {
                Some(PerContact { wave_generator, ring, carrier })
            }
        }
    }
}

impl Default for SeriesComplianceDocument {
    fn default() -> Self {
        Self::Given(CompliancesDocument::default())
    }
}

impl Serialize for SeriesComplianceDocument {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self {
            Self::Estimated => serializer.serialize_str(ESTIMATED),
            Self::Given(compliances) => compliances.serialize(serializer),
        }
    }
}

either! {
    SeriesComplianceDocument as "SeriesCompliance" (
        "Compliance of the support at each contact: numbers, or `estimated` for those of `series_compliance_estimates` whose parts are held so.",
        ObjectBuilder::new().schema_type(Type::String).enum_values(Some([ESTIMATED]))
    ) expects "`estimated`, or an object with a number for each contact":
    visit_str(word: &str) => match word {
        ESTIMATED => Ok(SeriesComplianceDocument::Estimated),
        _ => Err(E::unknown_variant(word, &[ESTIMATED])),
    },
    CompliancesDocument => SeriesComplianceDocument::Given,
}
