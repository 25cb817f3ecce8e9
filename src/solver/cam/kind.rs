//! What a kind of wave generator is: where it holds a tooth, and what it answers about itself (docs/explanation/theory.md section 2).

use nalgebra::{Point2, Unit, Vector2};

use crate::position::Position;
use crate::root::NotConverged;
use crate::violation::Parameter;

/// What a designer gives for a wave generator, as each kind tells it in its own file.
pub(super) struct Given {
    pub(super) lobes: i64,
    /// Whether the lobes are given, or those that the kind has.
    pub(super) are_lobes_given: bool,
    /// What says how large the cam is.
    pub(super) size: (Parameter, f64),
    /// What says how far it is from round.
    pub(super) shape: (Parameter, f64),
    /// What says how far the teeth are moved.
    pub(super) stroke: (Parameter, f64),
    /// Of the cam, or of the path of the teeth's centres.
    pub(super) mean_radius_mm: f64,
    pub(super) is_path: bool,
}

/// The cam where a tooth touches it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CamContact {
    /// Support function `h(φ)`: distance of the tangent from the axis.
    pub support_mm: f64,
    /// `|h'(φ)|`: the lever arm of a force along the normal about the axis.
    pub lever_arm_mm: f64,
    /// `1/ρ_H`: negative where the cam is hollow.
    pub curvature_per_mm: f64,
}

/// A point of the cam's outline, in its own frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct CamPoint {
    pub(crate) point: Point2<f64>,
    /// Counter-clockwise.
    pub(crate) tangent: Unit<Vector2<f64>>,
    /// Negative where the cam is hollow.
    pub(crate) bend: f64,
}

/// A tooth at one position. Mesh, ring and load follow from `d`, `T` and `T_ψ` alone.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ToothCenter {
    /// Where it is.
    pub position: Position,
    /// Where it touches the cam.
    pub cam_contact: CamContact,
    /// `d`: distance of its centre from the axis.
    pub center_radius_mm: f64,
    /// `T = tan γ = |h'|/(h + r)`, γ the pressure angle at the wave generator.
    pub tan_pressure_angle: f64,
    /// `T_ψ = dT/dψ`.
    pub tan_pressure_angle_derivative: f64,
}

impl ToothCenter {
    /// On a cam that is known by its support function: `d² = (h + r)² + h'²`, `T_ψ = (1 + T²)(T |h'| - h'')/(r + ρ_H)`.
    pub(crate) fn by_support(
        position: Position,
        tooth_radius_mm: f64,
        cam_contact: CamContact,
        cam_curvature_radius_mm: f64,
        support_second_derivative_mm: f64,
    ) -> Self {
        let lever_arm_mm = cam_contact.lever_arm_mm;
        let offset_support_mm = cam_contact.support_mm + tooth_radius_mm;
        let t = lever_arm_mm / offset_support_mm;
        Self {
            position,
            cam_contact,
            center_radius_mm: offset_support_mm.hypot(lever_arm_mm),
            tan_pressure_angle: t,
            tan_pressure_angle_derivative: (1.0 + t * t) * (t * lever_arm_mm - support_second_derivative_mm)
                / (tooth_radius_mm + cam_curvature_radius_mm),
        }
    }

    /// cos γ.
    pub fn cos_pressure_angle(&self) -> f64 {
        let t = self.tan_pressure_angle;
        1.0 / (1.0 + t * t).sqrt()
    }

    /// `φ = ψ + γ`: angle of the contact normal at the cam, from the lobe.
    pub fn normal_rad(&self) -> f64 {
        self.position.from_lobe_rad + self.tan_pressure_angle.atan()
    }
}

/// Valleys that are hollow.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Hollow {
    /// The cam's amplitude.
    pub(crate) amplitude_mm: f64,
    /// The amplitude up to which it would be convex.
    pub(crate) limit_mm: f64,
}

/// What a kind of wave generator answers, for teeth of the radius `r`.
///
/// Mesh and load follow from [`Kind::tooth`] alone. The rest are closed forms: of lengths, because differences of them decide what fits,
/// and of what happens in the valley, where a flank may be irregular by less than rounding.
pub(crate) trait Kind {
    /// `U`.
    fn lobes(&self) -> u32;

    /// The tooth whose centre stands at `position`.
    fn tooth(&self, tooth_radius_mm: f64, position: Position) -> Result<ToothCenter, NotConverged>;

    /// `d` alone.
    fn center_radius_mm(&self, tooth_radius_mm: f64, position: Position) -> Result<f64, NotConverged> {
        Ok(self.tooth(tooth_radius_mm, position)?.center_radius_mm)
    }

    /// The tooth with the largest pressure angle, where `dT/dψ = 0`.
    fn steepest(&self, tooth_radius_mm: f64) -> Result<ToothCenter, NotConverged>;

    /// The cam's largest distance from the axis, in the middle of a lobe: `d_l - r`.
    fn outer_radius_mm(&self, tooth_radius_mm: f64) -> f64;

    /// The cam's least distance from the axis, in a valley: `d_v - r`.
    fn inner_radius_mm(&self, tooth_radius_mm: f64) -> f64;

    /// The least radius of curvature of the cam where it is convex.
    fn least_curvature_radius_mm(&self, tooth_radius_mm: f64) -> f64;

    /// `d² - d_v²`, free of cancellation towards the valley.
    fn center_rise_mm2(&self, tooth_radius_mm: f64, tooth: &ToothCenter) -> f64;

    /// `d_l² - d²`, free of cancellation towards the lobe.
    fn center_drop_mm2(&self, tooth_radius_mm: f64, tooth: &ToothCenter) -> f64;

    /// `-k² T_ψ` in the valley, which is what bends the ring's tip: `d_v κ = 1 - this`.
    fn tip_bend(&self, tooth_radius_mm: f64, ring_teeth_per_lobe: f64) -> f64;

    /// The least tooth radius that undercuts the ring; none where no radius does.
    fn critical_tooth_radius_mm(&self, ring_teeth_per_lobe: f64) -> Option<f64>;

    /// Whether its valleys are hollow. A kind that never is says so: there is no default that a new kind could forget.
    fn hollow(&self) -> Option<Hollow>;

    /// The radius up to which neighbouring teeth are apart for sure, `sin` being that of half the angle between them: no centre comes
    /// nearer to the axis than `d_v`, and `d_v sin > r` is enough.
    fn surely_free_radius_mm(&self, sin: f64) -> f64 {
        // The cam stays as it is where teeth get thicker, so that d_v grows with r.
        self.inner_radius_mm(0.0) * (sin / (1.0 - sin))
    }

    /// Angle φ_H of the contact point from the valley, about the axis of rotation.
    fn contact_angle_from_valley_rad(&self, tooth_radius_mm: f64, tooth: &ToothCenter) -> f64 {
        let normal_mm = tooth_radius_mm * tooth.cos_pressure_angle();
        let behind_rad = (normal_mm * tooth.tan_pressure_angle).atan2(tooth.center_radius_mm - normal_mm);
        tooth.position.from_valley_rad + behind_rad
    }

    /// The outline where the tooth at `place` touches it, set back along its normal. A kind that knows its outline by the normal's
    /// angle may take `place` as that.
    fn outline(&self, tooth_radius_mm: f64, set_back_mm: f64, place: Position) -> Result<CamPoint, NotConverged> {
        let tooth = self.tooth(tooth_radius_mm, place)?;
        let (sin, cos) = tooth.normal_rad().sin_cos();
        let inside_mm = tooth_radius_mm + set_back_mm;
        let (center_sin, center_cos) = place.from_lobe_rad.sin_cos();
        let center = tooth.center_radius_mm * Vector2::new(center_cos, center_sin);
        Ok(CamPoint {
            point: Point2::from(center - inside_mm * Vector2::new(cos, sin)),
            tangent: Unit::new_unchecked(Vector2::new(-sin, cos)),
            // As that of the cam itself, as far as its parallel curves are regular.
            bend: tooth.cam_contact.curvature_per_mm,
        })
    }
}
