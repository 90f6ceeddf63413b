//! What an evaluation is asked, and what it answers.

use serde::{Deserialize, Serialize};

use super::race::Fidelity;
use super::takes::Given;
use crate::optimiser::AskKind;
use crate::reduced::LinearTransform;
use crate::scene::Orientation;

/// One evaluation: the unit of work that a worker pulls.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct EvaluationRequest {
    /// Index of the step in the study.
    pub step: usize,
    /// Why the optimiser asks.
    pub kind: AskKind,
    /// Iteration of the optimiser.
    pub iteration: usize,
    /// Design variables.
    pub x: Vec<f64>,
    /// Whether gradients are wanted.
    pub want_gradient: bool,
    /// The design variables from which the mesh plan is chosen; `None` for models without a mesh.
    pub plan_base: Option<Vec<f64>>,
    /// The sense of the enclosed area for this restart; `None` under `either`: the better one at this design.
    pub orientation: Option<Orientation>,
    /// Whether the objective alone is wanted, on the second mesh of error bands; the other fields are those of the
    /// evaluation whose band it is.
    #[serde(default, skip_serializing_if = "is_false")]
    pub second_mesh: bool,
    /// A fidelity below the study's own, on a rung of a race: such a design never counts as best.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub fidelity: Option<Fidelity>,
    /// What the step was given by others.
    #[serde(default, skip_serializing_if = "Given::is_empty")]
    pub given: Given,
}

#[expect(
    clippy::trivially_copy_pass_by_ref,
    reason = "the signature that serde asks for"
)]
pub(super) fn is_false(flag: &bool) -> bool {
    !flag
}

/// How an evaluation ended.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "status", rename_all = "snake_case")]
pub enum OutcomeStatus {
    /// Values are given.
    Ok,
    /// The design cannot be meshed.
    InfeasibleGeometry {
        /// Why.
        reason: String,
    },
    /// No equilibrium exists on the path beyond a load.
    NoEquilibrium {
        /// Kind of limit.
        kind: String,
        /// (leg + fraction) / legs at the last converged state.
        load_fraction: f64,
    },
    /// No stable equilibrium at the load margin, and no derivative of where it ends.
    NoMargin {
        /// Kind of limit.
        kind: String,
        /// Times a row's load that was reached.
        factor: f64,
        /// The margin that is asked for minus that.
        missing: f64,
    },
    /// The path meets a second equilibrium.
    NotUnique {
        /// (leg + fraction) / legs where it does.
        load_fraction: f64,
    },
    /// A failure of ours.
    NotConverged {
        /// What failed.
        reason: String,
        /// (leg + fraction) / legs at the last converged state.
        load_fraction: f64,
    },
    /// The worker reported nonsense: a wrong length, a non-finite number.
    InvalidResult {
        /// What was wrong.
        reason: String,
    },
    /// A command model failed.
    Failed {
        /// Its exit, its answer.
        reason: String,
    },
    /// The limit in Newton iterations and factorisations was reached.
    WorkLimit,
    /// Cancelled.
    Cancelled,
    /// The lease expired more often than the cap.
    Lost,
}

/// The answer to an [`EvaluationRequest`].
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Outcome {
    /// How it ended.
    #[serde(flatten)]
    pub status: OutcomeStatus,
    /// Minimised; present exactly where the status is ok.
    pub objective: Option<f64>,
    /// Feasible when <= 0; equalities follow the inequalities. Empty where the status is not ok.
    pub constraints: Vec<f64>,
    /// d objective / d x.
    pub gradient: Option<Vec<f64>>,
    /// d constraint / d x, one row per constraint.
    pub constraint_gradients: Option<Vec<Vec<f64>>>,
    /// What a finite-element model says beside the numbers.
    pub report: Option<EvaluationReport>,
    /// Seconds of wall time.
    pub wall_s: f64,
    /// Seconds of CPU time.
    pub cpu_s: f64,
}

/// What a finite-element evaluation says beside its numbers.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct EvaluationReport {
    /// Enclosed area of the tip path, counter-clockwise positive, mm^2.
    pub enclosed_area_mm2: Option<f64>,
    /// Values of the target's measure and of those of the bounds, in the document's order; empty where the path is not
    /// complete.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub measures: Vec<f64>,
    /// States of the path.
    pub path: Vec<StateReport>,
    /// First state where walls cross.
    pub walls_overlap: Option<OverlapReport>,
    /// Largest averaged stretch over the path.
    pub max_stretch: f64,
    /// Largest averaged stretch at the load margin, where it was wanted and reached.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub margin_stretch: Option<f64>,
    /// Times a row's load that was reached, where the load margin was not.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub margin_reached: Option<f64>,
    /// Where a second equilibrium was met.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub loss_of_uniqueness: Option<LossReport>,
    /// Largest number of negative pivots over the path.
    pub negative_pivots: usize,
    /// Transformations of the unit at the loaded rows of the schedule, where those were asked for.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub transforms: Vec<LinearTransform>,
    /// Number of elements.
    pub elements: usize,
    /// Free displacement unknowns.
    pub dofs: usize,
    /// Newton iterations.
    pub newton_iterations: usize,
    /// Factorisations.
    pub factorisations: usize,
    /// What was left out and why.
    pub left_out: Vec<String>,
    /// What a reader of the numbers should know: laws used beyond their range. Only where the stretch is looked at.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub notes: Vec<Note>,
}

/// What a reader of the numbers should know.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Note {
    /// The field of the document that it is about.
    pub about: String,
    /// What there is to know.
    pub message: String,
}

/// One state of the path.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct StateReport {
    /// Channel pressures, kPa.
    pub pressure_kpa: Vec<f64>,
    /// Tip displacement, mm.
    pub tip_mm: [f64; 2],
    /// Largest averaged stretch.
    pub max_stretch: f64,
}

/// Where a second equilibrium was met.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct LossReport {
    /// Leg, from 0.
    pub leg: usize,
    /// Fraction of the leg.
    pub fraction: f64,
    /// Channel pressures, kPa.
    pub pressure_kpa: Vec<f64>,
}

/// A crossing of walls.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct OverlapReport {
    /// Leg, from 0.
    pub leg: usize,
    /// Fraction of the leg.
    pub fraction: f64,
    /// Channel pressures, kPa.
    pub pressure_kpa: Vec<f64>,
    /// A point of the crossing in the deformed shape, mm.
    pub at_mm: [f64; 2],
    /// Whether the walls of one corner fold onto each other, rather than wall meeting wall.
    pub corner_fold: bool,
}

impl Outcome {
    /// Whether walls cross (a corner fold does not count as a crossing of walls).
    pub fn walls_overlap(&self) -> bool {
        self.report
            .as_ref()
            .and_then(|r| r.walls_overlap.as_ref())
            .is_some_and(|o| !o.corner_fold)
    }
}
