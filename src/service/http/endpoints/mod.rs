//! The endpoints: each handler with its description in the API document.

pub mod batch;
pub mod calculations;
pub mod design;
pub mod drawings;
pub mod service;
pub mod studies;
