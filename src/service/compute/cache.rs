//! The cache of finished answers. The key is a hash of the parameters of the answer.
//!
//! **Cache.** Entries are weighed in bytes; bodies up to 1 MiB are cached. Simultaneous requests with the same key
//! share one computation (single flight). It runs until the last of them has left.

use std::collections::HashMap;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

use axum::http::HeaderValue;
use bytes::Bytes;
use futures_util::FutureExt as _;
use futures_util::future::{BoxFuture, Shared, WeakShared};
use parking_lot::Mutex;
use toothwave_calculation::key::Key;

use crate::compute::budget::Reservation;
use crate::http::negotiation::Representation;
use crate::http::problem::Problem;

/// Largest body that is cached.
pub const MAX_BODY_BYTES: usize = 1 << 20;

/// Bytes of an entry in addition to its body.
const ENTRY_OVERHEAD_BYTES: usize = 640;

/// Request texts whose key is remembered. One takes about 360 bytes.
const MAX_REMEMBERED_REQUESTS: u64 = 65_536;

/// A finished answer.
#[derive(Debug, Clone)]
pub struct Answer {
    /// The body, encoded in its representation.
    pub body: Bytes,
    /// The reservation of the body. A small body and a body from the cache have none.
    pub reservation: Option<Arc<Reservation>>,
    /// Time of the computation.
    pub solve: Duration,
    /// The header `Server-Timing` with that time, made once for all requests.
    pub server_timing: HeaderValue,
}

/// Source of the answer to a request.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum CacheStatus {
    /// From the cache.
    Hit,
    /// Computed for this request.
    Miss,
    /// Computed for another request that came first.
    Collapsed,
}

impl CacheStatus {
    /// Returns the value of the header `Cache-Status` (RFC 9211).
    pub const fn header(self) -> &'static str {
        match self {
            Self::Hit => "toothwave; hit",
            Self::Miss => "toothwave; fwd=miss",
            Self::Collapsed => "toothwave; fwd=miss; collapsed",
        }
    }

    /// Returns the label for metrics.
    pub const fn label(self) -> &'static str {
        match self {
            Self::Hit => "hit",
            Self::Miss => "miss",
            Self::Collapsed => "collapsed",
        }
    }
}

/// The hash of a request body. An equal body is not parsed again.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct RequestHash([u8; 32]);

impl RequestHash {
    /// Hashes a body with its endpoint and representation.
    pub fn new(endpoint: &str, representation: Representation, body: &[u8]) -> Self {
        let mut hasher = blake3::Hasher::new();
        hasher.update(&[representation.format as u8, u8::from(representation.gzip)]);
        hasher.update(endpoint.as_bytes()).update(b"\0").update(body);
        Self(hasher.finalize().into())
    }
}

type Outcome = Result<Answer, Problem>;

/// Running computations by key, owned by the requests that wait for them. The number tells a computation from a later
/// one of the same key, so that the end of the first does not remove the second.
type Flights = Arc<Mutex<HashMap<Key, (u64, WeakShared<BoxFuture<'static, Outcome>>)>>>;

/// Finished answers and running computations. Clones share them.
#[derive(Debug, Clone)]
pub struct Cache {
    answers: moka::sync::Cache<Key, Answer>,
    keys: moka::sync::Cache<RequestHash, Key>,
    flights: Flights,
}

/// Removes a running computation from the map when it ends or is dropped.
struct RemoveOnDrop {
    flights: Flights,
    key: Key,
    number: u64,
}

impl Drop for RemoveOnDrop {
    fn drop(&mut self) {
        let mut flights = self.flights.lock();
        if flights.get(&self.key).is_some_and(|(number, _)| *number == self.number) {
            flights.remove(&self.key);
        }
    }
}

impl Cache {
    /// Makes a cache of at most this many bytes.
    pub fn new(max_bytes: u64) -> Self {
        let weight = |answer: &Answer| u32::try_from(answer.body.len() + ENTRY_OVERHEAD_BYTES).unwrap_or(u32::MAX);
        let answers = moka::sync::Cache::builder().max_capacity(max_bytes).weigher(move |_, answer| weight(answer));
        let keys = moka::sync::Cache::new(MAX_REMEMBERED_REQUESTS.min(max_bytes / 4096));
        Self { answers: answers.build(), keys, flights: Flights::default() }
    }

    /// Returns the bytes and the number of cached answers.
    pub fn size(&self) -> (u64, u64) {
        self.answers.run_pending_tasks();
        (self.answers.weighted_size(), self.answers.entry_count())
    }

    /// Returns the cached answer of a key.
    pub fn get(&self, key: Key) -> Option<Answer> {
        self.answers.get(&key)
    }

    /// Returns the key of a request body that was answered before.
    pub fn key(&self, request: RequestHash) -> Option<Key> {
        self.keys.get(&request)
    }

    /// Stores the key of a request body.
    pub fn remember(&self, request: RequestHash, key: Key) {
        self.keys.insert(request, key);
    }

    /// Returns the cached answer of a key, or computes it once for all requests that wait for it.
    pub async fn get_or_compute(
        &self,
        key: Key,
        compute: impl Future<Output = Outcome> + Send + 'static,
    ) -> Result<(Answer, CacheStatus), Problem> {
        let (flight, status) = {
            let mut flights = self.flights.lock();
            if let Some(answer) = self.answers.get(&key) {
                return Ok((answer, CacheStatus::Hit));
            }
            match flights.get(&key).and_then(|(_, flight)| flight.upgrade()) {
                Some(flight) => (flight, CacheStatus::Collapsed),
                None => {
                    let (number, flight) = self.flight(key, compute);
                    if let Some(flight) = flight.downgrade() {
                        flights.insert(key, (number, flight));
                    }
                    (flight, CacheStatus::Miss)
                }
            }
        };
        flight.await.map(|answer| (answer, status))
    }

    fn flight(
        &self,
        key: Key,
        compute: impl Future<Output = Outcome> + Send + 'static,
    ) -> (u64, Shared<BoxFuture<'static, Outcome>>) {
        static NUMBERS: AtomicU64 = AtomicU64::new(0);
        let number = NUMBERS.fetch_add(1, Ordering::Relaxed);
        let remove = RemoveOnDrop { flights: Arc::clone(&self.flights), key, number };
        let answers = self.answers.clone();
        let flight = async move {
            let outcome = compute.await;
            if let Ok(answer) = &outcome
                && answer.body.len() <= MAX_BODY_BYTES
            {
                answers.insert(key, Answer { reservation: None, ..answer.clone() });
            }
            // The answer is now in the cache.
            drop(remove);
            outcome
        };
        (number, flight.boxed().shared())
    }
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use axum::http::HeaderValue;
    use bytes::Bytes;
    use futures_util::poll;
    use tokio::sync::oneshot;
    use toothwave_calculation::key::Key;

    use super::{Answer, Cache};
    use crate::http::negotiation::Representation;
    use crate::http::problem::Problem;

    fn key(number: f64) -> Key {
        Key::new("test", &number, &Representation::JSON)
    }

    fn answer(bytes: usize) -> Answer {
        let server_timing = HeaderValue::from_static("");
        Answer { body: Bytes::from(vec![0; bytes]), reservation: None, solve: Duration::ZERO, server_timing }
    }

    #[tokio::test]
    async fn abandoned_computation_is_dropped() {
        let cache = Cache::new(1 << 20);
        let (sender, receiver) = oneshot::channel::<()>();
        let mut only = Box::pin(cache.get_or_compute(key(1.0), async {
            receiver.await.map_err(|error| Problem::internal(&error))?;
            Ok(answer(1))
        }));
        assert!(poll!(&mut only).is_pending());
        drop(only);
        assert!(sender.is_closed() && cache.flights.lock().is_empty());
    }
}
