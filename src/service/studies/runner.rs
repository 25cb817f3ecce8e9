//! What a study comes to: its chunks are computed and kept, and its answer is made of the kept parts.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use futures_util::{StreamExt as _, stream};
use metrics::counter;
use tokio_util::sync::CancellationToken;
use toothwave_calculation::no_answer::NoAnswer;
use toothwave_calculation::question;
use toothwave_study::{Gathered, Limits, Study, StudyAnswer, Work};

use super::store::{self, NewPart, Store, StoredDocument};
use super::{Kept, seal};
use crate::compute::pool::Pool;
use crate::http::problem::{Problem, ProblemCode};

/// What computes and keeps chunks.
#[derive(Debug, Clone)]
pub(super) struct Engine {
    pub(super) store: Store,
    pub(super) pool: Pool,
}

/// Computes the chunks that have no part yet, until all have one or it is told to stop; whether all have one.
///
/// # Errors
/// If a chunk fails, or its part cannot be kept.
pub(super) async fn run(
    engine: &Engine,
    kept: &Arc<Kept>,
    study: &Arc<Study>,
    stop: &CancellationToken,
) -> Result<bool, Problem> {
    let store = &engine.store;
    let id = kept.id.clone();
    let done = store.with(move |transaction| store::chunks_done(transaction, &id)).await?;
    let missing = (0..study.chunks()).filter(|chunk| !done.contains(chunk));
    let computed = stream::iter(missing).map(|chunk| compute_chunk(engine, study, chunk));
    let mut computed = computed.buffer_unordered(engine.pool.permits());
    loop {
        let next = tokio::select! {
            // First: a study that is cancelled keeps nothing more.
            biased;
            () = stop.cancelled() => return Ok(false),
            next = computed.next() => next,
        };
        let Some(part) = next.transpose()? else { return Ok(true) };
        let (variants, refused) = (part.variants, part.refused);
        store.with(move |transaction| store::keep(transaction, &part)).await?;
        kept.count(variants, refused);
    }
}

/// What comes of a run that may take so long.
///
/// # Errors
/// `deadline_exceeded` if it takes longer, and those of the run.
pub(super) async fn in_time(time: Duration, run: impl Future<Output = Result<bool, Problem>>) -> Result<bool, Problem> {
    tokio::time::timeout(time, run).await.unwrap_or_else(|_| {
        let detail = "the study did not finish within `study_deadline_ms`; what it has come to is kept, and the same question lets it go on";
        Err(Problem::new(ProblemCode::DeadlineExceeded, detail))
    })
}

async fn compute_chunk(engine: &Engine, study: &Arc<Study>, chunk: u64) -> Result<NewPart, Problem> {
    let work = Work::new(study, chunk);
    let id = study.id().to_string();
    let job = move |stop: &AtomicBool| {
        let part = work.run(stop).map_err(|_| NoAnswer::stopped())?;
        let (variants, refused) = (part.variants(), part.refused());
        counter!("toothwave_study_variants_total").increment(variants);
        let sealed = seal::sealed(&id, chunk, &part).map_err(|error| Problem::internal(&error))?;
        Ok(NewPart { study: id, chunk, variants, refused, sealed })
    };
    // The run of a study has a time of its own.
    engine.pool.run_in_background(Duration::MAX, job).await
}

/// The study that a stored document asks for.
///
/// # Errors
/// If it is damaged, or this build does not know such a study.
pub(super) fn read(id: &str, document: &StoredDocument) -> Result<Arc<Study>, Problem> {
    let &StoredDocument { max_states, max_profile_points, .. } = document;
    // It was admitted when it began.
    let calculation = question::Limits::new(max_states, max_profile_points);
    let limits = Limits { calculation, max_study_variants: u64::MAX, max_study_bytes: u64::MAX };
    if !document.is_intact() {
        return Err(damaged(id, "its document is another"));
    }
    Ok(Arc::new(Study::read(&document.text, &limits)?))
}

/// What a study has come to: whole if it is done, else as far as it has come.
///
/// # Errors
/// If what is kept of it is damaged, or it was forgotten in this moment.
pub(super) fn answer(store: &Store, kept: &Kept, stop: &AtomicBool) -> Result<StudyAnswer, Problem> {
    let id = &*kept.id;
    let is_done = kept.is_done();
    let document = store.now(|transaction| store::document(transaction, id))?.ok_or_else(|| forgotten(id))?;
    let study = read(id, &document)?;
    drop(document);
    if (study.variants(), study.chunks()) != (kept.variants, kept.chunks) {
        return Err(damaged(id, "it has other chunks"));
    }
    let mut gathered = Gathered::new(&study);
    let mut from_chunk = 0;
    loop {
        let parts = store.now(|transaction| store::parts(transaction, id, from_chunk))?;
        let Some((last, _)) = parts.last() else { break };
        from_chunk = last + 1;
        for (chunk, sealed) in &parts {
            let part = seal::unsealed(id, *chunk, sealed);
            gathered.add(*chunk, part.ok_or_else(|| damaged(id, &format!("the part of chunk {chunk} is another")))?);
        }
        if stop.load(Ordering::Relaxed) {
            return Err(NoAnswer::stopped().into());
        }
    }
    if is_done && !gathered.is_complete() {
        let is_there = store.now(|transaction| store::document(transaction, id))?.is_some();
        return Err(if is_there { damaged(id, "parts are missing") } else { forgotten(id) });
    }
    Ok(gathered.answer())
}

/// The problem of a study that is not in the file any more.
pub(super) fn forgotten(id: &str) -> Problem {
    let detail = format!("the study `{id}` was forgotten in this moment; ask for it again");
    Problem::new(ProblemCode::NotFound, detail)
}

fn damaged(id: &str, what: &str) -> Problem {
    let detail = "what is kept of the study is damaged; delete the study, and ask for it again";
    let cause = format!("the study {id} is damaged in its file: {what}");
    Problem { cause: Some(cause), ..Problem::new(ProblemCode::InternalError, detail) }
}
