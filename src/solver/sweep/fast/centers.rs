//! Wave generators other than ellipses. Mesh and load follow from `d`, `T` and `T_ψ` of the teeth's centres
//! (docs/explanation/theory.md sections 2.9 and 3).

use super::lanes::LANES;
use crate::cam::{Harmonic, HarmonicPath};

/// Largest number of Newton steps towards a normal. A drive that needs more uses the plain path.
const MAX_STEPS: u32 = 8;

/// A relative step this small is the last: the next would be proportional to its square.
const LAST_STEP: f64 = 1e-9;

/// Centres of a chunk of teeth.
pub(super) struct CenterLanes {
    /// `d`.
    pub(super) radius_mm: [f64; LANES],
    /// `T = tan γ`.
    pub(super) tan: [f64; LANES],
    /// `T_ψ`.
    pub(super) tan_derivative: [f64; LANES],
    /// `1/ρ_H`.
    pub(super) cam_curvature_per_mm: [f64; LANES],
}

impl CenterLanes {
    const ZERO: Self = {
        let column = [0.0; LANES];
        Self { radius_mm: column, tan: column, tan_derivative: column, cam_curvature_per_mm: column }
    };
}

/// Wave generators by their centres.
pub(super) enum Centers {
    /// A circle of radius `R0` at a distance e from the axis: a harmonic support with one lobe. The centres move on a
    /// circle of radius `P0 = R0 + r` about its centre.
    Eccentric(Harmonic),
    /// The support `h = R0 + e cos Uφ` with two lobes or more, whose normal `φ = ψ + γ` is computed iteratively.
    Harmonic(Harmonic),
    /// The path `d = R + e cos Uψ`.
    HarmonicPath(HarmonicPath),
}

impl Centers {
    /// Returns the centres of teeth of radius r from the sines and cosines of the phases `Uψ/2`; none if that takes too
    /// many steps.
    #[inline(always)]
    pub(super) fn at(&self, r: f64, sin: &[f64; LANES], cos: &[f64; LANES]) -> Option<CenterLanes> {
        match self {
            Self::Eccentric(cam) => Some(eccentric(cam, r, sin, cos)),
            Self::Harmonic(cam) => harmonic(cam, r, sin, cos),
            Self::HarmonicPath(cam) => Some(harmonic_path(cam, r, sin, cos)),
        }
    }
}

/// With `w = √(P0² - e² sin²ψ)`, the centre's distance from the circle's centre along the position:
/// `d = w + e cos ψ`, `T = e sin ψ/w`, `T_ψ = e cos ψ P0²/w³`.
#[inline(always)]
fn eccentric(cam: &Harmonic, r: f64, sin: &[f64; LANES], cos: &[f64; LANES]) -> CenterLanes {
    let (path_mm, e) = (cam.mean_radius_mm + r, cam.amplitude_mm);
    let curvature_per_mm = 1.0 / cam.mean_radius_mm;
    let mut lanes = CenterLanes::ZERO;
    for i in 0..LANES {
        let (along, across) = (e * (cos[i] * cos[i] - sin[i] * sin[i]), e * (2.0 * (sin[i] * cos[i])));
        let w = ((path_mm - across) * (path_mm + across)).sqrt();
        let per_w = 1.0 / w;
        let path = path_mm * per_w;
        lanes.radius_mm[i] = w + along;
        lanes.tan[i] = across * per_w;
        lanes.tan_derivative[i] = along * per_w * (path * path);
        lanes.cam_curvature_per_mm[i] = curvature_per_mm;
    }
    lanes
}

/// `T = eU sin(Uψ)/d`, `T_ψ = eU² cos(Uψ)/d + T²`, and the path's curvature
/// `κ_C = (1 + T² + T_ψ)/(d (1 + T²)^1.5)`. Its two factors also give `1/ρ_H = κ_C/(1 - rκ_C)`.
#[inline(always)]
fn harmonic_path(cam: &HarmonicPath, r: f64, sin: &[f64; LANES], cos: &[f64; LANES]) -> CenterLanes {
    let (mean_radius_mm, amplitude_mm, u) = (cam.mean_radius_mm, cam.amplitude_mm, cam.lobe_count());
    let (slope_mm, bend_mm) = (amplitude_mm * u, amplitude_mm * u * u);
    let mut lanes = CenterLanes::ZERO;
    for i in 0..LANES {
        let (cos_of_lobe, sin_of_lobe) = (cos[i] * cos[i] - sin[i] * sin[i], 2.0 * (sin[i] * cos[i]));
        let radius_mm = mean_radius_mm + amplitude_mm * cos_of_lobe;
        let per_radius = 1.0 / radius_mm;
        let tan = slope_mm * sin_of_lobe * per_radius;
        let tan_derivative = bend_mm * cos_of_lobe * per_radius + tan * tan;
        let square = 1.0 + tan * tan;
        let (above, below) = (square + tan_derivative, radius_mm * (square * square.sqrt()));
        lanes.radius_mm[i] = radius_mm;
        lanes.tan[i] = tan;
        lanes.tan_derivative[i] = tan_derivative;
        lanes.cam_curvature_per_mm[i] = above / (below - r * above);
    }
    lanes
}

/// Returns `sin Uφ` and `cos Uφ`, from those of `Uψ` and from `tan γ`, by the power U of `cos γ + i sin γ`.
#[inline(always)]
fn phases_of_normal(lobes: u32, of_lobe: &[[f64; LANES]; 2], tan: &[f64; LANES]) -> [[f64; LANES]; 2] {
    let (mut cos_gamma, mut sin_gamma) = ([0.0; LANES], [0.0; LANES]);
    for i in 0..LANES {
        cos_gamma[i] = 1.0 / (1.0 + tan[i] * tan[i]).sqrt();
        sin_gamma[i] = tan[i] * cos_gamma[i];
    }
    let [mut sin, mut cos] = *of_lobe;
    for _ in 0..lobes {
        for i in 0..LANES {
            let (s, c) = (sin[i], cos[i]);
            sin[i] = s * cos_gamma[i] + c * sin_gamma[i];
            cos[i] = c * cos_gamma[i] - s * sin_gamma[i];
        }
    }
    [sin, cos]
}

/// Newton's method for `T (P0 + e cos Uφ) = eU sin Uφ`. Then `ρ_H = R0 - e(U² - 1) cos Uφ` and
/// `T_ψ = (1 + T²)(T h' - h'')/(r + ρ_H)`.
#[inline(always)]
fn harmonic(cam: &Harmonic, r: f64, sin: &[f64; LANES], cos: &[f64; LANES]) -> Option<CenterLanes> {
    let (mean_radius_mm, e, u) = (cam.mean_radius_mm, cam.amplitude_mm, f64::from(cam.lobes));
    let path_mm = mean_radius_mm + r;
    let (mut of_lobe_sin, mut of_lobe_cos) = ([0.0; LANES], [0.0; LANES]);
    for i in 0..LANES {
        of_lobe_sin[i] = 2.0 * (sin[i] * cos[i]);
        of_lobe_cos[i] = cos[i] * cos[i] - sin[i] * sin[i];
    }
    let of_lobe = [of_lobe_sin, of_lobe_cos];
    let mut lanes = CenterLanes::ZERO;
    let mut is_found = false;
    // The first step starts at γ = 0.
    let mut phases = of_lobe;
    for _ in 0..MAX_STEPS {
        let mut largest = [0.0; LANES];
        let [sin, cos] = &phases;
        for i in 0..LANES {
            let (tan, above, lever) = (lanes.tan[i], path_mm + e * cos[i], e * u * sin[i]);
            let square = 1.0 + tan * tan;
            // Both sides are multiplied by the divisor of the derivative of their difference.
            let value = (tan * above - lever) * square;
            let slope = above * square - (tan * lever + e * u * u * cos[i]);
            let step = value / slope;
            lanes.tan[i] = tan - step;
            // Lanes beyond the last tooth may have any position.
            largest[i] = step.abs() - LAST_STEP * lanes.tan[i].abs();
        }
        phases = phases_of_normal(cam.lobes, &of_lobe, &lanes.tan);
        is_found = largest.iter().all(|&beyond| beyond <= 0.0);
        if is_found {
            break;
        }
    }
    if !is_found {
        return None;
    }
    let [sin, cos] = &phases;
    for i in 0..LANES {
        let (lever, along) = (e * u * sin[i], e * cos[i]);
        let above = path_mm + along;
        let tan = lever / above;
        let curvature_radius_mm = mean_radius_mm - (u * u - 1.0) * along;
        let all = 1.0 / (curvature_radius_mm * (r + curvature_radius_mm));
        lanes.radius_mm[i] = (above * above + lever * lever).sqrt();
        lanes.tan[i] = tan;
        lanes.tan_derivative[i] = (1.0 + tan * tan) * (tan * lever + u * u * along) * (all * curvature_radius_mm);
        lanes.cam_curvature_per_mm[i] = all * (r + curvature_radius_mm);
    }
    Some(lanes)
}
