//! Results as tables: Parquet holds what CSV does.

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

/// The names, then the rows as CSV spells them.
fn cells_of_parquet(gathered: &Gathered) -> Vec<Vec<String>> {
    let mut bytes = Vec::new();
    gathered.answer().write(Format::Parquet, &mut bytes).unwrap();
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
fn a_result_has_the_same_cells_as_parquet_and_as_csv() {
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
    // Where nothing was found there are the names.
    let impossible = with(&search, "/require", json!({ "outer_diameter_mm": { "max": 1.0 } }));
    assert_eq!(assert_same(&impossible), 0);
}

/// More rows than a group of Parquet holds.
#[test]
fn a_large_map_comes_in_several_groups() {
    let steps = json!({ "min": 10.0, "max": 20.0, "steps": 70_000 });
    let map = json!({ "study": "map", "base": paper(), "quantities": ["transmission_ratio"], "over": { "/load/input_torque_nm": steps } });
    assert_eq!(assert_same(&map), 70_000);
}
