//! The file of studies: an SQLite database that one process has open at a time. Without a file it is in memory.

use std::collections::HashSet;
use std::fs::OpenOptions;
use std::os::unix::fs::OpenOptionsExt as _;
use std::path::Path;
use std::sync::Arc;
use std::time::{SystemTime, UNIX_EPOCH};

use parking_lot::Mutex;
use rusqlite::{
    Connection, ErrorCode, OpenFlags, OptionalExtension as _, Row, Transaction, TransactionBehavior, named_params,
    params,
};
use toothwave_calculation::origin;

use super::StudyState;
use crate::http::problem::{Problem, ProblemCode};

/// Marks a database as a file of studies: "toth".
const APPLICATION_ID: i64 = 0x746f_7468;

/// The schema of this build. Versions 1 to 4 were those of builds with workers.
const SCHEMA_VERSION: i64 = 5;

/// The long columns are last, so that the others are read without them.
const SCHEMA: &str = "
CREATE TABLE studies (
    id TEXT PRIMARY KEY,
    kind TEXT NOT NULL,
    origin TEXT NOT NULL,
    state TEXT NOT NULL,
    problem TEXT,
    variants INTEGER NOT NULL,
    chunks INTEGER NOT NULL,
    bytes INTEGER NOT NULL,
    done INTEGER NOT NULL DEFAULT 0,
    looked_at INTEGER NOT NULL DEFAULT 0,
    impossible INTEGER NOT NULL DEFAULT 0,
    asked_at_s INTEGER NOT NULL,
    ends_at_s INTEGER NOT NULL,
    max_states INTEGER NOT NULL,
    max_profile_points INTEGER NOT NULL,
    document_hash BLOB NOT NULL,
    document BLOB NOT NULL
) STRICT;
CREATE TABLE parts (
    study TEXT NOT NULL,
    chunk INTEGER NOT NULL,
    origin TEXT NOT NULL,
    part BLOB NOT NULL,
    PRIMARY KEY (study, chunk)
) STRICT;
";

/// Why the file of studies did not do what it was asked.
#[derive(Debug, thiserror::Error)]
pub enum StoreError {
    /// What SQLite says, for instance that the disk is full.
    #[error("the file of studies fails: {0}")]
    Failed(rusqlite::Error),
    /// The thread that waited for the disk ended.
    #[error("the file of studies does not answer")]
    Silent,
    /// Its content is not what was written.
    #[error("the file of studies is damaged: {0}. Restore it from a backup, or start with a new file.")]
    Damaged(rusqlite::Error),
    /// Another process has it open.
    #[error("another process has the file of studies open. A file serves one process.")]
    InUse,
    /// Another version of toothwave wrote it.
    #[error(
        "the file of studies has schema {found}, and this build works with schema {SCHEMA_VERSION}. Start with a new file."
    )]
    OtherSchema {
        /// The schema that it has.
        found: i64,
    },
    /// Something else is kept there.
    #[error("the file is a database of something else. Name a file that does not exist yet.")]
    Foreign,
}

impl From<rusqlite::Error> for StoreError {
    fn from(error: rusqlite::Error) -> Self {
        match error.sqlite_error_code() {
            Some(ErrorCode::DatabaseCorrupt | ErrorCode::NotADatabase) => Self::Damaged(error),
            Some(ErrorCode::DatabaseBusy | ErrorCode::DatabaseLocked) => Self::InUse,
            _ => Self::Failed(error),
        }
    }
}

/// The client learns what it can do about it; the log has the words of SQLite.
impl From<StoreError> for Problem {
    fn from(error: StoreError) -> Self {
        tracing::warn!(%error, "the file of studies fails");
        match error {
            StoreError::Damaged(_) => Self::internal(&error),
            StoreError::Failed(failed) if failed.sqlite_error_code() == Some(ErrorCode::DiskFull) => {
                let detail = "the disk with the file of studies is full; try again when there is space";
                Self::new(ProblemCode::StoreUnavailable, detail)
            }
            _ => {
                let detail = "the file of studies cannot be read or written now; try again in a moment";
                Self::new(ProblemCode::StoreUnavailable, detail)
            }
        }
    }
}

/// A study that begins, or continues.
#[derive(Debug)]
pub(super) struct NewStudy {
    pub(super) id: String,
    pub(super) kind: &'static str,
    pub(super) variants: u64,
    pub(super) chunks: u64,
    /// What it takes with its result, about.
    pub(super) bytes: u64,
    pub(super) ends_at_s: u64,
    pub(super) max_states: u64,
    pub(super) max_profile_points: u64,
    pub(super) document: Vec<u8>,
}

/// A study without its document.
#[derive(Debug)]
pub(super) struct StoredStudy {
    pub(super) id: String,
    pub(super) kind: String,
    pub(super) state: StudyState,
    pub(super) problem: Option<String>,
    pub(super) variants: u64,
    pub(super) chunks: u64,
    pub(super) bytes: u64,
    /// Variants of the chunks that have a part, and the ones of these without an answer.
    pub(super) looked_at: u64,
    pub(super) impossible: u64,
    pub(super) asked_at_s: u64,
    pub(super) ends_at_s: u64,
}

/// The columns of one.
const STUDY: &str =
    "id, kind, state, problem, variants, chunks, bytes, done, looked_at, impossible, asked_at_s, ends_at_s";

/// What a study asks, with the limits of each variant.
#[derive(Debug)]
pub(super) struct StoredDocument {
    pub(super) text: Vec<u8>,
    pub(super) max_states: u64,
    pub(super) max_profile_points: u64,
    hash: [u8; blake3::OUT_LEN],
}

impl StoredDocument {
    /// Whether it is what was written.
    pub(super) fn is_intact(&self) -> bool {
        blake3::hash(&self.text) == self.hash
    }
}

/// A part that was computed.
#[derive(Debug)]
pub(super) struct NewPart {
    pub(super) study: String,
    pub(super) chunk: u64,
    pub(super) variants: u64,
    pub(super) refused: u64,
    pub(super) sealed: Vec<u8>,
}

/// Seconds since 1970.
pub(super) fn now_s() -> u64 {
    SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default().as_secs()
}

/// An open file of studies.
#[derive(Debug, Clone)]
pub struct Store {
    connection: Arc<Mutex<Connection>>,
    is_in_memory: bool,
}

impl Store {
    /// Opens a file, which is created if it does not exist; without one, a database in memory.
    ///
    /// # Errors
    /// If the file cannot be opened, is damaged, is open elsewhere, or was written by another version.
    pub fn open(file: Option<&Path>) -> Result<Self, StoreError> {
        let mut connection = match file {
            Some(file) => {
                // Others on the machine may not read it. If this fails, SQLite says why.
                let _ = OpenOptions::new().append(true).create(true).mode(0o600).open(file);
                Connection::open_with_flags(file, OpenFlags::SQLITE_OPEN_READ_WRITE | OpenFlags::SQLITE_OPEN_CREATE)?
            }
            None => Connection::open_in_memory()?,
        };
        connection.pragma_update(None, "locking_mode", "EXCLUSIVE")?;
        let transaction = connection.transaction_with_behavior(TransactionBehavior::Immediate)?;
        require_schema(&transaction)?;
        transaction.commit()?;
        // A commit outlives the process. After a power cut the last ones may be missing; these chunks are computed again.
        connection.pragma_update_and_check(None, "journal_mode", "WAL", |_| Ok(()))?;
        connection.pragma_update(None, "synchronous", "NORMAL")?;
        Ok(Self { connection: Arc::new(Mutex::new(connection)), is_in_memory: file.is_none() })
    }

    /// Whether it ends with the process.
    pub(super) const fn is_in_memory(&self) -> bool {
        self.is_in_memory
    }

    /// Runs one short transaction on a thread that may wait for the disk. It is carried out even if nobody waits for it any more.
    pub(super) async fn with<T: Send + 'static>(
        &self,
        work: impl FnOnce(&Transaction<'_>) -> rusqlite::Result<T> + Send + 'static,
    ) -> Result<T, StoreError> {
        let store = self.clone();
        tokio::task::spawn_blocking(move || store.now(work)).await.unwrap_or(Err(StoreError::Silent))
    }

    /// Runs one short transaction on this thread.
    pub(super) fn now<T>(&self, work: impl FnOnce(&Transaction<'_>) -> rusqlite::Result<T>) -> Result<T, StoreError> {
        let mut connection = self.connection.lock();
        let transaction = connection.transaction()?;
        let done = work(&transaction)?;
        transaction.commit()?;
        Ok(done)
    }
}

fn require_schema(transaction: &Transaction<'_>) -> Result<(), StoreError> {
    let pragma = |name| transaction.pragma_query_value(None, name, |row| row.get::<_, i64>(0));
    let tables: i64 = transaction.query_row("SELECT COUNT(*) FROM sqlite_schema", [], |row| row.get(0))?;
    match (pragma("application_id")?, pragma("user_version")?) {
        (APPLICATION_ID, SCHEMA_VERSION) => Ok(()),
        (APPLICATION_ID, found) => Err(StoreError::OtherSchema { found }),
        (0, 0) if tables == 0 => {
            transaction.execute_batch(SCHEMA)?;
            transaction.pragma_update(None, "application_id", APPLICATION_ID)?;
            transaction.pragma_update(None, "user_version", SCHEMA_VERSION)?;
            Ok(())
        }
        _ => {
            // Earlier builds noted their versions in a table.
            let found = transaction.query_row("SELECT MAX(version) FROM schema_versions", [], |row| row.get(0));
            Err(found.map_or(StoreError::Foreign, |found| StoreError::OtherSchema { found }))
        }
    }
}

/// The studies of this build and arithmetic, the one that was asked for longest ago first. Of others those that run are computed again
/// from their beginning, and the rest is removed: this build would give other bits.
pub(super) fn load(transaction: &Transaction<'_>) -> rusqlite::Result<Vec<StoredStudy>> {
    let others = "origin <> ?1";
    let is_over = "(state <> 'running' OR done = chunks)";
    transaction
        .execute(&format!("DELETE FROM parts WHERE study IN (SELECT id FROM studies WHERE {others})"), [origin()])?;
    transaction.execute(&format!("DELETE FROM studies WHERE {others} AND {is_over}"), [origin()])?;
    let adopt = format!("UPDATE studies SET origin = ?1, done = 0, looked_at = 0, impossible = 0 WHERE {others}");
    transaction.execute(&adopt, [origin()])?;
    let mut statement = transaction.prepare(&format!("SELECT {STUDY} FROM studies ORDER BY asked_at_s"))?;
    statement.query_map([], stored_study)?.collect()
}

fn stored_study(row: &Row<'_>) -> rusqlite::Result<StoredStudy> {
    let (done, chunks): (u64, u64) = (row.get("done")?, row.get("chunks")?);
    Ok(StoredStudy {
        id: row.get("id")?,
        kind: row.get("kind")?,
        state: match row.get_ref("state")?.as_str()? {
            _ if done == chunks => StudyState::Done,
            "running" => StudyState::Running,
            "failed" => StudyState::Failed,
            _ => StudyState::Cancelled,
        },
        problem: row.get("problem")?,
        variants: row.get("variants")?,
        chunks,
        bytes: row.get("bytes")?,
        looked_at: row.get("looked_at")?,
        impossible: row.get("impossible")?,
        asked_at_s: row.get("asked_at_s")?,
        ends_at_s: row.get("ends_at_s")?,
    })
}

/// Lets a study run, from its beginning or from where it stands.
pub(super) fn begin(transaction: &Transaction<'_>, new: &NewStudy) -> rusqlite::Result<StoredStudy> {
    let text = format!(
        "
        INSERT INTO studies (id, kind, origin, state, variants, chunks, bytes, asked_at_s, ends_at_s, max_states, max_profile_points,
            document_hash, document)
        VALUES (:id, :kind, :origin, 'running', :variants, :chunks, :bytes, :asked_at_s, :ends_at_s, :max_states, :max_profile_points,
            :document_hash, :document)
        ON CONFLICT (id) DO UPDATE SET state = 'running', problem = NULL, variants = :variants, chunks = :chunks,
            ends_at_s = :ends_at_s, asked_at_s = :asked_at_s
        RETURNING {STUDY}"
    );
    let hash = blake3::hash(&new.document);
    let values = named_params! {
        ":id": new.id, ":kind": new.kind, ":origin": origin(), ":variants": new.variants, ":chunks": new.chunks, ":bytes": new.bytes,
        ":asked_at_s": now_s(), ":ends_at_s": new.ends_at_s, ":max_states": new.max_states,
        ":max_profile_points": new.max_profile_points, ":document_hash": hash.as_bytes(),
        ":document": new.document,
    };
    transaction.query_row(&text, values, stored_study)
}

/// Notes how a study stands that does not run any more, with the problem that it has.
pub(super) fn stop(
    transaction: &Transaction<'_>,
    id: &str,
    state: StudyState,
    problem: Option<&str>,
) -> rusqlite::Result<()> {
    let word = toothwave_calculation::json::word(&state);
    transaction.execute("UPDATE studies SET state = ?2, problem = ?3 WHERE id = ?1", params![id, word, problem])?;
    Ok(())
}

/// Notes that a study was asked for.
pub(super) fn touch(transaction: &Transaction<'_>, id: &str) -> rusqlite::Result<()> {
    transaction.execute("UPDATE studies SET asked_at_s = ?2 WHERE id = ?1", params![id, now_s()])?;
    Ok(())
}

/// Forgets a study with its parts.
pub(super) fn forget(transaction: &Transaction<'_>, id: &str) -> rusqlite::Result<()> {
    transaction.execute("DELETE FROM parts WHERE study = ?1", [id])?;
    transaction.execute("DELETE FROM studies WHERE id = ?1", [id])?;
    Ok(())
}

/// What a study asks, if it is there.
pub(super) fn document(transaction: &Transaction<'_>, id: &str) -> rusqlite::Result<Option<StoredDocument>> {
    let text = "SELECT document, document_hash, max_states, max_profile_points FROM studies WHERE id = ?1";
    let read = |row: &Row<'_>| {
        Ok(StoredDocument {
            text: row.get("document")?,
            hash: row.get("document_hash")?,
            max_states: row.get("max_states")?,
            max_profile_points: row.get("max_profile_points")?,
        })
    };
    transaction.query_row(text, [id], read).optional()
}

/// Keeps a part, in the place of one of another build, and counts it.
pub(super) fn keep(transaction: &Transaction<'_>, part: &NewPart) -> rusqlite::Result<()> {
    let text = "INSERT OR REPLACE INTO parts (study, chunk, origin, part) VALUES (?1, ?2, ?3, ?4)";
    transaction.prepare(text)?.execute(params![part.study, part.chunk, origin(), part.sealed])?;
    let text =
        "UPDATE studies SET done = done + 1, looked_at = looked_at + ?2, impossible = impossible + ?3 WHERE id = ?1";
    transaction.prepare(text)?.execute(params![part.study, part.variants, part.refused])?;
    Ok(())
}

/// The chunks of a study that have a part of this build.
pub(super) fn chunks_done(transaction: &Transaction<'_>, id: &str) -> rusqlite::Result<HashSet<u64>> {
    let mut statement = transaction.prepare("SELECT chunk FROM parts WHERE study = ?1 AND origin = ?2")?;
    statement.query_map(params![id, origin()], |row| row.get(0))?.collect()
}

/// Some of a study's sealed parts of this build, from this chunk on.
pub(super) fn parts(transaction: &Transaction<'_>, id: &str, from_chunk: u64) -> rusqlite::Result<Vec<(u64, Vec<u8>)>> {
    /// Few enough that others wait for the file for some milliseconds.
    const AT_ONCE: i64 = 16;
    let text = "SELECT chunk, part FROM parts WHERE study = ?1 AND origin = ?2 AND chunk >= ?3 ORDER BY chunk LIMIT ?4";
    let mut statement = transaction.prepare(text)?;
    let rows = statement.query_map(params![id, origin(), from_chunk, AT_ONCE], |row| Ok((row.get(0)?, row.get(1)?)))?;
    rows.collect()
}
