//! The load on the wave generator's bearing and how long it lasts (docs/explanation/theory.md sections 4.9 and 10.5).

use std::f64::consts::PI;

use nalgebra::Vector2;

use crate::losses::{LoadedTooth, Mechanism};

/// What rolls in a bearing.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum RollingElement {
    /// Balls: life falls with the third power of the load.
    Ball,
    /// Rollers: with the power 10/3.
    Roller,
}

/// A load that a bearing bears for some of its turns.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LoadForRevolutions {
    /// The radial load.
    pub load_n: f64,
    /// How many revolutions, or what is in proportion to them.
    pub revolutions: f64,
}

impl RollingElement {
    /// `p` of the life equation.
    pub const fn life_exponent(self) -> f64 {
        match self {
            Self::Ball => 3.0,
            Self::Roller => 10.0 / 3.0,
        }
    }

    /// The constant load under which a bearing lasts as many revolutions as under these: `(Σ n F^p/Σ n)^(1/p)`.
    pub fn mean_load_n(self, loads: &[LoadForRevolutions]) -> f64 {
        let largest_n = loads.iter().map(|load| load.load_n).fold(0.0, f64::max);
        if largest_n <= 0.0 {
            return 0.0;
        }
        // Over the largest, so that no power leaves the range of doubles.
        let share = |load: &LoadForRevolutions| load.revolutions * (load.load_n / largest_n).powf(self.life_exponent());
        let revolutions: f64 = loads.iter().map(|load| load.revolutions).sum();
        largest_n * (loads.iter().map(share).sum::<f64>() / revolutions).powf(1.0 / self.life_exponent())
    }

    /// Basic rating life at 90 % reliability, `(C/P)^p` million revolutions (ISO 281), `P` a radial load and `C` the dynamic load rating;
    /// infinite without load.
    pub fn life_h(self, dynamic_load_rating_n: f64, mean_load_n: f64, speed_rpm: f64) -> f64 {
        1e6 * (dynamic_load_rating_n / mean_load_n).powf(self.life_exponent()) / (60.0 * speed_rpm)
    }
}

impl Mechanism {
    /// What the teeth's normal forces come to on the wave generator, in its frame, x along the middle of lobe 0: `-Σ F_H n(φ + 2πu/U)`
    /// over all teeth, which are those that the mesh lists (docs/explanation/theory.md section 4.9). Nothing where two lobes or more are loaded alike.
    pub fn radial_force_n(&self, teeth: &[LoadedTooth]) -> Vector2<f64> {
        if self.lobes_loaded_alike() > 1 {
            return Vector2::zeros();
        }
        teeth.iter().fold(Vector2::zeros(), |load, tooth| {
            // φ = ψ + γ
            let lobe_rad = 2.0 * PI * f64::from(tooth.lobe) / f64::from(self.lobes);
            let (sin, cos) = (tooth.position_rad + tooth.tan_pressure_angle.atan() + lobe_rad).sin_cos();
            load - tooth.force_n.wave_generator * Vector2::new(cos, sin)
        })
    }
}
