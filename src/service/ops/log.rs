//! The log: short lines on a terminal, JSON elsewhere. Writing never blocks; excess lines are dropped and counted.

use std::io::{self, IsTerminal as _};
use std::panic;
use std::sync::OnceLock;

use tracing_appender::non_blocking::{ErrorCounter, NonBlockingBuilder, WorkerGuard};
use tracing_subscriber::EnvFilter;

/// Most lines in the buffer: some megabytes.
const MAX_WAITING_LINES: usize = 8_192;

static DROPPED: OnceLock<ErrorCounter> = OnceLock::new();

/// Starts the log to standard error, panics included. Dropping the guard writes the buffered lines.
pub fn start(filter: EnvFilter) -> WorkerGuard {
    let builder = NonBlockingBuilder::default().lossy(true).buffered_lines_limit(MAX_WAITING_LINES);
    let (writer, guard) = builder.finish(io::stderr());
    DROPPED.get_or_init(|| writer.error_counter());
    let log = tracing_subscriber::fmt().with_env_filter(filter).with_writer(writer);
    if io::stderr().is_terminal() {
        log.compact().with_target(false).init();
    } else {
        log.json().with_span_list(false).init();
    }
    // The standard hook writes to standard error directly, which may block.
    panic::set_hook(Box::new(|panic| {
        let text = panic.payload_as_str().unwrap_or("no text");
        tracing::error!(location = panic.location().map(ToString::to_string), text, "panic");
    }));
    guard
}

/// Returns the number of dropped lines.
pub fn lost_lines() -> u64 {
    DROPPED.get().map_or(0, |counter| counter.dropped_lines() as u64)
}
