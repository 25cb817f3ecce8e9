//! One log line and one set of metrics for each request.

use std::sync::OnceLock;
use std::time::Instant;

use axum::extract::{MatchedPath, Request};
use axum::middleware::Next;
use axum::response::Response;
use metrics::{counter, gauge, histogram};
use metrics_exporter_prometheus::{Matcher, PrometheusBuilder, PrometheusHandle};
use tracing::Instrument;

use crate::api::App;
use crate::cache::Served;

/// Upper bounds of the histograms' buckets in seconds: from a cache hit to the longest deadline.
const BUCKETS_S: [f64; 12] = [1e-4, 2.5e-4, 5e-4, 1e-3, 2.5e-3, 5e-3, 1e-2, 5e-2, 0.1, 0.5, 1.0, 10.0];

static RECORDER: OnceLock<Option<PrometheusHandle>> = OnceLock::new();

/// Installs the recorder of this process, once.
pub fn install_recorder() {
    RECORDER.get_or_init(|| {
        PrometheusBuilder::new()
            .set_buckets_for_metric(Matcher::Suffix("_seconds".into()), &BUCKETS_S)
            .and_then(PrometheusBuilder::install_recorder)
            .inspect_err(|error| tracing::error!(%error, "no metrics"))
            .ok()
    });
}

/// The metrics as text; levels are read at this moment.
pub async fn render(app: &App) -> String {
    let size = app.cache.size().await;
    let running = app.pool.running();
    #[expect(clippy::cast_precision_loss, reason = "a gauge")]
    {
        gauge!("toothwave_cache_bytes").set(size.bytes as f64);
        gauge!("toothwave_cache_entries").set(size.entries as f64);
        gauge!("toothwave_batches_running").set(app.pool.batches() as f64);
        gauge!("toothwave_solves_running").set(running as f64);
        gauge!("toothwave_solves_queued").set(app.pool.admitted().saturating_sub(running) as f64);
    }
    let handle = RECORDER.get().and_then(Option::as_ref);
    handle.map(PrometheusHandle::render).unwrap_or_default()
}

/// The middleware: a span with the request's id, then one line and the metrics when the answer's head is ready.
pub async fn observe(request: Request, next: Next) -> Response {
    let started = Instant::now();
    // The route and not the path: labels must stay few.
    let route = request.extensions().get::<MatchedPath>().map_or("none", MatchedPath::as_str).to_owned();
    let method = match request.method().as_str() {
        known @ ("GET" | "HEAD" | "POST" | "PUT" | "PATCH" | "DELETE" | "OPTIONS") => known.to_owned(),
        // Clients can invent methods without end, and each would be a series of its own.
        _ => "other".to_owned(),
    };
    let id = request.headers().get("x-request-id").and_then(|value| value.to_str().ok()).unwrap_or_default();
    let span = tracing::info_span!("request", id, design = tracing::field::Empty);
    let response = next.run(request).instrument(span.clone()).await;
    let elapsed = started.elapsed();
    let status = response.status().as_u16();
    let cache = response.extensions().get::<Served>().map(|served| served.label());

    counter!("toothwave_http_requests_total", "route" => route.clone(), "method" => method.clone(), "status" => status.to_string())
        .increment(1);
    histogram!("toothwave_http_request_duration_seconds", "route" => route.clone()).record(elapsed);
    if let Some(cache) = cache {
        counter!("toothwave_cache_requests_total", "status" => cache).increment(1);
    }
    let elapsed_ms = 1e3 * elapsed.as_secs_f64();
    span.in_scope(|| tracing::info!(method, route, status, cache, elapsed_ms, "request"));
    response
}
