//! `POST /v1/sweep`: forces and contact stresses over one period.

use std::sync::Arc;

use axum::extract::{Request, State};
use axum::response::Response;
use toothwave_calculation::design::Design;
use toothwave_calculation::sweep::Sweep;
use toothwave_calculation::sweep::answer::SweepAnswer;

use crate::app::App;
use crate::http::answer::{Problems, respond};

/// Forces and contact stresses over one period.
#[utoipa::path(
    post,
    path = "/v1/sweep",
    tag = "drive",
    request_body(content = Design, description = "Reads all but `profile`; `load` is required."),
    params(("If-None-Match" = Option<String>, Header, description = "Entity tags that the client has.")),
    responses(
        (status = 200, description = "The sweep. As CSV one line a state, with the names of the columns of `states`; as an Apache Arrow stream the same columns; as text a summary; as SVG its plots.",
            content((SweepAnswer = "application/json"), (String = "text/plain"), (String = "text/csv"), (String = "application/vnd.apache.arrow.stream"), (String = "image/svg+xml")), headers(
                ("ETag" = String, description = "Entity tag of this representation."),
                ("Cache-Status" = String, description = "RFC 9211: `hit`, `fwd=miss`, `collapsed`."),
                ("Server-Timing" = String, description = "`solve;dur=` and the milliseconds of the solve.")
            )),
        (status = 304, description = "The client has this representation already (`If-None-Match`)."),
        Problems
    )
)]
pub async fn sweep(State(app): State<Arc<App>>, request: Request) -> Response {
    respond(Sweep, app, request).await
}
