//! `POST /v1/geometry`, `/v1/coincidence-degree`, `/v1/sweep`, `/v1/accuracy`: one calculation for one document.

use std::sync::Arc;

use axum::extract::{Request, State};
use axum::response::Response;
use toothwave_calculation::accuracy::{Accuracy, AccuracyAnswer};
use toothwave_calculation::coincidence_degree::{CoincidenceDegree, CoincidenceDegreeAnswer};
use toothwave_calculation::design::Design;
use toothwave_calculation::forms::CsvOptions;
use toothwave_calculation::geometry::{Geometry, GeometryAnswer};
use toothwave_calculation::sweep::Sweep;
use toothwave_calculation::sweep::answer::SweepAnswer;

use crate::app::App;
use crate::http::answer::{Problems, respond, respond_uncached};

/// Computes the profiles of the mating parts and the key figures of the geometry.
#[utoipa::path(
    post,
    path = "/v1/geometry",
    tag = "drive",
    request_body(content = Design, description = "A design document. This endpoint reads `drive` and `profile`."),
    params(CsvOptions, ("If-None-Match" = Option<String>, Header, description = "Entity tags of the responses that the client has.")),
    responses(
        (status = 200, description = "The profiles and key figures.", 
            content((GeometryAnswer = "application/json"), (String = "text/plain"), (String = "text/csv"))),
        (status = 304, description = "The client already has this representation (`If-None-Match`)."),
        Problems
    )
)]
pub async fn geometry(State(app): State<Arc<App>>, request: Request) -> Response {
    respond(Geometry, app, request).await
}

/// Computes the contact ratio (coincidence degree): how many teeth share the load.
#[utoipa::path(
    post,
    path = "/v1/coincidence-degree",
    tag = "drive",
    request_body(content = Design, description = "A design document. This endpoint reads `drive`."),
    params(CsvOptions, ("If-None-Match" = Option<String>, Header, description = "Entity tags of the responses that the client has.")),
    responses(
        (status = 200, description = "The contact ratio.", 
            content((CoincidenceDegreeAnswer = "application/json"), (String = "text/plain"), (String = "text/csv"))),
        (status = 304, description = "The client already has this representation (`If-None-Match`)."),
        Problems
    )
)]
pub async fn coincidence_degree(State(app): State<Arc<App>>, request: Request) -> Response {
    respond(CoincidenceDegree, app, request).await
}

/// Computes forces and contact stresses over one period.
#[utoipa::path(
    post,
    path = "/v1/sweep",
    tag = "drive",
    request_body(content = Design, description = "A design document. This endpoint reads all of it except `profile`. `load` is required."),
    params(CsvOptions, ("If-None-Match" = Option<String>, Header, description = "Entity tags of the responses that the client has.")),
    responses(
        (status = 200, description = "The sweep. CSV has one line for each state and the columns of `states`. The Apache Arrow stream has the same columns. Text is a summary, and SVG has the plots.",
            content((SweepAnswer = "application/json"), (String = "text/plain"), (String = "text/csv"), (String = "application/vnd.apache.arrow.stream"), (String = "image/svg+xml"))),
        (status = 304, description = "The client already has this representation (`If-None-Match`)."),
        Problems
    )
)]
pub async fn sweep(State(app): State<Arc<App>>, request: Request) -> Response {
    respond(Sweep, app, request).await
}

/// Measures the error and the time of each computation method.
/// The result depends on the load of the machine and is never cached.
#[utoipa::path(
    post,
    path = "/v1/accuracy",
    tag = "drive",
    request_body(content = Design, description = "A design document. This endpoint reads `drive`, `materials`, `load`, `model` and `accuracy`. `load` is required."),
    params(CsvOptions),
    responses((status = 200, description = "The methods, each with its error and its time.",
        content((AccuracyAnswer = "application/json"), (String = "text/plain"), (String = "text/csv"))), Problems)
)]
pub async fn accuracy(State(app): State<Arc<App>>, request: Request) -> Response {
    respond_uncached(Accuracy, app, request).await
}
