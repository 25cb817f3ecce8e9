//! The running service: listening, bounded connections, and stopping in order.

use std::io::{self, Write};
use std::net::SocketAddr;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use axum::Router;
use axum::body::Body;
use hyper::body::Incoming;
use hyper::server::conn::http1;
use hyper_util::rt::{TokioIo, TokioTimer};
use hyper_util::server::graceful::GracefulShutdown;
use hyper_util::service::TowerToHyperService;
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::{TcpListener, TcpStream};
use tokio::signal::unix::{SignalKind, signal};
use tokio::sync::{OwnedSemaphorePermit, Semaphore};
use tokio_io_timeout::TimeoutStream;
use tokio_util::sync::CancellationToken;
use tower::util::MapRequest;

use crate::api::App;
use crate::config::{Limits, MAX_HEADER_BYTES, Settings};
use crate::observe;
use crate::problem::{PROBLEM_JSON, Problem, ProblemCode, RETRY_AFTER_S};
use crate::router::router;

/// How long the service still listens after it has said that it is not ready, so that whoever asks can learn it.
const NOTICE: Duration = Duration::from_millis(200);

/// What running solves get at the end of the bound on a shutdown to be answered that it is over.
const LAST_WORDS: Duration = Duration::from_millis(300);

/// A connection that takes nothing of its answer for so long is closed.
const WRITE_STALL: Duration = Duration::from_secs(30);

/// What a client beyond the last connection gets to have sent its request before it is refused.
const REFUSAL: Duration = Duration::from_secs(1);

/// After an error of the listener itself, such as too many open files.
const ACCEPT_PAUSE: Duration = Duration::from_millis(100);

/// Serves until a signal, then drains within the bound of the settings.
///
/// # Errors
/// Where the address cannot be listened on, or the process gets no signals.
pub async fn serve(settings: &Settings) -> io::Result<()> {
    observe::install_recorder();
    let listener = TcpListener::bind(settings.listen).await?;
    let (mut terminate, mut interrupt) = (signal(SignalKind::terminate())?, signal(SignalKind::interrupt())?);
    let address = listener.local_addr()?;
    let keys = settings.keys_file.clone();
    if keys.is_none() && !address.ip().is_loopback() {
        tracing::warn!(%address, "anyone who reaches this address may use the service: no keys file is set");
    }
    let app = App::new(settings.limits());
    let router = router(Arc::clone(&app), &settings.cors_origins, keys);
    greet(address);
    let server = Server::new(router, app.limits);
    tokio::spawn(observe::keep_up());
    let signalled = async {
        tokio::select! {
            _ = terminate.recv() => {}
            _ = interrupt.recv() => {}
        }
        tracing::info!("stopping: no longer ready, draining");
        app.ready.store(false, Ordering::Relaxed);
        tokio::time::sleep(NOTICE).await;
    };
    tokio::select! {
        () = signalled => {}
        () = server.accept(&listener) => {}
    }
    drop(listener);
    server.closing.cancel();
    drain(server.graceful, &app, settings.shutdown()).await;
    tracing::info!("stopped");
    Ok(())
}

/// Waits until every request is answered, at most for `bound`; just before its end running solves are told to stop.
async fn drain(connections: GracefulShutdown, app: &App, bound: Duration) {
    let close_pool = async {
        tokio::time::sleep(bound.saturating_sub(LAST_WORDS)).await;
        tracing::warn!("requests still ran when the time to stop was nearly over");
        app.pool.close();
        tokio::time::sleep(LAST_WORDS).await;
    };
    tokio::select! {
        () = connections.shutdown() => {}
        () = close_pool => {}
    }
}

struct Server {
    router: Router,
    http: http1::Builder,
    graceful: GracefulShutdown,
    /// Cancelled when the service stops.
    closing: CancellationToken,
    connections: Arc<Semaphore>,
    max_connections: usize,
}

impl Server {
    fn new(router: Router, limits: Limits) -> Self {
        let mut http = http1::Builder::new();
        http.timer(TokioTimer::new())
            .header_read_timeout(Duration::from_millis(limits.header_timeout_ms))
            .max_header_size(MAX_HEADER_BYTES);
        Self {
            router,
            http,
            graceful: GracefulShutdown::new(),
            closing: CancellationToken::new(),
            connections: Arc::new(Semaphore::new(limits.max_connections)),
            max_connections: limits.max_connections,
        }
    }

    /// Accepts connections for ever.
    async fn accept(&self, listener: &TcpListener) {
        loop {
            match listener.accept().await {
                Ok((stream, _)) => match Arc::clone(&self.connections).try_acquire_owned() {
                    Ok(permit) => self.serve(stream, permit),
                    Err(_) => {
                        tokio::spawn(refuse(stream, self.max_connections));
                    }
                },
                Err(error) => {
                    // A client that gave up is none of the listener's faults; the others pass when something is closed.
                    if !matches!(error.kind(), io::ErrorKind::ConnectionAborted | io::ErrorKind::ConnectionReset) {
                        tracing::error!(%error, "no connection could be accepted");
                        tokio::time::sleep(ACCEPT_PAUSE).await;
                    }
                }
            }
        }
    }

    fn serve(&self, stream: TcpStream, permit: OwnedSemaphorePermit) {
        // Without it small answers could wait for the client's acknowledgement of earlier ones.
        let _ = stream.set_nodelay(true);
        let mut stream = TimeoutStream::new(stream);
        stream.set_write_timeout(Some(WRITE_STALL));
        let has_asked = Arc::new(AtomicBool::new(false));
        let asked = Arc::clone(&has_asked);
        let service = MapRequest::new(self.router.clone(), move |request: hyper::Request<Incoming>| {
            asked.store(true, Ordering::Relaxed);
            request.map(Body::new)
        });
        let service = TowerToHyperService::new(service);
        let connection = self.http.serve_connection(TokioIo::new(Box::pin(stream)), service);
        let connection = self.graceful.watch(connection);
        let closing = self.closing.clone();
        // A client that has not finished its first request's head holds up no shutdown.
        let never_asked = async move {
            closing.cancelled().await;
            tokio::time::sleep(NOTICE).await;
            if has_asked.load(Ordering::Relaxed) {
                std::future::pending::<()>().await;
            }
        };
        tokio::spawn(async move {
            let _held = permit;
            tokio::select! {
                // What goes wrong on a connection is its client's to know; the request, if there was one, is logged by itself.
                _ = connection => {}
                () = never_asked => {}
            }
        });
    }
}

/// Answers a connection beyond the last one, and closes it.
async fn refuse(mut stream: TcpStream, max_connections: usize) {
    let detail =
        format!("{max_connections} connections are open, as many as the service admits; try again in a moment");
    let problem = Problem::new(ProblemCode::TooManyConnections, detail);
    observe::problem_is_told(&problem);
    let body = serde_json::to_string(&problem).unwrap_or_default();
    let head = format!(
        "HTTP/1.1 503 Service Unavailable\r\ncontent-type: {PROBLEM_JSON}\r\nretry-after: {RETRY_AFTER_S}\r\nconnection: close\r\ncontent-length: {}\r\n\r\n",
        body.len()
    );
    let answer = async {
        // What is left unread when a connection is closed would reset it before the answer is read.
        let mut request = [0; 4096];
        let _ = stream.read(&mut request).await;
        let _ = stream.write_all(format!("{head}{body}").as_bytes()).await;
        let _ = stream.shutdown().await;
    };
    let _ = tokio::time::timeout(REFUSAL, answer).await;
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
