//! Where solves run: permits, a bounded queue, the deadline, cancellation; nothing else leaves the async executor.

use std::io;
use std::panic::{self, AssertUnwindSafe};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::time::Duration;

use metrics::{counter, histogram};
use parking_lot::Mutex;
use tokio::runtime::Handle;
use tokio::sync::{AcquireError, OwnedSemaphorePermit, Semaphore};
use tokio::time::Instant;
use tokio_util::sync::CancellationToken;
use tracing::Span;

use crate::beside::beside;
use crate::config::Limits;
use crate::memory::Memory;
use crate::problem::{Problem, ProblemCode};
use crate::queue;
use crate::room::{self, NoRoom, Reserved, Room};
use crate::turns::{self, Had, Turns};

/// A slice of what runs in turn begins nothing further after this time: so long at most does a single request wait behind short ones.
const SLICE: Duration = Duration::from_millis(5);

/// Or after this one, where others have as long slices: a single step of theirs, such as a variant of a study, may take as long.
const LONGEST_SLICE: Duration = Duration::from_secs(1);

/// A single solve waits for so long behind slices, where they are not known to be long.
const PATIENCE: Duration = Duration::from_millis(50);

/// Of what unread answers may take, variants of studies may take another such part while they are computed.
const PART_OF_VARIANTS: u64 = 4;

/// And what is read of a store such a part: by default 4 MiB or more, of which the longest document takes three.
const PART_ASIDE: u64 = 8;

/// What a single variant of a study may take: nobody waits for it, and a study has a time of its own.
const MOST_OF_A_VARIANT: Duration = Duration::from_secs(3600);

/// A variant that takes no more is not counted: most take a hundredth.
pub const SMALL_VARIANT_BYTES: u64 = 1 << 20;

/// Runs solves, a bounded number at once and a bounded number waiting.
#[derive(Debug, Clone)]
pub struct Pool {
    /// One for each solve that runs.
    permits: Arc<Semaphore>,
    /// One: for a single solve behind slices that hold permits for long, since a step of theirs is never cut.
    spare: Arc<Semaphore>,
    /// One for each solve that runs or waits, those of batches apart.
    places: Arc<Semaphore>,
    /// Those of them that wait for a permit.
    waiting: Arc<AtomicUsize>,
    /// One for each slice of a batch that runs or waits for a permit: as many as there are permits, so that a single request
    /// never waits for more than one round of them.
    turns: Turns,
    /// As many as there are for the bytes that variants of studies may take at once while they are computed.
    of_variants: Arc<Semaphore>,
    /// One: for a variant that takes more than that.
    of_a_large_variant: Arc<Semaphore>,
    /// One for each batch that runs.
    batches: Arc<Semaphore>,
    /// For what is neither a solve nor short.
    aside: queue::Lane,
    /// One: for what takes seconds, and is wanted all the same.
    unhurried: Arc<Semaphore>,
    /// Of answers, from which a variant takes what is beyond the part of variants, and what is read of a store; none where there are none.
    room: Option<Room>,
    memory: Memory,
    pace: Pace,
    /// Cancelled when the service stops and has no time left.
    closed: CancellationToken,
    limits: Limits,
    /// Where its threads are not those of who asks.
    threads: Option<Handle>,
}

/// How long slices are. Whoever waits for a turn behind one that cannot be cut as short gets as much when it comes: else a thousand short steps would wait for a
/// long one each.
#[derive(Debug, Clone, Default)]
struct Pace(Arc<Mutex<Option<LongStep>>>);

/// The longest step of late.
#[derive(Debug, Clone, Copy)]
struct LongStep {
    took: Duration,
    at: Instant,
}

impl Pace {
    fn most(&self, now: Instant) -> Duration {
        /// So many times what it took a step is remembered: the next one of as many that compute side by side is over by then.
        const REMEMBERED: u32 = 4;
        let longest = self.0.lock().filter(|step| now < step.at + REMEMBERED * step.took);
        longest.map_or(SLICE, |step| step.took)
    }

    fn note(&self, took: Duration, now: Instant) {
        if took > SLICE && took >= self.most(now) {
            *self.0.lock() = Some(LongStep { took: took.min(LONGEST_SLICE), at: now });
        }
    }
}

/// A slice that runs.
#[derive(Debug)]
pub struct Slice {
    pace: Pace,
    most: Duration,
    started: Instant,
    last: Instant,
}

impl Slice {
    fn new(pace: &Pace, spent: Duration) -> Self {
        let now = Instant::now();
        Self { pace: pace.clone(), most: pace.most(now).saturating_sub(spent), started: now, last: now }
    }

    /// After a step: whether no further one is to begin.
    pub fn is_over(&mut self) -> bool {
        let now = Instant::now();
        self.pace.note(now - self.last, now);
        self.last = now;
        self.busy() >= self.most
    }

    /// What its steps have taken.
    pub fn busy(&self) -> Duration {
        self.last - self.started
    }
}

#[cfg(test)]
impl Default for Slice {
    fn default() -> Self {
        Self::new(&Pace::default(), Duration::ZERO)
    }
}

/// An error says that the semaphore is closed, which it never is.
type Held = Result<OwnedSemaphorePermit, AcquireError>;

/// A turn, and with it a permit.
type Turn = Arc<(turns::Turn, Held)>;

/// One who runs slices one after the other. A turn of which it has not used all is its own until the next, where that comes soon.
#[derive(Debug, Default)]
pub struct Lane {
    turn: Arc<Mutex<Option<Turn>>>,
    /// Of the turn.
    spent: Duration,
    /// Of all turns, also those of its companions.
    had: Arc<Mutex<Had>>,
}

impl Lane {
    /// Another of the same: what they have had of the time is counted together.
    pub fn companion(had: &Arc<Mutex<Had>>) -> Self {
        Self { had: Arc::clone(had), ..Self::default() }
    }

    /// For so long a turn is kept: somebody waits for it meanwhile, and no core works.
    const KEPT: Duration = Duration::from_millis(20);

    fn keep(&mut self, turn: Turn, spent: Duration) {
        self.spent = spent;
        let (lane, kept) = (Arc::downgrade(&self.turn), Arc::downgrade(&turn));
        *self.turn.lock() = Some(turn);
        tokio::spawn(async move {
            tokio::time::sleep(Self::KEPT).await;
            // It may have been used meanwhile, and be another.
            if let (Some(lane), Some(kept)) = (lane.upgrade(), kept.upgrade()) {
                lane.lock().take_if(|turn| Arc::ptr_eq(turn, &kept));
            }
        });
    }

    fn let_go(&mut self) {
        *self.turn.lock() = None;
        self.spent = Duration::ZERO;
    }
}

/// Where a solve runs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Thread {
    /// On a thread of its own, for as long as the deadline lets it.
    Blocking,
    /// On the executor itself: for what keeps it from its other tasks no longer than some 0.1 ms. To hand that over to another thread
    /// and back would cost a quarter of it again. Nothing stops it on its way.
    Executor,
}

/// Sets the stop signal of a job that nobody waits for any more.
struct StopOnDrop {
    signal: Arc<AtomicBool>,
    is_over: bool,
}

impl Drop for StopOnDrop {
    fn drop(&mut self) {
        if !self.is_over {
            self.signal.store(true, Ordering::Relaxed);
            counter!("toothwave_cancellations_total").increment(1);
        }
    }
}

/// What a job holds that has not begun. It is given back when nobody waits any more: where the system refuses a thread, tokio keeps the job until
/// another finds one, and there would be no other once each permit lay in such a job.
struct Waiting<T>(Arc<Mutex<Option<T>>>);

/// One among those that are counted.
struct Counted<'a>(&'a AtomicUsize);

impl<'a> Counted<'a> {
    fn one_more(count: &'a AtomicUsize) -> Self {
        count.fetch_add(1, Ordering::Relaxed);
        Self(count)
    }
}

impl Drop for Counted<'_> {
    fn drop(&mut self) {
        self.0.fetch_sub(1, Ordering::Relaxed);
    }
}

impl<T> Drop for Waiting<T> {
    fn drop(&mut self) {
        drop(self.0.lock().take());
    }
}

impl Pool {
    /// A pool within these limits.
    pub fn new(limits: Limits) -> Self {
        Self {
            permits: Arc::new(Semaphore::new(limits.max_concurrent_solves)),
            spare: Arc::new(Semaphore::new(1)),
            places: Arc::new(Semaphore::new(limits.max_concurrent_solves + limits.max_queued_solves)),
            waiting: Arc::default(),
            turns: Turns::new(limits.max_concurrent_solves),
            of_variants: Arc::new(Semaphore::new(room::permits(limits.max_unread_bytes / PART_OF_VARIANTS) as usize)),
            of_a_large_variant: Arc::new(Semaphore::new(1)),
            batches: Arc::new(Semaphore::new(limits.max_concurrent_batches)),
            aside: queue::Lane::default(),
            unhurried: Arc::new(Semaphore::new(1)),
            room: None,
            memory: Memory::default(),
            pace: Pace::default(),
            closed: CancellationToken::new(),
            limits,
            threads: None,
        }
    }

    /// The same with solves on the threads of this runtime, which nothing else has.
    #[must_use]
    pub fn on(self, threads: &Handle) -> Self {
        Self { threads: Some(threads.clone()), ..self }
    }

    /// The same beside answers that take this room.
    #[must_use]
    pub fn beside(self, room: &Room) -> Self {
        Self { room: Some(room.clone()), memory: room.memory().clone(), ..self }
    }

    /// The memory that solves take.
    pub fn memory(&self) -> &Memory {
        &self.memory
    }

    /// Room for so many bytes that are taken aside. A part of what unread answers may take is there for that besides, since one is there at a time; what is beyond it is taken
    /// of that itself, of which who asks holds some already; of more than that there is as much as the memory really has.
    ///
    /// # Errors
    /// Where there is not so much in time.
    pub async fn room_aside(&self, deadline: Instant, bytes: u64, held_bytes: u64) -> Result<Option<Reserved>, NoRoom> {
        let max_bytes = self.limits.max_unread_bytes;
        let beyond_bytes = bytes.saturating_sub(max_bytes / PART_ASIDE);
        let is_all_counted = self.room.is_some() && bytes <= max_bytes;
        if !is_all_counted && beyond_bytes > 0 && !self.memory.has(beyond_bytes) {
            return Err(NoRoom::Scarce);
        }
        let Some(room) = &self.room else { return Ok(None) };
        room.beside(held_bytes).reserve_in_time(deadline, beyond_bytes).await.map(Some)
    }

    /// Whether answers that nobody has read yet take much.
    pub fn has_much_unread(&self) -> bool {
        self.room.as_ref().is_some_and(Room::has_much_unread)
    }

    /// Solves that run now.
    pub fn running(&self) -> usize {
        self.limits.max_concurrent_solves + 1 - self.permits.available_permits() - self.spare.available_permits()
    }

    /// Single solves that run or wait now.
    pub fn admitted(&self) -> usize {
        self.limits.max_concurrent_solves + self.limits.max_queued_solves - self.places.available_permits()
    }

    /// Single solves that wait now.
    pub fn waiting(&self) -> usize {
        self.waiting.load(Ordering::Relaxed)
    }

    /// The deadline of a request that arrives now.
    pub fn deadline(&self) -> Instant {
        Instant::now() + Duration::from_millis(self.limits.deadline_ms)
    }

    /// Stops every solve, and lets none begin.
    pub fn close(&self) {
        self.closed.cancel();
    }

    /// What comes of `future` until the deadline, at which it is dropped.
    ///
    /// # Errors
    /// `deadline_exceeded`, and whatever it comes to.
    pub async fn within<T>(
        &self,
        deadline: Instant,
        future: impl Future<Output = Result<T, Problem>>,
    ) -> Result<T, Problem> {
        tokio::time::timeout_at(deadline, future).await.unwrap_or_else(|_| Err(self.deadline_exceeded()))
    }

    /// What comes of `future`, which may wait for others, until the pool is closed.
    ///
    /// # Errors
    /// `shutting_down`, and whatever it comes to.
    pub async fn until_closed<T>(&self, future: impl Future<Output = Result<T, Problem>>) -> Result<T, Problem> {
        // What waits for a store is large, and would be so within each of its callers.
        let future = Box::pin(future);
        tokio::select! {
            biased;
            done = future => done,
            () = self.closed.cancelled() => Err(shutting_down()),
        }
    }

    /// Runs `job` as [`Self::run_while_wanted`] does, until the deadline.
    ///
    /// # Errors
    /// As there, and `deadline_exceeded` when the time is over.
    pub async fn run<T: Send + 'static>(
        &self,
        deadline: Instant,
        on: Thread,
        job: impl FnOnce(&AtomicBool) -> Result<T, Problem> + Send + 'static,
    ) -> Result<T, Problem> {
        self.within(deadline, self.run_while_wanted(on, job)).await
    }

    /// Runs `job` and hands it the signal that stops it: when the pool is closed, or when this future is dropped.
    ///
    /// # Errors
    /// `queue_full` at once where no place is free, `shutting_down` when the pool is closed, `internal_error` where the job panicked,
    /// and whatever the job returns.
    pub async fn run_while_wanted<T: Send + 'static>(
        &self,
        on: Thread,
        job: impl FnOnce(&AtomicBool) -> Result<T, Problem> + Send + 'static,
    ) -> Result<T, Problem> {
        let Ok(place) = Arc::clone(&self.places).try_acquire_owned() else {
            return Err(self.queue_full());
        };
        let pace = self.pace.clone();
        let timed = move |stop: &AtomicBool| {
            let started = Instant::now();
            let result = job(stop);
            let (now, took) = (Instant::now(), started.elapsed());
            // Slices wait for it as for a long step.
            pace.note(took, now);
            histogram!("toothwave_solve_duration_seconds").record(took);
            result
        };
        self.run_holding(place, on, timed).await
    }

    /// A place for a batch, to be held while it runs.
    ///
    /// # Errors
    /// `queue_full` where as many run as the service admits.
    pub fn batch_place(&self) -> Result<OwnedSemaphorePermit, Problem> {
        Arc::clone(&self.batches).try_acquire_owned().map_err(|_| {
            let most = self.limits.max_concurrent_batches;
            Problem::new(
                ProblemCode::QueueFull,
                format!("{most} batches run, as many as the service admits; try again in a moment"),
            )
        })
    }

    /// Batches that run now.
    pub fn batches(&self) -> usize {
        self.limits.max_concurrent_batches - self.batches.available_permits()
    }

    /// Runs what is one slice when its turn comes, however long that takes; its deadline begins when it runs.
    ///
    /// # Errors
    /// As [`Self::run`], but for `queue_full`.
    pub async fn run_in_turn<T: Send + 'static>(
        &self,
        job: impl FnOnce(&AtomicBool) -> Result<T, Problem> + Send + 'static,
    ) -> Result<T, Problem> {
        let deadline = Duration::from_millis(self.limits.deadline_ms);
        self.run_slice(&mut Lane::default(), deadline, |_, stop| job(stop)).await
    }

    /// Whether others have so long steps that a turn is kept until it is used up.
    pub fn are_turns_long(&self) -> bool {
        self.pace.most(Instant::now()) > SLICE
    }

    /// Whether a slice that asks now need not wait.
    pub fn has_free_permit(&self) -> bool {
        self.permits.available_permits() > 0
    }

    /// Runs a slice of a batch when its turn comes. Each of its steps has the deadline at least.
    ///
    /// # Errors
    /// As [`Self::run_in_turn`].
    pub async fn run_steps<T: Send + 'static>(
        &self,
        lane: &mut Lane,
        job: impl FnOnce(&mut Slice, &AtomicBool) -> Result<T, Problem> + Send + 'static,
    ) -> Result<T, Problem> {
        let deadline = Duration::from_millis(self.limits.deadline_ms);
        self.run_slice(lane, deadline + self.pace.most(Instant::now()), job).await
    }

    /// The same for so long at most. A time for which all of the process stood still is none in which a slice could come to its end: of that no more than a step
    /// is counted.
    async fn run_slice<T: Send + 'static>(
        &self,
        lane: &mut Lane,
        most: Duration,
        job: impl FnOnce(&mut Slice, &AtomicBool) -> Result<T, Problem> + Send + 'static,
    ) -> Result<T, Problem> {
        const STEPS: u32 = 8;
        let kept = lane.turn.lock().take();
        let turn = match kept {
            Some(turn) => turn,
            None => {
                lane.let_go();
                self.turn(&lane.had).await?
            }
        };
        let time_is_over = async {
            for _ in 0..STEPS {
                tokio::time::sleep(most / STEPS).await;
            }
        };
        let (pace, spent) = (self.pace.clone(), lane.spent);
        let timed = move |stop: &AtomicBool| {
            let mut time = Slice::new(&pace, spent);
            job(&mut time, stop).map(|done| (done, time.busy()))
        };
        let began = Instant::now();
        let sliced = tokio::select! {
            done = self.run_permitted(Arc::clone(&turn), Thread::Blocking, timed) => done,
            () = time_is_over => Err(deadline_exceeded(most)),
        };
        self.turns.note(&mut lane.had.lock(), began.elapsed());
        let (done, busy) = sliced?;
        // Where all have short steps the next turn comes as soon.
        let most = self.pace.most(Instant::now());
        if most > SLICE && spent + busy < most {
            lane.keep(turn, spent + busy);
        }
        Ok(done)
    }

    async fn turn(&self, had: &Mutex<Had>) -> Result<Turn, Problem> {
        let had = *had.lock();
        let turn = tokio::select! {
            biased;
            () = self.closed.cancelled() => return Err(shutting_down()),
            turn = self.turns.take(&had) => turn,
        };
        // Behind the single solves that came before: each may take as long as a slice.
        let permit = self.permit().await?;
        Ok(Arc::new((turn, permit)))
    }

    /// Runs a slice of a study that has room for variants of so many bytes while they are computed: beside others only as far as together they take no
    /// more than variants may, and where memory is scarce beside none.
    ///
    /// # Errors
    /// As [`Self::run_in_turn`].
    pub async fn run_variants<T: Send + 'static>(
        &self,
        lane: &mut Lane,
        room_bytes: u64,
        job: impl FnOnce(&mut Slice, &AtomicBool) -> Result<T, Problem> + Send + 'static,
    ) -> Result<T, Problem> {
        if room_bytes <= SMALL_VARIANT_BYTES {
            return self.run_slice(lane, MOST_OF_A_VARIANT, job).await;
        }
        // Nobody waits for room with a turn in hand.
        lane.let_go();
        let part_bytes = self.limits.max_unread_bytes / PART_OF_VARIANTS;
        let wanted = async {
            let beyond_bytes = room_bytes.saturating_sub(part_bytes);
            // Those that have to wait for it hold nothing of answers meanwhile.
            let alone = match beyond_bytes {
                0 => None,
                _ => Some(Arc::clone(&self.of_a_large_variant).acquire_owned().await),
            };
            // First: clients may hold that for long, and who waits for it is in nobody's way.
            let beyond = self.of_answers(beyond_bytes).await;
            // Where memory is scarce, whatever was counted, alone.
            let wanted_bytes = if self.memory.is_scarce() { part_bytes } else { room_bytes.min(part_bytes) };
            let permits = room::permits(wanted_bytes);
            (Arc::clone(&self.of_variants).acquire_many_owned(permits).await, beyond, alone)
        };
        let held = tokio::select! {
            held = wanted => held,
            () = self.closed.cancelled() => return Err(shutting_down()),
        };
        let job = move |time: &mut Slice, stop: &AtomicBool| {
            let _held = held;
            job(time, stop)
        };
        self.run_slice(lane, MOST_OF_A_VARIANT, job).await
    }

    /// So many bytes of the room of answers, when there are as many.
    async fn of_answers(&self, bytes: u64) -> Option<Reserved> {
        const LOOK: Duration = Duration::from_millis(20);
        let room = self.room.as_ref().filter(|_| bytes > 0)?;
        loop {
            // One that takes more than all there is was admitted all the same.
            if let Ok(reserved) = room.reserve(bytes.min(self.limits.max_unread_bytes)) {
                return Some(reserved);
            }
            tokio::time::sleep(LOOK).await;
        }
    }

    /// Runs what is no solve, and may yet take too long for the executor, on a thread of its own, one at a time, what has the shortest text and what came first by turns: it
    /// waits for no solve.
    ///
    /// # Errors
    /// `queue_full` where the system gives no thread, `deadline_exceeded` when the time is over, `internal_error` where the job panicked, and whatever it returns.
    pub async fn run_aside<T: Send + 'static>(
        &self,
        deadline: Instant,
        text_bytes: u64,
        job: impl FnOnce() -> Result<T, Problem> + Send + 'static,
    ) -> Result<T, Problem> {
        let running = async {
            let turn = self.aside.take(text_bytes).await;
            let work = move || {
                let _held = turn;
                caught(job)
            };
            beside(work).await.unwrap_or_else(|error| Err(no_thread(&error)))
        };
        self.within(deadline, running).await
    }

    /// Runs what takes its time on a thread of its own, one at a time: it waits for no solve, no solve waits for it, and no deadline stops it.
    ///
    /// # Errors
    /// `queue_full` where the system gives no thread, `internal_error` where the job panicked, and whatever it returns.
    pub async fn run_unhurried<T: Send + 'static>(
        &self,
        job: impl FnOnce() -> Result<T, Problem> + Send + 'static,
    ) -> Result<T, Problem> {
        let turn = Arc::clone(&self.unhurried).acquire_owned().await.map_err(|error| Problem::internal(&error))?;
        let work = move || {
            let _held = turn;
            caught(job)
        };
        tokio::select! {
            done = beside(work) => done.unwrap_or_else(|error| Err(no_thread(&error))),
            () = self.closed.cancelled() => Err(shutting_down()),
        }
    }

    /// Runs what takes some milliseconds, and for which somebody waits, as a single solve does, though it takes no place of one.
    ///
    /// # Errors
    /// As [`Self::run_while_wanted`], but for `queue_full`.
    pub async fn run_short<T: Send + 'static>(
        &self,
        job: impl FnOnce(&AtomicBool) -> Result<T, Problem> + Send + 'static,
    ) -> Result<T, Problem> {
        self.run_holding((), Thread::Blocking, job).await
    }

    async fn run_holding<T: Send + 'static>(
        &self,
        place: impl Send + 'static,
        on: Thread,
        job: impl FnOnce(&AtomicBool) -> Result<T, Problem> + Send + 'static,
    ) -> Result<T, Problem> {
        let permit = self.permit_of_a_single_one().await?;
        self.run_permitted((place, permit), on, job).await
    }

    async fn permit_of_a_single_one(&self) -> Result<Held, Problem> {
        let _waits = Counted::one_more(&self.waiting);
        let spare = async {
            if !self.are_turns_long() {
                tokio::time::sleep(PATIENCE).await;
            }
            // Behind others of its kind it waits.
            if self.turns.free() == self.limits.max_concurrent_solves {
                std::future::pending::<()>().await;
            }
            Arc::clone(&self.spare).acquire_owned().await
        };
        tokio::select! {
            biased;
            permit = Arc::clone(&self.permits).acquire_owned() => Ok(permit),
            permit = spare => Ok(permit),
            () = self.closed.cancelled() => Err(shutting_down()),
        }
    }

    async fn permit(&self) -> Result<Held, Problem> {
        tokio::select! {
            biased;
            () = self.closed.cancelled() => Err(shutting_down()),
            permit = Arc::clone(&self.permits).acquire_owned() => Ok(permit),
        }
    }

    async fn run_permitted<T: Send + 'static>(
        &self,
        held: impl Send + 'static,
        on: Thread,
        job: impl FnOnce(&AtomicBool) -> Result<T, Problem> + Send + 'static,
    ) -> Result<T, Problem> {
        if on == Thread::Executor {
            let _held = held;
            return caught(|| job(&AtomicBool::new(false)));
        }
        let mut stop = StopOnDrop { signal: Arc::default(), is_over: false };
        let signal = Arc::clone(&stop.signal);
        let waiting = Waiting(Arc::new(Mutex::new(Some(held))));
        let begun = Arc::clone(&waiting.0);
        // spawn_blocking loses the span, and cannot be aborted: span, permit and place go along.
        let span = Span::current();
        let threads = self.threads.clone().unwrap_or_else(Handle::current);
        let running = threads.spawn_blocking(move || {
            let Some(_held) = begun.lock().take() else {
                return Err(Problem::internal(&"nobody waits for it any more"));
            };
            span.in_scope(|| caught(|| job(&signal)))
        });
        let finished = tokio::select! {
            finished = running => finished,
            () = self.closed.cancelled() => return Err(shutting_down()),
        };
        stop.is_over = true;
        finished.unwrap_or_else(|error| Err(Problem::internal(&error)))
    }

    fn queue_full(&self) -> Problem {
        let Limits { max_concurrent_solves, max_queued_solves, .. } = self.limits;
        let detail = format!(
            "solves that run: {max_concurrent_solves}; that wait: {max_queued_solves}: as many as the service admits; try again in a moment"
        );
        Problem::new(ProblemCode::QueueFull, detail)
    }

    /// The problem of what took too long.
    pub fn deadline_exceeded(&self) -> Problem {
        deadline_exceeded(Duration::from_millis(self.limits.deadline_ms))
    }
}

fn deadline_exceeded(time: Duration) -> Problem {
    let detail = format!(
        "the computation did not finish within {} ms, waiting included; ask for less or try again in a moment",
        time.as_millis()
    );
    Problem::new(ProblemCode::DeadlineExceeded, detail)
}

/// Makes a panic of a job the problem of those who asked for it.
///
/// # Errors
/// `internal_error` where it panicked, and whatever it returns.
pub fn caught<T>(job: impl FnOnce() -> Result<T, Problem>) -> Result<T, Problem> {
    panic::catch_unwind(AssertUnwindSafe(job)).unwrap_or_else(|panic| Err(Problem::panicked(panic.as_ref())))
}

/// Of a job that panics somebody else tells.
fn no_thread(error: &io::Error) -> Problem {
    tracing::warn!(%error, "the system gave no thread");
    Problem::new(ProblemCode::QueueFull, "the system gives the service no thread now; try again in a moment")
}

fn shutting_down() -> Problem {
    Problem::new(
        ProblemCode::ShuttingDown,
        "the service is stopping, and had no time left for this computation; ask again",
    )
}

#[cfg(test)]
mod tests {
    use std::io;
    use std::pin::pin;
    use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
    use std::sync::{Arc, mpsc};
    use std::time::Duration;

    use clap::Parser as _;
    use futures_util::future::join_all;

    use super::{Lane, Pool, Slice, Thread};
    use crate::config::Settings;
    use crate::problem::{Problem, ProblemCode};
    use crate::room::{NoRoom, Room};

    #[derive(clap::Parser)]
    struct Line {
        #[command(flatten)]
        settings: Settings,
    }

    /// As where the system refuses a thread: tokio keeps the job until one is free.
    #[test]
    fn a_job_that_finds_no_thread_gives_its_permit_and_place_back_when_nobody_waits_any_more() -> io::Result<()> {
        let runtime = tokio::runtime::Builder::new_current_thread().enable_time().max_blocking_threads(1).build()?;
        runtime.block_on(async {
            let Line { settings } = Line::parse_from(["serve", "--deadline-ms", "1"]);
            let pool = Pool::new(settings.limits());
            let (release, released) = mpsc::channel::<()>();
            let busy = tokio::task::spawn_blocking(move || released.recv());
            let refused = pool.run(pool.deadline(), Thread::Blocking, |_| Ok(())).await;
            assert_eq!(refused.err().map(|problem| problem.code), Some(ProblemCode::DeadlineExceeded));
            assert_eq!((pool.running(), pool.admitted(), pool.waiting()), (0, 0, 0));
            assert!(release.send(()).is_ok());
            assert!(busy.await.is_ok_and(|done| done.is_ok()));
        });
        Ok(())
    }

    #[tokio::test(flavor = "multi_thread", worker_threads = 4)]
    async fn variants_that_take_much_are_computed_beside_others_only_as_far_as_there_is_room() {
        let words = ["serve", "--max-concurrent-solves", "4", "--max-unread-bytes", "67108864"];
        let Line { settings } = Line::parse_from(words);
        let pool = Pool::new(settings.limits());
        // Of 16 MiB for all of them.
        for (variant_bytes, is_scarce, most_at_once) in
            [(6 << 20, false, 2), (6 << 20, true, 1), (10 << 20, false, 1), (1 << 30, false, 1)]
        {
            pool.memory().set_scarce(is_scarce);
            let (running, most) = (Arc::new(AtomicUsize::new(0)), Arc::new(AtomicUsize::new(0)));
            let slices = (0..20).map(|_| {
                let (running, most) = (Arc::clone(&running), Arc::clone(&most));
                let job = move |_: &mut Slice, _: &AtomicBool| {
                    most.fetch_max(running.fetch_add(1, Ordering::SeqCst) + 1, Ordering::SeqCst);
                    std::thread::yield_now();
                    running.fetch_sub(1, Ordering::SeqCst);
                    Ok(())
                };
                let pool = &pool;
                async move { pool.run_variants(&mut Lane::default(), variant_bytes, job).await }
            });
            assert!(join_all(slices).await.iter().all(Result::is_ok));
            assert!(most.load(Ordering::SeqCst) <= most_at_once, "{variant_bytes}");
        }
    }

    /// A study of a thousand quick variants waited a thousand times behind another's slow ones, and a batch of a tenth of a second half a minute behind four clients
    /// who asked for one long sweep after the other.
    #[tokio::test(flavor = "multi_thread")]
    async fn who_has_short_steps_gets_as_much_of_the_time_as_who_has_long_ones() -> Result<(), Problem> {
        const STEP: Duration = Duration::from_millis(50);
        for is_single in [false, true] {
            let Line { settings } = Line::parse_from(["serve", "--max-concurrent-solves", "1"]);
            let pool = Pool::new(settings.limits());
            let others = Arc::new(AtomicUsize::new(0));
            let long = tokio::spawn({
                let (pool, others) = (pool.clone(), Arc::clone(&others));
                async move {
                    let single = |_: &AtomicBool| {
                        std::thread::sleep(STEP);
                        Ok(())
                    };
                    let step = move |time: &mut Slice, stop: &AtomicBool| {
                        let done = single(stop);
                        time.is_over();
                        done
                    };
                    let mut lane = Lane::default();
                    while if is_single {
                        pool.run_while_wanted(Thread::Blocking, single).await.is_ok()
                    } else {
                        pool.run_variants(&mut lane, 0, step).await.is_ok()
                    } {
                        others.fetch_add(1, Ordering::SeqCst);
                    }
                }
            });
            while others.load(Ordering::SeqCst) < 2 {
                tokio::task::yield_now().await;
            }
            let before = others.load(Ordering::SeqCst);
            // Each slice of a millisecond, after which other work is at hand: cut off by its bytes, say, or as a chunk of its own.
            let (mut lane, mut busy) = (Lane::default(), Duration::ZERO);
            for _ in 0..40 {
                let step = |time: &mut Slice, _: &AtomicBool| {
                    std::thread::sleep(Duration::from_millis(1));
                    time.is_over();
                    Ok(time.busy())
                };
                busy += pool.run_variants(&mut lane, 0, step).await?;
            }
            let beside = u32::try_from(others.load(Ordering::SeqCst) - before).unwrap_or(u32::MAX);
            long.abort();
            // Without turns of the same length it would have had forty.
            assert!(beside * STEP <= 2 * busy + 4 * STEP, "{beside} beside {busy:?}");
        }
        Ok(())
    }

    /// Two studies of variants of some seconds each held up all single requests.
    #[tokio::test(flavor = "multi_thread")]
    async fn a_single_solve_does_not_wait_for_a_step_that_takes_long() -> Result<(), Problem> {
        let Line { settings } = Line::parse_from(["serve", "--max-concurrent-solves", "2"]);
        let pool = Pool::new(settings.limits());
        let (senders, slices): (Vec<_>, Vec<_>) = (0..2)
            .map(|_| {
                let (release, released) = mpsc::channel::<()>();
                let (pool, mut lane) = (pool.clone(), Lane::default());
                let step = move |_: &mut Slice, _: &AtomicBool| Ok(released.recv().is_err());
                (release, tokio::spawn(async move { pool.run_variants(&mut lane, 0, step).await }))
            })
            .unzip();
        while pool.running() < 2 {
            tokio::task::yield_now().await;
        }
        for _ in 0..3 {
            assert_eq!(pool.run(pool.deadline(), Thread::Blocking, |_| Ok(7)).await?, 7);
        }
        // Beside slices that hold all permits one runs; who comes next waits, and counts as such.
        let (release, released) = mpsc::channel::<()>();
        let single = pool.clone();
        let long = move |_: &AtomicBool| Ok(released.recv().is_err());
        let long = tokio::spawn(async move { single.run_while_wanted(Thread::Blocking, long).await });
        while pool.running() < 3 {
            tokio::task::yield_now().await;
        }
        let mut next = pin!(pool.run_while_wanted(Thread::Blocking, |_| Ok(7)));
        assert!(futures_util::poll!(&mut next).is_pending());
        assert_eq!(pool.waiting(), 1);
        drop(release);
        assert_eq!(next.await?, 7);
        assert!(long.await.map_err(|error| Problem::internal(&error))??);
        assert_eq!(pool.waiting(), 0);
        drop(senders);
        for slice in slices {
            assert!(slice.await.map_err(|error| Problem::internal(&error))??);
        }
        assert_eq!(pool.running(), 0);
        Ok(())
    }

    /// A turn that is kept is nobody's for long.
    #[tokio::test(flavor = "multi_thread")]
    async fn a_turn_that_is_not_used_again_soon_is_given_back() -> Result<(), Problem> {
        let Line { settings } = Line::parse_from(["serve", "--max-concurrent-solves", "1"]);
        let pool = Pool::new(settings.limits());
        let mut lane = Lane::default();
        let long = |time: &mut Slice, _: &AtomicBool| {
            std::thread::sleep(Duration::from_millis(30));
            time.is_over();
            Ok(())
        };
        pool.run_variants(&mut lane, 0, long).await?;
        let mut other = Lane::default();
        pool.run_variants(&mut other, 0, |_, _| Ok(())).await?;
        assert!(other.turn.lock().is_some(), "of a turn of thirty milliseconds it used none");
        // Nobody uses it, and nobody lets go of it.
        pool.run_in_turn(|_| Ok(())).await?;
        assert!(other.turn.lock().is_none());
        pool.run_variants(&mut other, 0, |_, _| Ok(())).await?;
        drop(other);
        assert_eq!(pool.running(), 0);
        Ok(())
    }

    /// One alone has what it needs, of which nobody counted what is beyond the part of variants.
    #[tokio::test(flavor = "multi_thread")]
    async fn a_variant_that_takes_more_than_the_part_of_variants_waits_for_room_of_answers() -> Result<(), NoRoom> {
        let Line { settings } = Line::parse_from(["serve", "--max-unread-bytes", "67108864"]);
        let room = Room::new(64 << 20);
        let pool = Pool::new(settings.limits()).beside(&room);
        room.memory().set_scarce(true);
        assert!(pool.memory().is_scarce(), "both are of one memory");
        room.memory().set_scarce(false);
        let unread = room.reserve(60 << 20)?;
        let mut lane = Lane::default();
        let mut large = pin!(pool.run_variants(&mut lane, 30 << 20, |_, _| Ok(())));
        assert!(futures_util::poll!(&mut large).is_pending());
        // One within it does not wait for that.
        assert!(pool.run_variants(&mut Lane::default(), 8 << 20, |_, _| Ok(())).await.is_ok());
        assert!(futures_util::poll!(&mut large).is_pending());
        drop(unread);
        assert!(large.await.is_ok());
        assert_eq!(room.taken_bytes(), 0);
        Ok(())
    }

    /// Each slot of a study whose variants take more than their part held what was beyond it for itself, though one of them computed.
    #[tokio::test(flavor = "multi_thread")]
    async fn variants_that_wait_for_another_large_one_hold_no_room_of_answers() -> Result<(), NoRoom> {
        let words = ["serve", "--max-unread-bytes", "67108864", "--max-concurrent-solves", "4"];
        let Line { settings } = Line::parse_from(words);
        let room = Room::new(64 << 20);
        let pool = Pool::new(settings.limits()).beside(&room);
        let (begin, begun) = tokio::sync::oneshot::channel();
        let (release, released) = mpsc::channel::<()>();
        let (mut first, mut second) = (Lane::default(), Lane::default());
        let computing = pool.run_variants(&mut first, 30 << 20, move |_, _| {
            // Whether anybody listens is the test's own matter.
            let _ = begin.send(());
            released.recv().map_err(|error| Problem::internal(&error))
        });
        let mut computing = pin!(computing);
        tokio::select! {
            _ = &mut computing => panic!("nobody released it"),
            begun = begun => assert!(begun.is_ok()),
        }
        let taken_bytes = room.taken_bytes();
        let mut waiting = pin!(pool.run_variants(&mut second, 30 << 20, |_, _| Ok(())));
        assert!(futures_util::poll!(&mut waiting).is_pending());
        assert_eq!(room.taken_bytes(), taken_bytes);
        assert!(release.send(()).is_ok());
        assert!(computing.await.is_ok() && waiting.await.is_ok());
        Ok(())
    }

    /// Where answers keep all room, one that is read of a store had never any.
    #[tokio::test(start_paused = true)]
    async fn what_is_read_of_a_store_has_room_beside_answers_and_beyond_that_waits_for_some_in_nobodys_way()
    -> Result<(), NoRoom> {
        let Line { settings } = Line::parse_from(["serve", "--max-unread-bytes", "67108864", "--deadline-ms", "1000"]);
        let room = Room::new(64 << 20);
        let pool = Pool::new(settings.limits()).beside(&room);
        let (first, second) = (room.reserve(32 << 20)?, room.reserve(32 << 20)?);
        assert!(pool.room_aside(pool.deadline(), 8 << 20, 0).await.is_ok());
        let mut read = pin!(pool.room_aside(pool.deadline(), 48 << 20, 0));
        assert!(futures_util::poll!(&mut read).is_pending());
        drop(first);
        assert!(futures_util::poll!(&mut read).is_pending());
        drop(room.reserve(32 << 20)?);
        drop(second);
        drop(read.await?);
        let _all = room.reserve(64 << 20)?;
        assert!(pool.room_aside(pool.deadline(), 48 << 20, 0).await.is_err(), "by the deadline there was none");
        Ok(())
    }

    /// As of one that was stopped and goes on, or whose machine slept: what runs goes on with it.
    #[tokio::test(start_paused = true)]
    async fn a_time_for_which_the_process_stood_still_is_not_taken_from_a_slice() {
        let Line { settings } = Line::parse_from(["serve", "--deadline-ms", "1000"]);
        let pool = Pool::new(settings.limits());
        let (begin, begun) = tokio::sync::oneshot::channel();
        let (release, released) = mpsc::channel::<()>();
        let slice = tokio::spawn(async move {
            let work = move |_: &_| {
                // Whether anybody listens is the test's own matter.
                let _ = begin.send(());
                released.recv().map_err(|error| Problem::internal(&error))
            };
            pool.run_in_turn(work).await
        });
        assert!(begun.await.is_ok());
        tokio::time::advance(Duration::from_secs(60)).await;
        tokio::task::yield_now().await;
        assert!(!slice.is_finished());
        assert!(release.send(()).is_ok());
        assert!(slice.await.is_ok_and(|done| done.is_ok()));
    }

    #[tokio::test(start_paused = true)]
    async fn a_slice_that_waits_behind_others_for_longer_than_a_solve_may_take_still_runs() {
        let Line { settings } = Line::parse_from(["serve", "--max-concurrent-solves", "1", "--deadline-ms", "1000"]);
        let pool = Pool::new(settings.limits());
        let (release, released) = mpsc::channel::<()>();
        let other = pool.clone();
        let held = tokio::spawn(async move {
            let wait = move |_: &_| released.recv().map_err(|error| Problem::internal(&error));
            other.run_while_wanted(Thread::Blocking, wait).await
        });
        while pool.running() == 0 {
            tokio::task::yield_now().await;
        }
        let waiting = pool.clone();
        let slice = tokio::spawn(async move { waiting.run_in_turn(|_| Ok(())).await });
        while pool.turns.free() > 0 {
            tokio::task::yield_now().await;
        }
        tokio::time::advance(Duration::from_secs(10)).await;
        assert!(release.send(()).is_ok());
        assert!(held.await.is_ok_and(|done| done.is_ok()));
        assert!(slice.await.is_ok_and(|done| done.is_ok()));
    }
}
