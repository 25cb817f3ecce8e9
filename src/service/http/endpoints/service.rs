//! Limits, examples, materials, health, metrics.

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
use crate::http::examples::{self, EXAMPLES};
use crate::http::problem::{Problem, ProblemCode};
use crate::ops::config::Limits;
use crate::ops::metrics;

/// The limits of this service.
#[utoipa::path(get, path = "/v1/limits", tag = "service", responses((status = 200, description = "The limits.", body = Limits)))]
pub async fn limits(State(app): State<Arc<App>>) -> Json<Limits> {
    Json(app.limits)
}

/// The ready design documents.
#[derive(Debug, Serialize, ToSchema)]
pub struct ExamplesAnswer {
    /// All of them.
    pub examples: Vec<ExampleAnswer>,
}

/// A ready design document.
#[derive(Debug, Serialize, ToSchema)]
pub struct ExampleAnswer {
    /// Its name.
    pub name: &'static str,
    /// What it shows.
    pub title: &'static str,
    /// Where it stands.
    pub href: String,
}

/// The ready design documents by name.
#[utoipa::path(get, path = "/v1/examples", tag = "service", responses((status = 200, description = "The examples.", body = ExamplesAnswer)))]
pub async fn examples() -> Json<ExamplesAnswer> {
    let examples = EXAMPLES.iter().map(|example| ExampleAnswer {
        name: example.name,
        title: example.title,
        href: format!("/v1/examples/{}", example.name),
    });
    Json(ExamplesAnswer { examples: examples.collect() })
}

/// Materials that designers know by name.
#[derive(Debug, Serialize, ToSchema)]
pub struct MaterialsAnswer {
    /// All of them.
    pub materials: &'static [MaterialPreset],
}

/// Materials by name, each number with its published source, to be copied into a design document.
#[utoipa::path(get, path = "/v1/materials", tag = "service", responses((status = 200, description = "The materials.", body = MaterialsAnswer)))]
pub async fn materials() -> Json<MaterialsAnswer> {
    Json(MaterialsAnswer { materials: &MATERIALS })
}

/// One ready design document, to be sent to any endpoint as it is.
#[utoipa::path(
    get,
    path = "/v1/examples/{name}",
    tag = "service",
    params(("name" = String, Path, description = "As in `/v1/examples`.", example = "paper-5.1")),
    responses(
        (status = 200, description = "The document.", body = Design),
        (status = 404, description = "No example has this name.", body = Problem, content_type = "application/problem+json")
    )
)]
pub async fn example(name: Result<Path<String>, PathRejection>) -> Response {
    // A name that is no text is no example's either.
    let name = name.map(|Path(name)| name).unwrap_or_default();
    match examples::by_name(&name) {
        Some(example) => ([(header::CONTENT_TYPE, "application/json")], example.document).into_response(),
        None => {
            let names: Vec<_> = EXAMPLES.iter().map(|example| example.name).collect();
            let detail = format!("no example is called `{name}`; there are {}", names.join(", "));
            Problem::new(ProblemCode::NotFound, detail).into_response()
        }
    }
}

/// The process answers.
#[utoipa::path(get, path = "/health/live", tag = "service", responses((status = 200, description = "It does.", body = String, content_type = "text/plain")))]
pub async fn live() -> &'static str {
    "live\n"
}

/// The service wants requests.
#[utoipa::path(
    get,
    path = "/health/ready",
    tag = "service",
    responses(
        (status = 200, description = "It does.", body = String, content_type = "text/plain"),
        (status = 503, description = "It is shutting down.", body = String, content_type = "text/plain")
    )
)]
pub async fn ready(State(app): State<Arc<App>>) -> (StatusCode, &'static str) {
    if app.ready.load(Ordering::Relaxed) {
        (StatusCode::OK, "ready\n")
    } else {
        (StatusCode::SERVICE_UNAVAILABLE, "draining\n")
    }
}

/// Metrics in Prometheus' text format.
#[utoipa::path(get, path = "/metrics", tag = "service", responses((status = 200, description = "The metrics.", body = String, content_type = "text/plain")))]
pub async fn metrics(State(app): State<Arc<App>>) -> Response {
    let content_type = [(header::CONTENT_TYPE, "text/plain; version=0.0.4; charset=utf-8")];
    (content_type, metrics::render(&app)).into_response()
}
