//! What the service needs of Unix: signals, limits, priorities and file modes.

use std::fs::OpenOptions;
use std::io;
use std::os::unix::fs::OpenOptionsExt as _;
use std::path::Path;

use rustix::process::{Resource, getrlimit, setrlimit};
use tokio::signal::unix::{Signal, SignalKind, signal};

/// Handles SIGTERM and SIGINT from now on. The returned function waits for the next of them.
pub fn stop_signals() -> io::Result<impl AsyncFnMut()> {
    let (mut terminate, mut interrupt) = (signal(SignalKind::terminate())?, signal(SignalKind::interrupt())?);
    Ok(async move || {
        tokio::select! {
            _ = terminate.recv() => {}
            _ = interrupt.recv() => {}
        }
    })
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

/// Creates a file that other users cannot read, unless it exists.
pub fn create_private(file: &Path) -> io::Result<()> {
    OpenOptions::new().append(true).create(true).mode(0o600).open(file).map(drop)
}
