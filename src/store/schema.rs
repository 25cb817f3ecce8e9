//! The tables, in versions that follow each other.

use crate::connection::{Connection, Store, StoreError, milliseconds, on, within};
use crate::{LONG_LOCK_PATIENCE, LONG_PATIENCE, PATIENCE, read, stored};

/// The version that this build works with.
pub const SCHEMA_VERSION: u64 = VERSIONS.len() as u64;

/// What brings each version about from the one before. A version that was released is never changed.
const VERSIONS: [&str; 4] = [VERSION_1, VERSION_2, VERSION_3, VERSION_4];

/// Times are seconds since 1970 by the database's clock, so that those of the machines need not agree.
const VERSION_1: &str = "
CREATE TABLE studies (
    id TEXT PRIMARY KEY,
    kind TEXT NOT NULL,
    build TEXT NOT NULL,
    document TEXT NOT NULL,
    max_states BIGINT NOT NULL,
    max_profile_points BIGINT NOT NULL,
    variants BIGINT NOT NULL,
    chunk_variants BIGINT NOT NULL,
    chunks BIGINT NOT NULL,
    canary_variants BIGINT NOT NULL,
    canary TEXT NOT NULL,
    lease_ms BIGINT NOT NULL,
    is_cancelled BOOLEAN NOT NULL,
    asked_at_s BIGINT NOT NULL,
    ends_at_s BIGINT NOT NULL
);
-- What is still to be computed.
CREATE TABLE chunks (
    study TEXT NOT NULL REFERENCES studies ON DELETE CASCADE,
    chunk BIGINT NOT NULL,
    PRIMARY KEY (study, chunk)
);
-- What was, once each.
CREATE TABLE results (
    study TEXT NOT NULL REFERENCES studies ON DELETE CASCADE,
    chunk BIGINT NOT NULL,
    part BYTEA NOT NULL,
    variants BIGINT NOT NULL,
    refused BIGINT NOT NULL,
    busy_us BIGINT NOT NULL,
    worker TEXT NOT NULL,
    PRIMARY KEY (study, chunk)
);
-- Committed before computing. Whoever computes to the end, or stops in order, leaves none without a result behind.
CREATE TABLE attempts (
    study TEXT NOT NULL REFERENCES studies ON DELETE CASCADE,
    chunk BIGINT NOT NULL,
    worker TEXT NOT NULL,
    began_at_s BIGINT NOT NULL
);
CREATE INDEX attempts_of_chunk ON attempts (study, chunk);
-- What never came to a result.
CREATE TABLE gaps (
    study TEXT NOT NULL REFERENCES studies ON DELETE CASCADE,
    chunk BIGINT NOT NULL,
    attempts BIGINT NOT NULL,
    PRIMARY KEY (study, chunk)
);
";

/// Chunks stand in `chunks` a batch at a time: those below `opened` were written there. Of studies that are kept already all were.
const VERSION_2: &str = "
ALTER TABLE studies ADD COLUMN opened BIGINT NOT NULL DEFAULT 0;
UPDATE studies SET opened = chunks;
";

/// How a study stands is told from here: in SQLite's table the counts stand behind the parts, and who sums them up would go through all of these.
const VERSION_3: &str = "
CREATE INDEX counts_of_results ON results (study, variants, refused);
";

/// What waits for workers is told from here: in SQLite's table all that stands behind the document, which may be long, and who looks each second would go through
/// those of all studies.
const VERSION_4: &str = "
CREATE INDEX studies_that_wait ON studies (ends_at_s, opened, chunks, asked_at_s, id, chunk_variants, build) WHERE NOT is_cancelled;
";

/// What PostgreSQL needs to be spoken to as SQLite is, and to keep parts as they are: their numbers hardly compress.
const SERVER_VERSION_1: &str = "
CREATE FUNCTION unixepoch() RETURNS BIGINT LANGUAGE SQL VOLATILE
    AS 'SELECT CAST(floor(extract(epoch FROM clock_timestamp())) AS BIGINT)';
ALTER TABLE results ALTER COLUMN part SET STORAGE EXTERNAL;
";

const SERVER_VERSIONS: [&str; VERSIONS.len()] = [SERVER_VERSION_1, "", "", ""];

/// Any number that means this to everybody who migrates the same database.
const MIGRATION_LOCK: &str = "SELECT pg_advisory_xact_lock(7355608)";

impl Store {
    /// Brings the store to the schema of this build, in one transaction, and returns the version that it had before.
    ///
    /// # Errors
    /// Where it has a newer schema, or does not answer.
    pub async fn migrate(&self) -> Result<u64, StoreError> {
        self.with(LONG_PATIENCE, async |connection| {
            on!(connection, inner => sqlx::query("BEGIN").execute(inner).await.map(|_| ()))?;
            if let Connection::Server(inner) = connection {
                // For others who migrate, and for leases, whose transactions have the tables.
                let long = "SELECT set_config('lock_timeout', $1, TRUE)";
                sqlx::query(long).bind(milliseconds(LONG_LOCK_PATIENCE)).execute(&mut **inner).await?;
                sqlx::query(MIGRATION_LOCK).execute(&mut **inner).await?;
            }
            let known = "CREATE TABLE IF NOT EXISTS schema_versions (version BIGINT PRIMARY KEY, applied_at_s BIGINT NOT NULL)";
            on!(connection, inner => sqlx::query(known).execute(inner).await.map(|_| ()))?;
            let before = version(connection).await?;
            if before > SCHEMA_VERSION {
                on!(connection, inner => sqlx::query("ROLLBACK").execute(inner).await.map(|_| ()))?;
                return Err(StoreError::OtherSchema { found: before });
            }
            for (index, text) in VERSIONS.iter().enumerate().skip(usize::try_from(before).unwrap_or(usize::MAX)) {
                on!(connection, inner => sqlx::raw_sql(*text).execute(inner).await.map(|_| ()))?;
                if let Connection::Server(inner) = connection {
                    sqlx::raw_sql(SERVER_VERSIONS[index]).execute(&mut **inner).await?;
                }
                let version = stored(index as u64 + 1);
                on!(connection, inner => {
                    sqlx::query("INSERT INTO schema_versions VALUES ($1, unixepoch())").bind(version).execute(inner).await.map(|_| ())
                })?;
            }
            on!(connection, inner => sqlx::query("COMMIT").execute(inner).await.map(|_| ()))?;
            Ok(before)
        })
        .await
    }

    /// That the store has the schema of this build.
    ///
    /// # Errors
    /// Where it has another one, or does not answer.
    pub async fn check_schema(&self) -> Result<(), StoreError> {
        self.with(PATIENCE, async |connection| require_schema(connection).await).await
    }
}

/// That this connection leads to the schema of this build: short, so that for whatever follows nobody waits long for a silent server.
pub(crate) async fn require_schema(connection: &mut Connection) -> Result<(), StoreError> {
    match within(PATIENCE, version(connection)).await {
        Ok(found) if found == SCHEMA_VERSION => Ok(()),
        Ok(found) => Err(StoreError::OtherSchema { found }),
        // PostgreSQL's word for a table that is not there.
        Err(StoreError::Failed(sqlx::Error::Database(error))) if error.code().as_deref() == Some("42P01") => {
            Err(StoreError::OtherSchema { found: 0 })
        }
        Err(error) => Err(error),
    }
}

async fn version(connection: &mut Connection) -> Result<u64, StoreError> {
    let last = "SELECT CAST(COALESCE(MAX(version), 0) AS BIGINT) FROM schema_versions";
    let found: i64 = on!(connection, inner => sqlx::query_scalar(last).fetch_one(inner).await)?;
    Ok(read(found))
}
