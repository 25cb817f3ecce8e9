//! The endpoints: handlers with their descriptions for the API document.

pub mod batch;
pub mod calculations;
pub mod design;
pub mod drawings;
pub mod service;
pub mod studies;
