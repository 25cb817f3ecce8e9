//! The log's way out: lines are handed to a thread that writes them, and nothing waits for it. What listens to the log may be full, gone
//! or stuck; the service serves on, and counts the lines that were lost.

use std::io::{self, Write};
use std::panic;
use std::sync::OnceLock;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::time::Duration;

use tracing_subscriber::EnvFilter;
use tracing_subscriber::fmt::MakeWriter;

/// Lines that may wait to be written: some megabytes.
const WAITING_LINES: usize = 8_192;

/// What the lines that wait at the end of the process get to be written.
const LAST_LINES: Duration = Duration::from_millis(300);

/// Whether a panic ends the process: one of what it begins with, for which others may wait for ever.
static IS_STARTING: AtomicBool = AtomicBool::new(true);

static LOST_LINES: AtomicU64 = AtomicU64::new(0);
static WRITER: OnceLock<Log> = OnceLock::new();

/// Where the subscriber writes to.
#[derive(Debug, Clone)]
struct Log(SyncSender<Message>);

#[derive(Debug)]
enum Message {
    Line(Vec<u8>),
    /// To be answered when all lines before it are written.
    Flush(SyncSender<()>),
}

/// Logs as JSON to standard error from here on, panics included.
///
/// # Errors
/// Where no thread can be started.
pub fn start(filter: EnvFilter) -> io::Result<()> {
    let (lines, waiting) = sync_channel(WAITING_LINES);
    std::thread::Builder::new().name("log".into()).spawn(move || write(&waiting))?;
    let log = WRITER.get_or_init(|| Log(lines)).clone();
    tracing_subscriber::fmt().json().with_span_list(false).with_env_filter(filter).with_writer(log).init();
    // The usual hook writes to standard error itself, and would wait for it.
    panic::set_hook(Box::new(|panic| {
        let text = panic.payload_as_str().unwrap_or("without a text");
        let location = panic.location().map(ToString::to_string);
        tracing::error!(location, text, "a panic");
        if IS_STARTING.load(Ordering::Relaxed) {
            flush();
            std::process::exit(1);
        }
    }));
    Ok(())
}

/// A panic is from here on one of whatever panics.
pub fn end_of_start() {
    IS_STARTING.store(false, Ordering::Relaxed);
}

/// Waits until what was logged is written, but not for long.
pub fn flush() {
    let (written, done) = sync_channel(1);
    if WRITER.get().is_some_and(|Log(lines)| lines.try_send(Message::Flush(written)).is_ok()) {
        // Whether it is written or not, the process ends.
        let _ = done.recv_timeout(LAST_LINES);
    }
}

/// Lines that nobody will read: of these there were too many, or they could not be written.
pub fn lost_lines() -> u64 {
    LOST_LINES.load(Ordering::Relaxed)
}

fn write(waiting: &Receiver<Message>) {
    for message in waiting {
        match message {
            Message::Line(line) => {
                if io::stderr().write_all(&line).is_err() {
                    LOST_LINES.fetch_add(1, Ordering::Relaxed);
                }
            }
            Message::Flush(written) => {
                // Who asked may have waited long enough.
                let _ = written.try_send(());
            }
        }
    }
}

impl<'a> MakeWriter<'a> for Log {
    type Writer = Self;

    fn make_writer(&'a self) -> Self {
        self.clone()
    }
}

impl Write for Log {
    /// The subscriber writes whole lines.
    fn write(&mut self, line: &[u8]) -> io::Result<usize> {
        if self.0.try_send(Message::Line(line.into())).is_err() {
            LOST_LINES.fetch_add(1, Ordering::Relaxed);
        }
        Ok(line.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}
