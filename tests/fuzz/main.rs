//! Whatever the document, there is an answer in numbers or a reason: no panic, no number that is none, no endless loop.
//!
//! `cargo test` replays the committed corpus and tries some more at random beside it; `cargo bolero test NAME -p toothwave-calculation`
//! hands the same targets to a coverage-guided fuzzer.
#![allow(clippy::unwrap_used, reason = "a fuzz target fails by panicking")]

use serde_json::{Value, json};
use toothwave_calculation::accuracy::Accuracy;
use toothwave_calculation::coincidence_degree::CoincidenceDegree;
use toothwave_calculation::design::Design;
use toothwave_calculation::drawing::Drawing;
use toothwave_calculation::drawing::answer::DrawnPart;
use toothwave_calculation::forms::{Format, Forms};
use toothwave_calculation::geometry::Geometry;
use toothwave_calculation::no_answer::{NoAnswer, NoAnswerCode};
use toothwave_calculation::question::{Limits, Question};
use toothwave_calculation::sweep::Sweep;
use toothwave_solver::Never;

/// Small enough for thousands of answers.
const LIMITS: Limits = Limits { max_states: 2_000, max_profile_points: 20_000 };

fn assert_answered<Q: Question>(question: Q, design: &Design) {
    let answered = question.check(design, &LIMITS).and_then(|checked| Q::answer(&checked, &Never));
    match answered {
        // serde_json writes null where a number is none.
        Ok(answer) => {
            for format in Q::Answer::FORMS.iter().map(|(format, _)| *format).chain([Format::Json]) {
                let mut written = Vec::new();
                answer.write(format, &mut written).unwrap();
                let text = String::from_utf8(written).unwrap();
                let is_none = match format {
                    // serde_json writes null where a number is none; elsewhere a word may be `info`.
                    Format::Json => text.contains("null"),
                    Format::Text => text.contains("NaN"),
                    Format::Csv | Format::Svg | Format::Dxf | Format::Step => {
                        text.contains("NaN") || text.contains("inf")
                    }
                };
                assert!(!is_none, "{format:?}: {design:?}");
            }
        }
        Err(reason) => assert_refused_for_a_reason(&reason),
    }
}

fn assert_refused_for_a_reason(reason: &NoAnswer) {
    assert_ne!(reason.code, NoAnswerCode::InternalError, "{reason}");
    assert!(!reason.detail.is_empty());
}

fn assert_text_is_answered(text: &[u8]) {
    match Design::read(text) {
        Ok(design) => {
            assert_answered(Geometry, &design);
            assert_answered(CoincidenceDegree, &design);
            assert_answered(Sweep, &design);
            assert_answered(Drawing(DrawnPart::Assembly), &design);
        }
        Err(reason) => assert_refused_for_a_reason(&reason),
    }
}

#[test]
fn any_text() {
    bolero::check!().with_iterations(3_000).for_each(assert_text_is_answered);
}

/// A length between the ends of its range, most often an ordinary one.
fn length_mm(byte: u8) -> f64 {
    match byte {
        0..16 => 1e-6 * f64::from(byte + 1),
        240.. => 1e6 / f64::from(256 - u32::from(byte)),
        _ => 1.0 + f64::from(byte) / 4.0,
    }
}

/// A document of the right form: ratios of lengths that drives have, and numbers from all over the ranges.
fn document(bytes: &[u8; 20]) -> Value {
    let [scale, flattening, half, removal, thickness, more, bore, torque, form, law, rest @ ..] = *bytes;
    let a = length_mm(scale);
    let b = a * (1.0 - 10.0_f64.powf(-f64::from(flattening) / 16.0 - 0.1));
    let installed = 2 * (1 + i64::from(half) % 64);
    let teeth = installed * (1 + i64::from(removal) % 4);
    let sin = (std::f64::consts::PI / installed as f64).sin();
    let r = f64::from(thickness) / 255.0 * b * sin / (1.0 - sin).max(0.05);
    let mut ring = json!({ "teeth": if more % 2 == 0 { teeth - 2 } else { teeth + 2 } });
    if bore % 2 == 0 {
        ring["tip_radius_mm"] = json!(b + 2.0 * r + f64::from(bore) / 255.0 * (a - b));
    }
    let stiffness = match law % 3 {
        0 => json!({ "law": "linear" }),
        1 => json!({ "law": "palmgren" }),
        _ => json!({
            "law": "fixed",
            "wave_generator_n_per_mm": 10.0_f64.powi(i32::from(rest[0] % 19) - 3),
            "ring_n_per_mm": 10.0_f64.powi(i32::from(rest[1] % 19) - 3),
            "carrier_n_per_mm": 10.0_f64.powi(i32::from(rest[2] % 19) - 3)
        }),
    };
    let mut model = json!({
        "compatibility": if form % 2 == 0 { "projection" } else { "virtual_work" },
        "stiffness": stiffness
    });
    if rest[3] % 3 == 0 {
        let gap = |byte: u8| if byte < 128 { 0.0 } else { 10.0_f64.powi(i32::from(byte % 10) - 4) };
        model["clearance"] =
            json!({ "wave_generator_um": gap(rest[4]), "ring_um": gap(rest[5]), "carrier_um": gap(rest[6]) });
    }
    let sweep = if rest[7] % 2 == 0 {
        json!({ "samples": 1 + rest[7] / 8, "wind_up": rest[8] % 2 == 0 })
    } else {
        json!({ "tolerance": 10.0_f64.powi(-1 - i32::from(rest[7] % 12)), "wind_up": rest[8] % 2 == 0 })
    };
    let mut load = json!({ "input_torque_nm": 10.0_f64.powi(i32::from(torque % 28) - 12) });
    if rest[9] % 2 == 0 {
        load["allowable_stress_mpa"] = json!(10.0_f64.powi(i32::from(rest[9] % 10) - 3));
    }
    let coefficient = |byte: u8| if byte < 64 { 0.0 } else { (f64::from(byte) - 63.0) / 192.0 };
    let friction = (rest[5] % 2 == 0).then(|| {
        let mut wave_generator = json!({ "kind": "plain", "coefficient": coefficient(rest[0]) });
        if rest[5] % 3 > 0 {
            wave_generator["kind"] = json!(if rest[5] % 3 == 1 { "race" } else { "rolling" });
            wave_generator["bearing_coefficient"] = json!(coefficient(rest[1]));
            wave_generator["bearing_radius_mm"] = json!(length_mm(rest[2]));
        }
        json!({
            "wave_generator": wave_generator,
            "ring": { "coefficient": coefficient(rest[6]) },
            "carrier": { "coefficient": coefficient(rest[8]) }
        })
    });
    if rest[6] % 2 == 0 {
        load["input_speed_rpm"] = json!(10.0_f64.powi(i32::from(rest[6] % 13) - 6));
    }
    // Radii about where they have to lie, clearances from none to more than a tooth.
    let about = |byte: u8| 0.5 + f64::from(byte) / 170.0;
    let clearance = |byte: u8| if byte < 128 { 0.0 } else { 1e3 * r * (f64::from(byte) - 127.0) / 100.0 };
    let parts = json!({
        "wave_generator": { "bore_radius_mm": b * about(rest[1]), "clearance_um": clearance(rest[2]) },
        "teeth": { "clearance_um": clearance(rest[3]) },
        "ring": { "clearance_um": clearance(rest[4]) },
        "carrier": { "clearance_um": clearance(rest[6]) }
    });
    let mut document = json!({
        "drive": {
            "wave_generator": { "semi_major_mm": a, "semi_minor_mm": b },
            "teeth": { "count": teeth, "installed": installed, "radius_mm": r, "width_mm": length_mm(rest[8]) },
            "ring": ring
        },
        "load": load,
        "model": model,
        "sweep": sweep,
        "parts": parts,
        "assembly": { "input_angle_deg": 10.0 * f64::from(rest[0]) - 1000.0 },
        "profile": { "chord_tolerance_mm": 1e-3 * a, "extent": if form % 3 == 0 { "full" } else { "tooth" } }
    });
    if let Some(friction) = friction {
        document["friction"] = friction;
    }
    document
}

#[test]
fn any_drive() {
    bolero::check!().with_type::<[u8; 20]>().with_iterations(1_000).for_each(|bytes| {
        assert_text_is_answered(document(bytes).to_string().as_bytes());
    });
}

#[test]
fn any_accuracy() {
    bolero::check!().with_type::<[u8; 20]>().with_iterations(8).for_each(|bytes| {
        let text = document(bytes).to_string();
        assert_answered(Accuracy, &Design::read(text.as_bytes()).unwrap());
    });
}
