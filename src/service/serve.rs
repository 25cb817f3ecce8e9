//! The running service: listening, and stopping in order.

use std::io::{self, Write};
use std::net::SocketAddr;
use std::sync::atomic::Ordering;
use std::time::Duration;

use tokio::net::TcpListener;
use tokio::signal::unix::{SignalKind, signal};
use tokio::sync::oneshot;

use crate::api::App;
use crate::config::Settings;
use crate::observe;
use crate::router::router;

/// How long the service still listens after it has said that it is not ready, so that whoever asks can learn it.
const NOTICE: Duration = Duration::from_millis(200);

/// Serves until a signal, then drains within the bound of the settings.
///
/// # Errors
/// Where the address cannot be listened on, or the process gets no signals.
pub async fn serve(settings: &Settings) -> io::Result<()> {
    observe::install_recorder();
    let app = App::new(settings.limits());
    let ready = app.ready.clone();
    let listener = TcpListener::bind(settings.listen).await?;
    let (mut terminate, mut interrupt) = (signal(SignalKind::terminate())?, signal(SignalKind::interrupt())?);
    greet(listener.local_addr()?);
    let (stopping, stopped) = oneshot::channel();
    let shutdown = async move {
        tokio::select! {
            _ = terminate.recv() => {}
            _ = interrupt.recv() => {}
        }
        tracing::info!("stopping: no longer ready, draining");
        ready.store(false, Ordering::Relaxed);
        tokio::time::sleep(NOTICE).await;
        // Nobody listens any more only if serving has ended already.
        let _ = stopping.send(());
    };
    let serving = axum::serve(listener, router(app, &settings.cors_origins)).with_graceful_shutdown(shutdown);
    let bound = async {
        // An error means that the signal task is gone, and serving with it.
        let _ = stopped.await;
        tokio::time::sleep(settings.shutdown()).await;
    };
    tokio::select! {
        result = serving.into_future() => result?,
        () = bound => tracing::warn!("requests still ran when the time to stop was over"),
    }
    tracing::info!("stopped");
    Ok(())
}

/// Where the service is and what to try.
fn greet(address: SocketAddr) {
    let text = format!(
        "toothwave {} listens on http://{address}
The designer's page: http://{address}/
To try in another terminal:
  curl -s http://{address}/v1/examples/paper-5.1 | curl -s --json @- http://{address}/v1/coincidence-degree
  curl -s http://{address}/v1/examples/paper-5.1 | curl -s --json @- http://{address}/v1/sweep
The API: http://{address}/docs
",
        env!("CARGO_PKG_VERSION")
    );
    // Whoever started the service may have closed its output; it serves all the same.
    let _ = io::stdout().write_all(text.as_bytes());
}
