//! Outlines of the parts' sections: circles, and closed paths of lines, arcs and sampled curves (docs/explanation/theory.md section 8).

use nalgebra::{Point2, Rotation2, Unit, Vector2};

use crate::arcs::{self, ArcStart};
use crate::profile::{Polyline, SampledCurve};
use crate::spline;

/// Largest distance of polynomials from their curve, as a share of the chord tolerance. With it, solids of tolerance
/// 1e-3 mm touch each other within 10 nm.
pub const SPLINE_SHARE_OF_CHORD: f64 = 0.01;

/// Curve points per chord of the drawing, used to fit and check polynomials. Where a tip bends most, the chord points
/// alone are too few to define the curve between them.
pub(crate) const POINTS_PER_CHORD: u32 = 4;

/// Closed path. Each edge starts exactly at the end point of the edge before, the first at that of the last.
#[derive(Debug, Clone, PartialEq)]
pub enum Outline {
    /// A circle.
    Circle {
        /// Centre of the circle.
        center: Point2<f64>,
        /// Radius of the circle.
        radius_mm: f64,
    },
    /// Edges, in counter-clockwise order.
    Edges(Vec<Edge>),
}

/// Edge of an outline.
#[derive(Debug, Clone, PartialEq)]
pub enum Edge {
    /// A straight line.
    Line {
        /// Start point.
        start: Point2<f64>,
        /// End point.
        end: Point2<f64>,
    },
    /// An arc of a circle around the origin.
    Arc {
        /// Start point.
        start: Point2<f64>,
        /// End point.
        end: Point2<f64>,
        /// Radius of the circle.
        radius_mm: f64,
        /// Angle of the arc, counter-clockwise positive, at most one full turn.
        sweep_rad: f64,
    },
    /// A smooth curve through exact points, with chords within the tolerance.
    Curve {
        /// The points, both ends included.
        points: Polyline,
        /// Direction at the first point.
        start_tangent: Unit<Vector2<f64>>,
        /// Direction at the last point.
        end_tangent: Unit<Vector2<f64>>,
        /// Control polygons of consecutive Bézier polynomials with a common tangent, within [`SPLINE_SHARE_OF_CHORD`]
        /// of the tolerance.
        polynomials: Vec<Polyline>,
        /// Consecutive arcs with a common tangent, within the tolerance.
        arcs: Vec<ArcStart>,
    },
}

impl Edge {
    /// Returns the start point.
    pub fn start(&self) -> Point2<f64> {
        match self {
            Self::Line { start, .. } | Self::Arc { start, .. } => *start,
            Self::Curve { points, .. } => points.first().copied().unwrap_or_default(),
        }
    }

    /// Returns the end point.
    pub fn end(&self) -> Point2<f64> {
        match self {
            Self::Line { end, .. } | Self::Arc { end, .. } => *end,
            Self::Curve { points, .. } => points.last().copied().unwrap_or_default(),
        }
    }

    /// Returns the edge rotated about the origin.
    pub(crate) fn turned(&self, rotation: &Rotation2<f64>) -> Self {
        let tangent = |tangent: &Unit<Vector2<f64>>| Unit::new_unchecked(rotation * tangent.into_inner());
        let turned = |points: &Polyline| -> Polyline { points.iter().map(|point| rotation * point).collect() };
        match self {
            Self::Line { start, end } => Self::Line { start: rotation * start, end: rotation * end },
            Self::Arc { start, end, radius_mm, sweep_rad } => {
                Self::Arc { start: rotation * start, end: rotation * end, radius_mm: *radius_mm, sweep_rad: *sweep_rad }
            }
            Self::Curve { points, start_tangent, end_tangent, polynomials, arcs } => Self::Curve {
                points: turned(points),
                start_tangent: tangent(start_tangent),
                end_tangent: tangent(end_tangent),
                polynomials: polynomials.iter().map(turned).collect(),
                arcs: arcs.iter().map(|arc| ArcStart { point: rotation * arc.point, bulge: arc.bulge }).collect(),
            },
        }
    }

    /// Creates a curve from points with [`POINTS_PER_CHORD`].
    pub(crate) fn curve(sampled: &SampledCurve, chord_tolerance_mm: f64) -> Self {
        let SampledCurve { points, tangents } = sampled;
        Self::Curve {
            points: ends_of_chords(points),
            start_tangent: tangents[0],
            end_tangent: tangents[tangents.len() - 1],
            polynomials: spline::polygons(sampled, SPLINE_SHARE_OF_CHORD * chord_tolerance_mm),
            arcs: arcs::arcs(sampled, chord_tolerance_mm),
        }
    }

    /// Moves the end of a curve exactly to the start of the next edge.
    pub(crate) fn end_at(&mut self, next: Point2<f64>) {
        if let Self::Curve { points, polynomials, .. } = self {
            for polygon in polynomials.last_mut().into_iter().chain([points]) {
                polygon.pop();
                polygon.push(next);
            }
        }
    }
}

impl Outline {
    /// Returns a circle around the origin.
    pub(crate) const fn circle(radius_mm: f64) -> Self {
        Self::Circle { center: Point2::new(0.0, 0.0), radius_mm }
    }
}

/// Returns the number of chords of a curve with [`POINTS_PER_CHORD`].
pub(crate) const fn chords(points: &Polyline) -> usize {
    (points.len() - 1) / POINTS_PER_CHORD as usize
}

pub(crate) fn ends_of_chords(points: &Polyline) -> Polyline {
    points.iter().step_by(POINTS_PER_CHORD as usize).copied().collect()
}
