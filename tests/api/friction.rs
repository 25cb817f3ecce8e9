//! Friction in the document and losses in a sweep's answer.

use std::f64::consts::PI;

use serde_json::{Value, json};

use crate::asking::{Question, Service};
use crate::designs::{eccentric, shortest, undercut, with, without};

const CONTACTS: [&str; 3] = ["wave_generator", "ring", "carrier"];

/// Returns friction with this wave generator and 0.05 at ring and carrier.
pub(crate) fn on(wave_generator: &Value) -> Value {
    json!({ "wave_generator": wave_generator, "ring": { "coefficient": 0.05 }, "carrier": { "coefficient": 0.05 } })
}

fn plain() -> Value {
    on(&json!({ "kind": "plain", "coefficient": 0.03 }))
}

fn on_bearing(kind: &str) -> Value {
    let bearing = json!({ "kind": kind, "coefficient": 0.05, "bearing_coefficient": 0.002, "bearing_radius_mm": 52.0 });
    on(&bearing)
}

/// Returns case 5.1 by virtual work and the linear law with 40 intervals at 1500 rpm (docs/explanation/theory.md, section 10.3).
fn case_5_1(friction: Value) -> Value {
    let model = json!({ "compatibility": "virtual_work", "stiffness": { "law": "linear" } });
    let document = with(&shortest(), "/model", model);
    let document = with(&document, "/sweep", json!({ "samples": 40 }));
    with(&with(&document, "/load/input_speed_rpm", json!(1500.0)), "/friction", friction)
}

async fn swept(document: &Value) -> Value {
    let answer = Service::new().post("/v1/sweep", document).await;
    let found = answer.found();
    assert!(!answer.text().contains("null") && !answer.text().contains("NaN"));
    found
}

fn float(value: &Value) -> f64 {
    value.as_f64().unwrap_or_else(|| panic!("{value} is no number"))
}

fn floats(value: &Value) -> Vec<f64> {
    value.as_array().unwrap_or_else(|| panic!("{value} is no column")).iter().map(float).collect()
}

fn assert_near(found: f64, expected: f64, relative: f64, what: &str) {
    assert!((found - expected).abs() <= relative * expected.abs(), "{what}: {found} is not {expected}");
}

#[tokio::test]
async fn case_5_1_loses_known_shares_of_power() {
    let sliding = swept(&case_5_1(plain())).await["losses"].clone();
    assert!((float(&sliding["efficiency"]["ring_fixed"]) - 0.499).abs() < 5e-4, "{}", sliding["efficiency"]);
    assert_eq!(sliding["self_locking"]["ring_fixed"], json!(true));
    assert!(float(&sliding["efficiency"]["ring_fixed_back_driven"]) < 0.0);
    let on_race = swept(&case_5_1(on_bearing("race"))).await["losses"].clone();
    assert!((float(&on_race["efficiency"]["ring_fixed"]) - 0.874).abs() < 5e-4, "{}", on_race["efficiency"]);
    assert_eq!(on_race["self_locking"]["ring_fixed"], json!(false));
    // Without a rubbing race the estimate is too favourable.
    let rolling = swept(&case_5_1(on_bearing("rolling"))).await["losses"].clone();
    assert!(float(&rolling["efficiency"]["ring_fixed"]) > float(&on_race["efficiency"]["ring_fixed"]));
    assert_eq!(rolling["loss_ratio_by_place"]["wave_generator"], json!(0.0));
}

#[tokio::test]
async fn input_power_equals_output_power_plus_losses() {
    for friction in [plain(), on_bearing("race"), on_bearing("rolling")] {
        let found = swept(&case_5_1(friction)).await;
        let losses = &found["losses"];
        let speed_rad_per_s = 1500.0 * PI / 30.0;
        let in_w = float(&losses["required_input_torque_nm"]) * speed_rad_per_s;
        let out_w = float(&found["load"]["output_torque_nm"]) * speed_rad_per_s / 14.0;
        let lost_w = float(&losses["power_loss_w"]);
        assert_near(in_w, out_w + lost_w, 1e-12, "power in");
        assert_near(float(&losses["efficiency"]["ring_fixed"]), out_w / in_w, 1e-12, "efficiency");
        // If back-driven, the input power is that of output torque and speed.
        assert_near(float(&losses["efficiency"]["ring_fixed_back_driven"]) * out_w, out_w - lost_w, 1e-11, "behind");
        for (whole, places) in [("loss_ratio", "loss_ratio_by_place"), ("power_loss_w", "power_loss_by_place_w")] {
            let sum: f64 = losses[places].as_object().unwrap().values().map(float).sum();
            assert_near(sum, float(&losses[whole]), 1e-12, whole);
        }
        // Flanks and slips are the same for any fixed member: 26 ring teeth, 28 of the carrier, two lobes.
        let ratio = float(&losses["loss_ratio"]);
        for (fixed, share) in [("ring", 26.0 / 28.0), ("carrier", 1.0), ("wave_generator", 2.0 / 28.0)] {
            let driven = float(&losses["efficiency"][format!("{fixed}_fixed")]);
            assert_near(driven, 1.0 / (1.0 + share * ratio), 1e-14, fixed);
            let behind = float(&losses["efficiency"][format!("{fixed}_fixed_back_driven")]);
            assert!((behind - (1.0 - share * ratio)).abs() < 1e-14, "{fixed}");
        }
    }
}

#[tokio::test]
async fn losses_are_friction_times_slips_of_states() {
    for (kind, friction, of_cam) in [("plain", plain(), 0.03), ("race", on_bearing("race"), 0.05)] {
        let found = swept(&case_5_1(friction)).await;
        let (states, losses) = (&found["states"], &found["losses"]);
        let angles = floats(&states["input_angle_deg"]);
        let columns = CONTACTS.map(|contact| {
            (floats(&states[format!("force_{contact}_n")]), floats(&losses["slip_mm_per_rad"][contact]))
        });
        let by_angle = floats(&losses["by_input_angle"]["input_angle_deg"]);
        assert_eq!(by_angle.len(), 41);
        for (at, angle) in by_angle.iter().enumerate() {
            let mut lost_nmm = 0.0;
            for state in (0..angles.len()).filter(|&state| angles[state] == *angle) {
                let rolls = losses["rolls"][state].as_str().unwrap();
                for ((forces, slips), (contact, coefficient)) in
                    columns.iter().zip(CONTACTS.into_iter().zip([of_cam, 0.05, 0.05]))
                {
                    lost_nmm += 2.0 * coefficient * forces[state] * slips[state].abs();
                    assert!(contact != rolls || slips[state] == 0.0, "{contact} rolls at state {state}");
                }
            }
            let ratio = float(&losses["by_input_angle"]["loss_ratio"][at]);
            if kind == "plain" {
                assert_near(ratio, lost_nmm / 20e3, 1e-12, "loss ratio");
            } else {
                // The rest is lost in the bearing.
                assert!(ratio > lost_nmm / 20e3 && ratio < 2.0 * lost_nmm / 20e3, "{ratio} {lost_nmm}");
            }
            let driven = float(&losses["by_input_angle"]["efficiency"]["ring_fixed"][at]);
            assert_near(driven, 1.0 / (1.0 + ratio * 26.0 / 28.0), 1e-14, "efficiency there");
        }
    }
}

#[tokio::test]
async fn pressure_times_velocity_has_maximum_and_place() {
    let found = swept(&case_5_1(plain())).await;
    let (states, losses) = (&found["states"], &found["losses"]);
    // Speed of the wave generator against the carrier, with the ring fixed.
    let turning_rad_per_s = 1500.0 * PI / 30.0 * 26.0 / 28.0;
    for contact in CONTACTS {
        let stresses = floats(&states[format!("stress_{contact}_mpa")]);
        let slips = floats(&losses["slip_mm_per_rad"][contact]);
        let values: Vec<_> = stresses.iter().zip(&slips).map(|(stress, slip)| stress * slip.abs()).collect();
        let peak = &losses["pressure_velocity_mpa_m_per_s"][contact];
        let most = values.iter().copied().fold(0.0, f64::max);
        assert_near(float(&peak["value"]), 1e-3 * most * turning_rad_per_s, 1e-12, contact);
        let at = (0..values.len())
            .find(|&state| {
                states["input_angle_deg"][state] == peak["input_angle_deg"]
                    && states["position_deg"][state] == peak["position_deg"]
            })
            .unwrap();
        assert_near(values[at], most, 1e-12, contact);
    }
    // Double speed gives double values.
    let faster = swept(&with(&case_5_1(plain()), "/load/input_speed_rpm", json!(3000.0))).await["losses"].clone();
    let at_ring = |losses: &Value| float(&losses["pressure_velocity_mpa_m_per_s"]["ring"]["value"]);
    assert_near(at_ring(&faster), 2.0 * at_ring(losses), 1e-14, "p·v");
    assert_near(float(&faster["power_loss_w"]), 2.0 * float(&losses["power_loss_w"]), 1e-14, "power");
    assert_eq!(faster["efficiency"], losses["efficiency"]);
}

#[tokio::test]
async fn omitted_friction_computes_nothing() {
    let with_speed = swept(&without(&case_5_1(plain()), "/friction")).await;
    assert!(with_speed.get("losses").is_none());
    let mut without_either = case_5_1(plain());
    for pointer in ["/friction", "/load/input_speed_rpm"] {
        without_either = without(&without_either, pointer);
    }
    let mut frictionless = swept(&without_either).await;
    let with_friction = swept(&without(&case_5_1(plain()), "/load/input_speed_rpm")).await;
    for of_speed in ["power_loss_w", "power_loss_by_place_w", "pressure_velocity_mpa_m_per_s"] {
        assert!(with_friction["losses"].get(of_speed).is_none(), "{of_speed}");
    }
    // Normal forces and input torque stay those without friction.
    for field in ["states", "peaks", "load", "checks"] {
        assert_eq!(frictionless[field].take(), with_friction[field], "{field}");
    }
}

#[tokio::test]
async fn each_impossible_friction_is_reported_at_its_field() {
    let errors = async |document: Value| -> Vec<(String, f64)> {
        let answer = Service::new().post("/v1/sweep", &document).await;
        let problem = answer.refused(422, "impossible_design");
        let errors = problem["errors"].as_array().unwrap().iter();
        errors
            .map(|error| {
                assert_eq!(error["code"], "out_of_range");
                (error["pointer"].as_str().unwrap().to_owned(), float(&error["limit"]))
            })
            .collect()
    };
    let wrong = |kind: &str| {
        json!({
            "wave_generator": { "kind": kind, "coefficient": -0.1, "bearing_coefficient": 1.5, "bearing_radius_mm": 0 },
            "ring": { "coefficient": 2 }, "carrier": { "coefficient": -1e-9 }
        })
    };
    let expected = [
        ("/friction/wave_generator/coefficient", 0.0),
        ("/friction/ring/coefficient", 1.0),
        ("/friction/carrier/coefficient", 0.0),
        ("/friction/wave_generator/bearing_coefficient", 1.0),
        ("/friction/wave_generator/bearing_radius_mm", 1e-6),
    ]
    .map(|(pointer, limit)| (pointer.to_owned(), limit));
    assert_eq!(errors(case_5_1(wrong("race"))).await, expected);
    // All faults are reported together with those of load and drive.
    let document = with(&case_5_1(wrong("rolling")), "/load/input_speed_rpm", json!(0.0));
    let document = with(&document, "/drive/teeth/radius_mm", json!(-5.0));
    let found = errors(document).await;
    assert_eq!(found.len(), 7, "{found:?}");
    assert!(found.contains(&("/load/input_speed_rpm".into(), 1e-6)));
    for pointer in expected {
        assert!(found.contains(&pointer), "{pointer:?}");
    }
}

#[tokio::test]
async fn friction_of_wrong_form_is_reported_in_place() {
    for (friction, pointer, code) in [
        (json!({}), "", "missing_field"),
        (on(&json!({ "coefficient": 0.03 })), "/wave_generator", "missing_field"),
        (on(&json!({ "kind": "oily", "coefficient": 0.03 })), "/wave_generator/kind", "unknown_choice"),
        (on(&json!({ "kind": "plain" })), "/wave_generator/coefficient", "missing_field"),
        (on(&json!({ "kind": "race", "coefficient": 0.05 })), "/wave_generator/bearing_coefficient", "missing_field"),
        (
            on(&json!({ "kind": "plain", "coefficient": 0.05, "bearing_radius_mm": 2.0 })),
            "/wave_generator/bearing_radius_mm",
            "unknown_field",
        ),
    ] {
        let problem =
            Service::new().post("/v1/sweep", &case_5_1(friction.clone())).await.refused(422, "invalid_document");
        let error = &problem["errors"][0];
        assert_eq!(error["code"], code, "{friction}: {error}");
        assert!(error["pointer"].as_str().unwrap().starts_with(&format!("/friction{pointer}")), "{friction}: {error}");
    }
}

#[tokio::test]
async fn rolling_bearing_ignores_coefficient() {
    let mut bare = on_bearing("rolling");
    bare["wave_generator"].as_object_mut().unwrap().remove("coefficient");
    assert_eq!(swept(&case_5_1(bare)).await["losses"], swept(&case_5_1(on_bearing("rolling"))).await["losses"]);
}

#[tokio::test]
async fn zero_friction_loses_nothing() {
    let nothing = json!({
        "wave_generator": { "kind": "plain", "coefficient": 0.0 }, "ring": { "coefficient": 0 }, "carrier": { "coefficient": 0 }
    });
    let found = swept(&case_5_1(nothing.clone())).await["losses"].clone();
    assert!(found["efficiency"].as_object().unwrap().values().all(|value| float(value) == 1.0), "{found}");
    assert_eq!((float(&found["power_loss_w"]), float(&found["required_input_torque_nm"])), (0.0, 20.0));
    assert!(found["rolls"].as_array().unwrap().iter().all(|rolls| rolls == "nowhere"));
    let text = text_of(&case_5_1(nothing)).await;
    assert!(!text.contains("NaN") && !text.contains("inf"), "{text}");
}

#[tokio::test]
async fn flat_sided_teeth_slip_and_lose_more() {
    let flat = json!({ "shape": "flat_sided", "count": 28, "radius_mm": 5.0, "width_mm": 15.0, "flat_length_mm": 4.0 });
    let loose = swept(&case_5_1(on_bearing("race"))).await["losses"].clone();
    let found = swept(&with(&case_5_1(on_bearing("race")), "/drive/teeth", flat)).await["losses"].clone();
    assert!(found["rolls"].as_array().unwrap().iter().all(|rolls| rolls == "nowhere"));
    assert!(float(&found["loss_ratio"]) > float(&loose["loss_ratio"]));
    assert!(float(&found["efficiency_error"]) > float(&loose["efficiency_error"]));
}

#[tokio::test]
async fn loss_columns_have_length_of_states() {
    let unlike = with(&shortest(), "/drive/teeth/count", json!(27));
    let unlike = with(&unlike, "/drive/ring/teeth", json!(25));
    for document in [undercut(), eccentric(), unlike] {
        for sweep in [json!({ "samples": 7 }), json!({ "tolerance": 1e-6 })] {
            let document = with(&with(&document, "/friction", on_bearing("race")), "/sweep", sweep);
            let found = swept(&with(&document, "/sweep/wind_up", json!(true))).await;
            let states = found["states"]["tooth"].as_array().unwrap().len();
            let losses = &found["losses"];
            assert_eq!(losses["rolls"].as_array().unwrap().len(), states);
            for contact in CONTACTS {
                assert_eq!(floats(&losses["slip_mm_per_rad"][contact]).len(), states);
            }
            let by_angle = &losses["by_input_angle"];
            assert_eq!(by_angle["input_angle_deg"], found["wind_up"]["input_angle_deg"]);
            let angles = floats(&by_angle["input_angle_deg"]).len();
            assert_eq!(floats(&by_angle["loss_ratio"]).len(), angles);
            for column in by_angle["efficiency"].as_object().unwrap().values() {
                assert_eq!(floats(column).len(), angles);
            }
        }
    }
}

#[tokio::test]
async fn eccentric_radial_force_is_torque_over_eccentricity() {
    for sweep in [json!({ "samples": 9 }), json!({ "tolerance": 1e-4 })] {
        let found = swept(&with(&eccentric(), "/sweep", sweep)).await;
        let force = &found["radial_force_n"];
        let (values, directions) = (floats(&force["value"]), floats(&force["direction_deg"]));
        assert_eq!(floats(&force["input_angle_deg"]).len(), values.len());
        assert!(values.len() > 5);
        for (value, direction_deg) in values.iter().zip(&directions) {
            assert_near(value * direction_deg.to_radians().sin(), -5e3 / 1.2, 1e-9, "across");
        }
    }
    // Two equally loaded lobes balance each other.
    assert!(swept(&shortest()).await.get("radial_force_n").is_none());
}

async fn text_of(document: &Value) -> String {
    let question = Question::post("/v1/sweep", document.to_string()).with("accept", "text/plain");
    let answer = Service::new().ask(&question).await;
    assert_eq!(answer.status, 200, "{}", answer.text());
    answer.text().to_owned()
}

#[tokio::test]
async fn text_contains_losses_and_radial_force() {
    let text = text_of(&case_5_1(plain())).await;
    for part in ["ring fixed            49.9", "(locks itself)", "input torque with losses", "power lost", "MPa m/s"] {
        assert!(text.contains(part), "{part} is not in {text}");
    }
    assert!(!text_of(&without(&case_5_1(plain()), "/friction")).await.contains("efficiency"));
    assert!(text_of(&eccentric()).await.contains("largest force on the wave generator"));
    let text = text_of(&with_wear(on_bearing("race"))).await;
    assert!(text.contains("mm/h") && text.contains("all round"), "{text}");
    assert!(text_of(&on_its_bearing("ball")).await.contains("million revolutions"));
}

fn with_wear(friction: Value) -> Value {
    let rates = json!({ "wave_generator": 1e-6, "ring": 2e-6, "carrier": 3e-6 });
    let mut friction = friction;
    friction["wear_rate_mm3_per_nm"] = rates;
    case_5_1(friction)
}

#[tokio::test]
async fn wear_is_depth_per_hour_with_place() {
    let found = swept(&with_wear(plain())).await;
    let wear = found["losses"]["wear_mm_per_hour"].clone();
    // A slot has 120 passes an hour at one turn a minute; here 1500 turns, and 26/28 of that against the carrier.
    let (states, slips) = (&found["states"], &found["losses"]["slip_mm_per_rad"]["carrier"]);
    let at = (0..states["tooth"].as_array().unwrap().len())
        .find(|&state| {
            states["input_angle_deg"][state] == wear["carrier"]["input_angle_deg"]
                && states["position_deg"][state] == wear["carrier"]["position_deg"]
        })
        .unwrap();
    let force_n = float(&states["force_carrier_n"][at]);
    // Slip of the slot's wall per mm of the tooth's advance along it. The advance is d tan γ a radian: d times
    // the path's slope.
    let d_mm = float(&states["center_radius_mm"][at]);
    let k = 13.0;
    let tan_ring = float(&states["force_carrier_n"][at]) / float(&states["force_ring_n"][at]);
    // sin β Z_G/Z_K = F_S/F_K (section 4.1).
    let sin_ring = tan_ring * 26.0 / 28.0;
    let tan_cam = sin_ring / (1.0 - sin_ring * sin_ring).sqrt() / k;
    let slip = float(&slips[at]).abs() / (d_mm * tan_cam);
    let expected = 3e-6 * 1e-3 * force_n / 15.0 * slip * 120.0 * 1500.0 * 26.0 / 28.0;
    assert_near(float(&wear["carrier"]["value"]), expected, 1e-9, "slot");
    // Double rate gives double depth. Without a speed there is no depth an hour.
    let doubled = with(&with_wear(plain()), "/friction/wear_rate_mm3_per_nm/carrier", json!(6e-6));
    let doubled = swept(&doubled).await["losses"]["wear_mm_per_hour"].clone();
    assert_near(float(&doubled["carrier"]["value"]), 2.0 * expected, 1e-9, "slot");
    assert_eq!(doubled["wave_generator"], wear["wave_generator"]);
    let still = swept(&without(&with_wear(plain()), "/load/input_speed_rpm")).await;
    assert!(still["losses"].get("wear_mm_per_hour").is_none());
    let on_race = swept(&with_wear(on_bearing("race"))).await["losses"]["wear_mm_per_hour"].clone();
    assert_eq!(on_race["wave_generator"].as_object().unwrap().keys().collect::<Vec<_>>(), ["value"]);
    assert!(float(&on_race["wave_generator"]["value"]) > 0.0);
    assert!(on_race["carrier"]["position_deg"].is_number());
}

/// Returns an eccentric drive on its bearing.
fn on_its_bearing(element: &str) -> Value {
    let bearing = json!({
        "kind": "rolling", "bearing_coefficient": 0.0015, "bearing_radius_mm": 25.0,
        "bearing_load_rating_n": 9000.0, "bearing_element": element
    });
    with(&with(&eccentric(), "/friction", on(&bearing)), "/load/input_speed_rpm", json!(1500.0))
}

#[tokio::test]
async fn bearing_life_follows_iso_281() {
    for (element, exponent) in [("ball", 3.0), ("roller", 10.0 / 3.0)] {
        let found = swept(&on_its_bearing(element)).await;
        let bearing = &found["losses"]["bearing"];
        let load_n = float(&bearing["mean_load_n"]);
        let forces = floats(&found["radial_force_n"]["value"]);
        let (least, most) =
            forces.iter().fold((f64::MAX, 0.0_f64), |(least, most), &force| (least.min(force), most.max(force)));
        assert!((least..=most).contains(&load_n), "{least} {load_n} {most}");
        let millions = (9000.0 / load_n).powf(exponent);
        assert_near(float(&bearing["life_million_revolutions"]), millions, 1e-12, "life");
        // 28 teeth and 27 ring teeth. A race at rest against the carrier turns like the wave generator against it.
        let speed_rpm = 1500.0 * 27.0 / 28.0;
        assert_near(float(&bearing["speed_rpm"]), speed_rpm, 1e-12, "speed");
        assert_near(float(&bearing["life_h"]), 1e6 * millions / 60.0 / speed_rpm, 1e-12, "hours");
    }
    let still = swept(&without(&on_its_bearing("ball"), "/load/input_speed_rpm")).await["losses"]["bearing"].clone();
    assert_eq!(still.as_object().unwrap().len(), 2, "{still}");
    // Half the load gives eight times the life, because all forces are proportional.
    let linear = json!({ "compatibility": "virtual_work", "stiffness": { "law": "linear" } });
    let whole = with(&on_its_bearing("ball"), "/model", linear);
    let torque = float(&eccentric()["load"]["input_torque_nm"]);
    let half = with(&whole, "/load/input_torque_nm", json!(0.5 * torque));
    let half = swept(&half).await["losses"]["bearing"].clone();
    let whole = swept(&whole).await["losses"]["bearing"].clone();
    assert_near(float(&half["life_h"]), 8.0 * float(&whole["life_h"]), 1e-9, "half");
}

#[tokio::test]
async fn bearing_without_radial_load_has_no_life() {
    let mut friction = on_bearing("race");
    friction["wave_generator"]["bearing_load_rating_n"] = json!(9000.0);
    let problem = Service::new().post("/v1/sweep", &case_5_1(friction)).await.refused(422, "impossible_design");
    let error = &problem["errors"][0];
    assert_eq!(error["code"], "conflicting_fields");
    assert_eq!(error["pointer"], "/friction/wave_generator/bearing_load_rating_n");
}

/// Returns case 5.1 with a duty and wear.
fn on_duty(points: &[(f64, f64, f64)], friction: Value) -> Value {
    let points: Vec<_> = points
        .iter()
        .map(|(torque_nm, speed_rpm, share)| {
            json!({ "input_torque_nm": torque_nm, "input_speed_rpm": speed_rpm, "share_of_time": share })
        })
        .collect();
    with(&with_wear(friction), "/load", json!({ "duty": points }))
}

const DUTY: [(f64, f64, f64); 3] = [(10.0, 1500.0, 0.5), (40.0, 300.0, 0.3), (20.0, 3000.0, 0.2)];

fn alone(torque_nm: f64, speed_rpm: f64, friction: Value) -> Value {
    with(&with_wear(friction), "/load", json!({ "input_torque_nm": torque_nm, "input_speed_rpm": speed_rpm }))
}

/// Adds a clearance, so that forces are not proportional to the torque.
fn loose(document: &Value) -> Value {
    with(document, "/parts", json!({ "ring": { "clearance_um": 3.0 } }))
}

#[tokio::test]
async fn duty_reports_hardest_peaks_and_overall_means() {
    for friction in [plain(), on_bearing("race")] {
        let found = swept(&loose(&on_duty(&DUTY, friction.clone()))).await;
        let mut points = Vec::new();
        for (torque_nm, speed_rpm, _) in DUTY {
            points.push(swept(&loose(&alone(torque_nm, speed_rpm, friction.clone()))).await);
        }
        // The second point has the largest torque.
        for field in ["peaks", "states", "load", "checks", "loaded_teeth_per_zone"] {
            assert_eq!(found[field], points[1][field], "{field}");
        }
        let losses = &found["losses"];
        for field in ["slip_mm_per_rad", "rolls", "by_input_angle", "required_input_torque_nm"] {
            assert_eq!(losses[field], points[1]["losses"][field], "{field}");
        }
        let duty = &found["duty"];
        assert_eq!(duty["hardest_point"], 1);
        assert_near(float(&duty["mean_input_speed_rpm"]), 0.5 * 1500.0 + 0.3 * 300.0 + 0.2 * 3000.0, 1e-14, "speed");
        let (mut in_w, mut out_w, mut lost_w) = (0.0, 0.0, 0.0);
        for (((torque_nm, speed_rpm, share), point), listed) in
            DUTY.iter().zip(&points).zip(duty["points"].as_array().unwrap())
        {
            let efficiency = float(&point["losses"]["efficiency"]["ring_fixed"]);
            assert_eq!(float(&listed["efficiency_ring_fixed"]), efficiency);
            assert_near(float(&listed["power_loss_w"]), float(&point["losses"]["power_loss_w"]), 1e-14, "power");
            let ideal_w = share * torque_nm * speed_rpm * PI / 30.0;
            out_w += ideal_w;
            in_w += ideal_w / efficiency;
            lost_w += share * float(&point["losses"]["power_loss_w"]);
        }
        assert_near(float(&losses["efficiency"]["ring_fixed"]), out_w / in_w, 1e-12, "energy out over energy in");
        assert_near(float(&losses["power_loss_w"]), lost_w, 1e-12, "power");
        assert_near(in_w, out_w + lost_w, 1e-12, "energy");
        let places: f64 = losses["power_loss_by_place_w"].as_object().unwrap().values().map(float).sum();
        assert_near(places, lost_w, 1e-12, "places");
        for contact in CONTACTS {
            let of = |point: &Value| float(&point["losses"]["pressure_velocity_mpa_m_per_s"][contact]["value"]);
            let most = points.iter().map(of).fold(0.0, f64::max);
            assert_eq!(of(&found), most, "p·v is that of the worst");
            let wear = |point: &Value| float(&point["losses"]["wear_mm_per_hour"][contact]["value"]);
            let mean_of_peaks: f64 = DUTY.iter().zip(&points).map(|((_, _, share), point)| share * wear(point)).sum();
            assert!(wear(&found) <= mean_of_peaks * (1.0 + 1e-12), "{contact}");
            assert!(wear(&found) >= 0.3 * mean_of_peaks, "{contact}: {} {mean_of_peaks}", wear(&found));
        }
    }
}

#[tokio::test]
async fn duty_of_one_point_equals_that_load() {
    let (mut one, mut other) =
        (swept(&on_duty(&[(20.0, 1500.0, 1.0)], plain())).await, swept(&alone(20.0, 1500.0, plain())).await);
    assert_eq!(one.as_object_mut().unwrap().remove("duty").unwrap()["hardest_point"], 0);
    assert_eq!(one.take(), other.take());
}

#[tokio::test]
async fn duty_sums_bearing_damage_over_points() {
    let torque_nm = float(&eccentric()["load"]["input_torque_nm"]);
    let points = [(torque_nm, 1500.0, 0.75), (2.0 * torque_nm, 500.0, 0.25)];
    let duty: Vec<_> = points
        .iter()
        .map(|(torque_nm, speed_rpm, share)| {
            json!({ "output_torque_nm": 28.0 * torque_nm, "input_speed_rpm": speed_rpm, "share_of_time": share })
        })
        .collect();
    let found = swept(&with(&on_its_bearing("ball"), "/load", json!({ "duty": duty }))).await;
    assert_eq!(found["duty"]["hardest_point"], 1);
    let mut used = 0.0;
    for (torque_nm, speed_rpm, share) in points {
        let load = json!({ "input_torque_nm": torque_nm, "input_speed_rpm": speed_rpm });
        let alone = swept(&with(&on_its_bearing("ball"), "/load", load)).await;
        used += share / float(&alone["losses"]["bearing"]["life_h"]);
    }
    let bearing = &found["losses"]["bearing"];
    assert_near(float(&bearing["life_h"]) * used, 1.0, 1e-12, "life");
    let millions = float(&bearing["life_h"]) * 60e-6 * float(&bearing["speed_rpm"]);
    assert_near(float(&bearing["life_million_revolutions"]), millions, 1e-12, "revolutions");
}

#[tokio::test]
async fn duty_without_friction_has_only_peaks_and_points() {
    let found = swept(&without(&on_duty(&DUTY, plain()), "/friction")).await;
    assert!(found.get("losses").is_none());
    assert_eq!(found["load"]["input_torque_nm"], 40.0);
    assert_eq!(found["duty"]["points"][2]["output_torque_nm"], 280.0);
    assert!(found["duty"]["points"][2].get("power_loss_w").is_none());
}

#[tokio::test]
async fn duty_faults_are_reported_at_their_places() {
    let errors = async |document: Value, code: &str| -> Vec<(String, String)> {
        let problem = Service::new().post("/v1/sweep", &document).await.refused(422, code);
        let errors = problem["errors"].as_array().unwrap().iter();
        errors
            .map(|error| (error["pointer"].as_str().unwrap().into(), error["code"].as_str().unwrap().into()))
            .collect()
    };
    let expect = |faults: &[(&str, &str)]| -> Vec<(String, String)> {
        faults.iter().map(|&(pointer, code)| (pointer.into(), code.into())).collect()
    };
    let duty = on_duty(&DUTY, plain());
    let short = on_duty(&[(10.0, 1500.0, 0.5), (20.0, 100.0, 0.4)], plain());
    assert_eq!(errors(short, "impossible_design").await, expect(&[("/load/duty", "out_of_range")]));
    let wrong = on_duty(&[(-10.0, 1500.0, 0.5), (20.0, 0.0, 2.0)], plain());
    let places = ["/load/duty/0/input_torque_nm", "/load/duty/1/input_speed_rpm", "/load/duty/1/share_of_time"];
    assert_eq!(errors(wrong, "impossible_design").await, expect(&places.map(|place| (place, "out_of_range"))));
    let many = vec![(10.0, 1500.0, 1.0 / 101.0); 101];
    assert_eq!(errors(on_duty(&many, plain()), "impossible_design").await, expect(&[("/load/duty", "out_of_range")]));
    for (document, pointer, code) in [
        (with(&duty, "/load/duty", json!([])), "/load/duty", "out_of_range"),
        (with(&duty, "/load/duty", json!({})), "/load/duty", "wrong_type"),
        (with(&duty, "/load/input_torque_nm", json!(20.0)), "/load", "conflicting_fields"),
        (with(&duty, "/load/input_speed_rpm", json!(20.0)), "/load", "conflicting_fields"),
        (with(&duty, "/sweep", json!({ "tolerance": 1e-4 })), "/sweep/tolerance", "conflicting_fields"),
        (with(&duty, "/load/duty/1/output_torque_nm", json!(1.0)), "/load/duty/1", "conflicting_fields"),
        (without(&duty, "/load/duty/1/input_torque_nm"), "/load/duty/1", "missing_field"),
        (without(&duty, "/load/duty/1/share_of_time"), "/load/duty/1/share_of_time", "missing_field"),
        (with(&duty, "/load/duty/2/colour", json!(1)), "/load/duty/2/colour", "unknown_field"),
    ] {
        assert_eq!(errors(document, "invalid_document").await, expect(&[(pointer, code)]));
    }
}

#[tokio::test]
async fn all_duty_points_count_towards_state_limit() {
    let limits = crate::asking::Limits { max_states: 600, ..crate::asking::LIMITS };
    // 40 intervals with 7 teeth.
    let service = Service::within(limits);
    assert_eq!(service.post("/v1/sweep", &on_duty(&[(20.0, 1500.0, 1.0)], plain())).await.status, 200);
    let error = service.post("/v1/sweep", &on_duty(&DUTY, plain())).await.refused(422, "too_many_states");
    assert_eq!(error["errors"][0]["value"], 3.0 * 287.0);
}

#[tokio::test]
async fn allowable_stress_is_number_or_one_per_contact() {
    let faulty = async |allowable: Value| {
        let document = with(&shortest(), "/load/allowable_stress_mpa", allowable);
        let problem = Service::new().post("/v1/sweep", &document).await.problem();
        let error = &problem["errors"][0];
        (error["pointer"].as_str().unwrap().to_owned(), error["code"].as_str().unwrap().to_owned())
    };
    let at = |place: &str, code: &str| (format!("/load/allowable_stress_mpa{place}"), code.to_owned());
    assert_eq!(faulty(json!("much")).await, at("", "wrong_type"));
    assert_eq!(faulty(json!([1.0])).await, at("", "wrong_type"));
    assert_eq!(faulty(json!(0.0)).await, at("", "out_of_range"));
    assert_eq!(faulty(json!({ "ring": 1.0 })).await, at("/wave_generator", "missing_field"));
    let of = |ring: Value| json!({ "wave_generator": 900.0, "ring": ring, "carrier": 900.0 });
    assert_eq!(faulty(of(json!(true))).await, at("/ring", "wrong_type"));
    assert_eq!(faulty(of(json!(-1.0))).await, at("/ring", "out_of_range"));
}

#[tokio::test]
async fn slips_follow_states_in_csv() {
    let unlike = with(&with(&shortest(), "/drive/teeth/count", json!(27)), "/drive/ring/teeth", json!(25));
    for document in [shortest(), loose(&with(&unlike, "/model", json!({ "compatibility": "virtual_work" })))] {
        let csv = async |document: &Value| -> Vec<Vec<String>> {
            let question = Question::post("/v1/sweep", document.to_string()).with("accept", "text/csv");
            let answer = Service::new().ask(&question).await;
            assert_eq!(answer.status, 200, "{}", answer.text());
            answer.text().lines().map(|line| line.split(',').map(str::to_owned).collect()).collect()
        };
        let rubbing = with(&document, "/friction", plain());
        let losses = swept(&rubbing).await["losses"].clone();
        let (bare, with_slips) = (csv(&document).await, csv(&rubbing).await);
        let columns = bare[0].len();
        assert_eq!(
            with_slips[0][columns..],
            ["slip_wave_generator_mm_per_rad", "slip_ring_mm_per_rad", "slip_carrier_mm_per_rad", "rolls"]
        );
        for (state, (bare, row)) in bare[1..].iter().zip(&with_slips[1..]).enumerate() {
            assert_eq!(row[..columns], bare[..]);
            for (field, contact) in row[columns..].iter().zip(CONTACTS) {
                assert_eq!(field.parse::<f64>().unwrap(), float(&losses["slip_mm_per_rad"][contact][state]));
            }
            assert_eq!(row[columns + 3], losses["rolls"][state].as_str().unwrap());
        }
    }
}
