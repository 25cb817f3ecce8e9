//! Outlines of the parts' sections: circles, and closed paths of lines, arcs and sampled curves (docs/explanation/theory.md section 8).

use nalgebra::{Point2, Rotation2, Unit, Vector2};

use crate::arcs::{self, ArcStart};
use crate::profile::{Polyline, SampledCurve};
use crate::spline;

/// How far polynomials may be from their curve, as a share of the chord tolerance: as little as solids of tolerance 1e-3 mm need to touch each other
/// within 10 nm.
pub const SPLINE_SHARE_OF_CHORD: f64 = 0.01;

/// Points for each chord of the drawing that polynomials are laid through and held against: where a tip bends most, points that only just carry chords
/// do not tell what the curve does between them.
pub(crate) const POINTS_PER_CHORD: u32 = 4;

/// A closed path. Each edge starts at the very point where the one before ends, the first where the last ends.
#[derive(Debug, Clone, PartialEq)]
pub enum Outline {
    /// A circle.
    Circle {
        /// Its centre.
        center: Point2<f64>,
        /// Its radius.
        radius_mm: f64,
    },
    /// Edges, counter-clockwise.
    Edges(Vec<Edge>),
}

/// A piece of an outline.
#[derive(Debug, Clone, PartialEq)]
pub enum Edge {
    /// A straight line.
    Line {
        /// Where it starts.
        start: Point2<f64>,
        /// Where it ends.
        end: Point2<f64>,
    },
    /// An arc of a circle around the origin.
    Arc {
        /// Where it starts.
        start: Point2<f64>,
        /// Where it ends.
        end: Point2<f64>,
        /// Radius of the circle.
        radius_mm: f64,
        /// Its angle, counter-clockwise positive, within a full turn.
        sweep_rad: f64,
    },
    /// A smooth curve through points that are exact, its chords true to the tolerance.
    Curve {
        /// The points, both ends included.
        points: Polyline,
        /// Direction at the first point.
        start_tangent: Unit<Vector2<f64>>,
        /// Direction at the last point.
        end_tangent: Unit<Vector2<f64>>,
        /// Bézier's polygons of polynomials that follow each other along it with one tangent, within [`SPLINE_SHARE_OF_CHORD`] of the
        /// tolerance.
        polynomials: Vec<Polyline>,
        /// Arcs that follow each other along it with one tangent, within the tolerance.
        arcs: Vec<ArcStart>,
    },
}

impl Edge {
    /// Where it starts.
    pub fn start(&self) -> Point2<f64> {
        match self {
            Self::Line { start, .. } | Self::Arc { start, .. } => *start,
            Self::Curve { points, .. } => points.first().copied().unwrap_or_default(),
        }
    }

    /// Where it ends.
    pub fn end(&self) -> Point2<f64> {
        match self {
            Self::Line { end, .. } | Self::Arc { end, .. } => *end,
            Self::Curve { points, .. } => points.last().copied().unwrap_or_default(),
        }
    }

    /// The same turned about the origin.
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

    /// A curve that has [`POINTS_PER_CHORD`].
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

    /// Lets a curve end at the very point where the next edge starts.
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
    /// A circle around the origin.
    pub(crate) const fn circle(radius_mm: f64) -> Self {
        Self::Circle { center: Point2::new(0.0, 0.0), radius_mm }
    }
}

/// A face: an outline with holes in it.
#[derive(Debug, Clone, PartialEq)]
pub struct Section {
    /// What bounds it.
    pub outer: Outline,
    /// What is cut out of it.
    pub holes: Vec<Outline>,
}

/// Chords of a curve that has [`POINTS_PER_CHORD`].
pub(crate) const fn chords(points: &Polyline) -> usize {
    (points.len() - 1) / POINTS_PER_CHORD as usize
}

pub(crate) fn ends_of_chords(points: &Polyline) -> Polyline {
    points.iter().step_by(POINTS_PER_CHORD as usize).copied().collect()
}
