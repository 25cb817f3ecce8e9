//! Fuzz targets. Any document gets finite numbers or a reason, without a panic or an endless loop.
//!
//! `cargo test` replays the committed corpus and adds random inputs, which `PROPTEST_RNG_SEED` makes reproducible.
//! `cargo bolero test NAME -p toothwave-calculation` runs the same targets with a coverage-guided fuzzer.
#![allow(clippy::unwrap_used, reason = "a fuzz target fails by panicking")]

use proptest::prelude::*;
use serde_json::{Value, json};
use toothwave_calculation::accuracy::Accuracy;
use toothwave_calculation::coincidence_degree::CoincidenceDegree;
use toothwave_calculation::design::Design;
use toothwave_calculation::drawing::preset::Preset;
use toothwave_calculation::drawing::{Drawing, DrawnPart};
use toothwave_calculation::forms::{Format, Forms};
use toothwave_calculation::geometry::Geometry;
use toothwave_calculation::no_answer::{NoAnswer, NoAnswerCode};
use toothwave_calculation::question::{Limits, Question};
use toothwave_calculation::sweep::Sweep;
use toothwave_solver::Never;

/// Limits small enough for thousands of answers.
const LIMITS: Limits = Limits::new(2_000, 20_000);

fn assert_answered<Q: Question>(question: Q, design: &Design) {
    let answered = question.check(design, &LIMITS).and_then(|checked| Q::answer(&checked, &Never));
    match answered {
        // serde_json writes a non-finite number as null.
        Ok(answer) => {
            // Meshes take a hundred times as long as all other forms.
            let forms = Q::Answer::FORMS.iter().map(|(format, _)| *format).chain([Format::Json]);
            for format in forms.filter(|format| !matches!(format, Format::Stl | Format::ThreeMf)) {
                let mut written = Vec::new();
                answer.write(format, &mut written).unwrap();
                // The bytes of numbers also appear in the text.
                if matches!(format, Format::Arrow | Format::Parquet) {
                    continue;
                }
                let text = String::from_utf8(written).unwrap();
                let is_none = match format {
                    // serde_json writes a non-finite number as null. In other formats a word may contain `inf`.
                    Format::Json => text.contains("null"),
                    Format::Text => text.contains("NaN"),
                    _ => text.contains("NaN") || text.contains("inf"),
                };
                assert!(!is_none, "{format:?}: {design:?}");
            }
        }
        Err(reason) => {
            assert_ne!(reason.code, NoAnswerCode::InternalError, "{reason}: {design:?}");
            assert_refused_for_a_reason(&reason);
        }
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
            assert_answered(Drawing { part: DrawnPart::Assembly, preset: Preset::Document }, &design);
        }
        Err(reason) => assert_refused_for_a_reason(&reason),
    }
}

#[test]
fn any_text() {
    bolero::check!().with_iterations(3_000).for_each(assert_text_is_answered);
}

/// Runs a test on random bytes this many times.
fn drawn<const BYTES: usize>(cases: u32, test: impl Fn(&[u8; BYTES])) {
    let config = ProptestConfig { cases, failure_persistence: None, ..ProptestConfig::default() };
    let bytes = prop::collection::vec(any::<u8>(), BYTES);
    proptest!(config, |(bytes in bytes)| test(&bytes.try_into().unwrap()));
}

/// Returns a length within its range, most often an ordinary one.
fn length_mm(byte: u8) -> f64 {
    match byte {
        0..16 => 1e-6 * f64::from(byte + 1),
        240.. => 1e6 / f64::from(256 - u32::from(byte)),
        _ => 1.0 + f64::from(byte) / 4.0,
    }
}

/// Returns a well-formed document with usual ratios of lengths and numbers across all ranges.
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
        let rate = |byte: u8| 10.0_f64.powi(i32::from(byte % 14) - 11);
        json!({
            "wear_rate_mm3_per_nm": { "wave_generator": rate(rest[1]), "ring": rate(rest[2]), "carrier": rate(rest[3]) },
            "wave_generator": wave_generator,
            "ring": { "coefficient": coefficient(rest[6]) },
            "carrier": { "coefficient": coefficient(rest[8]) }
        })
    });
    if rest[6] % 2 == 0 {
        load["input_speed_rpm"] = json!(10.0_f64.powi(i32::from(rest[6] % 13) - 6));
    }
    // Radii near their possible range, and clearances from zero to above a tooth.
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
    let is_answered = |bytes: &[u8; 20]| assert_text_is_answered(document(bytes).to_string().as_bytes());
    bolero::check!().with_type().with_iterations(0).for_each(is_answered);
    drawn(1_000, is_answered);
}

/// Returns a signed number of any size within its range, most often zero.
fn deviation(byte: u8, largest: f64) -> f64 {
    let size = largest * 10.0_f64.powi(-i32::from(byte % 8));
    match byte / 8 % 4 {
        0 | 1 => 0.0,
        2 => size,
        _ => -size,
    }
}

/// Returns a document of any kind, shape and law, with modifications and deviations. Most fit each other.
fn relative(bytes: &[u8; 48]) -> Value {
    let [kind, size, stroke, lobes, half, removal, thickness, sense, bore, shape, rest @ ..] = *bytes;
    let [grooves, groove, flat, law, depth, series, form, torque, points, gap, modified, rest @ ..] = rest;
    let mean = length_mm(size);
    let e = mean * 10.0_f64.powf(-f64::from(stroke) / 64.0 - 0.3);
    let many = if lobes < 250 { 1 + i64::from(lobes) % 5 } else { 1 << (lobes - 246) };
    let (wave_generator, lobes) = match kind % 4 {
        0 => (json!({ "kind": "ellipse", "semi_major_mm": mean + e, "semi_minor_mm": mean - e }), 2),
        1 => (json!({ "kind": "eccentric", "radius_mm": mean, "eccentricity_mm": e }), 1),
        2 => (json!({ "kind": "harmonic", "lobes": many, "mean_radius_mm": mean, "amplitude_mm": e }), many),
        _ => (json!({ "kind": "harmonic_path", "lobes": many, "mean_path_radius_mm": mean, "amplitude_mm": e }), many),
    };
    let installed = 2 + i64::from(half) % 62;
    let count = installed * (1 + i64::from(removal) % 3);
    let sin = (std::f64::consts::PI / installed as f64).sin();
    let r = f64::from(thickness) / 255.0 * (mean - e) * sin / (1.0 - sin).max(0.05);
    let ring_teeth = if sense % 2 == 0 { count - lobes } else { count + lobes };
    let mut ring = json!({ "teeth": ring_teeth });
    if bore % 4 == 0 {
        ring["tip_radius_mm"] = json!(mean - e + 2.0 * r + f64::from(bore) / 128.0 * e);
    }
    let by_contact = |bits: u8, value: &dyn Fn(usize) -> f64| {
        let contacts = ["wave_generator", "ring", "carrier"].into_iter().enumerate();
        let chosen = contacts.filter(|(place, _)| bits >> place & 1 == 1);
        chosen.map(|(place, contact)| (contact.to_owned(), json!(value(place)))).collect::<Value>()
    };
    let mut teeth = json!({ "count": count, "installed": installed, "radius_mm": r });
    match shape % 3 {
        0 => teeth["width_mm"] = json!(r * 10.0_f64.powf(f64::from(groove) / 128.0 - 1.0)),
        1 => {
            teeth["shape"] = json!("ball");
            let wider = |place: usize| r * (1.0 + 10.0_f64.powf(-f64::from(groove) / (48.0 + place as f64)));
            teeth["groove_radius_mm"] = by_contact(grooves, &wider);
        }
        _ => {
            teeth["shape"] = json!("flat_sided");
            teeth["width_mm"] = json!(r * 10.0_f64.powf(f64::from(groove) / 128.0 - 1.0));
            teeth["flat_length_mm"] = json!(2.0 * r * f64::from(flat) / 256.0);
        }
    }
    let stiffness = |place: usize| 10.0_f64.powi(i32::from(depth) % 18 - 3) * [1.0, 10.0, 1.0][place];
    let mut model = json!({});
    match law % 6 {
        0 => {}
        1 => model["stiffness"] = json!({ "law": "linear" }),
        2 => model["stiffness"] = json!({ "law": "palmgren" }),
        3 => model["stiffness"] = json!({ "law": "hertz" }),
        4 => {
            let deep = |place: usize| r * 10.0_f64.powf(f64::from(depth) / 64.0 - 2.0 + place as f64);
            model["stiffness"] = json!({ "law": "johnson", "depth_mm": by_contact(grooves >> 3, &deep) });
        }
        _ => {
            model["stiffness"] = json!({
                "law": "fixed", "wave_generator_n_per_mm": stiffness(0), "ring_n_per_mm": stiffness(1),
                "carrier_n_per_mm": stiffness(2)
            });
        }
    }
    match form % 8 {
        0 => {}
        1 => model["compatibility"] = json!("projection"),
        _ => model["compatibility"] = json!("virtual_work"),
    }
    if series % 4 == 0 {
        let compliance = |place: usize| 10.0_f64.powi(-i32::from(series) % 13) * [1.0, 10.0, 100.0][place];
        model["series_compliance_mm_per_n"] = by_contact(grooves >> 5, &compliance);
    }
    if series % 8 == 1 {
        model["ring_teeth_bend"] = json!(true);
    }
    if series % 8 == 3 {
        model["wave_generator_moves"] = json!(true);
    }
    if series % 8 >= 6 {
        model["corner_contact"] = json!(true);
    }
    if gap % 2 == 0 {
        // Most often enough to cover an interference.
        let clearance = |_| 1e3 * r * 10.0_f64.powi(-i32::from(gap % 9));
        let gaps = by_contact(7, &clearance);
        model["clearance"] = json!({ "wave_generator_um": gaps["wave_generator"], "ring_um": gaps["ring"], "carrier_um": gaps["carrier"] });
    }
    let mut document = json!({
        "drive": { "wave_generator": wave_generator, "teeth": teeth, "ring": ring },
        "load": { "input_torque_nm": 10.0_f64.powi(i32::from(torque % 28) - 12), "allowable_stress_mpa": 1500.0 },
        "model": model,
        "sweep": if points % 2 == 0 {
            json!({ "samples": 1 + points / 8, "wind_up": true })
        } else {
            json!({ "tolerance": 10.0_f64.powi(-1 - i32::from(points % 12)), "wind_up": true })
        },
        "assembly": { "input_angle_deg": f64::from(points) },
        "profile": { "chord_tolerance_mm": 1e-3 * mean }
    });
    if modified % 2 == 0 {
        let (length_um, arcsec) =
            (|place: usize| deviation(rest[place], 1e3 * r), |place: usize| deviation(rest[place], 1e4));
        document["modification"] = json!({
            "ring_equidistant_um": length_um(0), "ring_path_shift_um": length_um(1), "ring_profile_shift_um": length_um(2),
            "ring_rotation_arcsec": arcsec(3), "wave_generator_equidistant_um": length_um(4), "slot_wall_um": length_um(5),
            "carrier_rotation_arcsec": arcsec(6), "tooth_radius_um": length_um(7)
        });
        if rest[8] % 2 == 0 {
            document["modification"]["ring_tip_relief"] = json!({
                "amount_um": deviation(rest[8], 1e3 * r), "start_deg": f64::from(rest[9]) / 255.0 * 180.0 / lobes as f64,
                "power": 0.1 + f64::from(rest[10]) / 4.0
            });
        }
    }
    let [deviating, list, of_parts @ ..] =
        [rest[11], rest[12], rest[13], rest[14], rest[15], rest[16], rest[17], rest[18]];
    if deviating % 2 == 0 {
        document["deviations"] = deviations(list, &of_parts, &rest[19..], [installed, ring_teeth, lobes], 1e3 * r);
    }
    document
}

/// Returns deviations: sometimes one list, mostly of the right length, and sometimes a runout. Few keep sweeps short.
fn deviations(list: u8, of_parts: &[u8], entries: &[u8], items: [i64; 3], size_um: f64) -> Value {
    let [slots, spaces, lobes] = items;
    let (name, count, size) = [
        ("wave_generator_lobe_um", lobes, size_um),
        ("tooth_radius_um", slots, size_um),
        ("slot_wall_um", slots, size_um),
        ("slot_angle_arcsec", slots, 1e3),
        ("ring_space_um", spaces, size_um),
        ("ring_space_angle_arcsec", spaces, 1e3),
    ][usize::from(list) % 6];
    let count = if list < 250 { count } else { count + 1 };
    let value = |item: i64| deviation(entries[usize::try_from(item).unwrap() % entries.len()], size);
    let mut deviations = json!({ name: (0..count).map(value).collect::<Vec<_>>() });
    for (part, pair) in ["wave_generator", "ring", "carrier"].into_iter().zip(of_parts.chunks(2)) {
        if pair[0] % 4 == 0 {
            let angle_deg = 2.0 * f64::from(pair[1]) - 250.0;
            let amount_um = deviation(pair[0], size_um).abs();
            deviations[format!("{part}_runout")] = json!({ "amount_um": amount_um, "angle_deg": angle_deg });
        }
    }
    deviations
}

#[test]
fn any_member_of_the_family() {
    let is_answered = |bytes: &[u8; 48]| assert_text_is_answered(relative(bytes).to_string().as_bytes());
    bolero::check!().with_type().with_iterations(0).for_each(is_answered);
    drawn(600, is_answered);
}

/// The fuzz documents would test nothing if none of them were possible.
#[test]
fn most_kinds_shapes_and_laws_have_an_answer() {
    let mut answered = std::collections::BTreeSet::new();
    let mut state = 1_u64;
    for _ in 0..4_000 {
        let bytes = std::array::from_fn(|_| {
            // Knuth's linear congruence.
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            state.to_le_bytes()[7]
        });
        let document = relative(&bytes);
        let design = Design::read(document.to_string().as_bytes()).unwrap();
        if Sweep.check(&design, &LIMITS).and_then(|checked| Sweep::answer(&checked, &Never)).is_ok() {
            let word = |pointer: &str| document.pointer(pointer).and_then(Value::as_str).unwrap_or("none").to_owned();
            answered.insert(word("/drive/wave_generator/kind"));
            answered.insert(word("/drive/teeth/shape"));
            answered.insert(word("/model/stiffness/law"));
            answered.insert(word("/model/compatibility"));
            let is_modified = document["modification"].as_object().into_iter().flatten().any(|(_, value)| value != 0.0);
            answered.insert(if is_modified { "modified" } else { "conjugate" }.to_owned());
            if !design.deviations.is_nil() {
                answered.insert("deviating".to_owned());
            }
        }
    }
    let expected = [
        "ellipse",
        "eccentric",
        "harmonic",
        "harmonic_path",
        "ball",
        "flat_sided",
        "linear",
        "palmgren",
        "hertz",
        "johnson",
        "fixed",
        "projection",
        "virtual_work",
        "modified",
        "conjugate",
        "deviating",
    ];
    for word in expected {
        assert!(answered.contains(word), "no document of {word} has an answer");
    }
}

#[test]
fn any_accuracy() {
    let is_answered =
        |document: Value| assert_answered(Accuracy, &Design::read(document.to_string().as_bytes()).unwrap());
    drawn(8, |bytes: &[u8; 20]| is_answered(document(bytes)));
    drawn(8, |bytes: &[u8; 48]| is_answered(relative(bytes)));
}
