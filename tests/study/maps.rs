//! Maps.

use serde_json::{Value, json};
use toothwave_calculation::field::FieldCode;
use toothwave_calculation::forms::Format;
use toothwave_calculation::question::Question as _;
use toothwave_calculation::sweep::Sweep;
use toothwave_solver::Never;
use toothwave_study::Study;

use crate::asking::{CALCULATION, LIMITS, answer, faulty, gathered, paper, text, with};

fn map(over: Value, quantities: Value) -> Value {
    json!({ "study": "map", "base": paper(), "over": over, "quantities": quantities })
}

fn numbers(value: &Value) -> Vec<f64> {
    value.as_array().unwrap_or_else(|| panic!("{value}")).iter().map(|number| number.as_f64().unwrap()).collect()
}

#[test]
fn map_answers_each_variant_as_its_document() {
    let over = json!({
        "/drive/teeth/radius_mm": { "min": 3.0, "max": 7.0, "steps": 5 },
        "/load/input_torque_nm": { "min": 10.0, "max": 20.0, "steps": 2 }
    });
    let found = answer(&map(over, json!(["peak_stress_ring_mpa"])));
    assert_eq!(found["over"][1]["pointer"], "/load/input_torque_nm", "the last axis is the fastest");
    let stresses_mpa = numbers(&found["possible"]["quantities"]["peak_stress_ring_mpa"]);
    let mut stresses_mpa = stresses_mpa.into_iter();
    for radius_mm in [3.0, 4.0, 5.0, 6.0, 7.0] {
        for torque_nm in [10.0, 20.0] {
            let document = with(&paper(), "/drive/teeth/radius_mm", json!(radius_mm));
            let document = with(&document, "/load/input_torque_nm", json!(torque_nm)).to_string();
            let sweep = Sweep.ask(document.as_bytes(), &CALCULATION, &Never).unwrap();
            assert_eq!(stresses_mpa.next(), Some(sweep.peaks.ring.stress_mpa.value));
        }
    }
    assert_eq!(stresses_mpa.next(), None);
}

#[test]
fn impossible_variants_are_counted_by_reason() {
    let over = json!({ "/drive/teeth/radius_mm": { "min": 3.0, "max": 9.0, "steps": 7 } });
    let found = answer(&map(over, json!(["slot_wall_mm"])));
    assert_eq!(found["possible"]["variant"], json!([0, 1, 2, 3, 4]));
    assert_eq!(found["impossible"], json!({ "variant": [5, 6], "reason": [0, 0] }));
    let reason = &found["reasons"][0];
    assert_eq!((&reason["code"], &reason["pointer"]), (&json!("teeth_touch"), &json!("/drive/teeth/radius_mm")));
    assert_eq!((&reason["variants"], &reason["first_variant"]), (&json!(2), &json!(5)));
}

/// The root of the drawn ring is at 68 mm.
#[test]
fn ring_inside_its_root_has_no_outer_diameter() {
    let over = json!({ "/parts/ring/outer_radius_mm": { "min": 66.0, "max": 72.0, "steps": 4 } });
    let found = answer(&map(over.clone(), json!(["outer_diameter_mm", "coincidence_degree"])));
    assert_eq!(numbers(&found["possible"]["quantities"]["outer_diameter_mm"]), [140.0, 144.0]);
    let reason = &found["reasons"][0];
    assert_eq!(
        (&reason["code"], &reason["pointer"]),
        (&json!("ring_without_rim"), &json!("/parts/ring/outer_radius_mm"))
    );
    // As in answers without drawings, an unrequested quantity gives no reason.
    let found = answer(&map(over, json!(["coincidence_degree"])));
    assert_eq!(found["possible"]["variant"], json!([0, 1, 2, 3]));
}

#[test]
fn outer_radius_out_of_range_is_the_reason() {
    let over = json!({ "/parts/ring/outer_radius_mm": { "one_of": [72.0, 1e308] } });
    let found = answer(&map(over, json!(["outer_diameter_mm"])));
    assert_eq!(numbers(&found["possible"]["quantities"]["outer_diameter_mm"]), [144.0]);
    let reason = &found["reasons"][0];
    assert_eq!((&reason["code"], &reason["pointer"]), (&json!("out_of_range"), &json!("/parts/ring/outer_radius_mm")));
    let over = json!({ "/parts/ring/clearance_um": { "one_of": [10.0, 1e300] } });
    let found = answer(&map(over, json!(["outer_diameter_mm"])));
    assert_eq!(found["possible"]["variant"], json!([0]));
    assert_eq!(found["reasons"][0]["pointer"], json!("/parts/ring/clearance_um"));
}

#[test]
fn every_whole_number_of_range_is_a_step() {
    let base = with(&paper(), "/drive/ring", json!({}));
    let study = json!({ "study": "map", "base": base, "over": { "/drive/teeth/count": { "min": 19.5, "max": 24 } }, "quantities": ["transmission_ratio"] });
    let found = answer(&study);
    assert_eq!(numbers(&found["over"][0]["values"]), [20.0, 21.0, 22.0, 23.0, 24.0]);
    // By default the ring has one tooth fewer for each of the two lobes.
    assert_eq!(numbers(&found["possible"]["quantities"]["transmission_ratio"]), [10.0, 10.5, 11.0, 11.5, 12.0]);
}

#[test]
fn fields_of_other_kinds_are_left_out() {
    let base = with(&paper(), "/drive/wave_generator/lobes", json!(2));
    let base = with(&base, "/drive/wave_generator/mean_radius_mm", json!(57.0));
    let base = with(&base, "/drive/wave_generator/amplitude_mm", json!(1.0));
    let over = json!({ "/drive/wave_generator/kind": { "one_of": ["ellipse", "harmonic"] } });
    let found = answer(&json!({ "study": "map", "base": base, "over": over, "quantities": ["ring_root_radius_mm"] }));
    assert_eq!(found["over"][0]["choices"], json!(["ellipse", "harmonic"]));
    assert_eq!(numbers(&found["possible"]["quantities"]["ring_root_radius_mm"]), [68.0, 68.0]);
    // Without a choice, an additional field is a fault.
    let study = json!({ "study": "map", "base": base, "over": { "/drive/teeth/radius_mm": { "min": 4, "max": 5, "steps": 2 } } });
    assert_eq!(faulty(&study), ("/base/drive/wave_generator/amplitude_mm".into(), "unknown_field".into()));
}

#[test]
fn outer_diameters_match_drawn_ring() {
    let over = json!({ "/drive/teeth/radius_mm": { "min": 4.0, "max": 5.0, "steps": 2 } });
    let found = answer(&map(over.clone(), json!(["outer_diameter_mm"])));
    assert_eq!(numbers(&found["possible"]["quantities"]["outer_diameter_mm"]), [2.4 * 66.0, 2.4 * 68.0]);
    let base = with(&paper(), "/parts", json!({ "ring": { "outer_radius_mm": 75.0 } }));
    let found = answer(&json!({ "study": "map", "base": base, "over": over, "quantities": ["outer_diameter_mm"] }));
    assert_eq!(numbers(&found["possible"]["quantities"]["outer_diameter_mm"]), [150.0, 150.0]);
}

#[test]
fn lines_of_map_are_its_variants() {
    let over = json!({ "/drive/teeth/radius_mm": { "min": 3.0, "max": 9.0, "steps": 4 } });
    let csv = text(&gathered(&map(over, json!(["undercut"]))), Format::Csv);
    let expected = "variant,/drive/teeth/radius_mm,undercut,reason\n0,3.0,0.0,\n1,5.0,0.0,\n2,7.0,,teeth_touch\n3,9.0,,teeth_touch\n";
    assert_eq!(csv, expected.replace("2,7.0,,teeth_touch", "2,7.0,1.0,"));
}

#[test]
fn impossible_map_is_refused_at_its_field() {
    let of = |over: Value| map(json!({ "/drive/teeth/radius_mm": over }), json!([]));
    for (over, field, code) in [
        (json!({ "min": 5.0, "max": 3.0, "steps": 2 }), "/min", "out_of_range"),
        (json!({ "min": 3.0, "max": 5.0 }), "", "missing_field"),
        (json!({ "min": 3.0, "max": 5.0, "steps": 0 }), "/steps", "out_of_range"),
        (json!({ "min": 3.0, "steps": 2 }), "", "missing_field"),
        (json!({ "min": 3.0, "max": 5.0, "one_of": [3.0] }), "", "conflicting_fields"),
        (json!({ "one_of": [] }), "/one_of", "out_of_range"),
        // The values would be infinite or not a number.
        (json!({ "min": -1e308, "max": 1e308, "steps": 3 }), "", "out_of_range"),
        (json!({ "min": null, "max": 5.0 }), "/min", "wrong_type"),
    ] {
        let expected = (format!("/over/~1drive~1teeth~1radius_mm{field}"), code.to_owned());
        assert_eq!(faulty(&of(over.clone())), expected, "{over}");
    }
    let counted = map(json!({ "/drive/teeth/count": { "min": 20, "max": 25, "steps": 3 } }), json!([]));
    assert_eq!(faulty(&counted), ("/over/~1drive~1teeth~1count/steps".into(), "wrong_type".into()));
    let unknown = map(json!({ "/drive/teeth/colour": { "min": 20, "max": 25, "steps": 3 } }), json!([]));
    assert_eq!(faulty(&unknown), ("/over/~1drive~1teeth~1colour".into(), "unknown_field".into()));
    assert_eq!(faulty(&map(json!({}), json!([]))), ("/over".into(), "missing_field".into()));
    let unloaded = json!({ "study": "map", "base": { "drive": paper()["drive"] }, "over": { "/drive/teeth/radius_mm": { "min": 3.0, "max": 5.0, "steps": 2 } }, "quantities": ["peak_force_n"] });
    assert_eq!(faulty(&unloaded), ("/base/load".into(), "missing_field".into()));
    let capacity = map(
        json!({ "/drive/teeth/radius_mm": { "min": 3.0, "max": 5.0, "steps": 2 } }),
        json!(["torque_capacity_output_nm"]),
    );
    assert_eq!(faulty(&capacity), ("/base/load/allowable_stress_mpa".into(), "missing_field".into()));
}

/// A typo must not be taken for a field of another kind and replaced by a default.
#[test]
fn unknown_field_of_base_is_refused() {
    let radii = || json!({ "/drive/teeth/radius_mm": { "one_of": [4.0, 5.0] } });
    let compatibilities = json!({ "/model/compatibility": { "one_of": ["virtual_work", "projection"] } });
    let shapes = json!({ "/drive/teeth/shape": { "one_of": ["cylinder", "ball"] } });
    for (over, place, value) in [
        (radii(), "/drive/teeth/instaled", json!(14)),
        (compatibilities, "/model/stiffnes", json!({ "law": "linear" })),
        (shapes.clone(), "/drive/teeth/groove_radius", json!({ "ring": 5.0 })),
        // This field belongs to a shape outside the choices.
        (shapes.clone(), "/drive/teeth/flat_length_mm", json!(3.0)),
    ] {
        let study = map(over, json!(["coincidence_degree"]));
        let base = with(&paper(), "/model", json!({}));
        let study = with(&study, "/base", with(&base, place, value));
        assert_eq!(faulty(&study), (format!("/base{place}"), "unknown_field".into()), "{place}");
    }
    // A field of one choice is left out of the others.
    let base = with(&paper(), "/drive/teeth/groove_radius_mm", json!({ "ring": 6.0 }));
    answer(&with(&map(shapes, json!(["coincidence_degree"])), "/base", base));
}

#[test]
fn wrong_parent_value_of_base_is_refused() {
    let radii = || json!({ "/drive/teeth/radius_mm": { "min": 4.0, "max": 5.0, "steps": 2 } });
    let varied = |pointer: &str, min: f64| json!({ pointer: { "min": min, "max": 2.0 * min, "steps": 2 } });
    for (over, place, value) in [
        (radii(), "/drive/ring", json!(30)),
        (radii(), "/drive/ring", json!("30")),
        (radii(), "/drive/ring", json!(null)),
        (radii(), "/drive/ring", json!([{ "teeth": 26, "tip_radius_mm": 67 }])),
        (varied("/model/clearance/ring_um", 1.0), "/model", json!([{ "compatibility": "projection" }])),
        (varied("/model/clearance/ring_um", 1.0), "/model", json!("projection")),
        (varied("/model/clearance/ring_um", 1.0), "/model/clearance", json!(100)),
        (varied("/load/input_torque_nm", 10.0), "/load", json!(5)),
    ] {
        let base = with(&with(&paper(), "/model", json!({})), place, value.clone());
        let study = with(&map(over, json!(["coincidence_degree"])), "/base", base);
        assert_eq!(faulty(&study), (format!("/base{place}"), "wrong_type".into()), "{place} {value}");
    }
}

/// Copies of all its prefixes would take much memory.
#[test]
fn too_deep_pointer_is_refused_beforehand() {
    let deep = "/".repeat(1 << 20);
    let over = json!({ deep: { "min": 0, "max": 1, "steps": 2 } });
    let (at, code) = faulty(&map(over, json!([])));
    assert!(at.starts_with("/over/~1~1") && code == "unknown_field", "{code}");
}

/// `min + i/(n-1)·(max-min)` gives values such as 7.999999999999999.
#[test]
fn every_grid_of_whole_numbers_has_whole_numbers() {
    for (min, by, count) in [(2, 1, 48), (20, 5, 30), (10, 10, 16), (20, 2, 39)] {
        let max = min + by * (count - 1);
        let over = json!({ "/drive/teeth/count": { "min": min, "max": max, "steps": count } });
        let counts = answer(&map(over, json!(["undercut"])))["over"][0]["values"].clone();
        let expected: Vec<_> = (0..count).map(|index| f64::from(min + by * index)).collect();
        assert_eq!(numbers(&counts), expected);
    }
}

#[test]
fn duplicate_name_is_refused_everywhere() {
    let range = r#"{ "min": 3, "max": 5, "steps": 2 }"#;
    let base = paper();
    let twice = |list: &str, name: &str, one: &str, rest: &str| {
        let text = format!(r#"{{ "base": {base}, "{list}": {{ "{name}": {one}, "{name}": {one} }}, {rest} }}"#);
        let refused = Study::read(text.as_bytes(), &LIMITS).unwrap_err();
        (refused.errors[0].pointer.clone(), refused.errors[0].code)
    };
    let radius = "/drive/teeth/radius_mm";
    let expected = |list: &str| (format!("/{list}/~1drive~1teeth~1radius_mm"), FieldCode::DuplicateField);
    assert_eq!(twice("over", radius, range, r#""study": "map""#), expected("over"));
    assert_eq!(twice("free", radius, range, r#""study": "search", "objectives": []"#), expected("free"));
    let limit = twice("require", "slot_wall_mm", r#"{ "min": 1 }"#, r#""study": "tolerance", "inputs": {}"#);
    assert_eq!(limit, ("/require/slot_wall_mm".into(), FieldCode::DuplicateField));
}

#[test]
fn contradictory_base_is_refused_before_any_variant() {
    let point = |share: f64| json!({ "input_torque_nm": 20.0, "input_speed_rpm": 500.0, "share_of_time": share });
    let radii = || json!({ "/drive/teeth/radius_mm": { "min": 4.0, "max": 5.0, "steps": 2 } });
    let torques = || json!({ "/load/input_torque_nm": { "min": 4.0, "max": 5.0, "steps": 2 } });
    let ellipse_of_three = with(&with(&paper(), "/drive/teeth/count", json!(3)), "/drive/ring", json!({}));
    for (base, over, place, code) in [
        (with(&paper(), "/load", json!({ "duty": [point(0.5), point(0.4)] })), radii(), "/load/duty", "out_of_range"),
        (
            with(&paper(), "/deviations", json!({ "slot_wall_um": [1.0] })),
            json!({ "/load/input_torque_nm": { "min": 4.0, "max": 5.0, "steps": 2 } }),
            "/deviations/slot_wall_um",
            "wrong_length",
        ),
        (ellipse_of_three, torques(), "/drive/ring/teeth", "out_of_range"),
    ] {
        let study = with(&map(over, json!(["peak_force_n"])), "/base", base);
        assert_eq!(faulty(&study), (format!("/base{place}"), code.to_owned()));
    }
}

/// RFC 6901 allows neither `00` nor `+0`. Beside `0` they would set one value twice.
#[test]
fn list_entry_has_one_name() {
    let point = json!({ "input_torque_nm": 20.0, "input_speed_rpm": 500.0, "share_of_time": 1.0 });
    let base = with(&paper(), "/load", json!({ "duty": [point] }));
    let study = |name: &str| {
        let pointer = format!("/load/duty/{name}/input_torque_nm");
        let over = json!({ pointer: { "min": 5.0, "max": 6.0, "steps": 2 } });
        with(&map(over, json!(["input_torque_nm"])), "/base", base.clone())
    };
    assert_eq!(numbers(&answer(&study("0"))["possible"]["quantities"]["input_torque_nm"]), [5.0, 6.0]);
    for name in ["00", "+0", "1"] {
        let at = format!("/over/~1load~1duty~1{name}~1input_torque_nm");
        assert_eq!(faulty(&study(name)), (at, "unknown_field".into()));
    }
}

#[test]
fn pointer_past_a_value_is_at_fault() {
    let of = |pointer: &str| faulty(&map(json!({ pointer: { "min": 3.0, "max": 5.0, "steps": 2 } }), json!([])));
    for pointer in [
        "/drive/teeth/radius_mm/",
        "/drive/teeth/count/x",
        "/deviations/tooth_radius_um/99",
        "/model/stiffness/depth_mm/ring",
    ] {
        let at = format!("/over/{}", pointer.replace('/', "~1"));
        assert_eq!(of(pointer), (at, "unknown_field".into()));
    }
    // An omitted object of the base may get fields.
    let base = with(&paper(), "/load/allowable_stress_mpa", json!(1500.0));
    let alone = json!({ "one_of": [1500.0] });
    let over = json!({
        "/load/allowable_stress_mpa/wave_generator": alone, "/load/allowable_stress_mpa/carrier": alone,
        "/load/allowable_stress_mpa/ring": { "min": 1000.0, "max": 1500.0, "steps": 2 }
    });
    let study = with(&map(over, json!(["torque_capacity_output_nm"])), "/base", base);
    let capacities_nm = answer(&study)["possible"]["quantities"]["torque_capacity_output_nm"].clone();
    let [at_1000, at_1500] = numbers(&capacities_nm)[..] else { panic!("{capacities_nm}") };
    assert!(at_1000 < at_1500);
}

/// Each point of a duty has its own speed.
#[test]
fn duty_losses_cover_all_points() {
    let point = |torque_nm: f64, speed_rpm: f64, share_of_time: f64| json!({ "input_torque_nm": torque_nm, "input_speed_rpm": speed_rpm, "share_of_time": share_of_time });
    let duty = json!({ "duty": [point(2.0, 3000.0, 0.75), point(20.0, 500.0, 0.25)] });
    let friction = json!({
        "wave_generator": { "kind": "plain", "coefficient": 0.03 },
        "ring": { "coefficient": 0.05 },
        "carrier": { "coefficient": 0.05 }
    });
    let gapped =
        json!({ "compatibility": "virtual_work", "stiffness": { "law": "linear" }, "clearance": { "ring_um": 10.0 } });
    let base = with(&with(&with(&paper(), "/load", duty), "/friction", friction), "/model", gapped);
    let over = json!({ "/drive/teeth/radius_mm": { "min": 5.0, "max": 5.5, "steps": 2 } });
    let names = ["loss_ratio", "power_loss_w", "pressure_velocity_ring_mpa_m_per_s", "peak_force_ring_n"];
    let found = answer(&json!({ "study": "map", "base": base, "over": over, "quantities": names }));
    let sweep = Sweep.ask(base.to_string().as_bytes(), &CALCULATION, &Never).unwrap();
    let losses = &sweep.losses.as_ref().unwrap().totals;
    let of_sweep = [
        losses.loss_ratio,
        losses.power_loss_w.unwrap(),
        losses.pressure_velocity_mpa_m_per_s.as_ref().unwrap().ring.value,
        sweep.peaks.ring.force_n.value,
    ];
    for (name, of_sweep) in names.into_iter().zip(of_sweep) {
        assert_eq!(numbers(&found["possible"]["quantities"][name])[0], of_sweep, "{name}");
    }
    // Without friction, the fault is the missing friction.
    let base = with(&paper(), "/load", base["load"].clone());
    let study = json!({ "study": "map", "base": base, "over": over, "quantities": ["power_loss_w"] });
    assert_eq!(faulty(&study), ("/base/friction".into(), "missing_field".into()));
}

/// The cases are a repeated column, a repeated line, and a map of impossible drives.
#[test]
fn map_without_possible_variant_is_refused_beforehand() {
    let radius = |over: Value| map(json!({ "/drive/teeth/radius_mm": over }), json!(["undercut"]));
    let steps = || radius(json!({ "min": 3.0, "max": 7.0, "steps": 5 }));
    let of_torque = |base: Value| {
        let over = json!({ "/load/input_torque_nm": { "min": 10.0, "max": 20.0, "steps": 2 } });
        json!({ "study": "map", "base": base, "over": over, "quantities": ["peak_force_n"] })
    };
    let over = "/over/~1drive~1teeth~1radius_mm";
    for (document, at, code) in [
        (
            with(&steps(), "/quantities", json!(["undercut", "period_deg", "undercut"])),
            "/quantities/2".to_owned(),
            "conflicting_fields",
        ),
        (radius(json!({ "one_of": [3.0, 3.0] })), format!("{over}/one_of/1"), "conflicting_fields"),
        (radius(json!({ "min": 4.0, "max": 4.0, "steps": 5 })), format!("{over}/steps"), "out_of_range"),
        (radius(json!({ "min": -2.0, "max": -1.0, "steps": 3 })), format!("{over}/max"), "out_of_range"),
        (
            with(&steps(), "/base/drive/wave_generator/semi_minor_mm", json!(60.0)),
            "/base/drive/wave_generator/semi_major_mm".to_owned(),
            "cam_not_elongated",
        ),
        (
            of_torque(with(&paper(), "/drive/teeth/installed", json!(5))),
            "/base/drive/teeth/installed".to_owned(),
            "installed_no_divisor",
        ),
        (
            of_torque(with(&paper(), "/drive/teeth/radius_mm", json!(9.0))),
            "/base/drive/teeth/radius_mm".to_owned(),
            "teeth_touch",
        ),
    ] {
        assert_eq!(faulty(&document), (at, code.to_owned()), "{document}");
    }
    // A single value is allowed, and teeth may touch at some radii of a map.
    assert_eq!(numbers(&answer(&radius(json!({ "min": 4.0, "max": 4.0, "steps": 1 })))["possible"]["variant"]), [0.0]);
    let one_of_two_ends = radius(json!({ "min": 4.0, "max": 5.0, "steps": 1 }));
    assert_eq!(faulty(&one_of_two_ends), ("/over/~1drive~1teeth~1radius_mm/steps".into(), "out_of_range".into()));
    let some = answer(&with(&steps(), "/base/drive/teeth/radius_mm", json!(9.0)));
    assert_eq!(numbers(&some["possible"]["variant"]).len(), 5);
}

#[test]
fn finger_compliance_matches_estimate_of_sweep() {
    let over = json!({ "/drive/teeth/radius_mm": { "one_of": [5.0] } });
    let johnson = json!({ "compatibility": "virtual_work", "stiffness": { "law": "johnson" } });
    let mut shares = Vec::new();
    for fingers in ["held_at_both_ends", "held_at_one_end"] {
        let base =
            with(&with(&paper(), "/model", johnson.clone()), "/parts", json!({ "carrier": { "fingers": fingers } }));
        let study = with(&map(over.clone(), json!(["carrier_finger_share"])), "/base", base.clone());
        let share = numbers(&answer(&study)["possible"]["quantities"]["carrier_finger_share"])[0];
        let sweep = Sweep.ask(base.to_string().as_bytes(), &CALCULATION, &Never).unwrap();
        let estimates = serde_json::to_value(&sweep.series_compliance_estimates).unwrap();
        let of_finger = |estimate: &&Value| estimate["contact"] == "carrier" && estimate["is_as_held"] == true;
        let estimate = estimates.as_array().unwrap().iter().find(of_finger).unwrap();
        assert_eq!(Some(share), estimate["share"].as_f64());
        shares.push(share);
    }
    assert!(shares[0] > 0.0 && shares[1] > 10.0 * shares[0], "{shares:?}");
}

#[test]
fn quantity_that_drive_lacks_is_null() {
    // The linear law has an error as large as a finger's share, and so no estimate.
    let over = json!({ "/load/input_torque_nm": { "one_of": [20.0] } });
    let linear = map(over.clone(), json!(["carrier_finger_share", "finger_stress_mpa", "peak_stress_mpa"]));
    let values = |study: &Value| {
        let quantities = answer(study)["possible"]["quantities"].clone();
        ["carrier_finger_share", "finger_stress_mpa", "peak_stress_mpa"].map(|name| quantities[name][0].is_number())
    };
    assert_eq!(values(&linear), [false, true, true]);
    let balls = json!({ "shape": "ball", "count": 28, "radius_mm": 5.0 });
    let balls = with(&with(&linear, "/base/drive/teeth", balls), "/base/model", json!({}));
    assert_eq!(values(&balls), [false, false, true]);
    let csv = text(&gathered(&balls), Format::Csv);
    assert!(csv.lines().nth(1).unwrap().starts_with("0,20.0,,,"), "{csv}");
}

#[test]
fn choices_equal_a_range_of_same_values() {
    let torques: Vec<_> = (10..266).collect();
    let base = with(&paper(), "/deviations", json!({ "slot_wall_um": vec![0; 28], "ring_space_um": vec![0; 26] }));
    let over = json!({
        "/load/input_torque_nm": { "one_of": torques },
        "/drive/teeth/width_mm": { "min": 10.0, "max": 11.0, "steps": 2 }
    });
    let quantities = json!(["input_torque_nm", "peak_force_n"]);
    let of_choices = with(&map(over, quantities.clone()), "/base", base.clone());
    let over = json!({
        "/load/input_torque_nm": { "min": 10.0, "max": 265.0, "steps": 256 },
        "/drive/teeth/width_mm": { "min": 10.0, "max": 11.0, "steps": 2 }
    });
    let of_range = with(&map(over, quantities), "/base", base);
    assert_eq!(answer(&of_choices)["possible"], answer(&of_range)["possible"]);
}
