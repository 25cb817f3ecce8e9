//! One design document in, one answer out.
//!
//! The way is bytes → [`Design`](design::Design) → checked parameters → answer → bytes, and [`Question`](question::Question) is that way. What stands
//! in its middle is `toothwave_solver`'s; here are the document, the answers, and the forms that they are written in. The crate knows no
//! network: whoever calls it decides where it runs, what is kept, and what a client is told.

/// The id of this build, beside [`toothwave_solver::VERSION`] in every answer: a hash of its sources, its dependencies and its target.
pub const BUILD: &str = env!("TOOTHWAVE_BUILD");

pub mod accuracy;
mod arithmetic;
pub mod coincidence_degree;
pub mod columns;
pub mod convert;
mod decimal_comma;
pub mod design;
pub mod drawing;
pub mod field;
pub mod findings;
pub mod forms;
pub mod geometry;
pub mod json;
pub mod key;
pub mod materials;
pub mod no_answer;
pub mod question;
pub mod schema_ranges;
pub mod strengths;
pub mod sweep;
pub mod union;

pub use arithmetic::origin;
