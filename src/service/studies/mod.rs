//! The studies of the service. They run in this process and are stored in an SQLite file, or in memory.
//!
//! This module has the record of every study. The file has their documents and parts. After a restart, studies that ran continue.

mod part_bytes;
mod record;
mod runner;
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

pub use self::record::{StudyRecord, StudyResource, StudyState};
use self::runner::Run;
pub use self::store::{Store, StoreError};
use self::store::{StoredStudy, now_s};
use crate::compute::pool::Pool;
use crate::http::problem::{Problem, ProblemCode};
use crate::ops::config::Limits;

/// Time between two removals of expired studies.
const EXPIRY_CHECK: Duration = Duration::from_secs(60);

/// Where studies are stored.
#[derive(Debug)]
pub struct Storage {
    /// The file.
    pub store: Store,
    /// After this time without a request a study is removed.
    pub expiry: Duration,
}

/// The studies of the service.
#[derive(Debug)]
pub struct Studies {
    pool: Pool,
    limits: Limits,
    storage: Option<Storage>,
    /// In the order of their latest `POST`, the oldest first.
    records: Mutex<Vec<Arc<StudyRecord>>>,
    /// Held while a study begins, is cancelled or is removed: one at a time.
    changes: tokio::sync::Mutex<()>,
    runs: TaskTracker,
    /// Cancelled when the service stops.
    closing: CancellationToken,
}

impl Studies {
    /// No studies yet. Without a storage there never are any.
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

    /// Loads the stored studies, and continues those that ran. Expired ones and those with a damaged document are removed.
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

    /// How many studies run.
    pub fn running(&self) -> usize {
        self.records.lock().iter().filter(|record| record.is_running()).count()
    }

    fn storage(&self) -> Result<&Storage, Problem> {
        self.storage.as_ref().ok_or_else(|| {
            let detail = "this service takes no studies, because it was started with `--studies off`";
            Problem::new(ProblemCode::StudiesOff, detail)
        })
    }

    fn record(&self, id: &str) -> Option<Arc<StudyRecord>> {
        self.records.lock().iter().find(|record| record.id == id).cloned()
    }

    /// The study with this id, which a client requests now.
    pub fn find(&self, id: &str) -> Result<Option<Arc<StudyRecord>>, Problem> {
        self.storage()?;
        Ok(self.record(id).inspect(|record| self.touch(record)))
    }

    /// Sets the time of the latest request to now. Nobody waits until it is stored.
    pub fn touch(&self, record: &StudyRecord) {
        let Some(Storage { store, .. }) = &self.storage else { return };
        let now_s = now_s();
        if record.asked_at_s.swap(now_s, Ordering::Relaxed) == now_s {
            return;
        }
        let (store, id) = (store.clone(), record.id.clone());
        self.runs.spawn(async move {
            if let Err(error) = store.with(move |transaction| store::set_asked_at(transaction, &id, now_s)).await {
                tracing::warn!(%error, "the time of a request for a study was not stored");
            }
        });
    }

    /// The study, which runs from now on if it is not done. If it has parts, it continues with them.
    /// Fails with `queue_full` if too many studies run, or if memory has no space for another one.
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
            let detail = format!(
                "{most} studies run, the most that this service runs at once. Try again in a second, or cancel one"
            );
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

    /// The oldest studies that leave memory so that another one has space: as few as possible, and none that runs.
    fn to_remove_for(&self, study: &Study) -> Result<Vec<Arc<StudyRecord>>, Problem> {
        let (id, bytes, most_bytes) = (study.id().to_string(), record::bytes(study), self.limits.max_study_bytes);
        let others = self.records.lock().iter().filter(|record| record.id != id).cloned().collect::<Vec<_>>();
        let (running, idle): (Vec<_>, Vec<_>) = others.into_iter().partition(|record| record.is_running());
        let sum = |records: &[Arc<StudyRecord>]| records.iter().map(|record| record.bytes()).sum::<u64>();
        let needed_bytes = bytes + sum(&running);
        if needed_bytes > most_bytes {
            let detail = format!(
                "the study takes {bytes} bytes: with those that run more than the {most_bytes} of `max_study_bytes`. Try again when one of them is done"
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

    /// Adds the record of a study, in the place of an earlier one, and runs the study if that is its state.
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

    /// Cancels a study that runs, and removes one that does not. False if there is no such study.
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
                let detail = "the service is stopping, and the study continues when it starts again. Cancel it then";
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

    /// The answer from the parts that are stored, computed on this thread.
    /// Fails if the file fails or is damaged, if the study was removed, or if `stop` is set.
    pub fn answer(&self, record: &StudyRecord, stop: &AtomicBool) -> Result<StudyAnswer, Problem> {
        runner::answer(&self.storage()?.store, record, stop)
    }

    /// Removes expired studies, again and again until the service stops.
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

    /// Stops all studies, which continue after a restart, and ends all waiting for them.
    pub fn close(&self) {
        self.closing.cancel();
        self.runs.close();
    }

    /// Completes when all studies have stopped and the file has all that they stored.
    pub async fn closed(&self) {
        self.runs.wait().await;
        if let Some(Storage { store, .. }) = &self.storage {
            store.merge_log();
        }
    }

    /// Cancelled when the service stops.
    pub const fn closing(&self) -> &CancellationToken {
        &self.closing
    }
}
