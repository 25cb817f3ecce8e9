//! Fingers of the carrier, as answer, capacity, quantity and finding.

use serde_json::{Value, json};

use crate::asking::Service;
use crate::designs::{shortest, with};

/// Case 5.1 with an allowable stress and this carrier.
fn case_5_1(carrier: Value) -> Value {
    let load = json!({ "input_torque_nm": 20.0, "allowable_stress_mpa": 1500.0 });
    with(&with(&shortest(), "/load", load), "/parts", json!({ "carrier": carrier }))
}

async fn swept(document: &Value) -> Value {
    Service::new().post("/v1/sweep", document).await.found()
}

fn number(found: &Value, pointer: &str) -> f64 {
    found.pointer(pointer).and_then(Value::as_f64).unwrap_or_else(|| panic!("no {pointer}"))
}

#[tokio::test]
async fn default_cage_has_stress_but_no_safety() {
    let found = swept(&case_5_1(json!({}))).await;
    let fingers = &found["fingers"];
    assert_eq!(fingers["fingers"], "far_ends_joined");
    assert_eq!((number(fingers, "/load_peak_over_mean"), fingers.get("safety")), (1.0, None));
    assert_eq!(found["torque_capacity"]["limited_by"], "ring");
    let thickness_mm = number(fingers, "/thickness_mm");
    assert!((thickness_mm - 3.884).abs() < 1e-3 && (number(fingers, "/height_mm") - 6.4).abs() < 1e-9);
    assert!((number(fingers, "/fillet_radius_mm") - 0.1 * thickness_mm).abs() < 1e-12);
    // Contact stresses are even, as with both ends held.
    let both = swept(&case_5_1(json!({ "fingers": "held_at_both_ends" }))).await;
    for same in ["peaks", "states", "torque_capacity"] {
        assert_eq!(found[same], both[same]);
    }
    assert!(number(&both, "/fingers/stress_mpa") < number(fingers, "/stress_mpa"));
}

#[tokio::test]
async fn weakest_of_contacts_and_fingers_limits_torque() {
    let limits = async |carrier: Value| {
        let found = swept(&case_5_1(carrier)).await;
        let capacity = found["torque_capacity"].clone();
        (capacity["limited_by"].as_str().unwrap().to_owned(), number(&capacity, "/output_torque_nm"))
    };
    let of = |strength: Value| json!({ "strength": strength, "fingers": "far_ends_joined" });
    let (by_contacts, contacts_nm) = limits(json!({ "fingers": "far_ends_joined" })).await;
    let (by, steel_nm) = limits(of(json!("42crmo4-qt"))).await;
    assert_eq!((by_contacts.as_str(), by.as_str(), steel_nm), ("ring", "ring", contacts_nm));
    let (by, aluminium_nm) = limits(of(json!("en-aw-7075-t6"))).await;
    assert_eq!(by, "finger_fatigue");
    let soft = json!({ "yield_strength_mpa": 90.0, "tensile_strength_mpa": 600.0, "endurance_limit_mpa": 600.0 });
    let (by, soft_nm) = limits(of(soft)).await;
    assert_eq!(by, "finger_yield");
    assert!(aluminium_nm < steel_nm && soft_nm < steel_nm);
}

#[tokio::test]
async fn reversed_load_lowers_safety_against_fatigue() {
    let carrier = json!({ "strength": "42crmo4-qt" });
    let [pulsating, reversed] =
        ["pulsating", "reversed"].map(|cycle| with(&case_5_1(carrier.clone()), "/load/cycle", json!(cycle)));
    let (pulsating, reversed) = (swept(&pulsating).await, swept(&reversed).await);
    assert_eq!(pulsating["fingers"], swept(&case_5_1(carrier)).await["fingers"]);
    let safeties = |found: &Value| {
        ["safety", "yield_safety", "fatigue_safety"].map(|name| number(&found["fingers"], &format!("/{name}")))
    };
    let ([least, of_yield, of_fatigue], [_, same, lower]) = (safeties(&pulsating), safeties(&reversed));
    assert_eq!((least, of_yield), (of_fatigue.min(of_yield), same));
    assert!((of_fatigue / lower - 682.76 / 495.0).abs() < 1e-4, "{of_fatigue} {lower}");
}

#[tokio::test]
async fn name_and_numbers_give_same_answer() {
    let presets = Service::new().get("/v1/materials").await.found()["strengths"].as_array().unwrap().clone();
    assert!(presets.len() > 3);
    for preset in presets {
        let named = swept(&case_5_1(json!({ "strength": preset["name"] }))).await;
        let mut numbers = json!({});
        for name in ["yield_strength_mpa", "tensile_strength_mpa", "endurance_limit_mpa", "hardened"] {
            numbers[name] = preset[name].clone();
        }
        assert_eq!(named, swept(&case_5_1(json!({ "strength": numbers }))).await, "{preset}");
    }
}

#[tokio::test]
async fn wrong_strength_is_refused() {
    let numbers = |yield_mpa: f64| json!({ "yield_strength_mpa": yield_mpa, "tensile_strength_mpa": 600.0, "endurance_limit_mpa": 200.0 });
    for (carrier, code, at, error_code) in [
        (json!({ "strength": "cheese" }), "invalid_document", "/strength", "unknown_choice"),
        (json!({ "strength": 900.0 }), "invalid_document", "/strength", "wrong_type"),
        (json!({ "strength": numbers(-1.0) }), "impossible_design", "/strength/yield_strength_mpa", "out_of_range"),
        (json!({ "finger_fillet_radius_mm": 0.0 }), "impossible_design", "/finger_fillet_radius_mm", "out_of_range"),
    ] {
        let problem = Service::new().post("/v1/sweep", &case_5_1(carrier)).await.refused(422, code);
        let error = &problem["errors"][0];
        assert_eq!((&error["pointer"], &error["code"]), (&json!(format!("/parts/carrier{at}")), &json!(error_code)));
    }
}

/// Held at one end, fingers make the load run to the foot: stresses by the root, wear by the load itself.
#[tokio::test]
async fn uneven_load_raises_stress_pressure_and_wear() {
    let friction = json!({
        "wave_generator": { "kind": "plain", "coefficient": 0.05 }, "ring": { "coefficient": 0.05 }, "carrier": { "coefficient": 0.05 },
        "wear_rate_mm3_per_nm": { "wave_generator": 1e-6, "ring": 1e-6, "carrier": 1e-6 }
    });
    let rubbing = with(&with(&case_5_1(json!({})), "/friction", friction), "/load/input_speed_rpm", json!(1000.0));
    let held = |fingers: &str| with(&rubbing, "/parts/carrier/fingers", json!(fingers));
    let (even, uneven) = (swept(&held("held_at_both_ends")).await, swept(&held("held_at_one_end")).await);
    let peak = number(&uneven, "/fingers/load_peak_over_mean");
    assert!((1.9..2.0).contains(&peak), "{peak}");
    let ratio = |pointer: &str| number(&uneven, pointer) / number(&even, pointer);
    for (pointer, expected) in [
        ("/peaks/ring/stress_mpa/value", peak.sqrt()),
        ("/peaks/ring/shear_depth_mm", peak.sqrt()),
        ("/peaks/ring/force_n/value", 1.0),
        ("/states/stress_carrier_mpa/9", peak.sqrt()),
        ("/losses/pressure_velocity_mpa_m_per_s/carrier/value", peak.sqrt()),
        ("/losses/wear_mm_per_hour/wave_generator/value", peak),
        ("/losses/loss_ratio", 1.0),
    ] {
        assert!((ratio(pointer) / expected - 1.0).abs() < 1e-12, "{pointer}: {}", ratio(pointer));
    }
    let capacity = ratio("/torque_capacity/output_torque_nm") * peak;
    assert!((capacity - 1.0).abs() < 0.05, "{capacity}");
}

#[tokio::test]
async fn weak_finger_has_finding() {
    let weak = json!({ "strength": "c45-n", "fingers": "held_at_one_end", "finger_fillet_radius_mm": 0.1 });
    let found = swept(&case_5_1(weak)).await;
    let findings = found["findings"].as_array().unwrap();
    let finding = findings.iter().find(|finding| finding["code"] == "finger_overstressed").unwrap();
    assert_eq!((&finding["value"], number(finding, "/limit")), (&found["fingers"]["safety"], 1.0));
    assert!(number(finding, "/value") < 1.0);
    let strong = swept(&case_5_1(json!({ "strength": "42crmo4-qt" }))).await;
    let codes: Vec<_> = strong["findings"].as_array().unwrap().iter().map(|finding| &finding["code"]).collect();
    assert!(!codes.contains(&&json!("finger_overstressed")), "{codes:?}");
}

#[tokio::test]
async fn balls_have_no_calculated_fingers() {
    let balls = json!({ "shape": "ball", "count": 28, "radius_mm": 5.0 });
    let found = swept(&with(&shortest(), "/drive/teeth", balls)).await;
    assert!(found.get("fingers").is_none());
}
