//! Cam that moves the tooth centres along `d = R + e cos Uψ`. It is explicit in the position, and concave in its
//! valleys for large strokes (docs/explanation/theory.md section 2.9).

use std::f64::consts::PI;

use crate::cam::kind::{Kind, ToothCenter};
use crate::position::Position;
use crate::root::{NotConverged, bracketed};

/// A cam with a harmonic path of the tooth centres.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct HarmonicPath {
    pub(crate) lobes: u32,
    /// `R`.
    pub(crate) mean_radius_mm: f64,
    /// `e`.
    pub(crate) amplitude_mm: f64,
    pub(crate) tooth_radius_mm: f64,
}

impl HarmonicPath {
    /// Returns the lower bound of R. It exceeds `r + e`, so that the valley is outside the axis. With two lobes or more
    /// it exceeds the larger root of `r(R + e + eU²) = (R + e)²`, so that the lobe is round. With one lobe
    /// `r < √(R² - e²)` at the sharpest point follows from the first. With three lobes or more the flanks of a lobe may
    /// still meet if `R < 2e`.
    pub(super) fn least_mean_radius_mm(&self) -> f64 {
        let (e, r) = (self.amplitude_mm, self.tooth_radius_mm);
        let of_valley_mm = r + e;
        if self.lobes < 2 {
            return of_valley_mm;
        }
        let u = self.lobe_count();
        let of_lobe_mm = 0.5 * (r + (r * (r + 4.0 * e * u * u)).sqrt()) - e;
        let round_mm = of_valley_mm.max(of_lobe_mm);
        let between_flanks_mm = |mean_radius_mm| Self { mean_radius_mm, ..*self }.least_normal_mm() - r;
        let (from_mm, to_mm) = (round_mm, 2.0 * e);
        let mean_mm = self.mean_radius_mm;
        let is_wide = mean_mm >= to_mm || (mean_mm > from_mm && between_flanks_mm(mean_mm) > 0.0);
        if self.lobes == 2 || from_mm >= to_mm || is_wide {
            return round_mm;
        }
        let at_start_mm = between_flanks_mm(from_mm);
        if at_start_mm >= 0.0 {
            return round_mm;
        }
        let between_flanks_mm = |mean_radius_mm| Ok(between_flanks_mm(mean_radius_mm));
        // Above this radius they never meet.
        bracketed("least radius of the path", from_mm, at_start_mm, to_mm, between_flanks_mm).unwrap_or(to_mm)
    }

    /// Returns the least normal `d sin ψ/sin(ψ + γ)` of the path from a centre to its lobe's axis. A tooth of that
    /// radius meets the other flank there.
    fn least_normal_mm(&self) -> f64 {
        /// Least phase from the valley, in rad: the least normal of a drive of `MAX_LOBES` is within the range.
        const FINEST_RAD: f64 = 1e-5;
        const RATIO: f64 = 0.8;
        let normal_mm = |valley_rad: f64| {
            let (sin, cos) = valley_rad.sin_cos();
            let center_radius_mm = self.mean_radius_mm - self.amplitude_mm * cos;
            let falls_mm = self.amplitude_mm * self.lobe_count() * sin;
            let (sin, cos) = ((PI - valley_rad) / self.lobe_count()).sin_cos();
            let across_mm = center_radius_mm * sin;
            let leaning_mm = across_mm + falls_mm * cos;
            if leaning_mm > 0.0 { across_mm * center_radius_mm.hypot(falls_mm) / leaning_mm } else { f64::INFINITY }
        };
        let (mut least_mm, mut at_rad, mut rad) = (f64::INFINITY, PI, PI);
        while rad > FINEST_RAD {
            rad *= RATIO;
            let found_mm = normal_mm(rad);
            if found_mm < least_mm {
                (least_mm, at_rad) = (found_mm, rad);
            }
        }
        // Golden-section search between its neighbours.
        const SHARE: f64 = 0.618_033_988_749_894_8;
        let (mut low, mut high) = (at_rad * RATIO, (at_rad / RATIO).min(PI));
        for _ in 0..40 {
            let (one, other) = (high - SHARE * (high - low), low + SHARE * (high - low));
            let (of_one, of_other) = (normal_mm(one), normal_mm(other));
            least_mm = least_mm.min(of_one).min(of_other);
            if of_one < of_other { high = other } else { low = one }
        }
        least_mm
    }

    pub(crate) fn lobe_count(&self) -> f64 {
        f64::from(self.lobes)
    }

    /// Returns `d_v = R - e`.
    fn valley_mm(&self) -> f64 {
        self.mean_radius_mm - self.amplitude_mm
    }
}

impl Kind for HarmonicPath {
    fn is_path(&self) -> bool {
        true
    }

    fn lobes(&self) -> u32 {
        self.lobes
    }

    fn tooth_radius_mm(&self) -> f64 {
        self.tooth_radius_mm
    }

    /// `T = eU sin(Uψ)/d`, `T_ψ = eU² cos(Uψ)/d + T²`, the path's curvature `κ_C = (cos γ/d)(1 + T_ψ/(1 + T²))`, and
    /// `1/ρ_H = κ_C/(1 - rκ_C)`, which has no pole at a straight part of the cam.
    fn at(&self, position: Position) -> Result<ToothCenter, NotConverged> {
        let (u, e) = (self.lobe_count(), self.amplitude_mm);
        let (cos, sin) = (position.phase_cos, position.phase_sin);
        // cos Uψ
        let cos_of_lobe = cos * cos - sin * sin;
        let center_radius_mm = self.mean_radius_mm + e * cos_of_lobe;
        let t = 2.0 * e * u * (sin * cos) / center_radius_mm;
        let derivative = e * u * u * cos_of_lobe / center_radius_mm + t * t;
        let cos_gamma = 1.0 / (1.0 + t * t).sqrt();
        let path_curvature_per_mm = cos_gamma / center_radius_mm * (1.0 + derivative / (1.0 + t * t));
        Ok(ToothCenter {
            position,
            support_mm: center_radius_mm * cos_gamma - self.tooth_radius_mm,
            lever_arm_mm: center_radius_mm * (t * cos_gamma),
            cam_curvature_per_mm: path_curvature_per_mm / (1.0 - self.tooth_radius_mm * path_curvature_per_mm),
            center_radius_mm,
            tan_pressure_angle: t,
            tan_pressure_angle_derivative: derivative,
        })
    }

    /// At `cos Uψ = -e/R`.
    fn steepest(&self) -> Result<ToothCenter, NotConverged> {
        let share = self.amplitude_mm / self.mean_radius_mm;
        let (cos, sin) = ((0.5 * (1.0 - share)).sqrt(), (0.5 * (1.0 + share)).sqrt());
        let position = Position {
            from_lobe_rad: 2.0 / self.lobe_count() * sin.atan2(cos),
            from_valley_rad: 2.0 / self.lobe_count() * cos.atan2(sin),
            phase_cos: cos,
            phase_sin: sin,
            ..Position::lobe(self.lobes)
        };
        self.at(position)
    }

    fn cam_outer_radius_mm(&self) -> f64 {
        self.mean_radius_mm + self.amplitude_mm - self.tooth_radius_mm
    }

    fn cam_inner_radius_mm(&self) -> f64 {
        self.valley_mm() - self.tooth_radius_mm
    }

    /// In the middle of a lobe; with one lobe at `cos ψ = -e/R`, where the path's radius of curvature is `√(R² - e²)`.
    fn least_curvature_radius_mm(&self) -> f64 {
        let (e, u) = (self.amplitude_mm, self.lobe_count());
        let lobe_mm = self.mean_radius_mm + e;
        let path_mm = if self.lobes < 2 {
            (self.valley_mm() * lobe_mm).sqrt()
        } else {
            lobe_mm * (lobe_mm / (lobe_mm + e * u * u))
        };
        path_mm - self.tooth_radius_mm
    }

    /// Uses `d - d_v = e(1 + cos Uψ)`.
    fn center_rise_mm2(&self, tooth: &ToothCenter) -> f64 {
        let cos = tooth.position.phase_cos;
        2.0 * self.amplitude_mm * cos * cos * (tooth.center_radius_mm + self.valley_mm())
    }

    /// Uses `d_l - d = e(1 - cos Uψ)`.
    fn center_drop_mm2(&self, tooth: &ToothCenter) -> f64 {
        let sin = tooth.position.phase_sin;
        2.0 * self.amplitude_mm * sin * sin * (tooth.center_radius_mm + (self.mean_radius_mm + self.amplitude_mm))
    }

    /// `eZ_K²/(R - e)`.
    fn tip_bend(&self, ring_teeth_per_lobe: f64) -> f64 {
        let ring_teeth = ring_teeth_per_lobe * self.lobe_count();
        self.amplitude_mm * ring_teeth * ring_teeth / self.valley_mm()
    }

    /// The valleys are concave if the amplitude exceeds `R/(U² + 1)`.
    fn hollow(&self) -> Option<(f64, f64)> {
        let u = self.lobe_count();
        let limit_mm = self.mean_radius_mm / (u * u + 1.0);
        (self.amplitude_mm > limit_mm).then_some((self.amplitude_mm, limit_mm))
    }

    /// `(R - e)²/(eZ_K² - (R - e))`, with the path unchanged.
    fn critical_tooth_radius_mm(&self, ring_teeth_per_lobe: f64) -> Option<f64> {
        let ring_teeth = ring_teeth_per_lobe * self.lobe_count();
        let valley_mm = self.valley_mm();
        let bend_mm = self.amplitude_mm * ring_teeth * ring_teeth - valley_mm;
        (bend_mm > 0.0).then(|| valley_mm * (valley_mm / bend_mm))
    }

    /// The path does not depend on the tooth radius.
    fn surely_free_radius_mm(&self, sin: f64) -> f64 {
        self.valley_mm() * sin
    }
}
