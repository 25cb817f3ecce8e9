//! `POST /v1/geometry`: the mating parts' profiles and what a designer decides by.

use std::sync::Arc;

use axum::extract::{Request, State};
use axum::response::Response;
use toothwave_calculation::design::Design;
use toothwave_calculation::geometry::{Geometry, GeometryAnswer};

use crate::app::App;
use crate::http::answer::{Problems, respond};

/// The mating parts' profiles and what a designer decides by.
#[utoipa::path(
    post,
    path = "/v1/geometry",
    tag = "drive",
    request_body(content = Design, description = "Reads `drive` and `profile`."),
    params(("If-None-Match" = Option<String>, Header, description = "Entity tags that the client has.")),
    responses(
        (status = 200, description = "The geometry.", 
            content((GeometryAnswer = "application/json"), (String = "text/plain"), (String = "text/csv")), headers(
                ("ETag" = String, description = "Entity tag of this representation."),
                ("Cache-Status" = String, description = "RFC 9211: `hit`, `fwd=miss`, `collapsed`."),
                ("Server-Timing" = String, description = "`solve;dur=` and the milliseconds of the solve.")
            )),
        (status = 304, description = "The client has this representation already (`If-None-Match`)."),
        Problems
    )
)]
pub async fn geometry(State(app): State<Arc<App>>, request: Request) -> Response {
    respond(Geometry, app, request).await
}
