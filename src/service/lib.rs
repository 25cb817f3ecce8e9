//! toothwave: the calculation service for discrete-tooth harmonic drives.
//!
//! A request walks one way: bytes → document → key → cache → checked parameters → answer → bytes. This crate is HTTP and the command
//! line; documents and answers are in `toothwave_calculation`, every formula is in `toothwave_solver`.

pub mod api;
pub mod app;
pub mod beside;
pub mod cache;
pub mod cli;
pub mod compute;
pub mod config;
pub mod examples;
pub mod frozen;
#[cfg(feature = "fault-injection")]
mod injected;
pub mod keys;
pub mod log;
pub mod machine;
pub mod memory;
pub mod negotiation;
pub mod observe;
mod openapi;
pub mod parts;
pub mod problem;
pub mod query;
pub mod queue;
pub mod room;
pub mod router;
pub mod serve;
pub mod shelf;
pub mod socket;
pub mod static_file;
pub mod studies;
pub mod turns;
pub mod worker;
