//! The record of a study: the state that its run changes and clients watch.

use std::sync::atomic::AtomicU64;

use serde::Serialize;
use tokio::sync::watch;
use tokio_util::sync::CancellationToken;
use toothwave_study::{Study, StudyAnswer};
use utoipa::ToSchema;

use super::state::{Progress, StudyState};
use super::store::StoredStudy;
use crate::http::problem::Problem;

/// Record of one study.
#[derive(Debug)]
pub struct StudyRecord {
    pub(super) id: String,
    kind: &'static str,
    variants: u64,
    bytes: u64,
    /// Seconds since 1970.
    pub(super) asked_at_s: AtomicU64,
    status: watch::Sender<Status>,
    /// Cancelled to stop the run.
    pub(super) stop: CancellationToken,
}

#[derive(Debug, Clone)]
struct Status {
    state: StudyState,
    problem: Option<Problem>,
    /// Progress of the stored parts.
    progress: Progress,
}

/// Current state of a study.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
pub struct StudyResource {
    /// Identifier: a hash of the study document.
    pub id: String,
    /// Kind of study.
    pub study: String,
    /// State.
    pub state: StudyState,
    /// Variants of the study.
    pub variants: u64,
    /// Computed variants. A search also counts the variants that it evaluates again with accurate peaks.
    pub looked_at: u64,
    /// Computed variants without an answer. A search counts those of its scan alone.
    pub impossible: u64,
    /// Path of the result below the service's address. It is partial while the study runs.
    pub result_href: String,
    /// Path of the progress events below the service's address.
    pub events_href: String,
    /// Problem of a failed study.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub problem: Option<Problem>,
    /// Result, in the response to a `POST` after the study has ended.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub result: Option<StudyAnswer>,
}

/// Estimates the memory of a study with its result, in bytes.
pub(super) fn bytes(study: &Study) -> u64 {
    /// Bytes of the document and the record.
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

    /// Estimated memory of the study with its result, in bytes.
    pub const fn bytes(&self) -> u64 {
        self.bytes
    }

    /// Returns the state without the result.
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

    /// True if the study runs.
    pub(super) fn is_running(&self) -> bool {
        self.state() == StudyState::Running
    }

    /// Completes at the next change after this call.
    pub fn changed(&self) -> impl Future<Output = ()> + Send + use<> {
        let mut status = self.status.subscribe();
        async move {
            // An error means that the record was removed, so there are no further changes.
            let _ = status.changed().await;
        }
    }

    /// Completes when the study has ended.
    pub async fn ended(&self) {
        // An error means that the record was removed.
        let _ = self.status.subscribe().wait_for(|status| status.state != StudyState::Running).await;
    }

    /// Counts a stored part.
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
