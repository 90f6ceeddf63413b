//! An evaluated point, and the best of several.

use serde::{Deserialize, Serialize};

use super::{contract::Values, problem::Problem};

/// A design and its values.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Point {
    /// Design variables.
    pub x: Vec<f64>,
    /// Objective.
    pub objective: f64,
    /// Constraints: inequalities, then equalities.
    pub constraints: Vec<f64>,
    /// Largest violation.
    pub violation: f64,
}

impl Point {
    pub(crate) fn new(problem: &Problem, x: Vec<f64>, values: &Values) -> Self {
        Self {
            x,
            objective: values.objective,
            violation: problem.violation(&values.constraints),
            constraints: values.constraints.clone(),
        }
    }

    /// Feasible points by their objective, before infeasible ones by their violation.
    pub fn better_than(&self, other: &Self, tolerance: f64) -> bool {
        match (self.violation <= tolerance, other.violation <= tolerance) {
            (true, true) => self.objective < other.objective,
            (false, false) => self.violation < other.violation,
            (feasible, _) => feasible,
        }
    }
}

/// Keeps the better of what was best and a new point.
pub(crate) fn keep_best(best: &mut Option<Point>, point: &Point, tolerance: f64) {
    if best
        .as_ref()
        .is_none_or(|best| point.better_than(best, tolerance))
    {
        *best = Some(point.clone());
    }
}
