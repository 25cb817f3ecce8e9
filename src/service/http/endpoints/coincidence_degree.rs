//! `POST /v1/coincidence-degree`: how many teeth share the load.

use std::sync::Arc;

use axum::extract::{Request, State};
use axum::response::Response;
use toothwave_calculation::coincidence_degree::{CoincidenceDegree, CoincidenceDegreeAnswer};
use toothwave_calculation::design::Design;

use crate::app::App;
use crate::http::answer::{Problems, respond};

/// How many teeth share the load.
#[utoipa::path(
    post,
    path = "/v1/coincidence-degree",
    tag = "drive",
    request_body(content = Design, description = "Reads `drive`."),
    params(("If-None-Match" = Option<String>, Header, description = "Entity tags that the client has.")),
    responses(
        (status = 200, description = "The coincidence degree.", 
            content((CoincidenceDegreeAnswer = "application/json"), (String = "text/plain"), (String = "text/csv")), headers(
                ("ETag" = String, description = "Entity tag of this representation."),
                ("Cache-Status" = String, description = "RFC 9211: `hit`, `fwd=miss`, `collapsed`."),
                ("Server-Timing" = String, description = "`solve;dur=` and the milliseconds of the solve.")
            )),
        (status = 304, description = "The client has this representation already (`If-None-Match`)."),
        Problems
    )
)]
pub async fn coincidence_degree(State(app): State<Arc<App>>, request: Request) -> Response {
    respond(CoincidenceDegree, app, request).await
}
