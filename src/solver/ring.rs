//! Flank of the ring: the outer parallel curve of the centres' path at the tooth radius (docs/explanation/theory.md
//! section 2). In a ring made with clearance it is slightly farther out.

use std::f64::consts::PI;

use nalgebra::{Point2, Unit, Vector2};

use crate::cam::{Cam, CurvePoint, Kind, ToothCenter};
use crate::position::{Position, half_lobe_rad};
use crate::root::{NotConverged, bracketed};

/// The flank of the ring's teeth.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RingFlank {
    pub(crate) cam: Cam,
    teeth_per_wave: f64,
    /// Distance from the path of the tooth centres, `r` without clearance.
    pub(crate) distance_mm: f64,
}

/// Contact of a tooth with the ring: on its flank, or on the corner that ends it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FlankPoint {
    /// Distance of the tooth's centre from it: that of the flank from the path of the centres, or more before a corner.
    pub distance_mm: f64,
    /// `tan β = k T`, β the ring's pressure angle (its normal against the radius).
    pub tan_pressure_angle: f64,
    /// cos β.
    pub cos_pressure_angle: f64,
    /// `1 + rκ`, κ the curvature of the centres' path: positive on the flank, small near a cusp.
    pub regularity: f64,
}

/// Cause of the flank's end towards the tip.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FlankEnd {
    /// The valley: a regular tip.
    RegularTip,
    /// Undercut: both flanks of the ring's tooth cross on its symmetry line.
    Undercut,
    /// A bore at the tip-circle radius.
    Bore,
}

/// End of the flank towards the tip, and its cause.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FlankLimit {
    /// ψ_e: position beyond which a tooth does not touch the ring.
    pub position: Position,
    /// Cause of the end.
    pub end: FlankEnd,
}

/// One tooth of the ring: its flank and the flank's end.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RingTooth {
    /// The flank.
    pub flank: RingFlank,
    /// End of the flank, and its cause.
    pub limit: FlankLimit,
    /// Radius of the tip before any bore, in mm.
    pub natural_tip_radius_mm: f64,
    /// Radius of the tip: natural, trimmed by undercut, or bored, in mm.
    pub tip_radius_mm: f64,
}

impl RingTooth {
    /// Builds the tooth of this flank, truncated by a bore (if any) inside the root.
    pub(crate) fn new(flank: RingFlank, bore_mm: Option<f64>) -> Result<Self, NotConverged> {
        let natural = flank.natural_limit()?;
        let natural_tip_radius_mm = match natural.end {
            FlankEnd::Undercut => {
                let tooth = flank.locus().at(natural.position)?;
                flank.radius_mm(&tooth, &flank.at(&tooth))
            }
            FlankEnd::RegularTip | FlankEnd::Bore => flank.regular_tip_radius_mm(),
        };
        let unbored = Self { flank, limit: natural, natural_tip_radius_mm, tip_radius_mm: natural_tip_radius_mm };
        let Some(tip_radius_mm) = bore_mm.filter(|&bore_mm| bore_mm > natural_tip_radius_mm) else {
            return Ok(unbored);
        };
        let position = flank.position_at_radius(tip_radius_mm)?;
        // Next to an undercut tip, rounding could otherwise move the end outward.
        let limit = if position.from_valley_rad > natural.position.from_valley_rad {
            FlankLimit { position, end: FlankEnd::Bore }
        } else {
            natural
        };
        Ok(Self { limit, tip_radius_mm, ..unbored })
    }

    /// Returns the engaged tooth with the largest pressure angles. It is at the steepest point of the path, or at the
    /// end of the flank if that comes first.
    ///
    /// # Errors
    /// [`NotConverged`] from the path.
    pub fn steepest_engaged(&self) -> Result<ToothCenter, NotConverged> {
        let locus = self.flank.locus();
        let steepest = locus.steepest()?;
        if steepest.position.from_valley_rad >= self.limit.position.from_valley_rad {
            Ok(steepest)
        } else {
            locus.at(self.limit.position)
        }
    }
}

/// Corner at the end of a pointed or bored flank, as seen from teeth before the flank (docs/explanation/theory.md
/// section 4.4, `corner_contact`).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TipCorner {
    flank: RingFlank,
    limit: FlankLimit,
    /// The flank at the corner.
    flank_end: FlankPoint,
    radius_mm: f64,
    /// Angle of the corner from the symmetry line of the ring's tooth, about the axis; 0 for a pointed tip.
    from_tip_rad: f64,
}

/// A tooth within this angle of the flank's end counts as on the flank. It is below every rotation in an answer and
/// above the difference of two methods, so that all decide alike.
const AT_END_RAD: f64 = 1e-12;

impl TipCorner {
    /// Returns the corner of a ring's tooth; none at a regular tip.
    pub(crate) fn of(tooth: &RingTooth) -> Result<Option<Self>, NotConverged> {
        let &RingTooth { flank, limit, .. } = tooth;
        if limit.end == FlankEnd::RegularTip {
            return Ok(None);
        }
        let center = flank.locus().at(limit.position)?;
        let flank_end = flank.at(&center);
        let from_tip_rad =
            if limit.end == FlankEnd::Undercut { 0.0 } else { flank.angle_from_tip_rad(&center, &flank_end) };
        let radius_mm = flank.radius_mm(&center, &flank_end);
        Ok(Some(Self { flank, limit, flank_end, radius_mm, from_tip_rad }))
    }

    /// Returns true if a tooth is before the flank, where it meets the corner first.
    pub(crate) fn is_before_flank(&self, position: &Position) -> bool {
        position.from_valley_rad < self.limit.position.from_valley_rad - AT_END_RAD
    }

    /// Returns the position nearest to the flank that is still before it.
    pub(crate) fn last_before_flank(limit: &FlankLimit) -> Position {
        let Position { from_valley_rad, lobes, .. } = limit.position;
        Position::from_valley((from_valley_rad - 2.0 * AT_END_RAD).max(0.0), lobes)
    }

    /// Returns the corner as seen from a tooth before the flank, along the line from its centre.
    pub(crate) fn seen_from(&self, tooth: &ToothCenter) -> FlankPoint {
        let k = self.flank.teeth_per_wave;
        let (sin, cos) = (tooth.position.from_valley_rad / k - self.from_tip_rad).sin_cos();
        let (along_mm, across_mm) = (self.radius_mm * cos - tooth.center_radius_mm, self.radius_mm * sin);
        let distance_mm = along_mm.hypot(across_mm);
        FlankPoint {
            // No tooth's circle extends beyond the corner: a smaller distance is rounding.
            distance_mm: distance_mm.max(self.flank.distance_mm),
            tan_pressure_angle: across_mm / along_mm,
            cos_pressure_angle: along_mm / distance_mm,
            regularity: self.flank_end.regularity,
        }
    }

    /// Returns the extra displacement of the corner under a force on the flank, relative to a plane wall. It is for
    /// each unit of the logarithm of the distance, over `(1 - ν²)/(π E L1)`. It follows from the solution for a wedge
    /// loaded at its apex (docs/explanation/theory.md section 4.4, `corner_contact`).
    pub(crate) fn bending_growth(&self) -> f64 {
        let normal_rad = self.flank_end.tan_pressure_angle.atan();
        // Half of the angle between the flank and its mirror image, or the land.
        let half_rad = if self.limit.end == FlankEnd::Undercut {
            0.5 * PI - (normal_rad - self.limit.position.from_valley_rad / self.flank.teeth_per_wave)
        } else {
            let to_tip_rad = self.limit.position.from_valley_rad / self.flank.teeth_per_wave;
            0.5 * (PI - (normal_rad - (to_tip_rad - self.from_tip_rad)))
        };
        let (sin, cos) = half_rad.sin_cos();
        PI * (sin * sin / (half_rad + sin * cos) + cos * cos / (half_rad - sin * cos)) - 2.0
    }

    /// Returns the gap between a tooth's circle and the corner.
    pub(crate) fn gap_mm(&self, seen: &FlankPoint) -> f64 {
        seen.distance_mm - self.flank.distance_mm
    }

    /// Returns the angle between the line from a tooth's centre to the corner and the flank's normal there.
    pub(crate) fn angle_off_flank_rad(&self, tooth: &ToothCenter, seen: &FlankPoint) -> f64 {
        let before_rad = self.limit.position.from_valley_rad - tooth.position.from_valley_rad;
        let turned_rad = before_rad / self.flank.teeth_per_wave;
        (self.flank_end.tan_pressure_angle.atan() - seen.tan_pressure_angle.atan() - turned_rad).max(0.0)
    }
}

impl RingFlank {
    pub(crate) fn new(cam: Cam, teeth_per_wave: f64) -> Self {
        Self { cam, teeth_per_wave, distance_mm: cam.kind().tooth_radius_mm() }
    }

    /// Returns the flank at another distance from the path.
    pub(crate) const fn at_distance(self, distance_mm: f64) -> Self {
        Self { distance_mm, ..self }
    }

    /// Returns the radius of the ring at the middle of its tooth space, `d_l + r` without clearance.
    pub fn root_radius_mm(&self) -> f64 {
        self.locus().cam_outer_radius_mm() + self.height_over_cam_mm()
    }

    /// Returns the radius of a regular tip, `d_v + r` without clearance.
    fn regular_tip_radius_mm(&self) -> f64 {
        self.locus().cam_inner_radius_mm() + self.height_over_cam_mm()
    }

    /// Returns the distance of cam and flank along a common normal, `2r` without clearance.
    fn height_over_cam_mm(&self) -> f64 {
        self.locus().tooth_radius_mm() + self.distance_mm
    }

    /// Returns the wave generator, whose path of tooth centres the flank is parallel to.
    pub const fn locus(&self) -> &dyn Kind {
        self.cam.kind()
    }

    /// Returns `k = Z_K / U`.
    pub const fn teeth_per_wave(&self) -> f64 {
        self.teeth_per_wave
    }

    /// Returns the point of the flank that `tooth` touches.
    pub fn at(&self, tooth: &ToothCenter) -> FlankPoint {
        let k = self.teeth_per_wave;
        let tan_pressure_angle = k * tooth.tan_pressure_angle;
        let secant_squared = 1.0 + tan_pressure_angle * tan_pressure_angle;
        let cos_pressure_angle = 1.0 / secant_squared.sqrt();
        let turning = self.turning(tooth);
        let regularity = 1.0 + self.distance_mm * (cos_pressure_angle / tooth.center_radius_mm) * turning;
        // Positive wherever a tooth meshes. Values below its own rounding error are unknown, and would give a curvature
        // of 1/0 or a negative one.
        let regularity = regularity.max(f64::EPSILON);
        FlankPoint { distance_mm: self.distance_mm, tan_pressure_angle, cos_pressure_angle, regularity }
    }

    /// Returns the rotation of the normal of flank and path for each radian of the path about the axis: of the sign of
    /// κ.
    pub(crate) fn turning(&self, tooth: &ToothCenter) -> f64 {
        let k = self.teeth_per_wave;
        let tan_pressure_angle = k * tooth.tan_pressure_angle;
        let secant_squared = 1.0 + tan_pressure_angle * tan_pressure_angle;
        1.0 + k * k * tooth.tan_pressure_angle_derivative / secant_squared
    }

    /// Returns the angle of the contact point from the tooth's centre line, about the axis:
    /// `atan(r sin β / (d + r cos β))`.
    pub fn lead_rad(&self, tooth: &ToothCenter, point: &FlankPoint) -> f64 {
        let normal_mm = point.distance_mm * point.cos_pressure_angle;
        (normal_mm * point.tan_pressure_angle / (tooth.center_radius_mm + normal_mm)).atan()
    }

    /// Returns the angle of the contact point from the middle of the tooth space.
    pub fn angle_from_space_rad(&self, tooth: &ToothCenter, point: &FlankPoint) -> f64 {
        tooth.position.from_lobe_rad / self.teeth_per_wave + self.lead_rad(tooth, point)
    }

    /// Returns the angle φ_K of the contact point from the symmetry line of the ring's tooth.
    pub fn angle_from_tip_rad(&self, tooth: &ToothCenter, point: &FlankPoint) -> f64 {
        tooth.position.from_valley_rad / self.teeth_per_wave - self.lead_rad(tooth, point)
    }

    /// Returns the distance `R` of the contact point from the axis.
    pub fn radius_mm(&self, tooth: &ToothCenter, point: &FlankPoint) -> f64 {
        let normal_mm = point.distance_mm * point.cos_pressure_angle;
        (tooth.center_radius_mm + normal_mm).hypot(normal_mm * point.tan_pressure_angle)
    }

    /// Returns the contact point in the ring's frame.
    pub fn point(&self, tooth: &ToothCenter, point: &FlankPoint) -> Point2<f64> {
        let (sin, cos) = self.angle_from_space_rad(tooth, point).sin_cos();
        Point2::from(Vector2::new(cos, sin) * self.radius_mm(tooth, point))
    }

    /// Returns the common tangent of flank and path, towards the tip, in the ring's frame.
    pub fn tangent(&self, tooth: &ToothCenter, point: &FlankPoint) -> Unit<Vector2<f64>> {
        let normal_rad = tooth.position.from_lobe_rad / self.teeth_per_wave + point.tan_pressure_angle.atan();
        Unit::new_unchecked(Vector2::new(-normal_rad.sin(), normal_rad.cos()))
    }

    /// Returns the point that the tooth at a position touches, with its tangent and sign of curvature.
    pub(crate) fn curve_point(&self, position: Position) -> Result<CurvePoint, NotConverged> {
        let tooth = self.locus().at(position)?;
        let point = self.at(&tooth);
        Ok(CurvePoint {
            point: self.point(&tooth, &point),
            tangent: self.tangent(&tooth, &point),
            bend: self.turning(&tooth),
        })
    }

    /// Returns `d_v (1 + rκ)` at the tip, with r the flank's distance.
    fn tip_regularity_mm(&self) -> f64 {
        let bend = self.locus().tip_bend(self.teeth_per_wave);
        self.regular_tip_radius_mm() - self.distance_mm * bend
    }

    /// Returns true if the ring's tips are undercut by their own envelope: the parallel curve is irregular at the tip.
    pub fn is_undercut(&self) -> bool {
        self.tip_regularity_mm() < 0.0
    }

    /// Returns the least tooth radius that undercuts; none if no radius does.
    pub fn critical_tooth_radius_mm(&self) -> Option<f64> {
        self.locus().critical_tooth_radius_mm(self.teeth_per_wave)
    }

    /// Returns the least distance from the path of the centres at which this flank is undercut. For an ellipse it is
    /// `(b + r)/(k² (a² - b²)/(a² + br) - 1)`, and equals the critical tooth radius if distance and radius are equal.
    /// Returns none if no distance undercuts.
    pub(crate) fn critical_distance_mm(&self) -> Option<f64> {
        let bend = self.locus().tip_bend(self.teeth_per_wave);
        (bend > 1.0).then(|| (self.locus().cam_inner_radius_mm() + self.locus().tooth_radius_mm()) / (bend - 1.0))
    }

    /// Returns the end of the flank without a bore.
    ///
    /// The flank crosses the symmetry line of the ring's tooth at `tan(x/k)(d + r cos β) = r sin β`, `x = π/U - ψ`.
    /// Division by `cos β sin(Ux/2) / k` removes the trivial root `x = 0`. Above the threshold of undercut the other
    /// root grows from 0 like a square root.
    fn natural_limit(&self) -> Result<FlankLimit, NotConverged> {
        if !self.is_undercut() {
            return Ok(FlankLimit { position: Position::valley(self.locus().lobes()), end: FlankEnd::RegularTip });
        }
        let lobes = self.locus().lobes();
        let k = self.teeth_per_wave;
        let gap = |position: Position| -> Result<f64, NotConverged> {
            let tooth = self.locus().at(position)?;
            let point = self.at(&tooth);
            let r = self.distance_mm;
            let widening = k * (position.from_valley_rad / k).tan() / position.phase_cos;
            Ok(widening * (tooth.center_radius_mm / point.cos_pressure_angle + r)
                - r * k * k * (tooth.tan_pressure_angle / position.phase_cos))
        };
        let at_tip = 2.0 / f64::from(lobes) * self.tip_regularity_mm();
        let position = self.crossing("end of the undercut flank", at_tip, gap)?;
        Ok(FlankLimit { position, end: FlankEnd::Undercut })
    }

    /// Returns the position at which the flank has the radius `bore_mm`, between those of a regular tip and of the
    /// root.
    ///
    /// # Errors
    /// [`NotConverged`] if the crossing is not found.
    pub fn position_at_radius(&self, bore_mm: f64) -> Result<Position, NotConverged> {
        let (a, b) = (self.locus().cam_outer_radius_mm(), self.locus().cam_inner_radius_mm());
        let height_mm = self.height_over_cam_mm();
        // Differences first: a bore may be as near to tip or root as its digits can express.
        let above_tip_mm = bore_mm - b - height_mm;
        let below_root_mm = a - bore_mm + height_mm;
        let above_tip_mm2 = above_tip_mm * (bore_mm + b + height_mm);
        let below_root_mm2 = below_root_mm * (bore_mm + a + height_mm);
        let excess = |position: Position| -> Result<f64, NotConverged> {
            let tooth = self.locus().at(position)?;
            Ok(if position.from_valley_rad < position.from_lobe_rad {
                self.rise_above_tip_mm2(&tooth) - above_tip_mm2
            } else {
                below_root_mm2 - self.drop_below_root_mm2(&tooth)
            })
        };
        self.crossing("flank at the bore", -above_tip_mm2, excess)
    }

    /// Returns the position between tip and root at which `function`, negative (`at_tip`) at the tip, changes its sign.
    /// The unknown is the angle from the nearer of valley and lobe.
    fn crossing(
        &self,
        what: &'static str,
        at_tip: f64,
        function: impl Fn(Position) -> Result<f64, NotConverged>,
    ) -> Result<Position, NotConverged> {
        let lobes = self.locus().lobes();
        let quarter_rad = 0.5 * half_lobe_rad(lobes);
        let middle = function(Position::from_valley(quarter_rad, lobes))?;
        Ok(if middle > 0.0 {
            let from_valley = |x| Position::from_valley(x, lobes);
            from_valley(bracketed(what, 0.0, at_tip, quarter_rad, |x| function(from_valley(x)))?)
        } else {
            let from_lobe = |psi| Position::from_lobe(psi, lobes);
            from_lobe(bracketed(what, quarter_rad, middle, 0.0, |psi| function(from_lobe(psi)))?)
        })
    }

    /// Returns `R² - (d_v + r)²`, without clearance. It is free of cancellation, except that of the flank itself near
    /// undercut.
    fn rise_above_tip_mm2(&self, tooth: &ToothCenter) -> f64 {
        let (b, r) = (self.locus().cam_inner_radius_mm(), self.locus().tooth_radius_mm());
        let center_rise_mm2 = self.locus().center_rise_mm2(tooth);
        let center_rise_mm = center_rise_mm2 / (tooth.center_radius_mm + b + r);
        let point = self.at(tooth);
        center_rise_mm2
            + 2.0 * self.distance_mm * (center_rise_mm * point.cos_pressure_angle - (b + r) * versine(&point))
    }

    /// Returns `(d_l + r)² - R²`, without clearance, as a sum of positive terms.
    fn drop_below_root_mm2(&self, tooth: &ToothCenter) -> f64 {
        let (a, r) = (self.locus().cam_outer_radius_mm(), self.locus().tooth_radius_mm());
        let center_drop_mm2 = self.locus().center_drop_mm2(tooth);
        let center_drop_mm = center_drop_mm2 / (a + r + tooth.center_radius_mm);
        let point = self.at(tooth);
        center_drop_mm2 + 2.0 * self.distance_mm * (center_drop_mm + tooth.center_radius_mm * versine(&point))
    }
}

/// Returns `1 - cos β` without cancellation.
fn versine(point: &FlankPoint) -> f64 {
    let tan = point.tan_pressure_angle;
    let cos = point.cos_pressure_angle;
    (tan * cos) * (tan * cos) / (1.0 + cos)
}
