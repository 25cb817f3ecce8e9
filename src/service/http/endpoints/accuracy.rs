//! `POST /v1/accuracy`: how wrong and how slow each way of computing a design is.

use std::sync::Arc;

use axum::extract::{Request, State};
use axum::response::Response;
use toothwave_calculation::accuracy::{Accuracy, AccuracyAnswer};
use toothwave_calculation::design::Design;

use crate::app::App;
use crate::http::answer::{Problems, respond_afresh};

/// How wrong and how slow each way of computing a design is, measured there and then beside whatever else the service does; never cached.
#[utoipa::path(
    post,
    path = "/v1/accuracy",
    tag = "drive",
    request_body(content = Design, description = "Reads `drive`, `materials`, `load`, `model` and `accuracy`; `load` is required."),
    responses((status = 200, description = "The ways, each with its error and its time.",
        content((AccuracyAnswer = "application/json"), (String = "text/plain"), (String = "text/csv"))), Problems)
)]
pub async fn accuracy(State(app): State<Arc<App>>, request: Request) -> Response {
    respond_afresh(Accuracy, app, request).await
}
