//! Room for answers that clients have not read yet: slow readers of large answers must not fill the memory.

use std::sync::Arc;

use bytes::Bytes;
use metrics::counter;
use tokio::sync::{OwnedSemaphorePermit, Semaphore};

use crate::problem::{Problem, ProblemCode};

/// Answers up to here need no room: the bound on connections bounds them too.
const SMALL_BYTES: usize = 1 << 16;

/// Room for so many bytes.
#[derive(Debug)]
pub struct Room {
    /// One permit for each KiB.
    free: Arc<Semaphore>,
    max_bytes: u64,
}

/// An answer on its way, which gives its room back when it is sent or its client has left.
struct OnItsWay {
    answer: Bytes,
    _room: OwnedSemaphorePermit,
}

impl AsRef<[u8]> for OnItsWay {
    fn as_ref(&self) -> &[u8] {
        &self.answer
    }
}

impl Room {
    /// Room for at most `max_bytes` at once.
    pub fn new(max_bytes: u64) -> Self {
        Self { free: Arc::new(Semaphore::new(permits(max_bytes) as usize)), max_bytes }
    }

    /// The answer, taking room until it is dropped. One larger than all the room takes all of it.
    ///
    /// # Errors
    /// `too_many_unread_bytes` where there is not so much left.
    pub fn take(&self, answer: Bytes) -> Result<Bytes, Problem> {
        let size = answer.len();
        if size <= SMALL_BYTES {
            return Ok(answer);
        }
        let size = permits((size as u64).min(self.max_bytes));
        let room = Arc::clone(&self.free).try_acquire_many_owned(size).map_err(|_| {
            counter!("toothwave_refusals_total", "reason" => "too_many_unread_bytes").increment(1);
            let detail = format!(
                "the answer has {} bytes: with the others on their way to clients more than the {} of `max_unread_bytes`; try again in a moment",
                answer.len(),
                self.max_bytes
            );
            Problem::new(ProblemCode::TooManyUnreadBytes, detail)
        })?;
        Ok(Bytes::from_owner(OnItsWay { answer, _room: room }))
    }
}

/// Permits for so many bytes.
fn permits(bytes: u64) -> u32 {
    // As many as a semaphore of any machine can count.
    u32::try_from(bytes.div_ceil(1024)).unwrap_or(u32::MAX).min(u32::MAX >> 3)
}
