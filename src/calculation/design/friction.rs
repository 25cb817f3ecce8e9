//! Friction of the contacts.

use serde::{Deserialize, Serialize};
use toothwave_solver::losses::bearing::RollingElement;
use toothwave_solver::losses::{FrictionParameters, RaceBearing, WaveGeneratorFriction};
use toothwave_solver::{Contact, Parameter, PerContact, Violation};
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
    /// How fast the parts wear, by Archard's law; left out, it is not computed.
    #[serde(default, deserialize_with = "given", skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    pub wear_rate_mm3_per_nm: Option<WearRatesDocument>,
}

/// The volume that a part loses at its contact with the teeth, in mm³, over force times way of the slip, in N·m.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields, default, expecting = "an object")]
pub struct WearRatesDocument {
    /// Of the wave generator, or its race.
    #[schema(minimum = 0.0, maximum = 1e3, default = 0.0)]
    pub wave_generator: f64,
    /// Of the ring.
    #[schema(minimum = 0.0, maximum = 1e3, default = 0.0)]
    pub ring: f64,
    /// Of the carrier.
    #[schema(minimum = 0.0, maximum = 1e3, default = 0.0)]
    pub carrier: f64,
}

/// What rolls in a bearing: its life falls with the third power of the load with balls, with the power 10/3 with rollers.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum BearingElementDocument {
    /// Balls.
    #[default]
    Ball,
    /// Rollers.
    Roller,
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
    /// Dynamic load rating C of the bearing that is an eccentric circle: its life by ISO 281 is asked for.
    #[serde(default, deserialize_with = "given", skip_serializing_if = "Option::is_none")]
    #[schema(minimum = 1e-3, maximum = 1e12, nullable = false)]
    pub bearing_load_rating_n: Option<f64>,
    /// What rolls in it.
    #[serde(default)]
    pub bearing_element: BearingElementDocument,
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
    /// Dynamic load rating C of the bearing that is an eccentric circle: its life by ISO 281 is asked for.
    #[serde(default, deserialize_with = "given", skip_serializing_if = "Option::is_none")]
    #[schema(minimum = 1e-3, maximum = 1e12, nullable = false)]
    pub bearing_load_rating_n: Option<f64>,
    /// What rolls in it.
    #[serde(default)]
    pub bearing_element: BearingElementDocument,
}

/// What the life of a bearing follows from.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BearingRating {
    /// C.
    pub dynamic_load_rating_n: f64,
    /// What rolls.
    pub element: RollingElement,
}

impl FrictionDocument {
    /// The wear rates, where there are any.
    pub fn wear_rate_mm3_per_nm(&self) -> Option<PerContact<f64>> {
        let WearRatesDocument { wave_generator, ring, carrier } = *self.wear_rate_mm3_per_nm.as_ref()?;
        Some(PerContact { wave_generator, ring, carrier })
    }

    /// What the life of the bearing follows from, where it is asked for.
    pub fn bearing_rating(&self) -> Option<BearingRating> {
        let (rating_n, element) = match &self.wave_generator {
            WaveGeneratorFrictionDocument::Plain(_) => return None,
            WaveGeneratorFrictionDocument::Race(race) => (race.bearing_load_rating_n, race.bearing_element),
            WaveGeneratorFrictionDocument::Rolling(rolling) => (rolling.bearing_load_rating_n, rolling.bearing_element),
        };
        Some(BearingRating { dynamic_load_rating_n: rating_n?, element: element.into() })
    }

    /// What is out of its range beside friction itself: wear rates, the bearing's rating, and a coefficient that stands where nothing depends on
    /// it.
    pub(super) fn violations_beside(&self) -> Vec<Violation> {
        let rates = self.wear_rate_mm3_per_nm();
        let rates =
            rates.iter().flat_map(|rates| rates.iter().map(|(contact, &rate)| (Parameter::WearRate(contact), rate)));
        let rating = self.bearing_rating().map(|rating| (Parameter::BearingLoadRating, rating.dynamic_load_rating_n));
        let checked = rates.chain(rating).filter_map(|(parameter, value)| parameter.check(value));
        self.idle_violation().into_iter().chain(checked).collect()
    }

    /// The coefficient that stands where nothing depends on it, if it is out of its range.
    fn idle_violation(&self) -> Option<Violation> {
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
            Race(RaceDocument { coefficient, bearing_coefficient, bearing_radius_mm, .. }) => {
                WaveGeneratorFriction::Race {
                    coefficient,
                    bearing: RaceBearing { coefficient: bearing_coefficient, radius_mm: bearing_radius_mm },
                }
            }
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

impl From<BearingElementDocument> for RollingElement {
    fn from(document: BearingElementDocument) -> Self {
        match document {
            BearingElementDocument::Ball => Self::Ball,
            BearingElementDocument::Roller => Self::Roller,
        }
    }
}

encoded! {
    struct FrictionDocument { wave_generator, ring, carrier, wear_rate_mm3_per_nm }
    struct CoefficientDocument { coefficient }
    struct WearRatesDocument { wave_generator, ring, carrier }
    struct RaceDocument { coefficient, bearing_coefficient, bearing_radius_mm, bearing_load_rating_n, bearing_element }
    struct RollingDocument { coefficient, bearing_coefficient, bearing_radius_mm, bearing_load_rating_n, bearing_element }
}

encoded!(enum BearingElementDocument);
