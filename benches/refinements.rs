//! What the refinements of the model cost: one solve of the ring's boundary elements, and three duty points with wear against the same without them.
//!
//! `cargo bench -p toothwave-calculation --bench refinements`

use std::hint::black_box;
use std::time::Instant;

use serde_json::{Value, json};
use toothwave_calculation::design::Design;
use toothwave_calculation::question::{Limits, Question};
use toothwave_calculation::sweep::Sweep;
use toothwave_solver::ring_bending::RingBending;
use toothwave_solver::{Drive, Material, Never};

const LIMITS: Limits = Limits::new(1_000_000, 1_000_000);

const ROUNDS: usize = 201;

/// Case 5.2 with a tooth radius.
fn case_5_2(tooth_radius_mm: f64) -> Value {
    json!({
        "drive": {
            "wave_generator": { "semi_major_mm": 50.7, "semi_minor_mm": 49.3 },
            "teeth": { "count": 84, "installed": 42, "radius_mm": tooth_radius_mm, "width_mm": 10.0 },
            "ring": { "teeth": 82 }
        }
    })
}

/// The median time of calls that take turns, in µs.
fn median_us<const N: usize>(mut calls: [&mut dyn FnMut(); N]) -> [f64; N] {
    let mut times = [const { Vec::new() }; N];
    for _ in 0..ROUNDS {
        for (call, times) in calls.iter_mut().zip(&mut times) {
            let started = Instant::now();
            call();
            times.push(1e6 * started.elapsed().as_secs_f64());
        }
    }
    times.map(|mut times| {
        times.sort_by(f64::total_cmp);
        times[ROUNDS / 2]
    })
}

fn drive(document: &Value) -> Drive {
    let design = Design::read(document.to_string().as_bytes()).expect("a document");
    Drive::new(&design.drive_parameters()).expect("a drive")
}

fn main() {
    // Another ring each time: the last one is remembered.
    let rings = [drive(&case_5_2(1.5)), drive(&case_5_2(1.51))];
    let mut at = 0;
    let mut solve = || {
        at = 1 - at;
        black_box(RingBending::new(&rings[at], &Material::STEEL).expect("a solution"));
    };
    let duty = |input_torque_nm: f64, share_of_time: f64| json!({ "input_torque_nm": input_torque_nm, "input_speed_rpm": 1500.0, "share_of_time": share_of_time });
    let asked = |tooth_radius_mm: f64, refinements: &str| {
        let mut document = case_5_2(tooth_radius_mm);
        document["load"] = json!({ "duty": [duty(3.0, 0.2), duty(2.0, 0.3), duty(1.0, 0.5)] });
        let contact = json!({ "coefficient": 0.05 });
        document["friction"] = json!({
            "wave_generator": { "kind": "plain", "coefficient": 0.05 }, "ring": contact, "carrier": contact,
            "wear_rate_mm3_per_nm": { "ring": 1e-8 }
        });
        document["model"] = json!({ "refinements": refinements });
        document.to_string()
    };
    let refined = [asked(1.5, "auto"), asked(1.51, "auto")];
    let plain = asked(1.5, "none");
    let ask = |document: &str| {
        black_box(Sweep.ask(document.as_bytes(), &LIMITS, &Never).expect("an answer"));
    };
    let mut next = 0;
    let mut auto = || {
        next = 1 - next;
        ask(&refined[next]);
    };
    let mut same = || ask(&refined[0]);
    let mut none = || ask(&plain);
    let [solve_us, auto_us, _, same_us, none_us] =
        median_us([&mut solve, &mut auto, &mut || ask(&refined[0]), &mut same, &mut none]);
    println!("one solve of the boundary elements     {solve_us:8.1} µs");
    println!(
        "three duty points with wear, `auto`    {auto_us:8.1} µs, of a ring that was solved before {same_us:.1} µs"
    );
    println!("the same, `none`                       {none_us:8.1} µs");
    println!("`auto` over (1.5 `none` and one solve) {:8.2}", auto_us / (1.5 * none_us + solve_us));
}
