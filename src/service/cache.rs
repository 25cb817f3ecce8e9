//! Final bytes by the parameters that made them: key, single flight, weight.

use std::future::Future;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use axum::http::HeaderValue;
use bytes::Bytes;
use serde::Serialize;
use tracing::Instrument;

use crate::negotiation::Representation;
use crate::problem::Problem;

/// A hash of everything that an answer's bytes depend on.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Key([u8; 32]);

impl Key {
    /// The key of an endpoint's answer to `parameters`, which are normalised, in one representation.
    ///
    /// # Errors
    /// An internal problem if the parameters do not serialise.
    pub fn new(endpoint: &str, parameters: &impl Serialize, representation: Representation) -> Result<Self, Problem> {
        let parts = (toothwave_solver::VERSION, endpoint, parameters, representation);
        let bytes = postcard::to_stdvec(&parts).map_err(|error| Problem::internal(&error))?;
        Ok(Self(blake3::hash(&bytes).into()))
    }

    /// The strong entity tag of the representation: the answer's bytes follow from the key alone.
    pub fn etag(&self) -> String {
        format!("\"{self}\"")
    }
}

impl std::fmt::Display for Key {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        // Half of the hash is enough to tell every design ever asked for apart.
        let mut half = [0; 16];
        half.copy_from_slice(&self.0[..16]);
        write!(f, "{:032x}", u128::from_be_bytes(half))
    }
}

/// A finished answer.
#[derive(Debug, Clone)]
pub struct Stored {
    /// The body, encoded as its representation says.
    pub body: Bytes,
    /// How long the solve took, as the header says it.
    pub server_timing: HeaderValue,
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

/// Answers by key, bounded by their bytes; and the keys of requests that were read before, so that the same bytes are not read again.
#[derive(Debug, Clone)]
pub struct Cache {
    answers: moka::future::Cache<Key, Stored>,
    keys: moka::sync::Cache<Spelling, Key>,
}

/// Spellings that are remembered: some ten megabytes.
const MOST_SPELLINGS: u64 = 65_536;

/// What an entry costs beside its body.
const ENTRY_OVERHEAD_BYTES: usize = 256;

impl Cache {
    /// A cache of at most `max_bytes`.
    pub fn new(max_bytes: u64) -> Self {
        let answers = moka::future::Cache::builder()
            .max_capacity(max_bytes)
            // A body beyond 4 GiB weighs as much as can be said, and is not kept.
            .weigher(|_, stored: &Stored| u32::try_from(stored.body.len() + ENTRY_OVERHEAD_BYTES).unwrap_or(u32::MAX))
            .build();
        Self { answers, keys: moka::sync::Cache::new(MOST_SPELLINGS) }
    }

    /// Bytes and entries kept now.
    pub async fn size(&self) -> CacheSize {
        // The cache counts lazily.
        self.answers.run_pending_tasks().await;
        CacheSize { bytes: self.answers.weighted_size(), entries: self.answers.entry_count() }
    }

    /// The answer under `key`, if it is kept.
    pub async fn get(&self, key: Key) -> Option<Stored> {
        self.answers.get(&key).await
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
    /// The flight runs in a task of its own: when the client that started it leaves, those who joined do not start over, and
    /// the deadline bounds what is computed for nobody.
    ///
    /// # Errors
    /// What `solve` returns; failures are not kept.
    pub async fn solve_once(
        &self,
        key: Key,
        solve: impl Future<Output = Result<Stored, Problem>> + Send + 'static,
    ) -> Result<(Stored, Served), Problem> {
        let is_own = Arc::new(AtomicBool::new(false));
        let started = Arc::clone(&is_own);
        let cache = self.answers.clone();
        let flight = async move {
            let solve = async {
                started.store(true, Ordering::Relaxed);
                solve.await
            };
            cache.try_get_with(key, solve).await
        };
        let joined = tokio::spawn(flight.in_current_span()).await;
        let stored = joined.map_err(|panic| Problem::internal(&panic))?.map_err(Arc::unwrap_or_clone)?;
        let served = if is_own.load(Ordering::Relaxed) { Served::Miss } else { Served::Collapsed };
        Ok((stored, served))
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
