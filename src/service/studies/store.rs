//! The database of studies: an SQLite file that one process opens at a time, or a database in memory.

use std::collections::HashSet;
use std::path::Path;
use std::sync::Arc;
use std::time::{SystemTime, UNIX_EPOCH};

use parking_lot::Mutex;
use rusqlite::{
    Connection, ErrorCode, OpenFlags, OptionalExtension as _, Row, Transaction, TransactionBehavior, named_params,
    params,
};
use serde_json::json;
use toothwave_calculation::json::word;
use toothwave_calculation::{origin, question};
use toothwave_study::Study;

use super::state::{Progress, StudyState};
use crate::http::problem::{Problem, ProblemCode};
use crate::ops::config::Limits;
use crate::unix::create_private;

/// Marks a database as a study database: "toth".
const APPLICATION_ID: i64 = 0x746f_7468;

/// Schema version of this build. Versions 1 to 4 belong to builds with workers.
const SCHEMA_VERSION: i64 = 5;

/// The long columns are last, so that the others are read without them.
const SCHEMA: &str = "
CREATE TABLE studies (
    id TEXT PRIMARY KEY,
    origin TEXT NOT NULL,
    state TEXT NOT NULL,
    problem TEXT,
    variants INTEGER NOT NULL DEFAULT 0,
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
    part BLOB NOT NULL,
    PRIMARY KEY (study, chunk)
) STRICT;
";

/// Error of the study database.
#[derive(Debug, thiserror::Error)]
pub enum StoreError {
    /// An SQLite error, for example that the disk is full.
    #[error("the study database failed: {0}")]
    Failed(rusqlite::Error),
    /// The thread of the transaction ended.
    #[error("the thread of the study database ended")]
    Silent,
    /// The content is damaged.
    #[error("the study database is damaged: {0}. Restore it from a backup, or start with a new file.")]
    Damaged(rusqlite::Error),
    /// Another process has the file open.
    #[error("another process has the study database open. Use one file for each process.")]
    InUse,
    /// Another version of toothwave wrote the file.
    #[error(
        "the study database has schema {found}, but this build needs schema {SCHEMA_VERSION}. Start with a new file."
    )]
    OtherSchema {
        /// The schema version of the file.
        found: i64,
    },
    /// The file is a database of another program.
    #[error("the file is a database of another program. Name a file that does not exist yet.")]
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

/// Converts to a problem for the client. The log gets SQLite's message.
impl From<StoreError> for Problem {
    fn from(error: StoreError) -> Self {
        tracing::warn!(%error, "the study database failed");
        match error {
            StoreError::Damaged(_) => Self::internal(&error),
            StoreError::Failed(failed) if failed.sqlite_error_code() == Some(ErrorCode::DiskFull) => {
                let detail = "the disk of the study database is full. Retry when it has free space";
                Self::new(ProblemCode::StoreUnavailable, detail)
            }
            _ => {
                let detail = "the study database cannot be read or written. Retry after 1 s";
                Self::new(ProblemCode::StoreUnavailable, detail)
            }
        }
    }
}

/// A study as it is stored.
#[derive(Debug)]
pub(super) struct StoredStudy {
    pub(super) id: String,
    pub(super) state: StudyState,
    pub(super) problem: Option<Problem>,
    pub(super) progress: Progress,
    /// Seconds since 1970, as is `ends_at_s`.
    pub(super) asked_at_s: u64,
    pub(super) ends_at_s: u64,
    max_states: u64,
    max_profile_points: u64,
    document_hash: [u8; blake3::OUT_LEN],
    document: Vec<u8>,
}

impl StoredStudy {
    /// Makes a new study that runs from now on.
    pub(super) fn new(study: &Study, document: &[u8], limits: &Limits) -> Self {
        let (now_s, most) = (now_s(), i64::MAX.unsigned_abs());
        Self {
            id: study.id().to_string(),
            state: StudyState::Running,
            problem: None,
            progress: Progress::default(),
            asked_at_s: now_s,
            ends_at_s: now_s.saturating_add(limits.study_deadline_ms.div_ceil(1000)).min(most),
            max_states: limits.max_states.min(most),
            max_profile_points: limits.max_profile_points.min(most),
            document_hash: blake3::hash(document).into(),
            document: document.into(),
        }
    }

    fn of_row(row: &Row<'_>) -> rusqlite::Result<Self> {
        let problem: Option<String> = row.get("problem")?;
        Ok(Self {
            id: row.get("id")?,
            state: serde_json::from_value(row.get::<_, String>("state")?.into()).unwrap_or(StudyState::Cancelled),
            problem: problem
                .and_then(|text| serde_json::from_str(&text).ok())
                .map(|(code, detail): (_, String)| Problem::new(code, detail)),
            progress: Progress { variants: row.get("variants")?, impossible: row.get("impossible")? },
            asked_at_s: row.get("asked_at_s")?,
            ends_at_s: row.get("ends_at_s")?,
            max_states: row.get("max_states")?,
            max_profile_points: row.get("max_profile_points")?,
            document_hash: row.get("document_hash")?,
            document: row.get("document")?,
        })
    }

    /// Parses the stored document. It was within the limits of the service when the study began.
    pub(super) fn read(&self) -> Result<Study, Problem> {
        if blake3::hash(&self.document) != self.document_hash {
            return Err(damaged(&self.id, "the document"));
        }
        let calculation = question::Limits::new(self.max_states, self.max_profile_points);
        let limits = toothwave_study::Limits { calculation, max_study_variants: u64::MAX, max_study_bytes: u64::MAX };
        Ok(Study::read(&self.document, &limits)?)
    }
}

/// A computed part.
#[derive(Debug)]
pub(super) struct NewPart {
    pub(super) study: String,
    pub(super) chunk: u64,
    pub(super) progress: Progress,
    pub(super) bytes: Vec<u8>,
}

/// Seconds since 1970.
pub(super) fn now_s() -> u64 {
    SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default().as_secs()
}

/// An open study database.
#[derive(Debug, Clone)]
pub struct Store {
    connection: Arc<Mutex<Connection>>,
    is_in_memory: bool,
}

impl Store {
    /// Opens a file, or creates it if it does not exist. Without a file it opens a database in memory.
    pub fn open(file: Option<&Path>) -> Result<Self, StoreError> {
        let mut connection = match file {
            Some(file) => {
                // Other users must not read the file. If this fails, SQLite reports why.
                let _ = create_private(file);
                Connection::open_with_flags(file, OpenFlags::SQLITE_OPEN_READ_WRITE | OpenFlags::SQLITE_OPEN_CREATE)?
            }
            None => Connection::open_in_memory()?,
        };
        connection.pragma_update(None, "locking_mode", "EXCLUSIVE")?;
        let transaction = connection.transaction_with_behavior(TransactionBehavior::Immediate)?;
        require_schema(&transaction)?;
        transaction.commit()?;
        // A commit survives the process. After a power cut the last ones may be missing, and are computed again.
        connection.pragma_update_and_check(None, "journal_mode", "WAL", |_| Ok(()))?;
        connection.pragma_update(None, "synchronous", "NORMAL")?;
        Ok(Self { connection: Arc::new(Mutex::new(connection)), is_in_memory: file.is_none() })
    }

    /// True if the studies are lost at the end of the process.
    pub(super) const fn is_in_memory(&self) -> bool {
        self.is_in_memory
    }

    /// Runs a short transaction on a blocking thread. It completes even if the future is dropped.
    pub(super) async fn with<T: Send + 'static>(
        &self,
        work: impl FnOnce(&Transaction<'_>) -> rusqlite::Result<T> + Send + 'static,
    ) -> Result<T, StoreError> {
        let store = self.clone();
        tokio::task::spawn_blocking(move || store.now(work)).await.unwrap_or(Err(StoreError::Silent))
    }

    /// Writes the write-ahead log into the file: the process may exit before the connection is dropped.
    pub(super) fn merge_log(&self) {
        if let Err(error) = self.connection.lock().query_row("PRAGMA wal_checkpoint(TRUNCATE)", [], |_| Ok(())) {
            tracing::warn!(%error, "cannot merge the write-ahead log into the study database");
        }
    }

    /// Runs a short transaction on this thread.
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
            // Earlier builds stored their version in a table.
            let found = transaction.query_row("SELECT MAX(version) FROM schema_versions", [], |row| row.get(0));
            Err(found.map_or(StoreError::Foreign, |found| StoreError::OtherSchema { found }))
        }
    }
}

/// Loads all studies, in the order of their latest request. Another build or arithmetic gives other bits. Its running
/// studies begin again, and its other studies and parts are removed.
pub(super) fn load(transaction: &Transaction<'_>) -> rusqlite::Result<Vec<StoredStudy>> {
    let of_others = "DELETE FROM parts WHERE study IN (SELECT id FROM studies WHERE origin <> ?1)";
    transaction.execute(of_others, [origin()])?;
    transaction.execute("DELETE FROM studies WHERE origin <> ?1 AND state <> 'running'", [origin()])?;
    let begin_again = "UPDATE studies SET origin = ?1, variants = 0, impossible = 0 WHERE origin <> ?1";
    transaction.execute(begin_again, [origin()])?;
    let mut statement = transaction.prepare("SELECT * FROM studies ORDER BY asked_at_s")?;
    statement.query_map([], StoredStudy::of_row)?.collect()
}

/// Returns the study with this id.
pub(super) fn study(transaction: &Transaction<'_>, id: &str) -> rusqlite::Result<Option<StoredStudy>> {
    transaction.query_row("SELECT * FROM studies WHERE id = ?1", [id], StoredStudy::of_row).optional()
}

/// Stores a study as running. If it has parts, it continues with them.
pub(super) fn begin(transaction: &Transaction<'_>, study: StoredStudy) -> rusqlite::Result<StoredStudy> {
    let text = "
        INSERT INTO studies (id, origin, state, asked_at_s, ends_at_s, max_states, max_profile_points, document_hash, document)
        VALUES (:id, :origin, 'running', :asked_at_s, :ends_at_s, :max_states, :max_profile_points, :document_hash, :document)
        ON CONFLICT (id) DO UPDATE SET state = 'running', problem = NULL, asked_at_s = :asked_at_s, ends_at_s = :ends_at_s
        RETURNING *";
    let values = named_params! {
        ":id": study.id, ":origin": origin(), ":asked_at_s": study.asked_at_s, ":ends_at_s": study.ends_at_s,
        ":max_states": study.max_states, ":max_profile_points": study.max_profile_points,
        ":document_hash": study.document_hash, ":document": study.document,
    };
    transaction.query_row(text, values, StoredStudy::of_row)
}

/// Stores the end of a study.
pub(super) fn end(
    transaction: &Transaction<'_>,
    id: &str,
    state: StudyState,
    problem: Option<Problem>,
) -> rusqlite::Result<()> {
    let problem = problem.map(|Problem { code, detail, .. }| json!([code, detail]).to_string());
    let text = "UPDATE studies SET state = ?2, problem = ?3 WHERE id = ?1";
    transaction.execute(text, params![id, word(&state), problem])?;
    Ok(())
}

/// Stores the time of a study's latest request.
pub(super) fn set_asked_at(transaction: &Transaction<'_>, id: &str, asked_at_s: u64) -> rusqlite::Result<()> {
    transaction.execute("UPDATE studies SET asked_at_s = ?2 WHERE id = ?1", params![id, asked_at_s])?;
    Ok(())
}

/// Removes a study with its parts.
pub(super) fn remove(transaction: &Transaction<'_>, id: &str) -> rusqlite::Result<()> {
    transaction.execute("DELETE FROM parts WHERE study = ?1", [id])?;
    transaction.execute("DELETE FROM studies WHERE id = ?1", [id])?;
    Ok(())
}

/// Stores a part.
pub(super) fn insert_part(transaction: &Transaction<'_>, part: &NewPart) -> rusqlite::Result<()> {
    let NewPart { study, chunk, progress: Progress { variants, impossible }, bytes } = part;
    // A run that the deadline ended may have stored the same part.
    let text = "INSERT OR IGNORE INTO parts VALUES (?1, ?2, ?3)";
    if transaction.execute(text, params![study, chunk, bytes])? == 1 {
        let text = "UPDATE studies SET variants = variants + ?2, impossible = impossible + ?3 WHERE id = ?1";
        transaction.execute(text, params![study, variants, impossible])?;
    }
    Ok(())
}

/// Returns the chunks of a study that have a part.
pub(super) fn chunks_done(transaction: &Transaction<'_>, id: &str) -> rusqlite::Result<HashSet<u64>> {
    let mut statement = transaction.prepare("SELECT chunk FROM parts WHERE study = ?1")?;
    statement.query_map([id], |row| row.get(0))?.collect()
}

/// Returns some parts of a study, from this chunk on.
pub(super) fn parts(transaction: &Transaction<'_>, id: &str, from_chunk: u64) -> rusqlite::Result<Vec<(u64, Vec<u8>)>> {
    /// Rows of one query. Others wait for the database for a few milliseconds at most.
    const AT_ONCE: i64 = 16;
    let text = "SELECT chunk, part FROM parts WHERE study = ?1 AND chunk >= ?2 ORDER BY chunk LIMIT ?3";
    let mut statement = transaction.prepare(text)?;
    statement.query_map(params![id, from_chunk, AT_ONCE], |row| Ok((row.get(0)?, row.get(1)?)))?.collect()
}

/// Returns the problem of a study with damaged stored content.
pub(super) fn damaged(id: &str, what: &str) -> Problem {
    let detail = "the stored study is damaged. Delete it and request it again";
    let cause = format!("the study {id} is damaged in its file: {what}");
    Problem { cause: Some(cause), ..Problem::new(ProblemCode::InternalError, detail) }
}
