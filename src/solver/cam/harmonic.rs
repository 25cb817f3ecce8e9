//! Support function `h = R0 + e cos Uφ`. With one lobe it is exactly the circle of radius R0 about a point at the
//! distance e from the axis (docs/explanation/theory.md section 2.9).

use crate::cam::kind::{CamContact, Kind, ToothCenter};
use crate::position::{Position, half_lobe_rad};
use crate::root::{NotConverged, ValueAndSlope, newton_in_bracket};

/// A cam with a harmonic support function.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Harmonic {
    lobes: u32,
    mean_radius_mm: f64,
    amplitude_mm: f64,
}

/// Half the phase `Uφ` of a normal: a quarter turn from lobe to valley.
#[derive(Clone, Copy)]
struct NormalPhase {
    cos: f64,
    sin: f64,
}

impl Harmonic {
    pub(super) const fn new(lobes: u32, mean_radius_mm: f64, amplitude_mm: f64) -> Self {
        Self { lobes, mean_radius_mm, amplitude_mm }
    }

    /// Returns the lower bound of R0: e, so that the axis is inside, and `e(U² - 1)`, so that the lobe is round.
    pub(super) fn least_mean_radius_mm(lobes: u32, amplitude_mm: f64) -> f64 {
        amplitude_mm * Self::bluntness(lobes).max(1.0)
    }

    /// Returns `U² - 1`.
    fn bluntness(lobes: u32) -> f64 {
        let u = f64::from(lobes);
        (u - 1.0) * (u + 1.0)
    }

    /// Returns true if the cam is the eccentric circle.
    pub(crate) const fn is_circle(&self) -> bool {
        self.lobes == 1
    }

    pub(crate) const fn lobes(&self) -> u32 {
        self.lobes
    }

    /// Returns `R0`.
    pub(crate) const fn mean_radius_mm(&self) -> f64 {
        self.mean_radius_mm
    }

    /// Returns `e`.
    pub(crate) const fn amplitude_mm(&self) -> f64 {
        self.amplitude_mm
    }

    fn lobe_count(&self) -> f64 {
        f64::from(self.lobes)
    }

    /// Returns `P0 = R0 + r`.
    fn mean_path_mm(&self, tooth_radius_mm: f64) -> f64 {
        self.mean_radius_mm + tooth_radius_mm
    }

    fn center(&self, tooth_radius_mm: f64, position: Position, phase: NormalPhase) -> ToothCenter {
        let (u, e) = (self.lobe_count(), self.amplitude_mm);
        let (cos_squared, sin_squared) = (phase.cos * phase.cos, phase.sin * phase.sin);
        let cos = cos_squared - sin_squared;
        let support_mm = self.mean_radius_mm + e * cos;
        // R0 - e(U² - 1) cos Uφ, starting with the difference that is small at a sharp lobe.
        let at_lobe_mm = self.mean_radius_mm - e * Self::bluntness(self.lobes);
        let curvature_radius_mm = at_lobe_mm + 2.0 * e * Self::bluntness(self.lobes) * sin_squared;
        let cam_contact = CamContact {
            support_mm,
            lever_arm_mm: 2.0 * e * u * (phase.sin * phase.cos),
            curvature_per_mm: 1.0 / curvature_radius_mm,
        };
        ToothCenter::by_support(position, tooth_radius_mm, cam_contact, curvature_radius_mm, -e * u * u * cos)
    }

    /// Returns `1 - cos Uφ` and `1 + cos Uφ`, each to full relative precision. The small one follows from `sin Uφ`,
    /// which is in the lever arm.
    fn versed(&self, tooth: &ToothCenter) -> (f64, f64) {
        let sin = tooth.cam_contact.lever_arm_mm / (self.amplitude_mm * self.lobe_count());
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
    fn pressure_angle(&self, tooth_radius_mm: f64, angle_rad: f64, towards: f64) -> ValueAndSlope {
        let (u, e) = (self.lobe_count(), self.amplitude_mm);
        let (sin, cos) = (u * angle_rad).sin_cos();
        let lever_mm = e * u * sin;
        let above_mm = self.mean_path_mm(tooth_radius_mm) + towards * e * cos;
        let squared_mm2 = above_mm * above_mm + lever_mm * lever_mm;
        ValueAndSlope {
            value: lever_mm.atan2(above_mm),
            slope: (e * u * u * cos * above_mm + towards * lever_mm * lever_mm) / squared_mm2,
        }
    }

    /// Solves for the normal's angle from the lobe, `φ - γ = ψ`, or, in the outer half, its angle y from the valley,
    /// `y + γ = x`.
    fn normal_phase(&self, tooth_radius_mm: f64, position: Position) -> Result<NormalPhase, NotConverged> {
        const WHAT: &str = "normal of the cam at a tooth";
        if position.phase_sin == 0.0 || position.phase_cos == 0.0 {
            return Ok(NormalPhase { cos: position.phase_cos, sin: position.phase_sin });
        }
        let (u, half_rad) = (self.lobe_count(), half_lobe_rad(self.lobes));
        let middle_rad = 0.5 * half_rad;
        let is_near_lobe =
            position.from_lobe_rad < middle_rad - self.pressure_angle(tooth_radius_mm, middle_rad, 1.0).value;
        if is_near_lobe {
            let psi = position.from_lobe_rad;
            let normal_rad = newton_in_bracket(
                WHAT,
                psi,
                middle_rad,
                psi + self.pressure_angle(tooth_radius_mm, psi, 1.0).value,
                |phi| {
                    let gamma = self.pressure_angle(tooth_radius_mm, phi, 1.0);
                    ValueAndSlope { value: (phi - psi) - gamma.value, slope: 1.0 - gamma.slope }
                },
            )?;
            let (sin, cos) = (0.5 * u * normal_rad).sin_cos();
            Ok(NormalPhase { cos, sin })
        } else {
            let x = position.from_valley_rad;
            // γ is at most eU² y over the least value of the denominator.
            let e = self.amplitude_mm;
            let low = x / (1.0 + e * u * u / (self.mean_path_mm(tooth_radius_mm) - e));
            let normal_rad = newton_in_bracket(WHAT, low.min(x), x, low, |y| {
                let gamma = self.pressure_angle(tooth_radius_mm, y, -1.0);
                ValueAndSlope { value: (y - x) + gamma.value, slope: 1.0 + gamma.slope }
            })?;
            let (cos, sin) = (0.5 * u * normal_rad).sin_cos();
            Ok(NormalPhase { cos, sin })
        }
    }
}

impl Kind for Harmonic {
    fn lobes(&self) -> u32 {
        self.lobes
    }

    fn tooth(&self, tooth_radius_mm: f64, position: Position) -> Result<ToothCenter, NotConverged> {
        Ok(self.center(tooth_radius_mm, position, self.normal_phase(tooth_radius_mm, position)?))
    }

    /// At `cos Uφ = -e/P0`.
    fn steepest(&self, tooth_radius_mm: f64) -> Result<ToothCenter, NotConverged> {
        let share = self.amplitude_mm / self.mean_path_mm(tooth_radius_mm);
        let phase = NormalPhase { cos: (0.5 * (1.0 - share)).sqrt(), sin: (0.5 * (1.0 + share)).sqrt() };
        let unplaced = self.center(tooth_radius_mm, Position::lobe(self.lobes), phase);
        let gamma_rad = unplaced.tan_pressure_angle.atan();
        let from_lobe_rad = 2.0 / self.lobe_count() * phase.sin.atan2(phase.cos) - gamma_rad;
        let from_valley_rad = 2.0 / self.lobe_count() * phase.cos.atan2(phase.sin) + gamma_rad;
        let position = Position::between(from_lobe_rad, from_valley_rad, self.lobes);
        Ok(ToothCenter { position, ..unplaced })
    }

    fn outer_radius_mm(&self, _: f64) -> f64 {
        self.mean_radius_mm + self.amplitude_mm
    }

    fn inner_radius_mm(&self, _: f64) -> f64 {
        self.mean_radius_mm - self.amplitude_mm
    }

    /// In the middle of a lobe.
    fn least_curvature_radius_mm(&self, _: f64) -> f64 {
        self.mean_radius_mm - self.amplitude_mm * Self::bluntness(self.lobes)
    }

    /// `e(1 + c)(2P0 + e(U² - 1)(1 - c))`, `c = cos Uφ`.
    fn center_rise_mm2(&self, tooth_radius_mm: f64, tooth: &ToothCenter) -> f64 {
        let (below, above) = self.versed(tooth);
        let e = self.amplitude_mm;
        e * above * (2.0 * self.mean_path_mm(tooth_radius_mm) + e * Self::bluntness(self.lobes) * below)
    }

    /// `e(1 - c)(2P0 - e(U² - 1)(1 + c))`.
    fn center_drop_mm2(&self, tooth_radius_mm: f64, tooth: &ToothCenter) -> f64 {
        let (below, above) = self.versed(tooth);
        let e = self.amplitude_mm;
        e * below * (2.0 * self.mean_path_mm(tooth_radius_mm) - e * Self::bluntness(self.lobes) * above)
    }

    /// `k² eU²/(ρ_H + r)` with the valley's `ρ_H = R0 + e(U² - 1)`.
    fn tip_bend(&self, tooth_radius_mm: f64, ring_teeth_per_lobe: f64) -> f64 {
        let ring_teeth = ring_teeth_per_lobe * self.lobe_count();
        let curvature_radius_mm = self.mean_radius_mm + self.amplitude_mm * Self::bluntness(self.lobes);
        self.amplitude_mm * ring_teeth * ring_teeth / (curvature_radius_mm + tooth_radius_mm)
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
        let b = self.mean_radius_mm + self.amplitude_mm * Self::bluntness(self.lobes);
        let linear = self.amplitude_mm * ring_teeth * ring_teeth - a - 2.0 * b;
        let least = (8.0 * a * b).sqrt();
        if linear < least {
            return None;
        }
        Some(2.0 * a * b / (linear + ((linear - least) * (linear + least)).sqrt()))
    }
}
