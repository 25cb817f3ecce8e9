//! Quantities that two fields can set. A contradiction is refused, and values that add up give a finding.

use serde_json::{Value, json};
use toothwave_calculation::convert::converted;
use toothwave_calculation::drawing::preset::Preset;
use toothwave_calculation::drawing::{Drawing, DrawnPart};
use toothwave_calculation::field::FieldCode;
use toothwave_calculation::no_answer::NoAnswer;
use toothwave_calculation::question::{Limits, Question};
use toothwave_calculation::sweep::Sweep;
use toothwave_solver::Never;

const LIMITS: Limits = Limits::new(1_000_000, 1_000_000);

/// Returns case 5.2 under the default model.
fn case_5_2() -> Value {
    let mut document: Value = serde_json::from_str(include_str!("../../examples/paper-5.2.json")).unwrap();
    document.as_object_mut().unwrap().remove("model");
    document
}

/// Returns case 5.2 with these fields.
fn with(changes: &Value) -> Value {
    let mut document = case_5_2();
    for (name, value) in changes.as_object().unwrap() {
        document[name] = value.clone();
    }
    document
}

fn swept(changes: &Value) -> Result<Value, NoAnswer> {
    let answer = Sweep.ask(with(changes).to_string().as_bytes(), &LIMITS, &Never)?;
    Ok(serde_json::to_value(answer).unwrap())
}

fn largest_n(changes: &Value) -> f64 {
    swept(changes).unwrap()["peaks"]["wave_generator"]["force_n"]["value"].as_f64().unwrap()
}

fn codes(answer: &Value) -> Vec<(String, Value)> {
    let findings = answer["findings"].as_array().unwrap().iter();
    findings.map(|finding| (finding["code"].as_str().unwrap().into(), finding["pointers"].clone())).collect()
}

#[test]
fn contradiction_is_refused_at_one_field() {
    let duty = json!([{ "input_torque_nm": 3.0, "input_speed_rpm": 1500.0, "share_of_time": 1.0 }]);
    let pairs = [
        (json!({ "load": { "input_torque_nm": 3.0, "output_torque_nm": 126.0 } }), "/load"),
        (json!({ "load": { "input_torque_nm": 3.0, "duty": duty } }), "/load"),
        (json!({ "load": { "input_speed_rpm": 1500.0, "duty": duty } }), "/load"),
        (json!({ "load": { "duty": duty }, "sweep": { "tolerance": 1e-4 } }), "/sweep/tolerance"),
        (json!({ "sweep": { "samples": 50, "tolerance": 1e-4 } }), "/sweep"),
        (
            json!({ "model": { "clearance": { "ring_um": 10.0 } }, "parts": { "ring": { "clearance_um": 5.0 } } }),
            "/model/clearance/ring_um",
        ),
        (
            json!({ "model": { "clearance": { "carrier_um": 10.0 } }, "parts": { "teeth": { "clearance_um": 5.0 } } }),
            "/model/clearance/carrier_um",
        ),
        (
            json!({ "model": { "clearance": { "wave_generator_um": 1.0 } }, "parts": { "wave_generator": { "clearance_um": 5.0 } } }),
            "/model/clearance/wave_generator_um",
        ),
        (json!({ "model": { "refinements": "none", "ring_teeth_bend": true } }), "/model/ring_teeth_bend"),
        (
            json!({ "model": { "refinements": ["ring_teeth_bend"], "wave_generator_moves": false } }),
            "/model/wave_generator_moves",
        ),
        (
            json!({ "model": { "refinements": ["auto", "corner_contact"], "corner_contact": false } }),
            "/model/corner_contact",
        ),
        (json!({ "model": { "compatibility": "projection", "corner_contact": true } }), "/model/corner_contact"),
    ];
    for (changes, pointer) in pairs {
        let refused = swept(&changes).unwrap_err();
        let error = &refused.errors[0];
        assert_eq!((error.pointer.as_str(), error.code), (pointer, FieldCode::ConflictingFields), "{changes}");
    }
}

#[test]
fn projection_rejects_listed_refinement() {
    let refused =
        swept(&json!({ "model": { "compatibility": "projection", "refinements": ["ring_teeth_bend"] } })).unwrap_err();
    assert_eq!(
        (refused.errors[0].pointer.as_str(), refused.errors[0].code),
        ("/model/refinements", FieldCode::ConflictingFields)
    );
}

#[test]
fn gap_is_sum_of_two_clearances() {
    let without_n = largest_n(&json!({}));
    let of_ring = json!({ "parts": { "ring": { "clearance_um": 10.0 } } });
    let gap_n = largest_n(&of_ring);
    assert!((without_n - 450.7).abs() < 0.05 && (gap_n - 709.9).abs() < 0.05, "{without_n} and {gap_n}");
    // A clearance of all contacts gives each part one half, or the teeth all of it.
    let halves =
        ["wave_generator", "ring", "carrier", "teeth"].map(|part| (part.to_owned(), json!({ "clearance_um": 5.0 })));
    let halves = json!({ "parts": halves.into_iter().collect::<serde_json::Map<_, _>>() });
    let of_teeth = json!({ "parts": { "teeth": { "clearance_um": 10.0 } } });
    assert_eq!(largest_n(&halves).to_bits(), largest_n(&of_teeth).to_bits());
}

#[test]
fn clearances_of_all_parts_load_eccentric_drive() {
    let document: Value = serde_json::from_str(
        r#"{"drive":{"wave_generator":{"kind":"eccentric","radius_mm":30.8,"eccentricity_mm":1.2},
            "teeth":{"shape":"cylinder","count":17,"radius_mm":3,"width_mm":6},"ring":{"teeth":18}},"load":{"input_torque_nm":2}}"#,
    )
    .unwrap();
    let largest_n = |document: &Value| {
        let answer = Sweep.ask(document.to_string().as_bytes(), &LIMITS, &Never).unwrap();
        answer.peaks.wave_generator.force_n.value
    };
    let mut gaps = document.clone();
    for part in ["wave_generator", "teeth", "ring", "carrier"] {
        gaps["parts"][part]["clearance_um"] = json!(100.0);
    }
    let ratio = largest_n(&gaps) / largest_n(&document);
    assert!((4.0..5.0).contains(&ratio), "{ratio}");
}

#[test]
fn deprecated_clearance_means_the_same_in_parts() {
    let old = json!({ "model": { "clearance": { "ring_um": 10.0 } } });
    let new = json!({ "parts": { "ring": { "clearance_um": 10.0 } } });
    assert_eq!(largest_n(&old).to_bits(), largest_n(&new).to_bits());
    let found = codes(&swept(&old).unwrap());
    assert!(found.contains(&("deprecated_field".into(), json!(["/model/clearance"]))), "{found:?}");
    assert!(!codes(&swept(&new).unwrap()).iter().any(|(code, _)| code == "deprecated_field"));
    let drawn = |changes: &Value| {
        let answer = Drawing { part: DrawnPart::Ring, preset: Preset::Document }
            .ask(with(changes).to_string().as_bytes(), &LIMITS, &Never)
            .unwrap();
        serde_json::to_value(answer).unwrap()
    };
    assert_eq!(drawn(&old)["bodies"], drawn(&new)["bodies"]);
    assert!(codes(&drawn(&old)).iter().any(|(code, _)| code == "deprecated_field"));
    // Equal values are no contradiction.
    let both = json!({ "model": old["model"], "parts": new["parts"] });
    assert_eq!(largest_n(&both).to_bits(), largest_n(&new).to_bits());
    // A deprecated gap of zero counts as left out.
    let zero = json!({ "model": { "clearance": { "ring_um": 0.0 } }, "parts": new["parts"] });
    assert_eq!(swept(&zero).unwrap(), swept(&new).unwrap());
}

/// Returns the wind-up without load at each input angle.
fn unloaded_deg(modification: &Value) -> Vec<f64> {
    let found = swept(&json!({ "modification": modification, "sweep": { "wind_up": true } })).unwrap();
    let column = found["wind_up"]["unloaded_wind_up_deg"].as_array().unwrap();
    column.iter().map(|number| number.as_f64().unwrap()).collect()
}

#[test]
fn shifts_of_ring_flank_add_up() {
    let shifted = json!({ "ring_path_shift_um": 10.0, "ring_profile_shift_um": 10.0 });
    let both = unloaded_deg(&shifted);
    for shift in ["ring_path_shift_um", "ring_profile_shift_um"] {
        let one = unloaded_deg(&json!({ shift: 10.0 }));
        assert!(one.iter().zip(&both).all(|(one, both)| one < both), "{shift}");
    }
}

#[test]
fn deprecated_switch_overrides_its_own_refinement() {
    let refinements = |model: Value| {
        swept(&json!({ "model": model, "parts": { "ring": { "clearance_um": 10.0 } } })).unwrap()["model"]["refinements"].clone()
    };
    let all = json!(["ring_teeth_bend", "wave_generator_moves"]);
    assert_eq!(refinements(json!({ "ring_teeth_bend": true })), all);
    assert_eq!(refinements(json!({ "ring_teeth_bend": false })), "none");
    assert_eq!(refinements(json!({ "wave_generator_moves": false })), json!(["ring_teeth_bend"]));
    let corner = json!(["ring_teeth_bend", "wave_generator_moves", "corner_contact"]);
    assert_eq!(refinements(json!({ "corner_contact": true })), corner);
    assert_eq!(refinements(json!({ "refinements": ["auto", "corner_contact"] })), corner);
}

#[test]
fn surface_set_back_twice_has_finding() {
    for (part, modified) in [
        ("wave_generator", "wave_generator_equidistant_um"),
        ("teeth", "tooth_radius_um"),
        ("ring", "ring_equidistant_um"),
        ("carrier", "slot_wall_um"),
    ] {
        let changes = json!({ "parts": { part: { "clearance_um": 4.0 } }, "modification": { modified: 3.0 } });
        let found = codes(&swept(&changes).unwrap());
        let pointers = json!([format!("/parts/{part}/clearance_um"), format!("/modification/{modified}")]);
        assert!(found.contains(&("set_back_twice".into(), pointers)), "{found:?}");
    }
}

/// Converts all numbers to doubles.
fn plain(value: &Value) -> Value {
    match value {
        Value::Number(number) => json!(number.as_f64()),
        Value::Array(items) => items.iter().map(plain).collect(),
        Value::Object(fields) => fields.iter().map(|(name, value)| (name.clone(), plain(value))).collect(),
        other => other.clone(),
    }
}

fn convert(document: &Value) -> Value {
    plain(&serde_json::from_str(&converted(document.to_string().as_bytes()).unwrap()).unwrap())
}

#[test]
fn converted_document_gives_same_forces_undeprecated() {
    let models = [
        json!({ "clearance": { "ring_um": 10.0, "carrier_um": 2.0 } }),
        json!({ "ring_teeth_bend": true, "clearance": { "wave_generator_um": 3.0 } }),
        json!({ "ring_teeth_bend": false, "wave_generator_moves": true }),
        json!({ "wave_generator_moves": false, "clearance": { "ring_um": 10.0 } }),
        json!({ "corner_contact": true }),
    ];
    for model in models {
        let old = with(&json!({ "model": model }));
        let new = convert(&old);
        let answer = |document: &Value| Sweep.ask(document.to_string().as_bytes(), &LIMITS, &Never).unwrap();
        let (old, new) = (answer(&old), answer(&new));
        assert_eq!(new.states, old.states, "{model}");
        let [mut old, mut new] = [old, new].map(|answer| serde_json::to_value(answer).unwrap());
        for answer in [&mut old, &mut new] {
            answer["model"].as_object_mut().unwrap().remove("clearance");
        }
        assert_eq!(new["model"], old["model"], "{model}");
        assert!(!codes(&new).iter().any(|(code, _)| code == "deprecated_field"));
    }
}

/// Otherwise a part that cannot be made would count as rigid, and its strength as unlimited.
#[test]
fn radii_that_leave_no_part_are_refused_where_it_counts() {
    let estimated = json!({ "series_compliance_mm_per_n": "estimated" });
    let swapped = json!({ "inner_radius_mm": 52.5, "outer_radius_mm": 51.5 });
    let mut strong = swapped.clone();
    strong["strength"] = json!("c45-n");
    let thin = json!({ "ring": { "outer_radius_mm": 52.0 } });
    for (changes, code) in [
        (json!({ "model": estimated, "parts": { "carrier": swapped } }), FieldCode::CarrierWithoutWall),
        (json!({ "parts": { "carrier": strong } }), FieldCode::CarrierWithoutWall),
        (json!({ "model": estimated, "parts": thin }), FieldCode::RingWithoutRim),
    ] {
        assert_eq!(swept(&changes).unwrap_err().errors[0].code, code, "{changes}");
    }
    // Forces on rigid supports do not depend on these parts.
    assert!(swept(&json!({ "parts": { "carrier": swapped } })).is_ok());
    assert!(swept(&json!({ "parts": thin })).is_ok());
}

#[test]
fn gaps_that_differ_by_rounding_are_equal() {
    let parts = |ring: f64| json!({ "ring": { "clearance_um": ring }, "teeth": { "clearance_um": 0.1 } });
    let both = |ring: f64| json!({ "model": { "clearance": { "ring_um": 0.8 } }, "parts": parts(ring) });
    assert!(swept(&both(0.7)).is_ok());
    assert_eq!(swept(&both(0.71)).unwrap_err().errors[0].code, FieldCode::ConflictingFields);
}

#[test]
fn document_without_deprecated_fields_stays_unchanged() {
    let document = with(&json!({ "model": { "refinements": "none" }, "parts": { "ring": { "clearance_um": 1.5 } } }));
    assert_eq!(convert(&document), plain(&document));
}

#[test]
fn impossible_tooth_radius_is_one_error() {
    let mut document = case_5_2();
    document["drive"]["teeth"]["radius_mm"] = json!(-5.0);
    let refused = Sweep.ask(document.to_string().as_bytes(), &LIMITS, &Never).unwrap_err();
    let pointers: Vec<_> = refused.errors.iter().map(|error| error.pointer.as_str()).collect();
    assert_eq!(pointers, ["/drive/teeth/radius_mm"]);
}
