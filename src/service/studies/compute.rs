//! How studies use the pool: no other file of studies knows it.

use std::sync::atomic::AtomicBool;

use crate::compute::{Lane, Pool};
use crate::problem::Problem;

/// Runs a job in the background, behind single requests, and hands it the flag that tells it to stop.
///
/// # Errors
/// Those of the job; `internal_error` if it panicked, `shutting_down` if the service stops.
pub(super) async fn run<T: Send + 'static>(
    pool: &Pool,
    job: impl FnOnce(&AtomicBool) -> Result<T, Problem> + Send + 'static,
) -> Result<T, Problem> {
    pool.run_variants(&mut Lane::default(), 0, |_, stop| job(stop)).await
}
