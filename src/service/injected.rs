//! What `tests/faults/studies` does to chunks, by failpoints; in builds with `fault-injection` alone.

use std::fs::File;
use std::io::{self, Write as _};
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

/// Ends the process in the middle of this chunk's rows: `half_part=return(CHUNK)`.
pub(crate) fn half_a_part(chunk: u64, file: &mut File, rows: &[u8]) -> io::Result<()> {
    if number("half_part") == Some(chunk) {
        file.write_all(&rows[..rows.len() / 2])?;
        std::process::abort();
    }
    Ok(())
}

fn number(name: &str) -> Option<u64> {
    fail::fail_point!(name, |number| number.and_then(|number| number.parse().ok()));
    None
}
