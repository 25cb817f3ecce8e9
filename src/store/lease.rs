//! A chunk in somebody's hands.

use std::convert::Infallible;
use std::time::Duration;

use sqlx::pool::PoolConnection;
use sqlx::postgres::Postgres;
use tokio::time::Instant;

use crate::connection::{Connection, Database, Store, StoreError, milliseconds, on, within};
use crate::studies::{Cut, begin, commit, say};
use crate::{MOST_ATTEMPTS, PATIENCE, stored};

/// What comes of asking for a chunk.
#[derive(Debug)]
pub enum Claim {
    /// It is to be computed.
    Chunk(Lease),
    /// It was tried as often as chunks are: it is a gap from now on.
    Gap(u64),
    /// Nobody waits: all are done or in work.
    None,
}

/// A chunk that nobody else computes meanwhile. One that is dropped is free again; where it was begun, that stays noted.
#[derive(Debug)]
pub struct Lease {
    store: Store,
    cut: Cut,
    chunk: u64,
    /// What its attempt is called.
    attempt: String,
    /// So long may its holder be silent.
    silence: Duration,
    held: Held,
    /// Whether its attempt counts as one that came to no result, should it come to none.
    is_noted: bool,
    /// When it was found to be lost.
    lost: Option<Instant>,
}

#[derive(Debug)]
enum Held {
    /// Among this process's own.
    Here,
    /// An open transaction.
    There(Box<PoolConnection<Postgres>>),
    /// Not any more: the server ended it.
    Lost,
}

/// A holder says so often at least that it is alive, though it may be silent for longer: it learns soon that its lease is lost.
const SAY: Duration = Duration::from_secs(3);

/// Before what a store did not do is tried again.
const PAUSE: Duration = Duration::from_secs(1);

/// So often is a chunk given back to a store that is cut off.
const GIVEN_BACK: usize = 4;

/// Waits, on a server, for whoever notes an attempt at the chunk or takes one back, and has others wait until the transaction is over: what a commit does not
/// come to its end with is seen by nobody, and holds its locks.
macro_rules! of_attempts {
    () => {
        "pg_advisory_xact_lock(hashtextextended($1, $2))"
    };
}

/// Chunks of a study that nobody holds.
macro_rules! free_chunks {
    ($which:literal) => {
        concat!(
            "SELECT chunk FROM chunks WHERE study = $1 AND EXISTS (SELECT 1 FROM studies WHERE id = $1 AND chunk_variants = $2)",
            $which,
            " ORDER BY chunk LIMIT 1 FOR UPDATE OF chunks SKIP LOCKED"
        )
    };
}

const FIRST_FREE: &str = free_chunks!("");

const THIS_IF_FREE: &str = free_chunks!(" AND chunk = $3");

macro_rules! unless_begun_as_often {
    () => {
        " WHERE (SELECT COUNT(*) FROM attempts WHERE study = $1 AND chunk = $2) < $4"
    };
}

impl Store {
    /// A chunk of a study that is nobody's, and is begun: [`Self::hold`] and [`Lease::begin`] in one.
    ///
    /// # Errors
    /// As these.
    pub async fn claim(&self, cut: &Cut, lease: Duration) -> Result<Claim, StoreError> {
        match self.hold(cut, lease).await? {
            Some(lease) => lease.begin().await,
            None => Ok(Claim::None),
        }
    }

    /// A chunk of a study that is nobody's, held until it is kept, for so long at most on a server.
    ///
    /// # Errors
    /// Where the store does not answer.
    pub async fn hold(&self, cut: &Cut, lease: Duration) -> Result<Option<Lease>, StoreError> {
        let mut are_all_open = false;
        let (chunk, held) = loop {
            match self.claim_open(cut, lease).await? {
                Some(claimed) => break claimed,
                None if are_all_open => return Ok(None),
                // Another may have opened the last ones meanwhile: they are looked for once more.
                None => are_all_open = !self.open_more(&cut.id).await?,
            }
        };
        // From here on dropping the lease sets the chunk free.
        let (store, attempt) = (self.clone(), self.attempt_name());
        Ok(Some(Lease { store, cut: cut.clone(), chunk, attempt, silence: lease, held, is_noted: false, lost: None }))
    }

    /// Whether a chunk of a study is nobody's.
    ///
    /// # Errors
    /// Where the store does not answer.
    pub async fn has_free_chunk(&self, cut: &Cut) -> Result<bool, StoreError> {
        if matches!(self.database, Database::File { .. }) {
            return Ok(self.hold(cut, Duration::ZERO).await?.is_some());
        }
        self.with(PATIENCE, async |connection| {
            let Connection::Server(session) = connection else { return Ok(false) };
            let text = "SELECT opened < chunks FROM studies WHERE id = $1 AND chunk_variants = $2";
            let chunk_variants = stored(cut.chunk_variants);
            let are_more = sqlx::query_scalar(text).bind(&cut.id).bind(chunk_variants);
            if are_more.fetch_optional(&mut **session).await? == Some(true) {
                return Ok(true);
            }
            let first = sqlx::query_scalar::<_, i64>(FIRST_FREE).bind(&cut.id).bind(chunk_variants);
            Ok(first.fetch_optional(&mut **session).await?.is_some())
        })
        .await
    }

    /// A chunk among those that are open.
    async fn claim_open(&self, cut: &Cut, lease: Duration) -> Result<Option<(u64, Held)>, StoreError> {
        if matches!(self.database, Database::File { .. }) {
            self.claim_here(cut).await
        } else {
            self.claim_there(cut, None, lease).await
        }
    }

    /// The same on a server, or this chunk where it is free.
    async fn claim_there(
        &self,
        cut: &Cut,
        chunk: Option<u64>,
        lease: Duration,
    ) -> Result<Option<(u64, Held)>, StoreError> {
        let Database::Server { leases, .. } = &self.database else { return Ok(None) };
        let connection = within(PATIENCE, async { Ok(leases.acquire().await?) }).await?;
        let mut begun = Begun(Some(Box::new(connection)));
        let Some(connection) = &mut begun.0 else { return Ok(None) };
        let chunk = within(PATIENCE, begin_lease(connection, cut, chunk, lease)).await?;
        let connection = begun.0.take();
        Ok(chunk.zip(connection.map(Held::There)))
    }

    async fn claim_here(&self, Cut { id, chunk_variants }: &Cut) -> Result<Option<(u64, Held)>, StoreError> {
        let Database::File { leased, .. } = &self.database else { return Ok(None) };
        self.with(PATIENCE, async |connection| {
            let limit = stored(leased.lock().map_or(0, |leased| leased.len() as u64) + 1);
            let text = "SELECT chunk FROM chunks WHERE study = $1 AND EXISTS (SELECT 1 FROM studies WHERE id = $1 AND chunk_variants = $2)
                ORDER BY chunk LIMIT $3";
            let chunk_variants = stored(*chunk_variants);
            let chunks: Vec<i64> = on!(connection, inner => {
                sqlx::query_scalar(text).bind(id).bind(chunk_variants).bind(limit).fetch_all(inner).await
            })?;
            // The connection is held: nobody else claims meanwhile.
            let Ok(mut leased) = leased.lock() else { return Ok(None) };
            let free = chunks.into_iter().map(crate::read).find(|&chunk| leased.insert((id.clone(), chunk)));
            Ok(free.map(|chunk| (chunk, Held::Here)))
        })
        .await
    }

    /// Notes that a chunk is about to be computed, unless it was begun as often as chunks are. Committed apart from the lease: it outlives
    /// the worker.
    async fn note_attempt(&self, study: &str, chunk: u64, attempt: &str) -> Result<bool, StoreError> {
        let text = match &self.database {
            Database::File { .. } => {
                concat!("INSERT INTO attempts SELECT $1, $2, $3, unixepoch()", unless_begun_as_often!())
            }
            // Until its commit is over, whoever takes it back waits for it.
            Database::Server { .. } => concat!(
                "INSERT INTO attempts SELECT $1, $2, $3, unixepoch() FROM (SELECT ",
                of_attempts!(),
                ") AS held",
                unless_begun_as_often!()
            ),
        };
        self.with(PATIENCE, async |connection| {
            let noted = on!(connection, inner => {
                sqlx::query(text)
                    .bind(study)
                    .bind(stored(chunk))
                    .bind(attempt)
                    .bind(stored(MOST_ATTEMPTS))
                    .execute(inner)
                    .await
                    .map(|done| done.rows_affected() == 1)
            })?;
            Ok(noted)
        })
        .await
    }

    /// Whether a chunk is over, or another has begun it since this attempt: of an earlier one nobody knows whether it ended its process.
    async fn is_anothers(&self, study: &str, chunk: u64, attempt: &str) -> Result<bool, StoreError> {
        let text = "SELECT NOT EXISTS (SELECT 1 FROM chunks WHERE study = $1 AND chunk = $2) OR EXISTS (SELECT 1 FROM attempts AS own, attempts AS others
            WHERE own.study = $1 AND own.chunk = $2 AND own.worker = $3 AND others.study = $1 AND others.chunk = $2 AND others.worker <> $3
                AND others.began_at_s >= own.began_at_s)";
        self.with(PATIENCE, async |connection| {
            let chunk = stored(chunk);
            Ok(on!(connection, inner => {
                sqlx::query_scalar(text).bind(study).bind(chunk).bind(attempt).fetch_one(inner).await
            })?)
        })
        .await
    }

    /// Deletes what is noted of an attempt, or is being noted.
    async fn delete_attempt(&self, study: &str, chunk: u64, attempt: &str) -> Result<(), StoreError> {
        let delete = "DELETE FROM attempts WHERE study = $1 AND chunk = $2 AND worker = $3";
        self.with(PATIENCE, async |connection| {
            begin(connection).await?;
            if let Connection::Server(session) = connection {
                // A statement of its own: the next one sees what was committed until then.
                let text = concat!("SELECT ", of_attempts!());
                sqlx::query(text).bind(study).bind(stored(chunk)).execute(&mut **session).await?;
            }
            on!(connection, inner => {
                sqlx::query(delete).bind(study).bind(stored(chunk)).bind(attempt).execute(inner).await.map(|_| ())
            })?;
            commit(connection).await
        })
        .await
    }
}

/// Whether what the server refuses may be tried again within the same transaction: not where this is in another's way, as in a deadlock, or came too late (class 40 of
/// PostgreSQL's appendix A).
fn leaves_transaction(error: &StoreError) -> bool {
    let StoreError::Failed(sqlx::Error::Database(refused)) = error else { return false };
    !refused.code().is_none_or(|code| code.starts_with("40"))
}

/// The session of a lease that is being begun: whoever fails or leaves meanwhile ends its transaction with it.
struct Begun(Option<Box<PoolConnection<Postgres>>>);

impl Drop for Begun {
    fn drop(&mut self) {
        if let Some(connection) = &mut self.0 {
            connection.close_on_drop();
        }
    }
}

async fn begin_lease(
    connection: &mut PoolConnection<Postgres>,
    Cut { id, chunk_variants }: &Cut,
    chunk: Option<u64>,
    lease: Duration,
) -> Result<Option<u64>, StoreError> {
    sqlx::query("BEGIN").execute(&mut **connection).await?;
    let free = sqlx::query_scalar::<_, i64>(if chunk.is_some() { THIS_IF_FREE } else { FIRST_FREE });
    let free = free.bind(id).bind(stored(*chunk_variants));
    let free = if let Some(chunk) = chunk { free.bind(stored(chunk)) } else { free };
    let Some(chunk) = free.fetch_optional(&mut **connection).await? else {
        sqlx::query("ROLLBACK").execute(&mut **connection).await?;
        return Ok(None);
    };
    // A worker that is silent for longer has its transaction ended, and the chunk is free. One that waits for a lock to keep what it has computed has not: that
    // would cost the chunk an attempt.
    sqlx::query(
        "SELECT set_config('idle_in_transaction_session_timeout', $1, TRUE), set_config('lock_timeout', '0', TRUE)",
    )
    .bind(milliseconds(lease))
    .execute(&mut **connection)
    .await?;
    Ok(Some(crate::read(chunk)))
}

/// What a chunk came to, as it is kept.
#[derive(Debug, Clone, Copy)]
struct Outcome<'a> {
    part: &'a [u8],
    variants: u64,
    refused: u64,
    busy: Duration,
}

impl Lease {
    /// The chunk's number.
    pub const fn chunk(&self) -> u64 {
        self.chunk
    }

    /// How often the chunk was begun before, and came to no result.
    ///
    /// # Errors
    /// Where the store does not answer.
    pub async fn attempts(&self) -> Result<u64, StoreError> {
        let text = "SELECT COUNT(*) FROM attempts WHERE study = $1 AND chunk = $2";
        let attempts = self.store.with(PATIENCE, async |connection| {
            let chunk = stored(self.chunk);
            Ok(on!(connection, inner => {
                sqlx::query_scalar::<_, i64>(text).bind(&self.cut.id).bind(chunk).fetch_one(inner).await
            })?)
        });
        attempts.await.map(crate::read)
    }

    /// The same after who lost a lease and goes on has had the time to find out that the chunk is another's, and to take its attempt back, where attempts are as many as
    /// chunks have.
    ///
    /// # Errors
    /// Where the store does not answer.
    pub async fn attempts_that_count(&mut self) -> Result<u64, StoreError> {
        // In this time its server has ended its session, and it has found that out.
        let patience = self.silence + 2 * self.often() + PATIENCE;
        let came = Instant::now();
        while came.elapsed() < patience {
            let attempts = self.attempts().await?;
            if attempts < MOST_ATTEMPTS || !matches!(self.held, Held::There(_)) {
                return Ok(attempts);
            }
            tokio::time::sleep(self.often()).await;
            self.say().await;
        }
        self.attempts().await
    }

    /// Notes that the chunk is about to be computed; one that was begun as often as chunks are is a gap instead.
    ///
    /// # Errors
    /// Where the store does not answer.
    pub async fn begin(mut self) -> Result<Claim, StoreError> {
        let chunk = self.chunk;
        match self.store.note_attempt(&self.cut.id, chunk, &self.attempt).await {
            Ok(true) => {
                self.is_noted = true;
                return Ok(Claim::Chunk(self));
            }
            Ok(false) => {}
            // The study was forgotten in this moment.
            Err(StoreError::Failed(sqlx::Error::Database(error))) if error.is_foreign_key_violation() => {
                return Ok(Claim::None);
            }
            Err(error) => {
                if error.leaves_open() {
                    self.take_back_attempt().await;
                }
                return Err(error);
            }
        }
        if matches!(self.held, Held::Lost) {
            // Whoever has the chunk now says what becomes of it.
            return Ok(Claim::None);
        }
        self.give_up().await?;
        Ok(Claim::Gap(chunk))
    }

    /// Says that its holder is alive, three times in the time that it may be silent or more, for as long as this is polled: a chunk may take longer than
    /// the canary let expect.
    pub async fn renew(&mut self) -> Infallible {
        loop {
            tokio::time::sleep(self.often()).await;
            self.say().await;
        }
    }

    fn often(&self) -> Duration {
        SAY.min(self.silence / 3)
    }

    /// Says so once. A lease that is lost all the same is taken again if nobody else has the chunk: restarts of a server while one long chunk was computed, or its full disk
    /// while what that came to was to be kept, made a gap of it.
    pub async fn say(&mut self) {
        if let Held::There(connection) = &mut self.held {
            let said = within(PATIENCE, async { Ok(sqlx::query("SELECT 1").execute(&mut ***connection).await?) }).await;
            if said.is_err() {
                connection.close_on_drop();
                self.held = Held::Lost;
            }
        }
        if matches!(self.held, Held::Lost) && self.is_noted {
            // An error: at the next time.
            let _ = self.hold_again().await;
        }
    }

    /// Takes a lease again that was lost. Where another has the chunk by now, or it is over, its holder goes on, and its attempt counts no more.
    async fn hold_again(&mut self) -> Result<(), StoreError> {
        let lost = *self.lost.get_or_insert_with(Instant::now);
        let Self { store, cut, chunk, attempt, silence, .. } = &*self;
        if let Some((_, held)) = store.claim_there(cut, Some(*chunk), *silence).await? {
            (self.held, self.lost) = (held, None);
        } else if lost.elapsed() > *silence || store.is_anothers(&cut.id, *chunk, attempt).await? {
            // Before, it may be this one's own session, which the server ends in that time.
            store.delete_attempt(&cut.id, *chunk, attempt).await?;
            self.is_noted = false;
        }
        Ok(())
    }

    /// Keeps what the chunk came to. Whoever comes second changes nothing: the bits are the same. Where the lease was lost, or is lost with
    /// this error, another call keeps it all the same.
    ///
    /// # Errors
    /// Where the store does not answer.
    pub async fn keep(&mut self, part: &[u8], variants: u64, refused: u64, busy: Duration) -> Result<(), StoreError> {
        let result = Outcome { part, variants, refused, busy };
        let (cut, chunk) = (self.cut.clone(), self.chunk);
        let worker = self.store.worker.to_string();
        match std::mem::replace(&mut self.held, Held::Lost) {
            Held::There(connection) => {
                let mut connection = Connection::Server(*connection);
                let kept = within(PATIENCE, async {
                    say(&mut connection, "SAVEPOINT held").await?;
                    write(&mut connection, &cut, chunk, result, &worker, true).await?;
                    commit(&mut connection).await
                })
                .await;
                if kept.is_ok() {
                    return kept;
                }
                // Where the server says that it has no room, the chunk is not another's for that.
                let is_held = kept.as_ref().is_err_and(leaves_transaction)
                    && within(PATIENCE, async {
                        say(&mut connection, "ROLLBACK TO SAVEPOINT held").await?;
                        say(&mut connection, "RELEASE SAVEPOINT held").await
                    })
                    .await
                    .is_ok();
                if let Connection::Server(mut connection) = connection {
                    if is_held {
                        self.held = Held::There(Box::new(connection));
                    } else {
                        connection.close_on_drop();
                    }
                }
                kept
            }
            held => {
                let kept = self
                    .store
                    .with(PATIENCE, async |connection| {
                        begin(connection).await?;
                        let is_ours = matches!(held, Held::Here);
                        write(connection, &cut, chunk, result, &worker, is_ours).await?;
                        commit(connection).await
                    })
                    .await;
                // Where it failed, it is ours for the next try.
                self.held = held;
                kept
            }
        }
    }

    /// Gives the chunk back as if it had not been begun: its worker stops, which is no fault of the chunk.
    ///
    /// # Errors
    /// Where the store does not answer; the attempt then stays noted.
    pub async fn give_back(self) -> Result<(), StoreError> {
        // Whoever claims it next is to see that it was not begun.
        let mut tries = 1;
        loop {
            match self.store.delete_attempt(&self.cut.id, self.chunk, &self.attempt).await {
                Err(error) if error.leaves_open() && tries < GIVEN_BACK => tries += 1,
                done => return done,
            }
            tokio::time::sleep(PAUSE).await;
        }
    }

    /// Sees to it that nothing is noted of an attempt that was not begun: a store that said nothing in time, since it does not flush for a while
    /// say, may note it all the same when it goes on, and one that was cut off before it said so may have. Three such attempts were a gap. Meanwhile the chunk is
    /// held, unless its lease was cut off too: else it would be claimed next.
    async fn take_back_attempt(&mut self) {
        const LONGEST_PAUSE: Duration = Duration::from_secs(10);
        let (store, cut, chunk, attempt) = (self.store.clone(), self.cut.clone(), self.chunk, self.attempt.clone());
        let taken_back = async {
            // What is deleted first may come before what is to be noted.
            let (mut deleted, mut pause) = (0, PAUSE);
            while deleted < 2 {
                tokio::time::sleep(pause).await;
                match store.delete_attempt(&cut.id, chunk, &attempt).await {
                    Ok(()) => (deleted, pause) = (deleted + 1, PAUSE),
                    Err(_) => pause = (2 * pause).min(LONGEST_PAUSE),
                }
            }
        };
        tokio::select! {
            () = taken_back => {}
            _ = self.renew() => {}
        }
    }

    /// Makes the chunk a gap.
    async fn give_up(mut self) -> Result<(), StoreError> {
        let (cut, chunk) = (self.cut.clone(), self.chunk);
        match std::mem::replace(&mut self.held, Held::Lost) {
            Held::There(connection) => {
                let mut connection = Connection::Server(*connection);
                let given_up = within(PATIENCE, async {
                    make_gap(&mut connection, &cut, chunk).await?;
                    commit(&mut connection).await
                })
                .await;
                if let (Err(_), Connection::Server(connection)) = (&given_up, &mut connection) {
                    connection.close_on_drop();
                }
                given_up
            }
            held => {
                self.held = held;
                self.store
                    .with(PATIENCE, async |connection| {
                        begin(connection).await?;
                        make_gap(connection, &cut, chunk).await?;
                        commit(connection).await
                    })
                    .await
            }
        }
    }
}

impl Drop for Lease {
    fn drop(&mut self) {
        match &mut self.held {
            Held::Here => {
                if let Database::File { leased, .. } = &self.store.database
                    && let Ok(mut leased) = leased.lock()
                {
                    leased.remove(&(self.cut.id.clone(), self.chunk));
                }
            }
            // The transaction ends with its session.
            Held::There(connection) => connection.close_on_drop(),
            Held::Lost => {}
        }
    }
}

/// Writes a result, if the study is still cut so. A chunk that another worker has in its hands by now is left to that one, who then finds the
/// result there.
async fn write(
    connection: &mut Connection,
    Cut { id, chunk_variants }: &Cut,
    chunk: u64,
    result: Outcome<'_>,
    worker: &str,
    is_ours: bool,
) -> Result<(), StoreError> {
    let (chunk, chunk_variants) = (stored(chunk), stored(*chunk_variants));
    let text = "INSERT INTO results SELECT $1, $2, $3, $4, $5, $6, $7
        WHERE EXISTS (SELECT 1 FROM studies WHERE id = $1 AND chunk_variants = $8) ON CONFLICT DO NOTHING";
    let busy_us = stored(u64::try_from(result.busy.as_micros()).unwrap_or(u64::MAX));
    on!(connection, inner => {
        sqlx::query(text)
            .bind(id)
            .bind(chunk)
            .bind(result.part)
            .bind(stored(result.variants))
            .bind(stored(result.refused))
            .bind(busy_us)
            .bind(worker)
            .bind(chunk_variants)
            .execute(inner)
            .await
            .map(|_| ())
    })?;
    let free = match connection {
        Connection::Server(_) if !is_ours => {
            "DELETE FROM chunks WHERE (study, chunk) IN (SELECT study, chunk FROM chunks WHERE study = $1 AND chunk = $2
                AND EXISTS (SELECT 1 FROM studies WHERE id = $1 AND chunk_variants = $3) FOR UPDATE OF chunks SKIP LOCKED)"
        }
        _ => FREE,
    };
    on!(connection, inner => sqlx::query(free).bind(id).bind(chunk).bind(chunk_variants).execute(inner).await.map(|_| ()))?;
    Ok(())
}

/// A chunk waits no longer, if the study is still cut so.
const FREE: &str = "DELETE FROM chunks WHERE study = $1 AND chunk = $2
    AND EXISTS (SELECT 1 FROM studies WHERE id = $1 AND chunk_variants = $3)";

async fn make_gap(connection: &mut Connection, Cut { id, chunk_variants }: &Cut, chunk: u64) -> Result<(), StoreError> {
    let (chunk, chunk_variants) = (stored(chunk), stored(*chunk_variants));
    let gap = "INSERT INTO gaps SELECT $1, $2, (SELECT COUNT(*) FROM attempts WHERE study = $1 AND chunk = $2)
        WHERE NOT EXISTS (SELECT 1 FROM results WHERE study = $1 AND chunk = $2)
            AND EXISTS (SELECT 1 FROM studies WHERE id = $1 AND chunk_variants = $3) ON CONFLICT DO NOTHING";
    for text in [gap, FREE] {
        on!(connection, inner => sqlx::query(text).bind(id).bind(chunk).bind(chunk_variants).execute(inner).await.map(|_| ()))?;
    }
    Ok(())
}
