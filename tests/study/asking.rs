//! Functions that run a study.

use std::sync::Arc;

use serde_json::{Value, json};
use toothwave_calculation::forms::{Format, Forms as _};
use toothwave_calculation::no_answer::NoAnswer;
use toothwave_calculation::question;
use toothwave_solver::Never;
use toothwave_study::{Gathered, Limits, Study, Work};

pub(crate) const CALCULATION: question::Limits = question::Limits::new(1_000_000, 1_000_000);

pub(crate) const LIMITS: Limits =
    Limits { calculation: CALCULATION, max_study_variants: 10_000_000, max_study_bytes: 1 << 30 };

pub(crate) fn study(document: &Value) -> Result<Arc<Study>, NoAnswer> {
    Study::read(document.to_string().as_bytes(), &LIMITS).map(Arc::new)
}

/// Returns pointer and code of a document's fault.
pub(crate) fn faulty(document: &Value) -> (String, String) {
    let refused = study(document).expect_err("the study can be carried out");
    let error = refused.errors.first().unwrap_or_else(|| panic!("{refused}"));
    (error.pointer.clone(), toothwave_calculation::json::word(&error.code))
}

/// Runs a study, one chunk after the other.
pub(crate) fn gathered(document: &Value) -> Gathered {
    let study = study(document).unwrap_or_else(|refused| panic!("{refused}"));
    let mut gathered = Gathered::new(&study);
    for chunk in 0..study.chunks() {
        gathered.add(chunk, Work::new(&study, chunk).run(&Never).unwrap());
    }
    gathered
}

pub(crate) fn text(gathered: &Gathered, format: Format) -> String {
    let mut text = Vec::new();
    gathered.answer().write(format, &mut text).unwrap();
    String::from_utf8(text).unwrap()
}

pub(crate) fn answer(document: &Value) -> Value {
    serde_json::from_str(&text(&gathered(document), Format::Json)).unwrap()
}

/// Returns the paper's case 5.1 under the paper's model, which is the fastest.
pub(crate) fn paper() -> Value {
    json!({
        "model": { "compatibility": "projection", "stiffness": { "law": "linear" } },
        "drive": {
            "wave_generator": { "semi_major_mm": 58.0, "semi_minor_mm": 56.0 },
            "teeth": { "count": 28, "radius_mm": 5.0, "width_mm": 15.0 },
            "ring": { "teeth": 26 }
        },
        "load": { "input_torque_nm": 20.0 }
    })
}

/// Returns the document with a field set. Its parent must exist.
pub(crate) fn with(document: &Value, pointer: &str, value: Value) -> Value {
    let mut document = document.clone();
    let (parent, name) = pointer.rsplit_once('/').unwrap();
    let name = name.replace("~1", "/").replace("~0", "~");
    match document.pointer_mut(parent).unwrap() {
        Value::Array(items) => items[name.parse::<usize>().unwrap()] = value,
        parent => parent[name] = value,
    }
    document
}
