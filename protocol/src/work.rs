//! Claim, heartbeat, report.

use salp_core::study::{EvaluationRequest, Outcome};
use serde::{Deserialize, Serialize};

use crate::id::{EvaluationId, StudyId, WorkerId};

/// Who a worker is. A study is bit-identical only on one build and one instruction set.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct WorkerIdentity {
    /// Id, once per process.
    pub id: WorkerId,
    /// Host name.
    pub host: String,
    /// Process id.
    pub pid: u32,
    /// Build of the solver.
    pub build: String,
    /// Instruction set that the solver uses.
    pub instruction_set: String,
}

/// Asks for an evaluation.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ClaimRequest {
    /// Who asks.
    pub worker: WorkerIdentity,
    /// Whether the worker may start programs.
    pub allow_commands: bool,
    /// How long the answer may be held back when there is no work, s; at most 20 are granted.
    #[serde(default)]
    pub wait_s: f64,
    /// Studies whose documents the worker has; theirs are not sent again.
    #[serde(default)]
    pub known_studies: Vec<StudyId>,
}

/// An evaluation with its lease. The answer to a claim without work is 204 and no body.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Claim {
    /// The evaluation.
    pub evaluation: EvaluationId,
    /// Fence of this claim.
    pub fence: i64,
    /// Number of this attempt, from 1.
    pub attempt: i64,
    /// Length of the lease, s; heartbeats renew it.
    pub lease_s: f64,
    /// Its study.
    pub study: StudyId,
    /// Index of its restart in the step.
    pub restart: usize,
    /// The study's document, unless the worker said that it has it.
    pub document: Option<serde_json::Value>,
    /// What is asked.
    pub request: EvaluationRequest,
}

/// Renews a lease.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct HeartbeatRequest {
    /// Fence of the claim.
    pub fence: i64,
}

/// Answer to a heartbeat.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct HeartbeatAnswer {
    /// What to do.
    pub directive: Directive,
}

/// What a worker does after a heartbeat.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Directive {
    /// Go on.
    Continue,
    /// Stop this evaluation and report it cancelled.
    Cancel,
    /// End after this evaluation.
    Drain,
}

/// Reports an outcome. The coordinator takes the outcome as plain JSON at first: what cannot be read is a result of its
/// own, not a lost report.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ReportRequest<O = Outcome> {
    /// Fence of the claim.
    pub fence: i64,
    /// Who reports.
    pub worker: WorkerIdentity,
    /// How it ended.
    pub outcome: O,
}

/// Answer to a report; the same to a repeated one.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct ReportAnswer {
    /// Status under which the outcome was stored.
    pub status: String,
}

/// Gives an evaluation back, unfinished, without an attempt lost.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct ReleaseRequest {
    /// Fence of the claim.
    pub fence: i64,
}

/// A worker as the coordinator saw it.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct WorkerView {
    /// Who.
    #[serde(flatten)]
    pub identity: WorkerIdentity,
    /// First claim, ms since 1970 UTC.
    pub first_seen_ms: i64,
    /// Last claim, heartbeat or report, ms since 1970 UTC.
    pub last_seen_ms: i64,
    /// Results accepted from it.
    pub evaluations: i64,
}
