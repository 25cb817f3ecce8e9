//! Drawings as binary STL, in millimetres: all bodies in place, in one list of triangles.

use std::io::{self, Write};

use super::DrawingAnswer;
use super::mesh::Mesh;
use super::svg;

/// Bytes before the number of triangles. They may have any content except `solid`, which marks a text file.
const HEAD_BYTES: usize = 80;

/// Writes a drawing. Fails for more triangles than STL can count.
pub(super) fn write(drawing: &DrawingAnswer, writer: &mut dyn Write) -> io::Result<()> {
    let meshes: Vec<_> = drawing.bodies.iter().map(|body| Mesh::new(body, drawing.chord_tolerance_mm)).collect();
    let bodies = || drawing.bodies.iter().zip(&meshes);
    let triangles: usize = bodies().map(|(body, mesh)| body.placements.len() * mesh.triangles.len()).sum();
    let mut head = svg::title(drawing).into_bytes();
    head.resize(HEAD_BYTES, b' ');
    writer.write_all(&head)?;
    writer.write_all(&u32::try_from(triangles).map_err(io::Error::other)?.to_le_bytes())?;
    for (body, mesh) in bodies() {
        for placement in &body.placements {
            let place = placement.placing();
            let placed = |[x, y, z]: [f64; 3]| {
                let [x, y] = place([x, y]);
                [x, y, z]
            };
            for triangle in &mesh.triangles {
                write_triangle(triangle.map(|corner| placed(mesh.points_mm[corner])), writer)?;
            }
        }
    }
    Ok(())
}

/// Writes the normal, the corners and two unused bytes.
fn write_triangle(corners_mm: [[f64; 3]; 3], writer: &mut dyn Write) -> io::Result<()> {
    let [a, b, c] = corners_mm;
    let (u, v) = (minus(b, a), minus(c, a));
    let normal = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]];
    let length = normal.iter().map(|x| x * x).sum::<f64>().sqrt().max(f64::MIN_POSITIVE);
    let mut record = [0; 50];
    let numbers = normal.map(|x| x / length).into_iter().chain(corners_mm.into_iter().flatten());
    for (bytes, number) in record.chunks_exact_mut(4).zip(numbers) {
        bytes.copy_from_slice(&single(number).to_le_bytes());
    }
    writer.write_all(&record)
}

fn minus(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

/// Rounds to the precision of STL.
#[expect(clippy::cast_possible_truncation, reason = "seven digits are what is wanted")]
pub(super) const fn single(number: f64) -> f32 {
    number as f32
}
