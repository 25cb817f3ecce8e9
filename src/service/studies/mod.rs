//! Studies run in this process and are stored in an SQLite file, or in memory.
//!
//! This module has a record for every study. The database has their documents and parts. After a restart, running
//! studies continue.

mod part_bytes;
mod record;
mod runner;
mod state;
mod store;

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use parking_lot::Mutex;
use tokio::time::timeout;
use tokio_util::sync::CancellationToken;
use tokio_util::task::TaskTracker;
use toothwave_study::{Study, StudyAnswer};
use tracing::Instrument as _;

pub use self::record::{StudyRecord, StudyResource};
use self::runner::Run;
pub use self::state::StudyState;
pub use self::store::{Store, StoreError};
use self::store::{StoredStudy, now_s};
use crate::compute::pool::Pool;
use crate::http::problem::{Problem, ProblemCode};
use crate::ops::config::Limits;

/// Interval at which expired studies are removed.
const EXPIRY_CHECK: Duration = Duration::from_secs(60);

/// Storage of the studies.
#[derive(Debug)]
pub struct Storage {
    /// The database.
    pub store: Store,
    /// Time without a request after which a study is removed.
    pub expiry: Duration,
}

/// The studies of the service.
#[derive(Debug)]
pub struct Studies {
    pool: Pool,
    limits: Limits,
    storage: Option<Storage>,
    /// Ordered by their latest `POST`, the oldest first.
    records: Mutex<Vec<Arc<StudyRecord>>>,
    /// Held while a study begins, is cancelled or is removed.
    changes: tokio::sync::Mutex<()>,
    runs: TaskTracker,
    /// Cancelled when the service stops.
    closing: CancellationToken,
}

impl Studies {
    /// Makes an empty list of studies. Without a storage it stays empty.
    pub fn new(pool: Pool, limits: Limits, storage: Option<Storage>) -> Self {
        Self {
            pool,
            limits,
            storage,
            records: Mutex::default(),
            changes: tokio::sync::Mutex::default(),
            runs: TaskTracker::new(),
            closing: CancellationToken::new(),
        }
    }

    /// Loads the stored studies and continues running ones. Removes expired and damaged ones.
    pub async fn load(&self) -> Result<(), StoreError> {
        let Some(Storage { store, .. }) = &self.storage else { return Ok(()) };
        for stored in store.with(store::load).await? {
            match stored.read() {
                Ok(study) => drop(self.insert(store, stored, study)),
                Err(problem) => {
                    tracing::error!(study = stored.id, %problem, cause = problem.cause, "removed an unreadable study");
                    store.with(move |transaction| store::remove(transaction, &stored.id)).await?;
                }
            }
        }
        self.remove_expired().await;
        Ok(())
    }

    /// Returns the number of running studies.
    pub fn running(&self) -> usize {
        self.records.lock().iter().filter(|record| record.is_running()).count()
    }

    fn storage(&self) -> Result<&Storage, Problem> {
        self.storage.as_ref().ok_or_else(|| {
            let detail = "this service has no studies, because it was started with `--studies off`. Start it with `--studies FILE`";
            Problem::new(ProblemCode::StudiesOff, detail)
        })
    }

    fn record(&self, id: &str) -> Option<Arc<StudyRecord>> {
        self.records.lock().iter().find(|record| record.id == id).cloned()
    }

    /// Returns the study with this id, and sets the time of its latest request.
    pub fn find(&self, id: &str) -> Result<Option<Arc<StudyRecord>>, Problem> {
        self.storage()?;
        Ok(self.record(id).inspect(|record| self.touch(record)))
    }

    /// Sets the time of the latest request to now. Storing it runs in the background.
    pub fn touch(&self, record: &StudyRecord) {
        let Some(Storage { store, .. }) = &self.storage else { return };
        let now_s = now_s();
        if record.asked_at_s.swap(now_s, Ordering::Relaxed) == now_s {
            return;
        }
        let (store, id) = (store.clone(), record.id.clone());
        self.runs.spawn(async move {
            if let Err(error) = store.with(move |transaction| store::set_asked_at(transaction, &id, now_s)).await {
                tracing::warn!(%error, "cannot store the time of a study's latest request");
            }
        });
    }

    /// Begins or continues a study, and returns its record. A finished one is returned as it is. Fails with
    /// `queue_full` if too many studies run, or if memory has no space for another one.
    pub async fn begin(&self, study: Study, document: &[u8]) -> Result<Arc<StudyRecord>, Problem> {
        let Storage { store, .. } = self.storage()?;
        let id = study.id().to_string();
        let _one_at_a_time = self.changes.lock().await;
        if let Some(record) = self.find(&id)?
            && matches!(record.state(), StudyState::Running | StudyState::Done)
        {
            let mut records = self.records.lock();
            records.retain(|other| other.id != id);
            records.push(Arc::clone(&record));
            return Ok(record);
        }
        let most = self.limits.max_concurrent_studies;
        if self.running() >= most {
            let detail = format!("{most} studies run, which is the limit. Retry after 1 s, or cancel one");
            return Err(Problem::new(ProblemCode::QueueFull, detail));
        }
        if store.is_in_memory() {
            for oldest in self.to_remove_for(&study)? {
                self.remove(store, &oldest).await?;
            }
        }
        let stored = StoredStudy::new(&study, document, &self.limits);
        let stored = store.with(move |transaction| store::begin(transaction, stored)).await?;
        Ok(self.insert(store, stored, study))
    }

    /// Returns the oldest studies that must leave memory for another one: as few as possible, and no running ones.
    fn to_remove_for(&self, study: &Study) -> Result<Vec<Arc<StudyRecord>>, Problem> {
        let (id, bytes, most_bytes) = (study.id().to_string(), record::bytes(study), self.limits.max_study_bytes);
        let others = self.records.lock().iter().filter(|record| record.id != id).cloned().collect::<Vec<_>>();
        let (running, idle): (Vec<_>, Vec<_>) = others.into_iter().partition(|record| record.is_running());
        let sum = |records: &[Arc<StudyRecord>]| records.iter().map(|record| record.bytes()).sum::<u64>();
        let needed_bytes = bytes + sum(&running);
        if needed_bytes > most_bytes {
            let detail = format!(
                "the study needs {bytes} bytes, and with the running studies this exceeds `max_study_bytes` ({most_bytes} bytes). Retry when one of them is done"
            );
            return Err(Problem::new(ProblemCode::QueueFull, detail));
        }
        let mut all_bytes = needed_bytes + sum(&idle);
        let is_needed = |record: &Arc<StudyRecord>| {
            let is_needed = all_bytes > most_bytes;
            all_bytes -= record.bytes();
            is_needed
        };
        Ok(idle.into_iter().take_while(is_needed).collect())
    }

    /// Adds the record of a study in place of an earlier one, and runs the study if its state is running.
    fn insert(&self, store: &Store, stored: StoredStudy, study: Study) -> Arc<StudyRecord> {
        let time = Duration::from_secs(stored.ends_at_s.saturating_sub(now_s()));
        let record = Arc::new(StudyRecord::new(stored, &study, self.closing.child_token()));
        let mut records = self.records.lock();
        records.retain(|other| other.id != record.id);
        records.push(Arc::clone(&record));
        if record.is_running() {
            let (store, pool) = (store.clone(), self.pool.clone());
            let run = Run { store, pool, record: Arc::clone(&record), study: Arc::new(study), time };
            self.runs.spawn(run.complete(self.closing.clone()).in_current_span());
        }
        record
    }

    /// Cancels a running study, or removes another one. Returns false if the id is unknown.
    pub async fn cancel_or_remove(&self, id: &str) -> Result<bool, Problem> {
        let Storage { store, .. } = self.storage()?;
        let _one_at_a_time = self.changes.lock().await;
        let Some(record) = self.record(id) else { return Ok(false) };
        if !record.is_running() {
            self.remove(store, &record).await?;
            return Ok(true);
        }
        record.stop.cancel();
        tokio::select! {
            () = record.ended() => Ok(true),
            () = self.closing.cancelled() => {
                let detail = "the service is stopping, and the study continues after the restart. Cancel it then";
                Err(Problem::new(ProblemCode::ShuttingDown, detail))
            }
        }
    }

    async fn remove(&self, store: &Store, record: &Arc<StudyRecord>) -> Result<(), StoreError> {
        let id = record.id.clone();
        store.with(move |transaction| store::remove(transaction, &id)).await?;
        self.records.lock().retain(|other| !Arc::ptr_eq(other, record));
        Ok(())
    }

    /// Computes the answer from the stored parts, on this thread. Fails if the database fails or is damaged, if the
    /// study was removed, or if `stop` is set.
    pub fn answer(&self, record: &StudyRecord, stop: &AtomicBool) -> Result<StudyAnswer, Problem> {
        runner::answer(&self.storage()?.store, record, stop)
    }

    /// Removes expired studies at intervals until the service stops.
    pub async fn keep_removing_expired(&self) {
        while timeout(EXPIRY_CHECK, self.closing.cancelled()).await.is_err() {
            self.remove_expired().await;
        }
    }

    async fn remove_expired(&self) {
        let Some(Storage { store, expiry }) = &self.storage else { return };
        let since_s = now_s().saturating_sub(expiry.as_secs());
        let _one_at_a_time = self.changes.lock().await;
        let is_old = |record: &StudyRecord| !record.is_running() && record.asked_at_s.load(Ordering::Relaxed) < since_s;
        let old: Vec<_> = self.records.lock().iter().filter(|record| is_old(record)).cloned().collect();
        for record in old {
            match self.remove(store, &record).await {
                Ok(()) => tracing::info!(study = record.id, "removed an expired study"),
                Err(error) => tracing::warn!(%error, study = record.id, "cannot remove an expired study"),
            }
        }
    }

    /// Stops all studies, and ends all waits for them. The studies continue after a restart.
    pub fn close(&self) {
        self.closing.cancel();
        self.runs.close();
    }

    /// Completes when all studies have stopped and the database is written.
    pub async fn closed(&self) {
        self.runs.wait().await;
        if let Some(Storage { store, .. }) = &self.storage {
            store.merge_log();
        }
    }

    /// Token that is cancelled when the service stops.
    pub const fn closing(&self) -> &CancellationToken {
        &self.closing
    }
}
