//! `POST /v1/geometry`, `/v1/coincidence-degree`, `/v1/sweep` and `/v1/accuracy`: each puts one question to one design document.

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

/// The mating parts' profiles and what a designer decides by.
#[utoipa::path(
    post,
    path = "/v1/geometry",
    tag = "drive",
    request_body(content = Design, description = "Reads `drive` and `profile`."),
    params(CsvOptions, ("If-None-Match" = Option<String>, Header, description = "Entity tags that the client has.")),
    responses(
        (status = 200, description = "The geometry.", 
            content((GeometryAnswer = "application/json"), (String = "text/plain"), (String = "text/csv"))),
        (status = 304, description = "The client has this representation already (`If-None-Match`)."),
        Problems
    )
)]
pub async fn geometry(State(app): State<Arc<App>>, request: Request) -> Response {
    respond(Geometry, app, request).await
}

/// How many teeth share the load.
#[utoipa::path(
    post,
    path = "/v1/coincidence-degree",
    tag = "drive",
    request_body(content = Design, description = "Reads `drive`."),
    params(CsvOptions, ("If-None-Match" = Option<String>, Header, description = "Entity tags that the client has.")),
    responses(
        (status = 200, description = "The coincidence degree.", 
            content((CoincidenceDegreeAnswer = "application/json"), (String = "text/plain"), (String = "text/csv"))),
        (status = 304, description = "The client has this representation already (`If-None-Match`)."),
        Problems
    )
)]
pub async fn coincidence_degree(State(app): State<Arc<App>>, request: Request) -> Response {
    respond(CoincidenceDegree, app, request).await
}

/// Forces and contact stresses over one period.
#[utoipa::path(
    post,
    path = "/v1/sweep",
    tag = "drive",
    request_body(content = Design, description = "Reads all but `profile`; `load` is required."),
    params(CsvOptions, ("If-None-Match" = Option<String>, Header, description = "Entity tags that the client has.")),
    responses(
        (status = 200, description = "The sweep. As CSV one line a state, with the names of the columns of `states`; as an Apache Arrow stream the same columns; as text a summary; as SVG its plots.",
            content((SweepAnswer = "application/json"), (String = "text/plain"), (String = "text/csv"), (String = "application/vnd.apache.arrow.stream"), (String = "image/svg+xml"))),
        (status = 304, description = "The client has this representation already (`If-None-Match`)."),
        Problems
    )
)]
pub async fn sweep(State(app): State<Arc<App>>, request: Request) -> Response {
    respond(Sweep, app, request).await
}

/// How wrong and how slow each way of computing a design is, measured there and then beside whatever else the service does; never cached.
#[utoipa::path(
    post,
    path = "/v1/accuracy",
    tag = "drive",
    request_body(content = Design, description = "Reads `drive`, `materials`, `load`, `model` and `accuracy`; `load` is required."),
    params(CsvOptions),
    responses((status = 200, description = "The ways, each with its error and its time.",
        content((AccuracyAnswer = "application/json"), (String = "text/plain"), (String = "text/csv"))), Problems)
)]
pub async fn accuracy(State(app): State<Arc<App>>, request: Request) -> Response {
    respond_uncached(Accuracy, app, request).await
}
