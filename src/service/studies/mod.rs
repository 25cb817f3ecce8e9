//! The studies of the service: what requests ask of them. They run in this process and are kept in a file, or in memory.
//!
//! Memory holds how every study stands; the file holds what it asks and what its chunks came to. After a restart studies that ran continue.

mod kept;
mod runner;
mod seal;
mod store;

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use parking_lot::Mutex;
use tokio_util::sync::CancellationToken;
use tokio_util::task::TaskTracker;
use toothwave_study::{Study, StudyAnswer};
use tracing::Instrument as _;

use self::kept::problem_text;
pub use self::kept::{Kept, StudyResource, StudyState};
use self::runner::Engine;
use self::store::{NewStudy, now_s};
pub use self::store::{Store, StoreError};
use crate::compute::pool::Pool;
use crate::http::problem::{Problem, ProblemCode};
use crate::ops::config::Limits;

/// Between two times that old studies are forgotten.
const FORGET: Duration = Duration::from_secs(60);

/// That a study was asked for is written down if this share of its expiry has passed, so that readers seldom write.
const NOTE_SHARE: u64 = 10;

/// Where studies are kept.
#[derive(Debug)]
pub enum Keeping {
    /// Nowhere: there are none.
    Off,
    /// In a file, or in memory.
    In {
        /// The file.
        store: Store,
        /// A study that nobody asks for is forgotten after this time.
        expiry: Duration,
    },
}

/// The studies of the service.
#[derive(Debug)]
pub struct Studies {
    pool: Pool,
    limits: Limits,
    keeping: Keeping,
    /// The one that began longest ago first.
    kept: Mutex<Vec<Arc<Kept>>>,
    /// Held while a study begins, is cancelled or forgotten: one at a time.
    changing: tokio::sync::Mutex<()>,
    runs: TaskTracker,
    /// Cancelled when the service stops.
    closing: CancellationToken,
}

impl Studies {
    /// None yet.
    pub fn new(pool: Pool, limits: Limits, keeping: Keeping) -> Self {
        Self {
            pool,
            limits,
            keeping,
            kept: Mutex::default(),
            changing: tokio::sync::Mutex::default(),
            runs: TaskTracker::new(),
            closing: CancellationToken::new(),
        }
    }

    /// Loads the studies of the file, and lets those continue that ran.
    ///
    /// # Errors
    /// If the file fails.
    pub async fn load(&self) -> Result<(), StoreError> {
        let Keeping::In { store, .. } = &self.keeping else { return Ok(()) };
        for stored in store.with(store::load).await? {
            let ends_at_s = stored.ends_at_s;
            let kept = Kept::new(stored);
            self.kept.lock().push(Arc::clone(&kept));
            if kept.is_running()
                && let Err(problem) = self.resume(store, &kept.id, ends_at_s).await
            {
                tracing::error!(study = kept.id, %problem, cause = problem.cause, "a study cannot continue");
                kept.stand(StudyState::Failed, Some(problem));
            }
        }
        Ok(())
    }

    async fn resume(&self, store: &Store, id: &str, ends_at_s: u64) -> Result<(), Problem> {
        let own = id.to_owned();
        let document = store.with(move |transaction| store::document(transaction, &own)).await?;
        let document = document.ok_or_else(|| runner::forgotten(id))?;
        let study = runner::read(id, &document)?;
        let new = NewStudy {
            // That of another build has another id here.
            id: id.into(),
            ends_at_s,
            max_states: document.max_states,
            max_profile_points: document.max_profile_points,
            ..new_study(&study, &document.text)
        };
        self.let_run(store, new, study).await?;
        Ok(())
    }

    /// Studies that run now.
    pub fn running(&self) -> usize {
        self.kept.lock().iter().filter(|kept| kept.is_running()).count()
    }

    fn store(&self) -> Result<&Store, Problem> {
        match &self.keeping {
            Keeping::In { store, .. } => Ok(store),
            Keeping::Off => {
                let detail = "this service takes no studies: it was started with `--studies off`";
                Err(Problem::new(ProblemCode::StudiesOff, detail))
            }
        }
    }

    /// The study with this id, if it is kept, which was asked for now.
    ///
    /// # Errors
    /// `studies_off` if there are none.
    pub fn find(&self, id: &str) -> Result<Option<Arc<Kept>>, Problem> {
        self.store()?;
        let kept = self.known(id);
        if let Some(kept) = &kept {
            self.touch(kept);
        }
        Ok(kept)
    }

    fn known(&self, id: &str) -> Option<Arc<Kept>> {
        self.kept.lock().iter().find(|kept| kept.id == id).cloned()
    }

    /// Notes that a study was asked for. Nobody waits until that is written down.
    pub fn touch(&self, kept: &Kept) {
        let Keeping::In { store, expiry } = &self.keeping else { return };
        let now_s = now_s();
        kept.asked_at_s.store(now_s, Ordering::Relaxed);
        if now_s.saturating_sub(kept.noted_at_s.load(Ordering::Relaxed)) > expiry.as_secs() / NOTE_SHARE {
            kept.noted_at_s.store(now_s, Ordering::Relaxed);
            let (store, id) = (store.clone(), kept.id.clone());
            self.runs.spawn(async move {
                if let Err(error) = store.with(move |transaction| store::touch(transaction, &id)).await {
                    tracing::warn!(%error, "that a study was asked for was not written down");
                }
            });
        }
    }

    /// The study, which runs from now on if it is not done: one that is kept continues where it stands.
    ///
    /// # Errors
    /// `queue_full` if as many run as the service admits, or memory has no place for it; `store_unavailable` if the file fails;
    /// `studies_off` if there are none.
    pub async fn begin(&self, study: Study, document: &[u8]) -> Result<Arc<Kept>, Problem> {
        let store = self.store()?;
        let id = study.id().to_string();
        let _one_at_a_time = self.changing.lock().await;
        if let Some(kept) = self.find(&id)?
            && matches!(kept.state(), StudyState::Running | StudyState::Done)
        {
            // The one that was asked for last is forgotten last.
            let mut all = self.kept.lock();
            all.retain(|other| other.id != id);
            all.push(Arc::clone(&kept));
            return Ok(kept);
        }
        let most = self.limits.max_concurrent_studies;
        if self.running() >= most {
            let detail = format!(
                "{most} studies run, as many as `max_concurrent_studies` admits; try again in a moment, or cancel one"
            );
            return Err(Problem::new(ProblemCode::QueueFull, detail));
        }
        let new = NewStudy {
            ends_at_s: now_s()
                .saturating_add(self.limits.study_deadline_ms.div_ceil(1000))
                .min(i64::MAX.unsigned_abs()),
            max_states: self.limits.max_states.min(i64::MAX.unsigned_abs()),
            max_profile_points: self.limits.max_profile_points.min(i64::MAX.unsigned_abs()),
            ..new_study(&study, document)
        };
        if store.is_in_memory() {
            for oldest in self.to_forget_for(&id, new.bytes)? {
                self.forget(store, &oldest).await?;
            }
        }
        Ok(self.let_run(store, new, Arc::new(study)).await?)
    }

    /// The oldest studies that memory keeps no longer so that another has a place: as many as it takes, and none that runs.
    fn to_forget_for(&self, id: &str, bytes: u64) -> Result<Vec<Arc<Kept>>, Problem> {
        let all = self.kept.lock();
        let others = || all.iter().filter(|kept| kept.id != id);
        let most_bytes = self.limits.max_study_bytes;
        let mut all_bytes = bytes + others().map(|kept| kept.bytes).sum::<u64>();
        let mut going = Vec::new();
        for kept in others().filter(|kept| !kept.is_running()) {
            if all_bytes <= most_bytes {
                break;
            }
            all_bytes -= kept.bytes;
            going.push(Arc::clone(kept));
        }
        if all_bytes <= most_bytes {
            return Ok(going);
        }
        let detail = format!(
            "the study takes {bytes} bytes: with those that run more than the {most_bytes} of `max_study_bytes`; try again when one of them is done"
        );
        Err(Problem::new(ProblemCode::QueueFull, detail))
    }

    /// Writes down that a study runs, and lets it.
    async fn let_run(&self, store: &Store, new: NewStudy, study: Arc<Study>) -> Result<Arc<Kept>, StoreError> {
        let stored = store.with(move |transaction| store::begin(transaction, &new)).await?;
        let time = Duration::from_secs(stored.ends_at_s.saturating_sub(now_s()));
        let kept = Kept::new(stored);
        {
            let mut all = self.kept.lock();
            all.retain(|other| other.id != kept.id);
            all.push(Arc::clone(&kept));
        }
        let stop = self.closing.child_token();
        *kept.run.lock() = stop.clone();
        let run = Run {
            engine: Engine { store: store.clone(), pool: self.pool.clone() },
            kept: Arc::clone(&kept),
            study,
            time,
            stop,
            closing: self.closing.clone(),
        };
        self.runs.spawn(run.complete().in_current_span());
        Ok(kept)
    }

    /// Cancels a study that runs, and forgets one that does not; whether it was kept.
    ///
    /// # Errors
    /// `store_unavailable` if the file fails; `studies_off` if there are none.
    pub async fn cancel_or_forget(&self, id: &str) -> Result<bool, Problem> {
        let store = self.store()?;
        let _one_at_a_time = self.changing.lock().await;
        let Some(kept) = self.known(id) else { return Ok(false) };
        if !kept.is_running() {
            self.forget(store, &kept).await?;
            return Ok(true);
        }
        kept.run.lock().cancel();
        // It ends at once, and keeps nothing from then on.
        tokio::select! {
            () = kept.ended() => Ok(true),
            () = self.closing.cancelled() => {
                let detail = "the service is stopping, and the study continues when it starts again; ask again then";
                Err(Problem::new(ProblemCode::ShuttingDown, detail))
            }
        }
    }

    async fn forget(&self, store: &Store, kept: &Arc<Kept>) -> Result<(), StoreError> {
        let id = kept.id.clone();
        store.with(move |transaction| store::forget(transaction, &id)).await?;
        self.kept.lock().retain(|other| !Arc::ptr_eq(other, kept));
        Ok(())
    }

    /// What a study has come to, computed on this thread.
    ///
    /// # Errors
    /// If the file fails or is damaged, the study was forgotten, or `stop` says so.
    pub fn answer(&self, kept: &Kept, stop: &AtomicBool) -> Result<StudyAnswer, Problem> {
        runner::answer(self.store()?, kept, stop)
    }

    /// Forgets studies that nobody has asked for during their expiry, until the service stops.
    pub async fn forget_old(&self) {
        loop {
            tokio::select! {
                () = tokio::time::sleep(FORGET) => self.forget_expired().await,
                () = self.closing.cancelled() => return,
            }
        }
    }

    /// Forgets once the studies that nobody has asked for during their expiry.
    pub async fn forget_expired(&self) {
        let Keeping::In { store, expiry } = &self.keeping else { return };
        let since_s = now_s().saturating_sub(expiry.as_secs());
        let _one_at_a_time = self.changing.lock().await;
        let is_old = |kept: &Arc<Kept>| !kept.is_running() && kept.asked_at_s.load(Ordering::Relaxed) < since_s;
        let old: Vec<_> = self.kept.lock().iter().filter(|kept| is_old(kept)).cloned().collect();
        for kept in old {
            match self.forget(store, &kept).await {
                Ok(()) => tracing::info!(study = kept.id, "removed a study that nobody asked for"),
                Err(error) => tracing::warn!(%error, study = kept.id, "cannot remove an old study"),
            }
        }
    }

    /// Stops all studies, which continue after a restart, and ends all waiting for them.
    pub fn close(&self) {
        self.closing.cancel();
        self.runs.close();
    }

    /// When all studies have stopped, and all that was to be noted of them is.
    pub async fn closed(&self) {
        self.runs.wait().await;
    }

    /// When nobody is to wait for a study any more.
    pub const fn closing(&self) -> &CancellationToken {
        &self.closing
    }
}

/// About what a study takes with its result, and what it asks.
fn new_study(study: &Study, document: &[u8]) -> NewStudy {
    /// What is noted of it besides.
    const OTHER_BYTES: u64 = 4096;
    NewStudy {
        id: study.id().to_string(),
        kind: study.kind(),
        variants: study.variants(),
        chunks: study.chunks(),
        bytes: OTHER_BYTES + study.kept_bytes(),
        ends_at_s: 0,
        max_states: 0,
        max_profile_points: 0,
        document: document.into(),
    }
}

/// A study that runs.
struct Run {
    engine: Engine,
    kept: Arc<Kept>,
    study: Arc<Study>,
    time: Duration,
    stop: CancellationToken,
    closing: CancellationToken,
}

impl Run {
    async fn complete(self) {
        let Self { engine, kept, study, time, stop, closing } = self;
        let computing = runner::run(&engine, &kept, &study, &stop);
        let ended = runner::in_time(time, computing).await;
        let (state, problem) = match ended {
            Ok(true) => return kept.stand(StudyState::Done, None),
            // It continues after the restart.
            _ if closing.is_cancelled() => return,
            Ok(false) => (StudyState::Cancelled, None),
            Err(problem) => (StudyState::Failed, Some(problem)),
        };
        let (id, text) = (kept.id.clone(), problem.as_ref().map(problem_text));
        if let Some(problem) = &problem {
            tracing::warn!(study = id, %problem, cause = problem.cause, "a study failed");
        }
        let noted = engine.store.with(move |transaction| store::stop(transaction, &id, state, text.as_deref())).await;
        if let Err(error) = noted {
            tracing::warn!(%error, "how a study ended was not written down: it continues after a restart");
        }
        kept.stand(state, problem);
    }
}
