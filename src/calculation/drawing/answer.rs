//! A drawing as it goes over the wire, which all its other forms are written from.

use serde::{Deserialize, Serialize};
use toothwave_solver::drawing::{Body, Edge, Outline, Placement, Subject};
use toothwave_solver::{Drive, Part, ToothShape};
use utoipa::ToSchema;

use crate::findings::FindingAnswer;

/// What can be drawn.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "kebab-case")]
pub enum DrawnPart {
    /// The ring, x along the middle of a tooth space.
    Ring,
    /// The wave generator, x along the middle of a lobe, the major axis of an ellipse.
    WaveGenerator,
    /// The carrier, x along a slot.
    Carrier,
    /// A tooth.
    Tooth,
    /// All parts in the ring's frame, at the document's input angle.
    Assembly,
}

impl DrawnPart {
    /// All of them.
    pub const ALL: [Self; 5] = [Self::Ring, Self::WaveGenerator, Self::Carrier, Self::Tooth, Self::Assembly];

    pub(super) const fn subject(self) -> Subject {
        match self {
            Self::Ring => Subject::Part(Part::Ring),
            Self::WaveGenerator => Subject::Part(Part::WaveGenerator),
            Self::Carrier => Subject::Part(Part::Carrier),
            Self::Tooth => Subject::Part(Part::Teeth),
            Self::Assembly => Subject::Assembly,
        }
    }
}

/// A drawing: prisms of the teeth's width, or balls, each given by its section and by where it stands.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
pub struct DrawingAnswer {
    /// Version of the solver.
    pub solver_version: &'static str,
    /// The build that computed it: equal builds on equal processors give equal bytes.
    pub build: &'static str,
    /// Hash of the solver's version and of the drive, the parts and the chord tolerance: alike on all drawings that belong together.
    pub design_hash: String,
    /// What is drawn.
    pub subject: DrawnPart,
    /// How far a chord of a curve may be from it.
    pub chord_tolerance_mm: f64,
    /// Angle of the wave generator; an assembly's.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    pub input_angle_deg: Option<f64>,
    /// The parts that are drawn.
    pub bodies: Vec<BodyAnswer>,
    /// What a designer should be told about the drive, and about the drawn parts as they are made.
    pub findings: Vec<FindingAnswer>,
}

/// A part: one prism, or, of teeth and of the fingers between the carrier's slots, several alike.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
pub struct BodyAnswer {
    /// Which part.
    pub part: BodyPart,
    /// What stands on its section.
    pub solid: BodySolid,
    /// Height of the prism; of a ball, that of the parts which it stands in the middle of.
    pub width_mm: f64,
    /// What bounds its section.
    pub outer: OutlineAnswer,
    /// What is cut out of its section.
    pub holes: Vec<OutlineAnswer>,
    /// Where each prism stands.
    pub placements: Vec<PlacementAnswer>,
}

/// What stands on a section.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum BodySolid {
    /// A prism, from the plane of the section up.
    Prism,
    /// A ball of the section's radius, its centre half the width above.
    Ball,
}

/// A part of the drive.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum BodyPart {
    /// The elliptic cam.
    WaveGenerator,
    /// The discrete teeth.
    Teeth,
    /// The rigid internal wheel.
    Ring,
    /// The slotted annulus; its fingers, without what joins them beside the teeth.
    Carrier,
}

impl From<Part> for BodyPart {
    fn from(part: Part) -> Self {
        match part {
            Part::WaveGenerator => Self::WaveGenerator,
            Part::Teeth => Self::Teeth,
            Part::Ring => Self::Ring,
            Part::Carrier => Self::Carrier,
        }
    }
}

/// A closed path. Each edge starts at the very point where the one before ends, the first where the last ends; counter-clockwise.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum OutlineAnswer {
    /// A circle around the origin.
    Circle {
        /// Its radius.
        radius_mm: f64,
    },
    /// Edges one after the other.
    Path {
        /// The edges.
        edges: Vec<EdgeAnswer>,
    },
}

/// A piece of an outline.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum EdgeAnswer {
    /// A straight line between two points.
    Line {
        /// x of its ends.
        x_mm: [f64; 2],
        /// y of its ends.
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
    /// A smooth curve through exact points, its chords true to the chord tolerance: interpolate it, or take the chords.
    Curve {
        /// x of its points.
        x_mm: Vec<f64>,
        /// y of its points.
        y_mm: Vec<f64>,
        /// Its direction at the first point, from the x axis.
        start_tangent_deg: f64,
        /// Its direction at the last point.
        end_tangent_deg: f64,
        /// Bézier's polygons of the polynomials that solids have in its place.
        #[serde(skip)]
        polynomials: Vec<Vec<[f64; 2]>>,
        /// x and y of the start, and the bulge, of the arcs that workshops have in its place.
        #[serde(skip)]
        arcs: Vec<[f64; 3]>,
    },
}

/// Where a section stands: turned about its origin, then moved.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, ToSchema)]
pub struct PlacementAnswer {
    /// x of its origin.
    pub x_mm: f64,
    /// y of its origin.
    pub y_mm: f64,
    /// How far it is turned, counter-clockwise.
    pub rotation_deg: f64,
}

impl From<Edge> for EdgeAnswer {
    fn from(edge: Edge) -> Self {
        match edge {
            Edge::Line { start, end } => Self::Line { x_mm: [start.x, end.x], y_mm: [start.y, end.y] },
            Edge::Arc { start, end, radius_mm, sweep_rad } => {
                let middle_rad = start.y.atan2(start.x) + 0.5 * sweep_rad;
                let (sin, cos) = middle_rad.sin_cos();
                Self::Arc {
                    x_mm: [start.x, radius_mm * cos, end.x],
                    y_mm: [start.y, radius_mm * sin, end.y],
                    center_mm: [0.0; 2],
                    radius_mm,
                    sweep_deg: sweep_rad.to_degrees(),
                }
            }
            Edge::Curve { points, start_tangent, end_tangent, polynomials, arcs } => Self::Curve {
                x_mm: points.iter().map(|point| point.x).collect(),
                y_mm: points.iter().map(|point| point.y).collect(),
                start_tangent_deg: start_tangent.y.atan2(start_tangent.x).to_degrees(),
                end_tangent_deg: end_tangent.y.atan2(end_tangent.x).to_degrees(),
                polynomials: polynomials
                    .iter()
                    .map(|polygon| polygon.iter().map(|pole| [pole.x, pole.y]).collect())
                    .collect(),
                arcs: arcs.iter().map(|arc| [arc.point.x, arc.point.y, arc.bulge]).collect(),
            },
        }
    }
}

impl OutlineAnswer {
    /// Centre and radius, where it is a circle: around the origin, or as a path of arcs about one centre.
    pub(super) fn circle(&self) -> Option<([f64; 2], f64)> {
        match self {
            Self::Circle { radius_mm } => Some(([0.0; 2], *radius_mm)),
            Self::Path { edges } => {
                let mut circles = edges.iter().map(|edge| match edge {
                    EdgeAnswer::Arc { center_mm, radius_mm, .. } => Some((*center_mm, *radius_mm)),
                    EdgeAnswer::Line { .. } | EdgeAnswer::Curve { .. } => None,
                });
                let first = circles.next()??;
                circles.all(|circle| circle == Some(first)).then_some(first)
            }
        }
    }
}

impl EdgeAnswer {
    /// Where it ends.
    pub fn end(&self) -> [f64; 2] {
        match self {
            Self::Line { x_mm, y_mm } => [x_mm[1], y_mm[1]],
            Self::Arc { x_mm, y_mm, .. } => [x_mm[2], y_mm[2]],
            Self::Curve { x_mm, y_mm, .. } => [x_mm[x_mm.len() - 1], y_mm[y_mm.len() - 1]],
        }
    }

    /// Where it starts.
    pub fn start(&self) -> [f64; 2] {
        match self {
            Self::Line { x_mm, y_mm } => [x_mm[0], y_mm[0]],
            Self::Arc { x_mm, y_mm, .. } => [x_mm[0], y_mm[0]],
            Self::Curve { x_mm, y_mm, .. } => [x_mm[0], y_mm[0]],
        }
    }
}

impl PlacementAnswer {
    /// Takes a point of the section to where it stands.
    pub fn placing(&self) -> impl Fn([f64; 2]) -> [f64; 2] + use<> {
        let Self { x_mm, y_mm, rotation_deg } = *self;
        let (sin, cos) = rotation_deg.to_radians().sin_cos();
        move |[x, y]| [x_mm + (x * cos - y * sin), y_mm + (x * sin + y * cos)]
    }
}

impl From<Outline> for OutlineAnswer {
    fn from(outline: Outline) -> Self {
        match outline {
            Outline::Circle { center, radius_mm } if center.coords.norm() > 0.0 => {
                // From its rightmost point through the uppermost one, and back.
                let half = |sign: f64| EdgeAnswer::Arc {
                    x_mm: [center.x + sign * radius_mm, center.x, center.x - sign * radius_mm],
                    y_mm: [center.y, center.y + sign * radius_mm, center.y],
                    center_mm: [center.x, center.y],
                    radius_mm,
                    sweep_deg: 180.0,
                };
                Self::Path { edges: vec![half(1.0), half(-1.0)] }
            }
            Outline::Circle { radius_mm, .. } => Self::Circle { radius_mm },
            Outline::Edges(edges) => Self::Path { edges: edges.into_iter().map(Into::into).collect() },
        }
    }
}

impl From<Placement> for PlacementAnswer {
    fn from(Placement { origin_mm, rotation_rad }: Placement) -> Self {
        Self { x_mm: origin_mm.x, y_mm: origin_mm.y, rotation_deg: rotation_rad.to_degrees() }
    }
}

impl BodyAnswer {
    pub(super) fn new(Body { part, section, placements }: Body, drive: &Drive) -> Self {
        let is_ball = part == Part::Teeth && matches!(drive.parameters().tooth, ToothShape::Ball { .. });
        Self {
            part: part.into(),
            solid: if is_ball { BodySolid::Ball } else { BodySolid::Prism },
            width_mm: drive.tooth_width_mm(),
            outer: section.outer.into(),
            holes: section.holes.into_iter().map(Into::into).collect(),
            placements: placements.into_iter().map(Into::into).collect(),
        }
    }
}
