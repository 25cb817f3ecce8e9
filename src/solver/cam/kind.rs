//! Interface of a kind of wave generator: the position of a tooth and the geometry of the cam
//! (docs/explanation/theory.md section 2).

use nalgebra::{Point2, Unit, Vector2};

use crate::position::{Position, half_lobe_rad};
use crate::root::NotConverged;

/// Point of an outline, with its tangent and sign of curvature.
#[derive(Debug, Clone, Copy)]
pub struct CurvePoint {
    /// The point, in mm.
    pub point: Point2<f64>,
    /// Tangent, counter-clockwise.
    pub tangent: Unit<Vector2<f64>>,
    /// Curvature up to a positive factor: its sign changes at an inflection.
    pub bend: f64,
}

/// Cosine and sine of an angle.
#[derive(Clone, Copy)]
pub(super) struct Direction {
    pub(super) cos: f64,
    pub(super) sin: f64,
}

/// A tooth at one position. Mesh, ring and load follow from `d`, `T` and `T_ψ` only.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ToothCenter {
    /// Position of the tooth.
    pub position: Position,
    /// Support function `h(φ)` of the cam: distance of the tangent from the axis.
    pub support_mm: f64,
    /// `|h'(φ)|`: lever arm, about the axis, of a force along the cam's normal.
    pub lever_arm_mm: f64,
    /// `1/ρ_H` of the cam; negative where it is concave.
    pub cam_curvature_per_mm: f64,
    /// `d`: distance of its centre from the axis.
    pub center_radius_mm: f64,
    /// `T = tan γ = |h'|/(h + r)`, γ the pressure angle at the wave generator.
    pub tan_pressure_angle: f64,
    /// `T_ψ = dT/dψ`.
    pub tan_pressure_angle_derivative: f64,
}

impl ToothCenter {
    /// Builds the tooth on a cam with a support function: `d² = (h + r)² + h'²`,
    /// `T_ψ = (1 + T²)(T |h'| - h'')/(r + ρ_H)`.
    pub(crate) fn by_support(
        position: Position,
        tooth_radius_mm: f64,
        support_mm: f64,
        lever_arm_mm: f64,
        support_second_derivative_mm: f64,
        cam_curvature_radius_mm: f64,
    ) -> Self {
        let offset_support_mm = support_mm + tooth_radius_mm;
        let t = lever_arm_mm / offset_support_mm;
        Self {
            position,
            support_mm,
            lever_arm_mm,
            cam_curvature_per_mm: 1.0 / cam_curvature_radius_mm,
            center_radius_mm: offset_support_mm.hypot(lever_arm_mm),
            tan_pressure_angle: t,
            tan_pressure_angle_derivative: (1.0 + t * t) * (t * lever_arm_mm - support_second_derivative_mm)
                / (tooth_radius_mm + cam_curvature_radius_mm),
        }
    }

    /// Returns cos γ.
    pub fn cos_pressure_angle(&self) -> f64 {
        let t = self.tan_pressure_angle;
        1.0 / (1.0 + t * t).sqrt()
    }

    /// Returns `φ = ψ + γ`: angle of the contact normal at the cam, from the lobe.
    pub fn normal_rad(&self) -> f64 {
        self.position.from_lobe_rad + self.tan_pressure_angle.atan()
    }
}

/// Geometry of a kind of wave generator and of the path of the teeth's centres around it, for teeth of the radius `r`.
/// The path is the outer parallel curve of the cam at that radius.
///
/// Mesh and load follow from [`Kind::at`] only. The other methods are closed forms. They give lengths whose differences
/// decide what fits, and properties of the valley, where a flank may be irregular by less than rounding.
pub trait Kind {
    /// Returns `U`.
    fn lobes(&self) -> u32;

    /// Returns `r`.
    fn tooth_radius_mm(&self) -> f64;

    /// Returns the tooth whose centre is at `position`.
    ///
    /// # Errors
    /// [`NotConverged`] if its contact with the cam is not found.
    fn at(&self, position: Position) -> Result<ToothCenter, NotConverged>;

    /// Returns `d` at any angle from a lobe.
    ///
    /// # Errors
    /// As [`Kind::at`].
    fn center_radius_at_mm(&self, angle_rad: f64) -> Result<f64, NotConverged> {
        let (lobes, half_rad) = (self.lobes(), half_lobe_rad(self.lobes()));
        let pitch_rad = 2.0 * half_rad;
        let folded = angle_rad.rem_euclid(pitch_rad);
        let position = if folded > 0.5 * half_rad && folded < 1.5 * half_rad {
            Position::from_valley((folded - half_rad).abs(), lobes)
        } else {
            Position::from_lobe(folded.min(pitch_rad - folded), lobes)
        };
        Ok(self.at(position)?.center_radius_mm)
    }

    /// Returns the tooth with the largest pressure angle at the wave generator, where `dT/dψ = 0`.
    ///
    /// # Errors
    /// [`NotConverged`] if its position is not found.
    fn steepest(&self) -> Result<ToothCenter, NotConverged>;

    /// Returns the cam's largest distance from the axis, in the middle of a lobe: `d_l - r`.
    fn cam_outer_radius_mm(&self) -> f64;

    /// Returns the cam's least distance from the axis, in a valley: `d_v - r`.
    fn cam_inner_radius_mm(&self) -> f64;

    /// Returns the least radius of curvature of the cam in its convex part.
    fn least_curvature_radius_mm(&self) -> f64;

    /// Returns `d² - d_v²`, free of cancellation towards the valley.
    fn center_rise_mm2(&self, tooth: &ToothCenter) -> f64;

    /// Returns `d_l² - d²`, free of cancellation towards the lobe.
    fn center_drop_mm2(&self, tooth: &ToothCenter) -> f64;

    /// Returns `-k² T_ψ` in the valley, which sets the curvature of the ring's tip: `d_v κ = 1 - this`.
    fn tip_bend(&self, ring_teeth_per_lobe: f64) -> f64;

    /// Returns the least tooth radius that undercuts the ring; none if no radius does.
    fn critical_tooth_radius_mm(&self, ring_teeth_per_lobe: f64) -> Option<f64>;

    /// Returns the amplitude and the largest one of a convex cam, if the valleys are concave. There is no default, so that
    /// every new kind has to answer.
    fn hollow(&self) -> Option<(f64, f64)>;

    /// Returns true if the path of the tooth centres is given, so that it is the same for all tooth radii.
    fn is_path(&self) -> bool {
        false
    }

    /// Returns a tooth radius below which neighbouring teeth cannot touch, with `sin` of half the angle between them.
    /// No centre is closer to the axis than `d_v`, and `d_v sin > r` is sufficient.
    fn surely_free_radius_mm(&self, sin: f64) -> f64 {
        // The cam does not depend on the tooth radius, so d_v grows with r.
        self.cam_inner_radius_mm() * (sin / (1.0 - sin))
    }

    /// Returns the angle φ_H of a tooth's contact point from the valley, about the axis of rotation.
    fn contact_angle_from_valley_rad(&self, tooth: &ToothCenter) -> f64 {
        let normal_mm = self.tooth_radius_mm() * tooth.cos_pressure_angle();
        let behind_rad = (normal_mm * tooth.tan_pressure_angle).atan2(tooth.center_radius_mm - normal_mm);
        tooth.position.from_valley_rad + behind_rad
    }

    /// Returns the point of the outline where the tooth at `place` touches it, offset inward along its normal. A kind
    /// whose outline is known by the normal's angle may take `place` as that angle. Both ends are exact.
    ///
    /// # Errors
    /// As [`Kind::at`].
    fn outline(&self, set_back_mm: f64, place: Position) -> Result<CurvePoint, NotConverged> {
        let tooth = self.at(place)?;
        let (sin, cos) = tooth.normal_rad().sin_cos();
        let inside_mm = self.tooth_radius_mm() + set_back_mm;
        let (center_sin, center_cos) = place.from_lobe_rad.sin_cos();
        let center = tooth.center_radius_mm * Vector2::new(center_cos, center_sin);
        Ok(CurvePoint {
            point: Point2::from(center - inside_mm * Vector2::new(cos, sin)),
            tangent: Unit::new_unchecked(Vector2::new(-sin, cos)),
            // Sign as for the cam itself, as long as its parallel curves are regular.
            bend: tooth.cam_curvature_per_mm,
        })
    }
}
