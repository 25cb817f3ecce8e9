//! Design documents, with functions that change and spell them.

use serde_json::{Value, json};

/// The documented design document.
pub(crate) const CONTRACT: &str = r#"{
  "drive": {
    "wave_generator": { "semi_major_mm": 58.0, "semi_minor_mm": 56.0 },
    "teeth": { "count": 28, "installed": 28, "radius_mm": 5.0, "width_mm": 15.0 },
    "ring": { "teeth": 26, "tip_radius_mm": 66.0 }
  },
  "materials": {
    "wave_generator": { "youngs_modulus_gpa": 210.0, "poissons_ratio": 0.3 },
    "teeth": {}, "ring": {}, "carrier": {}
  },
  "load": { "input_torque_nm": 20.0 },
  "model": { "compatibility": "projection", "stiffness": { "law": "linear" } },
  "sweep": { "samples": 50 },
  "profile": { "chord_tolerance_mm": 0.001, "extent": "tooth" }
}"#;

/// Returns the paper's load sharing model, which a document must name.
pub(crate) fn of_the_paper() -> Value {
    json!({ "compatibility": "projection", "stiffness": { "law": "linear" } })
}

/// Returns the paper's case 5.1 under the paper's model, with every other default written out.
pub(crate) fn spelled_out() -> Value {
    let steel = json!({ "youngs_modulus_gpa": 210.0, "poissons_ratio": 0.3 });
    json!({
        "drive": {
            "wave_generator": { "semi_major_mm": 58.0, "semi_minor_mm": 56.0 },
            "teeth": { "count": 28, "installed": 28, "radius_mm": 5.0, "width_mm": 15.0 },
            "ring": { "teeth": 26, "tip_radius_mm": null }
        },
        "materials": { "wave_generator": steel, "teeth": steel, "ring": steel, "carrier": steel },
        "load": { "input_torque_nm": 20.0 },
        "model": of_the_paper(),
        "sweep": { "samples": 50 },
        "profile": { "chord_tolerance_mm": 0.001, "extent": "tooth" }
    })
}

/// Returns case 5.1 with every default written out except the law. The default law follows from the drive.
pub(crate) fn defaults_spelled_out() -> Value {
    with(&spelled_out(), "/model", json!({ "compatibility": "virtual_work" }))
}

/// Returns the paper's case 5.1 with required fields only.
pub(crate) fn shortest() -> Value {
    json!({
        "drive": {
            "wave_generator": { "semi_major_mm": 58.0, "semi_minor_mm": 56.0 },
            "teeth": { "count": 28, "radius_mm": 5.0, "width_mm": 15.0 },
            "ring": { "teeth": 26 }
        },
        "load": { "input_torque_nm": 20.0 }
    })
}

/// Returns the paper's case 5.2, undercut.
pub(crate) fn undercut() -> Value {
    json!({
        "drive": {
            "wave_generator": { "semi_major_mm": 50.7, "semi_minor_mm": 49.3 },
            "teeth": { "count": 80, "installed": 40, "radius_mm": 1.5, "width_mm": 15.0 },
            "ring": { "teeth": 78 }
        },
        "load": { "input_torque_nm": 3.0 }
    })
}

/// Returns case 5.2 with the bore of the paper's figures 20 to 25.
pub(crate) fn bored() -> Value {
    with(&undercut(), "/drive/ring/tip_radius_mm", json!(52.8227))
}

/// Returns a drive with an eccentric circle, one lobe.
pub(crate) fn eccentric() -> Value {
    json!({
        "drive": {
            "wave_generator": { "kind": "eccentric", "radius_mm": 30.8, "eccentricity_mm": 1.2 },
            "teeth": { "count": 28, "radius_mm": 2.5, "width_mm": 10.0 },
            "ring": { "teeth": 27 }
        },
        "load": { "input_torque_nm": 5.0 }
    })
}

/// Returns a document with every number that it can hold at once, with fixed stiffnesses and a bore.
pub(crate) fn every_number() -> Value {
    let document = with(&spelled_out(), "/model/stiffness", fixed(4e5, 5e5, 3e5));
    with(&document, "/drive/ring/tip_radius_mm", json!(66.5))
}

/// Returns a law of fixed stiffnesses.
pub(crate) fn fixed(wave_generator: f64, ring: f64, carrier: f64) -> Value {
    json!({
        "law": "fixed",
        "wave_generator_n_per_mm": wave_generator,
        "ring_n_per_mm": ring,
        "carrier_n_per_mm": carrier
    })
}

fn split(pointer: &str) -> (&str, &str) {
    pointer.rsplit_once('/').expect("a pointer to a field")
}

/// Returns the document with a field or entry set. Its parent must exist.
pub(crate) fn with(document: &Value, pointer: &str, value: Value) -> Value {
    if pointer.is_empty() {
        return value;
    }
    let mut document = document.clone();
    if let Some(entry) = document.pointer_mut(pointer) {
        *entry = value;
        return document;
    }
    let (object, field) = split(pointer);
    let object = document.pointer_mut(object).and_then(Value::as_object_mut);
    object.unwrap_or_else(|| panic!("nothing holds {pointer}")).insert(field.into(), value);
    document
}

/// Returns the document without a field, which must exist.
pub(crate) fn without(document: &Value, pointer: &str) -> Value {
    let mut document = document.clone();
    let (object, field) = split(pointer);
    let removed = document.pointer_mut(object).and_then(|object| object.as_object_mut()?.remove(field));
    assert!(removed.is_some(), "{pointer} is not there");
    document
}

fn visit<'a>(value: &'a Value, pointer: &str, each: &mut impl FnMut(&str, &'a Value)) {
    each(pointer, value);
    for (field, inner) in value.as_object().into_iter().flatten() {
        visit(inner, &format!("{pointer}/{field}"), each);
    }
}

/// Returns pointers to all values that match.
pub(crate) fn pointers(document: &Value, is_meant: impl Fn(&Value) -> bool) -> Vec<String> {
    let mut pointers = Vec::new();
    visit(document, "", &mut |pointer, value| {
        if is_meant(value) {
            pointers.push(pointer.to_owned());
        }
    });
    pointers
}

/// Options for writing a document as text.
#[derive(Clone, Copy, Default)]
struct Spelling<'a> {
    /// True if the fields of every object are in reverse order.
    is_reversed: bool,
    /// Pointer to the duplicated field.
    twice: Option<&'a str>,
}

impl Spelling<'_> {
    fn text(self, value: &Value, pointer: &str) -> String {
        let Some(fields) = value.as_object() else { return value.to_string() };
        let mut texts: Vec<_> = fields
            .iter()
            .flat_map(|(name, value)| {
                let inner = format!("{pointer}/{name}");
                let text = format!("\n\t{} : {}", json!(name), self.text(value, &inner));
                vec![text; if self.twice == Some(&inner) { 2 } else { 1 }]
            })
            .collect();
        if self.is_reversed {
            texts.reverse();
        }
        format!("{{{}\r\n}}", texts.join(" ,"))
    }
}

/// Writes the document with the fields of every object in reverse order.
pub(crate) fn in_reverse(document: &Value) -> String {
    Spelling { is_reversed: true, ..Spelling::default() }.text(document, "")
}

/// Writes the document with one field twice.
pub(crate) fn with_twice(document: &Value, twice: &str) -> String {
    Spelling { twice: Some(twice), ..Spelling::default() }.text(document, "")
}
