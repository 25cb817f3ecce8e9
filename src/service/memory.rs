//! What the process really holds of the memory. What answers, variants and the cache take is counted before they have it, some of it by
//! estimates; this is looked at besides, so that no estimate that was too low ends the process.

use std::fs::File;
use std::io;
use std::os::unix::fs::FileExt as _;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::time::Duration;

use parking_lot::Mutex;
use tokio::time::Instant;

use crate::machine;

/// Between two looks: in that time a processor fills some megabytes.
const LOOK: Duration = Duration::from_millis(5);

/// Of the memory, such a part at least is nobody's: beyond the rest it is scarce. Until that is seen two processors still fill some of it, and the kernel
/// has its own.
const SPARE_PART: u64 = 5;

/// So often at most does the log say so.
const SAY: Duration = Duration::from_secs(10);

/// A memory below this is small.
const SMALL_BYTES: u64 = 4 << 30;

/// Whether more of the memory is held than should be.
#[derive(Debug, Clone)]
pub struct Memory(Arc<Inner>);

#[derive(Debug)]
struct Inner {
    is_scarce: AtomicBool,
    scarce_since: Mutex<Option<Instant>>,
    /// Beyond this it is scarce; nobody knows before it is watched.
    most_bytes: AtomicU64,
}

impl Default for Memory {
    fn default() -> Self {
        let (is_scarce, scarce_since) = Default::default();
        Self(Arc::new(Inner { is_scarce, scarce_since, most_bytes: AtomicU64::new(u64::MAX) }))
    }
}

impl Memory {
    /// Whether it is, as it was last seen.
    pub fn is_scarce(&self) -> bool {
        self.0.is_scarce.load(Ordering::Relaxed)
    }

    /// Sets what is seen.
    pub fn set_scarce(&self, is_scarce: bool) {
        if self.0.is_scarce.swap(is_scarce, Ordering::Relaxed) != is_scarce {
            *self.0.scarce_since.lock() = is_scarce.then(Instant::now);
        }
    }

    /// For how long it has been.
    pub fn scarce_for(&self) -> Duration {
        self.0.scarce_since.lock().map_or(Duration::ZERO, |since| since.elapsed())
    }

    /// Whether so many bytes more would leave what is to be left, as it is in this moment.
    pub fn has(&self, bytes: u64) -> bool {
        let most_bytes = self.0.most_bytes.load(Ordering::Relaxed);
        let held_bytes = || Status::open().and_then(|status| status.held_bytes());
        most_bytes == u64::MAX || held_bytes().is_ok_and(|held_bytes| held_bytes.saturating_add(bytes) <= most_bytes)
    }

    /// Sets how large it is, and with that what may be held.
    pub fn set_size(&self, memory_bytes: u64) -> u64 {
        let most_bytes = memory_bytes - memory_bytes / SPARE_PART;
        self.0.most_bytes.store(most_bytes, Ordering::Relaxed);
        most_bytes
    }

    /// Looks for ever, where the machine tells, and has give way what can where memory is scarce; the log says then what is not done.
    pub async fn watch(self, not_done: &str, give_way: impl Fn()) {
        // Opened once: where the process has no more files that must not end the watch.
        let (Some(memory_bytes), Ok(status)) = (machine::memory_bytes(), Status::open()) else { return };
        let most_bytes = self.set_size(memory_bytes);
        let mut said: Option<Instant> = None;
        loop {
            // What cannot be seen for once is as it was.
            if let Ok(held_bytes) = status.held_bytes() {
                let is_scarce = held_bytes > most_bytes;
                if is_scarce && said.is_none_or(|said| said.elapsed() > SAY) {
                    tracing::warn!(held_bytes, memory_bytes, "memory is scarce: {not_done}");
                    said = Some(Instant::now());
                }
                self.set_scarce(is_scarce);
                if is_scarce {
                    give_way();
                }
            }
            tokio::time::sleep(LOOK).await;
        }
    }
}

/// Where the memory is small the kernel is to give no page of 2 MiB where one of 4 KiB was touched, as the allocator asks it to: of sixteen threads that had
/// solved a little, tens of MiB were such pages, which nobody counts. Where it is large they are faster.
pub fn keep_pages_small() {
    if machine::memory_bytes().is_some_and(|bytes| bytes < SMALL_BYTES) {
        // Where the kernel knows no such pages there are none.
        let _ = rustix::thread::disable_transparent_huge_pages(true);
    }
}

/// What the kernel tells of this process.
struct Status(File);

impl Status {
    fn open() -> io::Result<Self> {
        File::open("/proc/self/status").map(Self)
    }

    /// Of the memory, what this process alone holds and cannot be read again from files.
    fn held_bytes(&self) -> io::Result<u64> {
        let mut text = [0; 4096];
        let read = self.0.read_at(&mut text, 0)?;
        let kib = str::from_utf8(&text[..read]).ok().and_then(|text| {
            let line = text.lines().find_map(|line| line.strip_prefix("RssAnon:"))?;
            line.split_whitespace().next()?.parse::<u64>().ok()
        });
        kib.map(|kib| 1024 * kib).ok_or_else(|| io::ErrorKind::InvalidData.into())
    }
}

#[cfg(test)]
mod tests {
    use super::{Memory, Status};
    use crate::room::Room;

    #[test]
    fn what_is_written_to_is_held() {
        const BYTES: usize = 256 << 20;
        let status = Status::open().expect("Linux tells");
        let before = status.held_bytes().expect("it does");
        let written = std::hint::black_box(vec![1_u8; BYTES]);
        // Other tests let go of little meanwhile.
        assert!(status.held_bytes().expect("again and again") - before > BYTES as u64 / 2);
        drop(written);
    }

    #[test]
    fn an_answer_larger_than_all_the_room_grows_only_as_far_as_the_memory_really_has_it() {
        const TERABYTE: u64 = 1 << 40;
        let room = Room::new(1 << 20);
        let mut larger = room.reserve(2 << 20).expect("alone it is given");
        larger.hold_at_least(TERABYTE).expect("nobody knows how much memory there is");
        larger.hold_at_most(2 << 20);
        room.memory().set_size(2 * TERABYTE);
        assert!(larger.hold_at_least(4 * TERABYTE).is_err());
        assert!(larger.hold_at_least(TERABYTE).is_ok());
        // What it was given is not asked of the memory again.
        room.memory().set_size(0);
        assert!(larger.hold_at_least(TERABYTE).is_ok());
        assert!(larger.hold_at_least(2 * TERABYTE).is_err());
        drop(larger);
        assert!(room.reserve(1 << 20).is_ok());
        assert!(Memory::default().has(u64::MAX));
    }
}
