//! What toothwave is measured against: the same columns, computed as one would write them down first.
//!
//! They share the paper's case and the answer's form with toothwave and no code: linear law, projection, a ring with a regular tip.

pub(crate) mod dense;
pub(crate) mod newton;
pub(crate) mod paper;

use std::f64::consts::PI;

use toothwave_solver::{DriveParameters, Material, ToothShape, WaveGenerator};

/// The columns of a sweep in the order of the API: one entry a state, without the tooth number, which stands beside them.
pub(crate) const COLUMNS: [&str; 11] = [
    "input_angle_deg",
    "position_deg",
    "center_radius_mm",
    "wave_generator_angle_deg",
    "ring_angle_deg",
    "force_wave_generator_n",
    "force_ring_n",
    "force_carrier_n",
    "stress_wave_generator_mpa",
    "stress_ring_mpa",
    "stress_carrier_mpa",
];

/// A sweep's states.
#[derive(Debug, Clone, Default)]
pub(crate) struct Columns {
    pub(crate) tooth: Vec<i64>,
    pub(crate) values: [Vec<f64>; 11],
}

impl Columns {
    /// Empty, with room for a sweep.
    fn with_room(case: &Case, intervals: i64) -> Self {
        let most = usize::try_from((case.drive.installed / 4 + 1) * (intervals + 1)).unwrap_or(0);
        Self { tooth: Vec::with_capacity(most), values: std::array::from_fn(|_| Vec::with_capacity(most)) }
    }

    fn push(&mut self, tooth: i64, values: [f64; 11]) {
        self.tooth.push(tooth);
        for (column, value) in self.values.iter_mut().zip(values) {
            column.push(value);
        }
    }
}

/// A drive under load: its parameters and what follows from them once.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Case {
    pub(crate) drive: DriveParameters,
    pub(crate) material: Material,
    pub(crate) input_torque_nm: f64,
}

impl Case {
    /// `a` and `b`.
    fn semi_axes_mm(&self) -> [f64; 2] {
        match self.drive.wave_generator {
            WaveGenerator::Ellipse { semi_major_mm, semi_minor_mm } => [semi_major_mm, semi_minor_mm],
            other => unreachable!("the baselines know ellipses alone, not {other:?}"),
        }
    }

    /// `L1`.
    fn tooth_width_mm(&self) -> f64 {
        match self.drive.tooth {
            ToothShape::Cylinder { width_mm } => width_mm,
            other => unreachable!("the baselines know cylinders alone, not {other:?}"),
        }
    }

    /// `k = Z_K/U`.
    fn ring_teeth_per_wave(&self) -> f64 {
        self.drive.ring_teeth as f64 / 2.0
    }

    /// `Z_G/U`.
    fn teeth_per_wave(&self) -> f64 {
        self.drive.teeth as f64 / 2.0
    }

    /// `s = sign(Z_G - Z_K)`.
    fn sense(&self) -> f64 {
        (self.drive.teeth - self.drive.ring_teeth).signum() as f64
    }

    /// E* of the contact of two like materials.
    fn contact_modulus_mpa(&self) -> f64 {
        let Material { youngs_modulus_gpa, poissons_ratio } = self.material;
        1e3 * youngs_modulus_gpa / (2.0 * (1.0 - poissons_ratio * poissons_ratio))
    }

    /// `k = π L1 E*/2`, alike at the three contacts.
    fn stiffness_n_per_mm(&self) -> f64 {
        0.5 * PI * self.tooth_width_mm() * self.contact_modulus_mpa()
    }

    /// Hertz [8].
    fn stress_mpa(&self, force_n: f64, curvature_per_mm: f64) -> f64 {
        (force_n * curvature_per_mm * self.contact_modulus_mpa() / (PI * self.tooth_width_mm())).sqrt()
    }

    /// The columns of one tooth from its geometry and its three forces.
    fn row(&self, input_angle_deg: f64, tooth: &newton::Tooth, force_n: [f64; 3]) -> [f64; 11] {
        [
            input_angle_deg,
            90.0 - tooth.from_minor_rad.to_degrees(),
            tooth.center_radius_mm,
            tooth.cam_angle_rad.to_degrees(),
            tooth.ring_angle_rad.to_degrees(),
            force_n[0],
            force_n[1],
            force_n[2],
            self.stress_mpa(force_n[0], tooth.curvature_per_mm[0]),
            self.stress_mpa(force_n[1], tooth.curvature_per_mm[1]),
            self.stress_mpa(force_n[2], tooth.curvature_per_mm[2]),
        ]
    }

    /// The teeth of one zone that stand on the flank at an input angle, by number with their positions `x = π/2 - ψ`.
    fn teeth_at(&self, interval: i64, intervals: i64) -> impl Iterator<Item = (i64, f64)> {
        let steps = intervals * self.drive.installed;
        // Which teeth mesh is decided in whole numbers: in floating point the tooth on the tip comes and goes with the rounding.
        let on_flank = move |step: i64| 0 < step && 4 * step <= steps;
        (1..=(self.drive.installed / 4 + 1))
            .map(move |tooth| (tooth, tooth * intervals - interval))
            .filter(move |(_, step)| on_flank(*step))
            .map(move |(tooth, step)| (tooth, 0.5 * PI * (steps - 4 * step) as f64 / steps as f64))
    }

    fn input_angle_deg(&self, interval: i64, intervals: i64) -> f64 {
        let removal = (self.drive.teeth / self.drive.installed) as f64;
        360.0 * removal / self.drive.ring_teeth as f64 * (interval as f64 / intervals as f64)
    }
}
