//! Parts as files: whatever wrote them, they are merged to the same bits.

use std::collections::BTreeSet;
use std::fs;
use std::path::PathBuf;
use std::sync::Arc;

use serde_json::json;
use toothwave_calculation::forms::Format;
use toothwave_solver::Never;
use toothwave_study::{Gathered, PartError, PartFolder, Study, Work};

use crate::asking::{LIMITS, gathered, paper, text, with};
use crate::engine::studies;
use crate::tables::cells_of_file;

/// A folder of this process, removed in the end.
struct Folder(PathBuf);

impl Folder {
    fn new(name: &str) -> Self {
        Self(std::env::temp_dir().join(format!("toothwave-{name}-{}", std::process::id())))
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        // It may not have been made.
        let _ = fs::remove_dir_all(&self.0);
    }
}

fn part_bytes(study: &Arc<Study>, chunk: u64) -> Vec<u8> {
    study.part_bytes(chunk, &Work::new(study, chunk).run(&Never).unwrap()).unwrap()
}

fn in_chunks_of(document: &serde_json::Value, variants: u64) -> Arc<Study> {
    Arc::new(Study::read(document.to_string().as_bytes(), &LIMITS).unwrap().in_chunks_of(variants))
}

#[test]
fn parts_in_files_give_the_same_bits() {
    // The linear law gives no share of a finger.
    let absent = json!({
        "study": "map", "base": paper(), "quantities": ["carrier_finger_share", "peak_stress_mpa"],
        "over": { "/drive/teeth/radius_mm": { "min": 4.0, "max": 20.0, "steps": 9 } }
    });
    for document in studies().into_iter().chain([absent]) {
        let study = in_chunks_of(&document, 500);
        let (path, mut merged) = (Folder::new(study.kind()), Gathered::new(&study));
        let folder = PartFolder::create(&path.0).unwrap();
        for chunk in (0..study.chunks()).rev() {
            folder.write(chunk, &part_bytes(&study, chunk)).unwrap();
        }
        assert_eq!(folder.chunks().unwrap(), (0..study.chunks()).collect::<BTreeSet<_>>());
        for chunk in folder.chunks().unwrap() {
            merged.add(chunk, study.read_part(chunk, folder.read(chunk).unwrap()).unwrap());
        }
        assert_eq!(text(&merged, Format::Json), text(&gathered(&document), Format::Json), "{}", study.kind());
    }
}

#[test]
fn temporary_files_are_no_parts() {
    let path = Folder::new("temporary");
    let folder = PartFolder::create(&path.0).unwrap();
    for name in [".0000000001-7-0.tmp", "notes.txt", "x.parquet"] {
        fs::write(path.0.join(name), "").unwrap();
    }
    assert_eq!(folder.chunks().unwrap(), BTreeSet::new());
    folder.write(3, b"first").unwrap();
    folder.write(3, b"second").unwrap();
    assert_eq!((folder.chunks().unwrap(), folder.read(3).unwrap()), (BTreeSet::from([3]), b"second".to_vec()));
}

#[test]
fn refuses_parts_of_other_studies_and_damaged_ones() {
    let [map, search, ..] = studies();
    let study = in_chunks_of(&map, 500);
    let bytes = part_bytes(&study, 1);
    assert!(study.read_part(1, bytes.clone()).is_ok());
    assert_eq!(study.read_part(2, bytes.clone()), Err(PartError::OtherStudy));
    assert_eq!(in_chunks_of(&map, 499).read_part(1, bytes.clone()), Err(PartError::OtherStudy));
    assert_eq!(in_chunks_of(&search, 1).read_part(1, bytes.clone()), Err(PartError::OtherStudy));
    assert!(matches!(study.read_part(1, bytes[..bytes.len() - 1].to_vec()), Err(PartError::Damaged(_))));
    assert!(matches!(study.read_part(1, Vec::new()), Err(PartError::Damaged(_))));
}

#[test]
fn refuses_part_of_another_build() {
    let [map, ..] = studies();
    let study = in_chunks_of(&map, 500);
    let (bytes, origin) = (part_bytes(&study, 0), toothwave_calculation::origin());
    let at = bytes.windows(origin.len()).position(|window| window == origin.as_bytes()).unwrap();
    let mut other = bytes;
    other[at..at + 4].copy_from_slice(b"0000");
    let refused = study.read_part(0, other).unwrap_err();
    assert!(matches!(&refused, PartError::OtherOrigin(found) if found.starts_with("0000")), "{refused}");
}

/// The columns of a tolerance study's rows: number, what deviates, inputs as drawn, quantities, reason.
#[test]
fn part_holds_a_row_a_variant() {
    let normal = json!({ "distribution": "normal", "sigma": 0.01 });
    let base = with(&paper(), "/model", json!({ "clearance": { "ring_um": 9.0 } }));
    let document = json!({
        "study": "tolerance", "base": base, "samples": 40, "quantities": ["peak_stress_ring_mpa"],
        "inputs": { "/drive/teeth/radius_mm": normal }, "deviations": { "ring_space_um": normal }
    });
    let study = in_chunks_of(&document, 1000);
    let cells = cells_of_file(part_bytes(&study, 0));
    assert_eq!(cells[0], ["variant", "deviates", "/drive/teeth/radius_mm", "peak_stress_ring_mpa", "reason"]);
    let deviates: Vec<_> = cells[1..].iter().map(|row| row[1].as_str()).collect();
    let counts = ["nothing", "everything", "/drive/teeth/radius_mm", "ring_space_um"]
        .map(|word| deviates.iter().filter(|found| **found == word).count());
    assert_eq!(counts, [1, 40, 40, 40]);
    let mut rows = Vec::new();
    gathered(&document).write_rows(Format::Csv, &mut rows).unwrap();
    let mut csv = csv::ReaderBuilder::new().has_headers(false).from_reader(rows.as_slice());
    let rows: Vec<Vec<String>> = csv.records().map(|row| row.unwrap().iter().map(str::to_owned).collect()).collect();
    assert_eq!(rows, cells);
}
