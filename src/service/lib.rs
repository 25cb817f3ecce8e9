//! toothwave: the calculation service for discrete-tooth harmonic drives.
//!
//! A request walks one way: bytes, document, key, cache, checked parameters, answer, bytes. This crate is HTTP and the command line.
//! Documents and answers are in `toothwave_calculation`, every formula is in `toothwave_solver`.

pub mod app;
pub mod cli;
pub mod compute;
pub mod http;
pub mod ops;
pub mod page;
pub mod studies;
