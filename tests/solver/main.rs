//! What is true of drives: against closed forms, independent constructions and a 60-digit calculation.

mod drives;
mod paper;
