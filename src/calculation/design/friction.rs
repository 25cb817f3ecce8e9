//! Friction of the contacts.

use serde::{Deserialize, Serialize};
use toothwave_solver::losses::{FrictionParameters, RaceBearing, WaveGeneratorFriction};
use toothwave_solver::{Contact, Parameter, Violation};
use utoipa::ToSchema;

use super::number::given;
use crate::key::encoded;
use crate::union::union;

/// Coulomb friction at each contact.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields, expecting = "an object")]
pub struct FrictionDocument {
    /// What the teeth run on.
    pub wave_generator: WaveGeneratorFrictionDocument,
    /// Between teeth and ring.
    pub ring: CoefficientDocument,
    /// Between teeth and carrier.
    pub carrier: CoefficientDocument,
}

/// Friction of a contact.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields, expecting = "an object")]
pub struct CoefficientDocument {
    /// Coefficient μ.
    #[schema(minimum = 0.0, maximum = 1.0)]
    pub coefficient: f64,
}

union! {
    /// What the teeth run on.
    pub enum WaveGeneratorFrictionDocument as "WaveGeneratorFriction" by "kind" read "by:kind" {
        /// The cam itself: teeth slide on it.
        Plain(CoefficientDocument) = "plain",
        /// A race around the cam, free to turn: a thin bearing, or the bearing that is the eccentric.
        Race(RaceDocument) = "race",
        /// A race that stands still against the carrier and does not rub on the teeth: the limit of a light bearing.
        Rolling(RollingDocument) = "rolling",
    }
}

/// A race around the cam, free to turn: a thin bearing, or the bearing that is the eccentric.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields, expecting = "an object")]
pub struct RaceDocument {
    /// Coefficient μ of teeth on the race.
    #[schema(minimum = 0.0, maximum = 1.0)]
    pub coefficient: f64,
    /// The bearing's friction couple over its load and radius.
    #[schema(minimum = 0.0, maximum = 1.0)]
    pub bearing_coefficient: f64,
    /// The radius that the bearing's coefficient belongs to.
    #[schema(minimum = 1e-6, maximum = 1e6)]
    pub bearing_radius_mm: f64,
}

/// A race that stands still against the carrier and does not rub on the teeth: the limit of a light bearing.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields, expecting = "an object")]
pub struct RollingDocument {
    /// May stand here as with `race`, but nothing depends on it: such a race does not rub on the teeth.
    #[serde(default, deserialize_with = "given", skip_serializing_if = "Option::is_none")]
    #[schema(minimum = 0.0, maximum = 1.0, nullable = false)]
    pub coefficient: Option<f64>,
    /// The bearing's friction couple over its load and radius.
    #[schema(minimum = 0.0, maximum = 1.0)]
    pub bearing_coefficient: f64,
    /// The radius that the bearing's coefficient belongs to.
    #[schema(minimum = 1e-6, maximum = 1e6)]
    pub bearing_radius_mm: f64,
}

impl FrictionDocument {
    /// The coefficient that stands where nothing depends on it, if it is out of its range.
    pub(super) fn idle_violation(&self) -> Option<Violation> {
        match &self.wave_generator {
            WaveGeneratorFrictionDocument::Rolling(RollingDocument { coefficient: Some(coefficient), .. }) => {
                Parameter::FrictionCoefficient(Contact::WaveGenerator).check(*coefficient)
            }
            _ => None,
        }
    }
}

impl From<&FrictionDocument> for FrictionParameters {
    fn from(document: &FrictionDocument) -> Self {
        use WaveGeneratorFrictionDocument::{Plain, Race, Rolling};
        let wave_generator = match document.wave_generator {
            Plain(CoefficientDocument { coefficient }) => WaveGeneratorFriction::Plain { coefficient },
            Race(RaceDocument { coefficient, bearing_coefficient, bearing_radius_mm }) => WaveGeneratorFriction::Race {
                coefficient,
                bearing: RaceBearing { coefficient: bearing_coefficient, radius_mm: bearing_radius_mm },
            },
            Rolling(RollingDocument { bearing_coefficient, bearing_radius_mm, .. }) => WaveGeneratorFriction::Rolling {
                bearing: RaceBearing { coefficient: bearing_coefficient, radius_mm: bearing_radius_mm },
            },
        };
        Self {
            wave_generator,
            ring_coefficient: document.ring.coefficient,
            carrier_coefficient: document.carrier.coefficient,
        }
    }
}

encoded! {
    struct FrictionDocument { wave_generator, ring, carrier }
    struct CoefficientDocument { coefficient }
    struct RaceDocument { coefficient, bearing_coefficient, bearing_radius_mm }
    struct RollingDocument { coefficient, bearing_coefficient, bearing_radius_mm }
}
