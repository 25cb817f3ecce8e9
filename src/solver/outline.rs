//! Outlines of the parts' sections: circles, and closed paths of lines, arcs and sampled curves (docs/explanation/theory.md section 8).

use nalgebra::{Point2, Rotation2, Unit, Vector2};

use crate::arcs::{self, ArcStart};
use crate::profile::{Polyline, SampledCurve, on_circle};
use crate::spline;

/// Largest distance of polynomials from their curve, as a share of the chord tolerance. With it, solids of tolerance
/// 1e-3 mm touch each other within 10 nm.
pub const SPLINE_SHARE_OF_CHORD: f64 = 0.01;

/// Curve points per chord of the drawing, used to fit and check polynomials. Where a tip bends most, the chord points
/// alone are too few to define the curve between them.
pub(crate) const POINTS_PER_CHORD: u32 = 4;

/// Closed path. Each edge starts exactly at the end point of the edge before, the first at that of the last. Edges are
/// counter-clockwise.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "document", derive(serde::Serialize, utoipa::ToSchema))]
#[cfg_attr(feature = "document", serde(tag = "kind", rename_all = "snake_case"), schema(as = OutlineAnswer))]
pub enum Outline {
    /// A circle around the origin.
    Circle {
        /// Radius of the circle.
        radius_mm: f64,
    },
    /// Consecutive edges.
    Path {
        /// The edges.
        edges: Vec<Edge>,
    },
}

/// Edge of an outline.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "document", derive(serde::Serialize, utoipa::ToSchema))]
#[cfg_attr(feature = "document", serde(tag = "kind", rename_all = "snake_case"), schema(as = EdgeAnswer))]
pub enum Edge {
    /// A straight line between two points.
    Line {
        /// x of the two ends.
        x_mm: [f64; 2],
        /// y of the two ends.
        y_mm: [f64; 2],
    },
    /// An arc of a circle.
    Arc {
        /// x of its start, its middle and its end.
        x_mm: [f64; 3],
        /// y of its start, its middle and its end.
        y_mm: [f64; 3],
        /// x and y of the circle's centre.
        center_mm: [f64; 2],
        /// Radius of the circle.
        radius_mm: f64,
        /// Angle of the arc, counter-clockwise positive.
        sweep_deg: f64,
    },
    /// A smooth curve through exact points, with chords within the chord tolerance. Interpolate it, or use the chords.
    Curve {
        /// x of the points.
        x_mm: Vec<f64>,
        /// y of the points.
        y_mm: Vec<f64>,
        /// Direction at the first point, from the x axis.
        start_tangent_deg: f64,
        /// Direction at the last point.
        end_tangent_deg: f64,
        /// Control polygons of consecutive Bézier polynomials with a common tangent, within [`SPLINE_SHARE_OF_CHORD`]
        /// of the tolerance, that replace the curve in solids.
        #[cfg_attr(feature = "document", serde(skip))]
        polynomials: Vec<Polyline>,
        /// Consecutive arcs with a common tangent, within the tolerance, that replace the curve in DXF.
        #[cfg_attr(feature = "document", serde(skip))]
        arcs: Vec<ArcStart>,
    },
}

impl Edge {
    pub(crate) fn line(start: Point2<f64>, end: Point2<f64>) -> Self {
        Self::Line { x_mm: [start.x, end.x], y_mm: [start.y, end.y] }
    }

    /// Creates an arc around the origin, at most one full turn.
    pub(crate) fn arc(start: Point2<f64>, end: Point2<f64>, radius_mm: f64, sweep_rad: f64) -> Self {
        let middle = on_circle(radius_mm, start.y.atan2(start.x) + 0.5 * sweep_rad);
        Self::Arc {
            x_mm: [start.x, middle.x, end.x],
            y_mm: [start.y, middle.y, end.y],
            center_mm: [0.0; 2],
            radius_mm,
            sweep_deg: sweep_rad.to_degrees(),
        }
    }

    /// Returns x and y of the points, which are on the edge, from start to end.
    pub fn points(&self) -> impl DoubleEndedIterator<Item = [f64; 2]> + ExactSizeIterator {
        let (x_mm, y_mm) = match self {
            Self::Line { x_mm, y_mm } => (&x_mm[..], &y_mm[..]),
            Self::Arc { x_mm, y_mm, .. } => (&x_mm[..], &y_mm[..]),
            Self::Curve { x_mm, y_mm, .. } => (&x_mm[..], &y_mm[..]),
        };
        x_mm.iter().zip(y_mm).map(|(&x, &y)| [x, y])
    }

    /// Returns the start point.
    pub fn start(&self) -> [f64; 2] {
        self.points().next().unwrap_or_default()
    }

    /// Returns the end point.
    pub fn end(&self) -> [f64; 2] {
        self.points().next_back().unwrap_or_default()
    }
}

/// Curve of an outline, before it is placed.
pub(crate) struct Curve {
    pub(crate) points: Polyline,
    /// Directions at the first point and at the last one.
    pub(crate) tangents: [Unit<Vector2<f64>>; 2],
    pub(crate) polynomials: Vec<Polyline>,
    pub(crate) arcs: Vec<ArcStart>,
}

impl Curve {
    /// Creates a curve from points with [`POINTS_PER_CHORD`].
    pub(crate) fn new(sampled: &SampledCurve, chord_tolerance_mm: f64) -> Self {
        let SampledCurve { points, tangents } = sampled;
        Self {
            points: ends_of_chords(points),
            tangents: [tangents[0], tangents[tangents.len() - 1]],
            polynomials: spline::polygons(sampled, SPLINE_SHARE_OF_CHORD * chord_tolerance_mm),
            arcs: arcs::arcs(sampled, chord_tolerance_mm),
        }
    }

    /// Returns the curve rotated about the origin.
    pub(crate) fn turned(&self, rotation: &Rotation2<f64>) -> Self {
        let turned = |points: &Polyline| -> Polyline { points.iter().map(|point| rotation * point).collect() };
        Self {
            points: turned(&self.points),
            tangents: self.tangents.map(|tangent| Unit::new_unchecked(rotation * tangent.into_inner())),
            polynomials: self.polynomials.iter().map(turned).collect(),
            arcs: self.arcs.iter().map(|arc| ArcStart { point: rotation * arc.point, bulge: arc.bulge }).collect(),
        }
    }

    /// Moves the end exactly to the start of the next edge.
    pub(crate) fn end_at(&mut self, next: Point2<f64>) {
        for points in self.polynomials.last_mut().into_iter().chain([&mut self.points]) {
            points.pop();
            points.push(next);
        }
    }
}

impl From<Curve> for Edge {
    fn from(Curve { points, tangents, polynomials, arcs }: Curve) -> Self {
        let [start_tangent_deg, end_tangent_deg] = tangents.map(|tangent| tangent.y.atan2(tangent.x).to_degrees());
        Self::Curve {
            x_mm: points.iter().map(|point| point.x).collect(),
            y_mm: points.iter().map(|point| point.y).collect(),
            start_tangent_deg,
            end_tangent_deg,
            polynomials,
            arcs,
        }
    }
}

/// Returns the number of chords of a curve with [`POINTS_PER_CHORD`].
pub(crate) const fn chords(points: &Polyline) -> usize {
    (points.len() - 1) / POINTS_PER_CHORD as usize
}

pub(crate) fn ends_of_chords(points: &Polyline) -> Polyline {
    points.iter().step_by(POINTS_PER_CHORD as usize).copied().collect()
}
