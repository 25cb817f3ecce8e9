//! Meshes for printers, with the clearances that printing wants.

use std::collections::HashMap;

use serde_json::{Value, json};

use crate::asking::{Question, Service};
use crate::designs::{bored, eccentric, shortest, with};
use crate::drawings::{PARTS, finely, made, part_area_mm2};

/// The corners of a binary STL's triangles.
fn triangles(stl: &[u8]) -> Vec<[[f32; 3]; 3]> {
    let count = u32::from_le_bytes(stl[80..84].try_into().unwrap()) as usize;
    assert_eq!(stl.len(), 84 + 50 * count);
    let number = |bytes: &[u8]| f32::from_le_bytes(bytes.try_into().unwrap());
    let corner = |bytes: &[u8]| [0, 4, 8].map(|at| number(&bytes[at..at + 4]));
    stl[84..].chunks_exact(50).map(|record| [12, 24, 36].map(|at| corner(&record[at..at + 12]))).collect()
}

async fn stl(path: &str, document: &Value) -> Vec<u8> {
    let question = Question::post(path, document.to_string()).with("accept", "model/stl");
    let answer = Service::new().ask(&question).await;
    assert_eq!((answer.status, answer.header("content-type")), (200, "model/stl"));
    answer.body
}

/// tests/drawings/meshes.py looks closer, by a mesh library.
#[tokio::test]
async fn a_mesh_is_closed_and_has_the_volume_of_its_prism() {
    for document in
        [shortest(), bored(), with(&eccentric(), "/parts", json!({ "wave_generator": { "bore_radius_mm": 10.0 } }))]
    {
        let width_mm = document["drive"]["teeth"]["width_mm"].as_f64().unwrap();
        // Of the smallest tooth 0.01 %.
        let fine = with(&document, "/profile", json!({ "chord_tolerance_mm": 1e-4 }));
        for part in PARTS {
            let triangles = triangles(&stl(&format!("/v1/drawings/{part}"), &fine).await);
            // Each edge is run through once in either direction.
            let mut edges = HashMap::new();
            let mut volume_mm3 = 0.0;
            for corners in &triangles {
                for (from, to) in [(0, 1), (1, 2), (2, 0)] {
                    let bits = |corner: [f32; 3]| corner.map(f32::to_bits);
                    let (from, to) = (bits(corners[from]), bits(corners[to]));
                    *edges.entry((from, to)).or_insert(0) += 1;
                    *edges.entry((to, from)).or_insert(0) -= 1;
                }
                let [a, b, c] = corners.map(|corner| corner.map(f64::from));
                volume_mm3 += (a[0] * (b[1] * c[2] - b[2] * c[1])
                    + a[1] * (b[2] * c[0] - b[0] * c[2])
                    + a[2] * (b[0] * c[1] - b[1] * c[0]))
                    / 6.0;
            }
            assert!(edges.values().all(|&count| count == 0), "{part} is open");
            let expected_mm3 = part_area_mm2(part, &finely(&document)).await * width_mm;
            assert!(
                (volume_mm3 / expected_mm3 - 1.0).abs() < 1e-4,
                "{part}: {volume_mm3} mm³, expected {expected_mm3}"
            );
        }
    }
}

#[tokio::test]
async fn the_printing_preset_sets_all_clearances() {
    let of_50_um = json!({ "clearance_um": 50.0 });
    let parts = json!({ "wave_generator": of_50_um, "teeth": of_50_um, "ring": of_50_um, "carrier": of_50_um });
    let service = Service::new();
    for document in [shortest(), made(r#"{ "teeth": { "clearance_um": 3 }, "ring": { "clearance_um": 4 } }"#)] {
        let printed = service.post("/v1/drawings/assembly?preset=printing", &document).await.found();
        assert_eq!(
            printed,
            service.post("/v1/drawings/assembly", &with(&document, "/parts", parts.clone())).await.found()
        );
        assert_ne!(printed, service.post("/v1/drawings/assembly", &document).await.found());
    }
    let deprecated = with(&shortest(), "/model", json!({ "clearance": { "ring_um": 10.0 } }));
    let printed = service.post("/v1/drawings/ring?preset=printing", &deprecated).await.found();
    assert!(printed["findings"].to_string().contains("deprecated_field"), "{}", printed["findings"]);
    for query in ["?preset=milling", "?preset", "?printing=true"] {
        service.post(&format!("/v1/drawings/ring{query}"), &shortest()).await.refused(400, "invalid_query");
    }
}
