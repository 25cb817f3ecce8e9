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
fn derivatives_are_those_of_the_closed_form() {
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

/// Stresses of the linear law go as the root of the torque; its own derivative is half of stress over torque.
#[test]
fn the_stress_goes_as_the_root_of_the_torque() {
    let study = json!({ "study": "sensitivity", "base": paper(), "quantities": ["peak_stress_ring_mpa"], "inputs": { "/load/input_torque_nm": { "relative": 1e-4 } } });
    let of = &answer(&study)["quantities"][0];
    let derivative = number(&of["inputs"][0]["derivative"]);
    assert!((derivative / (number(&of["value"]) / 40.0) - 1.0).abs() < 1e-8, "{of}");
}

/// One of them, of 10¹⁵ spaces of the ring, ended the process: a number was set aside for each before the count was looked at.
#[test]
fn a_base_of_a_count_that_no_drive_has_is_refused_before_its_items_deviate() {
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
fn a_count_has_differences_and_one_that_is_impossible_has_none() {
    let base = with(&paper(), "/drive/ring", json!({}));
    let study = json!({ "study": "sensitivity", "base": base, "quantities": ["transmission_ratio"], "inputs": { "/drive/teeth/count": {} } });
    let input = answer(&study)["quantities"][0]["inputs"][0].clone();
    assert_eq!(
        (number(&input["at_minus"]), number(&input["at_plus"]), number(&input["plus_minus"])),
        (13.5, 14.5, 1.0)
    );
    // With a ring of its own no other count fits.
    let found = answer(&with(&study, "/base/drive/ring", json!({ "teeth": 26 })));
    assert_eq!(found["quantities"][0]["inputs"][0].get("at_plus"), None);
    assert_eq!(found["reasons"][0]["code"], "tooth_difference");
}

/// Of a duty too; its shares of the time add up to one, and none moves alone.
#[test]
fn left_out_inputs_are_the_torques_and_speeds_of_a_duty_too() {
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

/// A step that rounding swallows would tell of a derivative of nothing, where case 5.1 has 39 MPa/mm.
#[test]
fn an_input_is_not_moved_by_less_than_its_quantities_can_tell() {
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

/// The next whole number above the semi-minor axis is the semi-major one, and that cam would be round.
#[test]
fn a_length_between_two_whole_numbers_deviates_from_where_it_stands() {
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
fn left_out_inputs_are_all_numbers_but_counts() {
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

/// The root radius is twice the tooth's radius and more: twice its deviation.
#[test]
fn quantiles_of_a_linear_quantity_are_those_of_what_deviates() {
    let of = answer(&tolerance(json!({ "distribution": "normal", "sigma": 0.01 })))["quantities"][0].clone();
    assert_eq!(number(&of["nominal"]), 68.0);
    assert!((number(&of["mean"]) - 68.0).abs() < 5.0 * 0.02 / 20_000_f64.sqrt());
    assert!((number(&of["standard_deviation"]) / 0.02 - 1.0).abs() < 0.02);
    // Twice the width of its interval of 95 % is eight standard errors.
    let is_near = |quantile: &Value, expected: f64| {
        let [low, high, value] = ["low", "high", "value"].map(|name| number(&quantile[name]));
        low <= value && value <= high && (value - expected).abs() < 2.0 * (high - low)
    };
    let standard = [-3.0902, -2.3263, -1.6449, -0.6745, 0.0, 0.6745, 1.6449, 2.3263, 3.0902];
    for (quantile, standard) in of["quantiles"].as_array().unwrap().iter().zip(standard) {
        assert!(is_near(quantile, 68.0 + 0.02 * standard), "{quantile}: {standard}");
    }
    // Uniform: every share is a place of its own.
    let of = answer(&tolerance(json!({ "distribution": "uniform", "limit": 0.05 })))["quantities"][0].clone();
    for quantile in of["quantiles"].as_array().unwrap() {
        let expected = 68.0 + 0.1 * (2.0 * number(&quantile["share"]) - 1.0);
        assert!(is_near(quantile, expected), "{quantile}: {expected}");
    }
}

/// Of two hundred studies 95 % are 190, give or take three; a Bin(200, 0.95) is below 180 once in five hundred.
#[test]
fn the_intervals_of_quantiles_hold_as_often_as_they_say() {
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
fn the_yield_is_the_share_within_the_limits() {
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

/// Twice the tooth's radius and once the semi-major axis: four parts of five of the variance.
#[test]
fn the_tightest_contributor_stands_first_with_its_share() {
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

/// Uniform: every bin holds the same share, give or take five of its standard deviations; each drive is in one of them.
#[test]
fn the_histogram_holds_every_drive_once() {
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
    // A quantity that nothing moves is in one bin.
    let still = with(
        &tolerance(json!({ "distribution": "uniform", "limit": 0.05 })),
        "/quantities",
        json!(["transmission_ratio"]),
    );
    let histogram = answer(&still)["quantities"][0]["histogram"].clone();
    assert_eq!(histogram, json!({ "edges": [14.0, 14.0], "drives": [20_000] }));
}

/// tests/reference/tolerances.py: other load sharing, and which tooth meets which space counted anew.
fn reference() -> Value {
    serde_json::from_str(include_str!("../reference/tolerances.json")).unwrap()
}

#[test]
fn drives_with_parts_that_deviate_have_the_figures_of_the_reference() {
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

/// With chance of its own. Below a quantile of ours lies the same share of its drives, within four standard deviations of both samples; where
/// one tooth carries all, many drives have the very same value, and the share lies between those below it and those up to it.
#[test]
fn the_quantiles_are_those_of_an_independent_sampler_of_the_reference_calculation() {
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
            // Beyond the digits that are written down.
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
fn impossible_drives_fail_the_yield_and_enter_no_quantile() {
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

/// It asked itself what else there is to be moved, without end, and the process ended.
#[test]
fn a_base_without_any_number_but_counts_has_nothing_to_be_moved() {
    let base = json!({ "drive": { "teeth": { "count": 28, "radius_mm": 0, "width_mm": 0 }, "ring": { "teeth": 26 } } });
    let fault = ("/inputs".to_owned(), "missing_field".to_owned());
    assert_eq!(faulty(&json!({ "study": "sensitivity", "base": base })), fault);
}

/// What was required was all that was answered.
#[test]
fn a_tolerance_study_that_names_no_quantities_has_all_of_them_whatever_it_requires() {
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

/// Of a drive with thousands of teeth each entry was a reason of its own: a study came to ten times what was expected of it.
#[test]
fn all_entries_of_a_list_that_are_out_of_range_are_one_reason() {
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
fn what_cannot_be_drawn_is_said_at_its_field() {
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

/// Each was carried out, to a yield of nothing.
#[test]
fn deviations_of_a_drive_that_cannot_be_or_cannot_have_them_are_refused_before_they_are_drawn() {
    let spaces = json!({ "ring_space_um": { "distribution": "normal", "sigma": 3.0, "limit": 9.0 } });
    let drawn = json!({ "study": "tolerance", "base": paper(), "deviations": spaces, "quantities": ["peak_stress_ring_mpa"], "samples": 10 });
    let mut taking = drawn.clone();
    taking["base"].as_object_mut().unwrap().remove("model");
    let moved = json!({ "study": "sensitivity", "base": paper(), "quantities": ["slot_wall_mm"] });
    let count = json!({ "/drive/teeth/count": { "distribution": "uniform", "limit": 1.0 } });
    for (document, at, code) in [
        // The paper's model takes no deviations.
        (drawn.clone(), "/deviations", "conflicting_fields"),
        (with(&taking, "/base/drive/teeth/radius_mm", json!(9.0)), "/base/drive/teeth/radius_mm", "teeth_touch"),
        (with(&moved, "/base/drive/teeth/radius_mm", json!(9.0)), "/base/drive/teeth/radius_mm", "teeth_touch"),
        (
            with(&taking, "/base/deviations", json!({ "ring_space_um": [1.0] })),
            "/base/deviations/ring_space_um",
            "conflicting_fields",
        ),
        (with(&taking, "/inputs", count), "/inputs/~1drive~1teeth~1count", "wrong_type"),
        (with(&taking, "/quantities", json!(["undercut", "undercut"])), "/quantities/1", "conflicting_fields"),
        (with(&moved, "/quantities", json!(["undercut", "undercut"])), "/quantities/1", "conflicting_fields"),
    ] {
        assert_eq!(faulty(&document), (at.to_owned(), code.to_owned()), "{document}");
    }
    crate::asking::study(&taking).unwrap_or_else(|refused| panic!("{refused}"));
}
