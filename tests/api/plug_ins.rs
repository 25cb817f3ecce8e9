//! What docs/how-to/plug-ins.md shows.

use serde_json::{Value, json};

use crate::designs::with;
use crate::drawings::drawn;

/// To the last digits, which are the processor's.
#[tokio::test]
async fn plug_ins_show_edges_as_they_come() {
    let document = |text: &str| serde_json::from_str::<Value>(text).unwrap();
    let flat_sided = document(include_str!("../../examples/flat-sided.json"));
    let coarse = with(
        &document(include_str!("../../examples/paper-5.1.json")),
        "/profile",
        json!({ "chord_tolerance_mm": 1.0 }),
    );
    let mut edges = Vec::new();
    for (part, document) in [("tooth", flat_sided), ("wave-generator", coarse)] {
        edges.extend(drawn(part, &document).await["bodies"][0]["outer"]["edges"].as_array().unwrap().clone());
    }
    let shown: Vec<_> = include_str!("../../docs/how-to/plug-ins.md").split("```json\n").skip(1).collect();
    let shown = shown.iter().map(|text| document(text.split("```").next().unwrap()));
    let kinds: Vec<_> = shown.clone().map(|edge| edge["kind"].clone()).collect();
    assert_eq!(kinds, ["line", "arc", "curve"]);
    for edge in shown {
        assert!(edges.iter().any(|found| is_close(found, &edge)), "{edge}");
    }
}

/// The same but for rounding.
fn is_close(found: &Value, expected: &Value) -> bool {
    match (found, expected) {
        (Value::Number(found), Value::Number(expected)) => {
            (found.as_f64().unwrap() - expected.as_f64().unwrap()).abs() < 1e-9
        }
        (Value::Array(found), Value::Array(expected)) => {
            found.len() == expected.len()
                && found.iter().zip(expected).all(|(found, expected)| is_close(found, expected))
        }
        (Value::Object(found), Value::Object(expected)) => {
            found.len() == expected.len()
                && expected
                    .iter()
                    .all(|(name, expected)| found.get(name).is_some_and(|found| is_close(found, expected)))
        }
        _ => found == expected,
    }
}
