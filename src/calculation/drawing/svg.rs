//! Drawings as SVG, in millimetres, true to scale.

use std::io::{self, Write};

use toothwave_solver::Part;
use toothwave_solver::drawing::{Body, Edge, Outline, Placement};

use super::DrawingAnswer;

/// Margin around the drawing, as a share of the picture.
const MARGIN: f64 = 0.03;

pub(super) fn write(drawing: &DrawingAnswer, writer: &mut dyn Write) -> io::Result<()> {
    let reach_mm = reach_mm(&drawing.bodies) * (1.0 + MARGIN);
    let size_mm = 2.0 * reach_mm;
    writeln!(
        writer,
        r#"<svg xmlns="http://www.w3.org/2000/svg" width="{size_mm}mm" height="{size_mm}mm" viewBox="{} {} {size_mm} {size_mm}">"#,
        -reach_mm, -reach_mm
    )?;
    writeln!(writer, "<title>{}</title>", title(drawing))?;
    writeln!(writer, "<desc>Millimetres, chords true to {} mm.</desc>", drawing.chord_tolerance_mm)?;
    writeln!(
        writer,
        r#"<g transform="scale(1 -1)" fill-rule="evenodd" stroke="black" stroke-width="1" stroke-linejoin="round">"#
    )?;
    for body in &drawing.bodies {
        let (id, fill) = match body.part {
            Part::WaveGenerator => ("wave_generator", "#d9c7e8"),
            Part::Teeth => ("teeth", "#f3d9a4"),
            Part::Ring => ("ring", "#c9d6e4"),
            Part::Carrier => ("carrier", "#cfe3cd"),
        };
        writeln!(writer, r#"<g id="{id}" fill="{fill}">"#)?;
        for placement in &body.placements {
            write!(writer, r#"<path vector-effect="non-scaling-stroke" d=""#)?;
            for outline in [&body.outer].into_iter().chain(&body.holes) {
                write_outline(outline, placement, writer)?;
            }
            writeln!(writer, r#""/>"#)?;
        }
        writeln!(writer, "</g>")?;
    }
    writeln!(writer, "</g>\n</svg>")
}

pub(super) fn title(drawing: &DrawingAnswer) -> String {
    let DrawingAnswer { solver_version, design_hash, .. } = drawing;
    format!("toothwave {solver_version}, {}, design {design_hash}", crate::json::word(&drawing.subject))
}

/// Returns the largest distance of a drawing's points from its origin.
pub(super) fn reach_mm(bodies: &[Body]) -> f64 {
    let of_edge = |edge: &Edge| match edge {
        Edge::Arc { center_mm: [x, y], radius_mm, .. } => x.hypot(*y) + radius_mm,
        Edge::Line { .. } | Edge::Curve { .. } => edge.points().map(|[x, y]| x.hypot(y)).fold(0.0, f64::max),
    };
    let of_body = |body: &Body| {
        let outline_mm = match &body.outer {
            Outline::Circle { radius_mm } => *radius_mm,
            Outline::Path { edges } => edges.iter().map(of_edge).fold(0.0, f64::max),
        };
        body.placements.iter().map(|placement| placement.x_mm.hypot(placement.y_mm) + outline_mm).fold(0.0, f64::max)
    };
    bodies.iter().map(of_body).fold(0.0, f64::max)
}

fn write_outline(outline: &Outline, placement: &Placement, writer: &mut dyn Write) -> io::Result<()> {
    match outline {
        Outline::Circle { radius_mm } => {
            let Placement { x_mm, y_mm, .. } = placement;
            let (left, right) = (x_mm - radius_mm, x_mm + radius_mm);
            write!(writer, "M{right} {y_mm}A{radius_mm} {radius_mm} 0 0 1 {left} {y_mm}")?;
            write!(writer, "A{radius_mm} {radius_mm} 0 0 1 {right} {y_mm}Z")
        }
        Outline::Path { edges } => {
            let place = placement.placing();
            for (index, edge) in edges.iter().enumerate() {
                if index == 0 {
                    let [x, y] = place(edge.start());
                    write!(writer, "M{x} {y}")?;
                }
                match edge {
                    Edge::Arc { radius_mm, sweep_deg, .. } => {
                        let [x, y] = place(edge.end());
                        let (large, counter_clockwise) =
                            (u8::from(sweep_deg.abs() > 180.0), u8::from(*sweep_deg > 0.0));
                        write!(writer, "A{radius_mm} {radius_mm} 0 {large} {counter_clockwise} {x} {y}")?;
                    }
                    Edge::Line { .. } | Edge::Curve { .. } => {
                        for [x, y] in edge.points().skip(1).map(&place) {
                            write!(writer, "L{x} {y}")?;
                        }
                    }
                }
            }
            write!(writer, "Z")
        }
    }
}
