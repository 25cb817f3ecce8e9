//! Backlash at the output, as answer, quantity and finding.

use serde_json::{Value, json};

use crate::asking::Service;
use crate::designs::{shortest, with};

/// Case 5.1, wind-up asked for.
fn case_5_1(clearance_um: f64) -> Value {
    let clearance = json!({ "clearance_um": clearance_um });
    let parts = json!({ "wave_generator": clearance, "ring": clearance, "carrier": clearance });
    with(&with(&shortest(), "/parts", parts), "/sweep", json!({ "samples": 20, "wind_up": true }))
}

/// The same without clearances, one slot turned.
pub(crate) fn jammed() -> Value {
    let slots: Vec<_> = (0..28).map(|slot| if slot == 3 { 30.0 } else { 0.0 }).collect();
    with(&case_5_1(0.0), "/deviations", json!({ "slot_angle_arcsec": slots }))
}

async fn swept(document: &Value) -> Value {
    Service::new().post("/v1/sweep", document).await.found()
}

fn number(found: &Value, pointer: &str) -> f64 {
    found.pointer(pointer).and_then(Value::as_f64).unwrap_or_else(|| panic!("no {pointer}"))
}

#[tokio::test]
async fn case_5_1_has_its_mean_and_contributions() {
    let found = swept(&case_5_1(10.0)).await;
    let backlash = &found["wind_up"]["backlash"];
    for (pointer, expected) in [
        ("/mean_arcmin", 6.266),
        ("/contribution_arcmin/wave_generator", 2.476),
        ("/contribution_arcmin/ring", 2.681),
        ("/contribution_arcmin/carrier", 1.108),
    ] {
        assert!((number(backlash, pointer) - expected).abs() < 6e-4, "{pointer} of {backlash}");
    }
    assert!(found["findings"].as_array().unwrap().iter().all(|finding| finding["code"] != "negative_backlash"));
}

#[tokio::test]
async fn jammed_drive_has_finding() {
    let found = swept(&jammed()).await;
    assert!((number(&found, "/wind_up/backlash/smallest_arcmin") + 0.5).abs() < 1e-9);
    let findings = found["findings"].as_array().unwrap();
    let finding = findings.iter().find(|finding| finding["code"] == "negative_backlash").unwrap();
    assert_eq!(finding["pointers"], json!(["/parts", "/deviations"]));
    assert_eq!(finding["value"], found["wind_up"]["backlash"]["smallest_arcmin"]);
}

#[tokio::test]
async fn backlash_needs_wind_up() {
    let found = swept(&with(&jammed(), "/sweep", json!({ "samples": 20 }))).await;
    assert!(found.pointer("/wind_up").is_none());
    assert!(found["findings"].as_array().unwrap().iter().all(|finding| finding["code"] != "negative_backlash"));
}

/// A thick tooth cannot pass the lobes.
#[tokio::test]
async fn blocked_tooth_is_refused() {
    let radii: Vec<_> = (0..28).map(|tooth| if tooth == 3 { -6.0 } else { 0.0 }).collect();
    let document = with(&case_5_1(5.0), "/deviations", json!({ "tooth_radius_um": radii }));
    let wide = with(&document, "/parts/carrier", json!({ "clearance_um": 300.0 }));
    Service::new().post("/v1/sweep", &wide).await.refused(422, "interference");
}
