//! Load and life of the wave generator's bearing (docs/explanation/theory.md sections 4.9 and 10.5).

use std::f64::consts::PI;

use nalgebra::Vector2;

use crate::cam::ToothCenter;
use crate::losses::{LoadedTooth, Mechanism};

/// Rolling element of a bearing. Its life falls with the third power of the load with balls, with the power 10/3 with
/// rollers.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "document", derive(serde::Serialize, serde::Deserialize, utoipa::ToSchema))]
#[cfg_attr(feature = "document", serde(rename_all = "snake_case"))]
pub enum RollingElement {
    /// Balls.
    #[default]
    Ball,
    /// Rollers.
    Roller,
}

/// Rating of the bearing that is the eccentric.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BearingRating {
    /// Dynamic load rating C.
    pub dynamic_load_rating_n: f64,
    /// Rolling element of the bearing.
    pub element: RollingElement,
}

/// Load and basic rating life (ISO 281, 90 % reliability, no factor for lubrication) of the bearing that is the eccentric.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "document", derive(serde::Serialize, utoipa::ToSchema))]
pub struct BearingLife {
    /// Constant radial load that gives the same life.
    pub mean_load_n: f64,
    /// Life in millions of revolutions of one ring relative to the other.
    pub life_million_revolutions: f64,
    /// Relative speed of the bearing's rings with the ring of the drive fixed, given a speed.
    #[cfg_attr(feature = "document", serde(skip_serializing_if = "Option::is_none"))]
    pub speed_rpm: Option<f64>,
    /// The life in hours, given a speed.
    #[cfg_attr(feature = "document", serde(skip_serializing_if = "Option::is_none"))]
    pub life_h: Option<f64>,
}

impl BearingRating {
    /// Returns the life under a mean load, in hours if the speed of its rings is known.
    pub fn life(&self, mean_load_n: f64, speed_rpm: Option<f64>) -> BearingLife {
        let life_h = |speed_rpm| self.element.life_h(self.dynamic_load_rating_n, mean_load_n, speed_rpm);
        BearingLife {
            mean_load_n,
            life_million_revolutions: 60.0 * 1e-6 * life_h(1.0),
            speed_rpm,
            life_h: speed_rpm.map(life_h),
        }
    }
}

impl RollingElement {
    /// Returns `p` of the life equation.
    pub const fn life_exponent(self) -> f64 {
        match self {
            Self::Ball => 3.0,
            Self::Roller => 10.0 / 3.0,
        }
    }

    /// Returns the constant load with the same life as these radial loads: `(Σ n F^p/Σ n)^(1/p)`. Each load
    /// has its number of revolutions, or any quantity proportional to it.
    pub fn mean_load_n(self, loads: &[(f64, f64)]) -> f64 {
        let largest_n = loads.iter().map(|&(load_n, _)| load_n).fold(0.0, f64::max);
        if largest_n <= 0.0 {
            return 0.0;
        }
        // Relative to the largest load, so that no power overflows or underflows.
        let share = |&(load_n, revolutions): &(f64, f64)| revolutions * (load_n / largest_n).powf(self.life_exponent());
        let revolutions: f64 = loads.iter().map(|&(_, revolutions)| revolutions).sum();
        largest_n * (loads.iter().map(share).sum::<f64>() / revolutions).powf(1.0 / self.life_exponent())
    }

    /// Returns the basic rating life at 90 % reliability, `(C/P)^p` million revolutions (ISO 281). `P` is a radial load
    /// and `C` the dynamic load rating. The life is infinite without load.
    pub fn life_h(self, dynamic_load_rating_n: f64, mean_load_n: f64, speed_rpm: f64) -> f64 {
        1e6 * (dynamic_load_rating_n / mean_load_n).powf(self.life_exponent()) / (60.0 * speed_rpm)
    }
}

impl Mechanism {
    /// Returns the resultant of the teeth's normal forces on the wave generator, in its frame with x along the middle
    /// of lobe 0: `-Σ F_H n(φ + 2πu/U)` over all teeth, which the mesh lists (docs/explanation/theory.md section 4.9).
    /// It is zero if two or more lobes carry the same load.
    pub fn radial_force_n(&self, teeth: &[LoadedTooth]) -> Vector2<f64> {
        if self.lobes_loaded_alike() > 1 {
            return Vector2::zeros();
        }
        teeth.iter().fold(Vector2::zeros(), |load, tooth| {
            // φ = ψ + γ
            let lobe_rad = 2.0 * PI * f64::from(tooth.lobe) / f64::from(self.drive.lobes());
            let ToothCenter { position, tan_pressure_angle, .. } = tooth.center;
            let (sin, cos) = (position.from_lobe_rad + tan_pressure_angle.atan() + lobe_rad).sin_cos();
            load - tooth.force_n.wave_generator * Vector2::new(cos, sin)
        })
    }
}
