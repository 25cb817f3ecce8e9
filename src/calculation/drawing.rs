//! Each mating part, or all of them in place, as outlines for CAD, workshops and eyes.

use std::borrow::Cow;

use serde::Serialize;
use toothwave_solver::Stop;
pub use toothwave_solver::drawing::DrawnPart;
use toothwave_solver::drawing::{self as solver, Body, DrawingParameters, Edge, Outline};
use toothwave_solver::drive::{Draft, DriveError};
use utoipa::ToSchema;

use crate::design::Design;
use crate::drawing::preset::Preset;
use crate::findings::{Causes, FindingAnswer, drive_findings};
use crate::forms::{Form, Format, Forms};
use crate::json::word;
use crate::key::Key;
use crate::no_answer::NoAnswer;
use crate::question::{Limits, Question};

mod dxf;
mod mesh;
pub mod preset;
mod step;
mod stl;
mod svg;
mod three_mf;

/// The question for a drawing.
#[derive(Debug)]
pub struct Drawing {
    /// Part.
    pub part: DrawnPart,
    /// Source of the clearances.
    pub preset: Preset,
}

/// A drawing that can be made.
#[derive(Debug)]
pub struct CheckedDrawing {
    drawing: solver::Drawing,
    design_hash: String,
    of_document: Vec<FindingAnswer>,
    causes: Causes,
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
    pub bodies: Vec<Body>,
    /// Findings about the drive and about the drawn parts as manufactured.
    pub findings: Vec<FindingAnswer>,
}

/// A point's coordinates.
const POINT_BYTES: u64 = 16;

/// A pole in its polygon, of which there are four or more.
const POLE_BYTES: u64 = 24;

/// Bytes of a point in STEP, with the records that are kept while they are written.
const STEP_POINT_BYTES: u64 = 1120;

impl Question for Drawing {
    type Checked = CheckedDrawing;
    type Answer = DrawingAnswer;

    fn name(&self) -> String {
        let preset = if self.preset == Preset::Printing { ", printing" } else { "" };
        format!("drawings/{}{preset}", word(&self.part))
    }

    fn reads(&self, design: &Design) -> impl Serialize {
        let assembly = (self.part == DrawnPart::Assembly).then(|| design.assembly.clone());
        (design.drawn_in_key(), assembly)
    }

    fn check(&self, design: &Design, limits: &Limits) -> Result<CheckedDrawing, NoAnswer> {
        let drawn = match self.preset {
            Preset::Document => Cow::Borrowed(design),
            Preset::Printing => Cow::Owned(preset::printed(design)),
        };
        let design = &*drawn;
        let of_design = design.drawn_in_key();
        let parameters = DrawingParameters {
            chord_tolerance_mm: design.profile.chord_tolerance_mm,
            max_points: limits.max_profile_points,
            input_angle_deg: design.assembly.input_angle_deg,
        };
        let draft = Draft::new(&design.drive_parameters())?;
        let parts = design.parts_parameters()?;
        let drawing = solver::Drawing::new(&draft, self.part, &parts, &parameters);
        let drawing = drawing.map_err(|error| match error {
            DriveError::Impossible(violations) => NoAnswer::impossible(&design.as_written(&violations)),
            DriveError::NotConverged(error) => error.into(),
        })?;
        Ok(CheckedDrawing {
            drawing,
            design_hash: Key::new("design", &of_design, &(Format::Json, false)).to_string(),
            of_document: FindingAnswer::of_document(design, false),
            causes: Causes {
                ring_clearance: parts.ring_clearance_um > 0.0,
                ring_equidistant: parts.modification.ring_equidistant_um > 0.0,
                ..Causes::default()
            },
        })
    }

    fn max_bytes(checked: &CheckedDrawing, format: Format) -> Option<u64> {
        // The chords of a mesh are known only when it is made.
        if matches!(format, Format::ThreeMf | Format::Stl) {
            return None;
        }
        // A solid has fewer poles than points. The text of a point is longest in STEP.
        let text_bytes = if format == Format::Step { STEP_POINT_BYTES } else { 60 };
        Some((POINT_BYTES + POLE_BYTES + text_bytes) * checked.drawing.expected_points())
    }

    fn answer(checked: &CheckedDrawing, stop: &dyn Stop) -> Result<DrawingAnswer, NoAnswer> {
        let bodies = checked.drawing.bodies(stop)?;
        let of_parts = checked.drawing.findings()?;
        let drive = checked.drawing.drive();
        let subject = checked.drawing.subject();
        let &DrawingParameters { chord_tolerance_mm, input_angle_deg, .. } = checked.drawing.parameters();
        let mut findings = drive_findings(drive)?;
        findings.extend(of_parts.iter().map(|finding| FindingAnswer::new(finding, drive, checked.causes)));
        findings.extend(checked.of_document.iter().cloned());
        Ok(DrawingAnswer {
            solver_version: toothwave_solver::VERSION,
            build: crate::BUILD,
            design_hash: checked.design_hash.clone(),
            subject,
            chord_tolerance_mm,
            input_angle_deg: (subject == DrawnPart::Assembly).then_some(input_angle_deg),
            bodies,
            findings,
        })
    }
}

impl DrawingAnswer {
    /// Points of all curves, and poles of the polynomials that solids have in their place.
    fn points_and_poles(&self) -> (usize, usize) {
        let outlines = self.bodies.iter().flat_map(|body| body.holes.iter().chain([&body.outer]));
        let edges = outlines.flat_map(|outline| match outline {
            Outline::Circle { .. } => &[][..],
            Outline::Path { edges } => edges,
        });
        edges.fold((0, 0), |(points, poles), edge| match edge {
            Edge::Curve { x_mm, polynomials, .. } => {
                (points + x_mm.len(), poles + polynomials.iter().map(Vec::len).sum::<usize>())
            }
            Edge::Line { .. } | Edge::Arc { .. } => (points, poles),
        })
    }
}

impl Forms for DrawingAnswer {
    const FORMS: &'static [(Format, Form<Self>)] = &[
        (Format::Svg, svg::write),
        (Format::Dxf, dxf::write),
        (Format::Step, step::write),
        (Format::ThreeMf, three_mf::write),
        (Format::Stl, stl::write),
    ];

    fn expected_bytes(&self) -> usize {
        // Two numbers of about 18 characters, each with its comma.
        4096 + 40 * self.points_and_poles().0
    }

    fn held_bytes(&self, format: Format) -> u64 {
        /// The records of a pole at both ends of a prism, by their texts.
        const RECORDS_BYTES: u64 = 320;
        let (points, poles) = self.points_and_poles();
        let of_records = if format == Format::Step { RECORDS_BYTES } else { 0 };
        let of_meshes = if matches!(format, Format::ThreeMf | Format::Stl) { mesh::held_bytes(self) } else { 0 };
        POINT_BYTES * points as u64 + (POLE_BYTES + of_records) * poles as u64 + of_meshes
    }
}
