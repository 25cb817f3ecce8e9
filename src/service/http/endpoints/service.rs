//! Endpoints for limits, examples, materials, health and metrics.

use std::sync::Arc;
use std::sync::atomic::Ordering;

use axum::Json;
use axum::extract::rejection::PathRejection;
use axum::extract::{Path, State};
use axum::http::{StatusCode, header};
use axum::response::{IntoResponse, Response};
use serde::Serialize;
use toothwave_calculation::design::Design;
use toothwave_calculation::materials::{MATERIALS, MaterialPreset};
use utoipa::ToSchema;

use crate::app::App;
use crate::http::examples::{EXAMPLES, Example};
use crate::http::problem::{Problem, ProblemCode};
use crate::ops::config::Limits;
use crate::ops::metrics;

/// Returns the limits of this service.
#[utoipa::path(get, path = "/v1/limits", tag = "service", responses((status = 200, description = "The limits.", body = Limits)))]
pub async fn limits(State(app): State<Arc<App>>) -> Json<Limits> {
    Json(app.limits)
}

/// List of the example design documents.
#[derive(Debug, Serialize, ToSchema)]
pub struct ExamplesAnswer {
    /// The examples.
    pub examples: &'static [Example],
}

/// Lists the example design documents.
#[utoipa::path(get, path = "/v1/examples", tag = "service", responses((status = 200, description = "The examples.", body = ExamplesAnswer)))]
pub async fn examples() -> Json<ExamplesAnswer> {
    Json(ExamplesAnswer { examples: EXAMPLES })
}

/// List of the named materials.
#[derive(Debug, Serialize, ToSchema)]
pub struct MaterialsAnswer {
    /// The materials.
    pub materials: &'static [MaterialPreset],
}

/// Lists materials by name, to copy into a design document. Each number has its published source.
#[utoipa::path(get, path = "/v1/materials", tag = "service", responses((status = 200, description = "The materials.", body = MaterialsAnswer)))]
pub async fn materials() -> Json<MaterialsAnswer> {
    Json(MaterialsAnswer { materials: &MATERIALS })
}

/// Returns an example design document. Every endpoint accepts it unchanged.
#[utoipa::path(
    get,
    path = "/v1/examples/{name}",
    tag = "service",
    params(("name" = String, Path, description = "Name from `/v1/examples`.", example = "paper-5.1")),
    responses(
        (status = 200, description = "The design document.", body = Design),
        (status = 404, description = "No example has this name.", body = Problem, content_type = "application/problem+json")
    )
)]
pub async fn example(name: Result<Path<String>, PathRejection>) -> Response {
    // A path segment that is not UTF-8 is an unknown name.
    let name = name.map(|Path(name)| name).unwrap_or_default();
    match EXAMPLES.iter().find(|example| example.name == name) {
        Some(example) => ([(header::CONTENT_TYPE, "application/json")], example.document).into_response(),
        None => {
            let names: Vec<_> = EXAMPLES.iter().map(|example| example.name).collect();
            let detail = format!("there is no example `{name}`. Use one of: {}", names.join(", "));
            Problem::new(ProblemCode::NotFound, detail).into_response()
        }
    }
}

/// Checks that the process answers.
#[utoipa::path(get, path = "/health/live", tag = "service", responses((status = 200, description = "The process answers.", body = String, content_type = "text/plain")))]
pub async fn live() -> &'static str {
    "live\n"
}

/// Checks that the service accepts requests.
#[utoipa::path(
    get,
    path = "/health/ready",
    tag = "service",
    responses(
        (status = 200, description = "The service accepts requests.", body = String, content_type = "text/plain"),
        (status = 503, description = "The service is stopping.", body = String, content_type = "text/plain")
    )
)]
pub async fn ready(State(app): State<Arc<App>>) -> (StatusCode, &'static str) {
    if app.ready.load(Ordering::Relaxed) {
        (StatusCode::OK, "ready\n")
    } else {
        (StatusCode::SERVICE_UNAVAILABLE, "draining\n")
    }
}

/// Returns metrics in the Prometheus text format.
#[utoipa::path(get, path = "/metrics", tag = "service", responses((status = 200, description = "The metrics.", body = String, content_type = "text/plain")))]
pub async fn metrics(State(app): State<Arc<App>>) -> Response {
    let content_type = [(header::CONTENT_TYPE, "text/plain; version=0.0.4; charset=utf-8")];
    (content_type, metrics::render(&app)).into_response()
}
