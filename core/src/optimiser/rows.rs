//! Constraints as one-sided rows: an equality is two opposed inequalities inside the method.

use serde::{Deserialize, Serialize};

use super::{contract::Values, problem::Problem, vector::add_scaled};

/// Gradients at a point, as the model tells them.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Gradient {
    /// d objective / d x.
    pub objective: Vec<f64>,
    /// d constraint / d x, one row per constraint.
    pub constraints: Vec<Vec<f64>>,
}

impl Gradient {
    /// The gradients among values, if they are there, of the right lengths and finite.
    pub fn of(problem: &Problem, values: &Values) -> Option<Self> {
        let n = problem.dimension();
        let whole = |row: &Vec<f64>| row.len() == n && row.iter().all(|value| value.is_finite());
        let objective = values.gradient.clone().filter(whole)?;
        let constraints = if problem.constraints() == 0 {
            Vec::new()
        } else {
            let rows = values.constraint_gradients.clone()?;
            if rows.len() != problem.constraints() || !rows.iter().all(whole) {
                return None;
            }
            rows
        };
        Some(Self {
            objective,
            constraints,
        })
    }

    /// Gradient of the objective plus rows times their multipliers.
    pub fn lagrangian(&self, problem: &Problem, tangent: &[(usize, f64)]) -> Vec<f64> {
        let mut sum = self.objective.clone();
        for &(row, multiplier) in tangent {
            let (index, sign) = constraint(problem, row);
            add_scaled(&mut sum, sign * multiplier, &self.constraints[index]);
        }
        sum
    }
}

/// Multipliers of the constraints from those of the rows: an equality's is the difference of its two rows'.
pub(super) fn of_constraints(problem: &Problem, multipliers: &[f64]) -> Vec<f64> {
    let mut told = vec![0.0; problem.constraints()];
    for (row, multiplier) in multipliers.iter().enumerate() {
        let (index, sign) = constraint(problem, row);
        told[index] += sign * multiplier;
    }
    told
}

/// Number of one-sided rows.
pub(super) fn count(problem: &Problem) -> usize {
    problem.inequalities + 2 * problem.equalities
}

/// The constraint behind a row, and the sign it enters with.
pub(super) fn constraint(problem: &Problem, row: usize) -> (usize, f64) {
    if row < problem.inequalities {
        (row, 1.0)
    } else {
        let side = row - problem.inequalities;
        (
            problem.inequalities + side / 2,
            if side.is_multiple_of(2) { 1.0 } else { -1.0 },
        )
    }
}

/// Values of all rows.
pub(super) fn values(problem: &Problem, constraints: &[f64]) -> Vec<f64> {
    (0..count(problem))
        .map(|row| {
            let (index, sign) = constraint(problem, row);
            sign * constraints[index]
        })
        .collect()
}

/// Gradient of a row.
pub(super) fn gradient(problem: &Problem, gradient: &Gradient, row: usize) -> Vec<f64> {
    let (index, sign) = constraint(problem, row);
    gradient.constraints[index]
        .iter()
        .map(|value| sign * value)
        .collect()
}
