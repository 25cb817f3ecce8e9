//! How long the answer to a sweep takes in Rust, in µs, for benches/python/run: `cargo bench --bench answer -- design.json`
#![allow(clippy::unwrap_used, reason = "what fails here has no reader but the terminal")]

use std::hint::black_box;
use std::time::Instant;

use toothwave_calculation::question::{Limits, Never, Question as _};
use toothwave_calculation::sweep::Sweep;

/// That of the Python package.
#[global_allocator]
static ALLOCATOR: mimalloc::MiMalloc = mimalloc::MiMalloc;

const RUNS: usize = 400;

fn main() {
    // Cargo adds `--bench`.
    let file = std::env::args().skip(1).find(|argument| argument != "--bench").unwrap();
    let document = std::fs::read(file).unwrap();
    let mut times_us: Vec<_> = (0..RUNS)
        .map(|_| {
            let started = Instant::now();
            black_box(Sweep.ask(&document, &Limits::OFFLINE, &Never).unwrap());
            started.elapsed().as_secs_f64() * 1e6
        })
        .collect();
    times_us.sort_by(f64::total_cmp);
    println!("{:.1}", times_us[RUNS / 2]);
}
