//! Tests of studies.
#![allow(
    clippy::float_cmp,
    clippy::unwrap_used,
    reason = "tests compare exactly where values are exact, and fail by panicking"
)]

mod asking;
mod conflicts;
mod conversion;
mod defaults;
mod deviations;
mod engine;
mod maps;
mod parts;
mod searches;
mod tables;
