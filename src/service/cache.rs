//! Final bytes by the parameters that made them: single flight, weight.

use std::collections::HashMap;
use std::future::Future;
use std::sync::{Arc, Weak};
use std::time::Duration;

use axum::http::HeaderValue;
use bytes::Bytes;
use memmap2::MmapOptions;
use parking_lot::Mutex;
use tokio::sync::watch;
use tokio_util::sync::{CancellationToken, DropGuard};
use toothwave_calculation::key::Key;
use tracing::Instrument;

use crate::negotiation::Representation;
use crate::problem::Problem;
use crate::room::Sent;

/// The strong entity tag of a representation: its bytes follow from the key alone.
pub fn etag(key: Key) -> String {
    format!("\"{key}\"")
}

/// A finished answer.
#[derive(Debug, Clone)]
pub struct Stored {
    /// The body, encoded as its representation says.
    pub body: Bytes,
    /// Whether it is on its way to clients.
    pub sent: Sent,
    /// Of an answer that was just made: its room, until all who asked have taken it.
    pub held: Option<Bytes>,
    /// How long the solve took.
    pub solve: Duration,
    /// The same as the header says it, made once for all who get the answer.
    pub server_timing: HeaderValue,
}

/// Where an answer came from and what it had cost: an extension of the response, for log and metrics.
#[derive(Debug, Clone, Copy)]
pub struct Provenance {
    /// How it came about.
    pub served: Served,
    /// How long its solve took, for whomever.
    pub solve: Duration,
}

/// How an answer came about.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Served {
    /// From the cache.
    Hit,
    /// Solved for this request.
    Miss,
    /// Solved for another request that came first and asked the same.
    Collapsed,
}

impl Served {
    /// As `Cache-Status` has it (RFC 9211).
    pub const fn cache_status(self) -> &'static str {
        match self {
            Self::Hit => "toothwave; hit",
            Self::Miss => "toothwave; fwd=miss",
            Self::Collapsed => "toothwave; fwd=miss; collapsed",
        }
    }

    /// As metrics have it.
    pub const fn label(self) -> &'static str {
        match self {
            Self::Hit => "hit",
            Self::Miss => "miss",
            Self::Collapsed => "collapsed",
        }
    }
}

/// A hash of a request as it was written: the same bytes ask the same.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Spelling([u8; 32]);

impl Spelling {
    /// Of a body sent to an endpoint for one representation.
    pub fn new(endpoint: &str, representation: Representation, body: &[u8]) -> Self {
        let mut hasher = blake3::Hasher::new();
        hasher.update(&[representation.format as u8, u8::from(representation.gzip)]);
        hasher.update(endpoint.as_bytes()).update(b"\0").update(body);
        Self(hasher.finalize().into())
    }
}

/// Answers by key, bounded by their bytes; the solves under way; and the keys of requests that were read before, so that the same bytes
/// are not read again.
#[derive(Debug, Clone)]
pub struct Cache {
    answers: moka::sync::Cache<Key, Stored>,
    keys: moka::sync::Cache<Spelling, Key>,
    flights: Flights,
    max_bytes: u64,
}

/// Solves under way, by the key of their answer. What drops a [`Landing`] must not hold the lock, which that takes.
type Flights = Arc<Mutex<HashMap<Key, Weak<Flight>>>>;

/// A solve for all who want its answer. It is theirs: with the last of them it ends.
#[derive(Debug)]
struct Flight {
    outcome: watch::Receiver<Option<Result<Stored, Problem>>>,
    _wanted: DropGuard,
}

/// Takes a solve off the list when it is over, however it ended.
struct Landing {
    flights: Flights,
    key: Key,
    flight: Weak<Flight>,
}

impl Drop for Landing {
    fn drop(&mut self) {
        let mut flights = self.flights.lock();
        // After one that nobody wanted any more another may have begun.
        if flights.get(&self.key).is_some_and(|flight| flight.ptr_eq(&self.flight)) {
            flights.remove(&self.key);
        }
    }
}

/// Spellings that are remembered, at most, and bytes of answers for each: one takes some 360 bytes, so that all take a tenth of what answers may.
const MOST_SPELLINGS: u64 = 65_536;
const BYTES_A_SPELLING: u64 = 4096;

/// An answer up to here is short: some tens of them come to little, and the allocator's pages for such are small.
const SHORT_BYTES: usize = 1 << 13;

/// Bodies that are kept in pages of their own, at most: the kernel lets a process have some 65 000 mappings.
const MOST_COPIES: u64 = 32_768;

/// The allocator gives a body beyond this pages that it shares with none.
const LONG_BYTES: usize = 1 << 19;

/// What an entry costs beside its body: of 60 000 short answers each took some 1060 bytes more, its spelling among them.
const ENTRY_OVERHEAD_BYTES: usize = 640;

impl Cache {
    /// A cache of at most `max_bytes`.
    pub fn new(max_bytes: u64) -> Self {
        let answers = moka::sync::Cache::builder()
            .max_capacity(max_bytes)
            // A body beyond 4 GiB weighs as much as can be said, and is not kept.
            .weigher(|_, stored: &Stored| u32::try_from(held_bytes(&stored.body)).unwrap_or(u32::MAX))
            .build();
        let spellings = MOST_SPELLINGS.min(max_bytes / BYTES_A_SPELLING);
        Self { answers, keys: moka::sync::Cache::new(spellings), flights: Flights::default(), max_bytes }
    }

    /// Whether a body that may be kept is to be copied into pages of its own. The allocator has pages of up to 4 MiB for bodies of about one length, and as long as
    /// one of these is kept it holds the whole page: 8 MiB of bodies held 58. A longer body has its own, but as many as its writer had.
    pub fn wants_copy(&self, body: &Vec<u8>) -> bool {
        let may_be_kept = self.max_bytes / MOST_COPIES < body.len() as u64 && body.len() as u64 <= self.max_bytes;
        let has_its_own = body.len() > LONG_BYTES && body.capacity() - body.len() <= body.len() / 4;
        may_be_kept && body.len() > SHORT_BYTES && !has_its_own
    }

    /// Bytes and entries kept now.
    pub fn size(&self) -> CacheSize {
        // The cache counts lazily.
        self.answers.run_pending_tasks();
        CacheSize { bytes: self.answers.weighted_size(), entries: self.answers.entry_count() }
    }

    /// Lets go of all answers: each can be computed again.
    pub fn let_go(&self) {
        self.answers.invalidate_all();
        self.answers.run_pending_tasks();
    }

    /// The answer under `key`, if it is kept.
    pub fn get(&self, key: Key) -> Option<Stored> {
        self.answers.get(&key)
    }

    /// The key of a request that was read and found possible before.
    pub fn key(&self, spelling: Spelling) -> Option<Key> {
        self.keys.get(&spelling)
    }

    /// Remembers the key of a request that was read and found possible.
    pub fn remember(&self, spelling: Spelling, key: Key) {
        self.keys.insert(spelling, key);
    }

    /// The answer under `key`, which `solve` makes once for all who ask meanwhile.
    ///
    /// The solve runs in a task of its own: when the client that started it leaves, or its time is over, those who joined do not start
    /// over; when all have left, it is dropped.
    ///
    /// Nothing where there is none until the time of this one who asks is over; each has its own.
    ///
    /// # Errors
    /// What `solve` returns; failures are not kept.
    pub async fn solve_once(
        &self,
        key: Key,
        time_is_over: impl Future<Output = ()>,
        solve: impl Future<Output = Result<Stored, Problem>> + Send + 'static,
    ) -> Result<Option<(Stored, Served)>, Problem> {
        let (flight, served) = {
            let mut flights = self.flights.lock();
            if let Some(stored) = self.answers.get(&key) {
                return Ok(Some((stored, Served::Hit)));
            }
            match flights.get(&key).and_then(Weak::upgrade) {
                Some(flight) => (flight, Served::Collapsed),
                None => {
                    let (flight, task) = self.flight(key, solve);
                    flights.insert(key, Arc::downgrade(&flight));
                    drop(flights);
                    // A runtime that is shut down drops it at once, and with it its landing, which locks.
                    tokio::spawn(task.in_current_span());
                    (flight, Served::Miss)
                }
            }
        };
        let mut outcome = flight.outcome.clone();
        let is_told = tokio::select! {
            biased;
            _ = outcome.wait_for(Option::is_some) => true,
            () = time_is_over => false,
        };
        if !is_told {
            if Arc::into_inner(flight).is_some() {
                // It was the last one, so the solve ends: whoever is told so finds its place free.
                let _ = outcome.wait_for(Option::is_some).await;
            }
            return Ok(None);
        }
        // Without an outcome the task has panicked, and has said so in the log.
        let outcome = outcome.borrow().clone();
        let stored = outcome.unwrap_or_else(|| Err(Problem::internal(&"a solve had no outcome")))?;
        Ok(Some((stored, served)))
    }

    /// A solve for whoever wants it, and the task that it runs in.
    fn flight(
        &self,
        key: Key,
        solve: impl Future<Output = Result<Stored, Problem>> + Send + 'static,
    ) -> (Arc<Flight>, impl Future<Output = ()> + Send + 'static) {
        let wanted = CancellationToken::new();
        let (teller, outcome) = watch::channel(None);
        let flight = Arc::new(Flight { outcome, _wanted: wanted.clone().drop_guard() });
        let landing = Landing { flights: Arc::clone(&self.flights), key, flight: Arc::downgrade(&flight) };
        let answers = self.answers.clone();
        let task = async move {
            let outcome = wanted.run_until_cancelled(solve).await;
            if let Some(Ok(stored)) = &outcome {
                keep(&answers, key, stored);
            }
            // Whoever finds no solve under way from here on finds the answer.
            drop(landing);
            teller.send_replace(outcome);
        };
        (flight, task)
    }
}

/// What an answer with this body takes where it is kept.
fn held_bytes(body: &Bytes) -> usize {
    const PAGE_BYTES: usize = 4096;
    ENTRY_OVERHEAD_BYTES + if body.len() > SHORT_BYTES { body.len().next_multiple_of(PAGE_BYTES) } else { body.len() }
}

/// A copy of an answer's bytes in pages of its own, which are the system's again with the last who has them; none where it gives none.
pub fn in_own_pages(bytes: &[u8]) -> Option<Bytes> {
    let mut pages = MmapOptions::new().len(bytes.len()).populate().map_anon().ok()?;
    pages.copy_from_slice(bytes);
    Some(Bytes::from_owner(pages))
}

/// Keeps an answer. The cache forgets what goes beyond its bound when it comes to that, which is after tens of insertions: of all but short ones at once, or
/// it would hold some beyond it, which take no room any more.
fn keep(answers: &moka::sync::Cache<Key, Stored>, key: Key, stored: &Stored) {
    // What is more than all of it would only be there for as long as it takes to let it go.
    if answers.policy().max_capacity().is_some_and(|most| held_bytes(&stored.body) as u64 > most) {
        return;
    }
    answers.insert(key, Stored { held: None, ..stored.clone() });
    if stored.body.len() > SHORT_BYTES {
        answers.run_pending_tasks();
    }
}

/// How full the cache is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct CacheSize {
    /// Bytes.
    pub bytes: u64,
    /// Entries.
    pub entries: u64,
}

#[cfg(test)]
mod tests {
    use std::future;
    use std::sync::Arc;
    use std::time::Duration;

    use axum::http::HeaderValue;
    use bytes::Bytes;
    use toothwave_calculation::key::Key;

    use super::{Cache, Served, Spelling, Stored, in_own_pages, keep};
    use crate::negotiation::Representation;
    use crate::problem::{Problem, ProblemCode};
    use crate::room::Sent;

    fn key(number: f64) -> Key {
        Key::new("sweep", &number, &Representation::JSON)
    }

    fn stored() -> Stored {
        Stored {
            body: Bytes::from_static(b"{}"),
            sent: Sent::default(),
            held: Some(Bytes::from_static(b"{}")),
            solve: Duration::ZERO,
            server_timing: HeaderValue::from_static("solve;dur=0"),
        }
    }

    #[tokio::test]
    async fn a_solve_that_is_over_is_not_remembered_however_it_ended() {
        let cache = Cache::new(1 << 20);
        let solved = cache.solve_once(key(1.0), future::pending(), async { Ok(stored()) }).await;
        assert!(solved.is_ok_and(|answer| answer.is_some_and(|(_, served)| served == Served::Miss)));
        assert!(cache.flights.lock().is_empty());
        let failed = cache.solve_once(key(2.0), future::pending(), async { Err(Problem::internal(&"a fault")) }).await;
        assert_eq!(failed.err().map(|problem| problem.code), Some(ProblemCode::InternalError));
        assert!(cache.flights.lock().is_empty());
        let given_up = cache.solve_once(key(3.0), future::ready(()), future::pending()).await;
        assert!(given_up.is_ok_and(|answer| answer.is_none()));
        assert!(cache.flights.lock().is_empty());
    }

    /// So that it is not read again.
    #[test]
    fn a_request_that_was_read_is_known_by_its_bytes() {
        let cache = Cache::new(1 << 20);
        let spelling = |body: &[u8]| Spelling::new("sweep", Representation::JSON, body);
        assert!(cache.key(spelling(b"{}")).is_none());
        cache.remember(spelling(b"{}"), key(1.0));
        assert!(cache.key(spelling(b"{}")) == Some(key(1.0)) && cache.key(spelling(b"{ }")).is_none());
    }

    #[test]
    fn a_body_that_is_kept_is_copied_unless_it_is_short_or_has_pages_of_its_own() {
        const MIB: usize = 1 << 20;
        let body = |length, capacity| {
            let mut body = Vec::with_capacity(capacity);
            body.resize(length, 0);
            body
        };
        let wants_copy = |cache_mib: u64, body| Cache::new(cache_mib << 20).wants_copy(&body);
        assert!(
            wants_copy(8, body(20_000, 20_000))
                && wants_copy(8, body(MIB / 2, MIB / 2))
                && wants_copy(8, body(MIB, 2 * MIB))
        );
        assert!(!wants_copy(8, body(8000, 16_000)), "it is short");
        assert!(!wants_copy(8, body(MIB, MIB + MIB / 8)), "it has pages of its own");
        assert!(!wants_copy(8, body(9 * MIB, 18 * MIB)), "the cache does not keep it");
        assert!(!wants_copy(1024, body(20_000, 20_000)), "there might be fifty thousand");
        let copy = in_own_pages(&[7; 20_000]).expect("some memory");
        assert_eq!(copy, vec![7; 20_000]);
    }

    #[test]
    fn where_few_answers_are_kept_few_spellings_are_remembered() {
        let most = |bytes| Cache::new(bytes).keys.policy().max_capacity();
        assert_eq!((most(1 << 20), most(8 << 20), most(1 << 40)), (Some(256), Some(2048), Some(65_536)));
    }

    /// Its room is of those who asked.
    #[tokio::test]
    async fn an_answer_that_is_kept_holds_no_room() {
        let cache = Cache::new(1 << 20);
        let solved = cache.solve_once(key(1.0), future::pending(), async { Ok(stored()) }).await;
        assert!(solved.is_ok_and(|answer| answer.is_some_and(|(stored, _)| stored.held.is_some())));
        assert!(cache.get(key(1.0)).is_some_and(|kept| kept.held.is_none()));
    }

    /// Bytes that are told when they are let go.
    struct Counted(Vec<u8>, #[expect(dead_code, reason = "it is counted")] Arc<()>);

    impl AsRef<[u8]> for Counted {
        fn as_ref(&self) -> &[u8] {
            &self.0
        }
    }

    #[test]
    fn large_answers_beyond_the_bound_are_let_go_at_once() {
        const BODY_BYTES: usize = 1 << 20;
        let (cache, another) = (Cache::new(3 * BODY_BYTES as u64), Cache::new(BODY_BYTES as u64));
        let kept = Arc::new(());
        let bodies = || Arc::strong_count(&kept) - 1;
        // What another test's thread may look at yet goes when that has moved on, and who looks into any cache helps with it.
        let are_let_go = |_| {
            another.get(key(-1.0));
            bodies() * BODY_BYTES <= 3 * BODY_BYTES
        };
        for number in 0..20 {
            let body = Bytes::from_owner(Counted(vec![0; BODY_BYTES], Arc::clone(&kept)));
            let server_timing = HeaderValue::from_static("");
            let stored = Stored { body, sent: Sent::default(), held: None, solve: Duration::ZERO, server_timing };
            keep(&cache.answers, key(f64::from(number)), &stored);
            drop(stored);
            assert!((0..100_000).any(are_let_go), "{} bodies after {number}", bodies());
        }
    }
}
