//! State and progress of a study, as stored and as served.

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

/// State of a study.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum StudyState {
    /// Variants are being computed.
    Running,
    /// All variants are computed.
    Done,
    /// A client cancelled the study. The same study document continues it.
    Cancelled,
    /// The study failed. The same study document continues it.
    Failed,
}

/// Computed variants, and those of them without an answer.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Progress {
    pub(super) variants: u64,
    pub(super) impossible: u64,
}
