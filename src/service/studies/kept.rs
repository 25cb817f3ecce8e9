//! A study as it stands: told to clients, changed by its run.

use std::sync::Arc;
use std::sync::atomic::AtomicU64;

use parking_lot::Mutex;
use serde::Serialize;
use tokio::sync::watch;
use tokio_util::sync::CancellationToken;
use toothwave_calculation::json::word;
use toothwave_study::StudyAnswer;
use utoipa::ToSchema;

use super::store::StoredStudy;
use crate::http::problem::{Problem, ProblemCode};

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

/// A study that is kept.
#[derive(Debug)]
pub struct Kept {
    pub(super) id: String,
    pub(super) kind: String,
    pub(super) variants: u64,
    pub(super) chunks: u64,
    pub(super) bytes: u64,
    standing: watch::Sender<Standing>,
    pub(super) run: Mutex<CancellationToken>,
    /// When it was last asked for, in seconds since 1970, and when that was last written down.
    pub(super) asked_at_s: AtomicU64,
    pub(super) noted_at_s: AtomicU64,
}

/// How a study stands, and why it broke off.
#[derive(Debug, Clone)]
struct Standing {
    state: StudyState,
    problem: Option<Problem>,
    /// Of the chunks that have a part.
    looked_at: u64,
    impossible: u64,
}

/// A study as it stands.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
pub struct StudyResource {
    /// What tells it from every other study: a hash of what is asked.
    pub id: String,
    /// Its kind.
    pub study: String,
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
    /// About what it takes with its result.
    pub const fn bytes(&self) -> u64 {
        self.bytes
    }

    pub(super) fn new(stored: StoredStudy) -> Arc<Self> {
        let StoredStudy {
            id, kind, state, problem, variants, chunks, bytes, looked_at, impossible, asked_at_s, ..
        } = stored;
        let problem = problem.map(|text| stored_problem(&text));
        Arc::new(Self {
            id,
            kind,
            variants,
            chunks,
            bytes,
            standing: watch::Sender::new(Standing { state, problem, looked_at, impossible }),
            run: Mutex::default(),
            asked_at_s: asked_at_s.into(),
            noted_at_s: asked_at_s.into(),
        })
    }

    /// How it stands.
    pub fn resource(&self) -> StudyResource {
        let standing = self.standing.borrow();
        let &Standing { state, ref problem, looked_at, impossible } = &*standing;
        StudyResource {
            id: self.id.clone(),
            study: self.kind.clone(),
            state,
            variants: self.variants,
            looked_at,
            impossible,
            result_href: format!("/v1/studies/{}/result", self.id),
            events_href: format!("/v1/studies/{}/events", self.id),
            problem: problem.clone(),
            result: None,
        }
    }

    /// Whether it runs.
    pub fn is_running(&self) -> bool {
        self.state() == StudyState::Running
    }

    pub(super) fn is_done(&self) -> bool {
        self.state() == StudyState::Done
    }

    pub(super) fn state(&self) -> StudyState {
        self.standing.borrow().state
    }

    /// Told whenever it stands otherwise, or has come further.
    pub fn watch(&self) -> impl Future<Output = ()> + Send + use<> {
        let mut standing = self.standing.subscribe();
        async move {
            // An error says that the study is forgotten: nothing more will come.
            let _ = standing.changed().await;
        }
    }

    /// When it does not run.
    pub async fn ended(&self) {
        // An error says that nothing tells of it any more.
        let _ = self.standing.subscribe().wait_for(|standing| standing.state != StudyState::Running).await;
    }

    /// Counts a part that was kept.
    pub(super) fn count(&self, variants: u64, refused: u64) {
        self.standing.send_modify(|standing| {
            standing.looked_at += variants;
            standing.impossible += refused;
        });
    }

    pub(super) fn stand(&self, state: StudyState, problem: Option<Problem>) {
        self.standing.send_modify(|standing| {
            (standing.state, standing.problem) = (state, problem);
        });
    }
}

/// A problem as a line of text, and back.
pub(super) fn problem_text(problem: &Problem) -> String {
    format!("{} {}", word(&problem.code), problem.detail)
}

fn stored_problem(text: &str) -> Problem {
    let (code, detail) = text.split_once(' ').unwrap_or_default();
    let code = match code {
        "deadline_exceeded" => ProblemCode::DeadlineExceeded,
        "store_unavailable" => ProblemCode::StoreUnavailable,
        _ => ProblemCode::InternalError,
    };
    Problem::new(code, detail)
}
