//! Drawings as DXF of AutoCAD 2000, the oldest version with light polylines and declared units.
//!
//! Not written with crate dxf 0.6: it writes tables without handles, which readers must repair. Structure and group
//! codes follow Autodesk's DXF reference. docs/reference/dxf.md lists AutoCAD's additional requirements, and the
//! programs that have opened these files.

use std::io::{self, Write};

use toothwave_solver::Part;

use super::answer::{DrawingAnswer, EdgeAnswer, OutlineAnswer, PlacementAnswer};
use super::svg;

/// Application name under which every outline stores its part, as extended data.
const APPLICATION: &str = "TOOTHWAVE";

/// Handles of referenced objects. Entities use handles from [`FIRST_FREE`] on.
const MODEL_SPACE: u32 = 0x10;
const PAPER_SPACE: u32 = 0x11;
const ROOT_DICTIONARY: u32 = 0x12;
const GROUP_DICTIONARY: u32 = 0x13;
const PLOT_STYLE_DICTIONARY: u32 = 0x14;
const PLOT_STYLE: u32 = 0x15;
const FIRST_FREE: u32 = 0x20;

/// Default line weight of layers.
const DEFAULT_LINE_WEIGHT: i64 = -3;

/// Margin around the drawing in the initial view, as a share of the view's height.
const VIEW_MARGIN: f64 = 0.1;

/// Name of a layer and its colour in the AutoCAD index.
struct Layer(&'static str, u8);

const fn layer_of(part: Part) -> Layer {
    match part {
        Part::WaveGenerator => Layer("WAVE_GENERATOR", 6),
        Part::Teeth => Layer("TEETH", 2),
        Part::Ring => Layer("RING", 5),
        Part::Carrier => Layer("CARRIER", 3),
    }
}

/// Writes a drawing.
///
/// # Errors
/// The errors of the writer.
pub(super) fn write(drawing: &DrawingAnswer, writer: &mut dyn Write) -> io::Result<()> {
    let mut dxf = Dxf { writer, next_handle: FIRST_FREE };
    let title = svg::title(drawing);
    dxf.text(999, &title)?;
    let outlines: usize = drawing.bodies.iter().map(|body| body.placements.len() * (1 + body.holes.len())).sum();
    dxf.header(drawing, outlines)?;
    dxf.classes()?;
    dxf.tables(drawing)?;
    dxf.blocks()?;
    dxf.section("ENTITIES")?;
    for body in &drawing.bodies {
        let layer = layer_of(body.part);
        for placement in &body.placements {
            for outline in [&body.outer].into_iter().chain(&body.holes) {
                dxf.outline(outline, placement, &layer)?;
                dxf.text(1001, APPLICATION)?;
                dxf.text(1000, &title)?;
            }
        }
    }
    dxf.text(0, "ENDSEC")?;
    dxf.objects()?;
    dxf.text(0, "EOF")
}

/// Writer of the file: pairs of a group code and a value.
struct Dxf<'a> {
    writer: &'a mut dyn Write,
    next_handle: u32,
}

impl Dxf<'_> {
    fn text(&mut self, code: u16, value: &str) -> io::Result<()> {
        write!(self.writer, "{code:>3}\r\n{value}\r\n")
    }

    fn integer(&mut self, code: u16, value: i64) -> io::Result<()> {
        write!(self.writer, "{code:>3}\r\n{value}\r\n")
    }

    /// Writes a number with the fewest digits that are read back as the same number, always with a point.
    fn number(&mut self, code: u16, value: f64) -> io::Result<()> {
        write!(self.writer, "{code:>3}\r\n{value:?}\r\n")
    }

    fn handle(&mut self, code: u16, handle: u32) -> io::Result<()> {
        write!(self.writer, "{code:>3}\r\n{handle:X}\r\n")
    }

    fn point(&mut self, code: u16, [x, y]: [f64; 2]) -> io::Result<()> {
        self.number(code, x)?;
        self.number(code + 10, y)
    }

    fn section(&mut self, name: &str) -> io::Result<()> {
        self.text(0, "SECTION")?;
        self.text(2, name)
    }

    /// Writes the start of an object: its type, its handle, its owner.
    fn object(&mut self, kind: &str, owner: u32) -> io::Result<u32> {
        let handle = self.next_handle;
        self.next_handle += 1;
        self.object_as(kind, handle, owner)?;
        Ok(handle)
    }

    fn object_as(&mut self, kind: &str, handle: u32, owner: u32) -> io::Result<()> {
        self.text(0, kind)?;
        // Only dimension styles keep their handle in another group.
        self.handle(if kind == "DIMSTYLE" { 105 } else { 5 }, handle)?;
        self.handle(330, owner)
    }

    fn header(&mut self, drawing: &DrawingAnswer, outlines: usize) -> io::Result<()> {
        let reach_mm = svg::reach_mm(&drawing.bodies);
        self.section("HEADER")?;
        self.text(9, "$ACADVER")?;
        self.text(1, "AC1015")?;
        self.text(9, "$DWGCODEPAGE")?;
        self.text(3, "ANSI_1252")?;
        for (name, corner_mm) in [("$EXTMIN", -reach_mm), ("$EXTMAX", reach_mm)] {
            self.text(9, name)?;
            self.point(10, [corner_mm; 2])?;
            self.number(30, 0.0)?;
        }
        // Metric; the unit is a millimetre.
        for (name, value) in [("$MEASUREMENT", 1), ("$INSUNITS", 4)] {
            self.text(9, name)?;
            self.integer(70, value)?;
        }
        // Above all handles of the tables and of the outlines.
        let beyond = u32::try_from(outlines).unwrap_or(u32::MAX).saturating_add(0x100);
        self.text(9, "$HANDSEED")?;
        self.handle(5, beyond)?;
        self.text(0, "ENDSEC")
    }

    /// Writes the classes of objects in this file that are not built into AutoCAD.
    fn classes(&mut self) -> io::Result<()> {
        self.section("CLASSES")?;
        for (kind, class) in
            [("ACDBDICTIONARYWDFLT", "AcDbDictionaryWithDefault"), ("ACDBPLACEHOLDER", "AcDbPlaceHolder")]
        {
            self.text(0, "CLASS")?;
            self.text(1, kind)?;
            self.text(2, class)?;
            self.text(3, "ObjectDBX Classes")?;
            for code in [90, 280, 281] {
                self.integer(code, 0)?;
            }
        }
        self.text(0, "ENDSEC")
    }

    fn tables(&mut self, drawing: &DrawingAnswer) -> io::Result<()> {
        self.section("TABLES")?;
        self.table("VPORT", 1, |dxf, table| dxf.view(table, svg::reach_mm(&drawing.bodies)))?;
        self.table("LTYPE", 3, |dxf, table| {
            for name in ["ByBlock", "ByLayer", "Continuous"] {
                dxf.record("LTYPE", "AcDbLinetypeTableRecord", table, name)?;
                dxf.text(3, "")?;
                dxf.integer(72, 65)?;
                dxf.integer(73, 0)?;
                dxf.number(40, 0.0)?;
            }
            Ok(())
        })?;
        let layers = drawing.bodies.iter().map(|body| layer_of(body.part));
        self.table("LAYER", 1 + drawing.bodies.len(), |dxf, table| {
            for Layer(name, color) in [Layer("0", 7)].into_iter().chain(layers) {
                dxf.record("LAYER", "AcDbLayerTableRecord", table, name)?;
                dxf.integer(62, color.into())?;
                dxf.text(6, "Continuous")?;
                dxf.integer(370, DEFAULT_LINE_WEIGHT)?;
                dxf.handle(390, PLOT_STYLE)?;
            }
            Ok(())
        })?;
        self.table("STYLE", 1, |dxf, table| {
            dxf.record("STYLE", "AcDbTextStyleTableRecord", table, "Standard")?;
            for (code, value) in [(40, 0.0), (41, 1.0), (50, 0.0)] {
                dxf.number(code, value)?;
            }
            dxf.integer(71, 0)?;
            dxf.number(42, 2.5)?;
            dxf.text(3, "txt")?;
            dxf.text(4, "")
        })?;
        self.table("VIEW", 0, |_, _| Ok(()))?;
        self.table("UCS", 0, |_, _| Ok(()))?;
        self.table("APPID", 2, |dxf, table| {
            dxf.record("APPID", "AcDbRegAppTableRecord", table, "ACAD")?;
            dxf.record("APPID", "AcDbRegAppTableRecord", table, APPLICATION)
        })?;
        self.table("DIMSTYLE", 1, |dxf, table| dxf.record("DIMSTYLE", "AcDbDimStyleTableRecord", table, "Standard"))?;
        self.table("BLOCK_RECORD", 2, |dxf, table| {
            for (name, handle) in [("*Model_Space", MODEL_SPACE), ("*Paper_Space", PAPER_SPACE)] {
                dxf.object_as("BLOCK_RECORD", handle, table)?;
                dxf.text(100, "AcDbSymbolTableRecord")?;
                dxf.text(100, "AcDbBlockTableRecord")?;
                dxf.text(2, name)?;
            }
            Ok(())
        })?;
        self.text(0, "ENDSEC")
    }

    fn table(
        &mut self,
        name: &str,
        records: usize,
        write: impl FnOnce(&mut Self, u32) -> io::Result<()>,
    ) -> io::Result<()> {
        self.text(0, "TABLE")?;
        self.text(2, name)?;
        let handle = self.next_handle;
        self.next_handle += 1;
        self.handle(5, handle)?;
        self.handle(330, 0)?;
        self.text(100, "AcDbSymbolTable")?;
        write!(self.writer, " 70\r\n{records}\r\n")?;
        if name == "DIMSTYLE" {
            self.text(100, "AcDbDimStyleTable")?;
        }
        write(self, handle)?;
        self.text(0, "ENDTAB")
    }

    fn record(&mut self, kind: &str, class: &str, table: u32, name: &str) -> io::Result<()> {
        self.object(kind, table)?;
        self.text(100, "AcDbSymbolTableRecord")?;
        self.text(100, class)?;
        self.text(2, name)?;
        self.integer(70, 0)
    }

    /// Writes the initial view: the whole drawing, from above, without snap and grid.
    fn view(&mut self, table: u32, reach_mm: f64) -> io::Result<()> {
        self.record("VPORT", "AcDbViewportTableRecord", table, "*Active")?;
        // Corners on the screen, centre, snap and grid.
        for (code, point) in
            [(10, [0.0; 2]), (11, [1.0; 2]), (12, [0.0; 2]), (13, [0.0; 2]), (14, [10.0; 2]), (15, [10.0; 2])]
        {
            self.point(code, point)?;
        }
        // Direction of view and target point.
        for (code, z) in [(16, 1.0), (17, 0.0)] {
            self.point(code, [0.0; 2])?;
            self.number(code + 20, z)?;
        }
        let height_mm = 2.0 * reach_mm * (1.0 + VIEW_MARGIN);
        // Height, aspect, lens, clipping planes, rotations of snap and view.
        for (code, value) in [(40, height_mm), (41, 1.0), (42, 50.0), (43, 0.0), (44, 0.0), (50, 0.0), (51, 0.0)] {
            self.number(code, value)?;
        }
        // Mode, smoothness of circles, fast zoom, coordinate icon; the rest is off.
        for (code, value) in [(71, 0), (72, 1000), (73, 1), (74, 3), (75, 0), (76, 0), (77, 0), (78, 0)] {
            self.integer(code, value)?;
        }
        Ok(())
    }

    fn blocks(&mut self) -> io::Result<()> {
        self.section("BLOCKS")?;
        for (name, owner) in [("*Model_Space", MODEL_SPACE), ("*Paper_Space", PAPER_SPACE)] {
            self.object("BLOCK", owner)?;
            self.text(100, "AcDbEntity")?;
            self.text(8, "0")?;
            self.text(100, "AcDbBlockBegin")?;
            self.text(2, name)?;
            self.integer(70, 0)?;
            self.point(10, [0.0; 2])?;
            self.number(30, 0.0)?;
            self.text(3, name)?;
            self.text(1, "")?;
            self.object("ENDBLK", owner)?;
            self.text(100, "AcDbEntity")?;
            self.text(8, "0")?;
            self.text(100, "AcDbBlockEnd")?;
        }
        self.text(0, "ENDSEC")
    }

    fn outline(
        &mut self,
        outline: &OutlineAnswer,
        placement: &PlacementAnswer,
        &Layer(layer, _): &Layer,
    ) -> io::Result<()> {
        let place = placement.placing();
        if let Some((center_mm, radius_mm)) = outline.circle() {
            self.entity("CIRCLE", "AcDbCircle", layer)?;
            self.point(10, place(center_mm))?;
            self.number(30, 0.0)?;
            return self.number(40, radius_mm);
        }
        let OutlineAnswer::Path { edges } = outline else { return Ok(()) };
        self.entity("LWPOLYLINE", "AcDbPolyline", layer)?;
        let vertices: usize = edges.iter().map(vertex_count).sum();
        write!(self.writer, " 90\r\n{vertices}\r\n")?;
        self.integer(70, 1)?; // closed
        for edge in edges {
            match edge {
                EdgeAnswer::Line { .. } => self.point(10, place(edge.start()))?,
                EdgeAnswer::Arc { sweep_deg, .. } => {
                    self.point(10, place(edge.start()))?;
                    // The bulge of a polyline is the tangent of a quarter of its arc's angle.
                    self.number(42, (0.25 * sweep_deg.to_radians()).tan())?;
                }
                EdgeAnswer::Curve { arcs, .. } => {
                    for &[x, y, bulge] in arcs {
                        self.point(10, place([x, y]))?;
                        self.number(42, bulge)?;
                    }
                }
            }
        }
        Ok(())
    }

    fn entity(&mut self, kind: &str, class: &str, layer: &str) -> io::Result<()> {
        self.object(kind, MODEL_SPACE)?;
        self.text(100, "AcDbEntity")?;
        self.text(8, layer)?;
        self.text(100, class)
    }

    /// Writes the named dictionaries: one of groups, empty, and one of plot styles, which every layer needs.
    fn objects(&mut self) -> io::Result<()> {
        self.section("OBJECTS")?;
        let entries = [("ACAD_GROUP", GROUP_DICTIONARY), ("ACAD_PLOTSTYLENAME", PLOT_STYLE_DICTIONARY)];
        self.dictionary("DICTIONARY", ROOT_DICTIONARY, 0, &entries)?;
        self.dictionary("DICTIONARY", GROUP_DICTIONARY, ROOT_DICTIONARY, &[])?;
        let normal = [("Normal", PLOT_STYLE)];
        self.dictionary("ACDBDICTIONARYWDFLT", PLOT_STYLE_DICTIONARY, ROOT_DICTIONARY, &normal)?;
        self.text(100, "AcDbDictionaryWithDefault")?;
        self.handle(340, PLOT_STYLE)?;
        self.object_as("ACDBPLACEHOLDER", PLOT_STYLE, PLOT_STYLE_DICTIONARY)?;
        self.text(0, "ENDSEC")
    }

    fn dictionary(&mut self, kind: &str, handle: u32, owner: u32, entries: &[(&str, u32)]) -> io::Result<()> {
        self.object_as(kind, handle, owner)?;
        self.text(100, "AcDbDictionary")?;
        self.integer(281, 1)?;
        for (name, entry) in entries {
            self.text(3, name)?;
            self.handle(350, *entry)?;
        }
        Ok(())
    }
}

/// Returns the vertices of an edge except its last, which is the start of the next edge.
const fn vertex_count(edge: &EdgeAnswer) -> usize {
    match edge {
        EdgeAnswer::Line { .. } | EdgeAnswer::Arc { .. } => 1,
        EdgeAnswer::Curve { arcs, .. } => arcs.len(),
    }
}
