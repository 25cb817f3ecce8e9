//! Studies in a store: how they stand, and what they have come to.

use std::collections::BTreeMap;
use std::time::Duration;

use tokio::time::Instant;

use crate::connection::{Connection, Database, Store, StoreError, on};
use crate::schema::require_schema;
use crate::{BATCH_CHUNKS, BEGIN_PATIENCE, LETTING_GO, LONG_PATIENCE, LOOK_AGAIN, PATIENCE, read, stored};

/// A study as it is first kept: all that follows from it is frozen with it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct NewStudy {
    /// What tells it from every other study.
    pub id: String,
    /// Its kind.
    pub kind: String,
    /// The build and the kind of processor that it belongs to, in a word: the column `build`.
    pub origin: String,
    /// What is asked, as it was sent.
    pub document: String,
    /// Most states of a variant's sweep.
    pub max_states: u64,
    /// Most points of a variant's profiles.
    pub max_profile_points: u64,
    /// Variants that it looks at.
    pub variants: u64,
    /// Variants of a chunk.
    pub chunk_variants: u64,
    /// Chunks that it consists of.
    pub chunks: u64,
    /// Variants of the canary.
    pub canary_variants: u64,
    /// A hash of what the canary comes to.
    pub canary: String,
    /// So long may a worker be silent over one chunk.
    pub lease: Duration,
    /// So long may the whole study take.
    pub time: Duration,
}

/// A study as it is cut into chunks. One that was forgotten and asked for anew may be cut otherwise: its chunks are others, of the same
/// numbers.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub struct Cut {
    /// The study's id.
    pub id: String,
    /// Variants of a chunk.
    pub chunk_variants: u64,
}

impl NewStudy {
    /// As it is cut.
    pub fn cut(&self) -> Cut {
        Cut { id: self.id.clone(), chunk_variants: self.chunk_variants }
    }
}

/// A chunk that never came to a result.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Gap {
    /// Its number.
    pub chunk: u64,
    /// How often it was tried.
    pub attempts: u64,
}

/// How a study stands.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Standing {
    /// As it was first kept; of `time` what is left.
    pub study: NewStudy,
    /// Length of its document.
    pub document_bytes: u64,
    /// Whether it was told to stop.
    pub is_cancelled: bool,
    /// Chunks that have a result.
    pub done: u64,
    /// Variants that those looked at.
    pub looked_at: u64,
    /// Of them, the ones without an answer.
    pub refused: u64,
    /// Chunks without one.
    pub gaps: Vec<Gap>,
    /// Since it was last asked for, as far as that was noted.
    pub unasked: Duration,
}

impl Standing {
    /// Whether every chunk has a result.
    pub const fn is_done(&self) -> bool {
        self.done >= self.study.chunks
    }

    /// Whether nothing is left to be tried.
    pub const fn is_exhausted(&self) -> bool {
        self.done + self.gaps.len() as u64 >= self.study.chunks
    }

    /// Whether its time is over.
    pub const fn is_late(&self) -> bool {
        self.study.time.is_zero()
    }

    /// Whether workers are wanted.
    pub const fn is_running(&self) -> bool {
        !self.is_cancelled && !self.is_exhausted() && !self.is_late()
    }
}

/// What a chunk came to.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Kept {
    /// Its number.
    pub chunk: u64,
    /// What it came to.
    pub part: Vec<u8>,
}

/// A study that waits for workers.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub struct Waiting {
    /// Which.
    pub cut: Cut,
    /// The build and the kind of processor that it belongs to, in a word.
    pub origin: String,
    /// Most states that one of its variants has.
    pub max_states: u64,
    /// Length of its document.
    pub document_bytes: u64,
}

/// The whole store in numbers.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Figures {
    /// Studies that are kept.
    pub studies: u64,
    /// Of these, the ones that run.
    pub running: u64,
    /// Chunks that have a result.
    pub done: u64,
    /// Chunks of studies that run that are still to be computed, those in work among them.
    pub waiting: u64,
    /// Chunks that somebody computes.
    pub in_work: u64,
    /// Attempts at all chunks.
    pub attempts: u64,
    /// Chunks that never came to a result.
    pub gaps: u64,
    /// Since the oldest study that runs was asked for.
    pub oldest: Duration,
}

type StudyRow = (String, String, String, String, i64, i64, i64, i64, i64, i64, String, i64, bool, i64, i64, i64);

macro_rules! study_with {
    ($document:literal) => {
        concat!(
            "SELECT id, kind, build, ",
            $document,
            ", max_states, max_profile_points, variants, chunk_variants, chunks, canary_variants, canary, lease_ms, is_cancelled,
            CAST(ends_at_s - unixepoch() AS BIGINT), CAST(unixepoch() - asked_at_s AS BIGINT), CAST(octet_length(document) AS BIGINT) FROM studies WHERE id = $1"
        )
    };
}

/// Open chunks of a study of the outer query that are still to be computed. One that has a result has its row for as long as another worker has it in hand: its first
/// holder's lease was lost, and what that one computed was kept.
macro_rules! to_be_computed {
    () => {
        "FROM chunks WHERE chunks.study = studies.id
            AND NOT EXISTS (SELECT 1 FROM results WHERE results.study = chunks.study AND results.chunk = chunks.chunk)"
    };
}

/// A study waits for workers.
macro_rules! waits {
    () => {
        concat!(
            "NOT is_cancelled AND ends_at_s > unixepoch() AND (opened < chunks OR EXISTS (SELECT 1 ",
            to_be_computed!(),
            "))"
        )
    };
}

const WAITING: &str = concat!(
    "SELECT id, chunk_variants, build, max_states, CAST(octet_length(document) AS BIGINT) FROM studies WHERE ",
    waits!(),
    " ORDER BY asked_at_s, id"
);

/// Nobody has asked for a study, or computed it, for so many seconds.
macro_rules! has_expired {
    () => {
        "asked_at_s <= unixepoch() - $1
            AND NOT EXISTS (SELECT 1 FROM attempts WHERE study = id AND began_at_s > unixepoch() - $1)"
    };
}

impl Store {
    /// Keeps a study, of which no chunk is open yet. Where it is kept already, perhaps in other chunks, nothing happens; whether it was not.
    ///
    /// # Errors
    /// Where the store does not answer, or has another schema.
    pub async fn create(&self, study: &NewStudy) -> Result<bool, StoreError> {
        self.with(BEGIN_PATIENCE, async |connection| {
            require_schema(connection).await?;
            let time_s = stored(study.time.as_secs());
            let is_new = on!(connection, inner => {
                sqlx::query(
                    "INSERT INTO studies VALUES ($1, $2, $3, $4, $5, $6, $7, $8, $9, $10, $11, $12, FALSE, unixepoch(), unixepoch() + $13, 0)
                        ON CONFLICT DO NOTHING",
                )
                .bind(&study.id)
                .bind(&study.kind)
                .bind(&study.origin)
                .bind(&study.document)
                .bind(stored(study.max_states))
                .bind(stored(study.max_profile_points))
                .bind(stored(study.variants))
                .bind(stored(study.chunk_variants))
                .bind(stored(study.chunks))
                .bind(stored(study.canary_variants))
                .bind(&study.canary)
                .bind(stored(u64::try_from(study.lease.as_millis()).unwrap_or(u64::MAX)))
                .bind(time_s)
                .execute(inner)
                .await
                .map(|done| done.rows_affected() == 1)
            })?;
            Ok(is_new)
        })
        .await
    }

    /// Opens the next chunks of a study, for whoever found none that is free; whether there may be some now.
    ///
    /// # Errors
    /// Where the store does not answer.
    pub(crate) async fn open_more(&self, id: &str) -> Result<bool, StoreError> {
        self.with(PATIENCE, async |connection| {
            let text = "SELECT opened FROM studies WHERE id = $1 AND opened < chunks AND NOT is_cancelled";
            let opened: Option<i64> =
                on!(connection, inner => sqlx::query_scalar(text).bind(id).fetch_optional(inner).await)?;
            let Some(opened) = opened else { return Ok(false) };
            begin(connection).await?;
            // Of many who find none at once the first opens them, and the others find them open.
            let text = "UPDATE studies SET opened = CASE WHEN chunks - opened > $3 THEN opened + $3 ELSE chunks END
                WHERE id = $1 AND opened = $2";
            let batch = stored(BATCH_CHUNKS);
            let is_ours = on!(connection, inner => {
                let done = sqlx::query(text).bind(id).bind(opened).bind(batch).execute(inner).await;
                done.map(|done| done.rows_affected() == 1)
            })?;
            if is_ours {
                let text = "INSERT INTO chunks WITH RECURSIVE numbers (chunk) AS
                        (SELECT CAST($2 AS BIGINT) UNION ALL SELECT chunk + 1 FROM numbers WHERE chunk + 1 < $2 + $3)
                        SELECT id, chunk FROM studies, numbers WHERE id = $1 AND chunk < opened";
                on!(connection, inner => sqlx::query(text).bind(id).bind(opened).bind(batch).execute(inner).await.map(|_| ()))?;
            }
            commit(connection).await?;
            Ok(true)
        })
        .await
    }

    /// Lets a study go on, for so long at most: what was cancelled, what ran out of time, and what became a gap is tried anew.
    ///
    /// # Errors
    /// As [`Self::create`].
    pub async fn resume(&self, id: &str, time: Duration) -> Result<(), StoreError> {
        self.with(BEGIN_PATIENCE, async |connection| {
            require_schema(connection).await?;
            begin(connection).await?;
            let time_s = stored(time.as_secs());
            on!(connection, inner => {
                sqlx::query("UPDATE studies SET is_cancelled = FALSE, asked_at_s = unixepoch(), ends_at_s = unixepoch() + $2 WHERE id = $1")
                    .bind(id).bind(time_s).execute(inner).await.map(|_| ())
            })?;
            for text in [
                "DELETE FROM attempts WHERE study = $1 AND chunk IN (SELECT chunk FROM gaps WHERE study = $1)",
                "INSERT INTO chunks SELECT study, chunk FROM gaps WHERE study = $1 ON CONFLICT DO NOTHING",
                // One that is noted in this moment stays: its chunk is not open again.
                "DELETE FROM gaps WHERE study = $1 AND (EXISTS (SELECT 1 FROM chunks WHERE chunks.study = $1 AND chunks.chunk = gaps.chunk)
                    OR EXISTS (SELECT 1 FROM results WHERE results.study = $1 AND results.chunk = gaps.chunk))",
            ] {
                on!(connection, inner => sqlx::query(text).bind(id).execute(inner).await.map(|_| ()))?;
            }
            commit(connection).await
        })
        .await
    }

    /// Tells a study to stop.
    ///
    /// # Errors
    /// As [`Self::create`].
    pub async fn cancel(&self, id: &str) -> Result<(), StoreError> {
        self.once(PATIENCE, "UPDATE studies SET is_cancelled = TRUE WHERE id = $1", id).await
    }

    /// Notes that a study was asked for: it expires so much later. Nobody needs it soon, so that it waits for long where the database does not write.
    ///
    /// # Errors
    /// As [`Self::create`].
    pub async fn touch(&self, id: &str) -> Result<(), StoreError> {
        self.once(LONG_PATIENCE, "UPDATE studies SET asked_at_s = unixepoch() WHERE id = $1", id).await
    }

    /// Forgets a study that does not run, with all that it has come to. Workers that have chunks of it in their hands are waited for, some seconds, and not by
    /// holding a connection: one that stands still keeps its chunk until its lease is over.
    ///
    /// # Errors
    /// As [`Self::create`], and [`StoreError::InWork`].
    pub async fn forget(&self, id: &str) -> Result<(), StoreError> {
        let began = Instant::now();
        while !self.forget_at_once(id, None).await? {
            if began.elapsed() >= LETTING_GO {
                return Err(StoreError::InWork);
            }
            tokio::time::sleep(LOOK_AGAIN).await;
            if self.look(id).await?.is_none_or(|standing| standing.is_running()) {
                // Another has forgotten it, or wants it again.
                break;
            }
        }
        Ok(())
    }

    /// Forgets a study of which no chunk is in work, and which nobody has wanted for so long; whether that was so.
    async fn forget_at_once(&self, id: &str, unwanted_for: Option<Duration>) -> Result<bool, StoreError> {
        self.with(LONG_PATIENCE, async |connection| {
            require_schema(connection).await?;
            begin(connection).await?;
            if let Connection::Server(server) = &mut *connection {
                sqlx::query("SET LOCAL lock_timeout = '10ms'").execute(&mut **server).await?;
            }
            match forget_within(connection, id, unwanted_for).await {
                Ok(true) => commit(connection).await.map(|()| true),
                Ok(false) | Err(StoreError::Locked) => {
                    on!(connection, inner => sqlx::query("ROLLBACK").execute(inner).await.map(|_| ()))?;
                    Ok(false)
                }
                Err(error) => Err(error),
            }
        })
        .await
    }

    /// A statement about one study.
    async fn once(&self, patience: Duration, text: &'static str, id: &str) -> Result<(), StoreError> {
        self.with(patience, async |connection| {
            require_schema(connection).await?;
            on!(connection, inner => sqlx::query(text).bind(id).execute(inner).await.map(|_| ()))?;
            Ok(())
        })
        .await
    }

    /// Forgets the studies that nobody has asked for in this time, but for those that somebody computed in it; returns how many.
    ///
    /// # Errors
    /// As [`Self::create`].
    pub async fn expire(&self, unasked_for: Duration) -> Result<u64, StoreError> {
        let unasked_for_s = stored(unasked_for.as_secs());
        let ids: Vec<String> = self
            .with(LONG_PATIENCE, async |connection| {
                require_schema(connection).await?;
                let text = concat!("SELECT id FROM studies WHERE ", has_expired!());
                Ok(on!(connection, inner => sqlx::query_scalar(text).bind(unasked_for_s).fetch_all(inner).await)?)
            })
            .await?;
        let (mut gone, mut refused) = (0, None);
        for id in ids {
            // One that somebody computes yet does not keep the others, nor does one that the store refuses to delete.
            match self.forget_at_once(&id, Some(unasked_for)).await {
                Ok(is_gone) => gone += u64::from(is_gone),
                Err(error) if error.leaves_open() => return Err(error),
                Err(error) => refused = Some(error),
            }
        }
        refused.map_or(Ok(gone), Err)
    }

    /// How a study stands, where it is kept.
    ///
    /// # Errors
    /// As [`Self::create`].
    pub async fn find(&self, id: &str) -> Result<Option<Standing>, StoreError> {
        self.stands(id, study_with!("document")).await
    }

    /// The same without its document, which may take much.
    ///
    /// # Errors
    /// As [`Self::create`].
    pub async fn look(&self, id: &str) -> Result<Option<Standing>, StoreError> {
        self.stands(id, study_with!("''")).await
    }

    async fn stands(&self, id: &str, text: &'static str) -> Result<Option<Standing>, StoreError> {
        self.with(PATIENCE, async |connection| {
            require_schema(connection).await?;
            let row: Option<StudyRow> = on!(connection, inner => sqlx::query_as(text).bind(id).fetch_optional(inner).await)?;
            let Some(row) = row else { return Ok(None) };
            // Gaps before results: a chunk that came to a result at last is counted as one.
            let gaps: Vec<(i64, i64)> = on!(connection, inner => {
                sqlx::query_as(
                    "SELECT chunk, attempts FROM gaps WHERE study = $1
                        AND NOT EXISTS (SELECT 1 FROM results WHERE results.study = gaps.study AND results.chunk = gaps.chunk) ORDER BY chunk",
                )
                .bind(id)
                .fetch_all(inner)
                .await
            })?;
            let (done, looked_at, refused): (i64, i64, i64) = on!(connection, inner => {
                sqlx::query_as(
                    "SELECT COUNT(*), CAST(COALESCE(SUM(variants), 0) AS BIGINT), CAST(COALESCE(SUM(refused), 0) AS BIGINT)
                        FROM results WHERE study = $1",
                )
                .bind(id)
                .fetch_one(inner)
                .await
            })?;
            let gaps = gaps.into_iter().map(|(chunk, attempts)| Gap { chunk: read(chunk), attempts: read(attempts) });
            let document_bytes = read(row.15);
            let (study, is_cancelled, unasked) = study(row);
            let (done, looked_at, refused) = (read(done), read(looked_at), read(refused));
            Ok(Some(Standing { study, document_bytes, is_cancelled, done, looked_at, refused, gaps: gaps.collect(), unasked }))
        })
        .await
    }

    /// The studies that wait for workers, the oldest first.
    ///
    /// # Errors
    /// As [`Self::create`].
    pub async fn waiting(&self) -> Result<Vec<Waiting>, StoreError> {
        self.with(PATIENCE, async |connection| {
            require_schema(connection).await?;
            let rows: Vec<(String, i64, String, i64, i64)> =
                on!(connection, inner => sqlx::query_as(WAITING).fetch_all(inner).await)?;
            let waiting = |(id, chunk_variants, origin, max_states, document_bytes)| Waiting {
                cut: Cut { id, chunk_variants: read(chunk_variants) },
                origin,
                max_states: read(max_states),
                document_bytes: read(document_bytes),
            };
            Ok(rows.into_iter().map(waiting).collect())
        })
        .await
    }

    /// The numbers of the chunks that have a result, each with its length.
    ///
    /// # Errors
    /// As [`Self::create`].
    pub async fn chunks_done(&self, Cut { id, chunk_variants }: &Cut) -> Result<Vec<(u64, u64)>, StoreError> {
        self.with(PATIENCE, async |connection| {
            let text = "SELECT chunk, CAST(octet_length(part) AS BIGINT) FROM results WHERE study = $1 AND EXISTS (SELECT 1 FROM studies WHERE id = $1 AND chunk_variants = $2)
                ORDER BY chunk";
            let rows: Vec<(i64, i64)> = on!(connection, inner => {
                sqlx::query_as(text).bind(id).bind(stored(*chunk_variants)).fetch_all(inner).await
            })?;
            Ok(rows.into_iter().map(|(chunk, bytes)| (read(chunk), read(bytes))).collect())
        })
        .await
    }

    /// What the chunks between two numbers have come to, the ends included.
    ///
    /// # Errors
    /// As [`Self::create`].
    pub async fn parts(
        &self,
        Cut { id, chunk_variants }: &Cut,
        first: u64,
        last: u64,
    ) -> Result<Vec<Kept>, StoreError> {
        self.with(PATIENCE, async |connection| {
            let text = "SELECT chunk, part FROM results WHERE study = $1 AND chunk BETWEEN $2 AND $3
                AND EXISTS (SELECT 1 FROM studies WHERE id = $1 AND chunk_variants = $4) ORDER BY chunk";
            let rows: Vec<(i64, Vec<u8>)> = on!(connection, inner => {
                sqlx::query_as(text)
                    .bind(id)
                    .bind(stored(first))
                    .bind(stored(last))
                    .bind(stored(*chunk_variants))
                    .fetch_all(inner)
                    .await
            })?;
            Ok(rows.into_iter().map(|(chunk, part)| Kept { chunk: read(chunk), part }).collect())
        })
        .await
    }

    /// Who has computed how many chunks of a study, and for how long.
    ///
    /// # Errors
    /// As [`Self::create`].
    pub async fn workers(&self, id: &str) -> Result<BTreeMap<String, (u64, Duration)>, StoreError> {
        self.with(PATIENCE, async |connection| {
            let text =
                "SELECT worker, COUNT(*), CAST(SUM(busy_us) AS BIGINT) FROM results WHERE study = $1 GROUP BY worker";
            let rows: Vec<(String, i64, i64)> =
                on!(connection, inner => sqlx::query_as(text).bind(id).fetch_all(inner).await)?;
            Ok(rows
                .into_iter()
                .map(|(worker, chunks, busy_us)| (worker, (read(chunks), Duration::from_micros(read(busy_us)))))
                .collect())
        })
        .await
    }

    /// The whole store in numbers.
    ///
    /// # Errors
    /// As [`Self::create`].
    pub async fn figures(&self) -> Result<Figures, StoreError> {
        self.with(LONG_PATIENCE, async |connection| {
            require_schema(connection).await?;
            let mut counts = [0_i64; 5];
            for (count, text) in counts.iter_mut().zip([
                "SELECT COUNT(*) FROM studies",
                "SELECT COUNT(*) FROM results",
                concat!(
                    "SELECT CAST(COALESCE(SUM(chunks - opened + (SELECT COUNT(*) ",
                    to_be_computed!(),
                    ")), 0) AS BIGINT) FROM studies WHERE NOT is_cancelled AND ends_at_s > unixepoch()"
                ),
                "SELECT COUNT(*) FROM attempts",
                "SELECT COUNT(*) FROM gaps WHERE NOT EXISTS
                    (SELECT 1 FROM results WHERE results.study = gaps.study AND results.chunk = gaps.chunk)",
            ]) {
                *count = on!(connection, inner => sqlx::query_scalar(text).fetch_one(inner).await)?;
            }
            let running: Vec<i64> = on!(connection, inner => {
                let text = concat!("SELECT CAST(unixepoch() - asked_at_s AS BIGINT) FROM studies WHERE ", waits!());
                sqlx::query_scalar(text).fetch_all(inner).await
            })?;
            let in_work = match (&self.database, connection) {
                (Database::File { leased, .. }, _) => leased.lock().map_or(0, |leased| leased.len() as u64),
                (Database::Server { .. }, connection) => sessions_that_compute(connection).await?,
            };
            let [studies, done, waiting, attempts, gaps] = counts.map(read);
            let oldest = Duration::from_secs(running.iter().copied().max().map_or(0, read));
            Ok(Figures { studies, running: running.len() as u64, done, waiting, in_work, attempts, gaps, oldest })
        })
        .await
    }
}

/// Forgets a study, if nobody has wanted it for so long; whether that was so.
async fn forget_within(
    connection: &mut Connection,
    id: &str,
    unwanted_for: Option<Duration>,
) -> Result<bool, StoreError> {
    // Who was told that it does not run any more may have been overtaken by one who lets it go on.
    let close = match unwanted_for {
        None => concat!("UPDATE studies SET opened = chunks WHERE id = $1 AND NOT (", waits!(), ")"),
        Some(_) => "UPDATE studies SET opened = chunks WHERE id = $1",
    };
    let is_closed = on!(connection, inner => sqlx::query(close).bind(id).execute(inner).await.map(|done| done.rows_affected() == 1))?;
    if !is_closed {
        return Ok(false);
    }
    if let Some(time) = unwanted_for {
        let text = concat!("SELECT COUNT(*) FROM studies WHERE ", has_expired!(), " AND id = $2");
        let unwanted_s = stored(time.as_secs());
        let unwanted: i64 =
            on!(connection, inner => sqlx::query_scalar(text).bind(unwanted_s).bind(id).fetch_one(inner).await)?;
        if unwanted == 0 {
            return Ok(false);
        }
    }
    // Its chunks first: whoever computes one must not wait for the study meanwhile. Nor does anybody open more of them.
    for text in ["DELETE FROM chunks WHERE study = $1", "DELETE FROM studies WHERE id = $1"] {
        on!(connection, inner => sqlx::query(text).bind(id).execute(inner).await.map(|_| ()))?;
    }
    Ok(true)
}

/// Sessions of leases whose transactions are open.
async fn sessions_that_compute(connection: &mut Connection) -> Result<u64, StoreError> {
    let Connection::Server(inner) = connection else { return Ok(0) };
    let text = "SELECT COUNT(*) FROM pg_stat_activity
        WHERE datname = current_database() AND application_name = 'toothwave lease' AND xact_start IS NOT NULL";
    Ok(read(sqlx::query_scalar(text).fetch_one(&mut **inner).await?))
}

pub(crate) async fn begin(connection: &mut Connection) -> Result<(), StoreError> {
    say(connection, "BEGIN").await
}

pub(crate) async fn commit(connection: &mut Connection) -> Result<(), StoreError> {
    say(connection, "COMMIT").await
}

pub(crate) async fn say(connection: &mut Connection, text: &'static str) -> Result<(), StoreError> {
    on!(connection, inner => sqlx::query(text).execute(inner).await.map(|_| ()))?;
    Ok(())
}

fn study(row: StudyRow) -> (NewStudy, bool, Duration) {
    #[rustfmt::skip]
    let (id, kind, origin, document, max_states, max_profile_points, variants, chunk_variants, chunks, canary_variants, canary, lease_ms, is_cancelled, left_s, unasked_s, _) = row;
    let study = NewStudy {
        id,
        kind,
        origin,
        document,
        max_states: read(max_states),
        max_profile_points: read(max_profile_points),
        variants: read(variants),
        chunk_variants: read(chunk_variants),
        chunks: read(chunks),
        canary_variants: read(canary_variants),
        canary,
        lease: Duration::from_millis(read(lease_ms)),
        time: Duration::from_secs(read(left_s)),
    };
    (study, is_cancelled, Duration::from_secs(read(unasked_s)))
}
