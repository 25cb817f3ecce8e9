//! toothwave: the calculation service for discrete-tooth harmonic drives.
//!
//! A request walks one way: document → drive → key → cache → solver → columns → bytes. This crate is HTTP and the command
//! line; every formula is in `toothwave_solver`.

pub mod api;
pub mod cache;
pub mod cli;
pub mod columns;
pub mod compute;
pub mod config;
pub mod design;
pub mod dxf;
pub mod examples;
pub mod findings;
pub mod json;
pub mod keys;
pub mod negotiation;
pub mod observe;
mod openapi;
pub mod plots;
pub mod problem;
pub mod room;
pub mod router;
pub mod serve;
pub mod step;
pub mod svg;
