//! Why a run ended.

use serde::{Deserialize, Serialize};

/// An objective below this falls without limit.
pub(super) const UNBOUNDED: f64 = -1e40;

/// Why a run ended, with the numbers that decided it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "reason", rename_all = "snake_case", deny_unknown_fields)]
pub enum StopReason {
    /// First-order conditions: the projected gradient over the gradient.
    KuhnTucker {
        /// Length of the projected direction, the gradient's being 1.
        residual: f64,
    },
    /// The objective changed by no more than `tolerance` in consecutive feasible iterations.
    Absolute {
        /// Last change of the objective.
        change: f64,
        /// The tolerance (DABOBJ).
        tolerance: f64,
    },
    /// The objective changed relatively by no more than `tolerance` in consecutive feasible iterations.
    Relative {
        /// Last change of the objective over its value.
        change: f64,
        /// The tolerance (DELOBJ).
        tolerance: f64,
    },
    /// As many iterations as allowed.
    IterationLimit {
        /// The limit (ITMAX).
        iterations: usize,
    },
    /// No feasible design after the allowed number of iterations, or no direction towards one.
    NoFeasibleDesign {
        /// Consecutive iterations outside the feasible region.
        iterations: usize,
        /// Largest constraint violation reached.
        violation: f64,
    },
    /// The objective falls without limit.
    Unbounded {
        /// Its last value.
        objective: f64,
    },
    /// Neither the start nor points near it could be evaluated.
    FailedStart {
        /// Points tried.
        attempts: usize,
    },
    /// The gradient could not be had: neither from the model nor by differences.
    NoGradient {
        /// Points tried for it at this iterate.
        attempts: usize,
    },
    /// Evaluations fail however short the step, in every direction of descent tried from the last iterate.
    Blocked {
        /// Directions tried.
        directions: usize,
    },
    /// The run costs more than the stall factor times what brought it to within 0.1 % of its best value.
    Stall {
        /// Analyses and gradients so far.
        cost: usize,
        /// Analyses and gradients to within 0.1 % of the best value.
        cost_to_best: usize,
    },
    /// As many evaluations as allowed, or fewer than a generation from it.
    EvaluationLimit {
        /// The limit.
        evaluations: usize,
    },
    /// The search has become as small as its steps may.
    SmallSteps {
        /// Largest standard deviation of a step along a variable, as a fraction of the distance of its bounds.
        step: f64,
        /// The tolerance.
        tolerance: f64,
    },
    /// The distribution of steps is too flat to draw from.
    Condition {
        /// Condition number of its covariance matrix.
        condition: f64,
        /// The limit.
        limit: f64,
    },
    /// No sequence is better that differs from the best one by an exchange or by a swap.
    NoBetterExchange {
        /// Sequences evaluated.
        points: usize,
        /// Sequences without values.
        failed: usize,
    },
    /// Every point of a random search was evaluated, or every sequence.
    SearchComplete {
        /// Points of the search.
        points: usize,
        /// Points without values.
        failed: usize,
    },
    /// Every point of a sweep was evaluated.
    SweepComplete {
        /// Points of the sweep.
        points: usize,
        /// Points without values.
        failed: usize,
    },
}
