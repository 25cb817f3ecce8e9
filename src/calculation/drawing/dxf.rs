//! Drawings as DXF of AutoCAD 2000, the oldest version with light polylines and declared units.
//!
//! Not written with crate dxf 0.6: it writes tables without handles, which readers must repair. Structure and group
//! codes follow Autodesk's DXF reference. docs/reference/dxf.md lists AutoCAD's additional requirements, and the
//! programs that have opened these files.

use std::fmt::Display;
use std::io::{self, Write};

use toothwave_solver::Part;
use toothwave_solver::drawing::{Edge, Outline, Placement};

use super::DrawingAnswer;
use super::svg;

/// Everything before and after the entities.
const START: &str = include_str!("dxf/start.txt");
const END: &str = include_str!("dxf/end.txt");

/// First handle that the templates do not use.
const FIRST_FREE: u32 = 0x20;

/// Margin around the drawing in the initial view, as a share of the view's height.
const VIEW_MARGIN: f64 = 0.1;

/// Returns the name of a part's layer, and its colour in the AutoCAD index.
const fn layer_of(part: Part) -> (&'static str, u8) {
    match part {
        Part::WaveGenerator => ("WAVE_GENERATOR", 6),
        Part::Teeth => ("TEETH", 2),
        Part::Ring => ("RING", 5),
        Part::Carrier => ("CARRIER", 3),
    }
}

pub(super) fn write(drawing: &DrawingAnswer, writer: &mut dyn Write) -> io::Result<()> {
    let mut dxf = Dxf { writer, next_handle: FIRST_FREE };
    let title = svg::title(drawing);
    dxf.text(999, &title)?;
    dxf.template(&start(drawing))?;
    for body in &drawing.bodies {
        let (layer, _) = layer_of(body.part);
        for placement in &body.placements {
            for outline in [&body.outer].into_iter().chain(&body.holes) {
                dxf.outline(outline, placement, layer)?;
                dxf.text(1001, "TOOTHWAVE")?;
                dxf.text(1000, &title)?;
            }
        }
    }
    dxf.template(END)
}

/// Returns the template of everything before the entities, with the numbers of this drawing.
fn start(drawing: &DrawingAnswer) -> String {
    let outlines: usize = drawing.bodies.iter().map(|body| body.placements.len() * (1 + body.holes.len())).sum();
    let seed = u32::try_from(outlines).unwrap_or(u32::MAX).saturating_add(0x100);
    let reach_mm = svg::reach_mm(&drawing.bodies);
    let layers = drawing.bodies.iter().map(|body| layer_of(body.part));
    let records = [("0", 7)].into_iter().chain(layers).map(|(name, color)| {
        format!("|0 LAYER|5 {{new}}|330 {{table}}|100 AcDbSymbolTableRecord|100 AcDbLayerTableRecord|2 {name}|70 0|62 {color}|6 Continuous|370 -3|390 15")
    });
    START
        .replace("{least}", &format!("{:?}", -reach_mm))
        .replace("{most}", &format!("{reach_mm:?}"))
        .replace("{height}", &format!("{:?}", 2.0 * reach_mm * (1.0 + VIEW_MARGIN)))
        .replace("{seed}", &format!("{seed:X}"))
        .replace("{layer count}", &(1 + drawing.bodies.len()).to_string())
        .replace("{layers}", &records.collect::<String>())
}

/// Returns centre and radius if the outline is a circle: around the origin, or a path of arcs about one centre.
fn circle(outline: &Outline) -> Option<([f64; 2], f64)> {
    match outline {
        Outline::Circle { radius_mm } => Some(([0.0; 2], *radius_mm)),
        Outline::Path { edges } => {
            let mut circles = edges.iter().map(|edge| match edge {
                Edge::Arc { center_mm, radius_mm, .. } => Some((*center_mm, *radius_mm)),
                Edge::Line { .. } | Edge::Curve { .. } => None,
            });
            let first = circles.next()??;
            circles.all(|circle| circle == Some(first)).then_some(first)
        }
    }
}

/// Writer of the file: pairs of a group code and a value.
struct Dxf<'a> {
    writer: &'a mut dyn Write,
    next_handle: u32,
}

impl Dxf<'_> {
    fn text(&mut self, code: impl Display, value: impl Display) -> io::Result<()> {
        write!(self.writer, "{code:>3}\r\n{value}\r\n")
    }

    /// Writes a number with the fewest digits that are read back as the same number, always with a point.
    fn number(&mut self, code: u16, value: f64) -> io::Result<()> {
        write!(self.writer, "{code:>3}\r\n{value:?}\r\n")
    }

    fn point(&mut self, code: u16, [x, y]: [f64; 2]) -> io::Result<()> {
        self.number(code, x)?;
        self.number(code + 10, y)
    }

    fn new_handle(&mut self) -> u32 {
        self.next_handle += 1;
        self.next_handle - 1
    }

    /// Writes the pairs of a template. start.txt describes its marks.
    fn template(&mut self, text: &str) -> io::Result<()> {
        let mut table = 0;
        for pair in text.lines().filter(|line| !line.starts_with('#')).flat_map(|line| line.split('|')) {
            let (code, value) = pair.split_once(' ').unwrap_or((pair, ""));
            let handle = match value {
                "{new}" => self.new_handle(),
                "{new table}" => {
                    table = self.new_handle();
                    table
                }
                "{table}" => table,
                _ => {
                    self.text(code, value)?;
                    continue;
                }
            };
            self.text(code, format_args!("{handle:X}"))?;
        }
        Ok(())
    }

    fn outline(&mut self, outline: &Outline, placement: &Placement, layer: &str) -> io::Result<()> {
        let place = placement.placing();
        if let Some((center_mm, radius_mm)) = circle(outline) {
            self.entity("CIRCLE", "AcDbCircle", layer)?;
            self.point(10, place(center_mm))?;
            self.number(30, 0.0)?;
            return self.number(40, radius_mm);
        }
        let Outline::Path { edges } = outline else { return Ok(()) };
        self.entity("LWPOLYLINE", "AcDbPolyline", layer)?;
        // The last point of an edge is the first of the next one.
        let vertex_count = |edge: &Edge| match edge {
            Edge::Line { .. } | Edge::Arc { .. } => 1,
            Edge::Curve { arcs, .. } => arcs.len(),
        };
        self.text(90, edges.iter().map(vertex_count).sum::<usize>())?;
        self.text(70, 1)?; // closed
        for edge in edges {
            match edge {
                Edge::Line { .. } => self.point(10, place(edge.start()))?,
                Edge::Arc { sweep_deg, .. } => {
                    self.point(10, place(edge.start()))?;
                    // The bulge of a polyline is the tangent of a quarter of its arc's angle.
                    self.number(42, (0.25 * sweep_deg.to_radians()).tan())?;
                }
                Edge::Curve { arcs, .. } => {
                    for arc in arcs {
                        self.point(10, place(arc.point.into()))?;
                        self.number(42, arc.bulge)?;
                    }
                }
            }
        }
        Ok(())
    }

    fn entity(&mut self, kind: &str, class: &str, layer: &str) -> io::Result<()> {
        let handle = self.new_handle();
        self.template(&format!("0 {kind}|5 {handle:X}|330 10|100 AcDbEntity|8 {layer}|100 {class}"))
    }
}
