//! A default means the same whether it is written out or left out.

use proptest::prelude::*;
use serde_json::{Value, json};
use toothwave_calculation::accuracy::{Accuracy, AccuracyAnswer};
use toothwave_calculation::design::Design;
use toothwave_calculation::forms::Format;
use toothwave_calculation::key::Key;
use toothwave_calculation::question::{Limits, Question};
use toothwave_calculation::sweep::Sweep;
use toothwave_solver::Never;

use crate::documents::{keys, read};
use crate::schema::{Chance, Schemas, leaves};

const LIMITS: Limits = Limits::new(1_000_000, 1_000_000);

const EXAMPLES: [&str; 9] = [
    include_str!("../../examples/balls.json"),
    include_str!("../../examples/eccentric-roller.json"),
    include_str!("../../examples/flat-sided.json"),
    include_str!("../../examples/harmonic-path.json"),
    include_str!("../../examples/harmonic-three-lobes.json"),
    include_str!("../../examples/paper-5.1.json"),
    include_str!("../../examples/paper-5.2-bored.json"),
    include_str!("../../examples/paper-5.2.json"),
    include_str!("../../examples/ring-with-more-teeth.json"),
];

fn examples() -> Vec<Value> {
    EXAMPLES.iter().map(|text| serde_json::from_str(text).unwrap()).collect()
}

/// Sets a value and creates missing parent objects.
fn put(document: &mut Value, pointer: &str, value: Value) {
    let mut at = document;
    for name in pointer.split('/').skip(1) {
        at = match at {
            Value::Array(items) => &mut items[name.parse::<usize>().unwrap()],
            object => &mut object[name],
        };
    }
    *at = value;
}

/// Lists every omitted default: fixed ones, and those that follow from other fields.
fn defaults(document: &Value) -> Vec<(String, Value)> {
    let design = read(document).unwrap();
    let mut written = serde_json::to_value(&design).unwrap();
    put(
        &mut written,
        "/drive/ring/tip_radius_mm",
        document.pointer("/drive/ring/tip_radius_mm").cloned().unwrap_or_default(),
    );
    if document.pointer("/drive/teeth/installed").is_none() {
        let count = written["drive"]["teeth"]["count"].clone();
        put(&mut written, "/drive/teeth/installed", count);
    }
    put(&mut written, "/parts/ring/rim", json!("housed"));
    put(&mut written, "/parts/carrier/fingers", json!("far_ends_joined"));
    put(&mut written, "/model/stiffness", serde_json::to_value(design.stiffness()).unwrap());
    for rate in ["wave_generator", "ring", "carrier"].map(|part| format!("/friction/wear_rate_mm3_per_nm/{part}")) {
        if design.friction.is_some() && written.pointer(&rate).is_none() {
            put(&mut written, &rate, json!(0.0));
        }
    }
    let left_out = |pointer: &String| document.pointer(pointer).is_none();
    let found = leaves(&written, "").into_iter().filter(left_out);
    found.map(|pointer| (pointer.clone(), written.pointer(&pointer).unwrap().clone())).collect()
}

/// Returns the document with one more default and its required companions, such as a law's name with its numbers.
fn with_default(document: &Value, (pointer, value): &(String, Value)) -> Value {
    let mut document = document.clone();
    if pointer.starts_with("/model/stiffness/depth_mm") {
        put(&mut document, "/model/stiffness/law", json!("johnson"));
    }
    put(&mut document, pointer, value.clone());
    document
}

fn assert_defaults_change_no_key(document: &Value) {
    let before = keys(&read(document).unwrap());
    let mut all = document.clone();
    for default in defaults(document) {
        let one = with_default(document, &default);
        assert_eq!(keys(&read(&one).unwrap()), before, "{default:?} in {document}");
        all = with_default(&all, &default);
    }
    assert_eq!(keys(&read(&all).unwrap()), before, "{all}");
}

#[test]
fn explicit_defaults_of_examples_keep_every_key() {
    examples().iter().for_each(assert_defaults_change_no_key);
}

proptest! {
    #[test]
    fn explicit_defaults_of_any_document_keep_key(seed: u64) {
        assert_defaults_change_no_key(&Schemas::new().document(&mut Chance::new(seed)));
    }
}

fn answer(document: &Value) -> Value {
    let answer = Sweep
        .ask(document.to_string().as_bytes(), &LIMITS, &Never)
        .unwrap_or_else(|error| panic!("{error}: {document}"));
    serde_json::to_value(answer).unwrap()
}

/// Returns case 5.2, whose tips are pointed.
fn pointed() -> Value {
    let mut document = examples().swap_remove(7);
    document["model"] = json!({});
    document
}

/// Returns documents whose refinements follow from the geometry, in all cases.
fn refined() -> Vec<Value> {
    let with = |pointer: &str, value: Value| {
        let mut document = pointed();
        put(&mut document, pointer, value);
        document
    };
    let mut documents = examples();
    documents.extend([
        pointed(),
        with("/parts", json!({ "ring": { "clearance_um": 10.0 } })),
        with("/modification/slot_wall_um", json!(3.0)),
        with("/drive/ring/tip_radius_mm", json!(52.9)),
        with("/model/refinements", json!(["corner_contact", "ring_teeth_bend"])),
        with("/model/refinements", json!("none")),
        with("/model/stiffness", json!({ "law": "palmgren" })),
        with("/model", json!({ "series_compliance_mm_per_n": "estimated" })),
        with("/model", json!({ "clearance": { "ring_um": 10.0, "carrier_um": 2.0 } })),
    ]);
    documents
}

#[test]
fn returned_model_gives_same_answer() {
    for document in refined() {
        let first = answer(&document);
        let mut sent_back = document.clone();
        sent_back["model"] = first["model"].clone();
        assert_eq!(answer(&sent_back), first, "{document}");
        let key = |document: &Value| -> Vec<Key> {
            let design: Design = read(document).unwrap();
            vec![Sweep.key(&design, &Format::Json), Accuracy.key(&design, &Format::Json)]
        };
        assert_eq!(key(&sent_back), key(&document), "{sent_back}");
    }
}

/// Its methods include those of virtual work, whose refinements `projection` itself has not.
#[test]
fn returned_model_of_projection_gives_same_methods() {
    let mut document = pointed();
    document["model"] = json!({ "compatibility": "projection" });
    let answer = |document: &Value| Accuracy.ask(document.to_string().as_bytes(), &LIMITS, &Never).unwrap();
    let first = answer(&document);
    document["model"] = serde_json::to_value(&first.model).unwrap();
    let again = answer(&document);
    let differences = |answer: AccuracyAnswer| -> Vec<_> {
        answer.ways.iter().map(|way| (way.law, way.states, way.model_difference.to_bits())).collect()
    };
    assert_eq!(differences(again), differences(first));
}

#[test]
fn three_equal_stresses_are_one() {
    let keyed = |stress: Value| {
        let mut document = pointed();
        put(&mut document, "/load/allowable_stress_mpa", stress);
        Sweep.key(&read(&document).unwrap(), &Format::Json)
    };
    let each = |ring: f64| json!({ "wave_generator": 900.0, "ring": ring, "carrier": 900.0 });
    assert_eq!(keyed(each(900.0)), keyed(json!(900.0)));
    assert_ne!(keyed(each(800.0)), keyed(json!(900.0)));
}

#[test]
fn zero_wear_rates_add_nothing_to_answer() {
    let friction = json!({ "wave_generator": { "kind": "plain", "coefficient": 0.05 }, "ring": { "coefficient": 0.05 }, "carrier": { "coefficient": 0.05 } });
    let mut document = pointed();
    put(&mut document, "/friction", friction);
    put(&mut document, "/load/input_speed_rpm", json!(1500.0));
    let without = answer(&document);
    put(&mut document, "/friction/wear_rate_mm3_per_nm", json!({ "ring": 0.0 }));
    assert_eq!(answer(&document), without);
}

#[test]
fn naming_default_law_changes_no_force() {
    let largest_n =
        |document: &Value| answer(document)["peaks"]["wave_generator"]["force_n"]["value"].as_f64().unwrap();
    let mut document = pointed();
    let left_out_n = largest_n(&document);
    assert!((left_out_n - 450.7).abs() < 0.05, "{left_out_n}");
    put(&mut document, "/model/stiffness/law", json!("johnson"));
    assert_eq!(largest_n(&document).to_bits(), left_out_n.to_bits());
}

#[test]
fn refinements_follow_from_geometry_and_gaps() {
    let cases = [
        (json!({}), json!(["ring_teeth_bend"])),
        (json!({ "parts": { "teeth": { "clearance_um": 1.0 } } }), json!(["ring_teeth_bend", "wave_generator_moves"])),
        (json!({ "modification": { "tooth_radius_um": 1.0 } }), json!(["ring_teeth_bend", "wave_generator_moves"])),
        (json!({ "model": { "compatibility": "projection" } }), json!("none")),
        (json!({ "model": { "stiffness": { "law": "palmgren" } } }), json!(["ring_teeth_bend"])),
    ];
    for (change, refinements) in cases {
        let mut document = pointed();
        for (field, value) in change.as_object().unwrap() {
            document[field] = value.clone();
        }
        assert_eq!(answer(&document)["model"]["refinements"], refinements, "{change}");
    }
    let natural = examples().swap_remove(5);
    assert_eq!(answer(&natural)["model"]["refinements"], "none");
}
