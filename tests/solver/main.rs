//! What is true of drives: against closed forms, independent constructions and a 60-digit calculation.
#![allow(clippy::float_cmp, clippy::unwrap_used, reason = "tests compare exactly where values are exact")]

mod backing;
mod contacts;
mod corners;
mod deviations;
mod drives;
mod extremes;
mod family;
mod fast;
mod finite_elements;
mod gaps;
mod laws;
mod limits;
mod losses;
mod modified_parts;
mod moving;
mod oracles;
mod paper;
mod parts;
mod profiles;
mod properties;
mod reference;
mod ring_bending;
mod springs;
mod tolerances;
mod true_peaks;
mod unloaded;

/// Counts, thread by thread, for the tests that ask what a sweep takes.
#[global_allocator]
static ALLOCATOR: alloc_counter::AllocCounterSystem = alloc_counter::AllocCounterSystem;
