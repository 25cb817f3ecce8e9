//! The run of a study: computes chunks in the background and stores their parts. The answer is made from the parts.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use futures_util::{StreamExt as _, stream};
use metrics::counter;
use tokio::time::timeout;
use tokio_util::sync::CancellationToken;
use toothwave_calculation::no_answer::NoAnswer;
use toothwave_study::{Gathered, Study, StudyAnswer, Work};

use super::part_bytes;
use super::record::StudyRecord;
use super::state::{Progress, StudyState};
use super::store::{self, NewPart, Store, damaged};
use crate::compute::pool::Pool;
use crate::http::problem::{Problem, ProblemCode};

/// A running study.
pub(super) struct Run {
    pub(super) store: Store,
    pub(super) pool: Pool,
    pub(super) record: Arc<StudyRecord>,
    pub(super) study: Arc<Study>,
    /// Time limit of the study.
    pub(super) time: Duration,
}

impl Run {
    /// Runs until the study ends or the service stops. After a restart it continues.
    pub(super) async fn complete(self, service_stops: CancellationToken) {
        let ended = timeout(self.time, self.compute_missing_chunks()).await.unwrap_or_else(|_| {
            let detail = "the study did not finish within `study_deadline_ms`. Its results so far are stored. Request it again to continue";
            Err(Problem::new(ProblemCode::DeadlineExceeded, detail))
        });
        let (state, problem) = match ended {
            Ok(true) => (StudyState::Done, None),
            _ if service_stops.is_cancelled() => return,
            Ok(false) => (StudyState::Cancelled, None),
            Err(problem) => (StudyState::Failed, Some(problem)),
        };
        let (id, stored_problem) = (self.record.id.clone(), problem.clone());
        if let Some(problem) = &problem {
            tracing::warn!(study = id, %problem, cause = problem.cause, "a study failed");
        }
        let stored = self.store.with(move |transaction| store::end(transaction, &id, state, stored_problem)).await;
        if let Err(error) = stored {
            tracing::warn!(%error, "cannot store the end of a study: it continues after a restart");
        }
        self.record.set_state(state, problem);
    }

    /// Computes until all chunks have a part. Returns false if the run was cancelled before.
    async fn compute_missing_chunks(&self) -> Result<bool, Problem> {
        let id = self.record.id.clone();
        let done = self.store.with(move |transaction| store::chunks_done(transaction, &id)).await?;
        let missing = (0..self.study.chunks()).filter(|chunk| !done.contains(chunk));
        let computed = stream::iter(missing).map(|chunk| self.compute(chunk));
        let mut computed = computed.buffer_unordered(self.pool.permits());
        loop {
            let next = tokio::select! {
                // Cancellation first, so that a cancelled study stores nothing more.
                biased;
                () = self.record.stop.cancelled() => return Ok(false),
                next = computed.next() => next,
            };
            let Some(part) = next.transpose()? else { return Ok(true) };
            let progress = part.progress;
            self.store.with(move |transaction| store::insert_part(transaction, &part)).await?;
            self.record.count(progress);
        }
    }

    async fn compute(&self, chunk: u64) -> Result<NewPart, Problem> {
        let work = Work::new(&self.study, chunk);
        // `study.id()` may differ: a study from another build keeps its first id.
        let study = self.record.id.clone();
        let job = move |stop: &AtomicBool| {
            let part = work.run(stop).map_err(|_| NoAnswer::stopped())?;
            let progress = Progress { variants: part.variants(), impossible: part.refused() };
            counter!("toothwave_study_variants_total").increment(progress.variants);
            let bytes = part_bytes::encode(&study, chunk, &part).map_err(|error| Problem::internal(&error))?;
            Ok(NewPart { study, chunk, progress, bytes })
        };
        // The run has its own time limit.
        self.pool.run_in_background(Duration::MAX, job).await
    }
}

/// Computes the answer from the stored parts, on this thread.
pub(super) fn answer(store: &Store, record: &StudyRecord, stop: &AtomicBool) -> Result<StudyAnswer, Problem> {
    let id = &*record.id;
    let is_done = record.state() == StudyState::Done;
    let stored = || store.now(|transaction| store::study(transaction, id))?.ok_or_else(|| removed(id));
    let mut gathered = Gathered::new(&Arc::new(stored()?.read()?));
    let mut from_chunk = 0;
    loop {
        let parts = store.now(|transaction| store::parts(transaction, id, from_chunk))?;
        let Some((last, _)) = parts.last() else { break };
        from_chunk = last + 1;
        for (chunk, bytes) in &parts {
            let part = part_bytes::decode(id, *chunk, bytes);
            gathered.add(*chunk, part.ok_or_else(|| damaged(id, &format!("the part of chunk {chunk}")))?);
        }
        if stop.load(Ordering::Relaxed) {
            return Err(NoAnswer::stopped().into());
        }
    }
    if is_done && !gathered.is_complete() {
        // Either the study was removed meanwhile, or parts were lost.
        stored()?;
        return Err(damaged(id, "the number of parts"));
    }
    Ok(gathered.answer())
}

fn removed(id: &str) -> Problem {
    let detail = format!("the study `{id}` was removed during this request. Request it again");
    Problem::new(ProblemCode::NotFound, detail)
}
