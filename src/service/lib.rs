//! toothwave: the calculation service for discrete-tooth harmonic drives.
//!
//! A request takes one path: bytes, document, key, cache, checked parameters, answer, bytes. Bytes that were seen before
//! lead to their key at once. This crate contains HTTP
//! and the command line. `toothwave_calculation` contains documents and answers, and `toothwave_solver` the formulas.

pub mod app;
pub mod cli;
pub mod compute;
pub mod http;
pub mod ops;
pub mod page;
pub mod studies;
pub mod unix;
