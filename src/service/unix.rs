//! What the service needs of Unix: signals, limits, priorities and file modes.

use std::fs::OpenOptions;
use std::io;
use std::os::unix::fs::OpenOptionsExt as _;
use std::path::Path;

use rustix::process::{Resource, getrlimit, setrlimit};
use tokio::net::TcpStream;
use tokio::signal::unix::{Signal, SignalKind, signal};

/// SIGTERM and SIGINT, which stop the service.
#[derive(Debug)]
pub struct StopSignals {
    terminate: Signal,
    interrupt: Signal,
}

impl StopSignals {
    /// Handles the signals from now on.
    pub fn new() -> io::Result<Self> {
        Ok(Self { terminate: signal(SignalKind::terminate())?, interrupt: signal(SignalKind::interrupt())? })
    }

    /// Waits for the next of them.
    pub async fn recv(&mut self) {
        tokio::select! {
            _ = self.terminate.recv() => {}
            _ = self.interrupt.recv() => {}
        }
    }
}

/// Returns the stream of SIGHUP.
pub fn hang_ups() -> io::Result<Signal> {
    signal(SignalKind::hangup())
}

/// Makes a file at its size limit an I/O error. Otherwise SIGXFSZ kills the process.
pub fn outlive_file_size_limit() -> io::Result<()> {
    signal(SignalKind::from_raw(rustix::process::Signal::XFSZ.as_raw())).map(drop)
}

/// Raises the limit of open files to the maximum. On failure it stays.
pub fn raise_file_limit() {
    let mut files = getrlimit(Resource::Nofile);
    files.current = files.maximum;
    let _ = setrlimit(Resource::Nofile, files);
}

/// Lowers the priority of this thread (Linux) or process. On failure it stays.
pub fn lower_priority(nice: i32) {
    let _ = rustix::process::nice(nice);
}

/// Switches transparent huge pages off. With them, clearing 2 MiB for each answer of 80 KB takes a sixth of its time.
pub fn use_small_pages() {
    #[cfg(target_os = "linux")]
    let _ = rustix::thread::disable_transparent_huge_pages(true);
}

/// Disconnects a client that takes no data for so long.
#[cfg_attr(not(target_os = "linux"), expect(unused_variables, reason = "only Linux has this option"))]
pub fn limit_unsent_time(stream: &TcpStream, limit: std::time::Duration) {
    #[cfg(target_os = "linux")]
    let _ = socket2::SockRef::from(stream).set_tcp_user_timeout(Some(limit));
}

/// Creates a file that other users cannot read, unless it exists.
pub fn create_private(file: &Path) -> io::Result<()> {
    OpenOptions::new().append(true).create(true).mode(0o600).open(file).map(drop)
}
