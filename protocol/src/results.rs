//! Results: ledger, curve, candidates.

use salp_core::study::Outcome;
use salp_core::study::race::Fidelity;
use serde::{Deserialize, Serialize};

use crate::id::{EvaluationId, WorkerId};
use crate::study::BandCounts;

/// One line of the ledger, in the optimiser's order within a restart.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct EvaluationRow {
    /// The evaluation.
    pub evaluation: EvaluationId,
    /// Index of the step.
    pub step: usize,
    /// Index of the restart in its step.
    pub restart: usize,
    /// Batch of the restart.
    pub batch: i64,
    /// Place in the batch.
    pub batch_index: i64,
    /// Why it was asked; `band` for an error band.
    pub kind: String,
    /// The evaluation whose band this is. Batch and place in it mean nothing then.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub band_of: Option<EvaluationId>,
    /// The fidelity below the study's own at which it was asked: it never counts as best.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub fidelity: Option<Fidelity>,
    /// Iteration of the optimiser.
    pub iteration: usize,
    /// Design variables.
    pub x: Vec<f64>,
    /// `ready`, `leased`, `withdrawn`, or the status of the outcome.
    pub status: String,
    /// Objective of an ok outcome.
    pub objective: Option<f64>,
    /// Largest violation of a constraint of an ok outcome, 0 when none.
    pub max_violation: Option<f64>,
    /// Within the optimiser's violation tolerance.
    pub feasible: bool,
    /// Walls cross somewhere on the path.
    pub overlap: bool,
    /// The evaluation that paid for this result, where it was known already.
    pub cached_from: Option<EvaluationId>,
    /// Wall time, s.
    pub wall_s: Option<f64>,
    /// CPU time, s.
    pub cpu_s: Option<f64>,
    /// Worker.
    pub worker: Option<WorkerId>,
    /// Attempt.
    pub attempt: i64,
    /// Fence.
    pub fence: i64,
    /// Asked, ms since 1970 UTC.
    pub created_ms: i64,
    /// Stored, ms since 1970 UTC.
    pub finished_ms: Option<i64>,
    /// The whole outcome, where `?outcome=true` asks for it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub outcome: Option<Outcome>,
}

/// A page of the ledger.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct LedgerPage {
    /// Lines, by evaluation id.
    pub evaluations: Vec<EvaluationRow>,
    /// Give as `?cursor=` for the next page; absent on the last one.
    pub next: Option<String>,
}

/// What runs along a curve.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Axis {
    /// CPU time: of a restart the sum over its own evaluations, in its optimiser's order.
    Cpu,
    /// Wall time since the study's first claim.
    Wall,
    /// Number of evaluations.
    Evaluations,
}

/// Run time against objective.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Curve {
    /// Axis.
    pub axis: Axis,
    /// Per restart.
    pub restarts: Vec<RestartCurve>,
    /// Over all restarts of a step, in the order of completion; only the points where the best changes, and the last one.
    pub best: Vec<BestSoFar>,
    /// Evaluations of the error bands.
    pub bands: BandCounts,
}

/// A point where the best changes.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct BestSoFar {
    /// The point.
    #[serde(flatten)]
    pub point: CurvePoint,
    /// Lower end of the error band of `best`; null while it is not known.
    pub band_low: Option<f64>,
    /// Upper end.
    pub band_high: Option<f64>,
    /// Whether `best` lies within the band of the best before it: they are told apart by less than the mesh's error.
    pub tie: bool,
}

/// Curve of a restart.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RestartCurve {
    /// Index of the step.
    pub step: usize,
    /// Index of the restart.
    pub index: usize,
    /// Points, in the optimiser's order.
    pub points: Vec<CurvePoint>,
}

/// A point of a curve.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct CurvePoint {
    /// Index of the step.
    pub step: usize,
    /// Time along the axis, s; on the axis of evaluations the CPU time.
    pub t_s: f64,
    /// Evaluations so far.
    pub evaluations: u64,
    /// Objective of this evaluation; null without values.
    pub objective: Option<f64>,
    /// Best so far among the feasible points without overlapping walls.
    pub best: Option<f64>,
    /// Largest violation of a constraint, 0 when none.
    pub max_violation: Option<f64>,
    /// Within the optimiser's violation tolerance.
    pub feasible: bool,
    /// Walls cross somewhere on the path.
    pub overlap: bool,
    /// Below the study's own fidelity: its cost counts, its objective does not.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub coarse: bool,
}

/// A distinct good point: the best of a restart. Those of a step come best first.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Candidate {
    /// Index of the step.
    pub step: usize,
    /// Index of the restart.
    pub restart: usize,
    /// The evaluation.
    pub evaluation: EvaluationId,
    /// Design variables.
    pub x: Vec<f64>,
    /// Minimised.
    pub objective: f64,
    /// Constraint values.
    pub constraints: Vec<f64>,
    /// Largest violation of a constraint, 0 when none.
    pub max_violation: f64,
    /// Error band of the objective, from a second mesh; null while it is not known, and of models without a mesh.
    #[serde(default)]
    pub band: Option<[f64; 2]>,
    /// Largest difference of a variable from the best of its step over its range; null where they have different variables.
    #[serde(default)]
    pub distance: Option<f64>,
    /// The first better one of its step that is the same within its error: near, and their bands meet.
    #[serde(default)]
    pub same_as: Option<EvaluationId>,
}
