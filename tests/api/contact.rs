//! Contact: Palmgren's law, clearances, wind-up, torque capacity, tolerance sweeps.

use serde_json::{Value, json};

use crate::asking::Service;
use crate::designs::{bored, shortest, spelled_out, undercut, with};

/// Returns case 5.1 by virtual work and Palmgren's law, with a gap at the ring's normal.
fn palmgren(ring_um: f64) -> Value {
    let model = json!({
        "compatibility": "virtual_work",
        "stiffness": { "law": "palmgren" }
    });
    let document = with(&with(&spelled_out(), "/model", model), "/sweep", json!({ "samples": 50, "wind_up": true }));
    with(&document, "/parts", json!({ "ring": { "clearance_um": ring_um } }))
}

fn numbers(column: &Value) -> Vec<f64> {
    column.as_array().unwrap().iter().map(|value| value.as_f64().unwrap()).collect()
}

fn codes(answer: &Value) -> Vec<&str> {
    answer["findings"].as_array().unwrap().iter().map(|finding| finding["code"].as_str().unwrap()).collect()
}

#[tokio::test]
async fn ring_gaps_raise_peak_and_unload_teeth() {
    // Known from two independent calculations. The mean needs a sweep finer than 50 intervals, because a tooth on the
    // minor axis counts as unloaded.
    let known = [(0.0, 1395.05, 7.00), (5.0, 1640.15, 5.31), (10.0, 1837.15, 4.60), (20.0, 2169.7, 3.89)];
    for (ring_um, peak_n, loaded) in known {
        let document = with(&palmgren(ring_um), "/sweep", json!({ "samples": 2000, "wind_up": true }));
        let answer = Service::new().post("/v1/sweep", &document).await.found();
        let teeth = numbers(&answer["wind_up"]["loaded_teeth"]);
        let period = &teeth[..teeth.len() - 1];
        let mean = period.iter().sum::<f64>() / period.len() as f64;
        assert!((mean - loaded).abs() < 0.006, "{ring_um} µm: {mean} teeth");

        let answer = Service::new().post("/v1/sweep", &palmgren(ring_um)).await.found();
        let found = answer["peaks"]["wave_generator"]["force_n"]["value"].as_f64().unwrap();
        assert!((found - peak_n).abs() < 0.06, "{ring_um} µm: {found} N");
    }
}

#[tokio::test]
async fn states_with_clearance_mark_loaded_teeth() {
    let answer = Service::new().post("/v1/sweep", &palmgren(10.0)).await.found();
    let states = &answer["states"];
    let forces = numbers(&states["force_ring_n"]);
    let loaded: Vec<_> = states["loaded"].as_array().unwrap().iter().map(|loaded| loaded.as_bool().unwrap()).collect();
    assert_eq!(loaded, forces.iter().map(|force| *force > 0.0).collect::<Vec<_>>());
    assert!(loaded.contains(&false) && loaded.contains(&true));
    let without = Service::new().post("/v1/sweep", &spelled_out()).await.found();
    assert!(without["states"].get("loaded").is_none());
}

#[tokio::test]
async fn reports_wind_up_and_too_stiff_linear_law() {
    let asked = with(&spelled_out(), "/sweep", json!({ "wind_up": true }));
    let linear = Service::new().post("/v1/sweep", &asked).await.found();
    assert_eq!(codes(&linear), ["linear_law_too_stiff"]);
    let finding = &linear["findings"][0];
    let ratio = finding["limit"].as_f64().unwrap() / finding["value"].as_f64().unwrap();
    assert!((4.0..8.0).contains(&ratio), "several times too stiff: {ratio}");
    let palmgren = Service::new().post("/v1/sweep", &palmgren(0.0)).await.found();
    assert!(codes(&palmgren).is_empty());
    let wind_up = |answer: &Value| numbers(&answer["wind_up"]["wind_up_deg"])[0];
    assert!(wind_up(&palmgren) > 4.0 * wind_up(&linear));
    let unasked = Service::new().post("/v1/sweep", &spelled_out()).await.found();
    assert!(unasked.get("wind_up").is_none() && codes(&unasked).is_empty());
}

#[tokio::test]
async fn linear_stiffness_is_torque_over_rotation() {
    let asked = with(&spelled_out(), "/sweep", json!({ "wind_up": true }));
    let answer = Service::new().post("/v1/sweep", &asked).await.found();
    let wind_up_deg = numbers(&answer["wind_up"]["wind_up_deg"]);
    for (wind_up_deg, found) in wind_up_deg.iter().zip(numbers(&answer["wind_up"]["torsional_stiffness_nm_per_rad"])) {
        let secant = 20.0 * 14.0 / (wind_up_deg.to_radians() / 14.0);
        assert!((found - secant).abs() < 1e-12 * secant);
    }
    let range = wind_up_deg.iter().fold(0.0_f64, |most, one| most.max(*one))
        - wind_up_deg.iter().fold(f64::INFINITY, |least, one| least.min(*one));
    let error_deg = answer["wind_up"]["transmission_error_peak_to_peak_deg"].as_f64().unwrap();
    assert!((error_deg - range / 14.0).abs() < 1e-15);
}

#[tokio::test]
async fn limiting_contact_bears_allowable_stress_at_capacity() {
    for base in [spelled_out(), palmgren(10.0)] {
        let asked = with(&base, "/load", json!({ "input_torque_nm": 20.0, "allowable_stress_mpa": 1500.0 }));
        let capacity = Service::new().post("/v1/sweep", &asked).await.found()["torque_capacity"].clone();
        let torque = capacity["input_torque_nm"].as_f64().unwrap();
        assert!((capacity["output_torque_nm"].as_f64().unwrap() - 14.0 * torque).abs() < 1e-12 * torque * 14.0);
        let at_capacity = with(&base, "/load", json!({ "input_torque_nm": torque }));
        let peaks = Service::new().post("/v1/sweep", &at_capacity).await.found()["peaks"].clone();
        let limiting = capacity["limited_by"].as_str().unwrap();
        for contact in ["wave_generator", "ring", "carrier"] {
            let stress = peaks[contact]["stress_mpa"]["value"].as_f64().unwrap();
            assert!(stress <= 1500.0 * (1.0 + 1e-11), "{contact}: {stress}");
            assert!(contact != limiting || stress > 1500.0 * (1.0 - 1e-11), "{contact}: {stress}");
        }
    }
}

/// Teeth are soft. The wave generator moves past them before a contact reaches the higher stress.
#[tokio::test]
async fn reports_capacity_that_no_contact_limits() {
    let soft = json!({ "youngs_modulus_gpa": 3.5, "poissons_ratio": 0.4 });
    let service = Service::new();
    let mut torques_nm = Vec::new();
    for (allowable_stress_mpa, turns_past_teeth) in [(100.0, None), (400.0, Some(&json!(true)))] {
        let asked = json!({
            "drive": {
                "wave_generator": { "semi_major_mm": 50.7, "semi_minor_mm": 49.3 },
                "teeth": { "count": 80, "installed": 40, "radius_mm": 1.5, "width_mm": 15.0 },
                "ring": { "teeth": 78 }
            },
            "materials": { "wave_generator": soft, "teeth": soft, "ring": soft, "carrier": soft },
            "load": { "input_torque_nm": 0.002, "allowable_stress_mpa": allowable_stress_mpa },
            "parts": { "ring": { "clearance_um": 10.0 } },
            "sweep": { "samples": 20 }
        });
        let capacity = service.post("/v1/sweep", &asked).await.found()["torque_capacity"].clone();
        assert_eq!(capacity.get("turns_past_teeth"), turns_past_teeth, "{capacity}");
        torques_nm.push(capacity["input_torque_nm"].as_f64().unwrap());
    }
    assert!(torques_nm[0] < torques_nm[1], "{torques_nm:?}");
}

/// Johnson's law ends at some input angles before a contact reaches its stress, but above the capacity of others.
#[tokio::test]
async fn reports_capacity_within_johnsons_law() {
    let material =
        |gpa: f64, poissons_ratio: f64| json!({ "youngs_modulus_gpa": gpa, "poissons_ratio": poissons_ratio });
    let soft = |load: Value, sweep: &Value| {
        json!({
            "drive": {
                "wave_generator": { "kind": "eccentric", "radius_mm": 16.0, "eccentricity_mm": 0.424 },
                "teeth": { "count": 22, "radius_mm": 0.474, "width_mm": 1.93 },
                "ring": { "teeth": 21 }
            },
            "load": load,
            "materials": {
                "wave_generator": material(300.0, 0.225), "teeth": material(3.0, 0.274), "ring": material(3.0, 0.434)
            },
            "sweep": sweep
        })
    };
    let service = Service::new();
    for (sweep, tolerance) in [(json!({ "samples": 7 }), 1e-12), (json!({ "tolerance": 1e-6 }), 2e-6)] {
        let asked = soft(json!({ "input_torque_nm": 0.01, "allowable_stress_mpa": 541.5 }), &sweep);
        let capacity = service.post("/v1/sweep", &asked).await.found()["torque_capacity"].clone();
        assert_eq!(capacity["limited_by"], "wave_generator");
        let torque_nm = capacity["input_torque_nm"].as_f64().unwrap();
        let there = service.post("/v1/sweep", &soft(json!({ "input_torque_nm": torque_nm }), &sweep)).await.found();
        let stress_mpa = there["peaks"]["wave_generator"]["stress_mpa"]["value"].as_f64().unwrap();
        assert!((stress_mpa / 541.5 - 1.0).abs() < tolerance, "{torque_nm} N·m, {stress_mpa} MPa");
    }
    // If the law ends before a contact reaches its stress, the refusal names the stress and the torque at that end.
    let sweep = json!({ "samples": 7 });
    let beyond = soft(json!({ "input_torque_nm": 0.01, "allowable_stress_mpa": 700.0 }), &sweep);
    let problem = service.post("/v1/sweep", &beyond).await.refused(422, "impossible_design");
    let detail = problem["detail"].as_str().unwrap();
    assert!(detail.starts_with("no torque capacity can be told"), "{detail}");
    assert!(detail.contains("`load.allowable_stress_mpa`"), "{detail}");
    let (_, end) = detail.split_once("an input torque of ").unwrap();
    let end_nm: f64 = end.split_once(' ').unwrap().0.parse().unwrap();
    let load = |share: f64| soft(json!({ "input_torque_nm": share * end_nm }), &sweep);
    service.post("/v1/sweep", &load(1.0 - 1e-9)).await.found();
    service.post("/v1/sweep", &load(1.0 + 1e-9)).await.refused(422, "impossible_design");
}

#[tokio::test]
async fn rejects_clearance_that_projection_turns_into_load() {
    let more_ring_teeth = [("/drive/ring/teeth", json!(30)), ("/drive/teeth/radius_mm", json!(4.0))]
        .into_iter()
        .fold(spelled_out(), |document, (pointer, value)| with(&document, pointer, value));
    let gap = |document: &Value, compatibility: &str| {
        let document = with(document, "/model", json!({ "compatibility": compatibility }));
        with(&document, "/parts", json!({ "carrier": { "clearance_um": 5.0 } }))
    };
    let refused = Service::new().post("/v1/sweep", &gap(&more_ring_teeth, "projection")).await;
    let problem = refused.refused(422, "impossible_design");
    assert_eq!(problem["errors"][0]["pointer"], "/parts/carrier/clearance_um");
    assert_eq!(problem["errors"][0]["code"], "clearance_not_monotone");
    // Projection weighs the gap positively with fewer ring teeth, and virtual work always does.
    Service::new().post("/v1/sweep", &gap(&spelled_out(), "projection")).await.found();
    Service::new().post("/v1/sweep", &gap(&more_ring_teeth, "virtual_work")).await.found();
}

#[tokio::test]
async fn palmgrens_law_beyond_steel_is_a_finding() {
    let brass = with(&palmgren(0.0), "/materials/carrier", json!({ "youngs_modulus_gpa": 100.0 }));
    let answer = Service::new().post("/v1/sweep", &brass).await.found();
    assert_eq!(codes(&answer), ["palmgren_beyond_steel"]);
    assert!(answer["findings"][0]["pointers"].as_array().unwrap().contains(&json!("/materials/carrier")));
}

#[tokio::test]
async fn samples_and_tolerance_exclude_each_other() {
    let both = with(&spelled_out(), "/sweep", json!({ "samples": 50, "tolerance": 1e-6 }));
    let (at, code, _) = Service::new().post("/v1/sweep", &both).await.faulty_field();
    assert_eq!((at.as_str(), code.as_str()), ("/sweep", "conflicting_fields"));
}

#[tokio::test]
async fn tolerance_sweep_has_both_sides_of_jump() {
    let document: Value = serde_json::from_str(include_str!("../../examples/paper-5.2.json")).unwrap();
    let answer =
        Service::new().post("/v1/sweep", &with(&document, "/sweep", json!({ "tolerance": 1e-9 }))).await.found();
    // The peak is just before a tooth enters. tests/reference/extremes.json has 40 digits of it.
    let peak = &answer["peaks"]["wave_generator"]["force_n"];
    assert!((peak["value"].as_f64().unwrap() - 525.554_176_523).abs() < 1e-6, "{peak}");
    let entry_deg = peak["input_angle_deg"].as_f64().unwrap();
    assert!((entry_deg - 1.428_103_736).abs() < 1e-8, "{peak}");
    let angles = numbers(&answer["states"]["input_angle_deg"]);
    let at_entry = angles.iter().filter(|angle| **angle == entry_deg).count();
    assert_eq!(at_entry, 4 + 5, "without the tooth that enters, and with it");
}

#[tokio::test]
async fn tolerance_with_too_many_states_is_refused() {
    let limits = crate::asking::LIMITS;
    let few = crate::asking::Limits { max_states: 100, ..limits };
    let fine = with(&spelled_out(), "/sweep", json!({ "tolerance": 1e-9 }));
    let problem = Service::within(few).post("/v1/sweep", &fine).await.refused(422, "too_many_states");
    assert_eq!(problem["errors"][0]["pointer"], "/sweep/tolerance");
    assert_eq!(problem["errors"][0]["limit"], 100.0);
}

#[tokio::test]
async fn sweep_reports_model_error_and_its_range() {
    let service = Service::new();
    let model_error = async |document: &Value| service.post("/v1/sweep", document).await.found()["model_error"].clone();
    let at_both_ends = json!({ "carrier": { "fingers": "held_at_both_ends" } });
    let stiff = model_error(&with(&shortest(), "/parts", at_both_ends)).await;
    assert_eq!((&stiff["is_within"], &stiff["beyond"]), (&json!(true), &json!([])));
    assert_eq!(stiff["measured"]["force"], json!({ "low": -0.01, "high": 0.0 }));
    let case = json!({
        "compatibility": "virtual_work",
        "law": "johnson",
        "ring_teeth_bend": false,
        "wave_generator_moves": false,
        "corner_contact": false,
        "has_gaps": false,
        "has_pointed_tips": false
    });
    assert_eq!(stiff["measured"]["case"], case);
    // The paper's model has a larger error, with a gap a far larger one.
    let paper = model_error(&spelled_out()).await;
    assert_eq!(paper["measured"]["force"], json!({ "low": 0.01, "high": 0.08 }));
    let gap = model_error(&with(&spelled_out(), "/parts", json!({ "ring": { "clearance_um": 12.0 } }))).await;
    assert_eq!(gap["measured"]["case"]["has_gaps"], true);
    assert!(gap["measured"]["force"]["high"].as_f64().unwrap() > 0.5);
    // Laws other than Johnson's were measured on three drives only.
    assert_eq!((&paper["is_within"], &paper["beyond"]), (&json!(false), &json!(["law"])));
    assert_eq!((&gap["is_within"], &gap["beyond"]), (&json!(false), &json!(["law", "gap"])));
    let pointed = model_error(&undercut()).await;
    assert_eq!(pointed["measured"]["case"]["has_pointed_tips"], true);
    assert_eq!(pointed["measured"]["case"]["ring_teeth_bend"], true);
    assert_eq!(pointed["measured"]["force"], json!({ "low": -0.01, "high": 0.0 }));
    // The carrier's fingers are 1.5 mm high, and the elastic bodies had none.
    assert_eq!(pointed["beyond"], json!(["entry_under_load", "soft_backing"]));
    assert_eq!(pointed["held"]["case"], "slender_fingers");
    // If slots run into each other, there is no finger to estimate.
    let thick = with(&shortest(), "/drive/teeth/radius_mm", json!(6.7));
    let open = with(&thick, "/parts", json!({ "carrier": { "inner_radius_mm": 58.5, "outer_radius_mm": 61.0 } }));
    assert_eq!(model_error(&open).await["beyond"], json!(["soft_backing"]));
    assert_eq!(
        (&stiff["held"]["case"], &stiff["held"]["wind_up"]),
        (&json!("housed"), &json!({ "low": -0.25, "high": -0.2 }))
    );
    let fixed =
        model_error(&with(&shortest(), "/model", json!({ "stiffness": crate::designs::fixed(4e5, 4e5, 4e5) }))).await;
    assert!(fixed.get("measured").is_none() && fixed["beyond"] == json!(["law"]));
    let balls =
        model_error(&with(&shortest(), "/drive/teeth", json!({ "shape": "ball", "count": 28, "radius_mm": 5.0 })))
            .await;
    assert_eq!(balls["beyond"][0], "law");
    assert_eq!(balls["beyond"][1], "tooth_shape");
    assert_eq!(stiff["range"]["lobes"], 2);
}

/// These defaults hold under every contact law.
#[tokio::test]
async fn default_refinements_follow_from_tips_and_gaps() {
    let service = Service::new();
    let solved = async |drive: &Value, model: Value, ring_um: f64| {
        let document = with(&with(drive, "/model", model), "/parts", json!({ "ring": { "clearance_um": ring_um } }));
        let answer = service.post("/v1/sweep", &document).await.found();
        (answer["states"].clone(), answer["model"]["refinements"].clone())
    };
    let listed = |refinements: Value| json!({ "stiffness": { "law": "johnson" }, "refinements": refinements });
    let (pointed, natural) = (undercut(), shortest());
    let (bend, both) = (json!(["ring_teeth_bend"]), json!(["ring_teeth_bend", "wave_generator_moves"]));
    for model in [json!({}), json!({ "stiffness": { "law": "johnson" } })] {
        assert_eq!(solved(&pointed, model.clone(), 0.0).await, solved(&pointed, listed(bend.clone()), 0.0).await);
        assert_eq!(solved(&pointed, model.clone(), 10.0).await, solved(&pointed, listed(both.clone()), 10.0).await);
        assert_eq!(solved(&natural, model.clone(), 0.0).await, solved(&natural, listed(json!("none")), 0.0).await);
        assert_eq!(solved(&natural, model, 10.0).await, solved(&natural, listed(json!("none")), 10.0).await);
    }
    assert_ne!(solved(&pointed, json!({}), 0.0).await.0, solved(&pointed, listed(json!("none")), 0.0).await.0);
    let moves = json!(["wave_generator_moves"]);
    assert_ne!(solved(&natural, listed(moves), 10.0).await.0, solved(&natural, json!({}), 10.0).await.0);
    // The default refinement's refusal says how to turn it off.
    let wide =
        |choice: Value| with(&with(&bored(), "/model", choice), "/parts", json!({ "ring": { "clearance_um": 300.0 } }));
    let problem = service.post("/v1/sweep", &wide(json!({}))).await.refused(422, "impossible_design");
    let advice = "or remove `wave_generator_moves` from `model.refinements`";
    assert!(problem["detail"].as_str().unwrap().ends_with(advice), "{problem}");
    service.post("/v1/sweep", &wide(json!({ "refinements": ["ring_teeth_bend"] }))).await.found();
    let refused = json!({ "compatibility": "projection", "refinements": ["wave_generator_moves"] });
    let problem = service.post("/v1/sweep", &with(&pointed, "/model", refused)).await.refused(422, "impossible_design");
    assert_eq!(problem["errors"][0]["pointer"], "/model/refinements");
}

/// Loads at tip corners start from zero. Teeth are listed from the valley, without a stress at the ring.
#[tokio::test]
async fn teeth_meet_tip_corners_if_chosen() {
    let service = Service::new();
    let sweep = async |model: Value| service.post("/v1/sweep", &with(&undercut(), "/model", model)).await.found();
    let (rigid, pressed) = (sweep(json!({})).await, sweep(json!({ "corner_contact": true })).await);
    assert_eq!((&rigid["enters_under_load"], &pressed["enters_under_load"]), (&json!(true), &json!(false)));
    assert_eq!(rigid["coincidence_degree"], pressed["coincidence_degree"]);
    let peak_n = |sweep: &Value| sweep["peaks"]["wave_generator"]["force_n"]["value"].as_f64().unwrap();
    assert!(peak_n(&pressed) < 0.95 * peak_n(&rigid), "{} N, rigid {} N", peak_n(&pressed), peak_n(&rigid));
    let states = &pressed["states"];
    let column = |name: &str| states[name].as_array().unwrap().iter().map(|value| value.as_f64().unwrap()).collect();
    let (position_deg, force_n, stress_mpa): (Vec<_>, Vec<_>, Vec<_>) =
        (column("position_deg"), column("force_ring_n"), column("stress_ring_mpa"));
    let end_deg = rigid["states"]["position_deg"].as_array().unwrap().iter().map(|at| at.as_f64().unwrap());
    let end_deg = end_deg.fold(0.0, f64::max);
    let before: Vec<_> = (0..force_n.len()).filter(|&at| position_deg[at] > end_deg + 0.5).collect();
    assert!(before.iter().any(|&at| force_n[at] > 0.0) && before.iter().any(|&at| force_n[at] == 0.0));
    assert!(before.iter().all(|&at| stress_mpa[at] == 0.0));
    assert_eq!(states["loaded"].as_array().unwrap().len(), force_n.len());
    assert_eq!(sweep(json!({ "corner_contact": false })).await["states"], rigid["states"]);
    let refused = json!({ "compatibility": "projection", "corner_contact": true });
    let problem =
        service.post("/v1/sweep", &with(&undercut(), "/model", refused)).await.refused(422, "invalid_document");
    let error = &problem["errors"][0];
    assert_eq!((&error["pointer"], &error["code"]), (&json!("/model/corner_contact"), &json!("conflicting_fields")));
}

/// Forces, stresses and cache keys follow the designer's carrier.
#[tokio::test]
async fn document_carrier_bears_flat_sided_teeth_only() {
    let flats =
        json!({ "shape": "flat_sided", "count": 28, "radius_mm": 5.0, "width_mm": 15.0, "flat_length_mm": 4.0 });
    let flat_sided = with(&shortest(), "/drive/teeth", flats);
    let service = Service::new();
    let carrier = |document: &Value, radii: Value| with(document, "/parts", json!({ "carrier": radii }));
    let narrow = carrier(&flat_sided, json!({ "inner_radius_mm": 60.5, "outer_radius_mm": 62.5 }));
    let stress_mpa = async |document: &Value| {
        let answer = service.post("/v1/sweep", document).await.found();
        answer["peaks"]["carrier"]["stress_mpa"]["value"].as_f64().unwrap()
    };
    let (by_default, given) = (stress_mpa(&flat_sided).await, stress_mpa(&narrow).await);
    assert!(given > 1.5 * by_default, "{given} and {by_default} MPa");
    let sweep_tag = async |document: &Value| service.post("/v1/sweep", document).await.etag().to_owned();
    assert_ne!(sweep_tag(&flat_sided).await, sweep_tag(&narrow).await);

    let within_cam = json!({ "inner_radius_mm": 57.0 });
    for path in ["/v1/sweep", "/v1/accuracy"] {
        let problem =
            service.post(path, &carrier(&flat_sided, within_cam.clone())).await.refused(422, "impossible_design");
        assert_eq!(problem["errors"][0]["pointer"], "/parts/carrier/inner_radius_mm");
        assert_eq!(problem["errors"][0]["code"], "carrier_meets_cam");
        service.post(path, &carrier(&shortest(), within_cam.clone())).await.found();
    }
}
