//! The ring's flank: the outer parallel curve of the centres' path at the tooth radius (docs/theory.md section 2), or, in a ring
//! made with clearance, a little farther out.

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

/// The flank where a tooth touches it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FlankPoint {
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
        let turning = 1.0 + k * k * tooth.tan_pressure_angle_derivative / secant_squared;
        let regularity = 1.0 + self.distance_mm * (cos_pressure_angle / tooth.center_radius_mm) * turning;
        // Positive wherever a tooth meshes; nearer to zero than its own rounding it is not known, and a curvature of
        // 1/0 or below would be neither.
        let regularity = regularity.max(f64::EPSILON);
        FlankPoint { tan_pressure_angle, cos_pressure_angle, regularity }
    }

    /// Angle of the contact point from the tooth's centre line, seen from the axis: `atan(r sin β / (d + r cos β))`.
    pub fn lead_rad(&self, tooth: &ToothCenter, point: &FlankPoint) -> f64 {
        let normal_mm = self.distance_mm * point.cos_pressure_angle;
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
        let normal_mm = self.distance_mm * point.cos_pressure_angle;
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
