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
use serde_json::json;
use toothwave_calculation::json::word;
use toothwave_calculation::{origin, question};
use toothwave_study::Study;

use super::record::{Progress, StudyState};
use super::runner::damaged;
use crate::http::problem::{Problem, ProblemCode};
use crate::ops::config::Limits;

/// Marks a database as a file of studies: "toth".
const APPLICATION_ID: i64 = 0x746f_7468;

/// The schema of this build. Versions 1 to 4 were those of builds with workers.
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
    /// It is a database of another program.
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

/// A study as it is stored.
#[derive(Debug)]
pub(super) struct StoredStudy {
    pub(super) id: String,
    pub(super) state: StudyState,
    pub(super) problem: Option<Problem>,
    pub(super) progress: Progress,
    /// Seconds since 1970, as `ends_at_s`.
    pub(super) asked_at_s: u64,
    pub(super) ends_at_s: u64,
    max_states: u64,
    max_profile_points: u64,
    document_hash: [u8; blake3::OUT_LEN],
    document: Vec<u8>,
}

impl StoredStudy {
    /// A study that is requested now.
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
            state: match row.get_ref("state")?.as_str()? {
                "running" => StudyState::Running,
                "done" => StudyState::Done,
                "failed" => StudyState::Failed,
                _ => StudyState::Cancelled,
            },
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

    /// What the stored document requests. It was within the limits of the service when the study began.
    pub(super) fn read(&self) -> Result<Study, Problem> {
        if blake3::hash(&self.document) != self.document_hash {
            return Err(damaged(&self.id, "the document"));
        }
        let calculation = question::Limits::new(self.max_states, self.max_profile_points);
        let limits = toothwave_study::Limits { calculation, max_study_variants: u64::MAX, max_study_bytes: u64::MAX };
        Ok(Study::read(&self.document, &limits)?)
    }
}

/// A part that was computed.
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

/// An open file of studies.
#[derive(Debug, Clone)]
pub struct Store {
    connection: Arc<Mutex<Connection>>,
    is_in_memory: bool,
}

impl Store {
    /// Opens a file, which is created if it does not exist; without one, a database in memory.
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

    /// Whether the studies are lost at the end of the process.
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

    /// Writes the write-ahead log into the file. The process may exit before the connection is dropped, which would do the same.
    pub(super) fn merge_log(&self) {
        if let Err(error) = self.connection.lock().query_row("PRAGMA wal_checkpoint(TRUNCATE)", [], |_| Ok(())) {
            tracing::warn!(%error, "the write-ahead log stays beside the file of studies");
        }
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

/// All studies, the one that was requested longest ago first. Of other builds and other arithmetic, which give other bits, those that run
/// begin again. The rest of them is removed.
pub(super) fn load(transaction: &Transaction<'_>) -> rusqlite::Result<Vec<StoredStudy>> {
    let of_others = "DELETE FROM parts WHERE study IN (SELECT id FROM studies WHERE origin <> ?1)";
    transaction.execute(of_others, [origin()])?;
    transaction.execute("DELETE FROM studies WHERE origin <> ?1 AND state <> 'running'", [origin()])?;
    let begin_again = "UPDATE studies SET origin = ?1, variants = 0, impossible = 0 WHERE origin <> ?1";
    transaction.execute(begin_again, [origin()])?;
    let mut statement = transaction.prepare("SELECT * FROM studies ORDER BY asked_at_s")?;
    statement.query_map([], StoredStudy::of_row)?.collect()
}

/// The study with this id.
pub(super) fn study(transaction: &Transaction<'_>, id: &str) -> rusqlite::Result<Option<StoredStudy>> {
    transaction.query_row("SELECT * FROM studies WHERE id = ?1", [id], StoredStudy::of_row).optional()
}

/// Stores a study that runs from now on. If it has parts, it continues with them.
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

/// Stores that a study does not run any more.
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

/// Stores when a study was requested.
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

/// The chunks of a study that have a part.
pub(super) fn chunks_done(transaction: &Transaction<'_>, id: &str) -> rusqlite::Result<HashSet<u64>> {
    let mut statement = transaction.prepare("SELECT chunk FROM parts WHERE study = ?1")?;
    statement.query_map([id], |row| row.get(0))?.collect()
}

/// Some parts of a study, from this chunk on.
pub(super) fn parts(transaction: &Transaction<'_>, id: &str, from_chunk: u64) -> rusqlite::Result<Vec<(u64, Vec<u8>)>> {
    /// Few enough that others wait for the file for some milliseconds.
    const AT_ONCE: i64 = 16;
    let text = "SELECT chunk, part FROM parts WHERE study = ?1 AND chunk >= ?2 ORDER BY chunk LIMIT ?3";
    let mut statement = transaction.prepare(text)?;
    statement.query_map(params![id, from_chunk, AT_ONCE], |row| Ok((row.get(0)?, row.get(1)?)))?.collect()
}
