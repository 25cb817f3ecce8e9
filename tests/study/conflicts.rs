//! Fields that set the same quantity.

use serde_json::{Value, json};

use crate::asking::{answer, faulty, paper, with};

/// Returns a map and a search that vary a field and the radius of the teeth, for a quantity that needs no load.
fn studies(base: &Value, pointer: &str) -> [Value; 2] {
    let range = |steps: Value| {
        json!({
            "/drive/teeth/radius_mm": with(&steps, "/min", json!(4.0)),
            pointer: with(&steps, "/min", json!(0.0))
        })
    };
    let quantity = "outer_diameter_mm";
    let free = range(json!({ "max": 5.0 }));
    [
        json!({ "study": "map", "base": base, "over": range(json!({ "max": 5.0, "steps": 2 })), "quantities": [quantity] }),
        json!({ "study": "search", "base": base, "free": free, "objectives": [{ "quantity": quantity, "goal": "min" }] }),
    ]
}

#[test]
fn conflict_is_refused_for_quantities_without_load_too() {
    let point = json!({ "input_torque_nm": 20.0, "input_speed_rpm": 100.0, "share_of_time": 1.0 });
    let of_duty = with(&paper(), "/load", json!({ "duty": [point] }));
    let of_samples = with(&paper(), "/sweep", json!({ "samples": 50 }));
    let of_johnson = with(&paper(), "/model/stiffness", json!({ "law": "johnson" }));
    for (base, pointer, at) in [
        (of_johnson, "/parts/ring/clearance_um", "/base/model/stiffness/law"),
        (paper(), "/load/output_torque_nm", "/base/load"),
        (of_samples, "/sweep/tolerance", "/base/sweep"),
        (of_duty.clone(), "/load/input_torque_nm", "/base/load"),
        (of_duty.clone(), "/load/input_speed_rpm", "/base/load"),
        (of_duty, "/sweep/tolerance", "/free/~1sweep~1tolerance"),
    ] {
        let [map, search] = studies(&base, pointer);
        assert_eq!(faulty(&map), (at.replace("/free", "/over"), "conflicting_fields".into()), "{map}");
        assert_eq!(faulty(&search), (at.into(), "conflicting_fields".into()), "{search}");
    }
}

/// The default law follows the teeth: `projection` takes that of cylinders, not that of balls.
#[test]
fn conflict_of_some_shapes_refuses_no_study() {
    let base = with(
        &with(&paper(), "/model", json!({ "compatibility": "projection" })),
        "/drive/teeth",
        json!({ "count": 28, "radius_mm": 5.0 }),
    );
    let over = json!({ "/drive/teeth/shape": { "one_of": ["cylinder", "ball"] }, "/drive/teeth/width_mm": { "one_of": [15.0] } });
    let map = json!({ "study": "map", "base": base, "over": over, "quantities": ["peak_force_n"] });
    let found = answer(&map);
    assert_eq!(found["impossible"]["variant"], json!([1]), "{found}");
}

/// Otherwise the row of 0 would have the gap of the other field.
#[test]
fn gap_of_zero_beside_deprecated_gap_is_refused() {
    let deprecated = with(&paper(), "/model/clearance", json!({ "ring_um": 5.0 }));
    let of_parts = with(&paper(), "/parts", json!({ "teeth": { "clearance_um": 5.0 } }));
    for (base, pointer) in [
        (&deprecated, "/parts/ring/clearance_um"),
        (&deprecated, "/parts/teeth/clearance_um"),
        (&of_parts, "/model/clearance/ring_um"),
    ] {
        let [map, _] = studies(base, pointer);
        let at = format!("/over/{}", pointer.replace('/', "~1"));
        assert_eq!(faulty(&map), (at, "conflicting_fields".into()), "{map}");
    }
    // Another contact's gap is no conflict.
    let [map, _] = studies(&deprecated, "/parts/carrier/clearance_um");
    crate::asking::study(&map).unwrap();
}

/// Otherwise the other fields of the object would lose the values that the word stands for.
#[test]
fn field_of_object_given_as_word_is_refused() {
    for (place, value, varied) in [
        ("/parts", json!({ "carrier": { "strength": "100cr6" } }), "/parts/carrier/strength/yield_strength_mpa"),
        ("/model", json!({ "series_compliance_mm_per_n": "estimated" }), "/model/series_compliance_mm_per_n/ring"),
    ] {
        let [map, search] = studies(&with(&paper(), place, value), varied);
        for (study, list) in [(map, "over"), (search, "free")] {
            let at = format!("/{list}/{}", varied.replace('/', "~1"));
            assert_eq!(faulty(&study), (at, "conflicting_fields".into()), "{study}");
        }
    }
}
