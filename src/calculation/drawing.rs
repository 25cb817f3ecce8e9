//! Each mating part, or all of them in place, as outlines for CAD, workshops and eyes.

use std::borrow::Cow;

use serde::Serialize;
use toothwave_solver::Stop;
use toothwave_solver::drawing as solver;
use toothwave_solver::drive::{Draft, DriveError};

use crate::design::Design;
use crate::drawing::answer::{BodyAnswer, DrawingAnswer, DrawnPart, EdgeAnswer, OutlineAnswer};
use crate::drawing::preset::Preset;
use crate::findings::{Causes, FindingAnswer, drive_findings};
use crate::forms::{Form, Format, Forms};
use crate::json::word;
use crate::key::Key;
use crate::no_answer::NoAnswer;
use crate::question::{Limits, Question};

pub mod answer;
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
    subject: DrawnPart,
    chord_tolerance_mm: f64,
    input_angle_deg: Option<f64>,
    of_document: Vec<FindingAnswer>,
    causes: Causes,
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
        let (subject, design) = (self.part, &*drawn);
        let of_design = design.drawn_in_key();
        let parameters = solver::DrawingParameters {
            chord_tolerance_mm: design.profile.chord_tolerance_mm,
            max_points: limits.max_profile_points,
            input_angle_deg: design.assembly.input_angle_deg,
        };
        let draft = Draft::new(&design.drive_parameters())?;
        let parts = design.parts_parameters()?;
        let drawing = solver::Drawing::new(&draft, subject.subject(), &parts, &parameters);
        let drawing = drawing.map_err(|error| match error {
            DriveError::Impossible(violations) => NoAnswer::impossible(&design.as_written(&violations)),
            DriveError::NotConverged(error) => error.into(),
        })?;
        Ok(CheckedDrawing {
            drawing,
            design_hash: Key::new("design", &of_design, &(Format::Json, false)).to_string(),
            subject,
            of_document: FindingAnswer::of_document(design, false),
            causes: Causes {
                ring_clearance: parts.ring_clearance_um > 0.0,
                ring_equidistant: parts.modification.ring_equidistant_um > 0.0,
                ..Causes::default()
            },
            chord_tolerance_mm: parameters.chord_tolerance_mm,
            input_angle_deg: (subject == DrawnPart::Assembly).then_some(parameters.input_angle_deg),
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
        let mut findings = drive_findings(drive)?;
        findings.extend(of_parts.iter().map(|finding| FindingAnswer::new(finding, drive, checked.causes)));
        findings.extend(checked.of_document.iter().cloned());
        Ok(DrawingAnswer {
            solver_version: toothwave_solver::VERSION,
            build: crate::BUILD,
            design_hash: checked.design_hash.clone(),
            subject: checked.subject,
            chord_tolerance_mm: checked.chord_tolerance_mm,
            input_angle_deg: checked.input_angle_deg,
            bodies: bodies.into_iter().map(|body| BodyAnswer::new(body, checked.drawing.drive())).collect(),
            findings,
        })
    }
}

impl DrawingAnswer {
    /// Points of all curves, and poles of the polynomials that solids have in their place.
    fn points_and_poles(&self) -> (usize, usize) {
        let outlines = self.bodies.iter().flat_map(|body| body.holes.iter().chain([&body.outer]));
        let edges = outlines.flat_map(|outline| match outline {
            OutlineAnswer::Circle { .. } => &[][..],
            OutlineAnswer::Path { edges } => edges,
        });
        edges.fold((0, 0), |(points, poles), edge| match edge {
            EdgeAnswer::Curve { x_mm, polynomials, .. } => {
                (points + x_mm.len(), poles + polynomials.iter().map(Vec::len).sum::<usize>())
            }
            EdgeAnswer::Line { .. } | EdgeAnswer::Arc { .. } => (points, poles),
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
