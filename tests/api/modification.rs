//! Modified parts.

use serde_json::{Value, json};

use crate::asking::Service;
use crate::designs::{eccentric, pointers, spelled_out, with};

/// Returns case 5.1 by virtual work with a modification and wind-up.
fn modified(modification: Value) -> Value {
    let model = json!({ "compatibility": "virtual_work", "stiffness": { "law": "palmgren" } });
    let document = with(&with(&spelled_out(), "/model", model), "/sweep", json!({ "wind_up": true }));
    with(&document, "/modification", modification)
}

/// Returns the same with gaps given as clearances.
fn cleared(clearance: Value) -> Value {
    with(&modified(json!({})), "/parts", clearance)
}

async fn swept(document: &Value) -> Value {
    Service::new().post("/v1/sweep", document).await.found()
}

fn numbers(column: &Value) -> Vec<f64> {
    column.as_array().unwrap().iter().map(|value| value.as_f64().unwrap()).collect()
}

#[track_caller]
fn assert_near(found: &[f64], expected: &[f64], relative: f64) {
    let size = expected.iter().fold(0.0_f64, |size, value| size.max(value.abs()));
    assert_eq!(found.len(), expected.len());
    for (found, expected) in found.iter().zip(expected) {
        assert!((found - expected).abs() <= relative * size, "{found} is not {expected}");
    }
}

fn relief() -> Value {
    json!({ "ring_tip_relief": { "amount_um": 6.0, "start_deg": 60.0, "power": 2.0 } })
}

#[tokio::test]
async fn offset_along_normals_equals_clearance() {
    let pairs = [
        (json!({ "ring_equidistant_um": 10.0 }), json!({ "ring": { "clearance_um": 10.0 } })),
        (json!({ "wave_generator_equidistant_um": 10.0 }), json!({ "wave_generator": { "clearance_um": 10.0 } })),
        (json!({ "slot_wall_um": 10.0 }), json!({ "carrier": { "clearance_um": 10.0 } })),
        (json!({ "tooth_radius_um": 10.0 }), json!({ "teeth": { "clearance_um": 10.0 } })),
    ];
    for (modification, clearance) in pairs {
        let (found, expected) = (swept(&modified(modification)).await, swept(&cleared(clearance)).await);
        for column in ["force_wave_generator_n", "force_ring_n", "force_carrier_n", "stress_ring_mpa"] {
            assert_near(&numbers(&found["states"][column]), &numbers(&expected["states"][column]), 1e-12);
        }
        assert_eq!(found["states"]["loaded"], expected["states"]["loaded"]);
        assert!(found["states"]["loaded"].is_array());
    }
}

#[tokio::test]
async fn turned_ring_or_carrier_is_lost_motion() {
    // kτ and (Z_G/U)τ for every tooth: docs/explanation/theory.md section 4.8.
    let conjugate = swept(&modified(json!({}))).await;
    for (field, ratio) in [("ring_rotation_arcsec", 13.0), ("carrier_rotation_arcsec", 14.0)] {
        let turned = swept(&modified(json!({ field: 36.0 }))).await;
        let forces = |answer: &Value| numbers(&answer["states"]["force_ring_n"]);
        assert_near(&forces(&turned), &forces(&conjugate), 1e-9);
        let wind_up_deg = |answer: &Value| numbers(&answer["wind_up"]["wind_up_deg"]);
        let lost: Vec<_> = wind_up_deg(&conjugate).iter().map(|wind_up| wind_up + ratio * 0.01).collect();
        assert_near(&wind_up_deg(&turned), &lost, 1e-9);
    }
}

#[tokio::test]
async fn each_modification_changes_an_answer() {
    let mut all = json!({
        "ring_equidistant_um": 10.0, "ring_path_shift_um": 3.0, "ring_profile_shift_um": 3.0, "ring_rotation_arcsec": 20.0,
        "wave_generator_equidistant_um": 1.0, "slot_wall_um": 1.0, "carrier_rotation_arcsec": 5.0, "tooth_radius_um": 0.5
    });
    all["ring_tip_relief"] = relief()["ring_tip_relief"].clone();
    let answer_without_findings = async |document: &Value| {
        let answer = swept(document).await;
        (numbers(&answer["states"]["force_ring_n"]), numbers(&answer["wind_up"]["wind_up_deg"]))
    };
    let document = modified(all.clone());
    let before = answer_without_findings(&document).await;
    let fields = pointers(&all, Value::is_number);
    assert_eq!(fields.len(), 11);
    for field in fields {
        let more = 1.1 * all.pointer(&field).unwrap().as_f64().unwrap();
        let after = answer_without_findings(&with(&document, &format!("/modification{field}"), json!(more))).await;
        assert!(after != before, "{field} moves nothing");
    }
}

#[tokio::test]
async fn outward_offsets_unload_flat_part_of_flank() {
    // Gaps are Δ cos β and Δ cos(β - δ), with δ < β. The path's shift leaves a smaller gap in the steep middle.
    let peak = async |modification: Value| {
        swept(&modified(modification)).await["peaks"]["ring"]["force_n"]["value"].as_f64().unwrap()
    };
    let none = peak(json!({})).await;
    let path = peak(json!({ "ring_path_shift_um": 10.0 })).await;
    let profile = peak(json!({ "ring_profile_shift_um": 10.0 })).await;
    let equidistant = peak(json!({ "ring_equidistant_um": 10.0 })).await;
    assert!(none < path && none < profile && none < equidistant, "{none} {path} {profile} {equidistant}");
    assert!((path - profile).abs() > 1e-3 && (profile - equidistant).abs() > 1e-3, "{path} {profile} {equidistant}");
}

#[tokio::test]
async fn teeth_on_relieved_tip_carry_less() {
    let last = |answer: &Value| {
        let states = &answer["states"];
        let pairs = numbers(&states["position_deg"]).into_iter().zip(numbers(&states["force_ring_n"]));
        pairs.filter(|(position_deg, _)| *position_deg > 75.0).map(|(_, force_n)| force_n).fold(0.0, f64::max)
    };
    let (with_relief, without) = (last(&swept(&modified(relief())).await), last(&swept(&modified(json!({}))).await));
    assert!(with_relief < 0.9 * without, "{with_relief} N, without {without} N");
}

#[tokio::test]
async fn interference_is_refused_unless_clearance_covers_it() {
    let full = modified(json!({ "ring_equidistant_um": -4.0 }));
    let problem = Service::new().post("/v1/sweep", &full).await.refused(422, "interference");
    let detail = problem["detail"].as_str().unwrap();
    assert!(detail.contains("deg") && detail.contains("µm") && detail.contains("`parts.*.clearance_um`"), "{detail}");
    let covered = with(&full, "/parts", json!({ "ring": { "clearance_um": 5.0 } }));
    let found = swept(&covered).await;
    let expected = swept(&cleared(json!({ "ring": { "clearance_um": 1.0 } }))).await;
    let forces = |answer: &Value| numbers(&answer["states"]["force_ring_n"]);
    assert_near(&forces(&found), &forces(&expected), 1e-9);
    // Geometry does not read modifications.
    Service::new().post("/v1/geometry", &full).await.found();
}

#[tokio::test]
async fn projection_rejects_modification_at_its_first_number() {
    let document = with(&modified(json!({ "slot_wall_um": 1.0 })), "/model", json!({ "compatibility": "projection" }));
    let refused = Service::new().post("/v1/sweep", &document).await;
    let problem = refused.refused(422, "impossible_design");
    let errors = problem["errors"].as_array().unwrap();
    assert_eq!(errors.len(), 1, "{problem}");
    assert_eq!(errors[0]["pointer"], "/modification/slot_wall_um");
    assert_eq!(errors[0]["code"], "conflicting_fields");
    // A modification of zeros is none.
    let nothing = with(&document, "/modification", json!({ "slot_wall_um": 0.0 }));
    Service::new().post("/v1/sweep", &nothing).await.found();
}

#[tokio::test]
async fn tip_relief_beyond_flank_is_reported_once() {
    let at = |start_deg: f64| {
        let relief = json!({ "amount_um": 6.0, "start_deg": start_deg, "power": 2.0 });
        with(&modified(json!({ "ring_tip_relief": relief })), "/load", json!({ "input_torque_nm": 0.0 }))
    };
    for (start_deg, limit) in [(90.0, 90.0), (150.0, 90.0), (181.0, 180.0)] {
        let problem = Service::new().post("/v1/sweep", &at(start_deg)).await.refused(422, "impossible_design");
        let errors = problem["errors"].as_array().unwrap();
        assert_eq!(errors.len(), 2, "{problem}");
        let error = errors.iter().find(|error| error["pointer"] == "/modification/ring_tip_relief/start_deg").unwrap();
        assert_eq!((error["value"].as_f64(), error["limit"].as_f64()), (Some(start_deg), Some(limit)), "{problem}");
    }
}

#[tokio::test]
async fn single_lobe_tip_relief_may_start_anywhere() {
    let relief = json!({ "amount_um": 3.0, "start_deg": 120.0, "power": 1.0 });
    // With few teeth the ring is not undercut, and the flank reaches the valley.
    let few = with(&with(&eccentric(), "/drive/teeth/count", json!(12)), "/drive/ring/teeth", json!(11));
    let document = with(&few, "/modification", json!({ "ring_tip_relief": relief }));
    let document = with(&document, "/model", json!({ "compatibility": "virtual_work" }));
    swept(&document).await;
}
