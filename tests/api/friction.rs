//! What a turn costs: friction in the document, losses in a sweep's answer.

use std::f64::consts::PI;

use serde_json::{Value, json};

use crate::asking::{Question, Service};
use crate::designs::{eccentric, shortest, undercut, with, without};

const CONTACTS: [&str; 3] = ["wave_generator", "ring", "carrier"];

/// Friction with this wave generator, 0.05 at ring and carrier.
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

/// Case 5.1 by virtual work and the linear law over 40 intervals, as section 10.3 has it, at 1500 revolutions a minute.
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
async fn case_5_1_loses_half_of_its_power_on_a_plain_cam_and_an_eighth_on_a_bearing() {
    let sliding = swept(&case_5_1(plain())).await["losses"].clone();
    assert!((float(&sliding["efficiency"]["ring_fixed"]) - 0.499).abs() < 5e-4, "{}", sliding["efficiency"]);
    assert_eq!(sliding["self_locking"]["ring_fixed"], json!(true));
    assert!(float(&sliding["efficiency"]["ring_fixed_back_driven"]) < 0.0);
    let on_race = swept(&case_5_1(on_bearing("race"))).await["losses"].clone();
    assert!((float(&on_race["efficiency"]["ring_fixed"]) - 0.874).abs() < 5e-4, "{}", on_race["efficiency"]);
    assert_eq!(on_race["self_locking"]["ring_fixed"], json!(false));
    // A race that does not rub flatters.
    let rolling = swept(&case_5_1(on_bearing("rolling"))).await["losses"].clone();
    assert!(float(&rolling["efficiency"]["ring_fixed"]) > float(&on_race["efficiency"]["ring_fixed"]));
    assert_eq!(rolling["loss_ratio_by_place"]["wave_generator"], json!(0.0));
}

#[tokio::test]
async fn power_in_is_power_out_and_what_is_lost() {
    for friction in [plain(), on_bearing("race"), on_bearing("rolling")] {
        let found = swept(&case_5_1(friction)).await;
        let losses = &found["losses"];
        let speed_rad_per_s = 1500.0 * PI / 30.0;
        let in_w = float(&losses["required_input_torque_nm"]) * speed_rad_per_s;
        let out_w = float(&found["load"]["output_torque_nm"]) * speed_rad_per_s / 14.0;
        let lost_w = float(&losses["power_loss_w"]);
        assert_near(in_w, out_w + lost_w, 1e-12, "power in");
        assert_near(float(&losses["efficiency"]["ring_fixed"]), out_w / in_w, 1e-12, "efficiency");
        // From behind, the power at the output is that of the output's torque and speed.
        assert_near(float(&losses["efficiency"]["ring_fixed_back_driven"]) * out_w, out_w - lost_w, 1e-11, "behind");
        for (whole, places) in [("loss_ratio", "loss_ratio_by_place"), ("power_loss_w", "power_loss_by_place_w")] {
            let sum: f64 = losses[places].as_object().unwrap().values().map(float).sum();
            assert_near(sum, float(&losses[whole]), 1e-12, whole);
        }
        // The same flanks at the same slips, whichever member stands still: 26 ring teeth, 28 of the carrier, two lobes.
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
async fn what_is_lost_is_friction_times_the_slips_of_the_states() {
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
                // The bearing takes the rest.
                assert!(ratio > lost_nmm / 20e3 && ratio < 2.0 * lost_nmm / 20e3, "{ratio} {lost_nmm}");
            }
            let driven = float(&losses["by_input_angle"]["efficiency"]["ring_fixed"][at]);
            assert_near(driven, 1.0 / (1.0 + ratio * 26.0 / 28.0), 1e-14, "efficiency there");
        }
    }
}

#[tokio::test]
async fn pressure_times_velocity_has_its_largest_value_and_its_place() {
    let found = swept(&case_5_1(plain())).await;
    let (states, losses) = (&found["states"], &found["losses"]);
    // Wave generator against carrier, the ring fixed.
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
    // Twice as fast is twice as much.
    let faster = swept(&with(&case_5_1(plain()), "/load/input_speed_rpm", json!(3000.0))).await["losses"].clone();
    let at_ring = |losses: &Value| float(&losses["pressure_velocity_mpa_m_per_s"]["ring"]["value"]);
    assert_near(at_ring(&faster), 2.0 * at_ring(losses), 1e-14, "p·v");
    assert_near(float(&faster["power_loss_w"]), 2.0 * float(&losses["power_loss_w"]), 1e-14, "power");
    assert_eq!(faster["efficiency"], losses["efficiency"]);
}

#[tokio::test]
async fn nothing_is_computed_of_friction_that_is_left_out_and_no_power_without_a_speed() {
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
    // Normal forces and the torque at the input stay those without friction.
    for field in ["states", "peaks", "load", "checks"] {
        assert_eq!(frictionless[field].take(), with_friction[field], "{field}");
    }
}

#[tokio::test]
async fn every_impossible_value_of_friction_is_a_fault_at_its_field() {
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
    // With those of the load and the drive at once.
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
async fn a_fault_of_friction_s_form_is_told_at_its_field() {
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
async fn a_bearing_without_a_rubbing_race_asks_for_no_coefficient_and_heeds_none() {
    let mut bare = on_bearing("rolling");
    bare["wave_generator"].as_object_mut().unwrap().remove("coefficient");
    assert_eq!(swept(&case_5_1(bare)).await["losses"], swept(&case_5_1(on_bearing("rolling"))).await["losses"]);
}

#[tokio::test]
async fn surfaces_without_friction_lose_nothing_and_numbers_stay_numbers() {
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
async fn a_tooth_with_flats_does_not_roll_and_loses_more_than_a_loose_one() {
    let flat = json!({ "shape": "flat_sided", "count": 28, "radius_mm": 5.0, "width_mm": 15.0, "flat_length_mm": 4.0 });
    let loose = swept(&case_5_1(on_bearing("race"))).await["losses"].clone();
    let found = swept(&with(&case_5_1(on_bearing("race")), "/drive/teeth", flat)).await["losses"].clone();
    assert!(found["rolls"].as_array().unwrap().iter().all(|rolls| rolls == "nowhere"));
    assert!(float(&found["loss_ratio"]) > float(&loose["loss_ratio"]));
    assert!(float(&found["efficiency_error"]) > float(&loose["efficiency_error"]));
}

#[tokio::test]
async fn columns_of_losses_fit_the_states_at_any_sweep_and_of_unlike_zones() {
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
async fn an_eccentric_is_pushed_across_its_eccentricity_by_the_torque_over_it() {
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
    // Two lobes that are loaded alike balance each other.
    assert!(swept(&shortest()).await.get("radial_force_n").is_none());
}

async fn text_of(document: &Value) -> String {
    let question = Question::post("/v1/sweep", document.to_string()).with("accept", "text/plain");
    let answer = Service::new().ask(&question).await;
    assert_eq!(answer.status, 200, "{}", answer.text());
    answer.text().to_owned()
}

#[tokio::test]
async fn losses_and_the_radial_force_can_be_read_as_text() {
    let text = text_of(&case_5_1(plain())).await;
    for part in ["ring fixed            49.9", "(locks itself)", "input torque with losses", "power lost", "MPa m/s"] {
        assert!(text.contains(part), "{part} is not in {text}");
    }
    assert!(!text_of(&without(&case_5_1(plain()), "/friction")).await.contains("efficiency"));
    assert!(text_of(&eccentric()).await.contains("largest force on the wave generator"));
}
