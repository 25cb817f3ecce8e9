//! Studies of earlier versions, without their deprecated fields.

use serde_json::{Value, json};
use toothwave_study::converted;

use crate::asking::{faulty, paper, study, with};

fn convert(document: &Value) -> Value {
    serde_json::from_str(&converted(document.to_string().as_bytes()).unwrap()).unwrap()
}

fn map(base: &Value, over: &Value) -> Value {
    json!({ "study": "map", "base": base, "over": over, "quantities": ["outer_diameter_mm"] })
}

#[test]
fn study_is_converted_with_its_pointers() {
    let range = json!({ "min": 0, "max": 10, "steps": 3 });
    let old = map(
        &with(&paper(), "/model/clearance", json!({ "carrier_um": 2.5 })),
        &json!({ "/model/clearance/ring_um": range }),
    );
    let new = map(
        &with(&paper(), "/parts", json!({ "carrier": { "clearance_um": 2.5 } })),
        &json!({ "/parts/ring/clearance_um": range }),
    );
    let id = |document: &Value| study(document).unwrap().id();
    assert_eq!(id(&convert(&old)), id(&new));
    assert_ne!(id(&old), id(&new));
}

/// A search reads the free fields of a start alone.
#[test]
fn start_keeps_the_values_of_free_fields() {
    let search = |free: &str, start: Value| {
        json!({
            "study": "search", "base": paper(), "free": { free: { "min": 0, "max": 10 } }, "start": [start],
            "objectives": [{ "quantity": "peak_force_n", "goal": "min" }]
        })
    };
    let gaps = |of_parts: f64, deprecated: f64| {
        let start = with(&paper(), "/parts", json!({ "ring": { "clearance_um": of_parts } }));
        with(&start, "/model/clearance", json!({ "ring_um": deprecated }))
    };
    for (free, start, expected) in [
        ("/parts/ring/clearance_um", gaps(0.0, 5.0), 0.0),
        ("/parts/ring/clearance_um", gaps(3.0, 5.0), 3.0),
        ("/model/clearance/ring_um", gaps(3.0, 5.0), 5.0),
    ] {
        let new = convert(&search(free, start));
        assert!(new["free"]["/parts/ring/clearance_um"].is_object(), "{new}");
        assert_eq!(new["start"][0]["parts"]["ring"]["clearance_um"].as_f64(), Some(expected), "{new}");
        study(&new).unwrap();
    }
}

#[test]
fn contradicting_study_is_not_converted() {
    let range = json!({ "min": 0, "max": 10, "steps": 3 });
    let deprecated = with(&paper(), "/model/clearance", json!({ "ring_um": 5.0 }));
    let of_teeth = with(&paper(), "/parts", json!({ "teeth": { "clearance_um": 5.0 } }));
    for document in [
        map(&deprecated, &json!({ "/parts/ring/clearance_um": range })),
        map(&of_teeth, &json!({ "/model/clearance/ring_um": range })),
        map(&paper(), &json!({ "/model/clearance/ring_um": range, "/parts/ring/clearance_um": range })),
    ] {
        let refused = converted(document.to_string().as_bytes()).unwrap_err();
        assert_eq!(refused.errors[0].pointer, faulty(&document).0, "{document}");
    }
}
