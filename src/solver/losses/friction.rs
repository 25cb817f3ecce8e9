//! Friction coefficients of the contacts, and how far first-order friction holds.

use super::Mechanism;
use crate::contact::PerContact;
use crate::violation::{Parameter, Violation};

/// Friction parameters of a drive, unchecked.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FrictionParameters {
    /// Surface that the teeth run on.
    pub wave_generator: WaveGeneratorFriction,
    /// `μ_K`: friction coefficient at the ring.
    pub ring_coefficient: f64,
    /// `μ_S`: friction coefficient at the carrier.
    pub carrier_coefficient: f64,
}

/// Surface that the teeth run on.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum WaveGeneratorFriction {
    /// The cam itself. Teeth slide on it.
    Plain {
        /// `μ_H`: friction coefficient at the wave generator.
        coefficient: f64,
    },
    /// A race around the cam that can turn: a thin bearing, or the bearing that is the eccentric.
    Race {
        /// `μ_H`: friction coefficient between teeth and race.
        coefficient: f64,
        /// Bearing that supports the race.
        bearing: RaceBearing,
    },
    /// A race at rest relative to the carrier, without friction on the teeth: the limit of a light bearing.
    Rolling {
        /// Bearing that supports the race.
        bearing: RaceBearing,
    },
}

/// Bearing between cam and race.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RaceBearing {
    /// `μ_b`: friction torque divided by load and radius.
    pub coefficient: f64,
    /// `R_b`: radius that the coefficient refers to.
    pub radius_mm: f64,
}

/// Checked friction parameters.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Friction(pub(super) FrictionParameters);

/// Possible difference between an efficiency and that of an exact equilibrium.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FirstOrderError {
    /// Largest error measured at such a loss and such coefficients.
    pub efficiency: f64,
    /// μ: largest coefficient.
    pub coefficient: f64,
    /// `μ_p`: largest possible friction along the wave generator as a whole.
    pub coefficient_along_cam: f64,
    /// True if the coefficients are in the measured range. Outside it the error is not a bound.
    pub is_within_measured_range: bool,
}

impl Friction {
    /// Checks the parameters.
    ///
    /// # Errors
    /// All values outside their ranges.
    pub fn new(parameters: &FrictionParameters) -> Result<Self, Vec<Violation>> {
        let friction = Self(*parameters);
        let coefficient = friction.coefficient();
        let contacts = coefficient.iter().map(|(contact, &value)| (Parameter::FrictionCoefficient(contact), value));
        let of_bearing = friction.bearing().into_iter().flat_map(|bearing| {
            [(Parameter::BearingCoefficient, bearing.coefficient), (Parameter::BearingRadius, bearing.radius_mm)]
        });
        let violations: Vec<_> =
            contacts.chain(of_bearing).filter_map(|(parameter, value)| parameter.check(value)).collect();
        if violations.is_empty() { Ok(friction) } else { Err(violations) }
    }

    /// Returns `μ_c`; none if the race has no friction on the teeth.
    fn coefficient(&self) -> PerContact<f64> {
        let wave_generator = match self.0.wave_generator {
            WaveGeneratorFriction::Plain { coefficient } | WaveGeneratorFriction::Race { coefficient, .. } => {
                coefficient
            }
            WaveGeneratorFriction::Rolling { .. } => 0.0,
        };
        PerContact { wave_generator, ring: self.0.ring_coefficient, carrier: self.0.carrier_coefficient }
    }

    /// Returns the bearing between cam and race, if there is one.
    pub const fn bearing(&self) -> Option<RaceBearing> {
        match self.0.wave_generator {
            WaveGeneratorFriction::Plain { .. } => None,
            WaveGeneratorFriction::Race { bearing, .. } | WaveGeneratorFriction::Rolling { bearing } => Some(bearing),
        }
    }

    /// Returns `μ_c F_c`.
    pub(super) fn limit_n(&self, force_n: &PerContact<f64>) -> PerContact<f64> {
        let coefficient = self.coefficient();
        PerContact::of(|contact| coefficient.get(contact) * force_n.get(contact))
    }

    /// Returns the error of an efficiency at the loss ℓ against an exact equilibrium with Coulomb friction: `(C μ + 10
    /// μ_p) ℓ`. μ is the largest coefficient and `μ_p` the largest possible friction along the wave generator as a
    /// whole. On a race `μ_p` is at most the bearing's friction. C and the ranges were measured
    /// (docs/explanation/theory.md section 10.6, `tests/reference/friction.py ranges`).
    pub fn first_order_error(&self, mechanism: &Mechanism, loss_share: f64) -> FirstOrderError {
        let of_bearing =
            self.bearing().map_or(0.0, |bearing| bearing.coefficient * bearing.radius_mm / mechanism.race_radius_mm());
        let coefficient = self.coefficient();
        let largest = coefficient.iter().map(|(_, &coefficient)| coefficient).fold(of_bearing, f64::max);
        let on_race = if mechanism.tooth_spins { ERROR_ON_RACE } else { ERROR_ON_RACE_WITHOUT_SPIN };
        let (share, along) = match self.0.wave_generator {
            WaveGeneratorFriction::Plain { .. } => (0.0, largest),
            WaveGeneratorFriction::Race { coefficient, .. } => (on_race, coefficient.min(of_bearing)),
            WaveGeneratorFriction::Rolling { .. } => (on_race, 0.0),
        };
        FirstOrderError {
            efficiency: (share * largest + ERROR_ALONG_CAM * along) * loss_share,
            coefficient: largest,
            coefficient_along_cam: along,
            is_within_measured_range: largest <= MEASURED_TO && along <= MEASURED_TO_ALONG_CAM,
        }
    }
}

/// Error of an efficiency, divided by μℓ, from friction along the cam as a whole.
const ERROR_ALONG_CAM: f64 = 10.0;

/// The same from the friction of each single tooth. It is visible on a race, where the cam has no drag.
const ERROR_ON_RACE: f64 = 2.5;

/// The same for teeth that cannot spin.
const ERROR_ON_RACE_WITHOUT_SPIN: f64 = 9.5;

/// Largest measured coefficient.
pub const MEASURED_TO: f64 = 0.1;

/// Largest measured friction along the cam.
pub const MEASURED_TO_ALONG_CAM: f64 = 0.05;

impl RaceBearing {
    /// Returns `D = μ_b R_b ΣF_H/R_race`, the bearing's friction force along the race.
    pub(super) fn drag_n(&self, load_n: f64, race_radius_mm: f64) -> f64 {
        self.coefficient * self.radius_mm * load_n / race_radius_mm
    }
}
