//! A drawing in JSON. All other formats are written from it.

use serde::{Deserialize, Serialize};
use toothwave_solver::drawing::{Body, Edge, Outline, Placement, Subject};
use toothwave_solver::{Drive, Part, ToothShape};
use utoipa::ToSchema;

use crate::findings::FindingAnswer;

/// Subject of a drawing.
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
    /// All subjects.
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

/// Drawing: prisms of the teeth's width, or balls, each given by its section and its placements.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
pub struct DrawingAnswer {
    /// Version of the solver.
    pub solver_version: &'static str,
    /// Build that computed the drawing. Equal builds on equal processors give equal bytes.
    pub build: &'static str,
    /// Hash of the solver's version, the drive, the parts and the chord tolerance. It is equal for all drawings that
    /// belong together.
    pub design_hash: String,
    /// Subject of the drawing.
    pub subject: DrawnPart,
    /// Largest distance of a chord from its curve.
    pub chord_tolerance_mm: f64,
    /// Angle of the wave generator, for an assembly only.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub input_angle_deg: Option<f64>,
    /// Drawn parts.
    pub bodies: Vec<BodyAnswer>,
    /// Findings about the drive and about the drawn parts as manufactured.
    pub findings: Vec<FindingAnswer>,
}

/// Part as prisms of one section. Teeth and the fingers between the carrier's slots have several placements.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
pub struct BodyAnswer {
    /// Name of the part.
    pub part: Part,
    /// Shape of the solid on its section.
    pub solid: BodySolid,
    /// Height of the prism. For a ball, that of the parts around it, with the ball in the middle.
    pub width_mm: f64,
    /// Outer boundary of the section.
    pub outer: OutlineAnswer,
    /// Holes in the section.
    pub holes: Vec<OutlineAnswer>,
    /// Placement of each prism.
    pub placements: Vec<PlacementAnswer>,
}

/// Shape of the solid on a section.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum BodySolid {
    /// A prism, from the plane of the section upward.
    Prism,
    /// A ball of the section's radius. Its centre is half the width above the section.
    Ball,
}

/// Closed path. Each edge starts exactly at the end point of the edge before, the first at that of the last. Edges are
/// counter-clockwise.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum OutlineAnswer {
    /// A circle around the origin.
    Circle {
        /// Radius of the circle.
        radius_mm: f64,
    },
    /// Consecutive edges.
    Path {
        /// The edges.
        edges: Vec<EdgeAnswer>,
    },
}

/// Edge of an outline.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum EdgeAnswer {
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
        /// Control polygons of the Bézier polynomials that replace the curve in solids.
        #[serde(skip)]
        polynomials: Vec<Vec<[f64; 2]>>,
        /// x and y of the start, and the bulge, of the arcs that replace the curve in DXF.
        #[serde(skip)]
        arcs: Vec<[f64; 3]>,
    },
}

/// Placement of a section: rotated about its origin, then moved.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, ToSchema)]
pub struct PlacementAnswer {
    /// x of the origin.
    pub x_mm: f64,
    /// y of the origin.
    pub y_mm: f64,
    /// Rotation, counter-clockwise.
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
    /// Returns centre and radius if the outline is a circle: around the origin, or a path of arcs about one centre.
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
    /// Returns x and y of the points, which are on the edge, from start to end.
    pub fn points(&self) -> impl DoubleEndedIterator<Item = [f64; 2]> + ExactSizeIterator {
        let (x_mm, y_mm) = match self {
            Self::Line { x_mm, y_mm } => (&x_mm[..], &y_mm[..]),
            Self::Arc { x_mm, y_mm, .. } => (&x_mm[..], &y_mm[..]),
            Self::Curve { x_mm, y_mm, .. } => (&x_mm[..], &y_mm[..]),
        };
        x_mm.iter().zip(y_mm).map(|(&x, &y)| [x, y])
    }

    /// Returns the end point.
    pub fn end(&self) -> [f64; 2] {
        self.points().next_back().unwrap_or_default()
    }

    /// Returns the start point.
    pub fn start(&self) -> [f64; 2] {
        self.points().next().unwrap_or_default()
    }
}

impl PlacementAnswer {
    /// Moves a point of the section to its place.
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
                // From the rightmost point through the uppermost one, and back.
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
    pub(super) fn new(Body { part, outer, holes, placements, .. }: Body, drive: &Drive) -> Self {
        let is_ball = part == Part::Teeth && matches!(drive.parameters().tooth, ToothShape::Ball { .. });
        Self {
            part,
            solid: if is_ball { BodySolid::Ball } else { BodySolid::Prism },
            width_mm: drive.tooth_width_mm(),
            outer: outer.into(),
            holes: holes.into_iter().map(Into::into).collect(),
            placements: placements.into_iter().map(Into::into).collect(),
        }
    }
}
