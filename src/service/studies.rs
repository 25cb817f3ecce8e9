//! Studies that run and that are kept: in memory, within the bound on unread answers, the oldest forgotten first; or in a store, of which
//! this is then a view. There the rows of a study are here only for who reads its result, likewise bounded.
//!
//! A study's chunks are worked on side by side, each in slices of a few milliseconds that wait for their turn behind single requests, as
//! those of batches do. Those of a store are the workers', who are here where the store is a file, and elsewhere where it is a server.

use std::collections::{BTreeSet, VecDeque};
use std::ops::Range;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::time::Duration;

use futures_util::FutureExt as _;
use futures_util::future::{BoxFuture, Shared, try_join_all};
use metrics::counter;
use parking_lot::Mutex;
use serde::Serialize;
use tokio::sync::{Semaphore, watch};
use tokio::time::Instant;
use tokio_util::sync::CancellationToken;
use toothwave_calculation::origin;
use toothwave_store::{Cut, Figures, NewStudy, PATIENCE, Standing as Stored, Store, StoreError};
use toothwave_study::{Gathered, Part, Study, StudyAnswer, Work};
use tracing::Instrument as _;
use utoipa::ToSchema;

use crate::compute::{Lane, Pool, SMALL_VARIANT_BYTES, Slice};
use crate::config::Limits;
use crate::frozen::{self, view_bytes};
use crate::parts::Parts;
use crate::problem::{Problem, ProblemCode};
use crate::room::{self, NoRoom, Room};
use crate::worker::{Capacity, PART_OF_CHUNKS, Workers, milliseconds, slice};

/// Between two looks at how a stored study stands.
const LOOK: Duration = Duration::from_secs(1);

/// Looks take a share of the database's time, however many chunks there are: a tenth at most.
const LOOKS_SHARE: u32 = 10;

/// But what took so long that the next look would be later than this was the database being away.
const LONGEST_PAUSE: Duration = Duration::from_secs(10);

/// Between two looks at the whole store in numbers.
const COUNT: Duration = Duration::from_secs(5);

/// Between two times that old studies are forgotten.
const EXPIRE: Duration = Duration::from_secs(60);

/// What a study gets that many processes share: nobody waits for it, and whoever wants its end cancels it.
const ENDLESS: Duration = Duration::from_secs(100 * 365 * 86_400);

/// For so long a server is told that nobody needs it any more.
const CLOSE: Duration = Duration::from_millis(300);

/// Stored studies that are forgotten at once, of the connections that there are for all else.
const FORGET_AT_ONCE: usize = 2;

/// Of what is read of a store at once: it is unpacked beside that.
const READ_BYTES: u64 = 4 << 20;

/// Rows of which an answer takes longer than some milliseconds.
const LARGE_BYTES: u64 = 1 << 20;

/// What is known of stored studies besides their rows, at most: hundreds of the usual, or the few largest.
const VIEWS_BYTES: u64 = 32 << 20;

/// A study in memory is shared out in so many pieces, as far as it has so many variants, or in four for each solve that may run at once.
const LEAST_PIECES: u64 = 16;

/// What has come of a piece is handed over after such a time: of what is broken off no more is lost.
const HAND_OVER: Duration = Duration::from_secs(1);

/// That a stored study was asked for is noted when it was not for this share of its expiry, so that who reads does not write each time.
const NOTE_SHARE: u32 = 10;

/// For so long an answer that was made while its study ran serves those who come back for it.
const FRESH: Duration = Duration::from_secs(60);

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

/// Where studies are kept.
#[derive(Debug)]
pub enum Keeping {
    /// In this process alone.
    Memory,
    /// Beyond it.
    Store {
        /// Where.
        store: Store,
        /// Since it was last asked for, until it is forgotten.
        expiry: Duration,
        /// Where rows are kept besides, of chunks that are computed in this process.
        parts: Option<Parts>,
    },
    /// Not at all: this is one of several replicas, and the others would know nothing of them.
    Nowhere,
}

/// The studies of the service.
#[derive(Debug)]
pub struct Studies {
    pool: Pool,
    room: Room,
    limits: Limits,
    keeping: Keeping,
    /// Told when a stored study was asked for, or has come further, in this process.
    changed: watch::Sender<()>,
    /// The store in numbers, as it was last seen.
    figures: Mutex<Option<Figures>>,
    /// The oldest first. Whoever changes whether a study of this list runs holds it.
    kept: Mutex<VecDeque<Arc<Kept>>>,
    /// Held while a stored study begins: as many as are counted run, and no more.
    beginning: Arc<tokio::sync::Mutex<()>>,
    /// The stored studies that were asked for, of which that is still to be noted.
    asked: Arc<Mutex<BTreeSet<String>>>,
    /// One for each stored study that is forgotten at once.
    forgetting: Arc<Semaphore>,
    /// Cancelled when the service stops: nobody waits for a study any more.
    closing: CancellationToken,
}

/// A study with what it has come to.
#[derive(Debug)]
pub struct Kept {
    id: String,
    study: Arc<Study>,
    /// Of a stored study none until its result is read, and none any more when another's needs the room.
    rows: Mutex<Option<Arc<Rows>>>,
    /// The chunks that will not come, each with how often it was tried.
    gaps: Mutex<Vec<(u64, u64)>>,
    /// Variants looked at, those of chunks that are not over yet among them.
    looked_at: AtomicU64,
    /// Of those that the result holds, the ones without an answer.
    impossible: AtomicU64,
    state: watch::Sender<Standing>,
    cancelled: Mutex<CancellationToken>,
    /// Of a stored study: seconds since it was last asked for, as far as that was noted.
    unasked_s: AtomicU64,
    /// Whether somebody looks how it stands while it runs, and one look at a time.
    is_followed: AtomicBool,
    looking: tokio::sync::Mutex<()>,
    /// What it takes besides its rows.
    bytes: u64,
    _room: Option<room::Kept>,
}

/// What a study has come to, as far as it is here.
#[derive(Debug)]
pub struct Rows {
    gathered: Mutex<Gathered>,
    /// Held while they are read from the store, which one does for all who wait for it: what came of it last, with when it was begun, or
    /// when it failed.
    gathering: tokio::sync::Mutex<Option<(Instant, Result<(), Problem>)>>,
    /// The last answer that was made apart, or is.
    making: Mutex<Option<Making>>,
    /// What they take beside what has come.
    other_bytes: u64,
    room: Mutex<room::Kept>,
}

impl Rows {
    fn bytes(&self) -> u64 {
        self.room.lock().bytes()
    }

    /// Adds so much to what has come, if there is room for it: there may be more reasons, each with its words, than was known before.
    fn add(&self, more_bytes: u64, add: impl FnOnce(&mut Gathered)) -> Result<(), Problem> {
        let mut gathered = self.gathered.lock();
        self.room.lock().hold_at_least(self.other_bytes + gathered.bytes() + more_bytes)?;
        add(&mut gathered);
        Ok(())
    }
}

/// What a study has come to, for who tells it: as long as this is held its rows stay, and their room is taken.
#[derive(Debug)]
pub struct Reading {
    kept: Arc<Kept>,
    /// What the answer is to be made of, as it is then: there are as many lists of its parts as answers that are being made.
    rows: Arc<Rows>,
    /// Where it is made already, once for all who wait to tell it.
    made: Option<Arc<Made>>,
}

impl Reading {
    /// About what the answer takes that is still to be made.
    pub fn columns_bytes(&self) -> u64 {
        if self.made.is_some() { self.kept.study.told_bytes() } else { self.kept.study.answer_bytes() }
    }

    /// It.
    pub fn answer(self) -> StudyAnswer {
        match &self.made {
            Some(made) => made.answer.clone(),
            None => self.kept.gathered(&self.rows).answer(),
        }
    }
}

/// An answer that was made apart from the requests for it.
#[derive(Debug)]
pub struct Made {
    /// It.
    pub answer: StudyAnswer,
    /// Whether every chunk is in it.
    is_whole: bool,
    at: Instant,
}

/// The same while it is made: all who ask meanwhile share it.
#[derive(Debug, Clone)]
struct Making {
    made: Shared<BoxFuture<'static, Result<Arc<Made>, Problem>>>,
    /// Nobody wants it any more when the last of these is gone.
    _wanted: Arc<()>,
    /// How often the study had come to stand otherwise when it was begun: more may have come since than is in it.
    changes: u64,
}

/// How a study stands, and why it broke off.
#[derive(Debug, Clone)]
struct Standing {
    state: StudyState,
    problem: Option<Problem>,
    /// How often it has come to stand otherwise.
    changes: u64,
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
    /// Variants that were looked at: of a search also those that it judges once more in the end, at true peaks.
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
        let Standing { state, problem, .. } = self.state.borrow().clone();
        let looked_at = self.looked_at.load(Ordering::Relaxed);
        StudyResource {
            id: self.id.clone(),
            study: self.study.kind(),
            state,
            variants: self.study.variants(),
            looked_at,
            impossible: self.impossible.load(Ordering::Relaxed),
            result_href: format!("/v1/studies/{}/result", self.id),
            events_href: format!("/v1/studies/{}/events", self.id),
            problem,
            result: None,
        }
    }

    /// Whether it runs.
    pub fn is_running(&self) -> bool {
        self.state.borrow().state == StudyState::Running
    }

    /// Whether its answer is all of its rows.
    pub fn is_a_map(&self) -> bool {
        self.study.kind() == "map"
    }

    /// Told whenever it stands otherwise, or has come further.
    pub fn watch(&self) -> impl Future<Output = ()> + Send + use<> {
        let mut state = self.state.subscribe();
        async move {
            // An error says that the study is forgotten: nothing more will come.
            let _ = state.changed().await;
        }
    }

    fn stand(&self, state: StudyState, problem: Option<Problem>) {
        self.state.send_modify(|standing| {
            let changes = standing.changes + u64::from(standing.state != state);
            *standing = Standing { state, problem, changes };
        });
    }

    /// Stops what runs in this process.
    fn cancel(&self) {
        let run = self.cancelled.lock();
        run.cancel();
        self.break_off(StudyState::Cancelled, None);
    }

    /// Of one that runs in this process: chunks that are not over are begun anew when it goes on.
    fn break_off(&self, state: StudyState, problem: Option<Problem>) {
        self.looked_at.store(self.here(|gathered| gathered.variants()), Ordering::Relaxed);
        self.stand(state, problem);
    }

    fn new(study: Arc<Study>, rows: Option<Arc<Rows>>, bytes: u64, room: Option<room::Kept>) -> Arc<Self> {
        Arc::new(Self {
            id: study.id().to_string(),
            rows: Mutex::new(rows),
            gaps: Mutex::default(),
            study,
            looked_at: AtomicU64::new(0),
            impossible: AtomicU64::new(0),
            state: watch::Sender::new(Standing { state: StudyState::Running, problem: None, changes: 0 }),
            cancelled: Mutex::default(),
            unasked_s: AtomicU64::new(0),
            is_followed: AtomicBool::new(false),
            looking: tokio::sync::Mutex::default(),
            bytes,
            _room: room,
        })
    }

    /// What it has come to, as far as it is here. Of a large study the answer takes long, and whoever adds to it must not wait meanwhile.
    fn gathered(&self, rows: &Rows) -> Gathered {
        let mut gathered = rows.gathered.lock().clone();
        gathered.give_up(self.gaps.lock().iter().copied());
        gathered
    }

    /// Looks at what it has come to, as far as that is here.
    fn here<T: Default>(&self, look: impl FnOnce(&mut Gathered) -> T) -> T {
        self.rows.lock().as_ref().map(|rows| look(&mut rows.gathered.lock())).unwrap_or_default()
    }

    /// Its rows, but where somebody reads them.
    fn unread_rows(&self) -> Option<Arc<Rows>> {
        self.rows.lock().as_ref().filter(|rows| Arc::strong_count(rows) == 1).cloned()
    }

    /// Whether who asks now is served by an answer that is made, or was.
    fn serves(&self, making: &Making) -> bool {
        // Where nobody has waited to its end nobody knows yet that it is made.
        match making.made.clone().now_or_never() {
            None => self.is_running() || making.changes == self.state.borrow().changes,
            Some(Ok(made)) => {
                let is_the_same = || self.is_running() || making.changes == self.state.borrow().changes;
                made.is_whole || (made.at.elapsed() < FRESH && is_the_same())
            }
            Some(Err(_)) => false,
        }
    }

    /// As it is cut, in the store.
    fn cut(&self) -> Cut {
        Cut { id: self.id.clone(), chunk_variants: self.study.chunk_variants() }
    }

    /// Reads what a stored study has come to since it was last read, or waits for who does. Those who wait for one who fails fail as well:
    /// of a store that says nothing each would wait as long again.
    async fn gather(&self, rows: &Rows, store: &Store, pool: &Pool) -> Result<(), Problem> {
        let asked = Instant::now();
        let mut last = rows.gathering.lock().await;
        if rows.gathered.lock().is_complete() {
            return Ok(());
        }
        if let Some((at, came)) = &*last
            && *at >= asked
        {
            return came.clone();
        }
        let begun = Instant::now();
        let came = self.gather_in_turn(rows, store, pool).await;
        let at = if came.is_ok() { begun } else { Instant::now() };
        *last = Some((at, came.clone()));
        came
    }

    async fn gather_in_turn(&self, rows: &Rows, store: &Store, pool: &Pool) -> Result<(), Problem> {
        let cut = self.cut();
        let was_done = self.state.borrow().state == StudyState::Done;
        let mut wanted = store.chunks_done(&cut).await?;
        {
            let gathered = rows.gathered.lock();
            wanted.retain(|(chunk, _)| gathered.lacks(*chunk));
        }
        for (first, last) in self.read_together(&wanted) {
            if pool.memory().is_scarce() {
                return Err(NoRoom::Scarce.into());
            }
            let stored = store.parts(&cut, first, last).await?;
            let cut = cut.clone();
            let unseal = move |_: &AtomicBool| {
                let part = |stored: &toothwave_store::Kept| {
                    Ok((stored.chunk, frozen::unsealed(&cut, stored.chunk, &stored.part)?))
                };
                stored.iter().map(part).collect::<Result<Vec<_>, Problem>>()
            };
            // Not in turn: variants may take minutes.
            let parts = pool.run_short(unseal).await?;
            let more_bytes = parts.iter().map(|(_, part)| part.bytes() as u64).sum();
            rows.add(more_bytes, |gathered| parts.into_iter().for_each(|(chunk, part)| gathered.add(chunk, part)))?;
        }
        // Of one that was forgotten meanwhile there are fewer, or none, and nothing else says so.
        let is_whole = rows.gathered.lock().is_complete();
        let is_done = || self.state.borrow().state == StudyState::Done;
        if is_done() && !is_whole {
            if !self.look(store).await? {
                return Err(self.forgotten());
            }
            if was_done && is_done() {
                return Err(Problem::internal(&format!(
                    "of the study {} the store has fewer chunks than it counts: it is damaged",
                    self.id
                )));
            }
        }
        Ok(())
    }

    /// The first and the last of chunks without a gap that are read together, of those that are wanted, each with its length.
    fn read_together(&self, wanted: &[(u64, u64)]) -> Vec<(u64, u64)> {
        let expected_bytes = self.study.stored_bytes() / self.study.chunks().max(1);
        let mut runs: Vec<(u64, u64)> = Vec::new();
        let mut bytes = 0;
        for &(chunk, length) in wanted {
            let part_bytes = length.max(expected_bytes);
            bytes += part_bytes;
            match runs.last_mut() {
                Some((_, last)) if *last + 1 == chunk && bytes <= READ_BYTES => *last = chunk,
                _ => {
                    bytes = part_bytes;
                    runs.push((chunk, chunk));
                }
            }
        }
        runs
    }

    fn forgotten(&self) -> Problem {
        let detail = format!("the study `{}` was forgotten in this moment; ask for it again", self.id);
        Problem::new(ProblemCode::NotFound, detail)
    }

    /// Looks how a stored study stands; whether it is kept at all. One that was forgotten and begun anew, in other chunks, is not this one.
    async fn look(&self, store: &Store) -> Result<bool, StoreError> {
        let looking = async {
            // One at a time, so that what is seen last is what was last the case.
            let held = self.looking.lock().await;
            Ok::<_, StoreError>((held, store.look(&self.id).await?))
        };
        let (_held, found) = patiently(looking).await?;
        let Some(stored) = found.filter(|stored| stored.study.cut() == self.cut()) else {
            self.stand(StudyState::Cancelled, None);
            return Ok(false);
        };
        self.looked_at.store(stored.looked_at, Ordering::Relaxed);
        self.impossible.store(stored.refused, Ordering::Relaxed);
        self.unasked_s.store(stored.unasked.as_secs(), Ordering::Relaxed);
        *self.gaps.lock() = stored.gaps.iter().map(|gap| (gap.chunk, gap.attempts)).collect();
        let (state, problem) = state_of(&stored);
        self.stand(state, problem);
        Ok(true)
    }

    /// Looks on while it runs.
    async fn follow(&self, store: &Store, changed: &watch::Sender<()>, closing: &CancellationToken) {
        let mut changed = changed.subscribe();
        let (mut least, mut most) = (Duration::ZERO, LOOK);
        while !self.is_followed.swap(true, Ordering::SeqCst) {
            while self.is_running() && !closing.is_cancelled() {
                tokio::select! {
                    () = next_look(&mut changed, least, most) => {}
                    () = closing.cancelled() => break,
                }
                let started = Instant::now();
                if let Err(error) = self.look(store).await {
                    tracing::warn!(study = self.id, %error, "how a study stands is not known");
                }
                (least, most) = pauses_after(started.elapsed());
            }
            self.is_followed.store(false, Ordering::SeqCst);
            // It may have been asked for again in this moment, by one who believed that it is followed.
            if !self.is_running() || closing.is_cancelled() {
                return;
            }
        }
    }
}

/// What comes of several things that are asked of a store, or of waiting for others who ask it, in the time that one of them may take.
async fn patiently<T, E: From<StoreError>>(future: impl Future<Output = Result<T, E>>) -> Result<T, E> {
    tokio::time::timeout(PATIENCE, future).await.unwrap_or_else(|_| Err(StoreError::Silent(PATIENCE).into()))
}

/// Between a look that took so long and the next one.
fn pause_after(look: Duration, least: Duration) -> Duration {
    (LOOKS_SHARE * look).clamp(least, LONGEST_PAUSE)
}

/// Between a look at a study and the next one, where it has come further and where nobody knows.
fn pauses_after(look: Duration) -> (Duration, Duration) {
    (pause_after(look, Duration::ZERO), pause_after(look, LOOK))
}

/// Waits until a study is to be looked at once more: when something has come further, and not before the least pause however often that is, or after the longest.
async fn next_look(changed: &mut watch::Receiver<()>, least: Duration, most: Duration) {
    let latest = Instant::now() + most;
    tokio::time::sleep(least).await;
    tokio::select! {
        _ = changed.changed() => {}
        () = tokio::time::sleep_until(latest) => {}
    }
}

/// What comes of a statement that has its turn until that is known, though nobody waits for it any more: a server that does not come to the end of it comes to it
/// later, and meanwhile the next would have one more beside it.
async fn to_its_end<T: Send + 'static>(
    turn: impl Send + 'static,
    statement: impl Future<Output = Result<T, StoreError>> + Send + 'static,
) -> Result<Result<T, StoreError>, Problem> {
    let ending = async move {
        let _turn = turn;
        statement.await
    };
    tokio::spawn(ending.in_current_span()).await.map_err(|error| Problem::internal(&error))
}

/// Why a stored study is not cancelled or forgotten, as far as anybody knows: a second DELETE would forget one that was cancelled, or was asked for anew.
fn perhaps_done(error: StoreError, done: &str) -> Problem {
    let is_open = error.leaves_open();
    let problem = Problem::from(error);
    if !is_open {
        return problem;
    }
    let detail = format!(
        "the studies' store does not answer in time, and the study may be {done} by now, or soon: look how it stands before you ask again"
    );
    Problem { detail, is_open, ..problem }
}

/// Whether a study's answer is made apart: that of a tolerance study is short, and its rows have to be sorted for it; so is that of a search, and its islands' fronts have to
/// be merged. That of a map is its rows.
fn is_made_apart(study: &Study) -> bool {
    matches!(study.kind(), "tolerance" | "search") && study.stored_bytes() >= LARGE_BYTES
}

/// Whether a stored study need not be begun.
const fn is_there(stored: &Stored) -> bool {
    stored.is_running() || stored.is_done()
}

/// How a stored study stands, in the words of the service.
fn state_of(stored: &Stored) -> (StudyState, Option<Problem>) {
    if stored.is_done() {
        return (StudyState::Done, None);
    }
    if stored.is_cancelled {
        return (StudyState::Cancelled, None);
    }
    if stored.is_exhausted() {
        let (gaps, chunks) = (stored.gaps.len(), stored.study.chunks);
        let detail = format!(
            "{gaps} of the study's {chunks} chunks came to no result, each tried {} times; the others did, and `gaps` names those; the same question tries them anew",
            toothwave_store::MOST_ATTEMPTS
        );
        return (StudyState::Failed, Some(Problem::new(ProblemCode::InternalError, detail)));
    }
    if stored.is_late() {
        return (StudyState::Failed, Some(too_late("its")));
    }
    (StudyState::Running, None)
}

/// The problem of a study that ran out of time.
fn too_late(time: &str) -> Problem {
    let detail = format!(
        "the study did not finish within {time} `study_deadline_ms`; what it has come to is kept, and the same question lets it go on"
    );
    Problem::new(ProblemCode::DeadlineExceeded, detail)
}

impl Studies {
    /// None yet, but for those of the store.
    pub fn new(pool: Pool, room: Room, limits: Limits, keeping: Keeping) -> Self {
        Self {
            pool,
            room,
            limits,
            keeping,
            changed: watch::Sender::default(),
            figures: Mutex::default(),
            kept: Mutex::default(),
            beginning: Arc::default(),
            asked: Arc::default(),
            forgetting: Arc::new(Semaphore::new(FORGET_AT_ONCE)),
            closing: CancellationToken::new(),
        }
    }

    /// Studies that run now.
    pub fn running(&self) -> usize {
        match self.figures() {
            Some(figures) => usize::try_from(figures.running).unwrap_or(usize::MAX),
            None => self.kept.lock().iter().filter(|kept| kept.is_running()).count(),
        }
    }

    /// The store in numbers, where there is one, as it was last seen.
    pub fn figures(&self) -> Option<Figures> {
        *self.figures.lock()
    }

    fn find_here(&self, id: &str) -> Option<Arc<Kept>> {
        self.kept.lock().iter().find(|kept| kept.id == id).cloned()
    }

    /// The study with this id, where it is kept. Who asks for one keeps it from expiring.
    ///
    /// # Errors
    /// Where the store does not answer, this is not the build or the processor that the study was asked of, or there is no room for what it consists of.
    pub async fn find(&self, id: &str) -> Result<Option<Arc<Kept>>, Problem> {
        let here = self.find_here(id);
        let Keeping::Store { store, .. } = &self.keeping else { return Ok(here) };
        let kept = match here.filter(|kept| kept.is_followed.load(Ordering::SeqCst)) {
            Some(kept) => kept,
            None => {
                let kept = match store.look(id).await? {
                    Some(stored) => self.kept_here(store, &stored, &mut None).await?,
                    None => None,
                };
                let Some(kept) = kept else {
                    self.kept.lock().retain(|kept| kept.id != id);
                    return Ok(None);
                };
                self.see(store, &kept).await?;
                kept
            }
        };
        self.is_asked_for(&kept);
        Ok(Some(kept))
    }

    /// Keeps a stored study from expiring, for somebody who asks for it, or still listens.
    pub fn is_asked_for(&self, kept: &Kept) {
        let Keeping::Store { store, .. } = &self.keeping else { return };
        // Until it is next looked at.
        if self.is_to_be_noted(kept.unasked_s.load(Ordering::Relaxed)) {
            kept.unasked_s.store(0, Ordering::Relaxed);
            self.note_asked(store, &kept.id);
        }
    }

    /// Notes that a study was asked for, one after the other. Nobody waits for it, and nobody is refused: who reads needs no store that can be written.
    fn note_asked(&self, store: &Store, id: &str) {
        let is_first = {
            let mut asked = self.asked.lock();
            let is_first = asked.is_empty();
            asked.insert(id.to_owned());
            is_first
        };
        // The others are noted by who notes the first.
        if !is_first {
            return;
        }
        let (store, asked, closing) = (store.clone(), Arc::clone(&self.asked), self.closing.clone());
        let mut next = Some(id.to_owned());
        let noting = async move {
            while let Some(id) = next {
                if let Err(error) = store.touch(&id).await {
                    tracing::warn!(study = id, %error, "that the study was asked for could not be noted");
                }
                let mut asked = asked.lock();
                asked.remove(&id);
                next = asked.first().cloned();
            }
        };
        tokio::spawn(async move { closing.run_until_cancelled(noting).await }.in_current_span());
    }

    /// Whether it is to be noted that a stored study was asked for, which was not for so long.
    fn is_to_be_noted(&self, unasked_s: u64) -> bool {
        let Keeping::Store { expiry, .. } = &self.keeping else { return false };
        unasked_s > (*expiry / NOTE_SHARE).as_secs()
    }

    /// A stored study as it is kept here, without its rows, unless it was forgotten meanwhile.
    ///
    /// # Errors
    /// Where this is not the build or the processor that it was asked of, or there is no room for it.
    async fn kept_here(
        &self,
        store: &Store,
        stored: &Stored,
        room: &mut Option<room::Kept>,
    ) -> Result<Option<Arc<Kept>>, Problem> {
        let cut = stored.study.cut();
        let known = self.kept.lock().iter().find(|kept| kept.cut() == cut).cloned();
        if known.is_some() {
            return Ok(known);
        }
        // A short document may stand for much, of which nothing is counted before it is read.
        if self.room.memory().is_scarce() {
            return Err(NoRoom::Scarce.into());
        }
        let thawed = frozen::thaw(&self.pool, store, &cut, stored.document_bytes).await?;
        let Some(thawed) = thawed else { return Ok(None) };
        let (study, _) = thawed.map_err(|reason| reason.told(&cut.id))?;
        // Each request holds its own, whatever is known of others; who asks it anew has it already.
        let room = match room.take() {
            Some(room) => room,
            None => self.room.keep(view_bytes(&study))?,
        };
        let kept = Self::view(study, Some(room));
        let (state, problem) = state_of(stored);
        kept.stand(state, problem);
        Ok(Some(self.keep_view(kept)))
    }

    fn view(study: Arc<Study>, room: Option<room::Kept>) -> Arc<Kept> {
        let bytes = view_bytes(&study);
        Kept::new(study, None, bytes, room)
    }

    /// Keeps what is known of a stored study, in the place of any other with its id and of the oldest that do not run. Where another has read it meanwhile, that is it.
    fn keep_view(&self, kept: Arc<Kept>) -> Arc<Kept> {
        let mut all = self.kept.lock();
        if let Some(known) = all.iter().find(|known| known.cut() == kept.cut()) {
            return Arc::clone(known);
        }
        all.retain(|other| other.id != kept.id);
        let most_bytes = self.limits.max_study_bytes.min(VIEWS_BYTES);
        let bytes = all.iter().map(|other| other.bytes).sum::<u64>() + kept.bytes;
        let mut beyond_bytes = bytes.saturating_sub(most_bytes);
        all.retain(|other| {
            let goes = beyond_bytes > 0 && !other.is_running();
            beyond_bytes -= if goes { other.bytes.min(beyond_bytes) } else { 0 };
            !goes
        });
        all.push_back(Arc::clone(&kept));
        kept
    }

    /// Keeps a study no longer. Another of its id, asked for meanwhile, stays.
    fn let_go(all: &mut VecDeque<Arc<Kept>>, kept: &Arc<Kept>) {
        all.retain(|other| !Arc::ptr_eq(other, kept));
    }

    /// Looks how a stored study stands, and on while it runs.
    async fn see(&self, store: &Store, kept: &Arc<Kept>) -> Result<(), Problem> {
        kept.look(store).await?;
        if kept.is_running() && !kept.is_followed.load(Ordering::SeqCst) {
            let (followed, store) = (Arc::clone(kept), store.clone());
            let (changed, closing) = (self.changed.clone(), self.closing.clone());
            tokio::spawn(async move { followed.follow(&store, &changed, &closing).await });
        }
        Ok(())
    }

    /// The study, which runs from now on if it is not done: one that is kept goes on where it was.
    ///
    /// # Errors
    /// `queue_full` where as many run as the service admits, `too_many_unread_bytes` where there is no room for what it comes to,
    /// `no_shared_store` where nobody else would know of it, `store_unavailable` where the store does not answer, `deadline_exceeded` where
    /// its canary has no turn until then.
    pub async fn begin(&self, study: Study, document: &[u8], deadline: Instant) -> Result<Arc<Kept>, Problem> {
        match &self.keeping {
            Keeping::Memory => self.begin_here(study),
            Keeping::Store { store, .. } => self.begin_there(store, study, document, deadline).await,
            Keeping::Nowhere => {
                let detail = "this is one of several replicas without a shared store, so the others would know nothing of the study: the setting `studies` names the PostgreSQL database that they share";
                Err(Problem::new(ProblemCode::NoSharedStore, detail))
            }
        }
    }

    async fn begin_there(
        &self,
        store: &Store,
        study: Study,
        document: &[u8],
        deadline: Instant,
    ) -> Result<Arc<Kept>, Problem> {
        let id = study.id().to_string();
        // From here on, as it may wait long for its canary, and many others with it.
        let mut room = Some(self.room.keep(view_bytes(&study))?);
        let (mut asked, mut new) = (Some(study), None);
        loop {
            let stored = store.look(&id).await?;
            let known = match &stored {
                Some(stored) => self.kept_here(store, stored, &mut room).await?,
                None => None,
            };
            let kept = match (stored, known) {
                (Some(stored), Some(kept)) if is_there(&stored) => {
                    if self.is_to_be_noted(stored.unasked.as_secs()) {
                        self.note_asked(store, &id);
                    }
                    Some(kept)
                }
                (_, known) => {
                    if known.is_none()
                        && let Some(study) = asked.take()
                    {
                        // Whoever would be refused needs no canary.
                        self.require_one_more(store).await?;
                        let started = Instant::now();
                        let limits = self.limits.of_calculation();
                        let freezing = frozen::freeze(&self.pool, study, document, &limits, self.time(store));
                        // Each of its slices has a deadline of its own, and waits its turn.
                        let frozen = self.pool.within(deadline, freezing).await?;
                        new = Some((frozen, milliseconds(started.elapsed())));
                    }
                    patiently(self.begin_in_turn(store, &id, known, new.as_ref(), &mut room)).await?
                }
            };
            if let Some(kept) = kept {
                self.see(store, &kept).await?;
                return Ok(kept);
            }
        }
    }

    /// Lets a study run that is known, or is new, if it still stands as it did. Who has the turn waits for nothing but the store.
    async fn begin_in_turn(
        &self,
        store: &Store,
        id: &str,
        known: Option<Arc<Kept>>,
        new: Option<&((Arc<Study>, NewStudy), u64)>,
        room: &mut Option<room::Kept>,
    ) -> Result<Option<Arc<Kept>>, Problem> {
        let turn = Arc::clone(&self.beginning).lock_owned().await;
        let kept = match (store.look(id).await?, known, new) {
            (Some(stored), Some(kept), _) if !is_there(&stored) && stored.study.cut() == kept.cut() => {
                self.require_one_more(store).await?;
                let (store, id, time) = (store.clone(), id.to_owned(), self.time(store));
                to_its_end(turn, async move { store.resume(&id, time).await }).await??;
                kept
            }
            (None, None, Some(((study, frozen), canary_ms))) => {
                self.require_one_more(store).await?;
                let (store, new) = (store.clone(), frozen.clone());
                if !to_its_end(turn, async move { store.create(&new).await }).await?? {
                    // Another replica was first, whose chunks may be others.
                    return Ok(None);
                }
                let NewStudy { chunks, canary_variants, .. } = frozen;
                tracing::info!(study = id, chunks, canary_variants, canary_ms, "a study is kept");
                self.keep_view(Self::view(Arc::clone(study), room.take()))
            }
            // Another has begun, or forgotten, it meanwhile.
            _ => return Ok(None),
        };
        self.changed.send_replace(());
        Ok(Some(kept))
    }

    /// That one more study may run. Those of other builds, and of other kinds of processors, wait for other workers, perhaps for ever.
    async fn require_one_more(&self, store: &Store) -> Result<(), Problem> {
        let of_this_kind = store.waiting().await?.iter().filter(|waiting| waiting.origin == origin()).count();
        if of_this_kind >= self.limits.max_concurrent_studies { Err(self.too_many_studies()) } else { Ok(()) }
    }

    /// Time that a study gets, to the second.
    const fn time(&self, store: &Store) -> Duration {
        if store.address().is_shared() {
            ENDLESS
        } else {
            Duration::from_secs(self.limits.study_deadline_ms.div_ceil(1000))
        }
    }

    fn too_many_studies(&self) -> Problem {
        let most = self.limits.max_concurrent_studies;
        let detail = format!(
            "{most} studies run, as many as `max_concurrent_studies` admits; try again in a moment, or cancel one"
        );
        Problem::new(ProblemCode::QueueFull, detail)
    }

    fn begin_here(&self, study: Study) -> Result<Arc<Kept>, Problem> {
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
        if all.iter().filter(|kept| kept.is_running()).count() >= self.limits.max_concurrent_studies {
            return Err(self.too_many_studies());
        }
        let in_work = self.in_work(&study);
        let working_bytes = study.working_bytes().saturating_mul(in_work);
        // Beside its rows no more than there is.
        let beside = |rows: &Rows| {
            // Each of the two takes whole KiB.
            let left_bytes = self.limits.max_unread_bytes.saturating_sub(rows.bytes().saturating_add(1024));
            working_bytes.min(left_bytes / 1024 * 1024)
        };
        let (kept, working) = match known {
            Some(kept) => {
                // These do not go for it.
                let rows = kept.rows.lock().clone().ok_or_else(|| kept.forgotten())?;
                let working_bytes = beside(&rows);
                self.make_room(&mut all, 0, working_bytes)?;
                (kept, self.room.keep(working_bytes)?)
            }
            None => {
                let study = Arc::new(study);
                let rows = self.new_rows(&mut all, &study, view_bytes(&study), working_bytes)?;
                let working = self.room.keep(beside(&rows))?;
                let kept = Kept::new(study, Some(rows), 0, None);
                all.push_back(Arc::clone(&kept));
                (kept, working)
            }
        };
        // Under the lock: nobody else lets it run as well, or forgets it meanwhile.
        self.run(&kept, in_work, working);
        Ok(kept)
    }

    /// How many pieces of a study are in work at once: one at least, and no more than take their part of the room.
    fn in_work(&self, study: &Study) -> u64 {
        let most = self.limits.max_unread_bytes / PART_OF_CHUNKS / study.working_bytes().max(1);
        study.span().end.min(self.limits.max_concurrent_solves as u64).min(most.max(1))
    }

    /// A place for what a study comes to, none of which is there yet, and so many bytes beside it that stay with it; there is room for so many more while it runs.
    fn new_rows(
        &self,
        all: &mut VecDeque<Arc<Kept>>,
        study: &Arc<Study>,
        beside_bytes: u64,
        working_bytes: u64,
    ) -> Result<Arc<Rows>, Problem> {
        let of_made = if is_made_apart(study) { study.told_bytes() } else { 0 };
        let other_bytes = beside_bytes.saturating_add(of_made);
        let bytes = study.stored_bytes().saturating_add(other_bytes);
        self.make_room(all, bytes, working_bytes)?;
        let room = Mutex::new(self.room.keep(bytes)?);
        let (gathered, gathering, making) = (Mutex::new(Gathered::new(study)), Default::default(), Mutex::default());
        Ok(Arc::new(Rows { gathered, gathering, making, other_bytes, room }))
    }

    /// For what a study comes to, and what its work takes, the oldest go, as many as it takes, and none where all of them would be too few: in memory those that
    /// do not run are forgotten; of stored ones the rows can be read again.
    fn make_room(&self, all: &mut VecDeque<Arc<Kept>>, bytes: u64, working_bytes: u64) -> Result<(), Problem> {
        // Whatever went, nothing would be kept.
        if self.room.memory().is_scarce() {
            return Err(NoRoom::Scarce.into());
        }
        let is_stored = matches!(self.keeping, Keeping::Store { .. });
        let most = self.limits.max_study_bytes;
        let mut left: u64 = all.iter().filter_map(|kept| Some(kept.rows.lock().as_ref()?.bytes())).sum();
        let mut given_back_bytes = 0;
        let mut going: Vec<(Arc<Kept>, Arc<Rows>)> = Vec::new();
        let mut could_go = all
            .iter()
            .filter(|kept| is_stored || !kept.is_running())
            .filter_map(|kept| Some((Arc::clone(kept), kept.unread_rows()?)));
        loop {
            // One that was admitted when the bound was larger has all of it; what is kept already is.
            let is_within = bytes == 0 || left + bytes.min(most) <= most;
            let both_bytes = bytes.saturating_add(1024).saturating_add(working_bytes);
            if is_within && self.room.could_keep(both_bytes, given_back_bytes) {
                break;
            }
            match could_go.next() {
                Some((kept, rows)) => {
                    {
                        let room = rows.room.lock();
                        left = left.saturating_sub(room.bytes());
                        given_back_bytes += room.held_bytes();
                    }
                    going.push((kept, rows));
                }
                None if is_within => {
                    going.clear();
                    break;
                }
                None => return Err(self.no_room(bytes)),
            }
        }
        drop(could_go);
        for (kept, _) in &going {
            *kept.rows.lock() = None;
        }
        if !is_stored && !going.is_empty() {
            all.retain(|kept| kept.rows.lock().is_some());
        }
        Ok(())
    }

    fn no_room(&self, bytes: u64) -> Problem {
        let most = self.limits.max_study_bytes;
        let detail = if matches!(self.keeping, Keeping::Store { .. }) {
            format!(
                "the study's result takes {bytes} bytes: with those that are being read more than the {most} of `max_study_bytes`; try again in a moment"
            )
        } else {
            format!(
                "the study takes {bytes} bytes: with those that run, or are being read, more than the {most} of `max_study_bytes`; try again when one of them is done"
            )
        };
        Problem::new(ProblemCode::QueueFull, detail)
    }

    /// Where a study has what it comes to, as far as it is here.
    fn rows(&self, kept: &Kept) -> Result<Arc<Rows>, Problem> {
        let mut all = self.kept.lock();
        let here = kept.rows.lock().clone();
        match (here, &self.keeping) {
            (Some(rows), _) => Ok(rows),
            (None, Keeping::Store { .. }) => {
                let rows = self.new_rows(&mut all, &kept.study, 0, 0)?;
                *kept.rows.lock() = Some(Arc::clone(&rows));
                Ok(rows)
            }
            (None, Keeping::Memory | Keeping::Nowhere) => Err(kept.forgotten()),
        }
    }

    /// Cancels a study that runs, and forgets one that does not; whether it was kept. A stored one may be of another build.
    ///
    /// # Errors
    /// Where the store does not answer.
    pub async fn cancel_or_forget(&self, id: &str) -> Result<bool, Problem> {
        let Keeping::Store { store, .. } = &self.keeping else {
            let mut all = self.kept.lock();
            let Some(kept) = all.iter().find(|kept| kept.id == id).cloned() else { return Ok(false) };
            if kept.is_running() {
                kept.cancel();
            } else {
                Self::let_go(&mut all, &kept);
            }
            return Ok(true);
        };
        let asked = Instant::now();
        let (here, stored) = (self.find_here(id), store.look(id).await?);
        let is_running = stored.as_ref().is_some_and(Stored::is_running);
        if is_running {
            // All of it within the time that a proxy waits.
            let cancelled = tokio::time::timeout_at(asked + PATIENCE, store.cancel(id)).await;
            cancelled.unwrap_or(Err(StoreError::Silent(PATIENCE))).map_err(|error| perhaps_done(error, "cancelled"))?;
        } else if stored.is_some() {
            self.forget_apart(store, id, asked + PATIENCE).await?;
        }
        if stored.is_some() {
            // Workers learn it at once where they are here.
            self.changed.send_replace(());
        }
        match here {
            Some(kept) if is_running => {
                let looked = tokio::time::timeout_at(asked + PATIENCE, kept.look(store)).await;
                if !matches!(looked, Ok(Ok(_))) {
                    // It is cancelled, though how far it came may not be told now.
                    kept.stand(StudyState::Cancelled, None);
                }
            }
            Some(kept) => Self::let_go(&mut self.kept.lock(), &kept),
            None => {}
        }
        Ok(stored.is_some())
    }

    /// Forgets a stored study, which goes on when the time is over: one of very many chunks takes long, and so does a server whose disk stands still. Few do at once, so
    /// that others find the store's connections.
    async fn forget_apart(&self, store: &Store, id: &str, until: Instant) -> Result<(), Problem> {
        let silent = || StoreError::Silent(PATIENCE);
        let turn = tokio::time::timeout_at(until, Arc::clone(&self.forgetting).acquire_owned()).await;
        let turn = turn.map_err(|_| silent())?.map_err(|error| Problem::internal(&error))?;
        let (store, id) = (store.clone(), id.to_owned());
        let forgetting = to_its_end(turn, async move { store.forget(&id).await });
        let forgotten = tokio::time::timeout_at(until, forgetting).await;
        forgotten.unwrap_or_else(|_| Ok(Err(silent())))?.map_err(|error| perhaps_done(error, "forgotten"))
    }

    /// What a study has come to, or the rows that its answer is soon made of.
    ///
    /// # Errors
    /// Where the store does not answer, there is no room, or the time is over.
    pub async fn read(&self, kept: &Arc<Kept>, deadline: Instant) -> Result<Reading, Problem> {
        let rows = self.rows(kept)?;
        let made = self.made_apart(kept, &rows, deadline).await?;
        if let (None, Keeping::Store { store, .. }) = (&made, &self.keeping) {
            // Meanwhile it holds room, and the turn may be behind variants of minutes. What has come by then stays.
            let gathered = Box::pin(kept.gather(&rows, store, &self.pool));
            self.pool.within(deadline, gathered).await?;
        }
        Ok(Reading { kept: Arc::clone(kept), rows, made })
    }

    /// What a study has come to, where that takes long to be made of its rows: made once for all who ask meanwhile, and apart from their
    /// requests, so that it goes on when the time of one of them is over.
    async fn made_apart(
        &self,
        kept: &Arc<Kept>,
        rows: &Arc<Rows>,
        deadline: Instant,
    ) -> Result<Option<Arc<Made>>, Problem> {
        if !is_made_apart(&kept.study) {
            return Ok(None);
        }
        let making = {
            let mut making = rows.making.lock();
            match &*making {
                Some(making) if kept.serves(making) => making.clone(),
                _ => making.insert(self.making(kept, rows)).clone(),
            }
        };
        let made = tokio::time::timeout_at(deadline, making.made).await.map_err(|_| {
            let detail =
                "the study's answer is still being made of its rows, which goes on; ask for it again in a moment";
            Problem::new(ProblemCode::DeadlineExceeded, detail)
        })??;
        Ok(Some(made))
    }

    fn making(&self, kept: &Arc<Kept>, rows: &Arc<Rows>) -> Making {
        let changes = kept.state.borrow().changes;
        let wanted = Arc::new(());
        let is_wanted = Arc::downgrade(&wanted);
        let (kept, rows, pool, room) = (Arc::clone(kept), Arc::clone(rows), self.pool.clone(), self.room.clone());
        let store = match &self.keeping {
            Keeping::Store { store, .. } => Some(store.clone()),
            Keeping::Memory | Keeping::Nowhere => None,
        };
        let made = async move {
            if let Some(store) = &store {
                kept.gather(&rows, store, &pool).await?;
            }
            // Who waits for a turn keeps nothing from being forgotten.
            let (kept_then, rows_then) = (Arc::downgrade(&kept), Arc::downgrade(&rows));
            drop((kept, rows));
            let make = move || {
                let (Some(kept), Some(rows), Some(_wanted)) =
                    (kept_then.upgrade(), rows_then.upgrade(), is_wanted.upgrade())
                else {
                    return Err(Problem::internal(&"nobody wants this answer any more"));
                };
                let _reserved = room.reserve(kept.study.stored_bytes())?;
                let gathered = kept.gathered(&rows);
                let (answer, is_whole) = (gathered.answer(), gathered.is_complete());
                Ok(Arc::new(Made { answer, is_whole, at: Instant::now() }))
            };
            pool.run_unhurried(make).await
        };
        let made = tokio::spawn(made.in_current_span());
        let made = made.map(|joined| joined.unwrap_or_else(|error| Err(Problem::internal(&error)))).boxed().shared();
        Making { made, _wanted: wanted, changes }
    }

    /// What a store is served by in this process, until the service is told to stop: the workers where it is a file, and whoever forgets old studies and counts.
    pub async fn serve_store(&self) {
        let Keeping::Store { store, expiry, parts } = &self.keeping else { return };
        let workers = async {
            if !store.address().is_shared() {
                // What a chunk has come to is little: it is begun anew.
                let patience = Duration::ZERO;
                // The file may be from a time of more memory; what is admitted now is computed now.
                let capacity = Capacity {
                    slots: self.limits.max_concurrent_solves,
                    slots_for_others: self.limits.max_concurrent_studies.saturating_sub(1),
                    chunks_bytes: self.limits.max_unread_bytes / PART_OF_CHUNKS,
                    variant_bytes: self.limits.max_unread_bytes,
                    admitted_states: self.limits.max_states,
                };
                Workers::new(
                    store.clone(),
                    parts.clone(),
                    self.pool.clone(),
                    capacity,
                    self.changed.clone(),
                    self.closing.clone(),
                    patience,
                )
                .work()
                .await;
            }
        };
        let count = async {
            let mut pause = Duration::ZERO;
            while !self.paused(pause).await {
                let started = Instant::now();
                if let Ok(figures) = store.figures().await {
                    *self.figures.lock() = Some(figures);
                }
                pause = pause_after(started.elapsed(), COUNT);
            }
        };
        let forget = async {
            while !self.paused(EXPIRE).await {
                match store.expire(expiry.saturating_add(*expiry / NOTE_SHARE)).await {
                    Ok(0) => {}
                    Ok(studies) => tracing::info!(studies, "forgotten, because nobody has asked for them for long"),
                    Err(error) => tracing::warn!(%error, "old studies could not be forgotten"),
                }
            }
        };
        let others = async {
            tokio::select! {
                _ = async { tokio::join!(count, forget) } => {}
                () = self.closing.cancelled() => {}
            }
        };
        tokio::join!(workers, others);
    }

    /// Lets go of the store, when nobody asks it any more.
    pub async fn close_store(&self) {
        let Keeping::Store { store, .. } = &self.keeping else { return };
        if store.address().is_shared() {
            // A server that does not hear of it finds it out.
            let _ = tokio::time::timeout(CLOSE, store.close()).await;
        } else {
            store.close().await;
        }
    }

    /// Waits; whether the service closes instead.
    async fn paused(&self, pause: Duration) -> bool {
        tokio::select! {
            () = tokio::time::sleep(pause) => false,
            () = self.closing.cancelled() => true,
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

    /// Lets so many pieces of a study run at once, which take this room until they are over.
    fn run(&self, kept: &Arc<Kept>, in_work: u64, working: room::Kept) {
        let cancelled = CancellationToken::new();
        *kept.cancelled.lock() = cancelled.clone();
        kept.looked_at.store(kept.here(|gathered| gathered.variants()), Ordering::Relaxed);
        kept.stand(StudyState::Running, None);
        let deadline = Instant::now() + Duration::from_millis(self.limits.study_deadline_ms);
        let (kept, pool, limits) = (Arc::clone(kept), self.pool.clone(), self.limits);
        tokio::spawn(async move {
            let missing: Vec<_> = kept.here(|gathered| gathered.missing().collect());
            let shares = LEAST_PIECES.max(4 * limits.max_concurrent_solves as u64);
            // An island is a piece of its own.
            let most = if kept.study.has_rows() { kept.study.span().end.div_ceil(shares) } else { 1 };
            let pieces = missing.into_iter().flat_map(|span| {
                let starts = span.clone().step_by(usize::try_from(most).unwrap_or(usize::MAX));
                starts.map(move |start| start..span.end.min(start + most))
            });
            let pieces = Arc::new(Pieces(Mutex::new(pieces.collect())));
            let working = Arc::new(working);
            let side_by_side = (0..in_work).map(|_| run_pieces(&pool, &kept, &pieces, &working, &cancelled));
            let chunks = try_join_all(side_by_side);
            let ended = tokio::select! {
                // First: what is cancelled begins nothing more. It was said to stand so already.
                biased;
                () = cancelled.cancelled() => return,
                ended = tokio::time::timeout_at(deadline, chunks) => ended,
            };
            // Who is cancelled in this moment says nothing more: it may run again.
            let _held = kept.cancelled.lock();
            if cancelled.is_cancelled() {
                return;
            }
            match ended {
                Ok(Ok(_)) if kept.here(|gathered| gathered.is_complete()) => kept.stand(StudyState::Done, None),
                Ok(Ok(_)) => {
                    let problem = Problem::internal(&"not all of the study was worked on");
                    kept.break_off(StudyState::Failed, Some(problem));
                }
                Ok(Err(problem)) => kept.break_off(StudyState::Failed, Some(problem)),
                Err(_) => {
                    let problem = too_late(&format!("the {} ms of", limits.study_deadline_ms));
                    kept.break_off(StudyState::Failed, Some(problem));
                }
            }
        });
    }
}

/// What of a study is still to be worked on, the first piece first.
#[derive(Debug)]
struct Pieces(Mutex<VecDeque<Range<u64>>>);

impl Pieces {
    fn next(&self, study: &Arc<Study>) -> Option<Work> {
        let piece = self.0.lock().pop_front()?;
        Some(Work::of_span(study, piece).within(SMALL_VARIANT_BYTES))
    }
}

/// What a slice has done of pieces.
struct Come {
    /// The piece that is not over, to go on with.
    rest: Option<Work>,
    over: Vec<(Range<u64>, Part)>,
    variants: u64,
    busy: Duration,
}

impl Come {
    /// One piece after the other, as far as the slice's time goes.
    fn of(
        mut work: Work,
        study: &Arc<Study>,
        pieces: &Pieces,
        time: &mut Slice,
        stop: &AtomicBool,
    ) -> Result<Self, Problem> {
        let (mut over, mut variants) = (Vec::new(), 0);
        let rest = loop {
            let sliced = slice(work, time, stop)?;
            variants += sliced.variants;
            if !sliced.is_over {
                break Some(sliced.work);
            }
            over.push(sliced.work.finish_span());
            let next = if time.is_over() { None } else { pieces.next(study) };
            let Some(next) = next else { break None };
            work = next;
        };
        Ok(Self { rest, over, variants, busy: time.busy() })
    }
}

/// Works pieces out, a slice at a time, until there are no more, and hands over what they come to.
async fn run_pieces(
    pool: &Pool,
    kept: &Arc<Kept>,
    pieces: &Arc<Pieces>,
    working: &Arc<room::Kept>,
    cancelled: &CancellationToken,
) -> Result<(), Problem> {
    // One that runs has them.
    let rows = kept.rows.lock().clone().ok_or_else(|| kept.forgotten())?;
    let (mut lane, mut rest, mut busy) = (Lane::default(), None, Duration::ZERO);
    while let Some(work) = rest.take().or_else(|| pieces.next(&kept.study)) {
        let room_bytes = work.room_bytes();
        let (study, pieces, working) = (Arc::clone(&kept.study), Arc::clone(pieces), Arc::clone(working));
        let job = move |time: &mut Slice, stop: &AtomicBool| {
            // A slice that nobody waits for any more still has it.
            let _working = working;
            Come::of(work, &study, &pieces, time, stop)
        };
        let mut came = pool.run_variants(&mut lane, room_bytes, job).await?;
        counter!("toothwave_study_variants_total").increment(came.variants);
        busy += came.busy;
        if busy >= HAND_OVER {
            busy = Duration::ZERO;
            came.over.extend(came.rest.as_mut().and_then(Work::hand_over));
        }
        // Whoever cancels it says what it has come to: from then on no more comes.
        let _held = kept.cancelled.lock();
        if cancelled.is_cancelled() {
            return Ok(());
        }
        kept.looked_at.fetch_add(came.variants, Ordering::Relaxed);
        let more_bytes = came.over.iter().map(|(_, part)| part.bytes() as u64).sum();
        rows.add(more_bytes, |gathered| {
            came.over.into_iter().for_each(|(span, part)| gathered.add_span(span, part));
            kept.impossible.store(gathered.refused(), Ordering::Relaxed);
        })?;
        kept.state.send_modify(|_| {});
        rest = came.rest;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn looks_take_a_tenth_of_the_time_and_follow_soon_on_a_database_that_was_away() {
        assert_eq!(pause_after(Duration::from_millis(3), LOOK), LOOK);
        assert_eq!(pause_after(Duration::from_millis(400), LOOK), Duration::from_secs(4));
        assert_eq!(pause_after(Duration::from_secs(8), LOOK), LONGEST_PAUSE);
        assert_eq!(pauses_after(Duration::from_millis(3)), (Duration::from_millis(30), LOOK));
    }

    /// After a database that was away it was 20 s, and a study that had been cancelled or was done was told as running so long.
    #[tokio::test(start_paused = true)]
    async fn of_the_two_pauses_before_a_look_the_longer_one_is_waited_for_and_not_both() {
        let sender = watch::Sender::default();
        let (mut changed, begun) = (sender.subscribe(), Instant::now());
        next_look(&mut changed, LONGEST_PAUSE, LONGEST_PAUSE).await;
        assert_eq!(begun.elapsed(), LONGEST_PAUSE);
        sender.send_replace(());
        next_look(&mut changed, LOOK, LONGEST_PAUSE).await;
        assert_eq!(begun.elapsed(), LONGEST_PAUSE + LOOK);
    }

    /// One that was cancelled, asked for again and done in that time was answered with what it had come to before, as that of one that is done.
    #[test]
    fn an_answer_that_is_being_made_serves_who_asks_while_the_study_stands_as_it_did() {
        let document = include_bytes!("../../examples/paper-5.1.json");
        let base: serde_json::Value = serde_json::from_slice(document).expect("a design");
        let over = serde_json::json!({ "/drive/teeth/radius_mm": { "min": 3.0, "max": 5.0, "steps": 3 } });
        let question = serde_json::json!({ "study": "map", "base": base, "over": over }).to_string();
        let calculation = toothwave_calculation::question::Limits { max_states: 1000, max_profile_points: 1000 };
        let limits = toothwave_study::Limits { calculation, max_study_variants: 10, max_study_bytes: u64::MAX };
        let study = Study::read(question.as_bytes(), &limits).expect("a study");
        let kept = Kept::new(Arc::new(study), None, 0, None);
        let making = || {
            let made = futures_util::future::pending().boxed().shared();
            Making { made, _wanted: Arc::default(), changes: kept.state.borrow().changes }
        };
        let of_running = making();
        kept.stand(StudyState::Running, None);
        assert!(kept.serves(&of_running));
        kept.stand(StudyState::Cancelled, None);
        let of_cancelled = making();
        assert!(kept.serves(&of_cancelled) && !kept.serves(&of_running));
        // Made when nobody waited any more: it was thrown away, and made anew for whoever came back, again and again.
        let answer = Gathered::new(&kept.study).answer();
        let made = Arc::new(Made { answer, is_whole: false, at: Instant::now() });
        let made = futures_util::future::ready(Ok(made)).boxed().shared();
        let ready = Making { made, ..making() };
        assert!(kept.serves(&ready));
        kept.stand(StudyState::Running, None);
        assert!(kept.serves(&of_cancelled), "it is told that it is not complete");
        kept.stand(StudyState::Done, None);
        assert!(!kept.serves(&of_cancelled) && !kept.serves(&ready));
        let of_done = making();
        kept.stand(StudyState::Done, None);
        assert!(kept.serves(&of_done));
    }
}
