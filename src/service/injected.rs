//! What `tests/faults/studies` does to chunks, by failpoints; in builds with `fault-injection` alone.

use std::time::Duration;

/// What a chunk should take, where that is ordered: `chunk_ms=return(MS)`.
pub(crate) fn chunk() -> Option<Duration> {
    milliseconds("chunk_ms")
}

/// Ends the process where this chunk is poison: `poison=return(CHUNK)`.
pub(crate) fn poison(chunk: u64) {
    if number("poison") == Some(chunk) {
        std::process::abort();
    }
}

/// For so long a worker sleeps over each chunk before it computes: `slow=return(MS)`.
pub(crate) fn slow() -> Option<Duration> {
    milliseconds("slow")
}

/// For so long chunks only sleep, and are not computed at all: `asleep=return(MS)`.
pub(crate) fn asleep() -> Option<Duration> {
    milliseconds("asleep")
}

fn milliseconds(name: &str) -> Option<Duration> {
    number(name).map(Duration::from_millis)
}

fn number(name: &str) -> Option<u64> {
    fail::fail_point!(name, |number| number.and_then(|number| number.parse().ok()));
    None
}
