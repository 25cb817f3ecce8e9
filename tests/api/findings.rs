//! Findings about possible drives.

use serde_json::{Value, json};

use crate::asking::{ENDPOINTS, Service};
use crate::backlash::jammed;
use crate::codes::{codes_of, finding_codes, words};
use crate::designs::{bored, of_the_paper, shortest, spelled_out, undercut, with, without};

/// Returns the findings of an endpoint and checks their form.
async fn findings_at(path: &str, document: &Value) -> Vec<Value> {
    let found = Service::new().post(path, document).await.found();
    let findings = found["findings"].as_array().unwrap().clone();
    let parts = json!({
        "wave_generator": { "bore_radius_mm": 20 },
        "ring": { "outer_radius_mm": 80, "clearance_um": 0, "rim": "housed" },
        "carrier": { "inner_radius_mm": 59, "outer_radius_mm": 65, "clearance_um": 0, "fingers": "held_at_both_ends" }
    });
    let spelled_out = with(&with(&spelled_out(), "/drive/ring/tip_radius_mm", json!(1.0)), "/parts", parts);
    let series = json!({ "wave_generator": 0.0, "ring": 0.0, "carrier": 0.0 });
    let spelled_out = with(&spelled_out, "/model/series_compliance_mm_per_n", series);
    for finding in &findings {
        for member in ["code", "severity", "detail", "advice"] {
            assert!(finding[member].as_str().is_some_and(|text| !text.is_empty()), "`{member}` of {finding}");
        }
        assert!(["info", "warning"].contains(&finding["severity"].as_str().unwrap()), "{finding}");
        assert!(
            finding["unit"].is_string() && finding["value"].is_number() && finding["limit"].is_number(),
            "{finding}"
        );
        let pointers = finding["pointers"].as_array().unwrap();
        assert!(!pointers.is_empty(), "{finding}");
        for pointer in pointers {
            let pointer = pointer.as_str().unwrap();
            assert!(spelled_out.pointer(pointer).or(document.pointer(pointer)).is_some(), "no document has {pointer}");
        }
        assert_eq!(finding.as_object().unwrap().len(), 8, "{finding}");
    }
    findings
}

async fn findings(document: &Value) -> Vec<Value> {
    findings_at("/v1/sweep", document).await
}

/// Returns the only finding with this code.
async fn finding(document: &Value, code: &str) -> Value {
    let mut findings = findings(document).await;
    findings.retain(|finding| finding["code"] == code);
    assert_eq!(findings.len(), 1, "{code}: {findings:?}");
    findings.remove(0)
}

fn assert_numbers(finding: &Value, value: f64, limit: f64, unit: &str) {
    for (name, expected) in [("value", value), ("limit", limit)] {
        let found = finding[name].as_f64().unwrap();
        assert!((found - expected).abs() <= 1e-9 * expected.abs().max(1.0), "{name} of {finding} is not {expected}");
    }
    assert_eq!(finding["unit"], unit);
}

#[tokio::test]
async fn undercut_warning_states_critical_radius() {
    let finding = finding(&undercut(), "undercut").await;
    let found = Service::new().post("/v1/geometry", &undercut()).await.found();
    assert_numbers(&finding, 1.5, found["undercut"]["critical_tooth_radius_mm"].as_f64().unwrap(), "mm");
    assert_eq!(finding["severity"], "warning");
    assert!(finding["pointers"].as_array().unwrap().contains(&json!("/drive/teeth/radius_mm")));
    assert!(finding["detail"].as_str().unwrap().contains("43.607"), "{finding}");
}

#[tokio::test]
async fn undercut_removed_by_bore_is_information() {
    assert_eq!(finding(&bored(), "undercut").await["severity"], "info");
}

#[tokio::test]
async fn bore_shortening_flank_states_natural_tip() {
    let natural =
        Service::new().post("/v1/geometry", &undercut()).await.found()["ring"]["tip_radius_mm"].as_f64().unwrap();
    assert_numbers(&finding(&bored(), "bore_shortens_flank").await, 52.8227, natural, "mm");
}

#[tokio::test]
async fn bore_inside_natural_tip_has_no_effect() {
    let document = with(&spelled_out(), "/drive/ring/tip_radius_mm", json!(65.9));
    let found = finding(&document, "bore_without_effect").await;
    assert_numbers(&found, 65.9, 66.0, "mm");
    assert_eq!((&found["severity"], &found["pointers"]), (&json!("info"), &json!(["/drive/ring/tip_radius_mm"])));
    let service = Service::new();
    for path in ENDPOINTS {
        let mut with_bore = service.post(path, &document).await.found();
        let mut without = service.post(path, &spelled_out()).await.found();
        assert_ne!(with_bore["findings"], without["findings"]);
        // The hash depends on the document.
        for field in ["findings", "design_hash"] {
            with_bore.as_object_mut().unwrap().remove(field);
            without.as_object_mut().unwrap().remove(field);
        }
        assert!(with_bore == without, "{path}");
    }
}

/// Returns case 5.1 with thirty teeth and every fifth slot filled: one or two teeth in each zone.
fn sparse() -> Value {
    let document =
        with(&shortest(), "/drive/teeth", json!({ "count": 30, "installed": 6, "radius_mm": 5.0, "width_mm": 15.0 }));
    with(&document, "/drive/ring/teeth", json!(28))
}

#[tokio::test]
async fn few_teeth_in_mesh_are_a_warning() {
    let finding = finding(&sparse(), "few_teeth_in_mesh").await;
    assert_numbers(&finding, 1.0, 2.0, "");
    assert_eq!(finding["severity"], "warning");
}

/// Returns case 5.1 with thick teeth, so that slot walls are thin.
fn thick() -> Value {
    with(&shortest(), "/drive/teeth/radius_mm", json!(5.5))
}

#[tokio::test]
async fn thin_slot_wall_is_a_warning() {
    let half = std::f64::consts::PI / 28.0;
    let wall = 2.0 * ((58.0_f64 * 58.0 - 5.5 * 5.5).sqrt() * half.sin() - 5.5 * half.cos());
    assert_numbers(&finding(&thick(), "thin_slot_wall").await, wall, 2.75, "mm");
}

/// Returns case 5.1 with teeth about as thick as the cam's stroke.
fn thin(radius_mm: f64) -> Value {
    with(&shortest(), "/drive/teeth/radius_mm", json!(radius_mm))
}

#[tokio::test]
async fn loaded_tooth_beyond_carrier_warns_for_each_edge() {
    // Centres run from b + r to a + r; the annulus reaches from a to b + 2r.
    let findings = findings(&thin(1.9)).await;
    let beyond: Vec<_> = findings.iter().filter(|finding| finding["code"] == "tooth_beyond_carrier").collect();
    assert_eq!(beyond.len(), 2, "{findings:?}");
    assert_numbers(beyond[0], 57.9, 58.0, "mm");
    assert_numbers(beyond[1], 59.9, 59.8, "mm");
    let stays = findings_at("/v1/geometry", &thin(2.1)).await;
    assert!(!codes_of(&stays).contains(&"tooth_beyond_carrier".to_owned()));
}

/// Returns a deep ellipse with many small teeth.
fn steep() -> Value {
    json!({
        "drive": {
            "wave_generator": { "semi_major_mm": 58.0, "semi_minor_mm": 50.0 },
            "teeth": { "count": 62, "radius_mm": 2.5, "width_mm": 15.0 },
            "ring": { "teeth": 60 }
        },
        "load": { "input_torque_nm": 20.0 }
    })
}

#[tokio::test]
async fn steep_ring_flank_warning_states_pressure_angle() {
    let finding = finding(&steep(), "steep_ring_flank").await;
    let geometry = Service::new().post("/v1/geometry", &steep()).await.found();
    assert_numbers(&finding, geometry["ring"]["pressure_angle_max_deg"].as_f64().unwrap(), 70.0, "deg");
    assert!(finding["value"].as_f64().unwrap() > 70.0);
}

/// Returns case 5.1 under a hundred times its torque: stresses are ten times larger, all above 1500 MPa.
fn overloaded() -> Value {
    with(&with(&shortest(), "/model", of_the_paper()), "/load/input_torque_nm", json!(2000.0))
}

#[tokio::test]
async fn stress_above_fatigue_limit_warns_for_each_contact() {
    let found = Service::new().post("/v1/sweep", &overloaded()).await.found();
    let mut findings = findings(&overloaded()).await;
    // This load also gives a wind-up beyond the model.
    findings.retain(|finding| finding["code"] != "wind_up_beyond_model");
    assert_eq!(findings.len(), 3, "{findings:?}");
    for (finding, contact) in findings.iter().zip(["wave_generator", "ring", "carrier"]) {
        assert_eq!(finding["code"], "stress_above_fatigue_limit");
        assert_numbers(finding, found["peaks"][contact]["stress_mpa"]["value"].as_f64().unwrap(), 1500.0, "MPa");
        assert!(finding["detail"].as_str().unwrap().contains(&contact.replace('_', " ")), "{finding}");
    }
}

/// Returns case 5.1 with gaps of a millimetre at the carrier.
fn loose() -> Value {
    let document = with(&shortest(), "/model", json!({ "compatibility": "virtual_work" }));
    with(&document, "/parts", json!({ "carrier": { "clearance_um": 1000.0 } }))
}

#[tokio::test]
async fn wind_up_above_tenth_of_period_warns() {
    let document = with(&loose(), "/sweep", json!({ "wind_up": true }));
    let found = Service::new().post("/v1/sweep", &document).await.found();
    let wind_up = found["wind_up"]["wind_up_deg"].as_array().unwrap();
    let most = wind_up.iter().map(|value| value.as_f64().unwrap()).fold(0.0, f64::max);
    let finding = finding(&loose(), "wind_up_beyond_model").await;
    assert_numbers(&finding, most, 36.0 / 26.0, "deg");
    assert!(most > 36.0 / 26.0 && finding["severity"] == "warning");
    let tight = with(&loose(), "/parts", json!({ "carrier": { "clearance_um": 10.0 } }));
    assert!(!codes_of(&findings(&tight).await).contains(&"wind_up_beyond_model".to_owned()));
}

#[tokio::test]
async fn sweep_counts_meshing_and_loaded_teeth() {
    let found = Service::new().post("/v1/sweep", &loose()).await.found();
    assert_eq!(found["teeth_in_mesh_per_zone"], json!({ "min": 7, "max": 7 }));
    let loaded = found["states"]["loaded"].as_array().unwrap();
    let angles = found["states"]["input_angle_deg"].as_array().unwrap();
    let mut carrying: Vec<(f64, u64)> = Vec::new();
    for (angle, loaded) in angles.iter().zip(loaded) {
        let (angle, loaded) = (angle.as_f64().unwrap(), u64::from(loaded.as_bool().unwrap()));
        match carrying.last_mut() {
            Some((last, teeth)) if *last == angle => *teeth += loaded,
            _ => carrying.push((angle, loaded)),
        }
    }
    let teeth = carrying.iter().map(|(_, teeth)| *teeth);
    let expected = json!({ "min": teeth.clone().min(), "max": teeth.max() });
    assert_eq!(found["loaded_teeth_per_zone"], expected);
    assert!(expected["max"].as_u64() < Some(7));
}

#[tokio::test]
async fn unread_load_gives_no_stress_finding() {
    for path in ["/v1/geometry", "/v1/coincidence-degree"] {
        assert!(findings_at(path, &overloaded()).await.is_empty());
    }
}

#[tokio::test]
async fn all_endpoints_report_same_findings_of_drive() {
    for document in [undercut(), bored(), sparse(), thick(), thin(1.9), steep()] {
        let of_geometry = findings_at("/v1/geometry", &document).await;
        assert_eq!(findings_at("/v1/coincidence-degree", &document).await, of_geometry);
        let of_sweep = findings_at("/v1/sweep", &document).await;
        assert_eq!(of_sweep[..of_geometry.len()], of_geometry, "a sweep adds to them");
    }
}

/// Returns the findings of an assembly without those of its drive.
async fn findings_of_parts(document: &Value) -> Vec<Value> {
    let of_drive = findings_at("/v1/geometry", document).await.len();
    findings_at("/v1/drawings/assembly", document).await.split_off(of_drive)
}

#[tokio::test]
async fn drawn_carrier_losing_teeth_warns_for_each_edge() {
    // Centres run from b + r to a + r; a wall stands r beside the slot's middle.
    let along = |radius_mm: f64| (radius_mm * radius_mm - 25.0).sqrt();
    for (radii, edge, expected) in [
        (json!({ "inner_radius_mm": 58.1, "outer_radius_mm": 58.2 }), "outer", (63.0, along(58.2))),
        (json!({ "inner_radius_mm": 62.0 }), "inner", (61.0, along(62.0))),
    ] {
        let document = with(&shortest(), "/parts", json!({ "carrier": radii }));
        let [finding] = &findings_of_parts(&document).await[..] else { panic!("{radii}") };
        assert_eq!((&finding["code"], &finding["severity"]), (&json!("tooth_leaves_slot"), &json!("warning")));
        assert_eq!(finding["pointers"][0], json!(format!("/parts/carrier/{edge}_radius_mm")));
        assert_numbers(finding, expected.0, expected.1, "mm");
    }
    let holds = json!({ "inner_radius_mm": 61.2, "outer_radius_mm": 63.3 });
    assert!(findings_of_parts(&with(&shortest(), "/parts", json!({ "carrier": holds }))).await.is_empty());
}

#[tokio::test]
async fn tooth_leaving_slot_unloaded_is_information() {
    // Case 5.2 by default: centres start at b + r = 50.8 mm, far past the undercut flank. The carrier starts a tenth of
    // the annulus outside the cam.
    let found = Service::new().post("/v1/geometry", &undercut()).await.found();
    let inner_mm = 50.7 + 0.1 * (found["ring"]["tip_radius_mm"].as_f64().unwrap() - 50.7);
    let findings = findings_of_parts(&undercut()).await;
    let [finding] = &findings[..] else { panic!("{findings:?}") };
    assert_eq!((&finding["code"], &finding["severity"]), (&json!("tooth_leaves_slot"), &json!("info")));
    assert_numbers(finding, 50.8, (inner_mm * inner_mm - 2.25).sqrt(), "mm");
}

/// Returns case 5.1 with a rim and a cam wall of one micrometre.
fn thin_walls() -> Value {
    let parts = json!({ "ring": { "outer_radius_mm": 68.001 }, "wave_generator": { "bore_radius_mm": 55.999 } });
    with(&shortest(), "/parts", parts)
}

#[tokio::test]
async fn micrometre_rims_and_walls_are_warnings() {
    let findings = findings_of_parts(&thin_walls()).await;
    let [rim, wall] = &findings[..] else { panic!("{findings:?}") };
    for (finding, pointer) in [(rim, "/parts/ring/outer_radius_mm"), (wall, "/parts/wave_generator/bore_radius_mm")] {
        assert_eq!((&finding["code"], &finding["pointers"]), (&json!("thin_wall_as_made"), &json!([pointer])));
        assert_numbers(finding, 0.001, 2.5, "mm");
    }
    let thick = json!({ "ring": { "outer_radius_mm": 70.6 }, "wave_generator": { "bore_radius_mm": 53.4 } });
    assert!(findings_of_parts(&with(&shortest(), "/parts", thick)).await.is_empty());
}

/// Returns case 5.1 with a ring clearance that moves the flank beyond the critical distance.
fn cleared(clearance_um: f64) -> Value {
    let parts = json!({ "ring": { "clearance_um": clearance_um, "outer_radius_mm": 90 } });
    with(&shortest(), "/parts", parts)
}

#[tokio::test]
async fn clearance_that_undercuts_ring_states_critical_distance() {
    // At the tip, the path of centres has the critical distance as its radius of curvature.
    let (a, b, r, k) = (58.0_f64, 56.0_f64, 5.0_f64, 13.0_f64);
    let critical_mm = (b + r) / (k * k * (a * a - b * b) / (a * a + b * r) - 1.0);
    let codes = async |clearance_um: f64| codes_of(&findings_of_parts(&cleared(clearance_um)).await);
    assert!(codes(1e3 * (critical_mm - r) - 1.0).await.is_empty());
    let findings = findings_of_parts(&cleared(1e3 * (critical_mm - r) + 1.0)).await;
    let [finding] = &findings[..] else { panic!("{findings:?}") };
    assert_eq!(finding["code"], "clearance_undercuts_ring");
    assert_numbers(finding, critical_mm + 1e-3, critical_mm, "mm");
    assert_eq!(findings_at("/v1/geometry", &cleared(9000.0)).await, findings_at("/v1/geometry", &shortest()).await);
}

#[tokio::test]
async fn undercut_by_offset_points_to_its_fields() {
    let modified = |document: &Value| with(document, "/modification", json!({ "ring_equidistant_um": 3000 }));
    let (clearance, equidistant, radius) =
        ("/parts/ring/clearance_um", "/modification/ring_equidistant_um", "/drive/teeth/radius_mm");
    for (document, pointers) in [
        (cleared(3000.0), vec![clearance, radius]),
        (modified(&cleared(0.0)), vec![equidistant, radius]),
        (modified(&cleared(10.0)), vec![clearance, equidistant, radius]),
    ] {
        let findings = findings_of_parts(&document).await;
        assert_eq!(findings[0]["pointers"], json!(pointers));
    }
}

#[tokio::test]
async fn undrawn_parts_have_no_findings() {
    assert!(findings_at("/v1/drawings/tooth", &thin_walls()).await.is_empty());
    assert_eq!(findings_at("/v1/drawings/ring", &thin_walls()).await.len(), 1);
}

/// Returns case 5.1 with a plain cam and equal friction everywhere.
fn rubbing(coefficient: f64) -> Value {
    let contact = json!({ "coefficient": coefficient });
    let cam = json!({ "kind": "plain", "coefficient": coefficient });
    with(&shortest(), "/friction", json!({ "wave_generator": cam, "ring": contact, "carrier": contact }))
}

#[tokio::test]
async fn friction_beyond_measured_range_states_its_end() {
    let along = finding(&rubbing(0.06), "friction_beyond_measured").await;
    assert_numbers(&along, 0.06, 0.05, "");
    assert_eq!(along["severity"], "warning");
    assert_numbers(&finding(&rubbing(0.2), "friction_beyond_measured").await, 0.2, 0.1, "");
    for document in [rubbing(0.05), rubbing(0.001)] {
        assert!(!codes_of(&findings(&document).await).contains(&"friction_beyond_measured".to_owned()));
    }
}

#[tokio::test]
async fn uncertain_efficiency_is_information_with_its_error() {
    let found = Service::new().post("/v1/sweep", &rubbing(0.03)).await.found();
    let losses = &found["losses"];
    let share = 1.0 / losses["efficiency"]["ring_fixed"].as_f64().unwrap() - 1.0;
    let finding = finding(&rubbing(0.03), "efficiency_uncertain").await;
    // Plain cam: ten times the coefficient of the losses over the output.
    assert_numbers(&finding, 10.0 * 0.03 * share, 0.05, "");
    assert_numbers(&finding, losses["efficiency_error"].as_f64().unwrap(), 0.05, "");
    assert_eq!(finding["severity"], "info");
    assert!(!codes_of(&findings(&rubbing(0.005)).await).contains(&"efficiency_uncertain".to_owned()));
}

/// Returns an eccentric drive on a bearing of this rating.
fn on_a_bearing(rating_n: f64, load: &Value) -> Value {
    let contact = json!({ "coefficient": 0.02 });
    let bearing = json!({
        "kind": "rolling", "bearing_coefficient": 0.0015, "bearing_radius_mm": 25.0, "bearing_load_rating_n": rating_n
    });
    json!({
        "drive": {
            "wave_generator": { "kind": "eccentric", "radius_mm": 30.8, "eccentricity_mm": 1.2 },
            "teeth": { "count": 18, "radius_mm": 2.5, "width_mm": 10.0 },
            "ring": { "teeth": 19 }
        },
        "load": load,
        "friction": { "wave_generator": bearing, "ring": contact, "carrier": contact }
    })
}

#[tokio::test]
async fn bearing_above_half_rating_is_a_warning() {
    const CODE: &str = "bearing_load_above_half_rating";
    let single = |torque_nm: f64| json!({ "input_torque_nm": torque_nm, "input_speed_rpm": 1500.0 });
    let bearing = |found: &Value| found["losses"]["bearing"].clone();
    let load_n =
        bearing(&Service::new().post("/v1/sweep", &on_a_bearing(9000.0, &single(2.0))).await.found())["mean_load_n"]
            .as_f64()
            .unwrap();
    let overloaded = finding(&on_a_bearing(1.999_999 * load_n, &single(2.0)), CODE).await;
    assert_numbers(&overloaded, load_n, 0.999_999_5 * load_n, "N");
    assert_eq!(overloaded["severity"], "warning");
    assert!(!codes_of(&findings(&on_a_bearing(2.000_001 * load_n, &single(2.0))).await).contains(&CODE.to_owned()));
    // The duty's mean load is below half the rating, but one point is above.
    let point = |torque_nm: f64, share: f64| json!({ "input_torque_nm": torque_nm, "input_speed_rpm": 1500.0, "share_of_time": share });
    let duty = on_a_bearing(1.9 * load_n, &json!({ "duty": [point(0.2, 0.9), point(2.0, 0.1)] }));
    let mean_n = bearing(&Service::new().post("/v1/sweep", &duty).await.found())["mean_load_n"].as_f64().unwrap();
    assert!(mean_n < 0.5 * load_n, "{mean_n} {load_n}");
    assert_numbers(&finding(&duty, CODE).await, load_n, 0.95 * load_n, "N");
}

/// Returns case 5.1 with these allowable stresses.
fn limited(allowable: Value) -> Value {
    with(&shortest(), "/load/allowable_stress_mpa", allowable)
}

#[tokio::test]
async fn stress_above_allowable_warns_for_each_contact() {
    let peaks = Service::new().post("/v1/sweep", &shortest()).await.found()["peaks"].clone();
    let peak = |contact: &str| peaks[contact]["stress_mpa"]["value"].as_f64().unwrap();
    let exceeded = async |allowable: Value| -> Vec<Value> {
        let all = findings(&limited(allowable)).await;
        all.into_iter().filter(|finding| finding["code"] == "stress_above_allowable").collect()
    };
    let [finding] = &exceeded(json!({ "wave_generator": 1e4, "ring": 500.0, "carrier": 1e4 })).await[..] else {
        panic!("one contact exceeds its own")
    };
    assert_numbers(finding, peak("ring"), 500.0, "MPa");
    assert_eq!(finding["severity"], "warning");
    assert!(finding["pointers"].as_array().unwrap().contains(&json!("/materials/ring")));
    assert_eq!(exceeded(json!(1.0)).await.len(), 3);
    // The finding of the fatigue limit covers this one.
    let codes = codes_of(&findings(&with(&overloaded(), "/load/allowable_stress_mpa", json!(1500.0))).await);
    assert!(
        !codes.contains(&"stress_above_allowable".to_owned())
            && codes.contains(&"stress_above_fatigue_limit".to_owned())
    );
    // A margin of 1e-12 covers rounding: with an allowable stress the sweep goes state by state.
    let hair = 1.0 + 1e-12;
    let just = json!({ "wave_generator": hair * peak("wave_generator"), "ring": hair * peak("ring"), "carrier": hair * peak("carrier") });
    assert!(exceeded(just).await.is_empty());
}

#[tokio::test]
async fn steep_flank_is_information_under_projection_only() {
    let document = with(&undercut(), "/model", of_the_paper());
    let geometry = Service::new().post("/v1/geometry", &document).await.found();
    let found = finding(&document, "projection_on_steep_flank").await;
    assert_numbers(&found, geometry["ring"]["pressure_angle_max_deg"].as_f64().unwrap(), 30.0, "deg");
    assert_eq!((&found["severity"], &found["pointers"]), (&json!("info"), &json!(["/model/compatibility"])));
    for other in [undercut(), spelled_out()] {
        assert!(!codes_of(&findings(&other).await).contains(&"projection_on_steep_flank".to_owned()));
    }
}

#[tokio::test]
async fn gap_is_a_warning_under_projection_only() {
    let gap = |document: &Value| {
        with(document, "/parts", json!({ "ring": { "clearance_um": 4.0 }, "carrier": { "clearance_um": 2.5 } }))
    };
    let found = finding(&gap(&spelled_out()), "projection_with_gap").await;
    assert_numbers(&found, 4.0, 0.0, "µm");
    assert_eq!(found["severity"], "warning");
    for other in [gap(&with(&shortest(), "/model", json!({}))), with(&gap(&spelled_out()), "/parts", json!({}))] {
        assert!(!codes_of(&findings(&other).await).contains(&"projection_with_gap".to_owned()));
    }
}

/// Returns case 5.1 under the default model with these parts.
fn held(parts: Value) -> Value {
    with(&shortest(), "/parts", parts)
}

/// Returns one compliance estimate of a sweep's answer.
async fn estimate(document: &Value, backing: &str) -> Value {
    let found = Service::new().post("/v1/sweep", document).await.found();
    let estimates = found["series_compliance_estimates"].as_array().unwrap();
    estimates.iter().find(|estimate| estimate["backing"] == backing).unwrap().clone()
}

#[tokio::test]
async fn slender_fingers_and_soft_rim_state_estimated_share() {
    for (parts, backing, code, contact) in [
        (json!({ "carrier": { "fingers": "held_at_one_end" } }), "finger_at_one_end", "slender_fingers", "carrier"),
        (json!({ "ring": { "rim": "free" } }), "free_rim", "soft_rim", "ring"),
    ] {
        let document = held(parts);
        let estimate = estimate(&document, backing).await;
        assert_eq!((&estimate["contact"], &estimate["is_as_held"]), (&json!(contact), &json!(true)));
        let found = finding(&document, code).await;
        assert_numbers(&found, estimate["share"].as_f64().unwrap(), 0.2, "");
        assert_eq!(found["severity"], "warning");
        // A compliance copied into the design is part of the forces.
        let series = json!({ contact: estimate["compliance_mm_per_n"] });
        let taken = with(&document, "/model", json!({ "series_compliance_mm_per_n": series }));
        assert!(!codes_of(&findings(&taken).await).contains(&code.to_owned()));
    }
    // Fingers held at both ends are not slender here; the default cage is.
    let both = json!({ "carrier": { "fingers": "held_at_both_ends" }, "ring": { "rim": "housed" } });
    assert!(findings(&held(both)).await.is_empty());
    assert_eq!(finding(&held(json!({})), "slender_fingers").await["severity"], "info");
}

#[tokio::test]
async fn slender_fingers_name_support_and_possible_advice() {
    let long = |fingers: &str| {
        let document = held(json!({ "carrier": { "fingers": fingers } }));
        with(&document, "/drive/teeth/width_mm", json!(40.0))
    };
    for (fingers, support) in [
        ("held_at_one_end", "held at one end,"),
        ("held_at_both_ends", "held at both ends,"),
        ("far_ends_joined", "joined at the other,"),
        ("web_in_the_middle", "a web in the middle,"),
    ] {
        let found = finding(&long(fingers), "slender_fingers").await;
        assert!(found["detail"].as_str().unwrap().contains(support), "{found}");
        let holds = found["advice"].as_str().unwrap().contains("hold the fingers at both ends");
        assert_eq!(holds, fingers != "held_at_both_ends", "{found}");
    }
}

#[tokio::test]
async fn estimated_series_compliance_is_that_of_held_parts() {
    let parts = json!({ "carrier": { "fingers": "held_at_one_end" }, "ring": { "rim": "free" }, "wave_generator": { "bore_radius_mm": 20.0 } });
    let document = held(parts);
    let series = |value: Value| with(&document, "/model", json!({ "series_compliance_mm_per_n": value }));
    let swept = async |document: &Value| Service::new().post("/v1/sweep", document).await.found();
    let estimates = swept(&document).await["series_compliance_estimates"].as_array().unwrap().clone();
    let as_held = estimates.iter().filter(|estimate| estimate["is_as_held"] == true);
    let by_hand: serde_json::Map<_, _> = as_held
        .map(|estimate| (estimate["contact"].as_str().unwrap().to_owned(), estimate["compliance_mm_per_n"].clone()))
        .collect();
    assert_eq!(by_hand.len(), 3);
    let mut estimated = swept(&series(json!("estimated"))).await;
    // Sent back as `model`, the word gives the same answer.
    let of_model = &mut estimated["model"]["series_compliance_mm_per_n"];
    assert_eq!(*of_model, "estimated");
    *of_model = by_hand.clone().into();
    assert_eq!(estimated, swept(&series(by_hand.into())).await);
    for (wrong, code) in [(json!("measured"), "unknown_choice"), (json!(1e-6), "wrong_type")] {
        let problem = Service::new().post("/v1/sweep", &series(wrong)).await.refused(422, "invalid_document");
        let error = &problem["errors"][0];
        assert_eq!((&error["pointer"], &error["code"]), (&json!("/model/series_compliance_mm_per_n"), &json!(code)));
    }
}

/// Balls of 3 mm around an eccentric circle, in grooves of this radius everywhere.
fn grooved(groove_radius_mm: f64) -> Value {
    let grooves = json!({ "wave_generator": groove_radius_mm, "ring": groove_radius_mm, "carrier": groove_radius_mm });
    let teeth = json!({ "shape": "ball", "count": 16, "radius_mm": 3.0, "groove_radius_mm": grooves });
    let cam = json!({ "kind": "eccentric", "radius_mm": 30.0, "eccentricity_mm": 1.0 });
    json!({ "drive": { "wave_generator": cam, "teeth": teeth, "ring": { "teeth": 17 } }, "load": { "input_torque_nm": 0.3 } })
}

#[tokio::test]
async fn contact_beyond_groove_warns_at_each_groove() {
    let document = grooved(3.001);
    let peaks = Service::new().post("/v1/sweep", &document).await.found()["peaks"].clone();
    let half_length_mm = |contact: &str| peaks[contact]["half_length_mm"].as_f64().unwrap();
    // Width at the edges of a groove of depth t: a chord of its circle.
    let (groove_mm, depth_mm) = (3.001_f64, 1.5_f64);
    let edge_mm = (groove_mm * groove_mm - (groove_mm - depth_mm) * (groove_mm - depth_mm)).sqrt();
    let mut found = findings(&document).await;
    found.retain(|finding| finding["code"] == "contact_beyond_groove");
    // The slots hold a ball as closely, but with a smaller force.
    assert!(half_length_mm("carrier") < edge_mm && found.len() == 2, "{found:?}");
    for (finding, contact) in found.iter().zip(["wave_generator", "ring"]) {
        assert_numbers(finding, half_length_mm(contact), edge_mm, "mm");
        let groove = format!("/drive/teeth/groove_radius_mm/{contact}");
        assert_eq!((&finding["severity"], &finding["pointers"]), (&json!("warning"), &json!([groove, "/load"])));
    }
    for kept in [grooved(3.01), with(&grooved(3.001), "/load/input_torque_nm", json!(0.1))] {
        assert!(!codes_of(&findings(&kept).await).contains(&"contact_beyond_groove".to_owned()));
    }
}

/// Drawings show only the path of balls' grooves, so a part made as drawn has no groove.
#[tokio::test]
async fn each_groove_not_drawn_is_information() {
    let document = grooved(3.1);
    for (part, contacts) in [
        ("ring", vec!["ring"]),
        ("wave-generator", vec!["wave_generator"]),
        ("carrier", vec!["carrier"]),
        ("tooth", vec![]),
        ("assembly", vec!["ring", "carrier", "wave_generator"]),
    ] {
        let mut found = findings_at(&format!("/v1/drawings/{part}"), &document).await;
        found.retain(|finding| finding["code"] == "groove_not_drawn");
        assert_eq!(found.len(), contacts.len(), "{part}: {found:?}");
        for (finding, contact) in found.iter().zip(contacts) {
            assert_numbers(finding, 3.1, 3.0, "mm");
            let groove = format!("/drive/teeth/groove_radius_mm/{contact}");
            assert_eq!((&finding["severity"], &finding["pointers"]), (&json!("info"), &json!([groove])));
        }
    }
    assert!(findings_of_parts(&without(&document, "/drive/teeth/groove_radius_mm")).await.is_empty());
}

#[tokio::test]
async fn every_finding_occurs_over_http() {
    let bore_without_effect = with(&shortest(), "/drive/ring/tip_radius_mm", json!(60.0));
    let linear = with(&spelled_out(), "/sweep", json!({ "wind_up": true }));
    let brass = [
        ("/model/stiffness", json!({ "law": "palmgren" })),
        ("/materials/ring", json!({ "youngs_modulus_gpa": 100.0 })),
    ]
    .into_iter()
    .fold(spelled_out(), |document, (pointer, value)| with(&document, pointer, value));
    let hollow = json!({ "kind": "harmonic_path", "lobes": 3, "mean_path_radius_mm": 22.0, "amplitude_mm": 3.0 });
    let teeth = json!({ "count": 33, "installed": 11, "radius_mm": 2.5, "width_mm": 10.0 });
    let hollow = json!({ "drive": { "wave_generator": hollow, "teeth": teeth, "ring": { "teeth": 30 } } });
    let teeth =
        json!({ "shape": "flat_sided", "count": 28, "radius_mm": 5.0, "width_mm": 15.0, "flat_length_mm": 9.8 });
    let cut = with(&spelled_out(), "/drive/teeth", teeth);
    let mut all = Vec::new();
    for document in [hollow, cut] {
        all.extend(findings_at("/v1/geometry", &document).await);
    }
    for document in [undercut(), bored(), bore_without_effect, sparse(), thick(), thin(1.9), steep(), overloaded()] {
        all.extend(findings(&document).await);
    }
    let wide = with(&shortest(), "/load/input_torque_nm", json!(2000.0));
    let gap = with(&spelled_out(), "/parts", json!({ "ring": { "clearance_um": 10.0 } }));
    let steep_projection = with(&undercut(), "/model", of_the_paper());
    let old = with(&shortest(), "/model", json!({ "clearance": { "ring_um": 3.0 } }));
    let twice = with(&old, "/modification", json!({ "ring_equidistant_um": 3.0 }));
    let rubbing = [rubbing(0.03), rubbing(0.2)];
    for document in [linear, brass, wide, loose(), limited(json!(500.0)), gap, steep_projection, twice, jammed()]
        .into_iter()
        .chain(rubbing)
    {
        all.extend(findings(&document).await);
    }
    all.extend(findings(&held(json!({ "ring": { "rim": "free" } }))).await);
    let weak =
        json!({ "carrier": { "strength": "c45-n", "fingers": "held_at_one_end", "finger_fillet_radius_mm": 0.1 } });
    all.extend(findings(&held(weak)).await);
    all.extend(findings(&grooved(3.001)).await);
    all.extend(findings(&on_a_bearing(3000.0, &json!({ "input_torque_nm": 2.0 }))).await);
    for document in [undercut(), thin_walls(), cleared(9000.0), grooved(3.1)] {
        all.extend(findings_of_parts(&document).await);
    }
    assert_eq!(codes_of(&all), words(&finding_codes()));
}

/// The fields differ between kinds of wave generators and shapes of teeth.
#[tokio::test]
async fn findings_point_to_fields_of_the_document() {
    let cylinders = |count: u32| json!({ "count": count, "installed": count, "radius_mm": 2.0, "width_mm": 12.0 });
    let eccentric = json!({ "kind": "eccentric", "radius_mm": 30.8, "eccentricity_mm": 2.4 });
    let harmonic = json!({ "kind": "harmonic", "lobes": 3, "mean_radius_mm": 48.0, "amplitude_mm": 2.2 });
    let path = json!({ "kind": "harmonic_path", "lobes": 3, "mean_path_radius_mm": 50.0, "amplitude_mm": 2.2 });
    let balls = json!({ "shape": "ball", "count": 40, "installed": 40, "radius_mm": 2.0 });
    let mut codes = Vec::new();
    for (wave_generator, teeth, ring_teeth) in [
        (&eccentric, cylinders(40), 39),
        (&eccentric, balls, 39),
        (&harmonic, cylinders(60), 57),
        (&path, cylinders(60), 57),
    ] {
        for tip_radius_mm in [Value::Null, json!(36.0), json!(53.0)] {
            let drive = json!({
                "wave_generator": wave_generator,
                "teeth": teeth,
                "ring": { "teeth": ring_teeth, "tip_radius_mm": tip_radius_mm }
            });
            let document = json!({ "drive": drive, "load": { "input_torque_nm": 40.0, "allowable_stress_mpa": 1e3 } });
            let reply = Service::new().post("/v1/sweep", &document).await;
            if reply.status != 200 {
                continue;
            }
            for finding in reply.found()["findings"].as_array().unwrap() {
                for pointer in finding["pointers"].as_array().unwrap() {
                    let pointer = pointer.as_str().unwrap();
                    let is_of_drive = pointer.starts_with("/drive") || pointer.starts_with("/load/");
                    assert!(!is_of_drive || document.pointer(pointer).is_some(), "{document} has no {pointer}");
                }
                let text = format!("{} {}", finding["detail"], finding["advice"]);
                assert!(!text.contains("ellipse") && !text.contains("major"), "{text}");
                codes.push(finding["code"].as_str().unwrap().to_owned());
            }
        }
    }
    for code in ["undercut", "tooth_beyond_carrier", "bore_shortens_flank", "stress_above_allowable"] {
        assert!(codes.iter().any(|found| found == code), "no {code} among {codes:?}");
    }
}
