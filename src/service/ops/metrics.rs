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

/// Upper bounds of the histogram buckets in seconds: from a cache hit to the default deadline.
const BUCKETS_S: [f64; 12] = [1e-4, 2.5e-4, 5e-4, 1e-3, 2.5e-3, 5e-3, 1e-2, 5e-2, 0.1, 0.5, 1.0, 10.0];

/// Interval at which recorded values are folded into buckets. Until then the recorder stores each value.
const UPKEEP: Duration = Duration::from_secs(1);

static RECORDER: OnceLock<Option<PrometheusHandle>> = OnceLock::new();

/// Installs the metrics recorder of this process, once.
pub fn install() {
    RECORDER.get_or_init(|| {
        PrometheusBuilder::new()
            .set_buckets_for_metric(Matcher::Suffix("_seconds".into()), &BUCKETS_S)
            .and_then(PrometheusBuilder::install_recorder)
            .inspect(|_| describe())
            .inspect_err(|error| tracing::error!(%error, "cannot install the metrics recorder"))
            .ok()
    });
}

fn describe() {
    Collector::default().describe();
    describe_counter!("toothwave_http_requests_total", "Requests.");
    describe_histogram!("toothwave_http_request_duration_seconds", "Time from a request to its response headers.");
    describe_counter!("toothwave_cache_requests_total", "Responses of cacheable endpoints, by cache status.");
    describe_gauge!("toothwave_cache_bytes", "Bytes in the cache.");
    describe_gauge!("toothwave_cache_entries", "Answers in the cache.");
    describe_histogram!("toothwave_solve_duration_seconds", "Time of each computation, without the wait for a permit.");
    describe_gauge!("toothwave_solves_running", "Running computations.");
    describe_gauge!("toothwave_solves_queued", "Requests that wait for a permit.");
    describe_gauge!("toothwave_batches_running", "Running batches.");
    describe_counter!("toothwave_batch_documents_total", "Answered documents of batches, by status.");
    describe_gauge!("toothwave_studies_running", "Running studies.");
    describe_counter!("toothwave_study_variants_total", "Computed variants of studies.");
    describe_counter!("toothwave_refusals_total", "Refused requests, by reason.");
    describe_counter!("toothwave_cancellations_total", "Computations that were stopped early.");
    describe_gauge!("toothwave_connections", "Open connections.");
    describe_gauge!("toothwave_unread_bytes", "Reserved bytes of max_unread_bytes.");
    describe_counter!("toothwave_log_lines_lost_total", "Dropped log lines.");
    describe_gauge!("toothwave_build_info", "Always 1. The labels have version and build.");
    // A series that does not exist yet would miss its first event in a rate.
    for name in ["toothwave_cancellations_total", "toothwave_study_variants_total"] {
        counter!(name).increment(0);
    }
    for code in ProblemCode::REFUSALS {
        refusals(code).increment(0);
    }
}

/// Returns the counter of refusals with this code.
pub fn refusals(code: ProblemCode) -> Counter {
    counter!("toothwave_refusals_total", "reason" => word(&code))
}

/// Counts a request. Routes, methods and statuses are few. There is no status if the client left early.
pub fn count_request(
    route: &str,
    method: &'static str,
    status: Option<u16>,
    cache: Option<&'static str>,
    elapsed: Duration,
) {
    let status = status.map_or_else(|| "none".to_owned(), |status| status.to_string());
    let route = route.to_owned();
    histogram!("toothwave_http_request_duration_seconds", "route" => route.clone()).record(elapsed);
    counter!("toothwave_http_requests_total", "route" => route, "method" => method, "status" => status).increment(1);
    if let Some(cache) = cache {
        counter!("toothwave_cache_requests_total", "status" => cache).increment(1);
    }
}

/// Returns the metrics as text. Gauges are read at this moment.
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

/// Folds recorded values into buckets, in an endless loop.
pub async fn upkeep() {
    loop {
        tokio::time::sleep(UPKEEP).await;
        if let Some(handle) = RECORDER.get().and_then(Option::as_ref) {
            handle.run_upkeep();
        }
    }
}
