//! Design documents as JSON, and their cache keys.

use std::cell::Cell;

use proptest::prelude::*;
use serde_json::{Value, json};
use toothwave_calculation::accuracy::Accuracy;
use toothwave_calculation::coincidence_degree::CoincidenceDegree;
use toothwave_calculation::design::Design;
use toothwave_calculation::drawing::preset::Preset;
use toothwave_calculation::drawing::{Drawing, DrawnPart};
use toothwave_calculation::field::FieldCode;
use toothwave_calculation::forms::Format;
use toothwave_calculation::geometry::Geometry;
use toothwave_calculation::key::Key;
use toothwave_calculation::no_answer::{NoAnswer, NoAnswerCode};
use toothwave_calculation::question::{Limits, Question, Stop};
use toothwave_calculation::sweep::Sweep;
use toothwave_solver::gaps::{Runout, TipRelief};
use toothwave_solver::{Deviations, Modification};

use crate::schema::{Chance, Schemas, leaves, objects};

pub(crate) fn read(document: &Value) -> Result<Design, NoAnswer> {
    Design::read(document.to_string().as_bytes())
}

/// Short sweeps are solved on the threads that serve requests.
#[test]
fn short_sweep_has_no_bending_ring_teeth() {
    let mut document = json!({
        "drive": {
            "wave_generator": { "semi_major_mm": 58, "semi_minor_mm": 56 },
            "teeth": { "count": 28, "radius_mm": 5, "width_mm": 15 },
            "ring": { "teeth": 26 }
        },
        "load": { "input_torque_nm": 20 },
        "model": { "refinements": "none" }
    });
    let limits = Limits::new(1_000_000, 1_000_000);
    let is_short = |document: &Value| {
        let checked = Sweep.check(&read(document).expect("a document"), &limits).expect("a drive");
        Sweep::is_short(&checked)
    };
    assert!(is_short(&document));
    document["model"]["refinements"] = json!(["ring_teeth_bend"]);
    assert!(!is_short(&document));
    document["model"] = json!({ "refinements": ["corner_contact"] });
    assert!(is_short(&document), "natural tips have no corner");
}

/// A stop flag that is set after so many reads.
struct StopsAfter {
    asked: Cell<u32>,
    times: u32,
}

impl Stop for StopsAfter {
    fn stopped(&self) -> bool {
        self.asked.set(self.asked.get() + 1);
        self.asked.get() > self.times
    }
}

#[test]
fn sweep_stops_after_its_solve_too() {
    let document = json!({
        "drive": {
            "wave_generator": { "semi_major_mm": 58, "semi_minor_mm": 56 },
            "teeth": { "count": 28, "radius_mm": 5, "width_mm": 15 },
            "ring": { "teeth": 26 }
        },
        "load": { "input_torque_nm": 20 }
    });
    let limits = Limits::new(1_000_000, 1_000_000);
    let checked = Sweep.check(&read(&document).expect("a document"), &limits).expect("a drive");
    let never = StopsAfter { asked: Cell::new(0), times: u32::MAX };
    checked.solve(&never).expect("a sweep");
    let of_solve = never.asked.get();
    Sweep::answer(&checked, &never).expect("an answer");
    let of_answer = never.asked.get() - of_solve;
    assert!(of_answer >= of_solve + 4, "{of_answer} and {of_solve}");
    for times in of_solve..of_answer {
        let stopped = Sweep::answer(&checked, &StopsAfter { asked: Cell::new(0), times });
        assert_eq!(stopped.err().map(|error| error.code), Some(NoAnswerCode::Stopped), "after {times}");
    }
}

/// Concatenates the keys of all questions.
pub(crate) fn keys(design: &Design) -> Vec<Key> {
    let form = Format::Json;
    let mut keys = vec![
        Geometry.key(design, &form),
        CoincidenceDegree.key(design, &form),
        Sweep.key(design, &form),
        Accuracy.key(design, &form),
    ];
    keys.extend(DrawnPart::ALL.map(|part| Drawing { part, preset: Preset::Document }.key(design, &form)));
    keys
}

fn with(document: &Value, pointer: &str, value: Value) -> Value {
    let mut document = document.clone();
    *document.pointer_mut(pointer).unwrap() = value;
    document
}

/// Returns another value of the same type, if one reads differently.
fn other(value: &Value) -> Option<Value> {
    match value {
        Value::Number(number) => {
            let number = number.as_f64().unwrap();
            let other = if number.fract() == 0.0 { number + 1.0 } else { number * 0.75 };
            // Above 2^53, adding one gives the same double.
            (other.total_cmp(&number).is_ne()).then(|| json!(other))
        }
        Value::Bool(value) => Some(json!(!value)),
        _ => None,
    }
}

/// Asserts that a document is refused for one fault at this place.
fn assert_fault(document: &Value, pointer: &str, code: FieldCode) {
    let refused = read(document).unwrap_err();
    assert_eq!(refused.code, NoAnswerCode::InvalidDocument, "{document}");
    assert_eq!(refused.errors.len(), 1);
    assert_eq!((refused.errors[0].pointer.as_str(), refused.errors[0].code), (pointer, code), "{document}: {refused}");
}

proptest! {
    #[test]
    fn document_survives_json_round_trip(seed: u64) {
        let document = Schemas::new().document(&mut Chance::new(seed));
        let design = read(&document).unwrap_or_else(|refused| panic!("{refused}: {document}"));
        let written = serde_json::to_string(&design).unwrap();
        prop_assert_eq!(Design::read(written.as_bytes()), Ok(design), "{}", written);
    }

    /// Each question reads a part of the document. Together they read all of it.
    #[test]
    fn each_changed_number_changes_a_key(seed: u64) {
        let document = Schemas::new().document(&mut Chance::new(seed));
        let before = keys(&read(&document).unwrap());
        for pointer in leaves(&document, "") {
            if let Some(other) = other(document.pointer(&pointer).unwrap()) {
                let changed = with(&document, &pointer, other);
                prop_assert_ne!(&keys(&read(&changed).unwrap()), &before, "{}: {}", pointer, changed);
            }
        }
    }

    #[test]
    fn different_documents_have_different_keys(one: u64, other: u64) {
        let document = |seed| read(&Schemas::new().document(&mut Chance::new(seed))).unwrap();
        let (one, other) = (document(one), document(other));
        prop_assert_eq!(one == other, keys(&one) == keys(&other));
    }

    #[test]
    fn structural_fault_is_reported_at_its_place(seed: u64) {
        let document = Schemas::new().document(&mut Chance::new(seed));
        // An empty list means no refinement.
        for pointer in leaves(&document, "").into_iter().filter(|pointer| pointer != "/model/refinements") {
            assert_fault(&with(&document, &pointer, json!([])), &pointer, FieldCode::WrongType);
        }
        for pointer in objects(&document, "") {
            let mut unknown = document.clone();
            unknown.pointer_mut(&pointer).unwrap()["colour"] = json!(1);
            assert_fault(&unknown, &format!("{pointer}/colour"), FieldCode::UnknownField);
            // One word may stand in place of the compliances.
            let takes_words = ["/model/series_compliance_mm_per_n", "/parts/carrier/strength"];
            let is_word_known = takes_words.contains(&pointer.as_str());
            let code = if is_word_known { FieldCode::UnknownChoice } else { FieldCode::WrongType };
            assert_fault(&with(&document, &pointer, json!("text")), &pointer, code);
            assert_fault(&with(&document, &pointer, json!([1])), &pointer, FieldCode::WrongType);
        }
    }
}

fn short() -> Value {
    json!({ "drive": {
        "wave_generator": { "semi_major_mm": 58.0, "semi_minor_mm": 56.0 },
        "teeth": { "count": 28, "radius_mm": 5.0, "width_mm": 15.0 }, "ring": { "teeth": 26 }
    }, "load": { "input_torque_nm": 20.0 } })
}

#[test]
fn reports_fault_of_kind_apart_from_its_fields() {
    let fault = |wave_generator: Value, pointer: &str, code| {
        assert_fault(
            &with(&short(), "/drive/wave_generator", wave_generator),
            &format!("/drive/wave_generator{pointer}"),
            code,
        );
    };
    fault(json!({ "kind": "round", "semi_major_mm": 58.0 }), "/kind", FieldCode::UnknownChoice);
    fault(json!({ "kind": 1 }), "/kind", FieldCode::WrongType);
    fault(json!({ "kind": null, "semi_major_mm": 58.0 }), "/kind", FieldCode::WrongType);
    fault(json!({ "kind": "eccentric", "radius_mm": 30.8 }), "/eccentricity_mm", FieldCode::MissingField);
    fault(json!({ "kind": "eccentric", "semi_major_mm": 30.8 }), "/semi_major_mm", FieldCode::UnknownField);
    fault(json!({ "radius_mm": 30.8 }), "/radius_mm", FieldCode::UnknownField);
    let refused = read(&with(&short(), "/drive/wave_generator", json!({ "lobes": 2 }))).unwrap_err();
    assert!(refused.to_string().ends_with("Or add the `kind` that has it"), "{refused}");
    fault(json!({ "kind": "harmonic", "lobes": 2.5 }), "/lobes", FieldCode::WrongType);
    fault(json!("ellipse"), "", FieldCode::WrongType);
    let twice =
        short().to_string().replace(r#""semi_major_mm":"#, r#""kind":"ellipse","kind":"ellipse","semi_major_mm":"#);
    let refused = Design::read(twice.as_bytes()).unwrap_err();
    assert_eq!(refused.errors[0].code, FieldCode::DuplicateField);
    assert_eq!(refused.errors[0].pointer, "/drive/wave_generator/kind");
}

#[test]
fn word_of_kind_may_follow_its_fields() {
    let behind = short().to_string().replace(r#""semi_minor_mm":56.0"#, r#""semi_minor_mm":56.0,"kind":"ellipse""#);
    assert_eq!(Design::read(behind.as_bytes()), read(&short()));
}

#[test]
fn object_in_place_of_word_is_refused() {
    let mut document = short();
    document["model"] = json!({ "compatibility": {} });
    assert_fault(&document, "/model/compatibility", FieldCode::WrongType);
}

#[test]
fn whole_numbers_are_written_without_point() {
    let written = |teeth: Value| {
        let design = read(&with(&short(), "/drive/ring/teeth", teeth)).unwrap();
        serde_json::to_value(design).unwrap()["drive"]["ring"]["teeth"].to_string()
    };
    assert_eq!((written(json!(26.0)), written(json!(1e300))), ("26".into(), "1e+300".into()));
}

#[test]
fn omitted_value_has_key_of_its_default() {
    let short = short();
    let mut long = short.clone();
    long["drive"]["wave_generator"]["kind"] = json!("ellipse");
    long["drive"]["teeth"]["shape"] = json!("cylinder");
    long["drive"]["teeth"]["installed"] = json!(28.0);
    long["drive"]["ring"]["tip_radius_mm"] = json!(null);
    long["materials"] = json!({ "teeth": { "poissons_ratio": 0.3 } });
    long["model"] = json!({ "compatibility": "virtual_work" });
    long["sweep"] = json!({ "samples": 50, "wind_up": false });
    long["modification"] = json!({ "slot_wall_um": 0.0, "tooth_radius_um": -0.0 });
    long["parts"] = json!({ "ring": { "clearance_um": -0.0 } });
    long["assembly"] = json!({ "input_angle_deg": -0.0 });
    assert_eq!(keys(&read(&short).unwrap()), keys(&read(&long).unwrap()));
    long["model"] = json!({ "stiffness": { "law": "johnson", "depth_mm": { "ring": 5.0 } }, "refinements": "none" });
    assert_eq!(keys(&read(&short).unwrap()), keys(&read(&long).unwrap()));
    long["model"]["refinements"] = json!(["ring_teeth_bend"]);
    assert_ne!(keys(&read(&short).unwrap()), keys(&read(&long).unwrap()));
}

#[test]
fn each_modification_reaches_the_solver() {
    let mut document = short();
    document["model"] = json!({ "compatibility": "virtual_work" });
    document["modification"] = json!({
        "ring_equidistant_um": 1.0, "ring_path_shift_um": 2.0, "ring_profile_shift_um": 3.0, "ring_rotation_arcsec": 4.0,
        "wave_generator_equidistant_um": 5.0, "slot_wall_um": 6.0, "carrier_rotation_arcsec": 7.0, "tooth_radius_um": 8.0,
        "ring_tip_relief": { "amount_um": 9.0, "start_deg": 10.0, "power": 11.0 }
    });
    let expected = Modification {
        ring_equidistant_um: 1.0,
        ring_path_shift_um: 2.0,
        ring_profile_shift_um: 3.0,
        ring_rotation_arcsec: 4.0,
        wave_generator_equidistant_um: 5.0,
        slot_wall_um: 6.0,
        carrier_rotation_arcsec: 7.0,
        tooth_radius_um: 8.0,
        ring_tip_relief: Some(TipRelief { amount_um: 9.0, start_deg: 10.0, power: 11.0 }),
    };
    assert_eq!(read(&document).unwrap().load_parameters(false).unwrap().modification, expected);
}

#[test]
fn each_deviation_reaches_the_solver() {
    let mut document = short();
    document["deviations"] = json!({
        "tooth_radius_um": [1.0, 2.0], "slot_angle_arcsec": [3.0], "slot_wall_um": [4.0], "ring_space_um": [5.0],
        "ring_space_angle_arcsec": [6.0], "wave_generator_lobe_um": [7.0, 8.0],
        "wave_generator_runout": { "amount_um": 9.0, "angle_deg": 10.0 }, "ring_runout": { "amount_um": 11.0 },
        "carrier_runout": { "angle_deg": 12.0 }
    });
    let runout = |amount_um, angle_deg| Runout { amount_um, angle_deg };
    let expected = Deviations {
        tooth_radius_um: vec![1.0, 2.0],
        slot_angle_arcsec: vec![3.0],
        slot_wall_um: vec![4.0],
        ring_space_um: vec![5.0],
        ring_space_angle_arcsec: vec![6.0],
        wave_generator_lobe_um: vec![7.0, 8.0],
        wave_generator_runout: runout(9.0, 10.0),
        ring_runout: runout(11.0, 0.0),
        carrier_runout: runout(0.0, 12.0),
    };
    let design = read(&document).unwrap();
    assert_eq!(design.deviations, expected);
    // A written document reads back as itself.
    assert_eq!(read(&serde_json::to_value(&design).unwrap()).unwrap(), design);
}
