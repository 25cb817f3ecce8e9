//! The pool runs computations on a fixed number of threads.
//!
//! **CPU.** Every computation holds one permit. There are N permits for single requests and N for background work
//! (batches, studies). Background threads run at `nice` 10, and the kernel shares the cores between the two kinds.
//! **Queue.** Permits are granted in the order of the requests. At most 32 requests wait; the next one gets 503
//! `queue_full`. At most 16 batches run.
//! **Time.** A computation checks its stop flag. The flag is set when the client leaves, when the deadline of the
//! request passes, or when the service stops. Computations below some 0.1 ms run to their end.

use std::io;
use std::panic::{self, AssertUnwindSafe};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, mpsc};
use std::thread;
use std::time::{Duration, Instant};

use metrics::{counter, histogram};
use parking_lot::Mutex;
use tokio::sync::{OwnedSemaphorePermit, Semaphore, oneshot};
use tokio_util::sync::CancellationToken;
use tracing::Span;

use crate::http::problem::{Problem, ProblemCode};
use crate::unix::lower_priority;

/// Most requests that wait for a permit.
pub const MAX_WAITING_REQUESTS: usize = 32;

/// Most batches that run at once.
pub const MAX_RUNNING_BATCHES: usize = 16;

/// The `nice` value of background threads. Next to a busy interactive thread they get a tenth of a core.
const BACKGROUND_NICE: i32 = 10;

/// Thirty years: longer than any deadline, and within the range of timers.
const FAR_FUTURE: Duration = Duration::from_secs(30 * 365 * 24 * 3600);

type Job = Box<dyn FnOnce() + Send>;

/// The permits and threads of one kind of work.
#[derive(Debug)]
struct Workers {
    permits: Arc<Semaphore>,
    count: usize,
    jobs: mpsc::Sender<Job>,
}

impl Workers {
    fn start(name: &str, count: usize, nice: i32) -> io::Result<Self> {
        let (jobs, waiting) = mpsc::channel::<Job>();
        let waiting = Arc::new(Mutex::new(waiting));
        for number in 0..count {
            let waiting = Arc::clone(&waiting);
            thread::Builder::new().name(format!("{name}-{number}")).spawn(move || {
                if nice > 0 {
                    lower_priority(nice);
                }
                loop {
                    let next = waiting.lock().recv();
                    let Ok(job) = next else { return };
                    job();
                }
            })?;
        }
        Ok(Self { permits: Arc::new(Semaphore::new(count)), count, jobs })
    }

    fn running(&self) -> usize {
        self.count - self.permits.available_permits()
    }
}

#[derive(Debug)]
struct Inner {
    interactive: Workers,
    background: Workers,
    waiting: Arc<Semaphore>,
    batches: Arc<Semaphore>,
    stopping: CancellationToken,
}

/// The threads and permits of the service. Clones share them.
#[derive(Debug, Clone)]
pub struct Pool(Arc<Inner>);

/// Sets the stop flag if it is dropped before the result arrives.
struct StopOnDrop {
    flag: Arc<AtomicBool>,
    is_done: bool,
}

impl Drop for StopOnDrop {
    fn drop(&mut self) {
        if !self.is_done {
            self.flag.store(true, Ordering::Relaxed);
            counter!("toothwave_cancellations_total").increment(1);
        }
    }
}

impl Pool {
    /// Starts a pool with this many permits and threads of each kind.
    pub fn start(permits: usize) -> io::Result<Self> {
        Ok(Self(Arc::new(Inner {
            interactive: Workers::start("solve", permits, 0)?,
            background: Workers::start("background", permits, BACKGROUND_NICE)?,
            waiting: Arc::new(Semaphore::new(MAX_WAITING_REQUESTS)),
            batches: Arc::new(Semaphore::new(MAX_RUNNING_BATCHES)),
            stopping: CancellationToken::new(),
        })))
    }

    /// Permits of each kind.
    pub fn permits(&self) -> usize {
        self.0.interactive.count
    }

    /// Running computations, of requests and in the background.
    pub fn running(&self) -> usize {
        self.0.interactive.running() + self.0.background.running()
    }

    /// Requests that wait for a permit.
    pub fn waiting(&self) -> usize {
        MAX_WAITING_REQUESTS - self.0.waiting.available_permits()
    }

    /// Running batches.
    pub fn batches(&self) -> usize {
        MAX_RUNNING_BATCHES - self.0.batches.available_permits()
    }

    /// Sets every stop flag and refuses further computations with `shutting_down`.
    pub fn stop(&self) {
        self.0.stopping.cancel();
    }

    /// Completes after the call of [`Self::stop`].
    pub async fn stopped(&self) {
        self.0.stopping.cancelled().await;
    }

    /// Computes for a request. Dropping the future sets the stop flag. Fails with `queue_full`, with `shutting_down`,
    /// or with `internal_error` after a panic.
    pub async fn run<T: Send + 'static>(
        &self,
        job: impl FnOnce(&AtomicBool) -> Result<T, Problem> + Send + 'static,
    ) -> Result<T, Problem> {
        let permit = self.interactive_permit().await?;
        self.run_on(&self.0.interactive, permit, job).await
    }

    /// Computes for a request on the executor, for work of at most 0.1 ms: a change of threads would add a quarter.
    pub async fn run_inline<T>(&self, job: impl FnOnce(&AtomicBool) -> Result<T, Problem>) -> Result<T, Problem> {
        let _permit = self.interactive_permit().await?;
        timed(|| catch_panic(|| job(&AtomicBool::new(false))))
    }

    /// Computes in the background, for at most `time` after it got a permit. Dropping the future sets the stop flag.
    pub async fn run_in_background<T: Send + 'static>(
        &self,
        time: Duration,
        job: impl FnOnce(&AtomicBool) -> Result<T, Problem> + Send + 'static,
    ) -> Result<T, Problem> {
        let permit = self.permit(&self.0.background).await?;
        within(Deadline::after(time), self.run_on(&self.0.background, permit, job)).await
    }

    /// Returns a permit that a batch holds while it runs. Fails with `queue_full` if 16 batches run.
    pub fn begin_batch(&self) -> Result<OwnedSemaphorePermit, Problem> {
        Arc::clone(&self.0.batches).try_acquire_owned().map_err(|_| {
            let detail = format!("{MAX_RUNNING_BATCHES} batches run, which is the limit. Retry after 1 s");
            Problem::new(ProblemCode::QueueFull, detail)
        })
    }

    async fn interactive_permit(&self) -> Result<OwnedSemaphorePermit, Problem> {
        let workers = &self.0.interactive;
        if let Ok(permit) = Arc::clone(&workers.permits).try_acquire_owned() {
            return Ok(permit);
        }
        let _waiting = self.0.waiting.try_acquire().map_err(|_| {
            let detail = format!(
                "{} computations run and {MAX_WAITING_REQUESTS} requests wait, which is the limit. Retry after 1 s",
                self.permits()
            );
            Problem::new(ProblemCode::QueueFull, detail)
        })?;
        self.permit(workers).await
    }

    async fn permit(&self, workers: &Workers) -> Result<OwnedSemaphorePermit, Problem> {
        tokio::select! {
            biased;
            () = self.0.stopping.cancelled() => Err(shutting_down()),
            permit = Arc::clone(&workers.permits).acquire_owned() => permit.map_err(|error| Problem::internal(&error)),
        }
    }

    async fn run_on<T: Send + 'static>(
        &self,
        workers: &Workers,
        permit: OwnedSemaphorePermit,
        job: impl FnOnce(&AtomicBool) -> Result<T, Problem> + Send + 'static,
    ) -> Result<T, Problem> {
        let flag = Arc::new(AtomicBool::new(false));
        let mut stop = StopOnDrop { flag: Arc::clone(&flag), is_done: false };
        let (sender, receiver) = oneshot::channel();
        let span = Span::current();
        let job = Box::new(move || {
            let result = span.in_scope(|| timed(|| catch_panic(|| job(&flag))));
            // The permit is free before the receiver gets the result.
            drop(permit);
            // An error means that the receiver was dropped.
            let _ = sender.send(result);
        });
        workers.jobs.send(job).map_err(|error| Problem::internal(&error))?;
        tokio::select! {
            biased;
            result = receiver => {
                stop.is_done = true;
                result.unwrap_or_else(|error| Err(Problem::internal(&error)))
            }
            () = self.0.stopping.cancelled() => Err(shutting_down()),
        }
    }
}

fn timed<T>(job: impl FnOnce() -> T) -> T {
    let started = Instant::now();
    let result = job();
    histogram!("toothwave_solve_duration_seconds").record(started.elapsed());
    result
}

/// Returns the result of a job. A panic becomes an internal error.
pub fn catch_panic<T>(job: impl FnOnce() -> Result<T, Problem>) -> Result<T, Problem> {
    panic::catch_unwind(AssertUnwindSafe(job)).unwrap_or_else(|panic| Err(Problem::panicked(panic.as_ref())))
}

/// Returns the result of a future, which is dropped at the deadline.
pub async fn within<T>(deadline: Deadline, future: impl Future<Output = Result<T, Problem>>) -> Result<T, Problem> {
    tokio::time::timeout_at(deadline.at, future).await.unwrap_or_else(|_| {
        let detail = format!(
            "the computation took longer than {} ms, the limit that follows from `deadline_ms`. Request less, or retry",
            deadline.span.as_millis()
        );
        Err(Problem::new(ProblemCode::DeadlineExceeded, detail))
    })
}

/// Time at which the work for a request is stopped.
#[derive(Debug, Clone, Copy)]
pub struct Deadline {
    /// The time.
    pub at: tokio::time::Instant,
    span: Duration,
}

impl Deadline {
    /// Returns the deadline after this time from now.
    pub fn after(span: Duration) -> Self {
        let now = tokio::time::Instant::now();
        // If the sum overflows, the deadline is thirty years away.
        Self { at: now.checked_add(span).unwrap_or(now + FAR_FUTURE), span }
    }
}

fn shutting_down() -> Problem {
    Problem::new(ProblemCode::ShuttingDown, "the service is stopping. Retry: another instance may have replaced it")
}
