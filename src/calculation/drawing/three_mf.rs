//! Drawings as 3MF (core specification 1.3), in millimetres: an archive with each body once as an object, and one item
//! for each placement.

use std::io::{self, Cursor, Write};

use toothwave_solver::drawing::{Body, Placement};
use zip::ZipWriter;
use zip::write::SimpleFileOptions;

use super::DrawingAnswer;
use super::mesh::Mesh;
use super::stl::single;
use super::svg;
use crate::json;

const CONTENT_TYPES: &str = r#"<?xml version="1.0" encoding="UTF-8"?>
<Types xmlns="http://schemas.openxmlformats.org/package/2006/content-types"><Default Extension="rels" ContentType="application/vnd.openxmlformats-package.relationships+xml"/><Default Extension="model" ContentType="application/vnd.ms-package.3dmanufacturing-3dmodel+xml"/></Types>
"#;

const RELATIONSHIPS: &str = r#"<?xml version="1.0" encoding="UTF-8"?>
<Relationships xmlns="http://schemas.openxmlformats.org/package/2006/relationships"><Relationship Target="/3D/3dmodel.model" Id="model" Type="http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel"/></Relationships>
"#;

pub(super) fn write(drawing: &DrawingAnswer, writer: &mut dyn Write) -> io::Result<()> {
    let mut archive = ZipWriter::new(Cursor::new(Vec::new()));
    // Files of an archive have a date. The default one is constant, so the same design gives the same bytes.
    let options = SimpleFileOptions::default();
    for (name, text) in [("[Content_Types].xml", CONTENT_TYPES), ("_rels/.rels", RELATIONSHIPS)] {
        archive.start_file(name, options)?;
        archive.write_all(text.as_bytes())?;
    }
    archive.start_file("3D/3dmodel.model", options)?;
    write_model(drawing, &mut archive)?;
    writer.write_all(&archive.finish()?.into_inner())
}

fn write_model(drawing: &DrawingAnswer, writer: &mut dyn Write) -> io::Result<()> {
    writeln!(
        writer,
        r#"<?xml version="1.0" encoding="UTF-8"?>
<model unit="millimeter" xml:lang="en-US" xmlns="http://schemas.microsoft.com/3dmanufacturing/core/2015/02">
<metadata name="Title">{}</metadata>
<metadata name="Application">toothwave {}</metadata>
<resources>"#,
        svg::title(drawing),
        drawing.solver_version
    )?;
    for (index, body) in drawing.bodies.iter().enumerate() {
        write_object(1 + index, body, drawing.chord_tolerance_mm, writer)?;
    }
    writeln!(writer, "</resources>\n<build>")?;
    for (index, body) in drawing.bodies.iter().enumerate() {
        for Placement { x_mm, y_mm, rotation_deg } in &body.placements {
            let (sin, cos) = rotation_deg.to_radians().sin_cos();
            let id = 1 + index;
            // The rows are the images of x, y, z and the origin.
            writeln!(
                writer,
                r#"<item objectid="{id}" transform="{cos} {sin} 0 {} {cos} 0 0 0 1 {x_mm} {y_mm} 0"/>"#,
                -sin
            )?;
        }
    }
    writeln!(writer, "</build>\n</model>")
}

fn write_object(id: usize, body: &Body, tolerance_mm: f64, writer: &mut dyn Write) -> io::Result<()> {
    let mesh = Mesh::new(body, tolerance_mm);
    let name = json::word(&body.part);
    writeln!(writer, r#"<object id="{id}" type="model" name="{name}"><mesh><vertices>"#)?;
    for point_mm in &mesh.points_mm {
        let [x, y, z] = point_mm.map(single);
        writeln!(writer, r#"<vertex x="{x}" y="{y}" z="{z}"/>"#)?;
    }
    writeln!(writer, "</vertices><triangles>")?;
    for [v1, v2, v3] in &mesh.triangles {
        writeln!(writer, r#"<triangle v1="{v1}" v2="{v2}" v3="{v3}"/>"#)?;
    }
    writeln!(writer, "</triangles></mesh></object>")
}
