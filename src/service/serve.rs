//! The running service: listening, bounded connections, and stopping in order.

use std::collections::VecDeque;
use std::io::{self, Write};
use std::net::SocketAddr;
use std::pin::pin;
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::Duration;

use axum::Router;
use axum::body::Body;
use futures_util::FutureExt as _;
use hyper::body::Incoming;
use hyper::server::conn::http1;
use hyper_util::rt::{TokioIo, TokioTimer};
use hyper_util::service::TowerToHyperService;
use parking_lot::Mutex;
use rustix::process::{Resource, getrlimit, setrlimit};
use tokio::net::{TcpListener, TcpSocket, TcpStream};
use tokio::runtime::Handle;
use tokio::signal::unix::{SignalKind, signal};
use tokio::sync::{OwnedSemaphorePermit, Semaphore, watch};
use tokio::task::{AbortHandle, unconstrained};
use tokio::time::{Instant, sleep, timeout_at};
use tokio_util::sync::CancellationToken;
use tokio_util::task::TaskTracker;
use tower::util::MapRequest;

use crate::app::App;
use crate::compute::Pool;
use crate::config::{Limits, MAX_HEADER_BYTES, Settings, StudiesPlace};
use crate::observe;
use crate::router::{self, Entry};
use crate::socket::{Seen, Socket};
use crate::studies::{Keeping, Store};

/// How long the service still listens at least after it has said that it is not ready, so that whoever asks can learn it.
const NOTICE: Duration = Duration::from_millis(200);

/// What running solves get at the end of the bound on a shutdown to be answered that it is over.
const LAST_WORDS: Duration = Duration::from_millis(300);

/// What a client beyond the last connection gets for all of its request and answer, and then to take it.
const REFUSAL: Duration = Duration::from_secs(1);

/// Connections beyond the last one that are open at once: of more the oldest is closed, but none whose request waits to be read, so that a
/// probe, which asks at once, is answered however many others come and say nothing.
const SIDE_CONNECTIONS: usize = 64;

/// What is read of a connection ahead of its turn, or waits to be written, at most: more than a head, and little for each of a thousand.
const MOST_AHEAD_BYTES: usize = 1 << 16;

/// Files that are kept for all but admitted connections: those beyond the last one, the listener, what the runtime has, the keys file.
const OTHER_FILES: u64 = SIDE_CONNECTIONS as u64 + 64;

/// Between two looks whether something that has come is still unread.
const UNREAD_LOOK: Duration = Duration::from_millis(1);

/// After an error of the listener itself, such as too many open files.
const ACCEPT_PAUSE: Duration = Duration::from_millis(100);

/// What has come of a connection and is not read yet may take so much in the system, which doubles it for what it notes.
const UNREAD_BYTES: u32 = 1 << 16;

/// What a client was sent and has not acknowledged takes as much, doubled likewise. A client far away gets so much in each round trip.
const UNACKNOWLEDGED_BYTES: u32 = 1 << 17;

/// Connections that may wait to be taken in: of a burst the system drops those beyond, and their clients try again after a second.
const BACKLOG: u32 = 4096;

fn listen_on(address: SocketAddr) -> io::Result<TcpListener> {
    let socket = if address.is_ipv4() { TcpSocket::new_v4()? } else { TcpSocket::new_v6()? };
    // As a service has it that is started again: connections of before may still be coming to their end.
    socket.set_reuseaddr(true)?;
    // Each of a thousand clients that send on what nobody reads could have some MiB of the system's memory otherwise, which may be the container's.
    socket.set_recv_buffer_size(UNREAD_BYTES)?;
    socket.set_send_buffer_size(UNACKNOWLEDGED_BYTES)?;
    socket.bind(address)?;
    socket.listen(BACKLOG)
}

/// Serves until a signal, then drains within the bound of the settings, or until a second signal.
///
/// # Errors
/// Where the address cannot be listened on, or the process gets no signals.
pub async fn serve(settings: &Settings, threads: &Handle) -> io::Result<()> {
    observe::install_recorder();
    // First: as the only process of a container it would not be ended by a signal that nobody takes, and to open a store may take long.
    let (mut terminate, mut interrupt) = (signal(SignalKind::terminate())?, signal(SignalKind::interrupt())?);
    let mut hang_up = signal(SignalKind::hangup())?;
    let mut told_to_stop = async || {
        tokio::select! {
            _ = terminate.recv() => {}
            _ = interrupt.recv() => {}
        }
    };
    let keeping = keeping(settings)?;
    let listener = listen_on(settings.listen)
        .map_err(|error| io::Error::new(error.kind(), format!("{}: {error}", settings.listen)))?;
    let address = listener.local_addr()?;
    let keys = settings.keys_file.clone();
    if keys.is_none() && !address.ip().is_loopback() {
        tracing::warn!(%address, "anyone who reaches this address may use the service: no keys file is set");
    }
    if let Some(keys) = &keys {
        keys.warn_of_readers();
    }
    let mut limits = settings.limits();
    limits.max_connections = connections_that_fit(limits.max_connections)?;
    let app = App::keeping(Pool::new(limits).on(threads), limits, keeping);
    app.studies.load().await.map_err(io::Error::other)?;
    let entry = Entry {
        cors_origins: settings.cors_origins.clone(),
        // A page of another site that resolves its own name to this machine knows no key.
        checks_host: keys.is_none() && address.ip().is_loopback(),
        keys: keys.clone(),
    };
    let server = Server::new(&app, &entry);
    // Whoever started the service may not read its output.
    let greeting = std::thread::Builder::new().name("greeting".into()).spawn(move || greet(address));
    if let Err(error) = greeting {
        tracing::warn!(%error, "no thread for the greeting");
    }
    tokio::spawn(observe::keep_up());
    tokio::spawn({
        let app = Arc::clone(&app);
        let not_done = "no large answer is begun, those that are made are given up";
        // Before clients are refused.
        app.pool.memory().clone().watch(not_done, move || app.cache.let_go())
    });
    tokio::spawn({
        let app = Arc::clone(&app);
        async move { app.studies.forget_old().await }
    });
    if let Some(keys) = keys {
        tokio::spawn(async move {
            for number in 1.. {
                if hang_up.recv().await.is_none() {
                    break;
                }
                keys.reload(number);
            }
        });
    }
    let notice = NOTICE.max(settings.lame_duck());
    let stopping = async {
        told_to_stop().await;
        tracing::info!("stopping: no longer ready, still listening");
        app.ready.store(false, Ordering::Relaxed);
        tokio::select! {
            () = sleep(notice) => false,
            () = told_to_stop() => true,
        }
    };
    let is_told_twice = tokio::select! {
        twice = stopping => twice,
        () = server.accept(&listener) => false,
    };
    if !is_told_twice {
        server.accept_those_that_wait(&listener);
        drop(listener);
        server.closing.cancel();
        app.studies.close();
        let ended = async {
            let until = Instant::now() + settings.shutdown();
            drain(server.open, &app, settings.shutdown()).await;
            if timeout_at(until.max(Instant::now() + LAST_WORDS), app.studies.closed()).await.is_err() {
                tracing::warn!("studies did not stop in time; what is kept of them is whole");
            }
        };
        tokio::select! {
            () = ended => {}
            () = told_to_stop() => tracing::warn!("told to stop again: what still ran is given up"),
        }
    }
    tracing::info!("stopped");
    Ok(())
}

/// Where the settings have studies kept.
fn keeping(settings: &Settings) -> io::Result<Keeping> {
    let file = match &settings.studies {
        Some(StudiesPlace::Off) => return Ok(Keeping::Off),
        Some(StudiesPlace::File(file)) => Some(file.as_path()),
        None => None,
    };
    let store = Store::open(file).map_err(|error| match file {
        Some(file) => io::Error::other(format!("{}: {error}", file.display())),
        None => io::Error::other(error),
    })?;
    Ok(Keeping::In { store, expiry: Duration::from_secs(settings.study_expiry_s) })
}

/// Raises the number of files that the process may open as far as it may; where that is not allowed, it stays what it was.
fn open_as_many_files_as_possible() {
    let mut files = getrlimit(Resource::Nofile);
    files.current = files.maximum;
    let _ = setrlimit(Resource::Nofile, files);
}

/// As many connections as are wanted, or as the process may open files for, whose number is raised as far as the process may do so itself.
///
/// # Errors
/// Where that is none.
fn connections_that_fit(wanted: usize) -> io::Result<usize> {
    open_as_many_files_as_possible();
    let Some(files) = getrlimit(Resource::Nofile).current else { return Ok(wanted) };
    let fit = usize::try_from(files.saturating_sub(OTHER_FILES)).unwrap_or(usize::MAX);
    if fit == 0 {
        let why = format!("the process may open {files} files: {OTHER_FILES}, and one for each connection, are wanted");
        return Err(io::Error::other(why));
    }
    if fit < wanted {
        tracing::warn!(files, wanted, fit, "fewer connections than wanted: the process may not open more files");
    }
    Ok(wanted.min(fit))
}

/// Waits until every request is answered, at most for `bound`; just before its end running solves are told to stop.
async fn drain(connections: TaskTracker, app: &App, bound: Duration) {
    let close_pool = async {
        sleep(bound.saturating_sub(LAST_WORDS)).await;
        tracing::warn!("requests still ran when the time to stop was nearly over");
        app.pool.close();
        sleep(LAST_WORDS).await;
    };
    connections.close();
    tokio::select! {
        () = connections.wait() => {}
        () = close_pool => {}
    }
}

/// Waits until a connection is to be used no more, once the service stops: whether it ever asked. What has come in time is read before: hyper
/// closes what it has read nothing of.
async fn is_to_end(closing: CancellationToken, mut has_asked: watch::Receiver<bool>, seen: Seen) -> bool {
    closing.cancelled().await;
    let until = Instant::now() + NOTICE;
    // An error says that there is no connection any more.
    let Ok(Ok(_)) = timeout_at(until, has_asked.wait_for(|&has_asked| has_asked)).await else { return false };
    while seen.has_unread() && Instant::now() < until {
        sleep(UNREAD_LOOK).await;
    }
    true
}

struct Server {
    router: Router,
    http: http1::Builder,
    /// What a connection beyond the last one gets.
    side: Router,
    side_http: http1::Builder,
    /// The last of those, the oldest first.
    side_connections: Mutex<VecDeque<(AbortHandle, Seen)>>,
    /// One for each of those, until its file is closed.
    side_places: Arc<Semaphore>,
    /// Connections that are served.
    open: TaskTracker,
    /// Cancelled when the service stops.
    closing: CancellationToken,
    connections: Arc<Semaphore>,
    patience: Duration,
}

impl Server {
    fn new(app: &Arc<App>, entry: &Entry) -> Self {
        let Limits { max_connections, header_timeout_ms, .. } = app.limits;
        let patience = Duration::from_millis(header_timeout_ms);
        let http = |patience| {
            let mut http = http1::Builder::new();
            http.timer(TokioTimer::new()).header_read_timeout(patience).max_header_size(MAX_HEADER_BYTES);
            http.max_buf_size(MOST_AHEAD_BYTES);
            http
        };
        let mut side_http = http(REFUSAL);
        side_http.keep_alive(false);
        Self {
            router: router::router(Arc::clone(app), entry),
            http: http(patience),
            side: router::beyond_connections(Arc::clone(app), entry),
            side_http,
            side_connections: Mutex::default(),
            side_places: Arc::new(Semaphore::new(SIDE_CONNECTIONS)),
            open: TaskTracker::new(),
            closing: CancellationToken::new(),
            connections: Arc::new(Semaphore::new(max_connections)),
            patience,
        }
    }

    /// Accepts connections for ever.
    async fn accept(&self, listener: &TcpListener) {
        loop {
            match listener.accept().await {
                Ok((stream, _)) => self.take(stream).await,
                Err(error) => {
                    // A client that gave up is none of the listener's faults; the others pass when something is closed.
                    if !matches!(error.kind(), io::ErrorKind::ConnectionAborted | io::ErrorKind::ConnectionReset) {
                        tracing::error!(%error, "no connection could be accepted");
                        sleep(ACCEPT_PAUSE).await;
                    }
                }
            }
        }
    }

    /// Accepts the connections that came before the listener is closed, which would cut them.
    fn accept_those_that_wait(&self, listener: &TcpListener) {
        // As many as could wait: those that come meanwhile, of many clients ever more, hold up no shutdown.
        for _ in 0..BACKLOG {
            // Of its own the runtime would say that none waits after some hundred.
            let Some(Ok((stream, _))) = unconstrained(listener.accept()).now_or_never() else { return };
            // Beyond the last connection nobody is taken in any more.
            if let Ok(permit) = Arc::clone(&self.connections).try_acquire_owned() {
                self.serve(Socket::new(stream, self.patience), permit);
            }
        }
    }

    async fn take(&self, stream: TcpStream) {
        match Arc::clone(&self.connections).try_acquire_owned() {
            Ok(permit) => self.serve(Socket::new(stream, self.patience), permit),
            Err(_) => {
                // The files that are kept for these are few: no further one is opened before another is closed.
                let place = self.side_place().await;
                self.serve_beside(stream, place);
            }
        }
    }

    async fn side_place(&self) -> Option<OwnedSemaphorePermit> {
        if let Ok(place) = Arc::clone(&self.side_places).try_acquire_owned() {
            return Some(place);
        }
        {
            let mut connections = self.side_connections.lock();
            connections.retain(|(_, seen)| seen.is_open());
            // Of a burst, those that ask may not have had their turn yet.
            let silent = connections.iter().position(|(_, seen)| !seen.has_unread());
            if let Some((oldest, seen)) = connections.remove(silent.unwrap_or(0)) {
                seen.give_up_much();
                oldest.abort();
            }
        }
        // An error says that the semaphore is closed, which it never is.
        Arc::clone(&self.side_places).acquire_owned().await.ok()
    }

    fn serve(&self, stream: Socket, permit: OwnedSemaphorePermit) {
        let (asked, has_asked) = watch::channel(false);
        let service = MapRequest::new(self.router.clone(), move |request: hyper::Request<Incoming>| {
            asked.send_replace(true);
            request.map(Body::new)
        });
        let (left, closed) = (stream.left(), stream.closed());
        let is_to_end = is_to_end(self.closing.clone(), has_asked, stream.seen());
        let closing = self.closing.clone();
        let connection = self.http.serve_connection(TokioIo::new(stream), TowerToHyperService::new(service));
        self.open.spawn(async move {
            let _held = permit;
            let to_its_end = async move {
                let mut connection = pin!(connection);
                tokio::select! {
                    // What goes wrong on a connection is its client's to know; the request, if there was one, is logged by itself.
                    _ = connection.as_mut() => {}
                    has_asked = is_to_end => {
                        // A client that has not finished its first request's head holds up no shutdown.
                        if !has_asked {
                            return;
                        }
                        connection.as_mut().graceful_shutdown();
                        let _ = connection.await;
                    }
                }
            };
            tokio::select! {
                () = to_its_end => {}
                () = left => {}
            }
            // Who is answered, and does not take it or does not close, holds up no shutdown either.
            let has_had_time = async {
                closing.cancelled().await;
                sleep(NOTICE).await;
            };
            tokio::select! {
                () = closed => {}
                () = has_had_time => {}
            }
        });
    }

    /// Answers a connection beyond the last one: health and metrics as ever, all else with a refusal.
    fn serve_beside(&self, stream: TcpStream, place: Option<OwnedSemaphorePermit>) {
        let stream = Socket::new(stream, REFUSAL);
        let service = MapRequest::new(self.side.clone(), |request: hyper::Request<Incoming>| request.map(Body::new));
        let (closed, seen) = (stream.closed(), stream.seen());
        let connection = self.side_http.serve_connection(TokioIo::new(stream), TowerToHyperService::new(service));
        let answered = tokio::spawn(async move {
            let _held = place;
            let _ = tokio::time::timeout(REFUSAL, connection).await;
            closed.await;
        });
        let mut connections = self.side_connections.lock();
        // Each keeps some kilobytes of its task.
        connections.retain(|(_, seen)| seen.is_open());
        connections.push_back((answered.abort_handle(), seen));
    }
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

#[cfg(test)]
mod tests {
    use clap::Parser as _;
    use socket2::SockRef;
    use tokio::io::{AsyncReadExt as _, AsyncWriteExt as _};

    use super::*;

    #[derive(clap::Parser)]
    struct Line {
        #[command(flatten)]
        settings: Settings,
    }

    /// A client whose connection is taken in when the service already closes, having sent this, and all that it gets.
    async fn answered(sent: &[u8]) -> io::Result<String> {
        let Line { settings } = Line::parse_from(["serve"]);
        let server = Server::new(&App::new(settings.limits()), &Entry::default());
        let listener = listen_on(SocketAddr::from(([127, 0, 0, 1], 0)))?;
        let mut client = TcpStream::connect(listener.local_addr()?).await?;
        client.write_all(sent).await?;
        server.closing.cancel();
        server.accept_those_that_wait(&listener);
        let mut answer = String::new();
        client.read_to_string(&mut answer).await?;
        server.open.close();
        server.open.wait().await;
        Ok(answer)
    }

    #[tokio::test]
    async fn what_has_come_before_the_service_closes_is_answered_though_nobody_has_read_it_yet() -> io::Result<()> {
        let answer = answered(b"GET /health/live HTTP/1.1\r\nhost: localhost\r\n\r\n").await?;
        assert!(answer.starts_with("HTTP/1.1 200"), "{answer:?}");
        Ok(())
    }

    /// Of each that came beyond the last connection its task was kept: some 38 000 probes, one after the other, ended a service of 128 MiB.
    #[tokio::test]
    async fn of_connections_beyond_the_last_one_nothing_is_kept() -> io::Result<()> {
        let Line { settings } = Line::parse_from(["serve"]);
        let server = Server::new(&App::new(settings.limits()), &Entry::default());
        let listener = listen_on(SocketAddr::from(([127, 0, 0, 1], 0)))?;
        let address = listener.local_addr()?;
        let mut most = 0;
        for _ in 0..100 {
            let mut client = TcpStream::connect(address).await?;
            let (stream, _) = listener.accept().await?;
            let place = server.side_place().await;
            server.serve_beside(stream, place);
            client.write_all(b"GET /health/live HTTP/1.1\r\nhost: localhost\r\n\r\n").await?;
            let mut answer = String::new();
            client.read_to_string(&mut answer).await?;
            assert!(answer.starts_with("HTTP/1.1 200"), "{answer:?}");
            drop(client);
            most = most.max(server.side_connections.lock().len());
        }
        assert!(most < 10, "{most}");
        Ok(())
    }

    /// Of each client whose network was gone the system kept what it had been sent for minutes, 2 MB each, and its place was another's: 210 MiB at 128 MiB.
    #[tokio::test]
    async fn what_a_client_does_not_take_is_thrown_away_and_nobody_has_its_place_before() -> io::Result<()> {
        let Line { settings } = Line::parse_from(["serve", "--header-timeout-ms", "300"]);
        let server = Server::new(&App::new(settings.limits()), &Entry::default());
        let listener = listen_on(SocketAddr::from(([127, 0, 0, 1], 0)))?;
        let socket = TcpSocket::new_v4()?;
        socket.set_recv_buffer_size(1 << 12)?;
        let mut client = socket.connect(listener.local_addr()?).await?;
        let (stream, _) = listener.accept().await?;
        // So that the system takes all of the answer.
        SockRef::from(&stream).set_send_buffer_size(1 << 20)?;
        server.take(stream).await;
        client.write_all(b"GET /openapi.json HTTP/1.1\r\nhost: localhost\r\nconnection: close\r\n\r\n").await?;
        server.open.close();
        server.open.wait().await;
        let error = client.read_to_end(&mut Vec::new()).await.expect_err("what was thrown away");
        assert_eq!(error.kind(), io::ErrorKind::ConnectionReset);
        Ok(())
    }

    #[tokio::test]
    async fn who_has_not_asked_holds_up_no_shutdown() -> io::Result<()> {
        for sent in [&b""[..], b"GET /health/live HTTP/1.1\r\nhost:"] {
            assert_eq!(answered(sent).await.unwrap_or_default(), "");
        }
        Ok(())
    }
}
