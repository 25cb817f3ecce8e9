//! Metrics in Prometheus' text format.

use std::sync::OnceLock;
use std::time::Duration;

use metrics::{Counter, counter, describe_counter, describe_gauge, describe_histogram, gauge, histogram};
use metrics_exporter_prometheus::{Matcher, PrometheusBuilder, PrometheusHandle};
use metrics_process::Collector;
use toothwave_calculation::BUILD;
use toothwave_calculation::json::word;

use super::log;
use crate::app::App;
use crate::http::problem::ProblemCode;
use crate::ops::config::MAX_CONNECTIONS;

/// Upper bounds of the histograms' buckets in seconds: from a cache hit to the longest deadline.
const BUCKETS_S: [f64; 12] = [1e-4, 2.5e-4, 5e-4, 1e-3, 2.5e-3, 5e-3, 1e-2, 5e-2, 0.1, 0.5, 1.0, 10.0];

/// Between two folds of recorded values into buckets; until then the recorder keeps each value.
const UPKEEP: Duration = Duration::from_secs(1);

static RECORDER: OnceLock<Option<PrometheusHandle>> = OnceLock::new();

/// Installs the recorder of this process, once.
pub fn install() {
    RECORDER.get_or_init(|| {
        PrometheusBuilder::new()
            .set_buckets_for_metric(Matcher::Suffix("_seconds".into()), &BUCKETS_S)
            .and_then(PrometheusBuilder::install_recorder)
            .inspect(|_| describe())
            .inspect_err(|error| tracing::error!(%error, "no metrics"))
            .ok()
    });
}

fn describe() {
    Collector::default().describe();
    describe_counter!("toothwave_http_requests_total", "Requests answered.");
    describe_histogram!("toothwave_http_request_duration_seconds", "Time to the head of an answer.");
    describe_counter!("toothwave_cache_requests_total", "Answers that may be kept, by where they came from.");
    describe_gauge!("toothwave_cache_bytes", "Bytes that the cache holds.");
    describe_gauge!("toothwave_cache_entries", "Answers that the cache holds.");
    describe_histogram!("toothwave_solve_duration_seconds", "Time of each computation, without waiting.");
    describe_gauge!("toothwave_solves_running", "Computations that run.");
    describe_gauge!("toothwave_solves_queued", "Requests that wait for a permit.");
    describe_gauge!("toothwave_batches_running", "Batches that run.");
    describe_counter!("toothwave_batch_documents_total", "Documents of batches answered.");
    describe_gauge!("toothwave_studies_running", "Studies that run.");
    describe_counter!("toothwave_study_variants_total", "Variants of studies computed.");
    describe_counter!("toothwave_refusals_total", "Requests refused, by the reason.");
    describe_counter!("toothwave_cancellations_total", "Computations that were stopped.");
    describe_gauge!("toothwave_connections", "Connections that are open.");
    describe_gauge!("toothwave_unread_bytes", "Bytes reserved of max_unread_bytes.");
    describe_counter!("toothwave_log_lines_lost_total", "Lines of the log that were dropped.");
    describe_gauge!("toothwave_build_info", "1; its labels say what runs.");
    // The rate of a series that does not exist yet misses its first event.
    for name in ["toothwave_cancellations_total", "toothwave_study_variants_total"] {
        counter!(name).increment(0);
    }
    for code in ProblemCode::REFUSALS {
        refusals(code).increment(0);
    }
}

/// The counter of refusals with this code.
pub fn refusals(code: ProblemCode) -> Counter {
    counter!("toothwave_refusals_total", "reason" => word(&code))
}

/// What tells requests of one route apart; no status if the client left before.
#[derive(Debug, Clone, Copy)]
pub struct Labels {
    /// The method.
    pub method: &'static str,
    /// The status.
    pub status: Option<u16>,
    /// The cache status.
    pub cache: Option<&'static str>,
}

/// Counts a request. Routes, methods and statuses are few, so that there are few series.
pub fn count_request(route: &str, Labels { method, status, cache }: Labels, elapsed: Duration) {
    let status = status.map_or_else(|| "none".to_owned(), |status| status.to_string());
    let route = route.to_owned();
    histogram!("toothwave_http_request_duration_seconds", "route" => route.clone()).record(elapsed);
    counter!("toothwave_http_requests_total", "route" => route, "method" => method, "status" => status).increment(1);
    if let Some(cache) = cache {
        counter!("toothwave_cache_requests_total", "status" => cache).increment(1);
    }
}

/// The metrics as text; gauges are read at this moment.
pub fn render(app: &App) -> String {
    let (cache_bytes, cache_entries) = app.cache.size();
    #[expect(clippy::cast_precision_loss, reason = "gauges are doubles")]
    for (name, value) in [
        ("toothwave_cache_bytes", cache_bytes),
        ("toothwave_cache_entries", cache_entries),
        ("toothwave_batches_running", app.pool.batches() as u64),
        ("toothwave_studies_running", app.studies.running() as u64),
        ("toothwave_solves_running", app.pool.running() as u64),
        ("toothwave_solves_queued", app.pool.waiting() as u64),
        ("toothwave_unread_bytes", app.budget.reserved_bytes()),
        ("toothwave_connections", (MAX_CONNECTIONS - app.connection_permits.available_permits()) as u64),
    ] {
        gauge!(name).set(value as f64);
    }
    gauge!("toothwave_build_info", "version" => env!("CARGO_PKG_VERSION"), "build" => BUILD).set(1.0);
    counter!("toothwave_log_lines_lost_total").absolute(log::lost_lines());
    Collector::default().collect();
    let handle = RECORDER.get().and_then(Option::as_ref);
    handle.map(PrometheusHandle::render).unwrap_or_default()
}

/// Folds recorded values into buckets, for ever.
pub async fn upkeep() {
    loop {
        tokio::time::sleep(UPKEEP).await;
        if let Some(handle) = RECORDER.get().and_then(Option::as_ref) {
            handle.run_upkeep();
        }
    }
}
