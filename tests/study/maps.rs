//! Maps.

use serde_json::{Value, json};
use toothwave_calculation::forms::Format;

use crate::asking::{answer, faulty, gathered, paper, text, with};

fn map(over: Value, quantities: Value) -> Value {
    json!({ "study": "map", "base": paper(), "over": over, "quantities": quantities })
}

#[test]
fn a_map_answers_each_variant_as_its_own_document_is_answered() {
    let over = json!({ "/drive/teeth/radius_mm": { "min": 3.0, "max": 7.0, "steps": 5 }, "/load/input_torque_nm": { "min": 10.0, "max": 20.0, "steps": 2 } });
    let found = answer(&map(over, json!(["peak_stress_ring_mpa", "undercut"])));
    assert_eq!(found["is_complete"], true, "{found}");
    println!("{found}");
}

#[test]
fn a_map_over_nothing_is_no_map() {
    assert_eq!(faulty(&map(json!({}), json!([]))), ("/over".into(), "missing_field".into()));
}

#[test]
fn the_lines_of_a_map_are_its_variants() {
    let over = json!({ "/drive/teeth/radius_mm": { "min": 3.0, "max": 9.0, "steps": 4 } });
    let csv = text(&gathered(&map(over, json!(["slot_wall_mm"]))), Format::Csv);
    println!("{csv}");
    let _ = with;
}
