//! Searches.

use serde_json::{Value, json};
use toothwave_calculation::no_answer::NoAnswerCode;
use toothwave_calculation::question::Question as _;
use toothwave_calculation::sweep::Sweep;
use toothwave_solver::Never;
use toothwave_study::{Limits, Study};

use crate::asking::{CALCULATION, LIMITS, answer, faulty, paper, study, with};

/// Returns a search with two opposing objectives of the teeth's radius and one limit.
fn search() -> Value {
    json!({
        "study": "search", "base": paper(), "evaluations": 4000,
        "free": { "/drive/teeth/radius_mm": { "min": 3.0, "max": 7.5 }, "/drive/wave_generator/semi_minor_mm": { "min": 55.0, "max": 57.5 } },
        "require": { "undercut": false },
        "objectives": [{ "quantity": "slot_wall_mm", "goal": "max" }, { "quantity": "carrier_radial_space_mm", "goal": "max" }]
    })
}

fn number(value: &Value) -> f64 {
    value.as_f64().unwrap_or_else(|| panic!("{value} is no number"))
}

/// Returns the area between a front and a reference corner. Both objectives are maximised.
fn hypervolume(points: &[(f64, f64)], corner: (f64, f64)) -> f64 {
    let mut points: Vec<_> = points.iter().filter(|point| point.0 > corner.0 && point.1 > corner.1).collect();
    points.sort_by(|one, other| other.0.total_cmp(&one.0));
    let mut area = 0.0;
    let mut height = corner.1;
    for &&(x, y) in &points {
        if y > height {
            area += (x - corner.0) * (y - height);
            height = y;
        }
    }
    area
}

#[test]
fn search_replaces_no_invalid_base_value() {
    let swept = with(&search(), "/objectives/0", json!({ "quantity": "peak_stress_ring_mpa", "goal": "min" }));
    let envelope = json!({
        "study": "search", "base": {}, "require": { "transmission_ratio": { "min": 10, "max": 20 }, "outer_diameter_mm": { "max": 120 } },
        "objectives": [{ "quantity": "slot_wall_mm", "goal": "max" }]
    });
    for value in [json!(5), json!("fine"), json!(null)] {
        let study = with(&swept, "/base/sweep", value.clone());
        assert_eq!(faulty(&study), ("/base/sweep".into(), "wrong_type".into()), "{value}");
        let study = with(&envelope, "/base/drive", value.clone());
        assert_eq!(faulty(&study), ("/base/drive".into(), "wrong_type".into()), "{value}");
    }
}

/// Further starts would never be evaluated, or would exceed the requested number.
#[test]
fn starts_are_limited_by_evaluations_of_each_island() {
    let started = |count: usize| {
        let study = with(&search(), "/evaluations", json!(100));
        with(&study, "/start", json!(vec![paper(); count]))
    };
    assert_eq!(faulty(&started(100)), ("/start".into(), "out_of_range".into()));
    assert_eq!(answer(&started(20))["evaluated"], 100);
}

#[test]
fn front_matches_fine_grid() {
    let map = json!({
        "study": "map", "base": paper(), "quantities": ["slot_wall_mm", "carrier_radial_space_mm", "undercut"],
        "over": { "/drive/teeth/radius_mm": { "min": 3.0, "max": 7.5, "steps": 226 }, "/drive/wave_generator/semi_minor_mm": { "min": 55.0, "max": 57.5, "steps": 126 } }
    });
    let grid = answer(&map);
    let column =
        |name: &str| grid["possible"]["quantities"][name].as_array().unwrap().iter().map(number).collect::<Vec<_>>();
    let walls = column("slot_wall_mm").into_iter().zip(column("carrier_radial_space_mm")).zip(column("undercut"));
    let brute: Vec<_> = walls.filter(|(_, undercut)| *undercut == 0.0).map(|(point, _)| point).collect();
    let found = answer(&search());
    let front = found["front"].as_array().unwrap();
    let front: Vec<_> = front
        .iter()
        .map(|found| {
            (number(&found["quantities"]["slot_wall_mm"]), number(&found["quantities"]["carrier_radial_space_mm"]))
        })
        .collect();
    assert!(front.len() > 50, "{}", front.len());
    let corner = (0.0, 0.0);
    let (own, best) = (hypervolume(&front, corner), hypervolume(&brute, corner));
    assert!(own > 0.995 * best, "{own} of {best}");
    for one in &front {
        assert!(!front.iter().any(|other| other != one && other.0 >= one.0 && other.1 >= one.1), "{one:?} is beaten");
    }
}

/// Both are true peaks, one without columns, and agree within the document's tolerance.
#[test]
fn front_design_has_figures_of_its_document() {
    let study = with(&search(), "/objectives/0", json!({ "quantity": "peak_stress_ring_mpa", "goal": "min" }));
    let study = with(&study, "/evaluations", json!(1000));
    let found = answer(&study);
    for found in found["front"].as_array().unwrap().iter().step_by(10) {
        let sweep = Sweep.ask(found["design"].to_string().as_bytes(), &CALCULATION, &Never).unwrap();
        let (stress_mpa, own_mpa) =
            (number(&found["quantities"]["peak_stress_ring_mpa"]), sweep.peaks.ring.stress_mpa.value);
        let tolerance = number(&found["design"]["sweep"]["tolerance"]);
        assert!((stress_mpa / own_mpa - 1.0).abs() <= tolerance, "{stress_mpa} {own_mpa} {tolerance:e}");
        assert_eq!(found["quantities"]["undercut"], 0.0);
    }
}

#[test]
fn reasons_outside_the_front_add_up() {
    let found = answer(&search());
    let scan = &found["scan"];
    let limit = &found["limits"][0];
    assert_eq!((&limit["quantity"], &limit["bound"]), (&json!("undercut"), &json!("is")));
    // There is one limit, so each failed variant fails it alone.
    assert_eq!(limit["fell"], limit["fell_alone"]);
    let count = |value: &Value| value.as_u64().unwrap();
    assert_eq!(count(&scan["variants"]), 800);
    assert_eq!(count(&scan["good"]) + count(&limit["fell"]) + count(&scan["impossible"]), 800);
    assert!(count(&limit["fell"]) > 0 && count(&scan["impossible"]) > 0);
    let reasons: u64 = scan["reasons"].as_array().unwrap().iter().map(|reason| count(&reason["variants"])).sum();
    assert_eq!(reasons, count(&scan["impossible"]));
}

/// The root radius a + 2 r is at least 64 mm: 153.6 mm with its rim.
#[test]
fn impossible_search_reports_least_relaxation() {
    let study = with(&search(), "/require/outer_diameter_mm", json!({ "max": 150.0 }));
    let found = answer(&study);
    assert_eq!(found["front"], json!([]));
    let relaxed = &found["relaxations"][0];
    assert_eq!((&relaxed["quantity"], &relaxed["bound"]), (&json!("outer_diameter_mm"), &json!("max")));
    assert!((number(&relaxed["needed"]) - 153.6).abs() < 0.05, "{relaxed}");
    assert_eq!(relaxed["found"]["quantities"]["undercut"], 0.0);
    assert!((number(&found["nearest_miss"]["quantities"]["outer_diameter_mm"]) - 153.6).abs() < 0.5);
}

/// All contacts follow the same power of the force, so stress times size is constant for each shape: the least stress
/// within 30 mm gives the ring size for 900 MPa.
#[test]
fn each_relaxation_is_within_one_percent() {
    let base = json!({
        "drive": { "teeth": { "count": 100 }, "ring": { "teeth": 98 } },
        "load": { "output_torque_nm": 400 },
        "model": { "compatibility": "virtual_work", "stiffness": { "law": "palmgren" } },
        "sweep": { "samples": 50 }
    });
    let study = json!({
        "study": "search", "base": base, "evaluations": 50000, "seed": 1,
        "free": {
            "/drive/wave_generator/semi_major_mm": { "min": 5, "max": 200 }, "/drive/wave_generator/semi_minor_mm": { "min": 5, "max": 200 },
            "/drive/teeth/radius_mm": { "min": 0.05, "max": 8 }, "/drive/teeth/width_mm": { "min": 1, "max": 10 }
        },
        "require": { "ring_root_radius_mm": { "max": 30 }, "peak_stress_mpa": { "max": 900 }, "undercut": false },
        "objectives": [{ "quantity": "ring_root_radius_mm", "goal": "min" }]
    });
    let stress_at = |radius_mm: f64| {
        let major_mm = 30.0 - 2.0 * radius_mm;
        let drive = json!({
            "wave_generator": { "semi_major_mm": major_mm }, "ring": { "teeth": 98 },
            "teeth": { "count": 100, "radius_mm": radius_mm, "width_mm": 10 }
        });
        let map = json!({
            "study": "map", "base": with(&base, "/drive", drive), "quantities": ["peak_stress_mpa", "undercut"],
            "over": { "/drive/wave_generator/semi_minor_mm": { "min": major_mm - 1.0, "max": major_mm - 1e-3, "steps": 100 } }
        });
        let found = answer(&map);
        let column = |name: &str| found["possible"]["quantities"][name].as_array().unwrap().clone();
        let whole =
            column("peak_stress_mpa").into_iter().zip(column("undercut")).filter(|(_, undercut)| *undercut == 0.0);
        whole.map(|(stress, _)| number(&stress)).fold(f64::INFINITY, f64::min)
    };
    let stress_mpa = (5..=90).map(|step| stress_at(0.01 * f64::from(step))).fold(f64::INFINITY, f64::min);
    let found = answer(&study);
    for (name, least) in [("peak_stress_mpa", stress_mpa), ("ring_root_radius_mm", 30.0 * stress_mpa / 900.0)] {
        let relaxations = found["relaxations"].as_array().unwrap();
        let relaxed = relaxations.iter().find(|relaxed| relaxed["quantity"] == name);
        let needed = number(&relaxed.unwrap_or_else(|| panic!("{name} is missing: {found}"))["needed"]);
        assert!((needed / least - 1.0).abs() < 0.01, "{name}: {needed} where {least} is possible");
    }
}

/// Without undercut all contact ratios are equal, so these designs must not fill the archive as ends of an objective.
#[test]
fn front_grows_no_worse_with_more_evaluations() {
    let study = json!({
        "study": "search", "base": paper(),
        "free": {
            "/drive/wave_generator/semi_major_mm": { "min": 40, "max": 60 }, "/drive/wave_generator/semi_minor_mm": { "min": 36, "max": 60 },
            "/drive/teeth/radius_mm": { "min": 1, "max": 8 }
        },
        "require": { "undercut": false, "slot_wall_mm": { "min": 1.5 } },
        "objectives": [
            { "quantity": "ring_root_radius_mm", "goal": "min" }, { "quantity": "ring_tooth_height_mm", "goal": "max" },
            { "quantity": "coincidence_degree", "goal": "max" }
        ]
    });
    let volume = |evaluations: u64| {
        let found = answer(&with(&study, "/evaluations", json!(evaluations)));
        let point = |found: &Value| {
            let quantity = |name: &str| number(&found["quantities"][name]);
            (-quantity("ring_root_radius_mm"), quantity("ring_tooth_height_mm"))
        };
        hypervolume(&found["front"].as_array().unwrap().iter().map(point).collect::<Vec<_>>(), (-75.0, 0.0))
    };
    let volumes = [25_000, 50_000, 100_000, 200_000].map(volume);
    assert!(volumes.is_sorted(), "{volumes:?}");
}

#[test]
fn limit_at_the_front_binds() {
    let study = with(&search(), "/require/outer_diameter_mm", json!({ "max": 160.0 }));
    let study = with(&study, "/objectives/0", json!({ "quantity": "ring_tooth_height_mm", "goal": "max" }));
    let found = answer(&study);
    let limits = found["limits"].as_array().unwrap();
    let diameter = limits.iter().find(|limit| limit["quantity"] == "outer_diameter_mm").unwrap();
    assert!(number(&diameter["fell"]) > 0.0);
    for found in found["front"].as_array().unwrap() {
        assert!(number(&found["quantities"]["outer_diameter_mm"]) <= 160.0);
    }
}

#[test]
fn counts_and_kinds_are_free_too() {
    let base = json!({ "drive": { "wave_generator": { "lobes": 2, "mean_radius_mm": 57.0, "amplitude_mm": 1.0, "semi_major_mm": 58.0, "semi_minor_mm": 56.0 },
        "teeth": { "width_mm": 15.0 } }, "load": { "input_torque_nm": 20.0 } });
    let study = json!({
        "study": "search", "base": base, "evaluations": 2000,
        "free": {
            "/drive/wave_generator/kind": { "one_of": ["ellipse", "harmonic"] },
            "/drive/teeth/count": { "min": 20, "max": 40 },
            "/drive/teeth/radius_mm": { "min": 2.0, "max": 8.0 }
        },
        "require": { "undercut": false },
        "objectives": [{ "quantity": "transmission_ratio", "goal": "max" }, { "quantity": "peak_stress_mpa", "goal": "min" }]
    });
    let found = answer(&study);
    let front = found["front"].as_array().unwrap();
    assert!(front.len() > 5, "{}", front.len());
    for found in front {
        let design = &found["design"]["drive"];
        let count = design["teeth"]["count"].as_i64().unwrap();
        assert_eq!(design["ring"]["teeth"].as_i64().unwrap(), count - 2);
        assert!((20..=40).contains(&count));
    }
}

#[test]
fn ratio_torque_and_space_suffice_for_a_drive() {
    let study = json!({
        "study": "search", "evaluations": 6000,
        "base": { "load": { "output_torque_nm": 200.0, "allowable_stress_mpa": 1500.0 } },
        "require": { "transmission_ratio": { "min": 19.5, "max": 20.5 }, "outer_diameter_mm": { "max": 120.0 }, "undercut": false, "torque_capacity_output_nm": { "min": 200.0 } },
        "objectives": [{ "quantity": "outer_diameter_mm", "goal": "min" }, { "quantity": "torque_capacity_output_nm", "goal": "max" }]
    });
    let found = answer(&study);
    let front = found["front"].as_array().unwrap();
    assert!(!front.is_empty(), "{found}");
    for found in front {
        let quantity = |name: &str| number(&found["quantities"][name]);
        assert!(quantity("outer_diameter_mm") <= 120.0 && quantity("torque_capacity_output_nm") >= 200.0);
        assert!((19.5..=20.5).contains(&quantity("transmission_ratio")) && quantity("undercut") == 0.0);
    }
}

/// Returns requirements without a drive.
fn requirements() -> Value {
    json!({
        "study": "search", "evaluations": 2000,
        "base": { "load": { "output_torque_nm": 200.0 }, "model": { "compatibility": "projection", "stiffness": { "law": "linear" } } },
        "require": { "transmission_ratio": { "min": 19.5, "max": 20.5 }, "outer_diameter_mm": { "max": 120.0 } },
        "objectives": [{ "quantity": "outer_diameter_mm", "goal": "min" }, { "quantity": "peak_stress_mpa", "goal": "min" }]
    })
}

/// Defaults follow for every kind of wave generator and shape of teeth.
#[test]
fn every_kind_of_base_has_free_fields() {
    for (wave_generator, lobes, free) in [
        (json!({}), 2, ["semi_major_mm", "semi_minor_mm"]),
        (json!({ "kind": "ellipse" }), 2, ["semi_major_mm", "semi_minor_mm"]),
        (json!({ "kind": "eccentric" }), 1, ["eccentricity_mm", "radius_mm"]),
        (json!({ "kind": "harmonic", "lobes": 3 }), 3, ["amplitude_mm", "mean_radius_mm"]),
        (json!({ "kind": "harmonic_path" }), 2, ["amplitude_mm", "mean_path_radius_mm"]),
    ] {
        let study = with(&requirements(), "/base/drive", json!({ "wave_generator": wave_generator }));
        let found = answer(&study);
        let front = found["front"].as_array().unwrap();
        assert!(!front.is_empty(), "{wave_generator}: {found}");
        for found in front {
            let drive = &found["design"]["drive"];
            let count = drive["teeth"]["count"].as_i64().unwrap();
            assert_eq!(count - drive["ring"]["teeth"].as_i64().unwrap(), lobes, "{wave_generator}");
            assert!((19.5..=20.5).contains(&(count as f64 / lobes as f64)), "{wave_generator}: {count} teeth");
        }
        let pointers: Vec<_> = found["free"].as_array().unwrap().iter().map(|free| &free["pointer"]).collect();
        for name in free {
            let pointer = json!(format!("/drive/wave_generator/{name}"));
            assert!(pointers.contains(&&pointer), "{pointer} is not free: {pointers:?}");
        }
    }
    for (shape, law, free) in [("ball", "hertz", 4), ("flat_sided", "johnson", 6)] {
        let base = json!({ "drive": { "teeth": { "shape": shape } }, "load": { "output_torque_nm": 20.0 }, "model": { "stiffness": { "law": law } } });
        let found = answer(&with(&with(&requirements(), "/base", base), "/evaluations", json!(400)));
        assert_eq!(found["free"].as_array().unwrap().len(), free, "{shape}: {}", found["free"]);
        assert!(number(&found["scan"]["impossible"]) < number(&found["scan"]["variants"]), "{found}");
    }
}

#[test]
fn tooth_count_follows_from_ring_teeth() {
    let study = with(&requirements(), "/base/drive", json!({ "ring": { "teeth": 38 } }));
    for found in answer(&study)["front"].as_array().unwrap() {
        assert_eq!(found["design"]["drive"]["teeth"]["count"], 40);
    }
}

/// Each refusal points to a given field or names the missing one.
#[test]
fn incomplete_request_is_refused_at_a_given_field() {
    let detail = |document: &Value| {
        let refused = study(document).expect_err("the study can be carried out");
        refused.errors[0].detail.clone()
    };
    let mut others = Vec::new();
    for (pointer, value, at, code, says) in [
        // With two lobes, ratios are multiples of one half.
        (
            "/require/transmission_ratio",
            json!({ "min": 19.6, "max": 19.9 }),
            "/require/transmission_ratio",
            "out_of_range",
            "lobes",
        ),
        (
            "/require/transmission_ratio",
            json!({ "min": -3, "max": -2 }),
            "/require/transmission_ratio",
            "out_of_range",
            "lobes",
        ),
        (
            "/require/transmission_ratio",
            json!({ "min": 20 }),
            "/free",
            "missing_field",
            "`min` and `max` of `transmission_ratio`",
        ),
        ("/require/outer_diameter_mm", json!({ "min": 100 }), "/free", "missing_field", "`max` of `outer_diameter_mm`"),
        (
            "/require/outer_diameter_mm",
            json!({ "max": -120 }),
            "/require/outer_diameter_mm/max",
            "out_of_range",
            "above zero",
        ),
        (
            "/base/drive",
            json!({ "wave_generator": { "kind": "elipse" } }),
            "/base/drive/wave_generator/kind",
            "unknown_choice",
            "ellipse",
        ),
        (
            "/base/drive",
            json!({ "wave_generator": { "kind": "harmonic", "lobes": 0 } }),
            "/base/drive/wave_generator/lobes",
            "out_of_range",
            "1000",
        ),
        ("/base/drive", json!({ "teeth": { "width": 3 } }), "/base/drive/teeth/width", "unknown_field", "width_mm"),
        ("/base/load/output_torque_nm", json!(-200), "/base/load/output_torque_nm", "out_of_range", "200"),
        ("/base/drive", json!({ "teeth": { "width_mm": 0 } }), "/base/drive/teeth/width_mm", "out_of_range", "0"),
        (
            "/free",
            json!({ "/drive/teeth/radius_mm": { "min": 3, "max": 4 } }),
            "/base/drive/teeth/count",
            "missing_field",
            "`free`",
        ),
        ("/start", json!([{}]), "/start/0/drive/teeth/count", "missing_field", "no value"),
        (
            "/start",
            json!([{ "drive": { "teeth": { "count": 40.5 } } }]),
            "/start/0/drive/teeth/count",
            "wrong_type",
            "whole",
        ),
        (
            "/start",
            json!([{ "drive": { "teeth": { "count": 50 } } }]),
            "/start/0/drive/teeth/count",
            "out_of_range",
            "39.0 to 41.0",
        ),
    ] {
        let document = with(&requirements(), pointer, value.clone());
        let found = (faulty(&document), detail(&document));
        if found.0 != (at.to_owned(), code.to_owned()) || !found.1.contains(says) {
            others.push(format!("{pointer}: {value}: {found:?}"));
        }
    }
    assert!(others.is_empty(), "{}", others.join("\n"));
    let complete = with(&with(&requirements(), "/base", paper()), "/start", json!([]));
    assert_eq!(faulty(&complete), ("/free".into(), "missing_field".into()), "everything stands in the base");
}

/// A duty refuses a tolerance sweep, so the search must not ask for one.
#[test]
fn search_under_duty_has_front_at_hardest_point() {
    let point =
        |torque_nm: f64| json!({ "input_torque_nm": torque_nm, "input_speed_rpm": 1000.0, "share_of_time": 0.5 });
    let under = |load: Value| {
        let study = with(&search(), "/objectives/0", json!({ "quantity": "peak_stress_ring_mpa", "goal": "min" }));
        answer(&with(&with(&study, "/base/load", load), "/evaluations", json!(400)))
    };
    let of_duty = under(json!({ "duty": [point(10.0), point(20.0)] }));
    let of_hardest = under(json!({ "input_torque_nm": 20.0 }));
    let front = of_duty["front"].as_array().unwrap();
    assert!(front.len() > 5, "{of_duty}");
    assert_eq!(front[0]["design"]["sweep"]["samples"], 200);
    let best = |found: &Value| number(&found["front"][0]["quantities"]["peak_stress_ring_mpa"]);
    assert!((best(&of_duty) / best(&of_hardest) - 1.0).abs() < 2e-3, "{} and {}", best(&of_duty), best(&of_hardest));
}

/// JSON pointers lead into arrays too (RFC 6901).
#[test]
fn list_entry_is_a_field() {
    let point =
        |torque_nm: f64| json!({ "output_torque_nm": torque_nm, "input_speed_rpm": 1000.0, "share_of_time": 0.5 });
    let base = with(&paper(), "/load", json!({ "duty": [point(200.0), point(100.0)] }));
    let study = json!({
        "study": "map", "base": base, "quantities": ["peak_stress_mpa"],
        "over": { "/load/duty/0/output_torque_nm": { "one_of": [200.0, 300.0] } }
    });
    let stresses = answer(&study)["possible"]["quantities"]["peak_stress_mpa"].clone();
    assert!((number(&stresses[1]) / number(&stresses[0]) - 1.5_f64.sqrt()).abs() < 1e-9, "{stresses}");
}

#[test]
fn start_is_evaluated_first() {
    let study = with(&search(), "/start", json!([paper()]));
    let study = with(&study, "/evaluations", json!(100));
    assert!(!answer(&study)["front"].as_array().unwrap().is_empty());
    let elsewhere = with(&study, "/start/0/drive/teeth/radius_mm", json!(9.0));
    assert_eq!(faulty(&elsewhere), ("/start/0/drive/teeth/radius_mm".into(), "out_of_range".into()));
}

#[test]
fn impossible_search_is_refused_at_its_field() {
    for (pointer, value, at, code) in [
        ("/objectives", json!([]), "/objectives", "missing_field"),
        ("/objectives/1/quantity", json!("slot_wall_mm"), "/objectives/1/quantity", "conflicting_fields"),
        ("/objectives/1/quantity", json!("beauty"), "/objectives/1/quantity", "unknown_choice"),
        ("/free", json!({}), "/free", "missing_field"),
        (
            "/free/~1drive~1teeth~1radius_mm",
            json!({ "min": 5, "max": 4 }),
            "/free/~1drive~1teeth~1radius_mm/min",
            "out_of_range",
        ),
        ("/require/undercut", json!({ "max": 1 }), "/require/undercut", "wrong_type"),
        ("/require/slot_wall_mm", json!(true), "/require/slot_wall_mm", "wrong_type"),
        ("/require/slot_wall_mm", json!({}), "/require/slot_wall_mm", "missing_field"),
        ("/require/slot_wall_mm", json!({ "min": 2, "max": 1 }), "/require/slot_wall_mm/min", "out_of_range"),
        ("/evaluations", json!(1), "/evaluations", "out_of_range"),
        ("/seed", json!(-1), "/seed", "out_of_range"),
    ] {
        assert_eq!(faulty(&with(&search(), pointer, value)), (at.to_owned(), code.to_owned()), "{pointer}");
    }
}

#[test]
fn search_without_effective_free_field_is_refused() {
    let radius = "/free/~1drive~1teeth~1radius_mm";
    let only = |pointer: &str, range: Value| with(&search(), "/free", json!({ pointer: range }));
    let requiring = |name: &str, required: Value| with(&search(), "/require", json!({ name: required }));
    let drawn = with(
        &requiring("outer_diameter_mm", json!({ "max": 150.0 })),
        "/base/parts",
        json!({ "ring": { "outer_radius_mm": 90.0 } }),
    );
    let of_friction = with(
        &requiring("efficiency_ring_fixed", json!({ "min": 1.2 })),
        "/base/friction",
        json!({ "wave_generator": { "kind": "plain", "coefficient": 0.05 }, "ring": { "coefficient": 0.05 }, "carrier": { "coefficient": 0.05 } }),
    );
    let of_ring = with(&requirements(), "/base/drive", json!({ "ring": { "teeth": 38 } }));
    let mut others = Vec::new();
    for (document, at, code) in [
        (
            with(&search(), "/objectives/1/quantity", json!("transmission_ratio")),
            "/objectives/1/quantity",
            "unaffected",
        ),
        (with(&search(), "/objectives/1/quantity", json!("input_torque_nm")), "/objectives/1/quantity", "unaffected"),
        (
            only("/profile/chord_tolerance_mm", json!({ "min": 0.001, "max": 0.01 })),
            "/objectives/0/quantity",
            "unaffected",
        ),
        (only("/sweep/samples", json!({ "min": 10, "max": 20 })), "/objectives/0/quantity", "unaffected"),
        (only("/drive/teeth/radius_mm", json!({ "min": 4.0, "max": 4.0 })), "/free", "unaffected"),
        (only("/drive/teeth/radius_mm", json!({ "one_of": [4.0] })), "/free", "unaffected"),
        (requiring("transmission_ratio", json!({ "min": 20.0 })), "/require/transmission_ratio/min", "unaffected"),
        (requiring("transmission_ratio", json!({ "max": 10.0 })), "/require/transmission_ratio/max", "unaffected"),
        (drawn, "/require/outer_diameter_mm/max", "unaffected"),
        (
            with(&of_ring, "/require/transmission_ratio", json!({ "min": 29.5, "max": 30.5 })),
            "/require/transmission_ratio/min",
            "unaffected",
        ),
        (of_friction, "/require/efficiency_ring_fixed/min", "out_of_range"),
        (requiring("peak_stress_mpa", json!({ "max": -1.0 })), "/require/peak_stress_mpa/max", "out_of_range"),
        (
            with(&requirements(), "/require/outer_diameter_mm", json!({ "max": 1e-9 })),
            "/require/outer_diameter_mm/max",
            "out_of_range",
        ),
        (
            with(&search(), radius, json!({ "min": -2.0, "max": -1.0 })),
            "/free/~1drive~1teeth~1radius_mm/max",
            "out_of_range",
        ),
        (
            with(&search(), radius, json!({ "min": 2e6, "max": 3e6 })),
            "/free/~1drive~1teeth~1radius_mm/min",
            "out_of_range",
        ),
        (
            with(&search(), radius, json!({ "one_of": [4.0, 5.0, 4.0] })),
            "/free/~1drive~1teeth~1radius_mm/one_of/2",
            "conflicting_fields",
        ),
        (only("/drive/teeth", json!({ "min": 4.0, "max": 5.0 })), "/free/~1drive~1teeth", "wrong_type"),
    ] {
        let found = faulty(&document);
        if found != (at.to_owned(), code.to_owned()) {
            others.push(format!("{at}: {found:?}"));
        }
    }
    assert!(others.is_empty(), "{}", others.join("\n"));
    // A limit that always holds is no fault, nor is a range that is possible in part.
    for document in [
        requiring("transmission_ratio", json!({ "min": 13.0 })),
        with(&search(), radius, json!({ "min": -2.0, "max": 5.0 })),
    ] {
        study(&document).unwrap_or_else(|refused| panic!("{refused}"));
    }
}

/// Each quantity declares the fields on which it depends.
#[test]
fn undeclared_fields_do_not_change_a_quantity() {
    let base = json!({
        "drive": { "wave_generator": { "semi_major_mm": 58.0, "semi_minor_mm": 56.0 }, "teeth": { "count": 28, "radius_mm": 5.0, "width_mm": 15.0 }, "ring": { "teeth": 26 } },
        "load": { "input_torque_nm": 20.0, "input_speed_rpm": 1000.0, "allowable_stress_mpa": 1500.0 },
        "materials": { "ring": { "youngs_modulus_gpa": 210.0, "poissons_ratio": 0.3 } },
        "modification": { "slot_wall_um": 1.0 },
        "friction": { "wave_generator": { "kind": "plain", "coefficient": 0.05 }, "ring": { "coefficient": 0.05 }, "carrier": { "coefficient": 0.05 } },
        "parts": { "ring": { "clearance_um": 5.0 }, "teeth": { "clearance_um": 1.0 } },
        "profile": { "chord_tolerance_mm": 0.001 },
        "sweep": { "samples": 16 }
    });
    for pointer in [
        "/drive/wave_generator/semi_minor_mm",
        "/drive/teeth/radius_mm",
        "/drive/teeth/width_mm",
        "/load/input_torque_nm",
        "/load/allowable_stress_mpa",
        "/materials/ring/youngs_modulus_gpa",
        "/parts/teeth/clearance_um",
        "/modification/slot_wall_um",
        "/friction/ring/coefficient",
        "/parts/ring/clearance_um",
        "/profile/chord_tolerance_mm",
    ] {
        let sensitivity = json!({ "study": "sensitivity", "base": base, "inputs": { pointer: { "relative": 0.01 } } });
        for quantity in answer(&sensitivity)["quantities"].as_array().unwrap() {
            let name = quantity["quantity"].as_str().unwrap();
            let changes = quantity["inputs"].as_array().unwrap().iter().any(|input| number(&input["change"]) != 0.0);
            let search = json!({
                "study": "search", "base": base, "evaluations": 100, "free": { pointer: { "min": 1e-3, "max": 2e-3 } },
                "objectives": [{ "quantity": name, "goal": "min" }]
            });
            let refused = study(&search).err().and_then(|refused| refused.errors.into_iter().next());
            let is_unaffected =
                refused.is_some_and(|error| toothwave_calculation::json::word(&error.code) == "unaffected");
            assert!(!(changes && is_unaffected), "{pointer} changes {name}");
        }
    }
}

/// Each design of the front is a whole document.
#[test]
fn result_size_of_long_document_is_bounded() {
    let of = |entries: usize| {
        let drive = json!({
            "wave_generator": { "semi_major_mm": 20_600.0, "semi_minor_mm": 20_599.0 },
            "teeth": { "count": entries, "radius_mm": 1.0, "width_mm": 15.0 },
            "ring": { "teeth": entries - 2 }
        });
        let base = with(&with(&paper(), "/drive", drive), "/deviations", json!({ "slot_wall_um": vec![0; entries] }));
        json!({
            "study": "search", "base": base, "evaluations": 500,
            "free": { "/drive/teeth/radius_mm": { "min": 0.5, "max": 1.0 } },
            "objectives": [{ "quantity": "slot_wall_mm", "goal": "max" }, { "quantity": "peak_stress_mpa", "goal": "min" }]
        })
    };
    let bytes = |entries| study(&of(entries)).unwrap().answer_bytes();
    // 200 designs with at least eight bytes an entry.
    assert!(bytes(9000) - bytes(1000) >= 200 * 8 * 8000);
    let limits = Limits { max_study_bytes: 8 << 20, ..LIMITS };
    let read = |entries| Study::read(of(entries).to_string().as_bytes(), &limits);
    assert!(read(100).is_ok());
    assert_eq!(read(9000).err().map(|refused| refused.code), Some(NoAnswerCode::TooManyVariants));
}

/// Returns a search for strong fingers, with this base.
fn of_fingers(base: Value) -> Value {
    let free = json!({ "/drive/teeth/width_mm": { "min": 5.0, "max": 40.0 } });
    let objectives = json!([{ "quantity": "finger_safety", "goal": "max" }]);
    json!({ "study": "search", "base": base, "evaluations": 400, "free": free, "objectives": objectives })
}

#[test]
fn strength_of_carrier_limits_safety_of_fingers() {
    let base = with(&paper(), "/parts", json!({ "carrier": { "strength": "c45-n" } }));
    let search = of_fingers(base.clone());
    let limit = |min: f64| with(&search, "/require", json!({ "finger_safety": { "min": min } }));
    let id = |document: &Value| study(document).unwrap().id();
    // The default written out is the same study; another limit is not.
    assert_eq!(id(&search), id(&limit(1.5)));
    assert_ne!(id(&search), id(&limit(0.0)));
    let at_most = |limit: Value| with(&search, "/require", json!({ "finger_safety": limit }));
    assert_eq!(id(&at_most(json!({ "max": 9 }))), id(&at_most(json!({ "min": 1.5, "max": 9 }))));
    let safety = number(&answer(&search)["front"][0]["quantities"]["finger_safety"]);
    assert!(safety >= 1.5, "{safety}");
    // Balls have no fingers, so they are no answer.
    let kinds = json!({ "/drive/teeth/radius_mm": { "min": 4.0, "max": 5.0 } });
    let balls = with(&base, "/drive/teeth", json!({ "shape": "ball", "count": 28 }));
    let balls = with(&with(&of_fingers(with(&balls, "/model", json!({}))), "/free", kinds), "/evaluations", json!(100));
    let found = answer(&balls);
    assert_eq!((&found["front"], &found["scan"]["reasons"][0]["code"]), (&json!([]), &json!("not_calculated")));
    // Without a strength there is no safety.
    assert_eq!(faulty(&of_fingers(paper())), ("/base/parts/carrier/strength".into(), "missing_field".into()));
}
