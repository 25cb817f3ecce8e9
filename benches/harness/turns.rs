//! Contestants that take turns, so that what disturbs the machine disturbs them all.

use std::error::Error;
use std::hint::black_box;
use std::time::{Duration, Instant};

use crate::harness::Spread;

/// A batch of runs takes at least so long: what the one before left in caches and memory must not count.
pub(crate) const BATCH: Duration = Duration::from_millis(50);

pub(crate) type Failure = Box<dyn Error>;

/// Runs so many times and says how long that took.
pub(crate) type Run<'a> = Box<dyn FnMut(u32) -> Result<Duration, Failure> + 'a>;

/// One of those who take turns.
pub(crate) struct Contestant<'a> {
    pub(crate) name: String,
    run: Run<'a>,
    /// Runs in a batch.
    batch: u32,
    /// Seconds a run, one entry a round.
    pub(crate) seconds: Vec<f64>,
}

impl<'a> Contestant<'a> {
    pub(crate) fn new(name: impl Into<String>, run: Run<'a>) -> Self {
        Self { name: name.into(), run, batch: 1, seconds: Vec::new() }
    }

    /// One that returns what it computes.
    pub(crate) fn of<T>(name: impl Into<String>, mut compute: impl FnMut() -> Result<T, Failure> + 'a) -> Self {
        let run = move |runs| {
            let started = Instant::now();
            for _ in 0..runs {
                black_box(compute()?);
            }
            Ok(started.elapsed())
        };
        Self::new(name, Box::new(run))
    }

    /// The same by the time that this thread was on a processor, which what else runs does not count in.
    pub(crate) fn of_processor<T>(
        name: impl Into<String>,
        mut compute: impl FnMut() -> Result<T, Failure> + 'a,
    ) -> Self {
        let run = move |runs| {
            let started = processor_time();
            for _ in 0..runs {
                black_box(compute()?);
            }
            Ok(processor_time().saturating_sub(started))
        };
        Self::new(name, Box::new(run))
    }

    pub(crate) fn spread(&self, runs_per_unit: f64) -> Spread {
        Spread::of(self.seconds.iter().map(|seconds| seconds * runs_per_unit))
    }
}

/// Lets the contestants take turns.
pub(crate) fn take_turns(contestants: &mut [Contestant<'_>], rounds: usize) -> Result<(), Failure> {
    for contestant in contestants.iter_mut() {
        // The first run warms up: memory, caches, the clock of the core.
        (contestant.run)(1)?;
        while (contestant.run)(contestant.batch)? < BATCH {
            contestant.batch *= 2;
        }
    }
    for round in 0..rounds {
        for turn in 0..contestants.len() {
            let index = (turn + round) % contestants.len();
            let contestant = &mut contestants[index];
            let elapsed = (contestant.run)(contestant.batch)?;
            contestant.seconds.push(elapsed.as_secs_f64() / f64::from(contestant.batch));
        }
    }
    Ok(())
}

/// How long this thread was on a processor, as the kernel counts it, to a few milliseconds.
fn processor_time() -> Duration {
    let text = std::fs::read_to_string("/proc/thread-self/schedstat").unwrap_or_default();
    let nanoseconds = text.split(' ').next().and_then(|field| field.parse().ok());
    Duration::from_nanos(nanoseconds.unwrap_or_default())
}
