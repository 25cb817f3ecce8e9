//! Approximation of curves by few arcs with common tangents, for formats with lines and arcs only
//! (docs/explanation/theory.md section 8).

use nalgebra::{Point2, Unit, Vector2};

use crate::profile::SampledCurve;
use crate::spline;

/// Largest distance between an arc and the points of a curve, as a share of the tolerance. The rest is for the curve
/// between two points, which differs from their chord by about a sixteenth of the tolerance.
const SHARE_AT_POINTS: f64 = 0.9;

/// Largest bulge that is drawn: a quarter of a circle.
const GREATEST_BULGE: f64 = std::f64::consts::SQRT_2 - 1.0;

/// Start of an arc, which ends at the start of the next one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ArcStart {
    /// Start point.
    pub point: Point2<f64>,
    /// Tangent of a quarter of the arc's angle, counter-clockwise positive; 0 is a line.
    pub bulge: f64,
}

/// Returns arcs along a curve, within a tolerance of it.
pub(crate) fn arcs(curve: &SampledCurve, tolerance_mm: f64) -> Vec<ArcStart> {
    let SampledCurve { points, tangents } = curve;
    let biarc = |from: usize, to: usize| Biarc::new([points[from], points[to]], [tangents[from], tangents[to]]);
    let is_one = |from: usize, to: usize| {
        biarc(from, to).is_some_and(|biarc| {
            points[from + 1..to].iter().all(|&point| biarc.distance_mm(point) <= SHARE_AT_POINTS * tolerance_mm)
        })
    };
    let ends = spline::ends_of_pieces(points.len() - 1, is_one);
    let of_piece = |ends: &[usize]| match biarc(ends[0], ends[1]) {
        Some(biarc) => biarc.arcs().to_vec(),
        None => vec![ArcStart { point: points[ends[0]], bulge: 0.0 }],
    };
    ends.windows(2).flat_map(of_piece).collect()
}

/// Biarc: two arcs between two points with given directions, with tangents of equal length.
struct Biarc {
    ends: [Point2<f64>; 2],
    tangents: [Unit<Vector2<f64>>; 2],
    joint: Point2<f64>,
    /// Tangent direction at the joint, of any length.
    along: Vector2<f64>,
}

impl Biarc {
    /// Returns the biarc. None if an arc would be more than a quarter of a circle.
    fn new(ends: [Point2<f64>; 2], tangents: [Unit<Vector2<f64>>; 2]) -> Option<Self> {
        let [start, end] = ends;
        let [from, to] = tangents.map(Unit::into_inner);
        let chord = end - start;
        // The length d of the tangents follows from `|chord - d (from + to)| = 2 d`.
        let along = chord.dot(&(from + to));
        let reach_mm = chord.norm_squared() / (along + along.hypot((to - from).norm() * chord.norm()));
        let [before, behind] = [start + reach_mm * from, end - reach_mm * to];
        let biarc = Self { ends, tangents, joint: nalgebra::center(&before, &behind), along: behind - before };
        biarc.arcs().iter().all(|arc| arc.bulge.abs() <= GREATEST_BULGE).then_some(biarc)
    }

    fn arcs(&self) -> [ArcStart; 2] {
        let [start, end] = self.ends;
        let [from, to] = &self.tangents;
        // A quarter of an arc's angle is half of the angle between chord and tangent.
        let [first, second] = [self.joint - start, end - self.joint];
        let bulge = |chord: Vector2<f64>, sine: f64, tangent: &Vector2<f64>| sine / (chord.norm() + chord.dot(tangent));
        [
            ArcStart { point: start, bulge: bulge(first, from.perp(&first), from) },
            ArcStart { point: self.joint, bulge: bulge(second, second.perp(to), to) },
        ]
    }

    /// Returns the distance of a point from the circle of the nearer arc.
    fn distance_mm(&self, point: Point2<f64>) -> f64 {
        let end = usize::from((point - self.joint).dot(&self.along) > 0.0);
        let tangent = &self.tangents[end];
        let chord = self.joint - self.ends[end];
        let curvature = 2.0 * tangent.perp(&chord) / chord.norm_squared();
        let off = point - self.ends[end];
        // On a circle through the end, `tangent × off = curvature off²/2`. The distance from it has no cancellation for
        // a flat arc.
        let excess_mm = tangent.perp(&off) - 0.5 * curvature * off.norm_squared();
        2.0 * excess_mm.abs() / (1.0 + (1.0 - 2.0 * curvature * excess_mm).max(0.0).sqrt())
    }
}
