//! Results as tables: Parquet and CSV hold the same cells.

use bytes::Bytes;
use parquet::file::reader::{FileReader as _, SerializedFileReader};
use parquet::record::Field;
use serde_json::{Value, json};
use toothwave_calculation::forms::{Format, Forms as _};
use toothwave_study::Gathered;

use crate::asking::{gathered, paper, text, with};

fn cells_of_csv(gathered: &Gathered) -> Vec<Vec<String>> {
    let text = text(gathered, Format::Csv);
    let mut csv = csv::ReaderBuilder::new().has_headers(false).from_reader(text.as_bytes());
    csv.records().map(|row| row.unwrap().iter().map(str::to_owned).collect()).collect()
}

/// Returns the names, then the rows in CSV spelling.
fn cells_of_parquet(gathered: &Gathered) -> Vec<Vec<String>> {
    let mut bytes = Vec::new();
    gathered.answer().write(Format::Parquet, &mut bytes).unwrap();
    cells_of_file(bytes)
}

pub(crate) fn cells_of_file(bytes: Vec<u8>) -> Vec<Vec<String>> {
    let file = SerializedFileReader::new(Bytes::from(bytes)).unwrap();
    let columns = file.metadata().file_metadata().schema().get_fields().iter();
    let mut cells = vec![columns.map(|column| column.name().to_owned()).collect::<Vec<_>>()];
    for row in file.get_row_iter(None).unwrap() {
        let row = row.unwrap();
        let spelled = row.get_column_iter().map(|(_, field)| match field {
            Field::Null => String::new(),
            Field::Long(count) => count.to_string(),
            Field::Double(number) => format!("{number:?}"),
            Field::Str(word) => word.clone(),
            other => panic!("{other:?}"),
        });
        cells.push(spelled.collect());
    }
    cells
}

fn assert_same(document: &Value) -> usize {
    let gathered = gathered(document);
    let (csv, parquet) = (cells_of_csv(&gathered), cells_of_parquet(&gathered));
    assert!(
        csv == parquet,
        "{}: {:?} and {:?}",
        document["study"],
        &csv[..2.min(csv.len())],
        &parquet[..2.min(parquet.len())]
    );
    csv.len() - 1
}

#[test]
fn parquet_and_csv_have_the_same_cells() {
    let radius = json!({ "min": 3.0, "max": 8.0, "steps": 11 });
    let map = json!({
        "study": "map", "base": paper(), "quantities": ["peak_stress_ring_mpa", "undercut"],
        "over": { "/drive/teeth/radius_mm": radius, "/model/compatibility": { "one_of": ["projection", "virtual_work"] } }
    });
    assert_eq!(assert_same(&map), 22);
    let search = json!({
        "study": "search", "base": paper(), "evaluations": 500,
        "free": { "/drive/teeth/radius_mm": { "min": 3.0, "max": 7.0 }, "/model/compatibility": { "one_of": ["projection", "virtual_work"] } },
        "objectives": [{ "quantity": "slot_wall_mm", "goal": "max" }, { "quantity": "peak_stress_mpa", "goal": "min" }]
    });
    assert!(assert_same(&search) > 5);
    assert!(
        assert_same(&json!({ "study": "sensitivity", "base": paper(), "quantities": ["peak_stress_ring_mpa"] })) > 4
    );
    let normal = json!({ "distribution": "normal", "sigma": 0.002 });
    let tolerance = json!({
        "study": "tolerance", "base": paper(), "samples": 100, "quantities": ["peak_stress_ring_mpa"],
        "inputs": { "/drive/teeth/radius_mm": normal }
    });
    assert_eq!(assert_same(&tolerance), 9);
    // Without results, the table has only names.
    let impossible = with(&search, "/require", json!({ "outer_diameter_mm": { "max": 1.0 } }));
    assert_eq!(assert_same(&impossible), 0);
}

#[test]
fn wide_table_has_small_row_groups() {
    let fields = (0..200).map(|entry| (format!("/deviations/slot_wall_um/{entry}"), json!({ "one_of": [0] })));
    let mut over: serde_json::Map<_, _> = fields.collect();
    // Nearly all variants are impossible, which makes them fast.
    over.insert("/drive/teeth/radius_mm".into(), json!({ "min": 1.0, "max": 900.0, "steps": 6000 }));
    let drive = json!({
        "wave_generator": { "semi_major_mm": 600.0, "semi_minor_mm": 599.0 },
        "teeth": { "count": 200, "radius_mm": 1.0, "width_mm": 15.0 },
        "ring": { "teeth": 198 }
    });
    let base = with(&with(&paper(), "/drive", drive), "/deviations", json!({ "slot_wall_um": vec![0; 200] }));
    let map = json!({ "study": "map", "base": base, "over": over, "quantities": ["transmission_ratio"] });
    let answer = gathered(&map).answer();
    let mut bytes = Vec::new();
    answer.write(Format::Parquet, &mut bytes).unwrap();
    let file = SerializedFileReader::new(Bytes::from(bytes)).unwrap();
    let groups = file.metadata().row_groups();
    assert_eq!(groups.iter().map(|group| group.num_rows()).sum::<i64>(), 6000);
    let most =
        groups.iter().map(|group| group.num_rows() * i64::try_from(group.columns().len()).unwrap()).max().unwrap();
    assert!(groups.len() > 1 && most <= 1 << 19, "{most} cells in one of {} groups", groups.len());
    // A number takes at least 8 bytes.
    let beside = answer.held_bytes(Format::Parquet) - answer.held_bytes(Format::Csv);
    assert!(beside >= 8 * u64::try_from(most).unwrap(), "{beside} bytes for {most} cells");
}

/// It has more rows than one Parquet row group.
#[test]
fn large_map_has_several_row_groups() {
    let steps = json!({ "min": 10.0, "max": 20.0, "steps": 70_000 });
    let map = json!({ "study": "map", "base": paper(), "quantities": ["transmission_ratio"], "over": { "/load/input_torque_nm": steps } });
    assert_eq!(assert_same(&map), 70_000);
}

#[test]
fn text_size_of_many_inputs_is_estimated_beforehand() {
    let mut base = with(&paper(), "/model/compatibility", json!("virtual_work"));
    base["deviations"] = json!({ "tooth_radius_um": (1..=28).collect::<Vec<_>>() });
    let inputs: serde_json::Map<_, _> =
        (0..28).map(|tooth| (format!("/deviations/tooth_radius_um/{tooth}"), json!({ "plus_minus": 0.01 }))).collect();
    let quantities = ["peak_stress_ring_mpa", "peak_stress_mpa", "slot_wall_mm"];
    let sensitivity = json!({ "study": "sensitivity", "base": base, "quantities": quantities, "inputs": inputs });
    let normal = json!({ "distribution": "normal", "sigma": 0.002 });
    let tolerance = json!({
        "study": "tolerance", "base": paper(), "samples": 3000, "quantities": quantities,
        "inputs": { "/drive/teeth/radius_mm": normal, "/load/input_torque_nm": normal }
    });
    for document in [sensitivity, tolerance] {
        let gathered = gathered(&document);
        let (text, expected_bytes) = (text(&gathered, Format::Json), gathered.answer().expected_bytes());
        assert!((text.len()..2 * text.len()).contains(&expected_bytes), "{expected_bytes} for {}", text.len());
    }
}
