//! The server: accepts connections, and shuts down gracefully.
//!
//! **Connections.** At most 1024 are open; the next one gets a fixed 503. The request headers must arrive within 30 s.
//! The kernel disconnects a client that takes no data for 30 s (`TCP_USER_TIMEOUT`). Slow clients are left to a
//! buffering proxy.

use std::io::{self, Write as _};
use std::net::SocketAddr;
use std::pin::pin;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use axum::Router;
use axum::body::Body;
use futures_util::FutureExt as _;
use hyper::body::Incoming;
use hyper::server::conn::http1;
use hyper_util::rt::{TokioIo, TokioTimer};
use hyper_util::server::graceful::GracefulShutdown;
use hyper_util::service::TowerToHyperService;
use socket2::SockRef;
use tokio::io::{AsyncReadExt as _, AsyncWriteExt as _};
use tokio::net::{TcpListener, TcpStream};
use tokio::sync::{OwnedSemaphorePermit, Semaphore};
use tokio::time::{sleep, timeout};
use tokio_util::sync::CancellationToken;
use tower::util::MapRequest;

use super::router::{self, Access};
use crate::app::App;
use crate::ops::config::{CLIENT_TIMEOUT_MS, MAX_CONNECTIONS, MAX_HEADER_BYTES, Settings, StudiesPlace};
use crate::ops::metrics;
use crate::studies::{Storage, Store};
use crate::unix::{hang_ups, raise_file_limit, stop_signals};

/// Shortest time for which the service still listens after it reports that it is not ready.
const NOTICE: Duration = Duration::from_millis(200);

/// Time before the end of a shutdown at which running computations are stopped, so that their clients get a response.
const LAST_ANSWERS: Duration = Duration::from_millis(300);

/// Pause after an error of the listener, for example too many open files.
const ACCEPT_PAUSE: Duration = Duration::from_millis(100);

/// Time limit for the refusal of a connection.
const REFUSAL_TIMEOUT: Duration = Duration::from_secs(1);

/// The response to a connection over the limit.
const REFUSAL: &[u8] = b"HTTP/1.1 503 Service Unavailable\r\ncontent-type: application/problem+json\r\nretry-after: 1\r\ncontent-length: 219\r\nconnection: close\r\n\r\n{\"type\":\"urn:toothwave:problem:too_many_connections\",\"title\":\"Too many connections are open\",\"status\":503,\"detail\":\"1024 connections are open, the most that this service serves. Try again\",\"code\":\"too_many_connections\"}";

/// Serves until a signal. Then it finishes running requests within `shutdown_ms`, or until a second signal.
pub async fn serve(settings: &Settings) -> io::Result<()> {
    metrics::install();
    // First: without a handler, process 1 of a container ignores signals.
    let mut stop_signal = stop_signals()?;
    raise_file_limit();
    let listener = TcpListener::bind(settings.listen)
        .await
        .map_err(|error| io::Error::new(error.kind(), format!("{}: {error}", settings.listen)))?;
    let address = listener.local_addr()?;
    let app = App::start(settings.limits(), study_storage(settings)?)?;
    app.studies.load().await.map_err(io::Error::other)?;
    let server = Server::new(&app, settings, address);
    print_address(address);
    tokio::spawn(metrics::upkeep());
    tokio::spawn({
        let app = Arc::clone(&app);
        async move { app.studies.keep_removing_expired().await }
    });
    watch_keys(settings)?;
    let stopping = async {
        stop_signal().await;
        tracing::info!("stopping: not ready, still listening");
        app.ready.store(false, Ordering::Relaxed);
        tokio::select! {
            () = sleep(NOTICE.max(Duration::from_millis(settings.lame_duck_ms))) => false,
            () = stop_signal() => true,
        }
    };
    let has_second_signal = tokio::select! {
        twice = stopping => twice,
        () = server.accept(&listener) => false,
    };
    if !has_second_signal {
        server.accept_waiting(&listener);
        drop(listener);
        tokio::select! {
            () = server.finish(&app, Duration::from_millis(settings.shutdown_ms)) => {}
            () = stop_signal() => tracing::warn!("second signal: running requests are aborted"),
        }
    }
    tracing::info!("stopped");
    Ok(())
}

/// Opens the database file of the studies, or a database in memory.
fn study_storage(settings: &Settings) -> io::Result<Option<Storage>> {
    let file = match &settings.studies {
        Some(StudiesPlace::Off) => return Ok(None),
        Some(StudiesPlace::File(file)) => Some(file.as_path()),
        None => None,
    };
    let store = Store::open(file).map_err(|error| match file {
        Some(file) => io::Error::other(format!("{}: {error}", file.display())),
        None => io::Error::other(error),
    })?;
    Ok(Some(Storage { store, expiry: Duration::from_secs(settings.study_expiry_s) }))
}

/// Reloads the keys file at each SIGHUP.
fn watch_keys(settings: &Settings) -> io::Result<()> {
    let Some(keys) = settings.keys_file.clone() else { return Ok(()) };
    let mut hang_up = hang_ups()?;
    tokio::spawn(async move {
        while hang_up.recv().await.is_some() {
            keys.reload();
        }
    });
    Ok(())
}

struct Server {
    router: Router,
    http: http1::Builder,
    connection_permits: Arc<Semaphore>,
    graceful: GracefulShutdown,
    closing: CancellationToken,
}

impl Server {
    fn new(app: &Arc<App>, settings: &Settings, address: SocketAddr) -> Self {
        let keys = settings.keys_file.clone();
        if keys.is_none() && !address.ip().is_loopback() {
            tracing::warn!(%address, "no keys file is set: everyone who reaches this address can use the service");
        }
        let access = Access {
            cors_origins: settings.cors_origins.clone(),
            // Without keys, a DNS rebinding attack could reach a service on the loopback address.
            checks_host: keys.is_none() && address.ip().is_loopback(),
            keys,
        };
        let mut http = http1::Builder::new();
        http.timer(TokioTimer::new()).header_read_timeout(Duration::from_millis(CLIENT_TIMEOUT_MS));
        http.max_header_size(MAX_HEADER_BYTES);
        Self {
            router: router::router(Arc::clone(app), &access),
            http,
            connection_permits: Arc::clone(&app.connection_permits),
            graceful: GracefulShutdown::new(),
            closing: CancellationToken::new(),
        }
    }

    /// Accepts connections until the service stops.
    async fn accept(&self, listener: &TcpListener) {
        loop {
            match listener.accept().await {
                Ok((stream, _)) => self.handle(stream),
                Err(error)
                    if matches!(error.kind(), io::ErrorKind::ConnectionAborted | io::ErrorKind::ConnectionReset) => {}
                Err(error) => {
                    tracing::error!(%error, "cannot accept a connection");
                    sleep(ACCEPT_PAUSE).await;
                }
            }
        }
    }

    /// Accepts the connections that wait in the kernel. Closing the listener would reset them.
    fn accept_waiting(&self, listener: &TcpListener) {
        for _ in 0..MAX_CONNECTIONS {
            let Some(Ok((stream, _))) = tokio::task::unconstrained(listener.accept()).now_or_never() else { return };
            self.handle(stream);
        }
    }

    fn handle(&self, stream: TcpStream) {
        // Without `TCP_NODELAY` small responses may wait for the acknowledgement of earlier ones.
        let _ = stream.set_nodelay(true);
        #[cfg(target_os = "linux")]
        let _ = SockRef::from(&stream).set_tcp_user_timeout(Some(Duration::from_millis(CLIENT_TIMEOUT_MS)));
        match Arc::clone(&self.connection_permits).try_acquire_owned() {
            Ok(permit) => self.serve_connection(stream, permit),
            Err(_) => {
                tokio::spawn(timeout(REFUSAL_TIMEOUT, refuse(stream)));
            }
        }
    }

    fn serve_connection(&self, stream: TcpStream, permit: OwnedSemaphorePermit) {
        let has_request = Arc::new(AtomicBool::new(false));
        let requested = Arc::clone(&has_request);
        let service = MapRequest::new(self.router.clone(), move |request: hyper::Request<Incoming>| {
            requested.store(true, Ordering::Relaxed);
            request.map(Body::new)
        });
        let connection = self.http.serve_connection(TokioIo::new(stream), TowerToHyperService::new(service));
        let connection = self.graceful.watch(connection);
        let closing = self.closing.clone();
        tokio::spawn(async move {
            let _place = permit;
            let closed_without_request = async {
                closing.cancelled().await;
                sleep(NOTICE).await;
                if has_request.load(Ordering::Relaxed) {
                    std::future::pending::<()>().await;
                }
            };
            tokio::select! {
                // The client sees connection errors. A request has its own log line.
                _ = connection => {}
                // Browsers open connections in advance. They must not delay a shutdown.
                () = closed_without_request => {}
            }
        });
    }

    /// Waits until all requests are answered. Near the end of `bound` it stops their computations.
    async fn finish(self, app: &App, bound: Duration) {
        self.closing.cancel();
        app.studies.close();
        let finished = async {
            self.graceful.shutdown().await;
            app.studies.closed().await;
        };
        let mut finished = pin!(finished);
        if timeout(bound.saturating_sub(LAST_ANSWERS), finished.as_mut()).await.is_err() {
            tracing::warn!("shutdown time is nearly over: running computations are stopped");
            app.pool.stop();
            let _ = timeout(LAST_ANSWERS, finished).await;
        }
    }
}

/// Refuses a connection over the limit. Closing it with unread bytes would reset it, so the request is read first.
async fn refuse(mut stream: TcpStream) -> io::Result<()> {
    let mut head = [0; 4096];
    let _ = stream.read(&mut head).await?;
    stream.write_all(REFUSAL).await?;
    stream.shutdown().await
}

/// Prints the address of the service and commands to try.
fn print_address(address: SocketAddr) {
    let text = format!(
        "toothwave {} listens on http://{address}
Page: http://{address}/
Examples for another terminal:
  curl -s http://{address}/v1/examples/paper-5.1 | curl -s --json @- http://{address}/v1/coincidence-degree
  curl -s http://{address}/v1/examples/paper-5.1 | curl -s --json @- http://{address}/v1/sweep
API documentation: http://{address}/docs
",
        env!("CARGO_PKG_VERSION")
    );
    // A thread, because standard output may be a pipe that is not read.
    std::thread::spawn(move || io::stdout().write_all(text.as_bytes()));
}
