//! The byte budget limits the memory of all large answers together.
//!
//! **Bytes.** Answers up to 256 KiB are free. A larger answer reserves its upper bound before it is computed. It
//! returns the bytes that it does not need and holds the rest until its last byte is handed to the network.
//! Reservations are granted in the order of the requests. An answer above the whole budget is refused with 422. A
//! request that waits for 5 s gets 503 `too_many_unread_bytes`.

use std::sync::Arc;
use std::time::Duration;

use bytes::Bytes;
use tokio::sync::{OwnedSemaphorePermit, Semaphore};
use tokio::time::timeout;

use crate::http::problem::{Problem, ProblemCode};

/// Largest answer that reserves nothing, in bytes.
pub const FREE_BYTES: u64 = 256 << 10;

/// Divisor of the budget. A sweep with a tolerance has an unknown size and reserves this fraction.
pub const UNKNOWN_SIZE_DIVISOR: u64 = 8;

/// Longest wait of a request for bytes.
const MAX_WAIT: Duration = Duration::from_secs(5);

/// Bytes of one semaphore permit.
const UNIT_BYTES: u64 = 1 << 10;

/// The bytes that all large answers share. Clones share one budget.
#[derive(Debug, Clone)]
pub struct Budget {
    free: Arc<Semaphore>,
    max_bytes: u64,
}

/// A part of the budget. Dropping it returns the bytes.
#[derive(Debug)]
pub struct Reservation {
    permit: OwnedSemaphorePermit,
    bytes: u64,
}

/// The bytes of an answer, together with their reservation.
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
    /// Makes a budget of this many bytes.
    pub fn new(max_bytes: u64) -> Self {
        let permits = usize::try_from(max_bytes / UNIT_BYTES).unwrap_or(usize::MAX).min(Semaphore::MAX_PERMITS);
        Self { free: Arc::new(Semaphore::new(permits)), max_bytes }
    }

    /// Upper bound of the bytes of an answer while it is computed and written.
    pub fn bound(&self, max_bytes: Option<u64>) -> u64 {
        max_bytes.unwrap_or(self.max_bytes / UNKNOWN_SIZE_DIVISOR)
    }

    /// Bytes that are reserved now.
    pub fn reserved_bytes(&self) -> u64 {
        self.max_bytes.saturating_sub(self.free.available_permits() as u64 * UNIT_BYTES)
    }

    /// Reserves bytes for an answer of at most this size. An answer of at most 256 KiB reserves nothing.
    pub async fn reserve(&self, bytes: u64) -> Result<Option<Reservation>, Problem> {
        if bytes <= FREE_BYTES {
            return Ok(None);
        }
        let units = u32::try_from(bytes.div_ceil(UNIT_BYTES)).ok().filter(|_| bytes <= self.max_bytes);
        let Some(units) = units else {
            let detail = format!(
                "the answer needs up to {bytes} bytes, but `max_unread_bytes` allows at most {}. Request fewer states or points",
                self.max_bytes
            );
            return Err(Problem::new(ProblemCode::TooManyStates, detail));
        };
        match timeout(MAX_WAIT, Arc::clone(&self.free).acquire_many_owned(units)).await {
            Ok(permit) => {
                let permit = permit.map_err(|error| Problem::internal(&error))?;
                Ok(Some(Reservation { permit, bytes }))
            }
            Err(_) => {
                let detail = format!(
                    "the answer needs up to {bytes} bytes, but other large answers hold most of `max_unread_bytes` ({} bytes). Retry after 1 s",
                    self.max_bytes
                );
                Err(Problem::new(ProblemCode::TooManyUnreadBytes, detail))
            }
        }
    }
}

impl Reservation {
    /// The reserved bytes.
    pub const fn bytes(&self) -> u64 {
        self.bytes
    }

    /// Returns all bytes above this size to the budget.
    pub fn shrink_to(&mut self, bytes: u64) {
        let units = usize::try_from(bytes.div_ceil(UNIT_BYTES)).unwrap_or(usize::MAX);
        // Dropping the split permits returns them.
        drop(self.permit.split(self.permit.num_permits().saturating_sub(units)));
        self.bytes = self.bytes.min(bytes);
    }

    /// Returns the same body. It holds its reservation, if there is one, until its last slice is dropped.
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
        let first = budget.reserve(6 * MIB).await.expect("free bytes").expect("a reservation");
        let mut second = Box::pin(budget.reserve(6 * MIB));
        assert!(poll!(&mut second).is_pending());
        // The queue is first in, first out: a small request waits behind a large one.
        let mut third = Box::pin(budget.reserve(MIB));
        assert!(poll!(&mut third).is_pending());
        assert!(budget.reserve(1000).await.expect("free").is_none());
        drop(first);
        let second = second.await.expect("free bytes");
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
        let mut reservation = budget.reserve(8 * MIB).await.expect("free bytes").expect("a reservation");
        reservation.shrink_to(2 * MIB);
        let body = Reservation::hold(Some(Arc::new(reservation)), Bytes::from(vec![0; 1000]));
        let part = body.slice(10..20);
        drop(body);
        assert_eq!(budget.reserved_bytes(), 2 * MIB);
        drop(part);
        assert_eq!(budget.reserved_bytes(), 0);
    }
}
