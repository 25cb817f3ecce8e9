//! Tooth space of the ring as made: its flank offset by a clearance and shaped by a modification
//! (docs/explanation/theory.md section 8).

use nalgebra::{Point2, Unit, Vector2};

use crate::cam::CurvePoint;
use crate::drive::{Drive, DriveError};
use crate::gaps::{MM_PER_UM, Modification, RAD_PER_ARCSEC, TipRelief};
use crate::position::{Position, half_lobe_rad};
use crate::profile::{Density, SampledCurve, on_circle, sampled};
use crate::ring::{FlankEnd, RingFlank, RingTooth};
use crate::root::{NotConverged, bracketed, golden_section};
use crate::violation::{Modified, Violation};
use crate::{SolveError, Stop};

/// One symmetric tooth space of the ring.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct ToothSpace {
    flank: ShapedFlank,
    start: Position,
    end: Position,
    /// Cause of the flank's end if only its distance from the path shaped it.
    end_by_distance: FlankEnd,
    pub(crate) tip: Tip,
    /// Largest radius of the space: that of the root, or of a tip relief beyond it.
    pub(crate) outermost_radius_mm: f64,
}

/// End of a space at the ring's tip.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Tip {
    pub(crate) radius_mm: f64,
    /// True if the tip is an arc of this radius; false for a point or a regular point of the curve.
    pub(crate) has_land: bool,
}

/// Flank with its shape in addition to its distance.
#[derive(Debug, Clone, Copy, PartialEq)]
struct ShapedFlank {
    flank: RingFlank,
    path_shift_mm: f64,
    profile_shift_mm: f64,
    turned_rad: f64,
    relief: Option<Relief>,
}

/// A tip relief relative to the drive's own flank.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Relief {
    amount_mm: f64,
    start_rad: f64,
    length_rad: f64,
    power: f64,
}

/// A shaped flank at one position.
struct ShapedPoint {
    radius_mm: f64,
    /// Angle from the middle of the space.
    angle_rad: f64,
    /// Angle from the symmetry line of the ring's tooth, with all its digits near the tip.
    angle_from_tip_rad: f64,
    tangent: Unit<Vector2<f64>>,
    /// Derivative of the curve along the path's tangent, by position; not positive beyond a cusp.
    speed_mm: f64,
    distance_mm: f64,
}

/// Number of positions over half a lobe at which the end of a shaped flank is searched for: far more than its
/// inflections.
const PLACES: u32 = 720;

/// Number of halvings towards the start of a relief in the search for its maximum, from the distance between positions.
const HALVINGS: i32 = 60;

/// Golden-section steps towards a maximum: to a millionth of the bracket, which changes a radius by less than rounding.
const SECTIONS: u32 = 30;

/// Distance of the points on either side of a point, between which a shaped flank's curvature is measured.
const BESIDE_SHARE_OF_HALF_LOBE: f64 = 1e-5;

/// Factor for rounding of a radius.
const ROUNDED: f64 = 1.0 + 1e-12;

/// Possible ends of a shaped flank; a regular tip is one if it has become a cusp.
const ENDS: [FlankEnd; 3] = [FlankEnd::Undercut, FlankEnd::Bore, FlankEnd::RegularTip];

impl ToothSpace {
    /// Builds the space of a ring with a clearance and a modification.
    ///
    /// # Errors
    /// A modification that leaves no flank, and [`NotConverged`] from the geometry.
    pub(crate) fn new(drive: &Drive, clearance_mm: f64, modification: &Modification) -> Result<Self, DriveError> {
        let leaves_nothing = |modified, value, limit| {
            DriveError::Impossible(vec![Violation::modification_leaves_nothing(modified, value, limit)])
        };
        let bore_mm = drive.parameters().tip_radius_mm;
        // The flank is outside the path, and its root outside the bore.
        let beside_bore_mm = bore_mm.map_or(f64::NEG_INFINITY, |bore_mm| bore_mm - drive.root_radius_mm());
        let least_set_back_mm = beside_bore_mm.max(-drive.parameters().tooth_radius_mm);
        let equidistant_mm = MM_PER_UM * modification.ring_equidistant_um;
        if clearance_mm + equidistant_mm <= least_set_back_mm {
            let limit = Some((least_set_back_mm - clearance_mm) / MM_PER_UM);
            return Err(leaves_nothing(Modified::RingEquidistant, modification.ring_equidistant_um, limit));
        }
        let flank = drive.flank().at_distance(drive.flank().distance_mm + (clearance_mm + equidistant_mm));
        let RingTooth { limit, tip_radius_mm, .. } = RingTooth::new(flank, bore_mm)?;
        let shaped = ShapedFlank::new(drive, flank, modification);
        if !shaped.is_shaped() {
            return Ok(Self {
                flank: shaped,
                start: Position::lobe(drive.lobes()),
                end: limit.position,
                end_by_distance: limit.end,
                tip: Tip { radius_mm: tip_radius_mm, has_land: limit.end == FlankEnd::Bore },
                outermost_radius_mm: flank.root_radius_mm(),
            });
        }
        if let Some(space) = shaped.space(limit.end, bore_mm)? {
            return Ok(space);
        }
        let unrelieved = ShapedFlank { relief: None, ..shaped };
        let (modified, value) = match modification.ring_tip_relief {
            Some(relief) if unrelieved.space(limit.end, bore_mm)?.is_some() => {
                (Modified::TipReliefAmount, relief.amount_um)
            }
            _ => modification.greatest_of_ring(),
        };
        Err(leaves_nothing(modified, value, None))
    }

    /// Returns the flank's distance from the path, and the least one that undercuts it, if both flanks end at their
    /// crossing because of that distance.
    pub(crate) fn undercutting_distance_mm(&self) -> Option<(f64, f64)> {
        let flank = &self.flank.flank;
        let critical_mm = flank.critical_distance_mm().filter(|_| self.end_by_distance == FlankEnd::Undercut)?;
        Some((flank.distance_mm, critical_mm))
    }

    /// Returns half the angle of the arc that joins rotated flanks at the root.
    pub(crate) const fn root_arc_rad(&self) -> f64 {
        self.flank.turned_rad.max(0.0)
    }

    /// Returns the flanks from tip to tip, with the middle of the space along x and the tip at this angle from it. They
    /// are one curve if they are smooth at the root.
    pub(crate) fn flanks(
        &self,
        tip_rad: f64,
        density: Density,
        stop: &dyn Stop,
    ) -> Result<Vec<SampledCurve>, SolveError> {
        let mut pieces = self.half(density, stop)?;
        if self.root_arc_rad() == 0.0 {
            // Both flanks start on the middle of the space.
            let first = &mut pieces[0].points[0];
            *first = Point2::new(first.coords.norm(), 0.0);
        }
        if !self.tip.has_land
            && let Some(end) = pieces.last_mut().and_then(|piece| piece.points.last_mut())
        {
            // Both flanks end on the symmetry line, where the tip is a point or smooth.
            *end = on_circle(self.tip.radius_mm, tip_rad);
        }
        let image = |point: &Point2<f64>| Point2::new(point.x, 0.0 - point.y);
        let image_tangent = |tangent: &Unit<Vector2<f64>>| Unit::new_unchecked(Vector2::new(-tangent.x, tangent.y));
        let mirrored = |curve: &SampledCurve| SampledCurve {
            points: curve.points.iter().rev().map(image).collect(),
            tangents: curve.tangents.iter().rev().map(image_tangent).collect(),
        };
        let mut curves: Vec<_> = pieces.iter().rev().map(mirrored).collect();
        let mut pieces = pieces.into_iter();
        // A relief with a power above one starts along the curve.
        let starts_bent = self.flank.relief.is_some_and(|relief| relief.start_rad == 0.0 && relief.power <= 1.0);
        if self.flank.turned_rad == 0.0
            && !starts_bent
            && let (Some(before), Some(SampledCurve { points, tangents })) = (curves.last_mut(), pieces.next())
        {
            before.points.extend(&points[1..]);
            before.tangents.extend(&tangents[1..]);
        }
        curves.extend(pieces);
        Ok(curves)
    }

    /// Returns a flank from the middle of the space outward, in two pieces if it contains the start of a tip relief.
    fn half(&self, density: Density, stop: &dyn Stop) -> Result<Vec<SampledCurve>, SolveError> {
        let Self { flank, start, end, .. } = self;
        let lobes = flank.flank.locus().lobes();
        let mut pieces = Vec::new();
        let mut piece = |from: Position, to: Position, is_relieved: bool| {
            let curve = |place| flank.curve_point(place, [from, to], is_relieved);
            pieces.push(sampled(from, to, density, stop, curve)?);
            Ok::<_, SolveError>(())
        };
        let relieved_from = flank.relief.map(|relief| Position::from_lobe(relief.start_rad, lobes));
        match relieved_from.filter(|from| from.from_valley_rad > end.from_valley_rad) {
            None => piece(*start, *end, false)?,
            Some(from) if from.from_valley_rad < start.from_valley_rad => {
                piece(*start, from, false)?;
                piece(from, *end, true)?;
            }
            Some(_) => piece(*start, *end, true)?,
        }
        Ok(pieces)
    }
}

impl ShapedFlank {
    fn new(drive: &Drive, flank: RingFlank, modification: &Modification) -> Self {
        let relief = modification.ring_tip_relief.filter(|relief| relief.amount_um != 0.0);
        Self {
            flank,
            path_shift_mm: MM_PER_UM * modification.ring_path_shift_um,
            profile_shift_mm: MM_PER_UM * modification.ring_profile_shift_um,
            turned_rad: RAD_PER_ARCSEC * modification.ring_rotation_arcsec,
            relief: relief.map(|TipRelief { amount_um, start_deg, power }| {
                let start_rad = start_deg.to_radians();
                let length_rad = drive.flank_limit().position.from_lobe_rad - start_rad;
                Relief { amount_mm: MM_PER_UM * amount_um, start_rad, length_rad, power }
            }),
        }
    }

    /// Returns true if more than its distance from the path shapes it.
    fn is_shaped(&self) -> bool {
        let shifts = [self.path_shift_mm, self.profile_shift_mm, self.turned_rad];
        self.relief.is_some() || shifts.iter().any(|&by| by != 0.0)
    }

    /// Returns the distance from the path and its derivative by ψ. `is_relieved` selects the side at the start of the
    /// relief.
    fn distance_mm(&self, position: &Position, is_relieved: bool) -> (f64, f64) {
        let plain_mm = self.flank.distance_mm;
        let Some(Relief { amount_mm, start_rad, length_rad, power }) = self.relief.filter(|_| is_relieved) else {
            return (plain_mm, 0.0);
        };
        let share = ((position.from_lobe_rad - start_rad) / length_rad).max(0.0);
        (plain_mm + amount_mm * share.powf(power), amount_mm * power * share.powf(power - 1.0) / length_rad)
    }

    /// Returns the flank at a position. The path is shifted along its radii; its parallel curve is then moved along its
    /// own radii and rotated. With `ρ = d + Δ` and `tan β' = kTd/ρ` its point is `ρ e(ψ/k) + D e(ψ/k + β')`.
    fn at(&self, position: Position, is_relieved: bool) -> Result<ShapedPoint, NotConverged> {
        let tooth = self.flank.locus().at(position)?;
        let k = self.flank.teeth_per_wave();
        let d = tooth.center_radius_mm;
        let path_radius_mm = d + self.path_shift_mm;
        let tan = k * tooth.tan_pressure_angle * d / path_radius_mm;
        // By ψ, with d' = -Td.
        let d_slope_mm = -tooth.tan_pressure_angle * d;
        let tan_slope = (k * (tooth.tan_pressure_angle_derivative * d + tooth.tan_pressure_angle * d_slope_mm)
            - tan * d_slope_mm)
            / path_radius_mm;
        let cos = 1.0 / tan.hypot(1.0);
        let turning = 1.0 / k + tan_slope * cos * cos;
        let (distance_mm, growth_mm) = self.distance_mm(&position, is_relieved);
        let speed_mm = path_radius_mm / (k * cos) + distance_mm * turning;
        let (along_mm, across_mm) = (path_radius_mm + distance_mm * cos, distance_mm * tan * cos);
        let lead_rad = across_mm.atan2(along_mm);
        let radius_mm = along_mm.hypot(across_mm);
        // Direction of the curve relative to the radius of its point, which is ahead of the path's by `lead`.
        let normal_rad = tan.atan() - lead_rad;
        let (sin_normal, cos_normal) = normal_rad.sin_cos();
        let (outward, around) = if growth_mm.is_finite() {
            (growth_mm * cos_normal - speed_mm * sin_normal, growth_mm * sin_normal + speed_mm * cos_normal)
        } else {
            // A relief with a power below one starts along the normal.
            (growth_mm.signum() * cos_normal, growth_mm.signum() * sin_normal)
        };
        // A shift along the radii stretches the component across them.
        let around = around * ((radius_mm + self.profile_shift_mm) / radius_mm);
        let angle_rad = position.from_lobe_rad / k + lead_rad + self.turned_rad;
        let (sin, cos) = angle_rad.sin_cos();
        let tangent = Vector2::new(outward * cos - around * sin, outward * sin + around * cos);
        Ok(ShapedPoint {
            radius_mm: radius_mm + self.profile_shift_mm,
            angle_rad,
            angle_from_tip_rad: position.from_valley_rad / k - lead_rad - self.turned_rad,
            tangent: Unit::new_normalize(tangent),
            speed_mm,
            distance_mm,
        })
    }

    /// Returns a point of the piece between two positions. Its curvature is the change of direction from just before to
    /// just behind it: a closed form with relief would need another derivative of T.
    fn curve_point(
        &self,
        position: Position,
        [from, to]: [Position; 2],
        is_relieved: bool,
    ) -> Result<CurvePoint, NotConverged> {
        if !self.is_shaped() {
            return self.flank.curve_point(position);
        }
        let lobes = position.lobes;
        let beside_rad = BESIDE_SHARE_OF_HALF_LOBE * half_lobe_rad(lobes);
        let tangent = |psi: f64| self.at(Position::from_lobe(psi, lobes), is_relieved).map(|at| at.tangent);
        let before = tangent((position.from_lobe_rad - beside_rad).max(from.from_lobe_rad))?;
        let behind = tangent((position.from_lobe_rad + beside_rad).min(to.from_lobe_rad))?;
        let at = self.at(position, is_relieved)?;
        let point = on_circle(at.radius_mm, at.angle_rad);
        Ok(CurvePoint { point, tangent: at.tangent, bend: before.perp(&behind) })
    }

    /// Returns the largest radius from start to end. The flank falls from its start, and an outward relief may raise it
    /// again. With a power below two it does so immediately, so the search also samples ever closer to the start of the
    /// relief.
    fn outermost_radius_mm(&self, start: Position, end: Position) -> Result<f64, NotConverged> {
        let root_mm = if start.from_lobe_rad > 0.0 {
            self.at(start, self.relief.is_some_and(|relief| start.from_lobe_rad > relief.start_rad))?.radius_mm
        } else {
            self.flank.root_radius_mm() + self.path_shift_mm + self.profile_shift_mm
        };
        let Some(relief) = self.relief.filter(|relief| relief.amount_mm > 0.0) else { return Ok(root_mm) };
        let first_rad = relief.start_rad.max(start.from_lobe_rad);
        let length_rad = end.from_lobe_rad - first_rad;
        if length_rad <= 0.0 {
            return Ok(root_mm);
        }
        let radius_mm = |beyond_rad: f64| {
            let position = Position::from_lobe((first_rad + beyond_rad).min(end.from_lobe_rad), end.lobes);
            self.at(position, true).map(|at| at.radius_mm)
        };
        let near = (0..HALVINGS).map(|i| length_rad * 0.5_f64.powi(HALVINGS - i) / f64::from(PLACES));
        let far = (1..=PLACES).map(|i| length_rad * (f64::from(i) / f64::from(PLACES)));
        let places: Vec<f64> = std::iter::once(0.0).chain(near).chain(far).collect();
        let radii_mm = places.iter().map(|&beyond_rad| radius_mm(beyond_rad)).collect::<Result<Vec<_>, _>>()?;
        let mut most_mm = radii_mm.iter().copied().fold(root_mm, f64::max);
        for (around, radii_mm) in places.windows(3).zip(radii_mm.windows(3)) {
            if radii_mm[1] >= radii_mm[0] && radii_mm[1] >= radii_mm[2] {
                // With both signs turned, the maximum is a minimum.
                let (least, _) = golden_section(-around[2], -around[0], SECTIONS, |x| Ok(-radius_mm(-x)?))?;
                most_mm = most_mm.max(-least);
            }
        }
        // Excess over the root by rounding alone is ignored.
        Ok(if most_mm > ROUNDED * root_mm { most_mm } else { root_mm })
    }

    /// Finds the start and the end of the flank; none if nothing is left.
    fn space(self, end_by_distance: FlankEnd, bore_mm: Option<f64>) -> Result<Option<ToothSpace>, NotConverged> {
        let lobes = self.flank.locus().lobes();
        let half_rad = half_lobe_rad(lobes);
        // By the angle from the valley, each position exact from its nearer end.
        let place = |x: f64| {
            if x < 0.5 * half_rad { Position::from_valley(x, lobes) } else { Position::from_lobe(half_rad - x, lobes) }
        };
        let places = || (1..=PLACES).map(move |i| half_rad * (f64::from(PLACES - i) / f64::from(PLACES)));
        let relieved = |position: Position| {
            self.at(position, self.relief.is_some_and(|relief| position.from_lobe_rad > relief.start_rad))
        };
        // Flanks that are rotated towards each other start at their crossing in the middle of the space.
        let mut start = Position::lobe(lobes);
        if self.turned_rad < 0.0 {
            let mut beyond = None;
            for x in places() {
                if relieved(place(x))?.angle_rad > 0.0 {
                    beyond = Some(x);
                    break;
                }
            }
            let Some(beyond) = beyond else { return Ok(None) };
            let angle = |psi: f64| Ok(relieved(Position::from_lobe(psi, lobes))?.angle_rad);
            let psi = bracketed("start of a turned flank", 0.0, self.turned_rad, half_rad - beyond, angle)?;
            start = Position::from_lobe(psi, lobes);
        }
        // Quantity that stays positive along the flank, for each possible end. Flanks that are rotated apart cross on
        // the symmetry line of the ring's tooth. Flanks that are rotated together still end where they would cross
        // without rotation. Division by the sine removes the trivial crossing at a regular tip, as in
        // `RingFlank::natural_limit`.
        let is_turned_together = self.turned_rad < 0.0;
        let margin = |end: FlankEnd, position: Position| {
            let at = relieved(position)?;
            Ok(match end {
                FlankEnd::Undercut if self.turned_rad > 0.0 => at.angle_from_tip_rad,
                FlankEnd::Undercut if position.from_valley_rad > 0.0 => {
                    (at.angle_from_tip_rad + self.turned_rad) / position.phase_cos
                }
                FlankEnd::Undercut => 2.0 / f64::from(lobes) * at.speed_mm / (at.radius_mm - self.profile_shift_mm),
                FlankEnd::Bore => at.radius_mm - bore_mm.unwrap_or(0.0),
                // Beyond a cusp the curve runs backwards.
                FlankEnd::RegularTip => at.speed_mm,
            })
        };
        // If the flank outlasts the drive's own, a relief continues by its power and may leave the ring there.
        let relief_mm = self.relief.map_or(0.0, |relief| relief.amount_mm.max(0.0));
        let most_mm = self.flank.root_radius_mm() + self.path_shift_mm + self.profile_shift_mm + relief_mm;
        let is_flank =
            |at: &ShapedPoint| at.distance_mm > 0.0 && at.radius_mm > 0.0 && at.radius_mm <= ROUNDED * most_mm;
        if !is_flank(&relieved(start)?) {
            return Ok(None);
        }
        for end in ENDS {
            if margin(end, start)? <= 0.0 {
                return Ok(None);
            }
        }
        let mut found = None;
        let mut before = start.from_valley_rad;
        for x in places().filter(|&x| x < start.from_valley_rad) {
            if !is_flank(&relieved(place(x))?) {
                return Ok(None);
            }
            for end in ENDS {
                let value = margin(end, place(x))?;
                if value < 0.0 {
                    let at = bracketed("end of a modified flank", x, value, before, |x| margin(end, place(x)))?;
                    if found.is_none_or(|(other, _)| at > other) {
                        found = Some((at, end));
                    }
                }
            }
            if found.is_some() {
                break;
            }
            before = x;
        }
        let end = found.map_or(Position::valley(lobes), |(x, _)| place(x));
        let kind = found.map(|(_, kind)| kind);
        let radius_mm = match (kind, bore_mm) {
            (Some(FlankEnd::Bore), Some(bore_mm)) => bore_mm,
            _ => relieved(end)?.radius_mm,
        };
        let has_land = is_turned_together || kind.is_some_and(|kind| kind != FlankEnd::Undercut);
        let outermost_radius_mm = self.outermost_radius_mm(start, end)?;
        let tip = Tip { radius_mm, has_land };
        Ok(Some(ToothSpace { flank: self, start, end, end_by_distance, tip, outermost_radius_mm }))
    }
}
