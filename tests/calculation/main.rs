//! What is true of documents and of what tells them apart.
#![allow(clippy::unwrap_used, reason = "tests fail by panicking")]

mod contradictions;
mod defaults;
mod documents;
mod losses;
mod reference;
mod schema;
mod tables;
