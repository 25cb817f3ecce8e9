//! The engine: chunks are pure, and merged in any order to the same bits.

use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};

use rayon::prelude::*;
use serde_json::{Value, json};
use toothwave_calculation::forms::Format;
use toothwave_solver::{Never, Stop};
use toothwave_study::{Gathered, Part, Work};

use crate::asking::{gathered, paper, study, text};

/// A study of each kind, each of several chunks.
fn studies() -> [Value; 4] {
    let radius = |steps: u64| json!({ "min": 3.0, "max": 7.5, "steps": steps });
    let normal = json!({ "distribution": "normal", "sigma": 0.01, "limit": 0.03 });
    [
        json!({
            "study": "map", "base": paper(), "quantities": ["peak_stress_ring_mpa", "slot_wall_mm"],
            "over": { "/drive/teeth/radius_mm": radius(70), "/load/input_torque_nm": { "min": 10, "max": 20, "steps": 70 } }
        }),
        json!({
            "study": "search", "base": paper(), "evaluations": 12_500,
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

/// A part as a store would keep it.
fn kept(part: &Part) -> Part {
    serde_json::from_str(&serde_json::to_string(part).unwrap()).unwrap()
}

#[test]
fn a_study_has_the_same_bits_in_any_order_of_its_chunks_from_any_store_and_on_any_number_of_threads() {
    for document in studies() {
        let one_thread = text(&gathered(&document), Format::Json);
        let study = study(&document).unwrap();
        let several = Mutex::new(Gathered::new(&study));
        let pool = rayon::ThreadPoolBuilder::new().num_threads(2).build().unwrap();
        pool.install(|| {
            let chunks: Vec<_> = (0..study.chunks()).rev().collect();
            chunks.into_par_iter().for_each(|chunk| {
                let part = kept(&Work::new(&study, chunk).run(&Never).unwrap());
                several.lock().unwrap().add(chunk, part.clone());
                // A second time, as where two workers had the same chunk.
                several.lock().unwrap().add(chunk, part);
            });
        });
        let several = several.into_inner().unwrap();
        assert!(several.is_complete());
        assert_eq!(text(&several, Format::Json), one_thread, "{}", study.kind());
    }
}

/// Stops when it is asked a certain time.
struct Times {
    is_set: AtomicBool,
}

impl Stop for Times {
    fn stopped(&self) -> bool {
        self.is_set.load(Ordering::Relaxed)
    }
}

#[test]
fn a_chunk_that_is_stopped_and_taken_up_again_has_the_same_bits() {
    for document in studies() {
        let study = study(&document).unwrap();
        let whole = Work::new(&study, 0).run(&Never).unwrap();
        let stop = Times { is_set: AtomicBool::new(false) };
        let mut work = Work::new(&study, 0);
        let mut stopped = 0;
        let mut steps = 0_u32;
        loop {
            // Every third time it is told to stop while it works on a variant.
            steps += 1;
            stop.is_set.store(steps.is_multiple_of(3), Ordering::Relaxed);
            match work.step(&stop) {
                Ok(true) => break,
                Ok(false) => {}
                Err(_) => stopped += 1,
            }
        }
        assert_eq!(work.finish(), whole, "{}", study.kind());
        assert!(stopped > 0 || study.kind() == "search", "{}", study.kind());
    }
}

#[test]
fn a_study_that_is_half_done_tells_what_it_has() {
    let [map, search, ..] = studies();
    for document in [map, search] {
        let study = study(&document).unwrap();
        let mut half = Gathered::new(&study);
        half.add(1, Work::new(&study, 1).run(&Never).unwrap());
        assert!(!half.is_complete() && half.missing().eq((0..study.chunks()).filter(|&chunk| chunk != 1)));
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
