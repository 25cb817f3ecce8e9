//! What `tests/faults/studies` does to chunks, by failpoints; in builds with `fault-injection` alone.

use std::time::Duration;

/// Variants of a chunk, where that is ordered: `chunk_variants=return(VARIANTS)`.
pub(crate) fn chunk_variants() -> Option<u64> {
    number("chunk_variants")
}

/// For so long a worker sleeps over each chunk before it computes: `slow_ms=return(MS)`.
pub(crate) fn slow() -> Option<Duration> {
    number("slow_ms").map(Duration::from_millis)
}

/// For so long chunks only sleep, and are not computed at all: `asleep_ms=return(MS)`.
pub(crate) fn asleep() -> Option<Duration> {
    number("asleep_ms").map(Duration::from_millis)
}

/// Ends the process where this chunk is poison: `poison=return(CHUNK)`.
pub(crate) fn poison(chunk: u64) {
    if number("poison") == Some(chunk) {
        std::process::abort();
    }
}

fn number(name: &str) -> Option<u64> {
    fail::fail_point!(name, |number| number.and_then(|number| number.parse().ok()));
    None
}
