//! `POST /v1/drawings/{part}`: each mating part, or all of them in place, as outlines for CAD, workshops and eyes.

use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use axum::extract::rejection::PathRejection;
use axum::extract::{Path, Request, State};
use axum::response::{IntoResponse, Response};
use clap::ValueEnum;
use serde::{Deserialize, Serialize};
use toothwave_solver::drawing::{self, Body, Edge, Outline, Placement, Subject};
use toothwave_solver::drive::{Draft, DriveError};
use toothwave_solver::{Part, SolveError};
use utoipa::ToSchema;

use super::geometry::drive_findings;
use super::{App, Endpoint, Form, Forms, Problems, respond};
use crate::cache::Key;
use crate::config::Limits;
use crate::design::Design;
use crate::findings::FindingAnswer;
use crate::negotiation::{Format, Representation};
use crate::problem::{Problem, ProblemCode};
use crate::{dxf, json, step, svg};

/// What can be drawn.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, ValueEnum, ToSchema)]
#[serde(rename_all = "kebab-case")]
pub enum DrawnPart {
    /// The ring, x along the middle of a tooth space
    Ring,
    /// The wave generator, x along its major axis
    WaveGenerator,
    /// The carrier, x along a slot
    Carrier,
    /// A tooth
    Tooth,
    /// All parts in the ring's frame, at the document's input angle
    Assembly,
}

impl DrawnPart {
    const fn subject(self) -> Subject {
        match self {
            Self::Ring => Subject::Part(Part::Ring),
            Self::WaveGenerator => Subject::Part(Part::WaveGenerator),
            Self::Carrier => Subject::Part(Part::Carrier),
            Self::Tooth => Subject::Part(Part::Teeth),
            Self::Assembly => Subject::Assembly,
        }
    }
}

/// A drawing: prisms of the teeth's width, each given by its section and by where it stands.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
pub struct DrawingAnswer {
    /// Version of the solver.
    pub solver_version: &'static str,
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
    /// Height of the prism.
    pub width_mm: f64,
    /// What bounds its section.
    pub outer: OutlineAnswer,
    /// What is cut out of its section.
    pub holes: Vec<OutlineAnswer>,
    /// Where each prism stands.
    pub placements: Vec<PlacementAnswer>,
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
    /// An arc of a circle around the origin.
    Arc {
        /// x of its start, its middle and its end.
        x_mm: [f64; 3],
        /// y of its start, its middle and its end.
        y_mm: [f64; 3],
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
                    radius_mm,
                    sweep_deg: sweep_rad.to_degrees(),
                }
            }
            Edge::Curve { points, start_tangent, end_tangent } => Self::Curve {
                x_mm: points.iter().map(|point| point.x).collect(),
                y_mm: points.iter().map(|point| point.y).collect(),
                start_tangent_deg: start_tangent.y.atan2(start_tangent.x).to_degrees(),
                end_tangent_deg: end_tangent.y.atan2(end_tangent.x).to_degrees(),
            },
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
            Outline::Circle { radius_mm } => Self::Circle { radius_mm },
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
    fn new(Body { part, section, placements }: Body, width_mm: f64) -> Self {
        Self {
            part: part.into(),
            width_mm,
            outer: section.outer.into(),
            holes: section.holes.into_iter().map(Into::into).collect(),
            placements: placements.into_iter().map(Into::into).collect(),
        }
    }
}

/// The endpoint.
#[derive(Debug)]
pub struct Drawing(pub DrawnPart);

/// A drawing that can be made.
#[derive(Debug)]
pub struct DrawingQuestion {
    drawing: drawing::Drawing,
    design_hash: String,
    subject: DrawnPart,
    chord_tolerance_mm: f64,
    input_angle_deg: Option<f64>,
}

impl Endpoint for Drawing {
    type Question = DrawingQuestion;
    type Answer = DrawingAnswer;

    fn name(&self) -> &'static str {
        match self.0 {
            DrawnPart::Ring => "drawings/ring",
            DrawnPart::WaveGenerator => "drawings/wave-generator",
            DrawnPart::Carrier => "drawings/carrier",
            DrawnPart::Tooth => "drawings/tooth",
            DrawnPart::Assembly => "drawings/assembly",
        }
    }

    fn reads<'a>(&self, design: &'a Design) -> impl Serialize + 'a {
        let assembly = (self.0 == DrawnPart::Assembly).then_some(&design.assembly);
        (&design.drive, &design.parts, design.profile.chord_tolerance_mm, assembly)
    }

    fn question(&self, design: &Design, limits: &Limits) -> Result<DrawingQuestion, Problem> {
        let subject = self.0;
        let of_design = (&design.drive, &design.parts, design.profile.chord_tolerance_mm);
        let parameters = design.drawing_parameters(limits.max_profile_points);
        let draft = Draft::new(&design.drive_parameters()).map_err(SolveError::from)?;
        let drawing = drawing::Drawing::new(&draft, subject.subject(), &design.parts_parameters(), &parameters);
        let drawing = drawing.map_err(|error| match error {
            DriveError::Impossible(violations) => Problem::impossible(&design.as_written(&violations)),
            error @ DriveError::NotConverged(_) => error.into(),
        })?;
        Ok(DrawingQuestion {
            drawing,
            design_hash: Key::new("design", &of_design, Representation::JSON)?.to_string(),
            subject,
            chord_tolerance_mm: parameters.chord_tolerance_mm,
            input_angle_deg: (subject == DrawnPart::Assembly).then_some(parameters.input_angle_deg),
        })
    }

    fn answer(question: &DrawingQuestion, stop: &AtomicBool) -> Result<DrawingAnswer, Problem> {
        let bodies = question.drawing.bodies(stop)?;
        Ok(DrawingAnswer {
            solver_version: toothwave_solver::VERSION,
            design_hash: question.design_hash.clone(),
            subject: question.subject,
            chord_tolerance_mm: question.chord_tolerance_mm,
            input_angle_deg: question.input_angle_deg,
            bodies: bodies
                .into_iter()
                .map(|body| BodyAnswer::new(body, question.drawing.drive().parameters().tooth_width_mm))
                .collect(),
            findings: {
                let of_parts = question.drawing.findings().map_err(SolveError::from)?;
                let mut findings = drive_findings(question.drawing.drive())?;
                findings.extend(of_parts.iter().map(FindingAnswer::from));
                findings
            },
        })
    }
}

impl Forms for DrawingAnswer {
    const FORMS: &'static [(Format, Form<Self>)] =
        &[(Format::Svg, svg::write), (Format::Dxf, dxf::write), (Format::Step, step::write)];
}

/// The sections of a part, or of all parts in place.
#[utoipa::path(
    post,
    path = "/v1/drawings/{part}",
    tag = "drive",
    request_body(content = Design, description = "Reads `drive`, `parts` and `profile.chord_tolerance_mm`, for `assembly` also `assembly`."),
    params(
        ("part" = DrawnPart, Path, description = "What is drawn.", example = "ring"),
        ("If-None-Match" = Option<String>, Header, description = "Entity tags that the client has.")
    ),
    responses(
        (status = 200, description = "The drawing. As DXF (AutoCAD 2000, millimetres) a layer a part, every outline a circle or one closed polyline with arcs as bulges; as SVG the same in millimetres; as STEP (AP214) every prism a solid in place, curves as cubic splines through their points.",
            content((DrawingAnswer = "application/json"), (String = "image/svg+xml"), (String = "image/vnd.dxf"), (String = "model/step")), headers(
                ("ETag" = String, description = "Entity tag of this representation."),
                ("Cache-Status" = String, description = "RFC 9211: `hit`, `fwd=miss`, `collapsed`."),
                ("Server-Timing" = String, description = "`solve;dur=` and the milliseconds of the solve.")
            )),
        (status = 304, description = "The client has this representation already (`If-None-Match`)."),
        (status = 404, description = "No such part.", body = Problem, content_type = "application/problem+json"),
        Problems
    )
)]
pub async fn drawing(
    State(app): State<Arc<App>>,
    part: Result<Path<DrawnPart>, PathRejection>,
    request: Request,
) -> Response {
    match part {
        Ok(Path(part)) => respond(Drawing(part), app, request).await,
        Err(_) => {
            let known: Vec<_> = DrawnPart::value_variants().iter().map(json::word).collect();
            let detail = format!("drawings there are of {}", known.join(", "));
            Problem::new(ProblemCode::NotFound, detail).into_response()
        }
    }
}
