//! Defaults written out, and consistency of studies with sweeps.

use serde_json::{Map, Value, json};
use toothwave_calculation::design::Design;
use toothwave_calculation::question::Question as _;
use toothwave_calculation::sweep::Sweep;
use toothwave_solver::Never;

use crate::asking::{CALCULATION, answer, paper, study, with};

fn examples() -> [Value; 3] {
    [
        include_str!("../../examples/paper-5.2.json"),
        include_str!("../../examples/harmonic-three-lobes.json"),
        include_str!("../../examples/flat-sided.json"),
    ]
    .map(|text| serde_json::from_str(text).unwrap())
}

/// Returns all kinds of studies over a number on which defaults depend.
fn studies(base: &Value) -> Vec<Value> {
    let radius_mm = base["drive"]["teeth"]["radius_mm"].as_f64().unwrap();
    let range = json!({ "min": 0.9 * radius_mm, "max": radius_mm });
    let radius = "/drive/teeth/radius_mm";
    vec![
        json!({ "study": "map", "base": base, "over": { radius: { "one_of": [radius_mm] } } }),
        json!({ "study": "search", "base": base, "free": { radius: range }, "objectives": [{ "quantity": "peak_force_n", "goal": "min" }] }),
        json!({ "study": "sensitivity", "base": base, "inputs": { radius: {} } }),
        json!({ "study": "tolerance", "base": base, "inputs": { radius: { "distribution": "uniform", "limit": 0.001 } }, "samples": 10 }),
    ]
}

/// Numbers that the base leaves out can be inputs, and empty deviations are no deviations.
#[test]
fn written_defaults_are_the_same_base() {
    let [base, ..] = examples();
    let modulus = "/materials/ring/youngs_modulus_gpa";
    let uniform = json!({ "distribution": "uniform", "limit": 1.0 });
    let written =
        with(&with(&base, "/materials", json!({ "ring": { "youngs_modulus_gpa": 210.0 } })), "/model", json!({}));
    let short = with(&base, "/model", json!({}));
    let with_deviations =
        with(&written, "/deviations", json!({ "slot_wall_um": [], "ring_runout": { "amount_um": 0 } }));
    for inputs in [
        json!({ "study": "sensitivity", "inputs": { modulus: {} } }),
        json!({ "study": "tolerance", "inputs": { modulus: uniform }, "deviations": { "slot_wall_um": uniform, "ring_runout": uniform }, "samples": 10 }),
    ] {
        let ids =
            [&short, &written, &with_deviations].map(|base| study(&with(&inputs, "/base", base.clone())).unwrap().id());
        assert_eq!(ids, [ids[0]; 3], "{inputs}");
    }
}

#[test]
fn explicit_default_keeps_the_id() {
    for base in examples() {
        let design = Design::read(base.to_string().as_bytes()).unwrap();
        let mut whole = serde_json::to_value(&design).unwrap();
        whole["drive"]["teeth"]["installed"] = json!(design.drive_parameters().installed);
        whole["parts"]["ring"]["rim"] = json!("housed");
        whole["model"]["refinements"] = json!("auto");
        if whole["model"]["stiffness"]["law"] == "johnson" {
            whole["model"]["stiffness"]["depth_mm"] = json!({});
        }
        for (short, long) in studies(&base).iter().zip(studies(&whole)) {
            assert_eq!(study(short).unwrap().id(), study(&long).unwrap().id(), "{long}");
        }
    }
}

/// Where the drive varies, `auto` may mean something else in each variant.
#[test]
fn returned_model_keeps_the_id_for_one_drive() {
    let [base, ..] = examples();
    let base = with(&base, "/model", json!({}));
    let swept = Sweep.ask(base.to_string().as_bytes(), &CALCULATION, &Never).unwrap();
    let returned = with(&base, "/model", serde_json::to_value(&swept.model).unwrap());
    let over = |base: &Value, pointer: &str, max: f64| json!({ "study": "map", "base": base, "over": { pointer: { "min": 1.0, "max": max, "steps": 2 } } });
    let torque = "/load/input_torque_nm";
    assert_same_id(&over(&base, torque, 2.0), &over(&returned, torque, 2.0));
    let [short, long] = [&base, &returned].map(|base| study(&over(base, "/parts/ring/clearance_um", 9.0)).unwrap());
    assert_ne!(short.id(), long.id());
}

/// Otherwise one study would be answered with the numbers of the other.
#[test]
fn default_that_follows_an_input_is_another_study() {
    let [base, ..] = examples();
    let base = with(&base, "/model", json!({}));
    let swept = Sweep.ask(base.to_string().as_bytes(), &CALCULATION, &Never).unwrap();
    let model = serde_json::to_value(&swept.model).unwrap();
    let of = |base: Value, pointer: &str| {
        let drawn = json!({ "distribution": "uniform", "limit": 0.01 });
        json!({ "study": "tolerance", "base": base, "inputs": { pointer: drawn }, "samples": 10, "quantities": ["peak_force_n"] })
    };
    for (name, pointer) in [("stiffness", "/drive/teeth/radius_mm"), ("refinements", "/parts/ring/clearance_um")] {
        let written = with(&base, "/model", json!({ name: model[name] }));
        let ids = [base.clone(), written].map(|base| study(&of(base, pointer)).unwrap().id());
        assert_ne!(ids[0], ids[1], "{name}");
    }
    let of_count = |base: Value| {
        let count = json!({ "/drive/teeth/count": { "relative": 0.001 } });
        json!({ "study": "sensitivity", "base": base, "inputs": count, "quantities": ["transmission_ratio"] })
    };
    let written = with(&base, "/drive/teeth/installed", base["drive"]["teeth"]["count"].clone());
    let mut short = base;
    short["drive"]["teeth"].as_object_mut().unwrap().remove("installed");
    let ids = [short, written].map(|base| study(&of_count(base)).unwrap().id());
    assert_ne!(ids[0], ids[1]);
}

#[test]
fn strength_by_name_is_its_numbers() {
    let [base, ..] = examples();
    let of = |strength: Value| {
        let base = with(&base, "/parts", json!({ "carrier": { "strength": strength } }));
        json!({ "study": "map", "base": base, "over": { "/load/input_torque_nm": { "min": 1, "max": 2, "steps": 2 } } })
    };
    let numbers = json!({
        "yield_strength_mpa": 490, "tensile_strength_mpa": 700, "endurance_limit_mpa": 315, "hardened": false
    });
    assert_same_id(&of(json!("c45-qt")), &of(numbers));
}

#[test]
fn replaced_object_or_list_of_base_keeps_the_id() {
    let [base, ..] = examples();
    for (pointer, value, choices) in [
        ("/model/refinements", json!(["auto"]), json!(["auto", "none"])),
        ("/parts/carrier/strength", json!({ "yield_strength_mpa": 490 }), json!(["c45-qt", "c45-n"])),
        ("/model/series_compliance_mm_per_n", json!({ "ring": 0 }), json!(["estimated"])),
        ("/load/allowable_stress_mpa", json!({ "ring": 1 }), json!([800.0])),
    ] {
        let of = |base: &Value| json!({ "study": "map", "base": base, "over": { pointer: { "one_of": choices } }, "quantities": ["peak_force_n"] });
        let short = with(&with(&base, "/model", json!({})), "/parts", json!({ "carrier": {} }));
        assert_same_id(&of(&short), &of(&with(&short, pointer, value)));
    }
}

/// The numbers of the default law, too, vary without the law's name.
#[test]
fn left_out_law_has_its_numbers() {
    let mut short = paper();
    short.as_object_mut().unwrap().remove("model");
    let long = with(&short, "/model", json!({ "stiffness": { "law": "johnson" } }));
    let depth = "/model/stiffness/depth_mm/ring";
    let of = |base: &Value| {
        [
            json!({ "study": "map", "base": base, "over": { depth: { "min": 4, "max": 6, "steps": 3 } } }),
            json!({ "study": "search", "base": base, "free": { depth: { "min": 4, "max": 6 } }, "objectives": [{ "quantity": "peak_force_n", "goal": "min" }] }),
            json!({ "study": "sensitivity", "base": base, "inputs": { depth: {} } }),
        ]
    };
    for (short, long) in of(&short).iter().zip(&of(&long)) {
        assert_same_id(short, long);
    }
    // Also where a shape drops a field that varies.
    let range = json!({ "min": 2, "max": 3, "steps": 2 });
    let over = json!({ depth: range, "/drive/teeth/flat_length_mm": range, "/drive/teeth/shape": { "one_of": ["cylinder", "flat_sided"] } });
    study(&json!({ "study": "map", "base": short, "over": over })).unwrap();
}

#[test]
fn inputs_written_out_keep_the_id() {
    for base in examples() {
        let whole = serde_json::to_value(Design::read(base.to_string().as_bytes()).unwrap()).unwrap();
        let short = json!({ "study": "sensitivity", "base": base });
        let found = answer(&short);
        let inputs = found["quantities"][0]["inputs"].as_array().unwrap();
        let inputs: Map<_, _> = inputs
            .iter()
            .map(|input| (input["pointer"].as_str().unwrap().to_owned(), json!({ "relative": 0.01 })))
            .collect();
        let ids = [
            short,
            json!({ "study": "sensitivity", "base": whole }),
            json!({ "study": "sensitivity", "base": whole, "inputs": inputs }),
        ]
        .map(|document| study(&document).unwrap().id());
        assert_eq!([ids[0]; 3], ids, "{base}");
    }
}

/// A base without a required field, which the study sets, is no design. Its defaults still count.
#[test]
fn explicit_default_of_varied_field_keeps_the_id() {
    let free = json!({
        "/drive/teeth/radius_mm": { "min": 4.0, "max": 5.0 }, "/parts/ring/clearance_um": { "min": 0.0, "max": 5.0 },
        "/materials/ring/youngs_modulus_gpa": { "min": 100.0, "max": 210.0 }
    });
    let mut base = paper();
    base["drive"]["teeth"].as_object_mut().unwrap().remove("radius_mm");
    let search = json!({ "study": "search", "base": base, "free": free, "objectives": [{ "quantity": "peak_force_n", "goal": "min" }] });
    for (pointer, default) in [
        ("/base/parts", json!({ "ring": { "clearance_um": 0.0 } })),
        ("/base/materials", json!({ "ring": { "youngs_modulus_gpa": 210.0 } })),
    ] {
        assert_same_id(&search, &with(&search, pointer, default));
    }
}

#[test]
fn replaced_value_of_base_keeps_the_id() {
    let [base, ..] = examples();
    let other = with(&base, "/drive/teeth/radius_mm", json!(1.4));
    let (studies, others) = (studies(&base), studies(&other));
    // The radii of the map are those of the base.
    let map = with(&others[0], "/over", studies[0]["over"].clone());
    assert_same_id(&studies[0], &map);
    let search = with(&others[1], "/free", studies[1]["free"].clone());
    assert_same_id(&studies[1], &search);
    for (one, other) in studies[2..].iter().zip(&others[2..]) {
        assert_ne!(study(one).unwrap().id(), study(other).unwrap().id(), "{other}");
    }
}

#[test]
fn number_of_default_law_is_input() {
    let base = with(&paper(), "/model", json!({}));
    let inputs = json!({ "/model/stiffness/depth_mm/ring": {} });
    let short = json!({ "study": "sensitivity", "base": base, "inputs": inputs, "quantities": ["peak_force_n"] });
    assert_same_id(&short, &with(&short, "/base/model/stiffness", json!({ "law": "johnson" })));
}

fn assert_same_id(short: &Value, long: &Value) {
    assert_eq!(study(short).unwrap().id(), study(long).unwrap().id(), "{short} {long}");
}

/// A search without a sweep has designs for sweeps all the same.
#[test]
fn default_samples_are_the_same_for_each_quantity() {
    let search = json!({
        "study": "search", "base": paper(), "evaluations": 100,
        "free": { "/drive/teeth/radius_mm": { "min": 4.0, "max": 5.0 } },
        "objectives": [{ "quantity": "outer_diameter_mm", "goal": "min" }]
    });
    assert_same_id(&search, &with(&search, "/base/sweep", json!({ "samples": 16 })));
    let found = answer(&search);
    assert_eq!((&found["evaluated"], &found["front"][0]["design"]["sweep"]["samples"]), (&json!(100), &Value::Null));
}

#[test]
fn all_whole_steps_written_out_keep_the_id() {
    let samples = |range: Value| json!({ "study": "map", "base": paper(), "over": { "/sweep/samples": range } });
    let steps = |steps: u64| samples(json!({ "min": 10, "max": 12, "steps": steps }));
    let all = samples(json!({ "min": 10, "max": 12 }));
    assert_same_id(&all, &steps(3));
    assert_ne!(study(&all).unwrap().id(), study(&steps(2)).unwrap().id());
}

#[test]
fn derived_free_fields_written_out_keep_the_id() {
    let short = json!({ "load": { "output_torque_nm": 200.0 } });
    let long = with(&short, "/drive", json!({ "wave_generator": { "kind": "harmonic_path", "lobes": 2 } }));
    let of = |base: Value| {
        json!({
            "study": "search", "base": base, "evaluations": 100,
            "require": { "transmission_ratio": { "min": 19.5, "max": 20.5 }, "outer_diameter_mm": { "max": 120.0 } },
            "objectives": [{ "quantity": "outer_diameter_mm", "goal": "min" }]
        })
    };
    let search = of(short);
    assert_same_id(&search, &of(long.clone()));
    let found = answer(&search);
    let range = |free: &Value| {
        (free["pointer"].as_str().unwrap().to_owned(), json!({ "min": free["min"], "max": free["max"] }))
    };
    let free: Map<_, _> = found["free"].as_array().unwrap().iter().map(range).collect();
    assert_same_id(&search, &with(&search, "/free", json!(free)));
    assert_same_id(&search, &with(&of(long), "/free", json!(free)));
}

#[test]
fn only_free_values_of_starts_change_the_id() {
    let search = &studies(&paper())[1];
    let start = |radius_mm: f64| json!([{ "drive": { "teeth": { "radius_mm": radius_mm } } }]);
    let started = with(search, "/start", start(4.9));
    assert_same_id(&started, &with(search, "/start", json!([with(&paper(), "/drive/teeth/radius_mm", json!(4.9))])));
    assert_ne!(study(&started).unwrap().id(), study(&with(search, "/start", start(4.8))).unwrap().id());
}

#[test]
fn non_default_value_changes_the_id() {
    let [base, ..] = examples();
    for (pointer, value) in [
        ("/model/refinements", json!("none")),
        ("/drive/teeth/installed", json!(20)),
        ("/parts", json!({ "ring": { "clearance_um": 1.0 } })),
    ] {
        let base = with(&base, "/model", json!({}));
        let other = with(&base, pointer, value);
        for (one, other) in studies(&base).iter().zip(studies(&other)) {
            assert_ne!(study(one).unwrap().id(), study(&other).unwrap().id(), "{other}");
        }
    }
}

#[test]
fn study_has_the_losses_of_its_sweep() {
    let base = json!({
        "drive": {
            "wave_generator": { "kind": "harmonic", "lobes": 2, "mean_radius_mm": 231.12997975753026, "amplitude_mm": 41.60339635635545 },
            "teeth": { "count": 8, "radius_mm": 68.49251202065417, "width_mm": 195.7791649140081 },
            "ring": { "teeth": 6, "tip_radius_mm": 330.67467672845333 }
        },
        "load": { "output_torque_nm": 81.02744671570262 },
        "model": { "stiffness": { "law": "palmgren" }, "refinements": ["ring_teeth_bend"] },
        "parts": {
            "wave_generator": { "clearance_um": 32.427941756611055 },
            "ring": { "clearance_um": 4.647819064937812 },
            "carrier": { "clearance_um": 24.77145301233784 }
        },
        "sweep": { "tolerance": 0.01, "wind_up": true },
        "friction": {
            "wave_generator": { "kind": "race", "coefficient": 0.12805712193672292, "bearing_coefficient": 0.00536429680252209, "bearing_radius_mm": 218.62018263879833 },
            "ring": { "coefficient": 0.10293595232186245 },
            "carrier": { "coefficient": 0.04377392473226462 }
        }
    });
    let map = json!({
        "study": "map", "base": base, "over": { "/drive/teeth/radius_mm": { "one_of": [68.49251202065417] } },
        "quantities": ["loss_ratio", "loss_ratio_wave_generator"]
    });
    let found = answer(&map);
    let sweep = Sweep.ask(base.to_string().as_bytes(), &CALCULATION, &Never).unwrap();
    let totals = sweep.losses.unwrap().totals;
    let of_sweep = [totals.loss_ratio, totals.loss_ratio_by_place.wave_generator];
    for (name, of_sweep) in ["loss_ratio", "loss_ratio_wave_generator"].into_iter().zip(of_sweep) {
        assert_eq!(found["possible"]["quantities"][name][0].as_f64(), Some(of_sweep), "{name}");
    }
}
