//! Friction of the contacts.

use serde::{Deserialize, Serialize};
use toothwave_solver::losses::bearing::{BearingRating, RollingElement};
use toothwave_solver::losses::duty::LossParameters;
use toothwave_solver::losses::{Friction, FrictionParameters, RaceBearing, WaveGeneratorFriction};
use toothwave_solver::{Contact, Parameter, PerContact, Violation};
use utoipa::ToSchema;

use crate::union;

/// Coulomb friction at each contact.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields, expecting = "an object")]
pub struct FrictionDocument {
    /// Friction of the teeth on the wave generator or its race.
    pub wave_generator: WaveGeneratorFrictionDocument,
    /// Friction between teeth and ring.
    pub ring: CoefficientDocument,
    /// Friction between teeth and carrier.
    pub carrier: CoefficientDocument,
    /// Wear rates of the parts for Archard's law, in mm³/(N·m). If all are 0, as by default, wear is not calculated.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub wear_rate_mm3_per_nm: Option<WearRatesDocument>,
}

/// Wear rate for each part: volume lost at its contact with the teeth over force times sliding distance, in mm³/(N·m).
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields, default, expecting = "an object")]
pub struct WearRatesDocument {
    /// At the wave generator or its race, in mm³/(N·m). Default: 0.
    pub wave_generator: f64,
    /// At the ring, in mm³/(N·m). Default: 0.
    pub ring: f64,
    /// At the carrier, in mm³/(N·m). Default: 0.
    pub carrier: f64,
}

/// Friction of a contact.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields, expecting = "an object")]
pub struct CoefficientDocument {
    /// Coefficient of friction μ, from 0 to 1.
    pub coefficient: f64,
}

union! {
    /// Surface on which the teeth run at the wave generator.
    #[schema(as = WaveGeneratorFriction)]
    pub enum WaveGeneratorFrictionDocument by "kind" read "by:kind" {
        /// Friction of a contact.
        Plain {
            /// Coefficient of friction μ, from 0 to 1.
            coefficient: f64,
        },
        /// A race around the cam that rotates freely: a thin bearing, or the bearing that is the eccentric.
        Race {
            /// Coefficient of friction μ between teeth and race, from 0 to 1.
            coefficient: f64,
            /// Coefficient of friction μ_b of the bearing, from 0 to 1: friction torque over load times `bearing_radius_mm`.
            bearing_coefficient: f64,
            /// Radius R_b for the bearing's coefficient of friction, in mm.
            bearing_radius_mm: f64,
            /// Dynamic load rating C of the bearing, in N, for its life by ISO 281. Only for the bearing of an eccentric
            /// circle. Default: no life is calculated.
            #[serde(skip_serializing_if = "Option::is_none")]
            bearing_load_rating_n: Option<f64>,
            /// Rolling element of the bearing. Default: ball.
            #[serde(default)]
            bearing_element: RollingElement,
        },
        /// A race that is at rest relative to the carrier and does not slide on the teeth: the limit of a light bearing.
        Rolling {
            /// Allowed as for `race`, but without effect: such a race does not slide on the teeth.
            #[serde(skip_serializing_if = "Option::is_none")]
            coefficient: Option<f64>,
            /// Coefficient of friction μ_b of the bearing, from 0 to 1: friction torque over load times `bearing_radius_mm`.
            bearing_coefficient: f64,
            /// Radius R_b for the bearing's coefficient of friction, in mm.
            bearing_radius_mm: f64,
            /// Dynamic load rating C of the bearing, in N, for its life by ISO 281. Only for the bearing of an eccentric
            /// circle. Default: no life is calculated.
            #[serde(skip_serializing_if = "Option::is_none")]
            bearing_load_rating_n: Option<f64>,
            /// Rolling element of the bearing. Default: ball.
            #[serde(default)]
            bearing_element: RollingElement,
        },
    }
}

impl FrictionDocument {
    /// Returns the parameters of the losses, and adds their violations: also if a bearing has a rating and the wave
    /// generator is no eccentric circle.
    pub(super) fn loss_parameters(
        &self,
        is_eccentric: bool,
        violations: &mut Vec<Violation>,
    ) -> Option<LossParameters> {
        let (wear_rate_mm3_per_nm, bearing) = (self.wear_rate_mm3_per_nm(), self.bearing_rating());
        if let WaveGeneratorFrictionDocument::Rolling { coefficient: Some(unused), .. } = self.wave_generator {
            violations.extend(Parameter::FrictionCoefficient(Contact::WaveGenerator).check(unused));
        }
        for (contact, &rate) in wear_rate_mm3_per_nm.iter().flat_map(PerContact::iter) {
            violations.extend(Parameter::WearRate(contact).check(rate));
        }
        if let Some(bearing) = &bearing {
            violations.extend(Parameter::BearingLoadRating.check(bearing.dynamic_load_rating_n));
            if !is_eccentric {
                violations.push(Violation::conflict(
                    Parameter::BearingLoadRating,
                    "a bearing's life by ISO 281 follows from the load across an eccentric circle: lobes that are loaded alike leave none, and a race that they bend has another life",
                ));
            }
        }
        let friction = Friction::new(&self.into()).map_err(|found| violations.extend(found)).ok()?;
        Some(LossParameters { friction, wear_rate_mm3_per_nm, bearing })
    }

    /// The wear rates, where there are any.
    fn wear_rate_mm3_per_nm(&self) -> Option<PerContact<f64>> {
        let WearRatesDocument { wave_generator, ring, carrier } = *self.wear_rate_mm3_per_nm.as_ref()?;
        Some(PerContact { wave_generator, ring, carrier })
    }

    /// Returns the data for the life of the bearing, if a load rating is given.
    fn bearing_rating(&self) -> Option<BearingRating> {
        use WaveGeneratorFrictionDocument::{Plain, Race, Rolling};
        match self.wave_generator {
            Plain { .. } => None,
            Race { bearing_load_rating_n, bearing_element: element, .. }
            | Rolling { bearing_load_rating_n, bearing_element: element, .. } => {
                Some(BearingRating { dynamic_load_rating_n: bearing_load_rating_n?, element })
            }
        }
    }
}

impl From<&FrictionDocument> for FrictionParameters {
    fn from(document: &FrictionDocument) -> Self {
        use WaveGeneratorFrictionDocument::{Plain, Race, Rolling};
        let bearing = |coefficient, radius_mm| RaceBearing { coefficient, radius_mm };
        let wave_generator = match document.wave_generator {
            Plain { coefficient } => WaveGeneratorFriction::Plain { coefficient },
            Race { coefficient, bearing_coefficient, bearing_radius_mm, .. } => {
                WaveGeneratorFriction::Race { coefficient, bearing: bearing(bearing_coefficient, bearing_radius_mm) }
            }
            Rolling { bearing_coefficient, bearing_radius_mm, .. } => {
                WaveGeneratorFriction::Rolling { bearing: bearing(bearing_coefficient, bearing_radius_mm) }
            }
        };
        Self {
            wave_generator,
            ring_coefficient: document.ring.coefficient,
            carrier_coefficient: document.carrier.coefficient,
        }
    }
}
