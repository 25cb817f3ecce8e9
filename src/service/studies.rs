//! Studies that run and that are kept: in memory, within the bound on unread answers, the oldest forgotten first.
//!
//! A study's chunks are worked on side by side, each in slices of a few milliseconds that wait for their turn behind single requests, as
//! those of batches do.

use std::collections::VecDeque;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::time::Duration;

use futures_util::{StreamExt as _, TryStreamExt as _, stream};
use metrics::counter;
use parking_lot::Mutex;
use serde::Serialize;
use tokio::sync::watch;
use tokio::time::Instant;
use tokio_util::sync::CancellationToken;
use toothwave_calculation::no_answer::NoAnswer;
use toothwave_study::{Gathered, Study, StudyAnswer, Work};
use utoipa::ToSchema;

use crate::compute::Pool;
use crate::config::Limits;
use crate::problem::{Problem, ProblemCode};
use crate::room::{Reserved, Room};

/// A slice begins no variant after this time: so long at most does a single request wait behind short ones.
const SLICE: Duration = Duration::from_millis(5);

/// How a study stands.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum StudyState {
    /// Variants are looked at.
    Running,
    /// All were looked at.
    Done,
    /// It was told to stop; the same question lets it go on.
    Cancelled,
    /// It broke off; the same question lets it go on.
    Failed,
}

/// The studies of the service.
#[derive(Debug)]
pub struct Studies {
    pool: Pool,
    room: Room,
    limits: Limits,
    /// The oldest first.
    kept: Mutex<VecDeque<Arc<Kept>>>,
    /// Cancelled when the service stops: nobody waits for a study any more.
    closing: CancellationToken,
}

/// A study with what it has come to.
#[derive(Debug)]
pub struct Kept {
    id: String,
    study: Arc<Study>,
    gathered: Mutex<Gathered>,
    /// Variants looked at, those of chunks that are not over yet among them.
    looked_at: AtomicU64,
    state: watch::Sender<Standing>,
    cancelled: Mutex<CancellationToken>,
    _room: Reserved,
}

/// How a study stands, and why it broke off.
#[derive(Debug, Clone)]
struct Standing {
    state: StudyState,
    problem: Option<Problem>,
}

/// A study as it stands.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
pub struct StudyResource {
    /// What tells it from every other study: a hash of what is asked.
    pub id: String,
    /// Its kind.
    pub study: &'static str,
    /// How it stands.
    pub state: StudyState,
    /// Variants that it looks at.
    pub variants: u64,
    /// Variants that were looked at.
    pub looked_at: u64,
    /// Of those that the result holds, the ones without an answer.
    pub impossible: u64,
    /// Where the result stands, as far as it has come.
    pub result_href: String,
    /// Where it tells of its progress.
    pub events_href: String,
    /// Why it broke off.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    pub problem: Option<Problem>,
    /// The result, where the study was asked for and does not run any more.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    pub result: Option<StudyAnswer>,
}

impl Kept {
    /// How it stands.
    pub fn resource(&self) -> StudyResource {
        let Standing { state, problem } = self.state.borrow().clone();
        let looked_at = self.looked_at.load(Ordering::Relaxed);
        StudyResource {
            id: self.id.clone(),
            study: self.study.kind(),
            state,
            variants: self.study.variants(),
            looked_at,
            impossible: self.gathered.lock().refused(),
            result_href: format!("/v1/studies/{}/result", self.id),
            events_href: format!("/v1/studies/{}/events", self.id),
            problem,
            result: None,
        }
    }

    /// What it has come to.
    pub fn answer(&self) -> StudyAnswer {
        self.gathered.lock().answer()
    }

    /// About what it takes to keep what it comes to.
    pub fn stored_bytes(&self) -> u64 {
        self.study.stored_bytes()
    }

    /// Whether it runs.
    pub fn is_running(&self) -> bool {
        self.state.borrow().state == StudyState::Running
    }

    /// Told whenever it stands otherwise, or has come further.
    pub fn watch(&self) -> impl Future<Output = ()> + Send + 'static {
        let mut state = self.state.subscribe();
        async move {
            // An error says that the study is forgotten: nothing more will come.
            let _ = state.changed().await;
        }
    }

    fn stand(&self, state: StudyState, problem: Option<Problem>) {
        self.state.send_replace(Standing { state, problem });
    }
}

impl Studies {
    /// None yet.
    pub fn new(pool: Pool, room: Room, limits: Limits) -> Self {
        Self { pool, room, limits, kept: Mutex::default(), closing: CancellationToken::new() }
    }

    /// Studies that run now.
    pub fn running(&self) -> usize {
        self.kept.lock().iter().filter(|kept| kept.is_running()).count()
    }

    /// The study with this id, where it is kept.
    pub fn find(&self, id: &str) -> Option<Arc<Kept>> {
        self.kept.lock().iter().find(|kept| kept.id == id).cloned()
    }

    /// The study, which runs from now on if it is not done: one that is kept goes on where it was.
    ///
    /// # Errors
    /// `queue_full` where as many run as the service admits, `too_many_unread_bytes` where there is no room for what it comes to.
    pub fn begin(&self, study: Study) -> Result<Arc<Kept>, Problem> {
        let id = study.id().to_string();
        let mut all = self.kept.lock();
        let known = all.iter().position(|kept| kept.id == id).and_then(|index| all.remove(index));
        if let Some(kept) = &known {
            // Whoever asks for it again makes it the youngest.
            all.push_back(Arc::clone(kept));
            if matches!(kept.state.borrow().state, StudyState::Running | StudyState::Done) {
                return Ok(Arc::clone(kept));
            }
        }
        let (running, most) = (all.iter().filter(|kept| kept.is_running()).count(), self.limits.max_concurrent_studies);
        if running >= most {
            let detail = format!(
                "{most} studies run, as many as `max_concurrent_studies` admits; try again in a moment, or cancel one"
            );
            return Err(Problem::new(ProblemCode::QueueFull, detail));
        }
        let kept = match known {
            Some(kept) => kept,
            None => {
                let reserved = self.make_room(&mut all, study.stored_bytes())?;
                let study = Arc::new(study);
                let kept = Arc::new(Kept {
                    id,
                    gathered: Mutex::new(Gathered::new(&study)),
                    study,
                    looked_at: AtomicU64::new(0),
                    state: watch::Sender::new(Standing { state: StudyState::Running, problem: None }),
                    cancelled: Mutex::default(),
                    _room: reserved,
                });
                all.push_back(Arc::clone(&kept));
                kept
            }
        };
        drop(all);
        self.run(&kept);
        Ok(kept)
    }

    /// Room for what a study comes to: the oldest that do not run are forgotten for it.
    fn make_room(&self, all: &mut VecDeque<Arc<Kept>>, bytes: u64) -> Result<Reserved, Problem> {
        loop {
            let stored: u64 = all.iter().map(|kept| kept.stored_bytes()).sum();
            let reserved = if stored + bytes > self.limits.max_study_bytes {
                let detail = format!(
                    "the study takes {bytes} bytes: with those that run more than the {} of `max_study_bytes`; try again when one of them is done",
                    self.limits.max_study_bytes
                );
                Err(Problem::new(ProblemCode::QueueFull, detail))
            } else {
                self.room.reserve(bytes).map_err(Problem::from)
            };
            match (reserved, all.iter().position(|kept| !kept.is_running())) {
                (Ok(reserved), _) => return Ok(reserved),
                (Err(problem), None) => return Err(problem),
                (Err(_), Some(oldest)) => drop(all.remove(oldest)),
            }
        }
    }

    /// Cancels a study that runs, and forgets one that does not.
    pub fn cancel_or_forget(&self, kept: &Arc<Kept>) {
        if kept.is_running() {
            kept.cancelled.lock().cancel();
            kept.stand(StudyState::Cancelled, None);
        } else {
            self.kept.lock().retain(|other| other.id != kept.id);
        }
    }

    /// Ends all waiting for studies.
    pub fn close(&self) {
        self.closing.cancel();
    }

    /// When nobody is to wait for a study any more.
    pub fn closing(&self) -> &CancellationToken {
        &self.closing
    }

    fn run(&self, kept: &Arc<Kept>) {
        let cancelled = CancellationToken::new();
        *kept.cancelled.lock() = cancelled.clone();
        kept.looked_at.store(kept.gathered.lock().variants(), Ordering::Relaxed);
        kept.stand(StudyState::Running, None);
        let deadline = Instant::now() + Duration::from_millis(self.limits.study_deadline_ms);
        let (kept, pool, limits) = (Arc::clone(kept), self.pool.clone(), self.limits);
        tokio::spawn(async move {
            let missing: Vec<_> = kept.gathered.lock().missing().collect();
            let chunks = stream::iter(missing)
                .map(|chunk| run_chunk(&pool, &kept, chunk))
                .buffer_unordered(limits.max_concurrent_solves)
                .try_collect::<()>();
            let ended = tokio::select! {
                // First: what is cancelled begins nothing more. It was said to stand so already.
                biased;
                () = cancelled.cancelled() => return,
                ended = tokio::time::timeout_at(deadline, chunks) => ended,
            };
            match ended {
                Ok(Ok(())) => kept.stand(StudyState::Done, None),
                Ok(Err(problem)) => kept.stand(StudyState::Failed, Some(problem)),
                Err(_) => {
                    let detail = format!(
                        "the study did not finish within the {} ms of `study_deadline_ms`; what it has come to is kept, and the same question lets it go on",
                        limits.study_deadline_ms
                    );
                    kept.stand(StudyState::Failed, Some(Problem::new(ProblemCode::DeadlineExceeded, detail)));
                }
            }
        });
    }
}

/// Works a chunk out, a slice at a time.
async fn run_chunk(pool: &Pool, kept: &Arc<Kept>, chunk: u64) -> Result<(), Problem> {
    let mut work = Work::new(&kept.study, chunk);
    loop {
        let (slice, variants, is_over) = pool.run_in_turn(move |stop| slice(work, stop)).await?;
        counter!("toothwave_study_variants_total").increment(variants);
        kept.looked_at.fetch_add(variants, Ordering::Relaxed);
        if is_over {
            kept.gathered.lock().add(chunk, slice.finish());
            kept.state.send_modify(|_| {});
            return Ok(());
        }
        kept.state.send_modify(|_| {});
        work = slice;
    }
}

/// As many variants as the time of a slice allows; at least one.
fn slice(mut work: Work, stop: &AtomicBool) -> Result<(Work, u64, bool), Problem> {
    #[cfg(feature = "fault-injection")]
    fail::fail_point!("solve");
    let started = std::time::Instant::now();
    let mut variants = 0;
    loop {
        let is_over = work.step(stop).map_err(|_| NoAnswer::stopped())?;
        variants += 1;
        if is_over || started.elapsed() >= SLICE {
            return Ok((work, variants, is_over));
        }
    }
}
