//! Losses of a tolerance sweep.

use serde_json::{Value, json};
use toothwave_calculation::question::{Limits, Question};
use toothwave_calculation::sweep::Sweep;
use toothwave_solver::Never;

const LIMITS: Limits = Limits::new(10_000_000, 1_000_000);

fn loss_ratio(document: &Value, sweep: Value) -> f64 {
    let mut document = document.clone();
    document["sweep"] = sweep;
    let answer = Sweep.ask(document.to_string().as_bytes(), &LIMITS, &Never).unwrap_or_else(|error| panic!("{error}"));
    answer.losses.unwrap().totals.loss_ratio
}

/// Returns a document with corner contact, gaps, and teeth that change their rolling contact within a period.
fn document() -> Value {
    json!({
        "drive": {
            "wave_generator": { "kind": "harmonic_path", "lobes": 7, "mean_path_radius_mm": 10.562873653723775, "amplitude_mm": 0.18394887731394402 },
            "teeth": { "count": 70, "radius_mm": 0.3434915807268858, "width_mm": 7.000694799097843 },
            "ring": { "teeth": 63, "tip_radius_mm": 11.000808725890401 }
        },
        "load": { "output_torque_nm": 0.0021102298661868106 },
        "model": { "refinements": ["corner_contact"] },
        "parts": { "ring": { "clearance_um": 0.43920700597152573 }, "carrier": { "clearance_um": 0.2168038949002652 } },
        "friction": {
            "wave_generator": { "kind": "plain", "coefficient": 0.01 },
            "ring": { "coefficient": 0.05386324293103281 },
            "carrier": { "coefficient": 0.0 }
        }
    })
}

#[test]
fn losses_keep_tolerance_of_sweep() {
    let finest = loss_ratio(&document(), json!({ "tolerance": 1e-10 }));
    let equal = loss_ratio(&document(), json!({ "samples": 64_000 }));
    assert!((finest / equal - 1.0).abs() < 1e-7, "{finest} and {equal}");
    for tolerance in [1e-2, 1e-4, 1e-6, 1e-9] {
        let found = loss_ratio(&document(), json!({ "tolerance": tolerance }));
        assert!((found / finest - 1.0).abs() <= tolerance, "{tolerance}: {found} and {finest}");
    }
}

#[test]
fn losses_do_not_depend_on_wind_up() {
    let tolerance = 1e-2;
    let alone = loss_ratio(&document(), json!({ "tolerance": tolerance }));
    let besides = loss_ratio(&document(), json!({ "tolerance": tolerance, "wind_up": true }));
    assert_eq!(alone.to_bits(), besides.to_bits());
}
