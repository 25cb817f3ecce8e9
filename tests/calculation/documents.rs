//! A document as JSON, and as the key of its answers.

use serde_json::{Value, json};
use toothwave_calculation::accuracy::Accuracy;
use toothwave_calculation::coincidence_degree::CoincidenceDegree;
use toothwave_calculation::design::Design;
use toothwave_calculation::drawing::Drawing;
use toothwave_calculation::drawing::answer::DrawnPart;
use toothwave_calculation::forms::Format;
use toothwave_calculation::geometry::Geometry;
use toothwave_calculation::key::Key;
use toothwave_calculation::question::Question;
use toothwave_calculation::sweep::Sweep;

/// Every field of a document that can stand beside the others.
fn whole() -> Value {
    json!({
        "drive": {
            "wave_generator": { "semi_major_mm": 58.0, "semi_minor_mm": 56.0 },
            "teeth": { "count": 28, "installed": 14, "radius_mm": 5.0, "width_mm": 15.0 },
            "ring": { "teeth": 26, "tip_radius_mm": 66.5 }
        },
        "materials": {
            "wave_generator": { "youngs_modulus_gpa": 201.0, "poissons_ratio": 0.31 },
            "teeth": { "youngs_modulus_gpa": 202.0, "poissons_ratio": 0.32 },
            "ring": { "youngs_modulus_gpa": 203.0, "poissons_ratio": 0.33 },
            "carrier": { "youngs_modulus_gpa": 204.0, "poissons_ratio": 0.34 }
        },
        "load": { "output_torque_nm": 200.0, "allowable_stress_mpa": 1500.0 },
        "model": {
            "compatibility": "virtual_work",
            "stiffness": { "law": "fixed", "wave_generator_n_per_mm": 1e5, "ring_n_per_mm": 2e5, "carrier_n_per_mm": 3e5 },
            "clearance": { "wave_generator_um": 1.0, "ring_um": 2.0, "carrier_um": 3.0 }
        },
        "sweep": { "samples": 31, "wind_up": true },
        "profile": { "chord_tolerance_mm": 0.002, "extent": "full" },
        "accuracy": { "requested_error": 1e-5 },
        "parts": {
            "wave_generator": { "bore_radius_mm": 20.0, "clearance_um": 4.0 },
            "teeth": { "clearance_um": 5.0 },
            "ring": { "outer_radius_mm": 80.0, "clearance_um": 6.0 },
            "carrier": { "inner_radius_mm": 58.5, "outer_radius_mm": 65.5, "clearance_um": 7.0 }
        },
        "assembly": { "input_angle_deg": 12.0 }
    })
}

fn read(document: &Value) -> Design {
    Design::read(document.to_string().as_bytes()).unwrap()
}

/// The keys of all questions, one after the other.
fn keys(document: &Value) -> Vec<Key> {
    let (design, form) = (read(document), Format::Json);
    let mut keys = vec![
        Geometry.key(&design, &form),
        CoincidenceDegree.key(&design, &form),
        Sweep.key(&design, &form),
        Accuracy.key(&design, &form),
    ];
    keys.extend(DrawnPart::ALL.map(|part| Drawing(part).key(&design, &form)));
    keys
}

/// Pointers to everything in a document that holds no further fields.
fn leaves(value: &Value, at: &str) -> Vec<String> {
    match value.as_object() {
        Some(fields) => fields.iter().flat_map(|(name, value)| leaves(value, &format!("{at}/{name}"))).collect(),
        None => vec![at.into()],
    }
}

/// The document without a field, and with another value in it, as far as that can be read.
fn changed(document: &Value, pointer: &str) -> Vec<Value> {
    let (parent, name) = pointer.rsplit_once('/').unwrap();
    let mut without = document.clone();
    without.pointer_mut(parent).unwrap().as_object_mut().unwrap().remove(name);
    let mut other = document.clone();
    let value = other.pointer_mut(pointer).unwrap();
    *value = match &*value {
        Value::Number(number) if number.is_i64() => json!(number.as_i64().unwrap() + 1),
        Value::Number(number) => json!(number.as_f64().unwrap() * 1.25),
        Value::Bool(value) => json!(!value),
        Value::String(word) => json!(match word.as_str() {
            "virtual_work" => "projection",
            "full" => "tooth",
            // The other laws know none of its stiffnesses.
            "fixed" => "fixed",
            word => panic!("another word for `{word}` is wanted here"),
        }),
        other => panic!("{other} is no value of a document"),
    };
    [without, other]
        .into_iter()
        .filter(|one| one != document && Design::read(one.to_string().as_bytes()).is_ok())
        .collect()
}

#[test]
fn a_document_that_is_written_as_json_reads_back_as_itself() {
    let whole = whole();
    let mut documents = vec![whole.clone()];
    documents.extend(leaves(&whole, "").iter().flat_map(|pointer| changed(&whole, pointer)));
    for law in ["linear", "palmgren"] {
        let mut other = whole.clone();
        other["model"]["stiffness"] = json!({ "law": law });
        documents.push(other);
    }
    let mut largest = whole;
    largest["drive"]["ring"]["teeth"] = json!(1e300);
    documents.push(largest);
    for document in documents {
        let design = read(&document);
        let written = serde_json::to_string(&design).unwrap();
        assert_eq!(Design::read(written.as_bytes()), Ok(design), "{written}");
    }
}

#[test]
fn whole_numbers_are_written_without_a_point() {
    let written = serde_json::to_value(read(&whole())).unwrap();
    assert_eq!(written["drive"]["teeth"]["count"].to_string(), "28");
}

/// Questions ask for parts of a document; together they ask for all of it.
#[test]
fn each_field_that_is_changed_or_left_out_gives_some_question_another_key() {
    let whole = whole();
    let before = keys(&whole);
    for pointer in leaves(&whole, "") {
        for document in changed(&whole, &pointer) {
            assert_ne!(keys(&document), before, "{pointer}: {document}");
        }
    }
}

#[test]
fn what_is_left_out_has_the_key_of_its_default() {
    let short = json!({ "drive": {
        "wave_generator": { "semi_major_mm": 58.0, "semi_minor_mm": 56.0 },
        "teeth": { "count": 28, "radius_mm": 5.0, "width_mm": 15.0 }, "ring": { "teeth": 26 }
    }, "load": { "input_torque_nm": 20.0 } });
    let mut long = short.clone();
    long["drive"]["teeth"]["installed"] = json!(28.0);
    long["drive"]["ring"]["tip_radius_mm"] = json!(null);
    long["materials"] = json!({ "teeth": { "poissons_ratio": 0.3 } });
    long["model"] = json!({ "compatibility": "projection", "stiffness": { "law": "linear" } });
    long["sweep"] = json!({ "samples": 50, "wind_up": false });
    long["parts"] = json!({ "ring": { "clearance_um": -0.0 } });
    long["assembly"] = json!({ "input_angle_deg": -0.0 });
    assert_eq!(keys(&short), keys(&long));
}
