//! `POST /v1/drawings/{part}`: outlines of one part or of the assembly.

use std::sync::Arc;

use axum::extract::rejection::PathRejection;
use axum::extract::{Path, Request, State};
use axum::http::Uri;
use axum::response::{IntoResponse, Response};
use toothwave_calculation::design::Design;
use toothwave_calculation::drawing::preset::DrawingOptions;
use toothwave_calculation::drawing::{Drawing, DrawingAnswer, DrawnPart};
use toothwave_calculation::json;

use crate::app::App;
use crate::http::answer::{Problems, respond};
use crate::http::negotiation::query;
use crate::http::problem::{Problem, ProblemCode};

/// Draws the sections of one part, or of the assembly.
#[utoipa::path(
    post,
    path = "/v1/drawings/{part}",
    tag = "drive",
    request_body(content = Design, description = "A design document. This endpoint reads `drive`, `parts` and `profile.chord_tolerance_mm`; the part `assembly` also reads `assembly`."),
    params(
        ("part" = DrawnPart, Path, description = "The part.", example = "ring"),
        DrawingOptions,
        ("If-None-Match" = Option<String>, Header, description = "Entity tags of the responses that the client has.")
    ),
    responses(
        (status = 200, description = "The drawing. DXF (AutoCAD 2000, millimetres) has one layer for each part; an outline is a circle or a closed polyline of lines and arcs, true to the chord tolerance. SVG has the same in millimetres. STEP (AP214) has one solid for each prism, in its position; circles are cylinders, other curves are polynomials. 3MF and STL have closed meshes, true to the chord tolerance.",
            content((DrawingAnswer = "application/json"), (String = "image/svg+xml"), (String = "image/vnd.dxf"), (String = "model/step"), (String = "model/3mf"), (String = "model/stl"))),
        (status = 304, description = "The client already has this representation (`If-None-Match`)."),
        (status = 404, description = "The part is unknown.", body = Problem, content_type = "application/problem+json"),
        Problems
    )
)]
pub async fn drawing(
    State(app): State<Arc<App>>,
    part: Result<Path<DrawnPart>, PathRejection>,
    mut request: Request,
) -> Response {
    let Ok(Path(part)) = part else {
        let known: Vec<_> = DrawnPart::ALL.iter().map(json::word).collect();
        let detail = format!("the part is unknown. Use one of: {}", known.join(", "));
        return Problem::new(ProblemCode::NotFound, detail).into_response();
    };
    let DrawingOptions { preset } = match query(request.uri()) {
        Ok(options) => options,
        Err(problem) => return problem.into_response(),
    };
    // The query has been read. What all endpoints share refuses one.
    *request.uri_mut() = Uri::default();
    respond(Drawing { part, preset }, app, request).await
}
