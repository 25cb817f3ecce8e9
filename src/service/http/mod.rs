//! HTTP: connections, routes, request processing, problems.

pub mod answer;
pub mod docs;
pub mod endpoints;
pub mod examples;
pub mod negotiation;
pub(crate) mod observe;
mod openapi;
pub mod problem;
pub mod router;
pub mod server;
