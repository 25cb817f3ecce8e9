//! The ring's flank: the outer parallel curve of the centres' path at the tooth radius (docs/explanation/theory.md section 2), or, in a ring
//! made with clearance, a little farther out.

use std::f64::consts::PI;

use nalgebra::{Point2, Unit, Vector2};

use crate::cam::ToothCenter;
use crate::locus::Locus;
use crate::position::{Position, half_lobe_rad};
use crate::root::{NotConverged, bracketed};

/// The flank of the ring's teeth.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RingFlank {
    locus: Locus,
    teeth_per_wave: f64,
    distance_mm: f64,
}

/// Where a tooth touches the ring: its flank, or the corner that ends it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FlankPoint {
    /// Distance of the tooth's centre from it: that of the flank from the path of the centres, or more before a corner.
    pub distance_mm: f64,
    /// `tan β = k T`, β the ring's pressure angle (its normal against the radius).
    pub tan_pressure_angle: f64,
    /// cos β.
    pub cos_pressure_angle: f64,
    /// `1 + rκ`, κ the curvature of the centres' path: positive on the flank, small where it comes near a cusp.
    pub regularity: f64,
}

/// What ends the flank towards the tip.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FlankEnd {
    /// The valley: a regular tip.
    RegularTip,
    /// Undercut: both flanks of the ring's tooth cross on its symmetry line.
    Undercut,
    /// A bore at the tip-circle radius.
    Bore,
}

/// Where and why the flank ends.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FlankLimit {
    /// ψ_e: beyond it a tooth touches no ring.
    pub position: Position,
    /// What ends it.
    pub end: FlankEnd,
}

/// One tooth of the ring: its flank and what ends it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RingTooth {
    /// The flank.
    pub flank: RingFlank,
    /// Where and why it ends.
    pub limit: FlankLimit,
    /// Radius of the tip before any bore.
    pub natural_tip_radius_mm: f64,
    /// Radius of the tip: natural, trimmed by undercut, or bored.
    pub tip_radius_mm: f64,
}

impl RingTooth {
    /// The tooth of this flank, truncated by a bore where it has one, which lies inside the root.
    pub(crate) fn new(flank: RingFlank, bore_mm: Option<f64>) -> Result<Self, NotConverged> {
        let natural = flank.natural_limit()?;
        let natural_tip_radius_mm = match natural.end {
            FlankEnd::Undercut => {
                let tooth = flank.locus.at(natural.position)?;
                flank.radius_mm(&tooth, &flank.at(&tooth))
            }
            FlankEnd::RegularTip | FlankEnd::Bore => flank.regular_tip_radius_mm(),
        };
        let unbored = Self { flank, limit: natural, natural_tip_radius_mm, tip_radius_mm: natural_tip_radius_mm };
        let Some(tip_radius_mm) = bore_mm.filter(|&bore_mm| bore_mm > natural_tip_radius_mm) else {
            return Ok(unbored);
        };
        let position = flank.position_at_radius(tip_radius_mm)?;
        // Beside an undercut tip rounding could otherwise move the end outward.
        let limit = if position.from_valley_rad > natural.position.from_valley_rad {
            FlankLimit { position, end: FlankEnd::Bore }
        } else {
            natural
        };
        Ok(Self { limit, tip_radius_mm, ..unbored })
    }

    /// The engaged tooth with the largest pressure angles: at the steepest place of the path, or where the flank ends
    /// before it.
    pub(crate) fn steepest_engaged(&self) -> Result<ToothCenter, NotConverged> {
        let locus = self.flank.locus();
        let steepest = locus.steepest()?;
        if steepest.position.from_valley_rad >= self.limit.position.from_valley_rad {
            Ok(steepest)
        } else {
            locus.at(self.limit.position)
        }
    }
}

/// The corner in which a pointed or bored flank ends, as teeth see it that have not come to the flank yet (docs/explanation/theory.md section 4.4, `corner_contact`).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TipCorner {
    flank: RingFlank,
    limit: FlankLimit,
    /// The flank at the corner.
    flank_end: FlankPoint,
    radius_mm: f64,
    /// Angle of the corner from the symmetry line of the ring's tooth, about the axis: nothing of a pointed tip.
    from_tip_rad: f64,
}

/// A tooth nearer to the flank's end than this is on the flank: nearer than what is turned in any answer, and farther than what two ways to the same
/// place differ by, so that all of them tell alike.
const AT_END_RAD: f64 = 1e-12;

impl TipCorner {
    /// That of a ring's tooth; none at a regular tip.
    pub(crate) fn of(tooth: &RingTooth) -> Result<Option<Self>, NotConverged> {
        let &RingTooth { flank, limit, .. } = tooth;
        if limit.end == FlankEnd::RegularTip {
            return Ok(None);
        }
        let center = flank.locus.at(limit.position)?;
        let flank_end = flank.at(&center);
        let from_tip_rad =
            if limit.end == FlankEnd::Undercut { 0.0 } else { flank.angle_from_tip_rad(&center, &flank_end) };
        let radius_mm = flank.radius_mm(&center, &flank_end);
        Ok(Some(Self { flank, limit, flank_end, radius_mm, from_tip_rad }))
    }

    /// Whether a tooth stands before the flank, where it meets the corner first.
    pub(crate) fn is_before_flank(&self, position: &Position) -> bool {
        position.from_valley_rad < self.limit.position.from_valley_rad - AT_END_RAD
    }

    /// The place nearest to the flank that is still before it.
    pub(crate) fn last_before_flank(limit: &FlankLimit) -> Position {
        let Position { from_valley_rad, lobes, .. } = limit.position;
        Position::from_valley((from_valley_rad - 2.0 * AT_END_RAD).max(0.0), lobes)
    }

    /// The corner as seen from a tooth before the flank: along the line from its centre.
    pub(crate) fn seen_from(&self, tooth: &ToothCenter) -> FlankPoint {
        let k = self.flank.teeth_per_wave;
        let (sin, cos) = (tooth.position.from_valley_rad / k - self.from_tip_rad).sin_cos();
        let (along_mm, across_mm) = (self.radius_mm * cos - tooth.center_radius_mm, self.radius_mm * sin);
        let distance_mm = along_mm.hypot(across_mm);
        FlankPoint {
            // No tooth's circle reaches over the corner: what is missing is rounding.
            distance_mm: distance_mm.max(self.flank.distance_mm),
            tan_pressure_angle: across_mm / along_mm,
            cos_pressure_angle: along_mm / distance_mm,
            regularity: self.flank_end.regularity,
        }
    }

    /// What a force on the flank moves the corner by more than it would move a wall, for each unit of the logarithm by which it is nearer to it and over
    /// `(1 - ν²)/(π E L1)`: by the solution for a wedge that is pressed at its apex (docs/explanation/theory.md section 4.4, `corner_contact`).
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

    /// What a tooth's circle keeps from the corner.
    pub(crate) fn gap_mm(&self, seen: &FlankPoint) -> f64 {
        seen.distance_mm - self.flank.distance_mm
    }

    /// By how much the line from a tooth's centre to the corner is turned against the flank's normal there.
    pub(crate) fn angle_off_flank_rad(&self, tooth: &ToothCenter, seen: &FlankPoint) -> f64 {
        let before_rad = self.limit.position.from_valley_rad - tooth.position.from_valley_rad;
        let turned_rad = before_rad / self.flank.teeth_per_wave;
        (self.flank_end.tan_pressure_angle.atan() - seen.tan_pressure_angle.atan() - turned_rad).max(0.0)
    }
}

impl RingFlank {
    pub(crate) const fn new(locus: Locus, teeth_per_wave: f64) -> Self {
        Self { locus, teeth_per_wave, distance_mm: locus.tooth_radius_mm() }
    }

    /// The same flank cut back along its normal.
    pub(crate) fn set_back_by(self, clearance_mm: f64) -> Self {
        Self { distance_mm: self.distance_mm + clearance_mm, ..self }
    }

    /// Radius of the ring at the middle of its tooth space, `d_l + r` without clearance.
    pub fn root_radius_mm(&self) -> f64 {
        self.locus.cam_outer_radius_mm() + self.height_over_cam_mm()
    }

    /// Radius of a regular tip, `d_v + r` without clearance.
    fn regular_tip_radius_mm(&self) -> f64 {
        self.locus.cam_inner_radius_mm() + self.height_over_cam_mm()
    }

    /// Distance of the flank from the path of the teeth's centres, `r` without clearance.
    pub(crate) const fn distance_mm(&self) -> f64 {
        self.distance_mm
    }

    /// Distance of cam and flank along a common normal, `2r` without clearance.
    fn height_over_cam_mm(&self) -> f64 {
        self.locus.tooth_radius_mm() + self.distance_mm
    }

    /// The path that the flank is parallel to.
    pub const fn locus(&self) -> &Locus {
        &self.locus
    }

    /// `k = Z_K / U`.
    pub const fn teeth_per_wave(&self) -> f64 {
        self.teeth_per_wave
    }

    /// The flank where `tooth` touches it.
    pub fn at(&self, tooth: &ToothCenter) -> FlankPoint {
        let k = self.teeth_per_wave;
        let tan_pressure_angle = k * tooth.tan_pressure_angle;
        let secant_squared = 1.0 + tan_pressure_angle * tan_pressure_angle;
        let cos_pressure_angle = 1.0 / secant_squared.sqrt();
        let turning = self.turning(tooth);
        let regularity = 1.0 + self.distance_mm * (cos_pressure_angle / tooth.center_radius_mm) * turning;
        // Positive wherever a tooth meshes; nearer to zero than its own rounding it is not known, and a curvature of
        // 1/0 or below would be neither.
        let regularity = regularity.max(f64::EPSILON);
        FlankPoint { distance_mm: self.distance_mm, tan_pressure_angle, cos_pressure_angle, regularity }
    }

    /// By how much the normal of flank and path turns for each radian that the path goes around the axis: of the sign of κ.
    pub(crate) fn turning(&self, tooth: &ToothCenter) -> f64 {
        let k = self.teeth_per_wave;
        let tan_pressure_angle = k * tooth.tan_pressure_angle;
        let secant_squared = 1.0 + tan_pressure_angle * tan_pressure_angle;
        1.0 + k * k * tooth.tan_pressure_angle_derivative / secant_squared
    }

    /// Angle of the contact point from the tooth's centre line, seen from the axis: `atan(r sin β / (d + r cos β))`.
    pub fn lead_rad(&self, tooth: &ToothCenter, point: &FlankPoint) -> f64 {
        let normal_mm = point.distance_mm * point.cos_pressure_angle;
        (normal_mm * point.tan_pressure_angle / (tooth.center_radius_mm + normal_mm)).atan()
    }

    /// Angle of the contact point from the middle of the tooth space.
    pub fn angle_from_space_rad(&self, tooth: &ToothCenter, point: &FlankPoint) -> f64 {
        tooth.position.from_lobe_rad / self.teeth_per_wave + self.lead_rad(tooth, point)
    }

    /// Angle φ_K of the contact point from the symmetry line of the ring's tooth.
    pub fn angle_from_tip_rad(&self, tooth: &ToothCenter, point: &FlankPoint) -> f64 {
        tooth.position.from_valley_rad / self.teeth_per_wave - self.lead_rad(tooth, point)
    }

    /// Distance `R` of the contact point from the axis.
    pub fn radius_mm(&self, tooth: &ToothCenter, point: &FlankPoint) -> f64 {
        let normal_mm = point.distance_mm * point.cos_pressure_angle;
        (tooth.center_radius_mm + normal_mm).hypot(normal_mm * point.tan_pressure_angle)
    }

    /// The contact point in the ring's frame.
    pub fn point(&self, tooth: &ToothCenter, point: &FlankPoint) -> Point2<f64> {
        let (sin, cos) = self.angle_from_space_rad(tooth, point).sin_cos();
        Point2::from(Vector2::new(cos, sin) * self.radius_mm(tooth, point))
    }

    /// The tangent of flank and path alike, towards the tip, in the ring's frame.
    pub fn tangent(&self, tooth: &ToothCenter, point: &FlankPoint) -> Unit<Vector2<f64>> {
        let normal_rad = tooth.position.from_lobe_rad / self.teeth_per_wave + point.tan_pressure_angle.atan();
        Unit::new_unchecked(Vector2::new(-normal_rad.sin(), normal_rad.cos()))
    }

    /// `d_v (1 + rκ)` at the tip, r being the flank's distance.
    fn tip_regularity_mm(&self) -> f64 {
        let bend = self.locus.cam().kind().tip_bend(self.locus.tooth_radius_mm(), self.teeth_per_wave);
        self.regular_tip_radius_mm() - self.distance_mm * bend
    }

    /// Whether the ring's tips are cut away by their own envelope: whether the parallel curve is irregular at the tip.
    pub fn is_undercut(&self) -> bool {
        self.tip_regularity_mm() < 0.0
    }

    /// The least tooth radius that undercuts; none where no radius does.
    pub fn critical_tooth_radius_mm(&self) -> Option<f64> {
        self.locus.cam().kind().critical_tooth_radius_mm(self.teeth_per_wave)
    }

    /// The least distance from the path of the centres at which this flank is undercut, of an ellipse `(b + r)/(k² (a² - b²)/(a² + br) - 1)`:
    /// that of the critical tooth radius where distance and radius are one. None where no distance undercuts.
    pub(crate) fn critical_distance_mm(&self) -> Option<f64> {
        let r = self.locus.tooth_radius_mm();
        let bend = self.locus.cam().kind().tip_bend(r, self.teeth_per_wave);
        (bend > 1.0).then(|| (self.locus.cam_inner_radius_mm() + r) / (bend - 1.0))
    }

    /// Where the flank ends if nothing is bored away.
    ///
    /// The flank crosses the symmetry line of the ring's tooth where `tan(x/k)(d + r cos β) = r sin β`, `x = π/U - ψ`.
    /// Divided by `cos β sin(Ux/2) / k` the trivial root `x = 0` is gone, and at the threshold of undercut the
    /// other one leaves from there like a square root.
    ///
    /// # Errors
    /// [`NotConverged`] if the crossing is not found.
    pub fn natural_limit(&self) -> Result<FlankLimit, NotConverged> {
        if !self.is_undercut() {
            return Ok(FlankLimit { position: Position::valley(self.locus.lobes()), end: FlankEnd::RegularTip });
        }
        let lobes = self.locus.lobes();
        let k = self.teeth_per_wave;
        let gap = |position: Position| -> Result<f64, NotConverged> {
            let tooth = self.locus.at(position)?;
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

    /// Where the flank reaches the radius `bore_mm`, which lies between those of a regular tip and of the root.
    ///
    /// # Errors
    /// [`NotConverged`] if the crossing is not found.
    pub fn position_at_radius(&self, bore_mm: f64) -> Result<Position, NotConverged> {
        let (a, b) = (self.locus.cam_outer_radius_mm(), self.locus.cam_inner_radius_mm());
        let height_mm = self.height_over_cam_mm();
        // Differences first: a bore may be as near to tip or root as its digits can say.
        let above_tip_mm = bore_mm - b - height_mm;
        let below_root_mm = a - bore_mm + height_mm;
        let above_tip_mm2 = above_tip_mm * (bore_mm + b + height_mm);
        let below_root_mm2 = below_root_mm * (bore_mm + a + height_mm);
        let excess = |position: Position| -> Result<f64, NotConverged> {
            let tooth = self.locus.at(position)?;
            Ok(if position.from_valley_rad < position.from_lobe_rad {
                self.rise_above_tip_mm2(&tooth) - above_tip_mm2
            } else {
                below_root_mm2 - self.drop_below_root_mm2(&tooth)
            })
        };
        self.crossing("flank at the bore", -above_tip_mm2, excess)
    }

    /// The position between tip and root where `function`, of negative value `at_tip` at the tip, changes its sign;
    /// solved in the angle from whichever of valley and lobe is nearer.
    fn crossing(
        &self,
        what: &'static str,
        at_tip: f64,
        function: impl Fn(Position) -> Result<f64, NotConverged>,
    ) -> Result<Position, NotConverged> {
        let lobes = self.locus.lobes();
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

    /// `R² - (d_v + r)²`, without clearance, free of cancellation but for that of the flank itself near the threshold of undercut.
    fn rise_above_tip_mm2(&self, tooth: &ToothCenter) -> f64 {
        let (b, r) = (self.locus.cam_inner_radius_mm(), self.locus.tooth_radius_mm());
        let center_rise_mm2 = self.locus.cam().kind().center_rise_mm2(r, tooth);
        let center_rise_mm = center_rise_mm2 / (tooth.center_radius_mm + b + r);
        let point = self.at(tooth);
        center_rise_mm2
            + 2.0 * self.distance_mm * (center_rise_mm * point.cos_pressure_angle - (b + r) * versine(&point))
    }

    /// `(d_l + r)² - R²`, without clearance, a sum of positive terms.
    fn drop_below_root_mm2(&self, tooth: &ToothCenter) -> f64 {
        let (a, r) = (self.locus.cam_outer_radius_mm(), self.locus.tooth_radius_mm());
        let center_drop_mm2 = self.locus.cam().kind().center_drop_mm2(r, tooth);
        let center_drop_mm = center_drop_mm2 / (a + r + tooth.center_radius_mm);
        let point = self.at(tooth);
        center_drop_mm2 + 2.0 * self.distance_mm * (center_drop_mm + tooth.center_radius_mm * versine(&point))
    }
}

/// `1 - cos β` without cancellation.
fn versine(point: &FlankPoint) -> f64 {
    let tan = point.tan_pressure_angle;
    let cos = point.cos_pressure_angle;
    (tan * cos) * (tan * cos) / (1.0 + cos)
}
