//! Studies as a client sees them.

use salp_core::study::race::RaceSummary;
use serde::{Deserialize, Serialize};

use crate::id::{EvaluationId, StudyId};

/// State of a study.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum StudyState {
    /// No evaluation was claimed yet.
    Queued,
    /// Evaluations are handed out.
    Running,
    /// Nothing is handed out.
    Paused,
    /// Cancelled, but evaluations are still out.
    Cancelling,
    /// Cancelled.
    Cancelled,
    /// Every step ended.
    Done,
    /// An optimiser broke, or a step could not begin because another one found nothing to hand on.
    Failed,
}

impl StudyState {
    /// As in the API and in the store.
    pub fn as_str(self) -> &'static str {
        match self {
            Self::Queued => "queued",
            Self::Running => "running",
            Self::Paused => "paused",
            Self::Cancelling => "cancelling",
            Self::Cancelled => "cancelled",
            Self::Done => "done",
            Self::Failed => "failed",
        }
    }

    /// The inverse of [`Self::as_str`].
    pub fn parse(text: &str) -> Option<Self> {
        Some(match text {
            "queued" => Self::Queued,
            "running" => Self::Running,
            "paused" => Self::Paused,
            "cancelling" => Self::Cancelling,
            "cancelled" => Self::Cancelled,
            "done" => Self::Done,
            "failed" => Self::Failed,
            _ => return None,
        })
    }

    /// Whether nothing will happen any more.
    pub fn is_final(self) -> bool {
        matches!(self, Self::Cancelled | Self::Done | Self::Failed)
    }
}

impl std::fmt::Display for StudyState {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(self.as_str())
    }
}

/// Answer to a submission.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct StudyCreated {
    /// Id.
    pub id: StudyId,
    /// Path of the study.
    pub url: String,
}

/// A page of studies, latest first.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct StudyPage {
    /// Studies.
    pub studies: Vec<StudyView>,
    /// Give as `?cursor=` for the next page; absent on the last one.
    pub next: Option<String>,
}

/// A study.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct StudyView {
    /// Id.
    pub id: StudyId,
    /// Name.
    pub name: String,
    /// State.
    pub state: StudyState,
    /// Why it failed.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub failure: Option<String>,
    /// Hash of the resolved document.
    pub fingerprint: String,
    /// Steps, in order.
    pub steps: Vec<StepView>,
    /// Best point of the latest step that has one.
    pub best: Option<Best>,
    /// Counts.
    pub counts: Counts,
    /// Submitted, ms since 1970 UTC.
    pub created_ms: i64,
    /// First claim, ms since 1970 UTC.
    pub started_ms: Option<i64>,
    /// End, ms since 1970 UTC.
    pub ended_ms: Option<i64>,
}

/// A step of a study.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct StepView {
    /// Id in the document.
    pub id: String,
    /// State.
    pub state: StepState,
    /// Why it is blocked.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub reason: Option<String>,
    /// What it took from other steps; `None` before it began.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub inputs: Option<serde_json::Value>,
    /// What it hands on; `None` before it is done.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub result: Option<serde_json::Value>,
    /// Begun, ms since 1970 UTC.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub began_ms: Option<i64>,
    /// Done or blocked, ms since 1970 UTC.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub ended_ms: Option<i64>,
    /// Best point.
    pub best: Option<Best>,
    /// How its restarts compete; `None` where they do not.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub race: Option<RaceSummary>,
}

/// State of a step.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum StepState {
    /// What it takes from other steps is not there yet.
    Waiting,
    /// In progress.
    Running,
    /// Every restart ended.
    Done,
    /// What it takes from other steps will never be there.
    Blocked,
}

impl StepState {
    /// As in the API and in the store.
    pub fn as_str(self) -> &'static str {
        match self {
            Self::Waiting => "waiting",
            Self::Running => "running",
            Self::Done => "done",
            Self::Blocked => "blocked",
        }
    }

    /// The inverse of [`Self::as_str`].
    pub fn parse(text: &str) -> Option<Self> {
        Some(match text {
            "waiting" => Self::Waiting,
            "running" => Self::Running,
            "done" => Self::Done,
            "blocked" => Self::Blocked,
            _ => return None,
        })
    }
}

/// A best point: within the optimiser's violation tolerance and without overlapping walls.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Best {
    /// Design variables.
    pub x: Vec<f64>,
    /// Minimised.
    pub objective: f64,
    /// Largest violation of a constraint, 0 when none.
    pub max_violation: f64,
    /// The evaluation.
    pub evaluation: EvaluationId,
    /// Index of the restart.
    pub restart: usize,
}

/// Counts of a study. Error bands and guesses are counted apart.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Counts {
    /// Restarts begun.
    pub restarts: u64,
    /// Restarts ended.
    pub restarts_done: u64,
    /// Evaluations asked for.
    pub evaluations: u64,
    /// Answered.
    pub answered: u64,
    /// Waiting for a worker.
    pub ready: u64,
    /// With a worker.
    pub leased: u64,
    /// Answered without values, for whatever reason.
    pub without_values: u64,
    /// Answered `not_converged`, `invalid_result` or `lost`: ours to explain.
    pub alarms: u64,
    /// Evaluations of error bands, which are in none of the other counts.
    #[serde(default)]
    pub bands: BandCounts,
    /// Evaluations of guesses, which are in none of the other counts.
    #[serde(default)]
    pub guesses: GuessCounts,
}

/// Evaluations of what an optimiser would probably ask, by workers that nothing else needed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct GuessCounts {
    /// Answered; what was withdrawn before its answer counts nowhere.
    pub answered: u64,
    /// Of these, results that an optimiser has asked for since.
    pub used: u64,
    /// CPU time of all answered, s. What was used is in the CPU time of no optimiser.
    pub cpu_s: f64,
}

/// Evaluations of error bands.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct BandCounts {
    /// Asked for.
    pub evaluations: u64,
    /// Answered.
    pub answered: u64,
    /// Answered without a value: these bands are not known.
    pub without_values: u64,
    /// CPU time that was spent on them, s.
    pub cpu_s: f64,
}

/// A restart.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RestartView {
    /// Index of the step.
    pub step: usize,
    /// Index of the restart in its step.
    pub index: usize,
    /// State.
    pub state: RestartState,
    /// Steps of the optimiser so far.
    pub version: i64,
    /// Evaluations that the optimiser was told.
    pub evaluations: u64,
    /// Best point.
    pub best: Option<Best>,
    /// Hash over what the optimiser was told, in its order: step, restart, kind, design bits, objective bits, outcome.
    pub history_sha256: String,
    /// What the optimiser says of itself: seed, stop reason, counts, final point.
    pub summary: serde_json::Value,
}

/// State of a restart.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum RestartState {
    /// Evaluations are out.
    Running,
    /// It competes with others, and waits for a decision that follows from those of lower index.
    Waiting,
    /// The optimiser stopped.
    Done,
}
