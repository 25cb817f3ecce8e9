//! Refuses unknown queries, so that a typo is never a silent default.

use axum::http::Uri;

use super::problem::{Problem, ProblemCode};

/// Checks that the request has no query.
///
/// # Errors
/// `invalid_query`.
pub(crate) fn require_no_query(uri: &Uri) -> Result<(), Problem> {
    match uri.query() {
        None | Some("") => Ok(()),
        Some(query) => {
            let detail = format!("`{}` takes no query, and the request has `{query}`. Leave it out", uri.path());
            Err(Problem::new(ProblemCode::InvalidQuery, detail))
        }
    }
}
