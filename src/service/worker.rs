//! Workers: they take chunks of stored studies, one after the other, compute them and keep what they come to.

use std::collections::{BTreeMap, HashMap};
use std::convert::Infallible;
use std::error::Error;
use std::future;
use std::pin::pin;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::{Duration, Instant};

use bytes::Bytes;
use futures_util::future::join_all;
use metrics::counter;
use parking_lot::Mutex;
use tokio::sync::{OwnedSemaphorePermit, Semaphore, SemaphorePermit, watch};
use tokio_util::sync::CancellationToken;
use toothwave_calculation::no_answer::NoAnswer;
use toothwave_store::{Claim, Lease, MOST_ATTEMPTS, NewStudy, Store, StoreError, Waiting};
use toothwave_study::{Interrupted, Part, Study, Work};

use crate::compute::{Lane, Pool, SMALL_VARIANT_BYTES, Slice};
use crate::frozen::{self, NotHere, view_bytes};
#[cfg(feature = "fault-injection")]
use crate::injected;
use crate::parts::Parts;
use crate::problem::{Problem, ProblemCode};
use crate::shelf::{SharedRoom, Shelf};

/// Between two looks at what there is to do, and at what was cancelled.
const PAUSE: Duration = Duration::from_secs(1);

/// For so long a chunk that is computed beside none waits for that, and has others wait: what ends a process mostly does so at once, and chunks may take minutes.
const ALONE: Duration = Duration::from_secs(3);

/// Between two looks at memory that is scarce.
const SCARCE_PAUSE: Duration = Duration::from_millis(20);

/// After so long nothing that is held of scarce memory comes back by itself where unread answers do not fill it: what the allocator keeps it uses again for who asks.
const LONGEST_SCARCE: Duration = Duration::from_secs(10);

/// Of a `worker`'s memory, or of what unread answers may take, chunks that are in work may take such a part.
pub const PART_OF_CHUNKS: u64 = 8;

/// Between two tries to keep a result: at first, and at most.
const RETRY: Duration = Duration::from_millis(200);
const LONGEST_RETRY: Duration = Duration::from_secs(10);

/// The workers of this process.
#[derive(Debug)]
pub struct Workers {
    store: Store,
    /// Where rows are kept besides.
    parts: Option<Parts>,
    pool: Pool,
    capacity: Capacity,
    /// Told when a study was asked for, or has come further, in this process.
    changed: watch::Sender<()>,
    /// Cancelled when no chunk is to be begun any more.
    stopping: CancellationToken,
    /// What a chunk that is in work then gets to come to its end.
    patience: Duration,
    /// Each in the hands of one slot at a time.
    known: Mutex<HashMap<Waiting, Arc<tokio::sync::Mutex<Seen>>>>,
    shelf: Shelf<Waiting, Ours>,
    /// One for each chunk that may be in work here: all of them for one that is computed beside none.
    side_by_side: Semaphore,
    /// Chunks of each study that are in work here.
    in_work: Mutex<HashMap<String, usize>>,
    room: SharedRoom,
    /// Shared by all chunks that are begun and not over.
    begun: Arc<()>,
    /// Held by the one that is begun though memory is scarce.
    though_scarce: Semaphore,
    /// What was last said of each.
    troubles: Mutex<BTreeMap<What, String>>,
}

/// What workers have room for. A variant that takes more would end the process, and each that takes it up again, canary first.
#[derive(Debug, Clone, Copy)]
pub struct Capacity {
    /// Chunks of one study that are computed side by side.
    pub slots: usize,
    /// Besides, one of each of so many other studies: a chunk may be long, and they are not to wait for its end. All of them are computed in slices that take turns.
    pub slots_for_others: usize,
    /// What all chunks that are in work may take at once, beside the variants that are computed; and what all studies may that they are of.
    pub chunks_bytes: u64,
    /// What a variant may take while it is computed,
    pub variant_bytes: u64,
    /// unless its study lets none have more states than this: such a one was admitted here.
    pub admitted_states: u64,
}

impl Capacity {
    const fn all_slots(&self) -> usize {
        self.slots + self.slots_for_others
    }
}

/// What may be in trouble: on a full device the store is read and not written.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum What {
    Reading,
    Writing,
    Parts,
}

impl What {
    const fn name(self) -> &'static str {
        match self {
            Self::Reading => "the studies' store",
            Self::Writing => "what is written to the studies' store",
            Self::Parts => "the folder of the studies' rows",
        }
    }
}

/// What is known of a study that waits, whether or not it is read.
#[derive(Debug, Default)]
struct Seen {
    /// Whether this process is known to compute its bits.
    has_sung: bool,
    /// Whether it is known not to.
    is_left_to_others: bool,
    /// Whether it could not be looked at the last time, which was said.
    is_in_trouble: bool,
    /// What it takes once it is read, as far as is known.
    bytes: u64,
}

/// A study that this process computes.
#[derive(Debug)]
struct Ours {
    study: Arc<Study>,
    frozen: NewStudy,
    /// What a variant of it may take while it is computed.
    most_bytes: u64,
    /// What a chunk takes that is in work, beside the study.
    chunk_bytes: u64,
    _room: OwnedSemaphorePermit,
}

/// Why a study is not to be had.
enum Unseen {
    /// It waits no more.
    Gone,
    /// Others that are used take all the room, and one waits for some.
    NoRoom,
    /// All its chunks are done or in work.
    NothingFree,
    /// It is computed by others.
    NotHere(NotHere),
    Problem(Problem),
}

impl From<NotHere> for Unseen {
    fn from(reason: NotHere) -> Self {
        Self::NotHere(reason)
    }
}

impl From<Problem> for Unseen {
    fn from(problem: Problem) -> Self {
        Self::Problem(problem)
    }
}

/// A chunk of a study that is in work, or may soon be.
struct InWork<'a> {
    all: &'a Mutex<HashMap<String, usize>>,
    id: &'a str,
}

impl<'a> InWork<'a> {
    /// Where fewer than so many are.
    fn one_more(all: &'a Mutex<HashMap<String, usize>>, id: &'a str, most: usize) -> Option<Self> {
        let mut counts = all.lock();
        let count = counts.entry(id.into()).or_default();
        (*count < most).then(|| {
            *count += 1;
            Self { all, id }
        })
    }
}

impl Drop for InWork<'_> {
    fn drop(&mut self) {
        let mut counts = self.all.lock();
        if let Some(count) = counts.get_mut(self.id) {
            *count -= 1;
            if *count == 0 {
                counts.remove(self.id);
            }
        }
    }
}

/// The studies that wait, as far as is known.
type Tasks = watch::Receiver<Arc<Vec<Waiting>>>;

impl Workers {
    /// Workers who have not begun yet.
    pub fn new(
        store: Store,
        parts: Option<Parts>,
        pool: Pool,
        capacity: Capacity,
        changed: watch::Sender<()>,
        stopping: CancellationToken,
        patience: Duration,
    ) -> Self {
        let (known, in_work, troubles) = Default::default();
        let side_by_side = Semaphore::new(capacity.all_slots());
        let shelf = Shelf::new(capacity.chunks_bytes, capacity.all_slots());
        let room = SharedRoom::new(capacity.chunks_bytes, capacity.all_slots());
        let (begun, though_scarce) = (Arc::default(), Semaphore::new(1));
        Self {
            store,
            parts,
            pool,
            capacity,
            changed,
            stopping,
            patience,
            known,
            shelf,
            side_by_side,
            in_work,
            room,
            begun,
            though_scarce,
            troubles,
        }
    }

    /// Works until it is told to stop.
    pub async fn work(&self) {
        let (tell, tasks) = watch::channel(Arc::default());
        let over = CancellationToken::new();
        let slots = async {
            join_all((0..self.capacity.all_slots()).map(|slot| self.fill(slot, tasks.clone()))).await;
            over.cancel();
        };
        tokio::join!(slots, self.look(&tell, &over));
    }

    /// Looks every second what there is to do. Chunks that are in work when it stops still learn that they are not wanted.
    async fn look(&self, tell: &watch::Sender<Arc<Vec<Waiting>>>, over: &CancellationToken) {
        let mut changed = self.changed.subscribe();
        while !over.is_cancelled() {
            match self.store.waiting().await {
                Ok(waiting) => {
                    self.is_well(What::Reading);
                    self.known.lock().retain(|task, _| waiting.contains(task));
                    self.shelf.retain(|task| waiting.contains(task));
                    tell.send_replace(Arc::new(waiting));
                }
                // What was begun may go on: it is kept when the store is back.
                Err(error) => self.is_in_trouble(What::Reading, &error),
            }
            tokio::select! {
                () = tokio::time::sleep(PAUSE) => {}
                _ = changed.changed() => {}
                () = over.cancelled() => {}
            }
        }
    }

    /// One chunk after the other, of the studies in turn, first of those of which the fewest are in work.
    async fn fill(&self, slot: usize, mut tasks: Tasks) {
        let Capacity { slots, .. } = self.capacity;
        let most_in_work = if slot < slots { slots } else { 1 };
        let (mut turn, mut lane, mut last) = (slot, Lane::default(), None);
        while !self.stopping.is_cancelled() {
            let waiting = Arc::clone(&tasks.borrow_and_update());
            let mut has_worked = false;
            let mut in_turn: Vec<_> =
                (0..waiting.len()).map(|offset| turn.wrapping_add(offset) % waiting.len()).collect();
            {
                let in_work = self.in_work.lock();
                in_turn.sort_by_key(|&index| in_work.get(&waiting[index].cut.id).copied());
            }
            for index in in_turn {
                if self.stopping.is_cancelled() {
                    return;
                }
                let task = &waiting[index];
                let Some(_one_more) = InWork::one_more(&self.in_work, &task.cut.id, most_in_work) else { continue };
                // A canary that is begun is no chunk: whoever is told to stop leaves it.
                let ready = tokio::select! {
                    biased;
                    () = self.stopping.cancelled() => return,
                    // It was cancelled, or forgotten.
                    _ = tasks.wait_for(|waiting| !waiting.contains(task)) => None,
                    ready = self.ready(task) => ready,
                };
                let Some(ready) = ready else { continue };
                let lease = ready.0.frozen.lease;
                // One whose attempt is being noted is claimed, and then given back.
                match self.claim(task, lease, ready, &mut tasks).await {
                    Ok((Claim::Chunk(lease), _)) if self.stopping.is_cancelled() => return give_up(lease).await,
                    Ok((Claim::Chunk(lease), None)) => give_up(lease).await,
                    Ok((Claim::Chunk(lease), Some(((ours, _held), mut beside)))) => {
                        // What another study has had of the time is not this one's.
                        if last.replace(task.cut.clone()).is_none_or(|last| last != task.cut) {
                            lane = Lane::default();
                        }
                        let no_longer_alone = async {
                            tokio::time::sleep(ALONE).await;
                            // Its own stays, so that one that is to be computed beside none sees it.
                            drop(beside.split(beside.num_permits().saturating_sub(1)));
                            future::pending::<Infallible>().await
                        };
                        tokio::select! {
                            () = self.compute(&mut lane, task, &ours, lease, &mut tasks) => {}
                            never = no_longer_alone => match never {},
                        }
                        has_worked = true;
                    }
                    Ok((Claim::Gap(chunk), _)) => {
                        tracing::warn!(study = task.cut.id, chunk, "a chunk was given up: no attempt came to a result");
                        self.changed.send_replace(());
                        has_worked = true;
                    }
                    Ok((Claim::None, _)) => {}
                    Err(error) => self.is_in_trouble(What::Writing, &error),
                }
                if has_worked {
                    turn = index + 1;
                    break;
                }
            }
            if !has_worked {
                tokio::select! {
                    _ = tasks.changed() => {}
                    () = self.stopping.cancelled() => {}
                }
            }
        }
    }

    /// A chunk that is begun, and what is held until it is over, what it is computed beside among it: one that came to no result in all attempts but the last may be what
    /// ended its process, and is computed beside none, so that no other is taken for that.
    async fn claim<H>(
        &self,
        task: &Waiting,
        lease: Duration,
        held: H,
        tasks: &mut Tasks,
    ) -> Result<(Claim, Option<(H, SemaphorePermit<'_>)>), StoreError> {
        let nothing = Ok((Claim::None, None));
        let found = async {
            let Some(lease) = self.store.hold(&task.cut, lease).await? else { return Ok(None) };
            let attempts = lease.attempts().await?;
            Ok::<_, StoreError>(Some((lease, attempts)))
        };
        let found = tokio::select! {
            found = found => found?,
            () = self.stopping.cancelled() => None,
        };
        let Some((mut lease, attempts)) = found else { return nothing };
        if attempts >= MOST_ATTEMPTS {
            // What it would be computed with is others' while it is seen whether it becomes a gap.
            drop(held);
            let attempts = tokio::select! {
                attempts = lease.attempts_that_count() => attempts?,
                () = self.stopping.cancelled() => return nothing,
                // It was cancelled, or forgotten.
                _ = tasks.wait_for(|waiting| !waiting.contains(task)) => return nothing,
            };
            // Where one was taken back it is claimed as any other.
            return if attempts < MOST_ATTEMPTS { nothing } else { Ok((lease.begin().await?, None)) };
        }
        let all = u32::try_from(self.capacity.all_slots()).unwrap_or(u32::MAX);
        // An error says that the semaphore is closed, which it never is.
        let beside = async {
            if attempts + 1 == MOST_ATTEMPTS
                && let Ok(none) = tokio::time::timeout(ALONE, self.side_by_side.acquire_many(all)).await
            {
                return none.ok();
            }
            self.side_by_side.acquire().await.ok()
        };
        let beside = tokio::select! {
            beside = beside => beside,
            () = self.stopping.cancelled() => return nothing,
            never = lease.renew() => match never {},
        };
        Ok((lease.begin().await?, beside.map(|beside| (held, beside))))
    }

    /// A study of which a chunk can be begun, and what that holds until it is over; none where another slot has the study in hand, or waits for room as this one
    /// would: there are others.
    async fn ready(&self, task: &Waiting) -> Option<(Arc<Ours>, impl Sized)> {
        let though_scarce = self.memory().await;
        let ours = self.study(task).await?;
        let room = self.room.take(ours.chunk_bytes).await?;
        let though_scarce = match though_scarce {
            // The study itself may have made it so: it goes on where nothing else does, or is let go until then.
            None if self.pool.memory().is_scarce() => {
                Some(self.though_scarce.try_acquire().ok().filter(|_| self.is_none_begun())?)
            }
            held => held,
        };
        Some((ours, (room, though_scarce, Arc::clone(&self.begun))))
    }

    fn is_none_begun(&self) -> bool {
        Arc::strong_count(&self.begun) == 1
    }

    /// Waits while memory is scarce, so that what is in work comes to its end and is let go before more is begun. Where nothing is, and unread answers do not fill it, that
    /// would be for ever: one is begun all the same after a while, beside none.
    async fn memory(&self) -> Option<SemaphorePermit<'_>> {
        while self.pool.memory().is_scarce() {
            self.shelf.clear();
            if self.is_none_begun()
                && !self.pool.has_much_unread()
                && self.pool.memory().scarce_for() > LONGEST_SCARCE
                && let Ok(alone) = self.though_scarce.try_acquire()
            {
                return Some(alone);
            }
            tokio::time::sleep(SCARCE_PAUSE).await;
        }
        None
    }

    /// The study, where this process computes it, and has room to read it.
    async fn study(&self, task: &Waiting) -> Option<Arc<Ours>> {
        let seen = Arc::clone(self.known.lock().entry(task.clone()).or_default());
        let mut seen = seen.try_lock().ok()?;
        if seen.is_left_to_others {
            return None;
        }
        match self.found(task, &mut seen).await {
            Ok(ours) => {
                seen.is_in_trouble = false;
                return Some(ours);
            }
            Err(Unseen::Gone | Unseen::NoRoom | Unseen::NothingFree) => {}
            Err(Unseen::NotHere(reason)) => {
                say_left_to_others(task, &reason);
                seen.is_left_to_others = true;
            }
            // Another time.
            Err(Unseen::Problem(problem)) => {
                if problem.code == ProblemCode::TooManyUnreadBytes {
                    self.shelf.clear();
                }
                if !std::mem::replace(&mut seen.is_in_trouble, true) {
                    let cause = problem.cause.as_deref();
                    tracing::warn!(study = task.cut.id, %problem, cause, "a study cannot be looked at; tried again until it can");
                }
            }
        }
        None
    }

    /// The study as it was read, of this build and with a canary of the same bits.
    async fn found(&self, task: &Waiting, seen: &mut Seen) -> Result<Arc<Ours>, Unseen> {
        let ours = match self.shelf.get(task) {
            Some(ours) if seen.has_sung => return Ok(ours),
            Some(ours) => ours,
            None => self.read(task, seen).await?,
        };
        if !seen.has_sung {
            let started = Instant::now();
            let heard = frozen::heard(&self.pool, &ours.study, &ours.frozen, ours.most_bytes).await?;
            let (canary_variants, canary_ms) = (ours.frozen.canary_variants, milliseconds(started.elapsed()));
            tracing::info!(study = task.cut.id, canary_variants, canary_ms, is_same = heard.is_ok(), "a canary sang");
            heard?;
            seen.has_sung = true;
            // Slots that found it in this one's hand do not wait for it. Told of each reading, those that find nothing free would read for ever.
            self.changed.send_replace(());
        }
        Ok(ours)
    }

    async fn read(&self, task: &Waiting, seen: &mut Seen) -> Result<Arc<Ours>, Unseen> {
        frozen::require_origin(&task.origin)?;
        // One whose chunks are all in others' hands must not take the turn of one that has some.
        if !self.store.has_free_chunk(&task.cut).await.map_err(Problem::from)? {
            return Err(Unseen::NothingFree);
        }
        let Capacity { variant_bytes, admitted_states, .. } = self.capacity;
        let most_bytes = if task.max_states <= admitted_states { u64::MAX } else { variant_bytes };
        let bytes = frozen::reading_bytes(task.document_bytes);
        if bytes > most_bytes {
            return Err(NotHere::NeedsMemory { bytes, most_bytes }.into());
        }
        let mut room = self.shelf.room(seen.bytes.max(task.document_bytes)).await.ok_or(Unseen::NoRoom)?;
        let thawed = frozen::thaw(&self.pool, &self.store, &task.cut, task.document_bytes).await?;
        let (study, frozen) = thawed.ok_or(Unseen::Gone)??;
        let bytes = view_bytes(&study) + task.document_bytes;
        if bytes > seen.bytes {
            // Nobody knew before.
            seen.bytes = bytes;
            room = self.shelf.try_room(bytes).ok_or(Unseen::NoRoom)?;
        }
        let chunk_bytes = chunk_bytes(&study, self.parts.is_some());
        let ours = Arc::new(Ours { study, frozen, most_bytes, chunk_bytes, _room: room });
        self.shelf.put(task.clone(), &ours, bytes);
        Ok(ours)
    }

    /// Computes a chunk and keeps what it comes to, unless it is not wanted any more.
    async fn compute(&self, lane: &mut Lane, task: &Waiting, ours: &Ours, mut lease: Lease, tasks: &mut Tasks) {
        let Ours { study, most_bytes, .. } = ours;
        let (id, chunk) = (&task.cut.id, lease.chunk());
        let time_is_over = async {
            self.stopping.cancelled().await;
            tokio::time::sleep(self.patience).await;
        };
        let is_over = async {
            tokio::select! {
                () = time_is_over => {}
                // It was cancelled, or forgotten.
                _ = tasks.wait_for(|waiting| !waiting.contains(task)) => {}
            }
        };
        tokio::pin!(is_over);
        let running = async {
            let (part, busy) = match run_chunk(&self.pool, lane, study, chunk, *most_bytes).await? {
                Ok(computed) => computed,
                Err(reason) => return Ok(Err(reason)),
            };
            let (part, rows) = self.with_rows(study, part).await?;
            Ok::<_, Problem>(Ok((part, rows, busy)))
        };
        let computed = tokio::select! {
            computed = running => Some(computed),
            () = &mut is_over => None,
            _ = lease.renew() => None,
        };
        let (part, mut rows, busy) = match computed {
            Some(Ok(Ok(computed))) => computed,
            Some(Ok(Err(reason))) => {
                say_left_to_others(task, &reason);
                let seen = Seen { is_left_to_others: true, ..Seen::default() };
                self.known.lock().insert(task.clone(), Arc::new(seen.into()));
                return give_up(lease).await;
            }
            Some(Err(problem)) => {
                // The attempt stays noted: it may be the chunk's fault.
                tracing::error!(study = id, chunk, %problem, cause = problem.cause, "a chunk failed");
                return;
            }
            None => {
                if let Err(error) = lease.give_back().await {
                    self.is_in_trouble(What::Writing, &error);
                }
                return;
            }
        };
        let (variants, refused) = (part.variants(), part.refused());
        let bytes = match frozen::sealed(&task.cut, chunk, &part) {
            Ok(bytes) => bytes,
            Err(problem) => {
                tracing::error!(study = id, chunk, cause = problem.cause, "a chunk cannot be kept");
                return;
            }
        };
        drop(part);
        let mut retry = RETRY;
        // What is computed is not computed again because the store is away for a while.
        loop {
            let kept = {
                // First: what the store has a result of has its rows.
                let mut keeping = pin!(self.keep_rows(study, chunk, &mut rows));
                tokio::select! {
                    kept = keeping.as_mut() => kept,
                    () = &mut is_over => {
                        give_up(lease).await;
                        // Where the folder stands still, its thread and the rows stay until it goes on, and with them this place and its room.
                        tokio::select! {
                            _ = keeping => {}
                            () = self.stopping.cancelled() => {}
                        }
                        return;
                    }
                    never = lease.renew() => match never {},
                }
            };
            if kept {
                match lease.keep(&bytes, variants, refused, busy).await {
                    Ok(()) => {
                        self.is_well(What::Writing);
                        self.changed.send_replace(());
                        break;
                    }
                    Err(error) => self.is_in_trouble(What::Writing, &error),
                }
            }
            lease.say().await;
            tokio::select! {
                () = tokio::time::sleep(retry) => {}
                never = lease.renew() => match never {},
                () = &mut is_over => break give_up(lease).await,
            }
            retry = (2 * retry).min(LONGEST_RETRY);
        }
    }

    /// Keeps rows that are still to be kept; whether none are any more.
    async fn keep_rows(&self, study: &Study, chunk: u64, rows: &mut Option<Bytes>) -> bool {
        let (Some(parts), Some(text)) = (&self.parts, &*rows) else { return true };
        match parts.keep(study, chunk, text.clone()).await {
            Ok(()) => {
                self.is_well(What::Parts);
                *rows = None;
                true
            }
            Err(error) => {
                self.is_in_trouble(What::Parts, &error);
                false
            }
        }
    }

    /// A part, and its rows where they are kept.
    async fn with_rows(&self, study: &Arc<Study>, part: Part) -> Result<(Part, Option<Bytes>), Problem> {
        if self.parts.is_none() || !study.has_rows() {
            return Ok((part, None));
        }
        let study = Arc::clone(study);
        let bytes = study.rows_bytes(&part);
        let writing = move |_: &mut Slice, _: &AtomicBool| {
            let mut rows = Vec::new();
            study.write_rows(&part, &mut rows).map_err(|error| Problem::internal(&error))?;
            Ok((part, Some(rows.into())))
        };
        self.pool.run_variants(&mut Lane::default(), bytes, writing).await
    }

    /// Says what is wrong, once.
    fn is_in_trouble(&self, what: What, error: &dyn Error) {
        let text = error.to_string();
        let mut troubles = self.troubles.lock();
        if troubles.get(&what) != Some(&text) {
            tracing::warn!(error = text, "{} is in trouble; tried again until it is well", what.name());
            troubles.insert(what, text);
        }
    }

    fn is_well(&self, what: What) {
        if self.troubles.lock().remove(&what).is_some() {
            tracing::info!("{} is well again", what.name());
        }
    }
}

fn say_left_to_others(task: &Waiting, reason: &NotHere) {
    tracing::warn!(study = task.cut.id, %reason, "a study is left to other workers");
}

/// About what a chunk takes that is in work, beside the variants that are computed: what it has come to, in columns that grow by doubling, and the same as it is
/// kept, or then on its way to the store; and its rows where they are kept, which grow in the same way.
fn chunk_bytes(study: &Study, has_parts: bool) -> u64 {
    let part_bytes = study.stored_bytes() / study.chunks().max(1);
    let rows_bytes =
        if has_parts { study.row_bytes().saturating_mul(2).saturating_mul(study.chunk_variants()) } else { 0 };
    study.working_bytes().saturating_add(part_bytes.saturating_mul(3)).saturating_add(rows_bytes)
}

/// Gives a chunk back that is not wanted, or because the time is over. Where nobody answers, that it was begun stays noted.
async fn give_up(lease: Lease) {
    let _ = lease.give_back().await;
}

/// For the log.
pub fn milliseconds(time: Duration) -> u64 {
    u64::try_from(time.as_millis()).unwrap_or(u64::MAX)
}

/// What a chunk comes to, and the time that it was computed for, unless a variant of it takes more than one may.
async fn run_chunk(
    pool: &Pool,
    lane: &mut Lane,
    study: &Arc<Study>,
    chunk: u64,
    most_bytes: u64,
) -> Result<Result<(Part, Duration), NotHere>, Problem> {
    let mut work = Work::new(study, chunk).within(SMALL_VARIANT_BYTES);
    #[cfg(feature = "fault-injection")]
    {
        injected::poison(chunk);
        if let Some(time) = injected::slow() {
            tokio::time::sleep(time).await;
        }
        if let Some(time) = injected::asleep() {
            tokio::time::sleep(time).await;
            return Ok(Ok((work.finish(), time)));
        }
    }
    let mut busy = Duration::ZERO;
    while work.room_bytes() <= most_bytes {
        let room_bytes = work.room_bytes();
        let job =
            move |time: &mut Slice, stop: &AtomicBool| slice(work, time, stop).map(|sliced| (sliced, time.busy()));
        let (sliced, took) = pool.run_variants(lane, room_bytes, job).await?;
        busy += took;
        counter!("toothwave_study_variants_total").increment(sliced.variants);
        work = sliced.work;
        if sliced.is_over {
            return Ok(Ok((work.finish(), busy)));
        }
    }
    Ok(Err(NotHere::NeedsMemory { bytes: work.room_bytes(), most_bytes }))
}

/// What a slice has done of a chunk.
#[derive(Debug)]
pub struct Sliced {
    /// The chunk, to go on with.
    pub work: Work,
    /// Variants that were looked at.
    pub variants: u64,
    /// Whether the chunk is over.
    pub is_over: bool,
}

/// As many variants as the time of a slice and the room of the work allow. Where a variant takes more room, the work that goes on has as much.
///
/// # Errors
/// When `stop` says so.
pub fn slice(mut work: Work, time: &mut Slice, stop: &AtomicBool) -> Result<Sliced, Problem> {
    #[cfg(feature = "fault-injection")]
    fail::fail_point!("solve");
    let mut variants = 0;
    loop {
        let is_over = match work.step(stop) {
            Ok(is_over) => is_over,
            Err(Interrupted::Stopped) => return Err(NoAnswer::stopped().into()),
            Err(Interrupted::NeedsBytes(bytes)) => {
                return Ok(Sliced { work: work.within(bytes), variants, is_over: false });
            }
        };
        variants += 1;
        if time.is_over() || is_over {
            return Ok(Sliced { work, variants, is_over });
        }
    }
}
