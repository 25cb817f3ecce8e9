//! Operation of the service: settings, log, metrics, keys.

pub mod config;
pub mod keys;
pub mod log;
pub mod metrics;
