//! Static files, uncompressed and compressed, with entity tags.

use std::io::Write as _;

use axum::body::Bytes;
use axum::http::{HeaderMap, HeaderValue, StatusCode, header};
use axum::response::{IntoResponse, Response};
use flate2::Compression;
use flate2::write::GzEncoder;

use crate::http::negotiation;

/// A file with its gzip coding, which is made once.
#[derive(Debug)]
pub struct StaticFile {
    content_type: &'static str,
    plain: Coded,
    gzip: Coded,
}

#[derive(Debug)]
struct Coded {
    body: Bytes,
    etag: String,
}

impl StaticFile {
    /// Compresses the file.
    pub fn new(content_type: &'static str, body: impl Into<Bytes>) -> Self {
        let body = body.into();
        let hash = blake3::hash(&body).to_hex();
        let mut encoder = GzEncoder::new(Vec::with_capacity(body.len() / 2), Compression::best());
        // Writing to memory does not fail. If it did, the uncompressed file would be served.
        let gzip = encoder.write_all(&body).and_then(|()| encoder.finish()).unwrap_or_default();
        Self {
            content_type,
            plain: Coded { body, etag: format!("\"{}\"", &hash[..32]) },
            gzip: Coded { body: gzip.into(), etag: format!("\"{}-gzip\"", &hash[..32]) },
        }
    }

    /// Returns the file in an accepted coding, or 304. `no-cache` makes clients revalidate, so that files of two builds
    /// never mix.
    pub fn answer(&self, headers: &HeaderMap) -> Response {
        let is_gzip = !self.gzip.body.is_empty() && negotiation::accepts_gzip(headers);
        let Coded { body, etag } = if is_gzip { &self.gzip } else { &self.plain };
        let common = [
            (header::CACHE_CONTROL, HeaderValue::from_static("no-cache")),
            (header::VARY, HeaderValue::from_static("accept-encoding")),
        ];
        let tag = [(header::ETAG, etag.as_str())];
        if negotiation::is_not_modified(headers, etag) {
            return (StatusCode::NOT_MODIFIED, common, tag).into_response();
        }
        let mut response = (common, tag, [(header::CONTENT_TYPE, self.content_type)], body.clone()).into_response();
        if is_gzip {
            response.headers_mut().insert(header::CONTENT_ENCODING, HeaderValue::from_static("gzip"));
        }
        response
    }
}
