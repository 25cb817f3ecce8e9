//! Profiles of the mating parts, sampled to a chord tolerance.

use std::f64::consts::PI;

use nalgebra::{Point2, Rotation2, Unit, Vector2};

use crate::cam::{CurvePoint, Kind};
use crate::drive::Drive;
use crate::position::{Position, half_lobe_rad};
use crate::ring::{FlankEnd, RingFlank};
use crate::root::NotConverged;
use crate::{SolveError, Stop};

/// A polyline in mm.
pub type Polyline = Vec<Point2<f64>>;

/// Part of the ring to draw.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "document", derive(serde::Serialize, serde::Deserialize, utoipa::ToSchema))]
#[cfg_attr(feature = "document", serde(rename_all = "snake_case"), schema(as = ExtentDocument))]
pub enum Extent {
    /// From one tooth's symmetry line to the next, angles ∓π/Z_K, so that copies join.
    #[default]
    Tooth,
    /// The closed ring, its last point equal to its first.
    Full,
}

/// The sampling of profiles.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "document", derive(serde::Serialize, serde::Deserialize, utoipa::ToSchema))]
#[cfg_attr(feature = "document", serde(deny_unknown_fields, default, expecting = "an object"), schema(as = ProfileDocument))]
pub struct ProfileParameters {
    /// Largest distance of a chord from its curve, in mm. Default: 0.001 mm.
    pub chord_tolerance_mm: f64,
    /// Part of the ring to draw: one tooth or the full ring. Default: one tooth.
    pub extent: Extent,
    /// Largest number of points over all profiles.
    #[cfg_attr(feature = "document", serde(skip))]
    pub max_points: u64,
}

impl Default for ProfileParameters {
    fn default() -> Self {
        Self { chord_tolerance_mm: 1e-3, extent: Extent::default(), max_points: u64::MAX }
    }
}

/// Profiles of the mating parts.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Profiles {
    /// The ring, in its own frame.
    pub ring: Polyline,
    /// The path of the teeth's centres, in the ring's frame.
    pub tooth_center_path: Polyline,
    /// The closed wave generator, in its own frame.
    pub wave_generator: Polyline,
}

/// Sampling density of a curve.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Density {
    /// Chord tolerance, in mm.
    pub(crate) tolerance_mm: f64,
    /// Points for each chord: a denser sample has exactly this many times the points.
    pub(crate) points_per_chord: u32,
    /// Limit of chords for a whole outline, applied to each of its curves.
    pub(crate) max_chords: u64,
}

/// A sampled curve with its direction at each point.
pub(crate) struct SampledCurve {
    pub(crate) points: Polyline,
    pub(crate) tangents: Vec<Unit<Vector2<f64>>>,
}

/// Initial number of pieces of half a lobe: so short that no tangent is perpendicular to its chord.
const PIECES: u32 = 16;

/// Largest number of bisections of a piece: 2^40 chords are beyond every tolerance in the range.
const MAX_DEPTH: u32 = 40;

/// Returns the profiles of a drive.
///
/// ```
/// use toothwave_solver::profile::{Extent, ProfileParameters, profiles};
/// # use toothwave_solver::{Drive, DriveParameters, Never};
/// let drive = Drive::new(&DriveParameters::default()).unwrap();
///
/// let parameters = ProfileParameters { extent: Extent::Full, ..ProfileParameters::default() };
/// let ring = profiles(&drive, &parameters, &Never).unwrap().ring;
/// assert_eq!(ring.first(), ring.last());
/// ```
///
/// # Errors
/// [`SolveError::TooManyPoints`], [`SolveError::Stopped`], and [`SolveError::NotConverged`] from the geometry.
pub fn profiles(drive: &Drive, parameters: &ProfileParameters, stop: &dyn Stop) -> Result<Profiles, SolveError> {
    let ring_teeth = drive.parameters().ring_teeth.unsigned_abs();
    let &ProfileParameters { chord_tolerance_mm: tolerance_mm, extent, max_points } = parameters;
    let density = Density { tolerance_mm, points_per_chord: 1, max_chords: max_points };
    let flank = ring_half_tooth(drive, density, stop)?;
    let path = path_half_tooth(drive, density, stop)?;
    let half_lobe = cam_half_lobe(drive.flank().locus(), 0.0, density, stop)?.points;

    let copies = match extent {
        Extent::Tooth => 1,
        Extent::Full => ring_teeth,
    };
    let spans = |half: &Polyline| 2 * (half.len() as u64 - 1);
    let points = copies * (spans(&flank) + spans(&path)) + u64::from(drive.lobes()) * spans(&half_lobe) + 3;
    if points > max_points {
        return Err(SolveError::TooManyPoints { points, limit: max_points });
    }
    Ok(Profiles {
        ring: repeated(&from_tip_to_tip(&flank), ring_teeth, extent),
        tooth_center_path: repeated(&from_tip_to_tip(&path), ring_teeth, extent),
        wave_generator: closed(&cam_outline(&half_lobe, drive.lobes())),
    })
}

/// Estimates the number of points of the profiles, at most [`ProfileParameters::max_points`]. It is an upper bound.
pub fn expected_points(drive: &Drive, parameters: &ProfileParameters) -> u64 {
    let tolerance_mm = parameters.chord_tolerance_mm;
    // For a curve that rotates by κ ds, the height of a chord's tangents is c²κ/4, and bisection leaves chords at least
    // half as long as allowed. Their number is about ∫ √(κ/t) ds, by Cauchy and Schwarz at most √(∫κ ds · L / t).
    let chords = |turned_rad: f64, length_mm: f64| f64::from(PIECES) + (turned_rad * length_mm / tolerance_mm).sqrt();
    let ring_teeth = drive.parameters().ring_teeth.unsigned_abs();
    let lobes = f64::from(drive.lobes());
    let (root_mm, height_mm) = (drive.root_radius_mm(), drive.root_radius_mm() - drive.tip_radius_mm());
    // Half a profile rises and falls by at most its arc and its height; its slope starts and ends at zero.
    let half = |parts: f64| chords(PI + PI / parts, PI * root_mm / parts + height_mm);
    let copies = match parameters.extent {
        Extent::Tooth => 1.0,
        Extent::Full => ring_teeth as f64,
    };
    let points = 2.0 * (2.0 * copies * half(ring_teeth as f64) + lobes * half(lobes));
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "whole enough, and saturating; not negative"
    )]
    let points = points as u64;
    points.min(parameters.max_points)
}

/// Returns the ring from the middle of its tooth space to its tooth's symmetry line, including the land of a bored tip.
fn ring_half_tooth(drive: &Drive, density: Density, stop: &dyn Stop) -> Result<Polyline, SolveError> {
    let mut points = flank_curve(drive.flank(), drive.flank_limit().position, density, stop)?;
    let tip_rad = PI / drive.parameters().ring_teeth as f64;
    match drive.flank_limit().end {
        FlankEnd::RegularTip | FlankEnd::Undercut => {
            points.pop();
        }
        FlankEnd::Bore => {
            let radius_mm = drive.tip_radius_mm();
            let start_rad = points.last().map_or(0.0, |point| point.y.atan2(point.x));
            let land_rad = tip_rad - start_rad;
            // A chord over the angle 4 asin(√(t/2R)) is t away from its arc.
            let step_rad = 4.0 * (0.5 * density.tolerance_mm / radius_mm).min(1.0).sqrt().asin();
            let steps = (land_rad / step_rad).ceil().max(1.0);
            let mut step = 1.0;
            while step < steps {
                points.push(on_circle(radius_mm, start_rad + land_rad * (step / steps)));
                step += 1.0;
            }
        }
    }
    points.push(on_circle(drive.tip_radius_mm(), tip_rad));
    Ok(points)
}

/// Returns the ring's flank from the middle of its tooth space to a position.
fn flank_curve(flank: &RingFlank, end: Position, density: Density, stop: &dyn Stop) -> Result<Polyline, SolveError> {
    let start = Position::lobe(flank.locus().lobes());
    Ok(sampled(start, end, density, stop, |position| flank.curve_point(position))?.points)
}

/// Returns the path of a tooth's centre from the middle of the tooth space to the symmetry line of the ring's tooth.
fn path_half_tooth(drive: &Drive, density: Density, stop: &dyn Stop) -> Result<Polyline, SolveError> {
    let (flank, p) = (drive.flank(), drive.parameters());
    let path = flank.at_distance(0.0);
    let mut points = flank_curve(&path, Position::valley(drive.lobes()), density, stop)?;
    points.pop();
    let valley_mm = flank.locus().cam_inner_radius_mm() + p.tooth_radius_mm;
    points.push(on_circle(valley_mm, PI / p.ring_teeth as f64));
    Ok(points)
}

/// Returns the wave generator from the middle of a lobe to the adjacent valley, offset inward by less than its least
/// radius of curvature.
pub(crate) fn cam_half_lobe(
    locus: &dyn Kind,
    clearance_mm: f64,
    density: Density,
    stop: &dyn Stop,
) -> Result<SampledCurve, SolveError> {
    let lobes = locus.lobes();
    let outline = |place| locus.outline(clearance_mm, place);
    let mut curve = sampled(Position::lobe(lobes), Position::valley(lobes), density, stop, outline)?;
    // The last point is on the valley's line.
    if let Some(last) = curve.points.last_mut() {
        *last = Point2::from(last.coords.norm() * direction(1, 2 * lobes));
    }
    Ok(curve)
}

/// Returns all half lobes of the wave generator from one: mirrored at the valley, then rotated from lobe to lobe. Each
/// starts exactly at the end of the one before, the first at that of the last.
pub(crate) fn cam_half_lobes(half_lobe: &Polyline, lobes: u32) -> Vec<Polyline> {
    let pitch = direction(1, lobes);
    // Adding zero turns -0.0 into 0.0.
    let mirror =
        |p: &Point2<f64>| Point2::new(pitch.x * p.x + pitch.y * p.y + 0.0, pitch.y * p.x - pitch.x * p.y + 0.0);
    let mirrored: Polyline = half_lobe.iter().rev().map(mirror).collect();
    let mut start = half_lobe[0];
    let halves = (0..2 * lobes).map(|index| {
        let half = if index % 2 == 0 { half_lobe } else { &mirrored };
        let at = direction(index / 2, lobes);
        let turn = |p: &Point2<f64>| Point2::new(at.x * p.x - at.y * p.y + 0.0, at.y * p.x + at.x * p.y + 0.0);
        let mut points: Polyline = if index < 2 { half.clone() } else { half.iter().map(turn).collect() };
        let last = points.len() - 1;
        points[0] = start;
        if index + 1 == 2 * lobes {
            points[last] = half_lobe[0];
        }
        start = points[last];
        points
    });
    halves.collect()
}

/// Returns the closed wave generator from half a lobe.
fn cam_outline(half_lobe: &Polyline, lobes: u32) -> Polyline {
    let halves = cam_half_lobes(half_lobe, lobes);
    half_lobe[..1].iter().chain(halves.iter().flat_map(|half| &half[1..])).copied().collect()
}

/// Returns the direction at a fraction of a turn, exact on the axes.
pub(crate) fn direction(numerator: u32, denominator: u32) -> Vector2<f64> {
    let quarters = 4 * u64::from(numerator);
    let whole = u64::from(denominator);
    if quarters.is_multiple_of(whole) {
        return match quarters / whole % 4 {
            0 => Vector2::new(1.0, 0.0),
            1 => Vector2::new(0.0, 1.0),
            2 => Vector2::new(-1.0, 0.0),
            _ => Vector2::new(0.0, -1.0),
        };
    }
    let (sin, cos) = (2.0 * PI * (f64::from(numerator) / f64::from(denominator))).sin_cos();
    Vector2::new(cos, sin)
}

pub(crate) fn on_circle(radius_mm: f64, angle_rad: f64) -> Point2<f64> {
    let (sin, cos) = angle_rad.sin_cos();
    Point2::new(radius_mm * cos, radius_mm * sin)
}

/// Samples the curve over positions from `start` to `end`, both included, by bisection until each chord is in
/// tolerance.
pub(crate) fn sampled(
    start: Position,
    end: Position,
    Density { tolerance_mm, points_per_chord, max_chords }: Density,
    stop: &dyn Stop,
    curve: impl Fn(Position) -> Result<CurvePoint, NotConverged>,
) -> Result<SampledCurve, SolveError> {
    // Measured from the valley, where cusps are. Beyond the middle a `Position` is as precise from the other side.
    let (lobes, half_rad) = (start.lobes, half_lobe_rad(start.lobes));
    let at = |x: f64| {
        if x <= end.from_valley_rad {
            curve(end)
        } else if x < 0.5 * half_rad {
            curve(Position::from_valley(x, lobes))
        } else {
            curve(Position::from_lobe(half_rad - x, lobes))
        }
    };
    let span = start.from_valley_rad - end.from_valley_rad;
    let mut from = (start.from_valley_rad, curve(start)?);
    let mut curve_points = vec![from.1];
    let mut chords = 0;
    let mut arc = Vec::new();
    for piece in 1..=PIECES {
        let x = start.from_valley_rad - span * (f64::from(piece) / f64::from(PIECES));
        let mut pending = vec![(x.max(end.from_valley_rad), at(x)?, 0)];
        while let Some(to) = pending.pop() {
            let (x, to_point, depth) = to;
            arc.clear();
            if depth == MAX_DEPTH || chord_deviation_mm(&from.1, &to_point) <= tolerance_mm {
                arc.push(from.1);
                for step in 1..points_per_chord {
                    let share = f64::from(step) / f64::from(points_per_chord);
                    arc.push(at(from.0 + share * (x - from.0))?);
                }
                arc.push(to_point);
            }
            if !arc.is_empty() && (depth == MAX_DEPTH || inflections_seen(&arc) <= 1) {
                curve_points.extend(&arc[1..]);
                from = (x, to_point);
                chords += 1;
                if chords > max_chords {
                    return Err(SolveError::TooManyPoints { points: chords, limit: max_chords });
                }
            } else {
                if stop.stopped() {
                    return Err(SolveError::Stopped);
                }
                let middle = 0.5 * (from.0 + x);
                pending.push((x, to_point, depth + 1));
                pending.push((middle, at(middle)?, depth + 1));
            }
        }
    }
    let (points, tangents) = curve_points.into_iter().map(|CurvePoint { point, tangent, .. }| (point, tangent)).unzip();
    Ok(SampledCurve { points, tangents })
}

/// Counts the visible changes of the sign of curvature of an arc.
fn inflections_seen(arc: &[CurvePoint]) -> usize {
    arc.windows(2).filter(|pair| pair[0].bend * pair[1].bend < 0.0).count()
}

/// Returns an upper bound of the distance between an arc with at most one inflection and its chord
/// (docs/explanation/theory.md section 2.8).
///
/// A convex arc is within the triangle of its chord and its end tangents, whose height is `c sin α sin β / sin(α + β)`.
/// An arc with one inflection is below the tangent at one end and above that at the other, within
/// `c max(tan α, tan β)`, on either side of the chord.
fn chord_deviation_mm(from: &CurvePoint, to: &CurvePoint) -> f64 {
    let chord = to.point - from.point;
    let length = chord.norm();
    if length == 0.0 {
        return 0.0;
    }
    let direction = chord / length;
    let (sin_from, cos_from) = (direction.perp(&from.tangent), direction.dot(&from.tangent));
    let (sin_to, cos_to) = (-direction.perp(&to.tangent), direction.dot(&to.tangent));
    if cos_from <= 0.0 || cos_to <= 0.0 {
        return length;
    }
    let sin_sum = sin_from * cos_to + cos_from * sin_to;
    let is_convex = from.bend * to.bend >= 0.0 && sin_from * sin_to > 0.0;
    if is_convex {
        length * (sin_from * sin_to / sin_sum).abs()
    } else {
        length * (sin_from / cos_from).abs().max((sin_to / cos_to).abs())
    }
}

/// Returns the profile from tip to tip, counter-clockwise, from a half that starts in the middle of the tooth space.
fn from_tip_to_tip(half: &Polyline) -> Polyline {
    // Subtracting from zero avoids -0.0.
    let image = half.iter().rev().map(|p| Point2::new(p.x, 0.0 - p.y));
    image.chain(half.iter().skip(1).copied()).collect()
}

fn repeated(tooth: &Polyline, ring_teeth: u64, extent: Extent) -> Polyline {
    match extent {
        Extent::Tooth => tooth.clone(),
        Extent::Full => {
            let open = &tooth[..tooth.len() - 1];
            let turned = |copy: u64| {
                let rotation = Rotation2::new(2.0 * PI * (copy as f64 / ring_teeth as f64));
                open.iter().map(move |point| rotation * point)
            };
            closed(&(0..ring_teeth).flat_map(turned).collect())
        }
    }
}

/// Returns the same curve with its first point repeated at the end.
fn closed(curve: &Polyline) -> Polyline {
    let mut points = curve.clone();
    if let (Some(&first), Some(last)) = (points.first(), points.last())
        && *last != first
    {
        points.push(first);
    }
    points
}
