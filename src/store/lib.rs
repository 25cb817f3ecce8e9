//! Where studies are kept: an SQLite file of one process, or a PostgreSQL server that many processes share.
//!
//! A study is chunks, and what they come to is the truth: unique by study and chunk, written once, never changed. There is no queue beside it.
//! On PostgreSQL **the open transaction is the lease** of a chunk (`FOR UPDATE SKIP LOCKED`): a worker that dies, or falls silent for longer than
//! its session may, has its transaction ended by the server, and the chunk is free again. Nobody sends heartbeats, nobody looks for the dead.
//! Before a chunk is computed its attempt is committed apart from the lease; a chunk whose attempts all ended without a result becomes a gap.
//!
//! This crate knows neither what a study asks nor what a part holds: both are bytes.

mod address;
mod connection;
mod lease;
mod schema;
mod studies;

use std::time::Duration;

pub use address::{Address, AddressError};
pub use connection::{Store, StoreError};
pub use lease::{Claim, Lease};
pub use schema::SCHEMA_VERSION;
pub use studies::{Cut, Figures, Gap, Kept, NewStudy, Standing, Waiting};

/// Attempts without a result that make a chunk a gap.
pub const MOST_ATTEMPTS: u64 = 3;

/// Chunks of a study that are opened at once: more than are claimed in the time that it takes, and written in some milliseconds.
const BATCH_CHUNKS: u64 = 256;

/// What a single operation may take: a server that cannot be reached says nothing. Shorter than a proxy waits for an answer.
pub const PATIENCE: Duration = Duration::from_secs(10);

/// For what touches every chunk of a study, of which there may be very many.
pub(crate) const LONG_PATIENCE: Duration = Duration::from_secs(120);

/// For what lets a study run: a server that takes it and does not come to its end, since its disk or its standby stands still, comes to it later, and who gives
/// up sooner tries sooner again.
pub(crate) const BEGIN_PATIENCE: Duration = Duration::from_secs(30);

/// So long does the server let a statement wait for a lock. For a row it may do so twice, first for whoever waits for it already, and the answer
/// should come within [`PATIENCE`].
pub(crate) const LOCK_PATIENCE: Duration = Duration::from_millis(4500);

/// The same for who migrates, within [`LONG_PATIENCE`].
pub(crate) const LONG_LOCK_PATIENCE: Duration = Duration::from_secs(100);

/// So long may a session be silent in the middle of a transaction; a lease says for itself how long. Whoever lives goes on within milliseconds, or
/// gives up after [`PATIENCE`].
pub(crate) const SILENCE: Duration = Duration::from_secs(3 * PATIENCE.as_secs());

/// How long a study that is to be forgotten waits for those who compute it to let go. Who sees that it was cancelled does within a second or so.
const LETTING_GO: Duration = Duration::from_secs(5);

/// Between two tries of it.
const LOOK_AGAIN: Duration = Duration::from_millis(250);

/// A number as both databases keep it.
pub(crate) fn stored(number: u64) -> i64 {
    i64::try_from(number).unwrap_or(i64::MAX)
}

/// A number as it was kept.
pub(crate) fn read(number: i64) -> u64 {
    u64::try_from(number).unwrap_or(0)
}
