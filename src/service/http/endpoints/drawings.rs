//! `POST /v1/drawings/{part}`: each mating part, or all of them in place, as outlines for CAD, workshops and eyes.

use std::sync::Arc;

use axum::extract::rejection::PathRejection;
use axum::extract::{Path, Request, State};
use axum::http::Uri;
use axum::response::{IntoResponse, Response};
use toothwave_calculation::design::Design;
use toothwave_calculation::drawing::Drawing;
use toothwave_calculation::drawing::answer::{DrawingAnswer, DrawnPart};
use toothwave_calculation::drawing::preset::DrawingOptions;
use toothwave_calculation::json;

use crate::app::App;
use crate::http::answer::{Problems, respond};
use crate::http::negotiation::query;
use crate::http::problem::{Problem, ProblemCode};

/// The sections of a part, or of all parts in place.
#[utoipa::path(
    post,
    path = "/v1/drawings/{part}",
    tag = "drive",
    request_body(content = Design, description = "Reads `drive`, `parts` and `profile.chord_tolerance_mm`, for `assembly` also `assembly`."),
    params(
        ("part" = DrawnPart, Path, description = "What is drawn.", example = "ring"),
        DrawingOptions,
        ("If-None-Match" = Option<String>, Header, description = "Entity tags that the client has.")
    ),
    responses(
        (status = 200, description = "The drawing. As DXF (AutoCAD 2000, millimetres) a layer a part, every outline a circle or one closed polyline of lines and arcs, true to the chord tolerance; as SVG the same in millimetres; as STEP (AP214) every prism a solid in place, circles as cylinders, other curves as polynomials; as 3MF and STL closed meshes, true to the chord tolerance.",
            content((DrawingAnswer = "application/json"), (String = "image/svg+xml"), (String = "image/vnd.dxf"), (String = "model/step"), (String = "model/3mf"), (String = "model/stl"))),
        (status = 304, description = "The client has this representation already (`If-None-Match`)."),
        (status = 404, description = "No such part.", body = Problem, content_type = "application/problem+json"),
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
        let detail = format!("drawings there are of {}", known.join(", "));
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
