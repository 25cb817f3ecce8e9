//! How long studies take on one core: `cargo bench --bench studies`, or with a name only those that have it in theirs.
#![allow(clippy::unwrap_used, reason = "what fails here has no reader but the terminal")]

use std::sync::Arc;
use std::time::Instant;

use serde_json::{Value, json};
use toothwave_calculation::forms::{Format, Forms as _};
use toothwave_calculation::question;
use toothwave_solver::Never;
use toothwave_study::{Gathered, Limits, Study, Work};

/// The service's own.
#[global_allocator]
static ALLOCATOR: mimalloc::MiMalloc = mimalloc::MiMalloc;

const LIMITS: Limits = Limits {
    calculation: question::Limits::new(1_000_000, 1_000_000),
    max_study_variants: 1_000_000_000,
    max_study_bytes: 1 << 34,
};

/// Case 5.1 of the paper under Johnson's law.
fn paper() -> Value {
    json!({
        "drive": {
            "wave_generator": { "semi_major_mm": 58.0, "semi_minor_mm": 56.0 },
            "teeth": { "count": 28, "radius_mm": 5.0, "width_mm": 15.0 },
            "ring": { "teeth": 26 }
        },
        "load": { "input_torque_nm": 20.0 },
        "model": { "compatibility": "virtual_work", "stiffness": { "law": "johnson" } },
        "sweep": { "samples": 16 }
    })
}

fn map() -> Value {
    json!({
        "study": "map", "base": paper(),
        "over": {
            "/drive/teeth/radius_mm": { "min": 3.0, "max": 6.5, "steps": 1000 },
            "/drive/wave_generator/semi_minor_mm": { "min": 55.5, "max": 57.5, "steps": 1000 }
        },
        "quantities": ["peak_stress_ring_mpa", "torsional_stiffness_min_nm_per_rad"]
    })
}

fn search() -> Value {
    json!({
        "study": "search",
        "base": {
            "load": { "output_torque_nm": 200.0, "allowable_stress_mpa": 1500.0 },
            "model": { "compatibility": "virtual_work", "stiffness": { "law": "johnson" } },
            "friction": {
                "wave_generator": { "kind": "plain", "coefficient": 0.03 }, "ring": { "coefficient": 0.05 }, "carrier": { "coefficient": 0.05 }
            }
        },
        "require": {
            "transmission_ratio": { "min": 19.5, "max": 20.5 }, "outer_diameter_mm": { "max": 120.0 }, "undercut": false,
            "torque_capacity_output_nm": { "min": 200.0 }, "slot_wall_over_slot_width": { "min": 0.25 }
        },
        "objectives": [{ "quantity": "outer_diameter_mm", "goal": "min" }, { "quantity": "efficiency_ring_fixed", "goal": "max" }]
    })
}

fn tolerance() -> Value {
    json!({
        "study": "tolerance", "base": paper(), "samples": 10_000,
        "inputs": { "/drive/teeth/radius_mm": { "distribution": "normal", "sigma": 0.002, "limit": 0.006 } },
        "quantities": ["peak_stress_ring_mpa", "transmission_error_peak_to_peak_deg"]
    })
}

fn main() {
    let wanted: Vec<_> = std::env::args().skip(1).filter(|argument| !argument.starts_with('-')).collect();
    for (name, document) in [("map", map()), ("search", search()), ("tolerance", tolerance())] {
        if !wanted.is_empty() && !wanted.iter().any(|wanted| name.contains(wanted.as_str())) {
            continue;
        }
        let study = Arc::new(Study::read(document.to_string().as_bytes(), &LIMITS).unwrap());
        let started = Instant::now();
        let mut gathered = Gathered::new(&study);
        for chunk in 0..study.chunks() {
            gathered.add(chunk, Work::new(&study, chunk).run(&Never).unwrap());
        }
        let elapsed = started.elapsed();
        let started = Instant::now();
        let mut text = Vec::new();
        gathered.answer().write(Format::Json, &mut text).unwrap();
        println!(
            "{name}: {} variants, {:.2} s, {:.2} µs each; merged and written in {:.2} s, {} bytes",
            gathered.variants(),
            elapsed.as_secs_f64(),
            1e6 * elapsed.as_secs_f64() / gathered.variants() as f64,
            started.elapsed().as_secs_f64(),
            text.len()
        );
    }
}
