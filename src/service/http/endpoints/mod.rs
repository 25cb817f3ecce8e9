//! The endpoints: one file each, with its handler and its description in the API document.

pub mod accuracy;
pub mod batch;
pub mod coincidence_degree;
pub mod design;
pub mod drawings;
pub mod geometry;
pub mod peaks;
pub mod service;
pub mod studies;
pub mod sweep;
