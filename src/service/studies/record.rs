//! A study record: the state of one study, which its run changes and clients watch.

use std::sync::atomic::AtomicU64;

use serde::Serialize;
use tokio::sync::watch;
use tokio_util::sync::CancellationToken;
use toothwave_study::{Study, StudyAnswer};
use utoipa::ToSchema;

use super::store::StoredStudy;
use crate::http::problem::Problem;

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

/// A study that the service has.
#[derive(Debug)]
pub struct StudyRecord {
    pub(super) id: String,
    kind: &'static str,
    variants: u64,
    bytes: u64,
    /// Seconds since 1970.
    pub(super) asked_at_s: AtomicU64,
    status: watch::Sender<Status>,
    /// Cancelled to end the run.
    pub(super) stop: CancellationToken,
}

#[derive(Debug, Clone)]
struct Status {
    state: StudyState,
    problem: Option<Problem>,
    /// The parts that are stored.
    progress: Progress,
}

/// How many variants have been computed, and how many of these have no answer.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Progress {
    pub(super) variants: u64,
    pub(super) impossible: u64,
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
    /// Where the result stands below the service's address, as far as it has come.
    pub result_href: String,
    /// Where it tells of its progress, below the service's address.
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

/// About the memory that a study takes with its result.
pub(super) fn bytes(study: &Study) -> u64 {
    /// The document and the record.
    const OTHER_BYTES: u64 = 4096;
    OTHER_BYTES + study.kept_bytes()
}

impl StudyRecord {
    pub(super) fn new(stored: StoredStudy, study: &Study, stop: CancellationToken) -> Self {
        let StoredStudy { id, state, problem, progress, asked_at_s, .. } = stored;
        Self {
            id,
            kind: study.kind(),
            variants: study.variants(),
            bytes: bytes(study),
            asked_at_s: asked_at_s.into(),
            status: watch::Sender::new(Status { state, problem, progress }),
            stop,
        }
    }

    /// About the memory that the study takes with its result.
    pub const fn bytes(&self) -> u64 {
        self.bytes
    }

    /// The state as clients get it, without the result.
    pub fn resource(&self) -> StudyResource {
        let Status { state, problem, progress } = self.status.borrow().clone();
        StudyResource {
            id: self.id.clone(),
            study: self.kind.into(),
            state,
            variants: self.variants,
            looked_at: progress.variants,
            impossible: progress.impossible,
            result_href: format!("/v1/studies/{}/result", self.id),
            events_href: format!("/v1/studies/{}/events", self.id),
            problem,
            result: None,
        }
    }

    pub(super) fn state(&self) -> StudyState {
        self.status.borrow().state
    }

    /// Whether the study runs.
    pub(super) fn is_running(&self) -> bool {
        self.state() == StudyState::Running
    }

    /// Completes at the next change after this call.
    pub fn changed(&self) -> impl Future<Output = ()> + Send + use<> {
        let mut status = self.status.subscribe();
        async move {
            // An error means that the record was removed: there are no further changes.
            let _ = status.changed().await;
        }
    }

    /// Completes when the study does not run.
    pub async fn ended(&self) {
        // An error means that the record was removed.
        let _ = self.status.subscribe().wait_for(|status| status.state != StudyState::Running).await;
    }

    /// Counts a part that was stored.
    pub(super) fn count(&self, part: Progress) {
        self.status.send_modify(|Status { progress, .. }| {
            progress.variants += part.variants;
            progress.impossible += part.impossible;
        });
    }

    pub(super) fn set_state(&self, state: StudyState, problem: Option<Problem>) {
        self.status.send_modify(|status| (status.state, status.problem) = (state, problem));
    }
}
