//! Sensitivities and tolerance studies, against closed forms.

use std::collections::BTreeMap;

use serde_json::{Value, json};

use crate::asking::{answer, faulty, paper, with};

fn number(value: &Value) -> f64 {
    value.as_f64().unwrap_or_else(|| panic!("{value} is no number"))
}

fn named<'a>(list: &'a Value, member: &str, name: &str) -> &'a Value {
    let list = list.as_array().unwrap();
    list.iter().find(|item| item[member] == name).unwrap_or_else(|| panic!("no {name} in {list:?}"))
}

/// The root radius is `a + 2 r`.
#[test]
fn derivatives_match_the_closed_form() {
    let study = json!({
        "study": "sensitivity", "base": paper(), "quantities": ["ring_root_radius_mm"],
        "inputs": { "/drive/teeth/radius_mm": { "plus_minus": 0.005 }, "/drive/wave_generator/semi_major_mm": { "relative": 0.001 }, "/drive/teeth/width_mm": {} }
    });
    let found = answer(&study);
    let of = &found["quantities"][0];
    assert_eq!(number(&of["value"]), 68.0);
    let expected = [
        ("/drive/wave_generator/semi_major_mm", 1.0, 0.058),
        ("/drive/teeth/radius_mm", 2.0, 0.01),
        ("/drive/teeth/width_mm", 0.0, 0.0),
    ];
    for (input, (pointer, derivative, change)) in of["inputs"].as_array().unwrap().iter().zip(expected) {
        assert_eq!(input["pointer"], pointer, "what moves it most stands first");
        assert!(
            (number(&input["derivative"]) - derivative).abs() < 1e-9
                && (number(&input["change"]) - change).abs() < 1e-9
        );
        assert_eq!(input["is_smooth"], true);
    }
}

/// Under the linear law, the derivative of the stress is half of stress over torque.
#[test]
fn stress_grows_with_root_of_torque() {
    let study = json!({ "study": "sensitivity", "base": paper(), "quantities": ["peak_stress_ring_mpa"], "inputs": { "/load/input_torque_nm": { "relative": 1e-4 } } });
    let of = &answer(&study)["quantities"][0];
    let derivative = number(&of["inputs"][0]["derivative"]);
    assert!((derivative / (number(&of["value"]) / 40.0) - 1.0).abs() < 1e-8, "{of}");
}

/// Listing 10¹⁵ spaces would exhaust the memory.
#[test]
fn impossible_count_is_refused_before_items_deviate() {
    let normal = json!({ "distribution": "normal", "sigma": 3.0 });
    let of_slots = with(&paper(), "/drive/ring", json!({}));
    for (base, deviation, field) in [
        (with(&paper(), "/drive/ring/teeth", json!(1e15)), "ring_space_um", "/drive/ring/teeth"),
        (with(&paper(), "/drive/teeth/installed", json!(1e15)), "slot_wall_um", "/drive/teeth/installed"),
        (with(&of_slots, "/drive/teeth/count", json!(1e15)), "tooth_radius_um", "/drive/teeth/count"),
        (
            with(
                &paper(),
                "/drive/wave_generator",
                json!({ "kind": "harmonic_path", "lobes": 1e15, "mean_path_radius_mm": 57.0, "amplitude_mm": 1.0 }),
            ),
            "wave_generator_lobe_um",
            "/drive/wave_generator/lobes",
        ),
    ] {
        let study = json!({ "study": "tolerance", "base": base, "deviations": { deviation: normal }, "quantities": [], "samples": 10 });
        assert_eq!(faulty(&study), (format!("/base{field}"), "out_of_range".into()));
    }
}

#[test]
fn only_possible_counts_have_differences() {
    let base = with(&paper(), "/drive/ring", json!({}));
    let study = json!({ "study": "sensitivity", "base": base, "quantities": ["transmission_ratio"], "inputs": { "/drive/teeth/count": {} } });
    let input = answer(&study)["quantities"][0]["inputs"][0].clone();
    assert_eq!(
        (number(&input["at_minus"]), number(&input["at_plus"]), number(&input["plus_minus"])),
        (13.5, 14.5, 1.0)
    );
    // With a fixed ring no other count fits.
    let found = answer(&with(&study, "/base/drive/ring", json!({ "teeth": 26 })));
    assert_eq!(found["quantities"][0]["inputs"][0].get("at_plus"), None);
    assert_eq!(found["reasons"][0]["code"], "tooth_difference");
}

/// Shares of time add up to one, so none moves alone.
#[test]
fn omitted_inputs_include_duty_torques_and_speeds() {
    let point =
        |torque_nm: f64| json!({ "input_torque_nm": torque_nm, "input_speed_rpm": 1000.0, "share_of_time": 0.5 });
    let base = with(&paper(), "/load", json!({ "duty": [point(20.0), point(10.0)] }));
    let found = answer(&json!({ "study": "sensitivity", "base": base, "quantities": ["input_torque_nm"] }));
    let inputs = &found["quantities"][0]["inputs"];
    let of_load = |input: &&Value| input["pointer"].as_str().unwrap().starts_with("/load");
    let of_load: Vec<_> = inputs.as_array().unwrap().iter().filter(of_load).map(|input| &input["pointer"]).collect();
    let torque = named(inputs, "pointer", "/load/duty/0/input_torque_nm");
    assert!((number(&torque["derivative"]) - 1.0).abs() < 1e-9, "the hardest point's torque is the load's");
    assert_eq!(of_load.len(), 4, "{of_load:?}");
}

/// A step lost in rounding would give a zero derivative, where case 5.1 has 39 MPa/mm.
#[test]
fn step_is_large_enough_for_every_quantity() {
    let pointer = "/drive/wave_generator/semi_major_mm";
    let study = |input: Value| json!({ "study": "sensitivity", "base": paper(), "quantities": ["peak_stress_ring_mpa"], "inputs": { pointer: input } });
    let at = |name: &str| (format!("/inputs/~1drive~1wave_generator~1semi_major_mm/{name}"), "out_of_range".to_owned());
    assert_eq!(faulty(&study(json!({ "plus_minus": 1e-16 }))), at("plus_minus"));
    assert_eq!(faulty(&study(json!({ "plus_minus": 5e-8 }))), at("plus_minus"));
    assert_eq!(faulty(&study(json!({ "relative": 1e-10 }))), at("relative"));
    assert_eq!(faulty(&study(json!({ "relative": 5.0 }))), at("relative"));
    let derivative = |plus_minus: f64| {
        number(&answer(&study(json!({ "plus_minus": plus_minus })))["quantities"][0]["inputs"][0]["derivative"])
    };
    assert!((derivative(6e-8) / derivative(1e-4) - 1.0).abs() < 1e-5, "{} {}", derivative(6e-8), derivative(1e-4));
}

/// The next whole number above this semi-minor axis is the semi-major one, which would make the cam round.
#[test]
fn length_between_whole_numbers_is_not_rounded() {
    let base = with(&paper(), "/drive/wave_generator", json!({ "semi_major_mm": 57.0, "semi_minor_mm": 56.5 }));
    let pointer = "/drive/wave_generator/semi_minor_mm";
    let study = json!({
        "study": "tolerance", "base": base, "quantities": ["ring_tip_radius_mm"], "samples": 10,
        "inputs": { pointer: { "distribution": "uniform", "limit": 0.005 } }
    });
    let found = answer(&study);
    assert_eq!(found["impossible"], 0);
    assert_eq!(number(&found["quantities"][0]["nominal"]), 66.5);
    let over = json!({ pointer: { "min": 56.5, "max": 56.5, "steps": 1 } });
    let found = answer(&json!({ "study": "map", "base": base, "over": over, "quantities": ["ring_tip_radius_mm"] }));
    assert_eq!(found["possible"]["quantities"]["ring_tip_radius_mm"], json!([66.5]));
}

#[test]
fn omitted_inputs_are_all_numbers_but_counts() {
    let found = answer(&json!({ "study": "sensitivity", "base": paper(), "quantities": ["outer_diameter_mm"] }));
    let mut pointers: Vec<_> = found["quantities"][0]["inputs"]
        .as_array()
        .unwrap()
        .iter()
        .map(|input| input["pointer"].as_str().unwrap())
        .collect();
    pointers.sort_unstable();
    let expected = [
        "/drive/teeth/radius_mm",
        "/drive/teeth/width_mm",
        "/drive/wave_generator/semi_major_mm",
        "/drive/wave_generator/semi_minor_mm",
        "/load/input_torque_nm",
    ];
    let of_materials = ["carrier", "ring", "teeth", "wave_generator"]
        .map(|part| ["poissons_ratio", "youngs_modulus_gpa"].map(|name| format!("/materials/{part}/{name}")));
    let expected: Vec<_> = expected.map(str::to_owned).into_iter().chain(of_materials.into_iter().flatten()).collect();
    assert_eq!(pointers, expected);
}

fn tolerance(distribution: Value) -> Value {
    json!({ "study": "tolerance", "base": paper(), "samples": 20_000, "quantities": ["ring_root_radius_mm"], "inputs": { "/drive/teeth/radius_mm": distribution } })
}

/// The root radius contains twice the tooth's radius, so it has twice its deviation.
#[test]
fn quantiles_of_linear_quantity_follow_its_inputs() {
    let of = answer(&tolerance(json!({ "distribution": "normal", "sigma": 0.01 })))["quantities"][0].clone();
    assert_eq!(number(&of["nominal"]), 68.0);
    assert!((number(&of["mean"]) - 68.0).abs() < 5.0 * 0.02 / 20_000_f64.sqrt());
    assert!((number(&of["standard_deviation"]) / 0.02 - 1.0).abs() < 0.02);
    // Twice the width of its 95 % interval is eight standard errors.
    let is_near = |quantile: &Value, expected: f64| {
        let [low, high, value] = ["low", "high", "value"].map(|name| number(&quantile[name]));
        low <= value && value <= high && (value - expected).abs() < 2.0 * (high - low)
    };
    let standard = [-3.0902, -2.3263, -1.6449, -0.6745, 0.0, 0.6745, 1.6449, 2.3263, 3.0902];
    for (quantile, standard) in of["quantiles"].as_array().unwrap().iter().zip(standard) {
        assert!(is_near(quantile, 68.0 + 0.02 * standard), "{quantile}: {standard}");
    }
    // Uniform: each share is a position.
    let of = answer(&tolerance(json!({ "distribution": "uniform", "limit": 0.05 })))["quantities"][0].clone();
    for quantile in of["quantiles"].as_array().unwrap() {
        let expected = 68.0 + 0.1 * (2.0 * number(&quantile["share"]) - 1.0);
        assert!(is_near(quantile, expected), "{quantile}: {expected}");
    }
}

/// Of 200 studies 95 % are 190, within three. Bin(200, 0.95) is below 180 once in 500.
#[test]
fn quantile_intervals_have_their_coverage() {
    let study = with(&tolerance(json!({ "distribution": "uniform", "limit": 0.05 })), "/samples", json!(200));
    let (mut medians, mut ends) = (0, 0);
    for seed in 0..200 {
        let of = answer(&with(&study, "/seed", json!(seed)))["quantities"][0].clone();
        let holds = |share: f64| {
            let quantiles = of["quantiles"].as_array().unwrap();
            let quantile = quantiles.iter().find(|quantile| number(&quantile["share"]) == share).unwrap();
            let expected = 68.0 + 0.1 * (2.0 * share - 1.0);
            number(&quantile["low"]) <= expected && expected <= number(&quantile["high"])
        };
        medians += u32::from(holds(0.5));
        ends += u32::from(holds(0.95));
    }
    assert!(medians >= 180 && ends >= 180, "{medians} medians, {ends} ends of 200");
}

#[test]
fn nothing_deviates_beyond_its_limit() {
    let of =
        answer(&tolerance(json!({ "distribution": "normal", "sigma": 0.01, "limit": 0.012 })))["quantities"][0].clone();
    assert!(number(&of["least"]) >= 68.0 - 0.024 && number(&of["largest"]) <= 68.0 + 0.024);
    assert!(number(&of["largest"]) > 68.0 + 0.0235);
}

#[test]
fn yield_is_share_within_limits() {
    let study = with(
        &tolerance(json!({ "distribution": "uniform", "limit": 0.05 })),
        "/require",
        json!({ "ring_root_radius_mm": { "max": 68.05 } }),
    );
    let found = answer(&study);
    let (share, low, high) =
        (number(&found["yield"]["share"]), number(&found["yield"]["low"]), number(&found["yield"]["high"]));
    assert!(low < 0.75 && 0.75 < high && low < share && share < high, "{}", found["yield"]);
    assert_eq!(number(&found["limits"][0]["failed"]), (20_000.0 * (1.0 - share)).round());
}

/// Twice the tooth's radius and once the semi-major axis give four fifths of the variance.
#[test]
fn largest_contributor_comes_first_with_its_share() {
    let study = with(
        &tolerance(json!({ "distribution": "normal", "sigma": 0.01 })),
        "/inputs/~1drive~1wave_generator~1semi_major_mm",
        json!({ "distribution": "normal", "sigma": 0.01 }),
    );
    let of = answer(&study)["quantities"][0].clone();
    let first = &of["contributors"][0];
    assert_eq!(first["deviation"], "/drive/teeth/radius_mm");
    assert!((number(&first["share"]) - 0.8).abs() < 0.03, "{first}");
    let others = named(&of["contributors"], "deviation", "/drive/wave_generator/semi_major_mm");
    assert!((number(&others["share"]) + number(&first["share"]) - 1.0).abs() < 1e-12);
}

/// Uniform: every bin holds the same share, within five standard deviations.
#[test]
fn histogram_holds_every_drive_once() {
    let of = answer(&tolerance(json!({ "distribution": "uniform", "limit": 0.05 })))["quantities"][0].clone();
    let column = |name: &str| of["histogram"][name].as_array().unwrap().iter().map(number).collect::<Vec<_>>();
    let (edges, drives) = (column("edges"), column("drives"));
    assert_eq!((edges.len(), drives.len()), (56, 55), "twice the cube root of 20 000");
    assert_eq!((edges[0], edges[55]), (number(&of["least"]), number(&of["largest"])));
    assert_eq!(drives.iter().sum::<f64>(), 20_000.0);
    let expected = 20_000.0 / 55.0;
    assert!(drives.iter().all(|drives| (drives - expected).abs() < 5.0 * expected.sqrt()), "{drives:?}");
    let even = edges.windows(2).all(|pair| (pair[1] - pair[0] - (edges[55] - edges[0]) / 55.0).abs() < 1e-12);
    assert!(even, "{edges:?}");
    // A constant quantity has one bin.
    let still = with(
        &tolerance(json!({ "distribution": "uniform", "limit": 0.05 })),
        "/quantities",
        json!(["transmission_ratio"]),
    );
    let histogram = answer(&still)["quantities"][0]["histogram"].clone();
    assert_eq!(histogram, json!({ "edges": [14.0, 14.0], "drives": [20_000] }));
}

/// Reads the results of tests/reference/tolerances.py, which calculates load sharing and meshing spaces independently.
fn reference() -> Value {
    serde_json::from_str(include_str!("../reference/tolerances.json")).unwrap()
}

#[test]
fn drives_with_deviating_parts_match_the_reference() {
    let reference = reference();
    for drive in reference["drives"].as_array().unwrap() {
        let deviations = ["ring_space_um", "tooth_radius_um"].map(|name| (name, &drive[name]));
        let base = with(&reference["design"], "/deviations", json!(BTreeMap::from(deviations)));
        let values = drive["values"].as_object().unwrap();
        let study = json!({ "study": "sensitivity", "base": base, "quantities": values.keys().collect::<Vec<_>>(), "inputs": { "/load/input_torque_nm": {} } });
        let found = answer(&study);
        for (name, value) in values {
            let own = number(&named(&found["quantities"], "quantity", name)["value"]);
            assert!((own / number(value) - 1.0).abs() < 1e-11, "{name}: {own} and not {value}");
        }
    }
}

/// Both samples use their own random numbers and agree within four standard deviations. Where one tooth carries all,
/// many drives have equal values, and the share lies between those below and those up to the value.
#[test]
fn quantiles_match_an_independent_sampler() {
    const SAMPLES: u32 = 2000;
    let reference = reference();
    let values = reference["values"].as_object().unwrap();
    let found = answer(&json!({
        "study": "tolerance", "base": reference["design"], "deviations": reference["deviations"], "samples": SAMPLES,
        "quantities": values.keys().collect::<Vec<_>>()
    }));
    assert_eq!((&found["interference"], &found["impossible"]), (&json!(0), &json!(0)));
    for (name, column) in values {
        let column: Vec<_> = column.as_array().unwrap().iter().map(number).collect();
        let (own, others) = (f64::from(SAMPLES), column.len() as f64);
        let of = named(&found["quantities"], "quantity", name);
        for quantile in of["quantiles"].as_array().unwrap() {
            let (share, value) = (number(&quantile["share"]), number(&quantile["value"]));
            let below = |value: f64| column.partition_point(|&other| other <= value) as f64 / others;
            // The reference has no further digits.
            let (fewest, most) = (below(value * (1.0 - 1e-8)), below(value * (1.0 + 1e-8)));
            let room = 4.0 * (share * (1.0 - share) * (1.0 / own + 1.0 / others)).sqrt() + 1.0 / own;
            assert!(
                fewest - room < share && share < most + room,
                "{name}: {fewest} to {most} below the quantile of {share}"
            );
        }
    }
}

#[test]
fn impossible_drives_lower_yield_but_no_quantile() {
    // Teeth of 6.4 mm nearly touch.
    let study =
        with(&tolerance(json!({ "distribution": "uniform", "limit": 0.3 })), "/base/drive/teeth/radius_mm", json!(7.0));
    let study =
        with(&with(&study, "/samples", json!(2000)), "/require", json!({ "ring_root_radius_mm": { "max": 100.0 } }));
    let found = answer(&study);
    let impossible = number(&found["impossible"]);
    assert!(impossible > 0.0 && number(&found["samples"]) == 2000.0, "{found}");
    assert_eq!(number(&found["yield"]["share"]), (2000.0 - impossible) / 2000.0);
    assert_eq!(found["reasons"][0]["code"], "teeth_touch");
}

/// This holds for any requirements.
#[test]
fn tolerance_study_defaults_to_all_quantities() {
    let mut study = with(&tolerance(json!({ "distribution": "uniform", "limit": 0.01 })), "/samples", json!(10));
    study.as_object_mut().unwrap().remove("quantities");
    let names = |study: &Value| {
        let found = answer(study)["quantities"].as_array().unwrap().clone();
        found.iter().map(|of| of["quantity"].as_str().unwrap().to_owned()).collect::<Vec<_>>()
    };
    let all = names(&study);
    assert!(all.len() > 10);
    assert_eq!(names(&with(&study, "/require", json!({ "ring_root_radius_mm": { "max": 100.0 } }))), all);
}

/// One reason for each entry would exceed the expected size of a study.
#[test]
fn bad_entries_of_a_list_are_one_reason() {
    let of_spaces = json!({ "ring_space_angle_arcsec": { "distribution": "normal", "sigma": 50_000.0 } });
    let study = json!({
        "study": "tolerance", "base": with(&paper(), "/model", json!({ "compatibility": "virtual_work" })), "samples": 300,
        "deviations": of_spaces, "quantities": ["peak_stress_ring_mpa"]
    });
    let found = answer(&study);
    let reasons = found["reasons"].as_array().unwrap();
    let out_of_range: Vec<_> = reasons.iter().filter(|reason| reason["code"] == "out_of_range").collect();
    let [reason] = out_of_range[..] else { panic!("{reasons:?}") };
    assert_eq!(reason["pointer"], "/deviations/ring_space_angle_arcsec");
    assert!(number(&reason["variants"]) > 100.0, "{reason}");
}

#[test]
fn impossible_deviation_is_refused_at_its_field() {
    for (distribution, field, code) in [
        (json!({ "distribution": "normal" }), "/sigma", "missing_field"),
        (json!({ "distribution": "normal", "sigma": 0.0 }), "/sigma", "out_of_range"),
        (json!({ "distribution": "normal", "sigma": 1.0, "limit": 0.001 }), "/limit", "out_of_range"),
        (json!({ "distribution": "uniform", "sigma": 1.0, "limit": 1.0 }), "/sigma", "conflicting_fields"),
        (json!({ "distribution": "uniform" }), "/limit", "missing_field"),
        (json!({ "distribution": "gaussian" }), "/distribution", "unknown_choice"),
    ] {
        let expected = (format!("/inputs/~1drive~1teeth~1radius_mm{field}"), code.to_owned());
        assert_eq!(faulty(&tolerance(distribution.clone())), expected, "{distribution}");
    }
    let nothing = json!({ "study": "tolerance", "base": paper() });
    assert_eq!(faulty(&nothing), ("/deviations".into(), "missing_field".into()));
    let unknown = with(&nothing, "/deviations", json!({ "colour": { "distribution": "uniform", "limit": 1.0 } }));
    assert_eq!(faulty(&unknown), ("/deviations/colour".into(), "unknown_field".into()));
}

#[test]
fn deviations_of_impossible_base_are_refused_beforehand() {
    let spaces = json!({ "ring_space_um": { "distribution": "normal", "sigma": 3.0, "limit": 9.0 } });
    let drawn = json!({ "study": "tolerance", "base": paper(), "deviations": spaces, "quantities": ["peak_stress_ring_mpa"], "samples": 10 });
    let mut taking = drawn.clone();
    taking["base"].as_object_mut().unwrap().remove("model");
    let moved = json!({ "study": "sensitivity", "base": paper(), "quantities": ["slot_wall_mm"] });
    let count = json!({ "/drive/teeth/count": { "distribution": "uniform", "limit": 1.0 } });
    let runout = json!({ "ring_runout": { "distribution": "uniform", "limit": 8.0 } });
    let amount = json!({ "/deviations/ring_runout/amount_um": { "distribution": "uniform", "limit": 1.0 } });
    let shifted = json!({ "/modification/slot_wall_um": { "distribution": "uniform", "limit": 1.0 } });
    let modified = with(&with(&drawn, "/deviations", json!({})), "/inputs", shifted);
    let drawn_twice = with(&with(&taking, "/deviations", runout), "/inputs", amount);
    for (document, at, code) in [
        // The paper's model does not support deviations or modifications.
        (drawn.clone(), "/deviations", "conflicting_fields"),
        (modified, "/inputs/~1modification~1slot_wall_um", "conflicting_fields"),
        (with(&taking, "/base/drive/teeth/radius_mm", json!(9.0)), "/base/drive/teeth/radius_mm", "teeth_touch"),
        (with(&moved, "/base/drive/teeth/radius_mm", json!(9.0)), "/base/drive/teeth/radius_mm", "teeth_touch"),
        (
            with(&taking, "/base/deviations", json!({ "ring_space_um": [1.0] })),
            "/base/deviations/ring_space_um",
            "conflicting_fields",
        ),
        (with(&taking, "/inputs", count), "/inputs/~1drive~1teeth~1count", "wrong_type"),
        (drawn_twice, "/inputs/~1deviations~1ring_runout~1amount_um", "conflicting_fields"),
        (with(&taking, "/quantities", json!(["undercut", "undercut"])), "/quantities/1", "conflicting_fields"),
        (with(&moved, "/quantities", json!(["undercut", "undercut"])), "/quantities/1", "conflicting_fields"),
    ] {
        assert_eq!(faulty(&document), (at.to_owned(), code.to_owned()), "{document}");
    }
    crate::asking::study(&taking).unwrap_or_else(|refused| panic!("{refused}"));
}
