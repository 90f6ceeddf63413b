//! What every optimiser says and hears.

use serde::{Deserialize, Serialize};

/// Why a point is asked for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum AskKind {
    /// The start.
    Initial,
    /// A gradient at the iterate, or a point of its difference batch.
    Gradient,
    /// A trial of the one-dimensional search.
    Trial,
    /// A return to the boundary of the feasible region.
    Return,
    /// The iterate again, under a new mesh plan.
    Replan,
}

/// A point that the optimiser wants evaluated. The points of one batch are independent of each other.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Ask {
    /// Why.
    pub kind: AskKind,
    /// Design variables.
    pub x: Vec<f64>,
    /// Whether gradients of the objective and of all constraints are wanted.
    pub want_gradient: bool,
    /// Iteration of the optimiser, from 0.
    pub iteration: usize,
}

/// The answer to one ask, in the order of the batch.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Told {
    /// Evaluated.
    Values(Values),
    /// No values: geometry that cannot be meshed, no equilibrium, a failed program.
    Failed,
}

/// Values at a point; finite by contract.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Values {
    /// Minimised.
    pub objective: f64,
    /// Feasible when <= 0; equalities (feasible when 0) follow the inequalities.
    pub constraints: Vec<f64>,
    /// d objective / d x where wanted.
    pub gradient: Option<Vec<f64>>,
    /// d constraint / d x where wanted, one row per constraint.
    pub constraint_gradients: Option<Vec<Vec<f64>>>,
}
