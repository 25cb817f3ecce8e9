//! The engine: chunks are pure, and merging in any order gives the same bits.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};

use rayon::prelude::*;
use serde_json::{Value, json};
use toothwave_calculation::forms::{Format, Forms as _};
use toothwave_solver::{Never, Stop};
use toothwave_study::{Gathered, Part, Study, Work};

use crate::asking::{LIMITS, gathered, paper, study, text, with};

/// Returns a study of each kind with several chunks each.
pub(crate) fn studies() -> [Value; 4] {
    let radius = |steps: u64| json!({ "min": 3.0, "max": 7.5, "steps": steps });
    let normal = json!({ "distribution": "normal", "sigma": 0.01, "limit": 0.03 });
    [
        json!({
            "study": "map", "base": paper(), "quantities": ["peak_stress_ring_mpa", "slot_wall_mm"],
            "over": { "/drive/teeth/radius_mm": radius(70), "/load/input_torque_nm": { "min": 10, "max": 20, "steps": 70 } }
        }),
        json!({
            "study": "search", "base": paper(), "evaluations": 25_000,
            "free": { "/drive/teeth/radius_mm": { "min": 3.0, "max": 7.5 }, "/drive/wave_generator/semi_minor_mm": { "min": 54.0, "max": 57.9 } },
            "require": { "undercut": false, "outer_diameter_mm": { "max": 165.0 } },
            "objectives": [{ "quantity": "peak_stress_mpa", "goal": "min" }, { "quantity": "outer_diameter_mm", "goal": "min" }]
        }),
        json!({ "study": "sensitivity", "base": paper() }),
        json!({
            "study": "tolerance", "base": paper(), "samples": 3000, "quantities": ["peak_stress_ring_mpa"],
            "inputs": { "/drive/teeth/radius_mm": normal, "/drive/wave_generator/semi_major_mm": normal }
        }),
    ]
}

fn in_chunks_of(document: &Value, variants: u64) -> Arc<Study> {
    Arc::new(Study::read(document.to_string().as_bytes(), &LIMITS).unwrap().in_chunks_of(variants))
}

/// Returns a part after a round trip through its file.
fn kept(study: &Study, chunk: u64, part: &Part) -> Part {
    study.read_part(chunk, study.part_bytes(chunk, part).unwrap()).unwrap()
}

#[test]
fn chunks_in_any_order_give_same_bits() {
    for document in studies() {
        let one_thread = text(&gathered(&document), Format::Json);
        let study = study(&document).unwrap();
        let several = Mutex::new(Gathered::new(&study));
        let pool = rayon::ThreadPoolBuilder::new().num_threads(2).build().unwrap();
        pool.install(|| {
            let chunks: Vec<_> = (0..study.chunks()).rev().collect();
            chunks.into_par_iter().for_each(|chunk| {
                let part = kept(&study, chunk, &Work::new(&study, chunk).run(&Never).unwrap());
                several.lock().unwrap().add(chunk, part.clone());
                // Adding a part twice changes nothing.
                several.lock().unwrap().add(chunk, part);
            });
        });
        let several = several.into_inner().unwrap();
        assert!(several.is_complete());
        assert_eq!(text(&several, Format::Json), one_thread, "{}", study.kind());
    }
}

/// A stop flag that the test sets.
struct Times {
    is_set: AtomicBool,
}

impl Stop for Times {
    fn stopped(&self) -> bool {
        self.is_set.load(Ordering::Relaxed)
    }
}

#[test]
fn resumed_chunk_has_same_bits() {
    for document in studies() {
        let study = in_chunks_of(&document, 100);
        let whole = Work::new(&study, 0).run(&Never).unwrap();
        let stop = Times { is_set: AtomicBool::new(false) };
        let mut work = Work::new(&study, 0);
        let mut stopped = 0;
        let mut steps = 0_u32;
        loop {
            // Every third step is stopped while it works on a variant.
            steps += 1;
            stop.is_set.store(steps.is_multiple_of(3), Ordering::Relaxed);
            match work.step(&stop) {
                Ok(true) => break,
                Ok(false) => {}
                Err(_) => stopped += 1,
            }
        }
        // As text, since an absent value is not equal to itself.
        assert_eq!(format!("{:?}", work.finish()), format!("{whole:?}"), "{}", study.kind());
        assert!(stopped > 0 || study.kind() == "search", "{}", study.kind());
    }
}

/// Each quantity has an entry with a name for each input or kind of deviation.
#[test]
fn answer_size_of_many_inputs_is_known_beforehand() {
    let inputs = |what: &Value| (0..26).map(|i| (format!("/deviations/ring_space_um/{i}"), what.clone())).collect();
    let base = with(&paper(), "/deviations", json!({ "ring_space_um": vec![0.0; 26] }));
    let base = with(&base, "/model", json!({ "clearance": { "ring_um": 9.0 } }));
    let moved: serde_json::Map<_, _> = inputs(&json!({ "plus_minus": 0.5 }));
    let drawn: serde_json::Map<_, _> = inputs(&json!({ "distribution": "normal", "sigma": 0.1, "limit": 0.3 }));
    let quantities = ["peak_force_n", "peak_stress_ring_mpa", "peak_stress_carrier_mpa"];
    for document in [
        json!({ "study": "sensitivity", "base": base, "inputs": moved, "quantities": quantities }),
        json!({ "study": "tolerance", "base": base, "inputs": drawn, "quantities": quantities, "samples": 10 }),
    ] {
        let study = study(&document).unwrap();
        let mut text = Vec::new();
        gathered(&document).answer().write(Format::Json, &mut text).unwrap();
        // Names and numbers take about the size of their text.
        let (told, text) = (study.told_bytes(), text.len() as u64);
        assert!((text / 2..4 * text).contains(&told), "{told} for {text} of text: {}", document["study"]);
    }
}

#[test]
fn half_done_study_reports_what_it_has() {
    let [map, search, ..] = studies();
    for document in [map, search] {
        let study = in_chunks_of(&document, 100);
        let mut half = Gathered::new(&study);
        half.add(1, Work::new(&study, 1).run(&Never).unwrap());
        assert!(!half.is_complete());
        let answer: Value = serde_json::from_str(&text(&half, Format::Json)).unwrap();
        assert_eq!(answer["is_complete"], false);
        half.add(0, Work::new(&study, 0).run(&Never).unwrap());
        for chunk in 2..study.chunks() {
            half.add(chunk, Work::new(&study, chunk).run(&Never).unwrap());
        }
        assert_eq!(text(&half, Format::Json), text(&gathered(&document), Format::Json));
    }
}

#[test]
fn another_seed_is_another_study() {
    let [_, search, _, tolerance] = studies();
    for document in [search, tolerance] {
        let mut other = document.clone();
        other["seed"] = json!(2);
        assert_ne!(study(&document).unwrap().id(), study(&other).unwrap().id());
        assert_ne!(text(&gathered(&document), Format::Json), text(&gathered(&other), Format::Json));
    }
}

#[test]
fn study_in_any_chunk_size_has_same_bits() {
    for document in studies() {
        let whole = text(&gathered(&document), Format::Json);
        for variants in [1, 7, 1_000_000] {
            let study = in_chunks_of(&document, variants);
            let mut gathered = Gathered::new(&study);
            for chunk in (0..study.chunks()).rev() {
                gathered.add(chunk, Work::new(&study, chunk).run(&Never).unwrap());
            }
            assert!(text(&gathered, Format::Json) == whole, "{} in chunks of {variants}", study.kind());
        }
    }
}

#[test]
fn variant_alone_equals_variant_among_others() {
    let [map, _, sensitivity, tolerance] = studies();
    for document in [map, sensitivity, tolerance] {
        let study = in_chunks_of(&document, 1);
        let whole = in_chunks_of(&document, u64::MAX);
        assert_eq!((study.chunks(), whole.chunks()), (study.variants(), 1));
        let mut alone = Gathered::new(&study);
        (0..study.chunks()).for_each(|chunk| alone.add(chunk, Work::new(&study, chunk).run(&Never).unwrap()));
        let mut together = Gathered::new(&whole);
        together.add(0, Work::new(&whole, 0).run(&Never).unwrap());
        assert!(text(&alone, Format::Json) == text(&together, Format::Json));
    }
}

#[test]
fn chunks_follow_from_number_of_variants() {
    let chunks = |steps: u64| {
        let over = json!({ "/drive/teeth/radius_mm": { "min": 3.0, "max": 7.0, "steps": steps } });
        let map = json!({ "study": "map", "base": paper(), "over": over, "quantities": ["undercut"] });
        study(&map).unwrap().chunks()
    };
    assert_eq!([5, 256, 1000, 1_000_000].map(chunks), [5, 256, 250, 256]);
}
