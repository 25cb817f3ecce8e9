//! What the process really holds of the memory. What answers, variants and the cache take is counted before they have it, some of it by
//! estimates; this is looked at besides, so that no estimate that was too low ends the process.

use std::fs;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use crate::machine;

/// Between two looks: in that time a processor fills some megabytes.
const LOOK: Duration = Duration::from_millis(5);

/// Of the memory, so much at least is nobody's: beyond the rest it is scarce.
const SPARE_PART: u64 = 8;

/// So often at most does the log say so.
const SAY: Duration = Duration::from_secs(10);

/// Whether nearly all of the memory is held.
#[derive(Debug, Clone, Default)]
pub struct Memory(Arc<AtomicBool>);

impl Memory {
    /// Whether it is, as it was last seen.
    pub fn is_scarce(&self) -> bool {
        self.0.load(Ordering::Relaxed)
    }

    /// What is seen.
    pub fn is_seen_to_be_scarce(&self, is_scarce: bool) {
        self.0.store(is_scarce, Ordering::Relaxed);
    }

    /// Looks for ever, where the machine tells.
    pub async fn watch(self) {
        let Some(memory_bytes) = machine::memory_bytes() else { return };
        let most_bytes = memory_bytes - memory_bytes / SPARE_PART;
        let mut said: Option<Instant> = None;
        while let Some(held_bytes) = held_bytes() {
            let is_scarce = held_bytes > most_bytes;
            if is_scarce && said.is_none_or(|said| said.elapsed() > SAY) {
                tracing::warn!(
                    held_bytes,
                    memory_bytes,
                    "memory is scarce: no large answer is begun, those that are made are given up"
                );
                said = Some(Instant::now());
            }
            self.is_seen_to_be_scarce(is_scarce);
            tokio::time::sleep(LOOK).await;
        }
    }
}

/// Of the memory, what this process alone holds and cannot be read again from files.
fn held_bytes() -> Option<u64> {
    let status = fs::read_to_string("/proc/self/status").ok()?;
    let kib = status.lines().find_map(|line| line.strip_prefix("RssAnon:"))?.split_whitespace().next()?;
    Some(1024 * kib.parse::<u64>().ok()?)
}

#[cfg(test)]
mod tests {
    use super::held_bytes;

    #[test]
    fn what_is_written_to_is_held() {
        const BYTES: usize = 256 << 20;
        let before = held_bytes().expect("Linux tells");
        let written = std::hint::black_box(vec![1_u8; BYTES]);
        // Other tests let go of little meanwhile.
        assert!(held_bytes().expect("Linux tells") - before > BYTES as u64 / 2);
        drop(written);
    }
}
