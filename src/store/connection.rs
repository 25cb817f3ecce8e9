//! Connections to either database, and what may go wrong with them.

use std::collections::HashSet;
use std::fs::OpenOptions;
use std::future::Future;
use std::os::unix::fs::OpenOptionsExt as _;
use std::path::Path;
use std::sync::Arc;
use std::sync::Mutex;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, SystemTime, UNIX_EPOCH};

use sqlx::pool::{PoolConnection, PoolOptions};
use sqlx::postgres::{PgConnectOptions, PgDatabaseError, PgPool, PgSeverity, Postgres};
use sqlx::sqlite::{Sqlite, SqliteConnectOptions, SqliteJournalMode, SqliteLockingMode, SqlitePool, SqliteSynchronous};

use sqlx::{ConnectOptions as _, Connection as _};

use crate::address::Address;
use crate::{LOCK_PATIENCE, PATIENCE, SILENCE};

/// A chunk by its study and its number.
pub(crate) type ChunkName = (String, u64);

/// A store of studies.
#[derive(Debug, Clone)]
pub struct Store {
    pub(crate) database: Database,
    address: Address,
    /// What this process is called in the store.
    pub(crate) worker: Arc<str>,
    /// Counts its attempts, from a number that no process of the same name had before.
    attempts: Arc<AtomicU64>,
}

#[derive(Debug, Clone)]
pub(crate) enum Database {
    /// One connection: the file belongs to it alone. The leases are this process's own.
    File { pool: SqlitePool, leased: Arc<Mutex<HashSet<ChunkName>>> },
    /// Those of leases are held while a chunk is computed; the others pass from hand to hand.
    Server { pool: PgPool, leases: PgPool },
}

/// A connection to either database.
#[derive(Debug)]
pub(crate) enum Connection {
    File(PoolConnection<Sqlite>),
    Server(PoolConnection<Postgres>),
}

/// The same statements for both databases.
macro_rules! on {
    ($connection:expr, $inner:ident => $body:expr) => {
        match $connection {
            $crate::connection::Connection::File($inner) => {
                let $inner = &mut **$inner;
                $body
            }
            $crate::connection::Connection::Server($inner) => {
                let $inner = &mut **$inner;
                $body
            }
        }
    };
}
pub(crate) use on;

/// Why a store did not do what it was asked.
#[derive(Debug, thiserror::Error)]
pub enum StoreError {
    /// Nobody answers, or the server says no.
    #[error("the studies' store fails: {0}")]
    Failed(#[source] sqlx::Error),
    /// It was silent for too long.
    #[error("the studies' store did not answer within {} s", .0.as_secs())]
    Silent(Duration),
    /// Another session has a lock on what was asked for, and the server waited for it as long as it is told to.
    #[error("another session holds what is wanted of the studies' store, and does not let go of it")]
    Locked,
    /// The database has another schema than this build works with.
    #[error("the studies' store has schema {found}, and this build works with {}: {}", crate::SCHEMA_VERSION, if *found < crate::SCHEMA_VERSION { "`toothwave migrate` brings it there" } else { "a newer build is needed" })]
    OtherSchema {
        /// What it has; 0 for none.
        found: u64,
    },
    /// Another process has the file.
    #[error(
        "another process has the studies' file {0}: a file serves one process; several of them share a PostgreSQL database"
    )]
    InUse(String),
    /// Somebody keeps something else there.
    #[error("{0} is a database of something else: name a file that is not there yet")]
    Foreign(String),
    /// A worker has a chunk in its hands, and does not let go.
    #[error("a worker computes a chunk of the study and does not let go of it; try again once its lease is over")]
    InWork,
    /// A file knows no workers elsewhere.
    #[error("{0} is a file, which serves one process: workers share a PostgreSQL database")]
    NotShared(String),
}

/// PostgreSQL, appendix A.
pub(crate) const LOCK_NOT_AVAILABLE: &str = "55P03";

impl StoreError {
    /// Whether what was asked may have been done, or be done yet: nobody said that it was not.
    pub fn leaves_open(&self) -> bool {
        match self {
            Self::Silent(_) => true,
            Self::Failed(sqlx::Error::PoolClosed) => false,
            Self::Failed(sqlx::Error::Database(error)) => match error.try_downcast_ref::<PgDatabaseError>() {
                // What is an error was not done; with these the session ends, at whatever it was.
                Some(error) => matches!(error.severity(), PgSeverity::Fatal | PgSeverity::Panic),
                None => error.code().is_some_and(|code| is_of_file(&code)),
            },
            Self::Failed(_) => true,
            _ => false,
        }
    }
}

impl From<sqlx::Error> for StoreError {
    fn from(error: sqlx::Error) -> Self {
        match error {
            // Of the pools' own patience, which is as long.
            sqlx::Error::PoolTimedOut => Self::Silent(PATIENCE),
            sqlx::Error::Database(refused) if refused.code().as_deref() == Some(LOCK_NOT_AVAILABLE) => Self::Locked,
            error => Self::Failed(error),
        }
    }
}

/// Connections that are not leases: few statements, each over soon.
const CONNECTIONS: u32 = 8;

/// A session that was not used for so long is closed: others may want it, leases among them, of whom a server takes so many.
const IDLE: Duration = Duration::from_secs(5);

/// More than any machine computes chunks side by side.
const MOST_LEASES: u32 = 1024;

impl Store {
    /// The store at an address; a server is not connected to before it is needed.
    ///
    /// # Errors
    /// Where a file cannot be opened, is another process's or something else's, or has a schema of a newer build.
    pub async fn open(address: &Address) -> Result<Self, StoreError> {
        let worker = worker_name().into();
        let attempts = Arc::new(AtomicU64::new(nanoseconds_now()));
        match address {
            Address::File(path) => {
                make_private(path);
                if is_foreign(path).await {
                    return Err(StoreError::Foreign(address.to_string()));
                }
                let options = SqliteConnectOptions::new()
                    .filename(path)
                    .create_if_missing(true)
                    // Whatever was committed outlives the process, and the machine too.
                    .journal_mode(SqliteJournalMode::Wal)
                    .synchronous(SqliteSynchronous::Full)
                    .locking_mode(SqliteLockingMode::Exclusive)
                    .foreign_keys(true)
                    .busy_timeout(Duration::from_secs(1))
                    .disable_statement_logging();
                let pool = PoolOptions::<Sqlite>::new()
                    .max_connections(1)
                    .idle_timeout(None)
                    .max_lifetime(None)
                    .acquire_timeout(PATIENCE)
                    // Whoever had it may have failed, or left, in the middle of a transaction. Where none was begun there is nothing to be
                    // undone, which is an error of no interest.
                    .after_release(|connection, _| {
                        Box::pin(async move {
                            drop(sqlx::query("ROLLBACK").execute(connection).await);
                            Ok(true)
                        })
                    })
                    .connect_with(options)
                    .await
                    .map_err(|error| in_use(error, address))?;
                let store = Self {
                    database: Database::File { pool, leased: Arc::default() },
                    address: address.clone(),
                    worker,
                    attempts,
                };
                store.migrate().await.map_err(|error| match error {
                    StoreError::Failed(error) => in_use(error, address),
                    other => other,
                })?;
                Ok(store)
            }
            Address::Server(options) => {
                let options = options.as_ref().clone().application_name("toothwave").disable_statement_logging();
                // A lease's session waits for its worker; the server ends it when that takes too long.
                let leases = options.clone().application_name("toothwave lease");
                let leases = sessions(MOST_LEASES, leases);
                let pool = sessions(CONNECTIONS, options);
                Ok(Self { database: Database::Server { pool, leases }, address: address.clone(), worker, attempts })
            }
        }
    }

    /// What the next attempt of this process is called.
    pub(crate) fn attempt_name(&self) -> String {
        format!("{}#{:x}", self.worker, self.attempts.fetch_add(1, Ordering::Relaxed))
    }

    /// Where it is.
    pub const fn address(&self) -> &Address {
        &self.address
    }

    /// What is done with a connection, within the patience that one has for it, the wait for the connection included; but for that nobody
    /// waits longer than one does for a silent server. What a connection was left in the middle of, by an error or by whoever waits no
    /// longer, is undone: that of a file by its pool, a server's by closing it.
    pub(crate) async fn with<T>(
        &self,
        patience: Duration,
        job: impl AsyncFnOnce(&mut Connection) -> Result<T, StoreError>,
    ) -> Result<T, StoreError> {
        within(patience, async {
            let connection = within(PATIENCE, async {
                Ok(match &self.database {
                    Database::File { pool, .. } => Connection::File(pool.acquire().await?),
                    Database::Server { pool, .. } => Connection::Server(pool.acquire().await?),
                })
            })
            .await?;
            let mut borrowed = Borrowed { connection, is_at_rest: false };
            let done = job(&mut borrowed.connection).await;
            borrowed.is_at_rest = done.is_ok();
            done
        })
        .await
    }

    /// Closes all connections: a file is free for others then.
    pub async fn close(&self) {
        match &self.database {
            Database::File { pool, .. } => pool.close().await,
            Database::Server { pool, leases } => {
                pool.close().await;
                leases.close().await;
            }
        }
    }
}

/// Sessions that the server frees of whoever left them. One that is cut off, or stands still, in the middle of a transaction has it ended, and
/// one that waits for a lock is told so before its client gives up: the server does not look whether anybody still waits for the answer, would
/// keep a process for it, and would do in the end what was believed to have failed. Of a host that is gone without a word it ends them within a minute. Said in each session: there
/// are those between who take no such options when a connection is made.
fn sessions(most: u32, options: PgConnectOptions) -> PgPool {
    let text =
        "SELECT set_config('idle_in_transaction_session_timeout', $1, FALSE), set_config('lock_timeout', $2, FALSE),
        set_config('tcp_keepalives_idle', '30', FALSE), set_config('tcp_keepalives_interval', '10', FALSE),
        set_config('tcp_keepalives_count', '3', FALSE)";
    PoolOptions::new()
        .max_connections(most)
        .idle_timeout(IDLE)
        .acquire_timeout(PATIENCE)
        .after_connect(move |session, _| {
            Box::pin(async move {
                let limits = sqlx::query(text).bind(milliseconds(SILENCE)).bind(milliseconds(LOCK_PATIENCE));
                limits.execute(session).await.map(|_| ())
            })
        })
        .connect_lazy_with(options)
}

/// As PostgreSQL's settings are given.
pub(crate) fn milliseconds(time: Duration) -> String {
    time.as_millis().to_string()
}

/// A connection that is not given back in the middle of anything.
struct Borrowed {
    connection: Connection,
    is_at_rest: bool,
}

impl Drop for Borrowed {
    fn drop(&mut self) {
        if let (Connection::Server(connection), false) = (&mut self.connection, self.is_at_rest) {
            connection.close_on_drop();
        }
    }
}

/// What comes of a future in time.
pub(crate) async fn within<T>(
    patience: Duration,
    future: impl Future<Output = Result<T, StoreError>>,
) -> Result<T, StoreError> {
    tokio::time::timeout(patience, future).await.unwrap_or(Err(StoreError::Silent(patience)))
}

/// A new file is its owner's alone, and so is what SQLite puts beside it: it holds designs. One that is there keeps the mode that it was
/// given; where none can be made SQLite says why.
fn make_private(path: &Path) {
    let _ = OpenOptions::new().write(true).create_new(true).mode(0o600).open(path);
}

/// Whether SQLite's file could not be read or written: what was to be committed may be in its log all the same.
fn is_of_file(code: &str) -> bool {
    const IO_ERROR: u64 = 10;
    code.parse::<u64>().is_ok_and(|code| code & 0xff == IO_ERROR)
}

/// Whether a file is a database of something else. It is only read: what a connection of ours asks for changes it.
async fn is_foreign(path: &Path) -> bool {
    let options = SqliteConnectOptions::new().filename(path).read_only(true).disable_statement_logging();
    let tables = async {
        let mut connection = options.connect().await?;
        let tables = sqlx::query_scalar("SELECT name FROM sqlite_schema WHERE type = 'table'");
        let tables: Vec<String> = tables.fetch_all(&mut connection).await?;
        connection.close().await?;
        Ok::<_, sqlx::Error>(tables)
    };
    // Where it cannot be read that is said of it when it is opened.
    let tables = tables.await.unwrap_or_default();
    let has = |name: &str| tables.iter().any(|table| table == name);
    let is_ours = tables.is_empty() || (has("studies") && has("schema_versions"));
    !is_ours
}

/// Since 1970.
fn nanoseconds_now() -> u64 {
    let now = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
    u64::try_from(now.as_nanos()).unwrap_or_default()
}

/// SQLite's word for a file that somebody else has.
fn in_use(error: sqlx::Error, address: &Address) -> StoreError {
    let is_locked = error.as_database_error().is_some_and(|error| error.message().contains("database is locked"));
    if is_locked { StoreError::InUse(address.to_string()) } else { error.into() }
}

/// Machine and process, for whoever looks into the store.
fn worker_name() -> String {
    let host = std::fs::read_to_string("/proc/sys/kernel/hostname").unwrap_or_default();
    format!("{}:{}", host.trim(), std::process::id())
}
