//! Wave generators that say where a tooth's centre is without a search: mesh and load follow from `d`, `T` and `T_ψ` alone (docs/theory.md sections 2.9 and 3).

use crate::cam::{Harmonic, HarmonicPath};

/// Where a tooth's centre stands.
#[derive(Clone, Copy)]
pub(super) struct Center {
    /// `d`.
    pub(super) radius_mm: f64,
    /// `T = tan γ`.
    pub(super) tan: f64,
    /// `T_ψ`.
    pub(super) tan_derivative: f64,
    /// `1/ρ_H`.
    pub(super) cam_curvature_per_mm: f64,
}

/// What tells the centre from the sine and the cosine of the phase `Uψ/2`.
pub(super) trait Centers: Copy {
    fn at(self, sin: f64, cos: f64) -> Center;
}

/// The circle of radius `R0` about a point e beside the axis: the centres run on the circle of radius `P0 = R0 + r` about it.
#[derive(Clone, Copy)]
pub(super) struct EccentricCenters {
    path_mm: f64,
    eccentricity_mm: f64,
    curvature_per_mm: f64,
}

impl EccentricCenters {
    /// Of a harmonic support with one lobe; of more lobes none.
    pub(super) fn new(cam: &Harmonic, tooth_radius_mm: f64) -> Option<Self> {
        cam.is_circle().then(|| Self {
            path_mm: cam.mean_radius_mm() + tooth_radius_mm,
            eccentricity_mm: cam.amplitude_mm(),
            curvature_per_mm: 1.0 / cam.mean_radius_mm(),
        })
    }
}

impl Centers for EccentricCenters {
    /// With `w = √(P0² - e² sin²ψ)`, the centre's distance from that point along the position: `d = w + e cos ψ`, `T = e sin ψ/w`,
    /// `T_ψ = e cos ψ P0²/w³`.
    #[inline(always)]
    fn at(self, sin: f64, cos: f64) -> Center {
        let Self { path_mm, eccentricity_mm: e, curvature_per_mm } = self;
        let (along, across) = (e * (cos * cos - sin * sin), e * (2.0 * (sin * cos)));
        let w2 = (path_mm - across) * (path_mm + across);
        let w = w2.sqrt();
        let per_w = 1.0 / w;
        Center {
            radius_mm: w + along,
            tan: across * per_w,
            tan_derivative: along * (path_mm * per_w) * (path_mm * per_w) * per_w,
            cam_curvature_per_mm: curvature_per_mm,
        }
    }
}

/// The path `d = R + e cos Uψ`.
#[derive(Clone, Copy)]
pub(super) struct HarmonicPathCenters {
    mean_radius_mm: f64,
    /// `e`, `eU` and `eU²`.
    amplitude_mm: f64,
    slope_mm: f64,
    bend_mm: f64,
    tooth_radius_mm: f64,
}

impl HarmonicPathCenters {
    pub(super) fn new(cam: &HarmonicPath, tooth_radius_mm: f64) -> Self {
        let (amplitude_mm, u) = (cam.amplitude_mm(), cam.lobe_count());
        Self {
            mean_radius_mm: cam.mean_radius_mm(),
            amplitude_mm,
            slope_mm: amplitude_mm * u,
            bend_mm: amplitude_mm * u * u,
            tooth_radius_mm,
        }
    }
}

impl Centers for HarmonicPathCenters {
    /// `T = eU sin(Uψ)/d`, `T_ψ = eU² cos(Uψ)/d + T²`, `1/ρ_H` from the path's curvature.
    #[inline(always)]
    fn at(self, sin: f64, cos: f64) -> Center {
        let (cos_of_lobe, sin_of_lobe) = (cos * cos - sin * sin, 2.0 * (sin * cos));
        let radius_mm = self.mean_radius_mm + self.amplitude_mm * cos_of_lobe;
        let per_radius = 1.0 / radius_mm;
        let tan = self.slope_mm * sin_of_lobe * per_radius;
        let tan_derivative = self.bend_mm * cos_of_lobe * per_radius + tan * tan;
        // κ_C = (1 + T² + T_ψ)/(d (1 + T²)^1.5), as a fraction whose parts make 1/ρ_H = κ_C/(1 - rκ_C) too.
        let square = 1.0 + tan * tan;
        let (above, below) = (square + tan_derivative, radius_mm * (square * square.sqrt()));
        let cam_curvature_per_mm = above / (below - self.tooth_radius_mm * above);
        Center { radius_mm, tan, tan_derivative, cam_curvature_per_mm }
    }
}
