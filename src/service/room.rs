//! Room for large answers on their way to clients: those who read slowly must not fill the memory.

use std::sync::{Arc, Weak};

use bytes::Bytes;
use parking_lot::Mutex;
use tokio::sync::{OwnedSemaphorePermit, Semaphore};

use crate::problem::{Problem, ProblemCode};

/// Answers up to here need no room, so that slow readers of large ones stop nobody's ordinary work; the bound on connections bounds
/// them too.
const SMALL_BYTES: usize = 1 << 18;

/// Room for so many bytes.
#[derive(Debug)]
pub struct Room {
    /// One permit for each KiB.
    free: Arc<Semaphore>,
    max_bytes: u64,
}

/// An answer on its way, which gives its room back when the last client has it or has left.
#[derive(Debug)]
struct OnItsWay {
    answer: Bytes,
    _room: OwnedSemaphorePermit,
}

/// What one of its clients holds.
struct Share(Arc<OnItsWay>);

impl AsRef<[u8]> for Share {
    fn as_ref(&self) -> &[u8] {
        &self.0.answer
    }
}

/// Whether an answer is on its way to somebody already: it is in memory once, and takes room once.
#[derive(Debug, Clone, Default)]
pub struct Sent(Arc<Mutex<Weak<OnItsWay>>>);

impl Room {
    /// Room for at most `max_bytes` at once.
    pub fn new(max_bytes: u64) -> Self {
        Self { free: Arc::new(Semaphore::new(permits(max_bytes) as usize)), max_bytes }
    }

    /// The answer, taking room until it is dropped. One larger than all the room takes all of it.
    ///
    /// # Errors
    /// `too_many_unread_bytes` where there is not so much left.
    pub fn take(&self, answer: Bytes, sent: &Sent) -> Result<Bytes, Problem> {
        if answer.len() <= SMALL_BYTES {
            return Ok(answer);
        }
        let mut sent = sent.0.lock();
        if let Some(shared) = sent.upgrade() {
            return Ok(Bytes::from_owner(Share(shared)));
        }
        let size = permits((answer.len() as u64).min(self.max_bytes));
        let room = Arc::clone(&self.free).try_acquire_many_owned(size).map_err(|_| {
            let detail = format!(
                "the answer has {} bytes: with the others on their way to clients more than the {} of `max_unread_bytes`; try again in a moment",
                answer.len(),
                self.max_bytes
            );
            Problem::new(ProblemCode::TooManyUnreadBytes, detail)
        })?;
        let shared = Arc::new(OnItsWay { answer, _room: room });
        *sent = Arc::downgrade(&shared);
        Ok(Bytes::from_owner(Share(shared)))
    }
}

/// Permits for so many bytes: at least one, so that without any room large answers go one at a time, and no more than a semaphore of
/// any machine can count.
fn permits(bytes: u64) -> u32 {
    u32::try_from(bytes.div_ceil(1024)).unwrap_or(u32::MAX).clamp(1, u32::MAX >> 3)
}
