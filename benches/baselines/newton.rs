//! Baseline (i): the formulas of docs/explanation/theory.md as they stand there, with a Newton solve and libm calls at each state.
//!
//! Angles count from the minor axis: `x = π/2 - ψ` and `χ = π/2 - φ`. A tooth there has no lever arm, and its stress is the square root of
//! what is left of one: counted from the major axis the stress on the tip is 4e-8 of its peak and not zero.

use super::{Case, Columns};

/// A tooth's geometry.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Tooth {
    /// x.
    pub(crate) from_minor_rad: f64,
    pub(crate) center_radius_mm: f64,
    pub(crate) cam_angle_rad: f64,
    pub(crate) ring_angle_rad: f64,
    /// |h'|.
    pub(crate) lever_arm_mm: f64,
    /// γ.
    pub(crate) cam_pressure_rad: f64,
    /// β.
    pub(crate) ring_pressure_rad: f64,
    /// Relative curvatures at cam, ring and slot.
    pub(crate) curvature_per_mm: [f64; 3],
}

/// The support function with its derivatives at a normal.
struct Support {
    h: f64,
    /// |h'|.
    first: f64,
    second: f64,
}

fn support(a: f64, b: f64, chi: f64) -> Support {
    let (sin, cos) = chi.sin_cos();
    let h = (a * a * sin * sin + b * b * cos * cos).sqrt();
    let first = (a * a - b * b) * sin * cos / h;
    let second = ((a * a - b * b) * (cos * cos - sin * sin) - first * first) / h;
    Support { h, first, second }
}

/// χ from `x = χ + atan(|h'|/(h + r))`, which is `ψ = φ + atan(h'/(h + r))`.
fn normal_rad(a: f64, b: f64, r: f64, from_minor_rad: f64) -> f64 {
    let mut chi = from_minor_rad;
    for _ in 0..50 {
        let Support { h, first, second } = support(a, b, chi);
        let residual = chi + (first / (h + r)).atan() - from_minor_rad;
        let slope = (h + r) * (h + r + second) / ((h + r) * (h + r) + first * first);
        let step = residual / slope;
        chi -= step;
        // Newton squares the error: what is left after so small a step is below the last digit.
        if step.abs() < 1e-9 {
            break;
        }
    }
    chi
}

impl Tooth {
    /// At the position x.
    pub(crate) fn at(case: &Case, from_minor_rad: f64) -> Self {
        let ([a, b], r) = (case.semi_axes_mm(), case.drive.tooth_radius_mm);
        let k = case.ring_teeth_per_wave();
        let chi = normal_rad(a, b, r, from_minor_rad);
        let Support { h, first, second } = support(a, b, chi);
        let center_radius_mm = (h + r).hypot(first);
        let tan_cam = first / (h + r);
        let cam_pressure_rad = tan_cam.atan();
        let ring_pressure_rad = (k * tan_cam).atan();
        let (sin, cos) = chi.sin_cos();
        let cam_angle_rad = (h * sin + first * cos).atan2(h * cos - first * sin);
        let (ring_sin, ring_cos) = ring_pressure_rad.sin_cos();
        let lead_rad = (r * ring_sin / (center_radius_mm + r * ring_cos)).atan();
        let position_slope = (h + r) * (h + r + second) / (center_radius_mm * center_radius_mm);
        let tan_slope = (first * first - second * (h + r)) / ((h + r) * (h + r)) / position_slope;
        let path_per_mm = ring_cos / center_radius_mm * (1.0 + k * k * tan_slope / (1.0 + k * k * tan_cam * tan_cam));
        Self {
            from_minor_rad,
            center_radius_mm,
            cam_angle_rad,
            ring_angle_rad: from_minor_rad / k - lead_rad,
            lever_arm_mm: first,
            cam_pressure_rad,
            ring_pressure_rad,
            curvature_per_mm: [1.0 / r + 1.0 / (h + second), 1.0 / (r * (1.0 + r * path_per_mm)), 1.0 / r],
        }
    }
}

/// The sweep.
pub(crate) fn sweep(case: &Case, intervals: i64) -> Columns {
    let stiffness = case.stiffness_n_per_mm();
    let mut columns = Columns::with_room(case, intervals);
    let mut teeth = Vec::new();
    for interval in 0..=intervals {
        teeth.clear();
        let mut torque_per_rad = 0.0;
        for (number, from_minor_rad) in case.teeth_at(interval, intervals) {
            let tooth = Tooth::at(case, from_minor_rad);
            let (gamma, beta, s) = (tooth.cam_pressure_rad, tooth.ring_pressure_rad, case.sense());
            let ring_ratio = gamma.cos() / beta.cos();
            let carrier_ratio = gamma.sin() * case.teeth_per_wave();
            // [3] with [7], over F_H.
            let compliance =
                (1.0 + ring_ratio * (gamma + s * beta).cos() + s * carrier_ratio * gamma.sin()) / stiffness;
            let force_per_rad = tooth.lever_arm_mm / compliance;
            torque_per_rad += 2.0 * force_per_rad * tooth.lever_arm_mm;
            teeth.push((number, tooth, [force_per_rad, force_per_rad * ring_ratio, force_per_rad * carrier_ratio]));
        }
        let rotation_rad = 1e3 * case.input_torque_nm / torque_per_rad;
        let input_angle_deg = case.input_angle_deg(interval, intervals);
        for (number, tooth, force_per_rad) in &teeth {
            columns.push(*number, case.row(input_angle_deg, tooth, force_per_rad.map(|force| force * rotation_rad)));
        }
    }
    columns
}
