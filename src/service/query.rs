//! What stands behind the question mark of a request.

use axum::http::Uri;

use crate::problem::{Problem, ProblemCode};

/// Checks that there is no query, so that a typo is never a silent default.
///
/// # Errors
/// `invalid_query`.
pub fn require_no_query(uri: &Uri) -> Result<(), Problem> {
    match uri.query() {
        None | Some("") => Ok(()),
        Some(query) => {
            let detail = format!("`{}` knows no query, and the request has `{query}`", uri.path());
            Err(Problem::new(ProblemCode::InvalidQuery, detail))
        }
    }
}
