//! Tests of design documents and their answers.
#![allow(clippy::unwrap_used, reason = "tests fail by panicking")]

mod columns;
mod contradictions;
mod defaults;
mod documents;
mod losses;
mod reference;
mod schema;
mod tables;
