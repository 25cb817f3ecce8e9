//! The byte budget: large answers together never hold more memory than this.
//!
//! **Bytes.** Answers up to 256 KiB are free. A larger answer reserves its upper bound before it is computed, gives back what it does
//! not need, and holds the rest until its last byte is handed to the network. Reservations are given in the order of the requests.
//! An answer above the whole budget is refused with 422. One that waits for 5 s gets 503 `too_many_unread_bytes`.

use std::sync::Arc;
use std::time::Duration;

use bytes::Bytes;
use tokio::sync::{OwnedSemaphorePermit, Semaphore};
use tokio::time::timeout;

use crate::http::problem::{Problem, ProblemCode};

/// Answers up to this size reserve nothing.
pub const FREE_BYTES: u64 = 256 << 10;

/// A sweep to a tolerance, whose size is not known before, reserves this part of the budget.
pub const PART_OF_UNKNOWN_SIZE: u64 = 8;

/// A request waits for bytes at most this long.
const PATIENCE: Duration = Duration::from_secs(5);

/// Bytes of one permit of the semaphore.
const UNIT_BYTES: u64 = 1 << 10;

/// Bytes that all large answers share; clones share the same budget.
#[derive(Debug, Clone)]
pub struct Budget {
    free: Arc<Semaphore>,
    max_bytes: u64,
}

/// A part of the budget, given back when it is dropped.
#[derive(Debug)]
pub struct Reservation {
    permit: OwnedSemaphorePermit,
    bytes: u64,
}

/// The bytes of an answer that hold their reservation.
struct Held {
    body: Bytes,
    _reservation: Arc<Reservation>,
}

impl AsRef<[u8]> for Held {
    fn as_ref(&self) -> &[u8] {
        &self.body
    }
}

impl Budget {
    /// A budget of this many bytes.
    pub fn new(max_bytes: u64) -> Self {
        let permits = usize::try_from(max_bytes / UNIT_BYTES).unwrap_or(usize::MAX).min(Semaphore::MAX_PERMITS);
        Self { free: Arc::new(Semaphore::new(permits)), max_bytes }
    }

    /// The whole budget.
    pub const fn max_bytes(&self) -> u64 {
        self.max_bytes
    }

    /// Bytes that are reserved now.
    pub fn reserved_bytes(&self) -> u64 {
        self.max_bytes.saturating_sub(self.free.available_permits() as u64 * UNIT_BYTES)
    }

    /// Reserves for an answer of at most this many bytes. An answer of at most 256 KiB reserves nothing.
    pub async fn reserve(&self, bytes: u64) -> Result<Option<Reservation>, Problem> {
        if bytes <= FREE_BYTES {
            return Ok(None);
        }
        let units = u32::try_from(bytes.div_ceil(UNIT_BYTES)).ok().filter(|_| bytes <= self.max_bytes);
        let Some(units) = units else {
            let detail = format!(
                "the answer may take {bytes} bytes, more than the {} of `max_unread_bytes`. Ask for fewer states or points",
                self.max_bytes
            );
            return Err(Problem::new(ProblemCode::TooManyStates, detail));
        };
        match timeout(PATIENCE, Arc::clone(&self.free).acquire_many_owned(units)).await {
            Ok(permit) => {
                let permit = permit.map_err(|error| Problem::internal(&error))?;
                Ok(Some(Reservation { permit, bytes }))
            }
            Err(_) => {
                let detail = format!(
                    "the answer may take {bytes} bytes, and other large answers hold the rest of the {} of `max_unread_bytes`. Try again in a second",
                    self.max_bytes
                );
                Err(Problem::new(ProblemCode::TooManyUnreadBytes, detail))
            }
        }
    }
}

impl Reservation {
    /// What is reserved.
    pub const fn bytes(&self) -> u64 {
        self.bytes
    }

    /// Gives back all beyond this many bytes.
    pub fn shrink_to(&mut self, bytes: u64) {
        let units = usize::try_from(bytes.div_ceil(UNIT_BYTES)).unwrap_or(usize::MAX);
        // Dropping the rest gives it back.
        drop(self.permit.split(self.permit.num_permits().saturating_sub(units)));
        self.bytes = self.bytes.min(bytes);
    }

    /// The same body. It holds its reservation, if it has one, until the last part of it is dropped.
    pub fn hold(reservation: Option<Arc<Self>>, body: Bytes) -> Bytes {
        match reservation {
            Some(reservation) => Bytes::from_owner(Held { body, _reservation: reservation }),
            None => body,
        }
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use bytes::Bytes;
    use futures_util::poll;

    use super::{Budget, Reservation};
    use crate::http::problem::ProblemCode;

    const MIB: u64 = 1 << 20;

    #[tokio::test(start_paused = true)]
    async fn reservations_never_exceed_budget() {
        let budget = Budget::new(10 * MIB);
        let first = budget.reserve(6 * MIB).await.expect("room").expect("a large one");
        let mut second = Box::pin(budget.reserve(6 * MIB));
        assert!(poll!(&mut second).is_pending());
        // Reservations are served in order, so a small one does not overtake.
        let mut third = Box::pin(budget.reserve(MIB));
        assert!(poll!(&mut third).is_pending());
        assert!(budget.reserve(1000).await.expect("free").is_none());
        drop(first);
        let second = second.await.expect("room");
        assert!(third.await.is_ok());
        assert_eq!(budget.reserved_bytes(), 6 * MIB);
        let late = budget.reserve(6 * MIB).await;
        assert_eq!(late.map_err(|problem| problem.code).err(), Some(ProblemCode::TooManyUnreadBytes));
        drop(second);
        assert_eq!(budget.reserved_bytes(), 0);
    }

    #[tokio::test]
    async fn body_holds_its_bytes_until_dropped() {
        let budget = Budget::new(10 * MIB);
        let mut reservation = budget.reserve(8 * MIB).await.expect("room").expect("a large one");
        reservation.shrink_to(2 * MIB);
        let body = Reservation::hold(Some(Arc::new(reservation)), Bytes::from(vec![0; 1000]));
        let part = body.slice(10..20);
        drop(body);
        assert_eq!(budget.reserved_bytes(), 2 * MIB);
        drop(part);
        assert_eq!(budget.reserved_bytes(), 0);
    }
}
