//! The mating parts' profiles, sampled to a chord tolerance.

use std::f64::consts::PI;

use nalgebra::{Point2, Rotation2, Unit, Vector2};

use crate::cam::CamPoint;
use crate::drive::Drive;
use crate::locus::Locus;
use crate::position::{Position, half_lobe_rad};
use crate::ring::{FlankEnd, FlankLimit, RingFlank};
use crate::root::NotConverged;
use crate::{SolveError, Stop};

/// A polyline in mm.
pub type Polyline = Vec<Point2<f64>>;

/// How much of the ring is wanted.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Extent {
    /// From one tooth's symmetry line to the next, angles ∓π/Z_K.
    Tooth,
    /// The closed ring, its last point equal to its first.
    Full,
}

/// What profiles are asked for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ProfileParameters {
    /// How far a chord may be from its curve.
    pub chord_tolerance_mm: f64,
    /// How much of the ring.
    pub extent: Extent,
    /// How many points at most, over all profiles.
    pub max_points: u64,
}

/// The profiles of the mating parts.
#[derive(Debug, Clone, PartialEq)]
pub struct Profiles {
    /// The ring, in its own frame.
    pub ring: Polyline,
    /// The path of the teeth's centres, in the ring's frame.
    pub tooth_center_path: Polyline,
    /// The closed wave generator, in its own frame.
    pub wave_generator: Polyline,
}

/// A point of a curve with its tangent and the way it bends.
#[derive(Debug, Clone, Copy)]
pub(crate) struct CurvePoint {
    pub(crate) point: Point2<f64>,
    pub(crate) tangent: Unit<Vector2<f64>>,
    /// Of unlike signs on either side of an inflection.
    pub(crate) bend: f64,
}

/// How densely a curve is sampled.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Density {
    /// How true its chords are.
    pub(crate) tolerance_mm: f64,
    /// Points for each of these chords, so that a denser sample has so many times the points and never more.
    pub(crate) points_per_chord: u32,
    /// How many chords are given up at: what a whole outline may have, its curves may have each.
    pub(crate) max_chords: u64,
}

impl Density {
    /// The ends of the chords alone.
    const fn of_chords(parameters: &ProfileParameters) -> Self {
        Self { tolerance_mm: parameters.chord_tolerance_mm, points_per_chord: 1, max_chords: parameters.max_points }
    }
}

/// A sampled curve with its direction at each point.
pub(crate) struct SampledCurve {
    pub(crate) points: Polyline,
    pub(crate) tangents: Vec<Unit<Vector2<f64>>>,
}

/// Pieces that half a lobe starts with, so short that no tangent stands across its chord.
const PIECES: u32 = 16;

/// Halvings of a piece at most: 2^40 chords of a piece are beyond every tolerance that the ranges allow.
const MAX_DEPTH: u32 = 40;

/// The profiles of a drive.
///
/// # Errors
/// [`SolveError::TooManyPoints`], [`SolveError::Stopped`], and [`SolveError::NotConverged`] from the geometry.
pub fn profiles(drive: &Drive, parameters: &ProfileParameters, stop: &dyn Stop) -> Result<Profiles, SolveError> {
    let ring_teeth = drive.parameters().ring_teeth.unsigned_abs();
    let density = Density::of_chords(parameters);
    let flank = ring_half_tooth(drive, density, stop)?;
    let path = path_half_tooth(drive, density, stop)?;
    let half_lobe = cam_half_lobe(drive.flank().locus(), 0.0, density, stop)?.points;

    let copies = match parameters.extent {
        Extent::Tooth => 1,
        Extent::Full => ring_teeth,
    };
    let spans = |half: &Polyline| 2 * (half.len() as u64 - 1);
    let points = copies * (spans(&flank) + spans(&path)) + u64::from(drive.lobes()) * spans(&half_lobe) + 3;
    if points > parameters.max_points {
        return Err(SolveError::TooManyPoints { points, limit: parameters.max_points });
    }
    Ok(Profiles {
        ring: repeated(&from_tip_to_tip(&flank), ring_teeth, parameters.extent),
        tooth_center_path: repeated(&from_tip_to_tip(&path), ring_teeth, parameters.extent),
        wave_generator: closed(&cam_outline(&half_lobe, drive.lobes())),
    })
}

/// About how many points the profiles have, [`ProfileParameters::max_points`] at most: no fewer than they do have, and some times as many.
pub fn expected_points(drive: &Drive, parameters: &ProfileParameters) -> u64 {
    let tolerance_mm = parameters.chord_tolerance_mm;
    // Of a curve that turns by κ ds the height of a chord's tangents is c²κ/4, and halving leaves chords down to half as long as they may
    // be: some ∫ √(κ/t) ds of them, by Cauchy and Schwarz no more than √(∫κ ds · L / t).
    let chords = |turned_rad: f64, length_mm: f64| f64::from(PIECES) + (turned_rad * length_mm / tolerance_mm).sqrt();
    let ring_teeth = drive.parameters().ring_teeth.unsigned_abs();
    let lobes = f64::from(drive.lobes());
    let (root_mm, height_mm) = (drive.root_radius_mm(), drive.root_radius_mm() - drive.tip_radius_mm());
    // A half rises and falls in no more than its arc and its height; its slope comes from nothing and goes there again.
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

/// The ring from the middle of its tooth space to its tooth's symmetry line, land of a bored tip included.
fn ring_half_tooth(drive: &Drive, density: Density, stop: &dyn Stop) -> Result<Polyline, SolveError> {
    let mut points = flank_curve(drive.flank(), drive.flank_limit(), density, stop)?.points;
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

/// The ring's flank from the middle of its tooth space to its end.
pub(crate) fn flank_curve(
    flank: &RingFlank,
    limit: &FlankLimit,
    density: Density,
    stop: &dyn Stop,
) -> Result<SampledCurve, SolveError> {
    let lobes = flank.locus().lobes();
    sampled(Position::lobe(lobes), limit.position, lobes, density, stop, |position| {
        let tooth = flank.locus().at(position)?;
        let point = flank.at(&tooth);
        Ok(CurvePoint {
            point: flank.point(&tooth, &point),
            tangent: flank.tangent(&tooth, &point),
            bend: flank.turning(&tooth),
        })
    })
}

/// The path of a tooth's centre from the middle of the tooth space to the symmetry line of the ring's tooth.
fn path_half_tooth(drive: &Drive, density: Density, stop: &dyn Stop) -> Result<Polyline, SolveError> {
    let flank = drive.flank();
    let lobes = drive.lobes();
    let mut points = sampled(Position::lobe(lobes), Position::valley(lobes), lobes, density, stop, |position| {
        let tooth = flank.locus().at(position)?;
        let point = flank.at(&tooth);
        let angle_rad = position.from_lobe_rad / flank.teeth_per_wave();
        Ok(CurvePoint {
            point: on_circle(tooth.center_radius_mm, angle_rad),
            tangent: flank.tangent(&tooth, &point),
            bend: flank.turning(&tooth),
        })
    })?
    .points;
    points.pop();
    let p = drive.parameters();
    let valley_mm = flank.locus().cam_inner_radius_mm() + p.tooth_radius_mm;
    points.push(on_circle(valley_mm, PI / p.ring_teeth as f64));
    Ok(points)
}

/// The wave generator from the middle of a lobe to the valley beside it, set back along its normal by less than its least radius of curvature.
pub(crate) fn cam_half_lobe(
    locus: &Locus,
    clearance_mm: f64,
    density: Density,
    stop: &dyn Stop,
) -> Result<SampledCurve, SolveError> {
    let lobes = locus.lobes();
    let mut curve = sampled(Position::lobe(lobes), Position::valley(lobes), lobes, density, stop, |place| {
        let CamPoint { point, tangent, bend } = locus.cam_outline(clearance_mm, place)?;
        Ok(CurvePoint { point, tangent, bend })
    })?;
    // The last point stands on the valley's line.
    if let Some(last) = curve.points.last_mut() {
        *last = Point2::from(last.coords.norm() * direction(1, 2 * lobes));
    }
    Ok(curve)
}

/// The closed wave generator from half a lobe of it: mirrored at the valley, then turned from lobe to lobe.
pub(crate) fn cam_outline(half_lobe: &Polyline, lobes: u32) -> Polyline {
    let pitch = direction(1, lobes);
    // Adding zero turns -0.0 into 0.0.
    let mirrored = half_lobe
        .iter()
        .rev()
        .skip(1)
        .map(|p| Point2::new(pitch.x * p.x + pitch.y * p.y + 0.0, pitch.y * p.x - pitch.x * p.y + 0.0));
    let lobe: Polyline = half_lobe.iter().copied().chain(mirrored).collect();
    let mut outline = lobe.clone();
    for turned in 1..lobes {
        let at = direction(turned, lobes);
        let next =
            lobe.iter().skip(1).map(|p| Point2::new(at.x * p.x - at.y * p.y + 0.0, at.y * p.x + at.x * p.y + 0.0));
        outline.extend(next);
    }
    if let Some(last) = outline.last_mut() {
        *last = half_lobe[0];
    }
    outline
}

/// The direction at a fraction of a turn, exact on the axes.
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

fn on_circle(radius_mm: f64, angle_rad: f64) -> Point2<f64> {
    let (sin, cos) = angle_rad.sin_cos();
    Point2::new(radius_mm * cos, radius_mm * sin)
}

/// The curve over positions from `start` to `end`, both included, by halving pieces until each chord is true.
pub(crate) fn sampled(
    start: Position,
    end: Position,
    lobes: u32,
    Density { tolerance_mm, points_per_chord, max_chords }: Density,
    stop: &dyn Stop,
    curve: impl Fn(Position) -> Result<CurvePoint, NotConverged>,
) -> Result<SampledCurve, SolveError> {
    // Measured from the valley, where cusps are; beyond the middle a `Position` is as good from the other side.
    let half_rad = half_lobe_rad(lobes);
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

/// How often an arc is seen to change the way it bends.
fn inflections_seen(arc: &[CurvePoint]) -> usize {
    arc.windows(2).filter(|pair| pair[0].bend * pair[1].bend < 0.0).count()
}

/// An upper bound of the distance between an arc with one inflection at most and its chord (docs/explanation/theory.md section 2.8).
///
/// A convex arc lies in the triangle of its chord and its end tangents, whose height is
/// `c sin α sin β / sin(α + β)`; an arc with one inflection stays below the tangent at one end and above that at the other, within
/// `c max(tan α, tan β)`, on whichever sides of the chord these are.
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

/// From a half that starts in the middle of the tooth space: from tip to tip, counter-clockwise.
fn from_tip_to_tip(half: &Polyline) -> Polyline {
    // Subtracting from zero, because -0.0 is no better a 0.0.
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

/// The same curve with its first point as its last.
fn closed(curve: &Polyline) -> Polyline {
    let mut points = curve.clone();
    if let (Some(&first), Some(last)) = (points.first(), points.last())
        && *last != first
    {
        points.push(first);
    }
    points
}
