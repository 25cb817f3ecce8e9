//! `GET /docs/`: Swagger UI, compiled in, over the service's own API document.

use std::collections::BTreeMap;
use std::io::{Cursor, Read as _};
use std::sync::LazyLock;

use axum::extract::Path;
use axum::extract::rejection::PathRejection;
use axum::http::{HeaderMap, HeaderValue, header};
use axum::response::{IntoResponse, Redirect, Response};
use utoipa_swagger_ui_vendored::SWAGGER_UI_VENDORED;
use zip::ZipArchive;

use super::problem::{Problem, ProblemCode};
use crate::page::static_file::StaticFile;

/// Swagger UI sets styles itself and draws with data URLs.
const POLICY: HeaderValue = HeaderValue::from_static(
    "default-src 'self'; style-src 'self' 'unsafe-inline'; img-src 'self' data:; frame-ancestors 'none'",
);

const INDEX: &str = "index.html";

/// The files of the archive that the page loads, with their media types.
const ARCHIVED: [(&str, &str); 7] = [
    (INDEX, "text/html; charset=utf-8"),
    ("index.css", "text/css; charset=utf-8"),
    ("swagger-ui.css", "text/css; charset=utf-8"),
    ("swagger-ui-bundle.js", "text/javascript; charset=utf-8"),
    ("swagger-ui-standalone-preset.js", "text/javascript; charset=utf-8"),
    ("favicon-16x16.png", "image/png"),
    ("favicon-32x32.png", "image/png"),
];

const INITIALIZER: (&str, &str) = ("swagger-initializer.js", "text/javascript; charset=utf-8");

/// Relative addresses, because a proxy may strip a prefix. No validator: it would be a service elsewhere.
const SETTINGS: &[u8] = br##"window.onload = () => {
  window.ui = SwaggerUIBundle({
    "url": "openapi.json",
    "dom_id": "#swagger-ui",
    "deepLinking": true,
    "validatorUrl": null,
    presets: [SwaggerUIBundle.presets.apis, SwaggerUIStandalonePreset],
    layout: "StandaloneLayout",
  });
};
"##;

static FILES: LazyLock<BTreeMap<&str, StaticFile>> = LazyLock::new(|| {
    let mut files = BTreeMap::from([(INITIALIZER.0, StaticFile::new(INITIALIZER.1, SETTINGS.to_vec()))]);
    files.extend(ARCHIVED.iter().filter_map(|&(name, media)| Some((name, StaticFile::new(media, archived(name)?)))));
    files
});

/// A file of the archive, whose folder carries the version in its name.
fn archived(name: &str) -> Option<Vec<u8>> {
    let mut archive = ZipArchive::new(Cursor::new(SWAGGER_UI_VENDORED)).ok()?;
    let suffix = format!("/dist/{name}");
    let path = archive.file_names().flatten().find(|path| path.ends_with(&suffix))?.into_owned();
    let mut bytes = Vec::new();
    archive.by_name(&path).ok()?.read_to_end(&mut bytes).ok()?;
    Some(bytes)
}

/// Redirects `/docs` to the page. The address is relative, because a proxy may strip a prefix from the path.
pub async fn redirect() -> Redirect {
    Redirect::to("docs/")
}

/// The page itself.
pub async fn index(headers: HeaderMap) -> Response {
    file(INDEX, &headers)
}

/// The files that it loads.
pub async fn asset(name: Result<Path<String>, PathRejection>, headers: HeaderMap) -> Response {
    file(&name.map(|Path(name)| name).unwrap_or_default(), &headers)
}

fn file(name: &str, headers: &HeaderMap) -> Response {
    let Some(file) = FILES.get(name) else {
        return Problem::new(ProblemCode::NotFound, "the documentation has no such page. Start at `/docs`")
            .into_response();
    };
    let mut response = file.answer(headers);
    response.headers_mut().insert(header::CONTENT_SECURITY_POLICY, POLICY);
    response
}
