//! `GET /`: the web page, compiled in, so that it needs no Node and no network.

pub mod static_file;

use std::collections::BTreeMap;
use std::sync::LazyLock;

use axum::extract::Path;
use axum::extract::rejection::PathRejection;
use axum::http::{HeaderMap, HeaderValue, Uri, header};
use axum::response::{IntoResponse, Response};

use self::static_file::StaticFile;
use crate::http::problem::{Problem, ProblemCode};

/// Everything loads from this origin. Inline scripts, frames and forms are forbidden.
const CONTENT_SECURITY_POLICY: HeaderValue = HeaderValue::from_static(
    "default-src 'none'; script-src 'self'; style-src 'self'; connect-src 'self'; img-src 'self' data:; \
     base-uri 'none'; form-action 'none'; frame-ancestors 'none'",
);

/// A file of the page.
struct Asset {
    name: &'static str,
    content_type: &'static str,
    body: &'static [u8],
}

macro_rules! assets {
    ($($name:literal as $content_type:expr),* $(,)?) => {
        &[$(Asset { name: $name, content_type: $content_type, body: include_bytes!($name) }),*]
    };
}

const HTML: &str = "text/html; charset=utf-8";
const CSS: &str = "text/css; charset=utf-8";
const SCRIPT: &str = "text/javascript; charset=utf-8";
const SVG: &str = "image/svg+xml";

const INDEX: Asset = Asset { name: "index.html", content_type: HTML, body: include_bytes!("index.html") };

const ASSETS: &[Asset] = assets![
    "style.css" as CSS,
    "results.css" as CSS,
    "narrow.css" as CSS,
    "print.css" as CSS,
    "studies.css" as CSS,
    "icon.svg" as SVG,
    "theme.js" as SCRIPT,
    "kinds.js" as SCRIPT,
    "language.js" as SCRIPT,
    "main.js" as SCRIPT,
    "access.js" as SCRIPT,
    "accuracy.js" as SCRIPT,
    "answers.js" as SCRIPT,
    "ask.js" as SCRIPT,
    "chart.js" as SCRIPT,
    "clipboard.js" as SCRIPT,
    "comparison.js" as SCRIPT,
    "convert.js" as SCRIPT,
    "design.js" as SCRIPT,
    "document-dialog.js" as SCRIPT,
    "dom.js" as SCRIPT,
    "drawings.js" as SCRIPT,
    "effect.js" as SCRIPT,
    "examples.js" as SCRIPT,
    "explore.js" as SCRIPT,
    "field-notes.js" as SCRIPT,
    "field.js" as SCRIPT,
    "fields.js" as SCRIPT,
    "find.js" as SCRIPT,
    "findings-list.js" as SCRIPT,
    "findings.js" as SCRIPT,
    "form.js" as SCRIPT,
    "format.js" as SCRIPT,
    "front.js" as SCRIPT,
    "grades.js" as SCRIPT,
    "grids.js" as SCRIPT,
    "history.js" as SCRIPT,
    "large.js" as SCRIPT,
    "lines.js" as SCRIPT,
    "login.js" as SCRIPT,
    "losses.js" as SCRIPT,
    "materials.js" as SCRIPT,
    "mechanism.js" as SCRIPT,
    "menus.js" as SCRIPT,
    "motion.js" as SCRIPT,
    "parameters.js" as SCRIPT,
    "pass.js" as SCRIPT,
    "picture.js" as SCRIPT,
    "plots.js" as SCRIPT,
    "preferences.js" as SCRIPT,
    "quantities.js" as SCRIPT,
    "reasons.js" as SCRIPT,
    "remedies.js" as SCRIPT,
    "report.js" as SCRIPT,
    "requirements.js" as SCRIPT,
    "results.js" as SCRIPT,
    "rounding.js" as SCRIPT,
    "sensitivity.js" as SCRIPT,
    "service.js" as SCRIPT,
    "service.zh-cn.js" as SCRIPT,
    "share.js" as SCRIPT,
    "sight.js" as SCRIPT,
    "slider.js" as SCRIPT,
    "states.js" as SCRIPT,
    "status.js" as SCRIPT,
    "strengths.js" as SCRIPT,
    "studies.js" as SCRIPT,
    "study-view.js" as SCRIPT,
    "terms.js" as SCRIPT,
    "texts.en.js" as SCRIPT,
    "texts.fields.en.js" as SCRIPT,
    "texts.fields.zh-cn.js" as SCRIPT,
    "texts.js" as SCRIPT,
    "texts.results.en.js" as SCRIPT,
    "texts.results.zh-cn.js" as SCRIPT,
    "texts.studies.en.js" as SCRIPT,
    "texts.studies.zh-cn.js" as SCRIPT,
    "texts.zh-cn.js" as SCRIPT,
    "tiles.js" as SCRIPT,
    "tolerance.js" as SCRIPT,
    "toolbar.js" as SCRIPT,
    "turning.js" as SCRIPT,
    "views.js" as SCRIPT,
    "words.js" as SCRIPT,
];

static FILES: LazyLock<BTreeMap<&str, StaticFile>> = LazyLock::new(|| {
    let file = |asset: &Asset| (asset.name, StaticFile::new(asset.content_type, asset.body));
    ASSETS.iter().chain([&INDEX]).map(file).collect()
});

/// Serves the page.
pub async fn index(headers: HeaderMap) -> Response {
    serve(&FILES[INDEX.name], &headers)
}

/// Serves the files of the page.
pub async fn asset(name: Result<Path<String>, PathRejection>, uri: Uri, headers: HeaderMap) -> Response {
    // A path segment that is not UTF-8 is an unknown file.
    let name = name.map(|Path(name)| name).unwrap_or_default();
    match FILES.get(name.as_str()) {
        Some(file) if name != INDEX.name => serve(file, &headers),
        _ => {
            let detail = format!("there is no file `{}`. The page is at `/`", uri.path());
            Problem::new(ProblemCode::NotFound, detail).into_response()
        }
    }
}

fn serve(file: &StaticFile, headers: &HeaderMap) -> Response {
    let mut response = file.answer(headers);
    // Also on 304: browsers replace their stored headers by these.
    response.headers_mut().insert(header::CONTENT_SECURITY_POLICY, CONTENT_SECURITY_POLICY);
    response
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;
    use std::path::Path;

    use super::{ASSETS, INDEX};

    fn files(folder: &Path, prefix: &str) -> BTreeSet<String> {
        let entries = std::fs::read_dir(folder).expect("the folder is there").map(|entry| entry.expect("readable"));
        entries
            .flat_map(|entry| {
                let name = format!("{prefix}{}", entry.file_name().to_string_lossy());
                if entry.path().is_dir() { files(&entry.path(), &format!("{name}/")) } else { BTreeSet::from([name]) }
            })
            .collect()
    }

    /// A module that is not served would fail only in a browser.
    #[test]
    fn every_file_of_the_page_is_served() {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("page");
        let named = ASSETS.iter().chain([&INDEX]).map(|asset| asset.name.to_owned());
        let served = named.chain(["mod.rs".to_owned(), "static_file.rs".to_owned()]).collect();
        assert_eq!(files(&folder, ""), served);
    }
}
