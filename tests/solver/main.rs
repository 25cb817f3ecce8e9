//! Tests of the solver against closed forms, independent constructions and a 60-digit calculation.
#![allow(clippy::float_cmp, clippy::unwrap_used, reason = "tests compare exactly where values are exact")]

mod backing;
mod backlash;
mod contacts;
mod corners;
mod deviations;
mod drives;
mod extremes;
mod family;
mod fast;
mod finger_strength;
mod fingers;
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

/// Counts allocations of each thread, for tests of a sweep's memory.
#[global_allocator]
static ALLOCATOR: alloc_counter::AllocCounterSystem = alloc_counter::AllocCounterSystem;
