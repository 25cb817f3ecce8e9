//! Support function `h = R0 + e cos Uφ`. With one lobe it is exactly the circle of radius R0 about a point at the
//! distance e from the axis (docs/explanation/theory.md section 2.9).

use crate::cam::kind::{Direction, Kind, ToothCenter};
use crate::position::{Position, half_lobe_rad};
use crate::root::{NotConverged, ValueAndSlope, newton_in_bracket};

/// A cam with a harmonic support function.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Harmonic {
    pub(crate) lobes: u32,
    /// `R0`.
    pub(crate) mean_radius_mm: f64,
    /// `e`.
    pub(crate) amplitude_mm: f64,
    pub(crate) tooth_radius_mm: f64,
}

impl Harmonic {
    /// Returns the lower bound of R0: e, so that the axis is inside, and `e(U² - 1)`, so that the lobe is round.
    pub(super) fn least_mean_radius_mm(&self) -> f64 {
        self.amplitude_mm * self.bluntness().max(1.0)
    }

    /// Returns `U² - 1`.
    fn bluntness(&self) -> f64 {
        let u = self.lobe_count();
        (u - 1.0) * (u + 1.0)
    }

    /// Returns true if the cam is the eccentric circle.
    pub(crate) const fn is_circle(&self) -> bool {
        self.lobes == 1
    }

    fn lobe_count(&self) -> f64 {
        f64::from(self.lobes)
    }

    /// Returns `P0 = R0 + r`.
    fn mean_path_mm(&self) -> f64 {
        self.mean_radius_mm + self.tooth_radius_mm
    }

    /// Returns the tooth for half the phase `Uφ` of its normal, a quarter turn from lobe to valley.
    fn center(&self, position: Position, phase: Direction) -> ToothCenter {
        let (u, e) = (self.lobe_count(), self.amplitude_mm);
        let (cos_squared, sin_squared) = (phase.cos * phase.cos, phase.sin * phase.sin);
        let cos = cos_squared - sin_squared;
        // R0 - e(U² - 1) cos Uφ, starting with the difference that is small at a sharp lobe.
        let at_lobe_mm = self.mean_radius_mm - e * self.bluntness();
        ToothCenter::by_support(
            position,
            self.tooth_radius_mm,
            self.mean_radius_mm + e * cos,
            2.0 * e * u * (phase.sin * phase.cos),
            -e * u * u * cos,
            at_lobe_mm + 2.0 * e * self.bluntness() * sin_squared,
        )
    }

    /// Returns `1 - cos Uφ` and `1 + cos Uφ`, each to full relative precision. The small one follows from `sin Uφ`,
    /// which is in the lever arm.
    fn versed(&self, tooth: &ToothCenter) -> (f64, f64) {
        let sin = tooth.lever_arm_mm / (self.amplitude_mm * self.lobe_count());
        let cos = (self.lobe_count() * tooth.normal_rad()).cos();
        let sin_squared = sin * sin;
        if sin_squared > 0.5 {
            return (1.0 - cos, 1.0 + cos);
        }
        let small = sin_squared / (1.0 + (1.0 - sin_squared).sqrt());
        if cos > 0.0 { (small, 2.0 - small) } else { (2.0 - small, small) }
    }

    /// Returns `γ` and `dγ/dφ` for a normal at `angle_rad` from a lobe (`towards` = 1) or a valley (-1):
    /// `tan γ = eU sin/(P0 ± e cos)`.
    fn pressure_angle(&self, angle_rad: f64, towards: f64) -> ValueAndSlope {
        let (u, e) = (self.lobe_count(), self.amplitude_mm);
        let (sin, cos) = (u * angle_rad).sin_cos();
        let lever_mm = e * u * sin;
        let above_mm = self.mean_path_mm() + towards * e * cos;
        let squared_mm2 = above_mm * above_mm + lever_mm * lever_mm;
        ValueAndSlope {
            value: lever_mm.atan2(above_mm),
            slope: (e * u * u * cos * above_mm + towards * lever_mm * lever_mm) / squared_mm2,
        }
    }

    /// Solves for the normal's angle from the lobe, `φ - γ = ψ`, or, in the outer half, its angle y from the valley,
    /// `y + γ = x`.
    fn normal_phase(&self, position: Position) -> Result<Direction, NotConverged> {
        const WHAT: &str = "normal of the cam at a tooth";
        if position.phase_sin == 0.0 || position.phase_cos == 0.0 {
            return Ok(Direction { cos: position.phase_cos, sin: position.phase_sin });
        }
        let (u, half_rad) = (self.lobe_count(), half_lobe_rad(self.lobes));
        let middle_rad = 0.5 * half_rad;
        if position.from_lobe_rad < middle_rad - self.pressure_angle(middle_rad, 1.0).value {
            let psi = position.from_lobe_rad;
            let guess_rad = psi + self.pressure_angle(psi, 1.0).value;
            let normal_rad = newton_in_bracket(WHAT, psi, middle_rad, guess_rad, |phi| {
                let gamma = self.pressure_angle(phi, 1.0);
                ValueAndSlope { value: (phi - psi) - gamma.value, slope: 1.0 - gamma.slope }
            })?;
            let (sin, cos) = (0.5 * u * normal_rad).sin_cos();
            Ok(Direction { cos, sin })
        } else {
            let x = position.from_valley_rad;
            // γ is at most eU² y over the least value of the denominator.
            let e = self.amplitude_mm;
            let low = x / (1.0 + e * u * u / (self.mean_path_mm() - e));
            let normal_rad = newton_in_bracket(WHAT, low.min(x), x, low, |y| {
                let gamma = self.pressure_angle(y, -1.0);
                ValueAndSlope { value: (y - x) + gamma.value, slope: 1.0 + gamma.slope }
            })?;
            let (cos, sin) = (0.5 * u * normal_rad).sin_cos();
            Ok(Direction { cos, sin })
        }
    }
}

impl Kind for Harmonic {
    fn lobes(&self) -> u32 {
        self.lobes
    }

    fn tooth_radius_mm(&self) -> f64 {
        self.tooth_radius_mm
    }

    fn at(&self, position: Position) -> Result<ToothCenter, NotConverged> {
        Ok(self.center(position, self.normal_phase(position)?))
    }

    /// At `cos Uφ = -e/P0`.
    fn steepest(&self) -> Result<ToothCenter, NotConverged> {
        let share = self.amplitude_mm / self.mean_path_mm();
        let phase = Direction { cos: (0.5 * (1.0 - share)).sqrt(), sin: (0.5 * (1.0 + share)).sqrt() };
        let unplaced = self.center(Position::lobe(self.lobes), phase);
        let gamma_rad = unplaced.tan_pressure_angle.atan();
        let from_lobe_rad = 2.0 / self.lobe_count() * phase.sin.atan2(phase.cos) - gamma_rad;
        let from_valley_rad = 2.0 / self.lobe_count() * phase.cos.atan2(phase.sin) + gamma_rad;
        let position = Position::between(from_lobe_rad, from_valley_rad, self.lobes);
        Ok(ToothCenter { position, ..unplaced })
    }

    fn cam_outer_radius_mm(&self) -> f64 {
        self.mean_radius_mm + self.amplitude_mm
    }

    fn cam_inner_radius_mm(&self) -> f64 {
        self.mean_radius_mm - self.amplitude_mm
    }

    /// In the middle of a lobe.
    fn least_curvature_radius_mm(&self) -> f64 {
        self.mean_radius_mm - self.amplitude_mm * self.bluntness()
    }

    /// `e(1 + c)(2P0 + e(U² - 1)(1 - c))`, `c = cos Uφ`.
    fn center_rise_mm2(&self, tooth: &ToothCenter) -> f64 {
        let (below, above) = self.versed(tooth);
        let e = self.amplitude_mm;
        e * above * (2.0 * self.mean_path_mm() + e * self.bluntness() * below)
    }

    /// `e(1 - c)(2P0 - e(U² - 1)(1 + c))`.
    fn center_drop_mm2(&self, tooth: &ToothCenter) -> f64 {
        let (below, above) = self.versed(tooth);
        let e = self.amplitude_mm;
        e * below * (2.0 * self.mean_path_mm() - e * self.bluntness() * above)
    }

    /// `k² eU²/(ρ_H + r)` with the valley's `ρ_H = R0 + e(U² - 1)`.
    fn tip_bend(&self, ring_teeth_per_lobe: f64) -> f64 {
        let ring_teeth = ring_teeth_per_lobe * self.lobe_count();
        let curvature_radius_mm = self.mean_radius_mm + self.amplitude_mm * self.bluntness();
        self.amplitude_mm * ring_teeth * ring_teeth / (curvature_radius_mm + self.tooth_radius_mm)
    }

    /// A cam with a support function is convex.
    fn hollow(&self) -> Option<(f64, f64)> {
        None
    }

    /// The lower root of `2r² + (A + 2B - eZ_K²) r + AB = 0`, `A = R0 - e`, `B = R0 + e(U² - 1)`; none if the roots
    /// are complex.
    fn critical_tooth_radius_mm(&self, ring_teeth_per_lobe: f64) -> Option<f64> {
        let ring_teeth = ring_teeth_per_lobe * self.lobe_count();
        let a = self.mean_radius_mm - self.amplitude_mm;
        let b = self.mean_radius_mm + self.amplitude_mm * self.bluntness();
        let linear = self.amplitude_mm * ring_teeth * ring_teeth - a - 2.0 * b;
        let least = (8.0 * a * b).sqrt();
        if linear < least {
            return None;
        }
        Some(2.0 * a * b / (linear + ((linear - least) * (linear + least)).sqrt()))
    }
}
