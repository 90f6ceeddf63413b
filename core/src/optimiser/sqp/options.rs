//! Options of sequential quadratic programming.

use serde::{Deserialize, Serialize};

use crate::{
    fault::Faults,
    optimiser::{
        convergence::Rules,
        linearisation::Common,
        options::{GradientSource, at_least_one, not_negative, positive},
    },
};

/// Options of sequential quadratic programming.
///
/// Constraints are expected in normalised form (of order one). The objective may have any size, and change it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct SqpOptions {
    /// Where gradients come from.
    pub gradient: GradientSource,
    /// Ask for the gradient with every evaluation and skip the gradient phase: for models whose adjoint costs a few per
    /// cent of the value. Ignored with differences.
    pub eager_gradients: bool,
    /// Relative step of forward differences.
    pub difference_step: f64,
    /// Least absolute step of forward differences.
    pub least_difference_step: f64,
    /// A constraint is violated above this value.
    pub violation_tolerance: f64,
    /// Absolute change of the objective that counts as none; `None`: max(1e-8 |F0|, 1e-20).
    pub absolute_tolerance: Option<f64>,
    /// Relative change of the objective that counts as none.
    pub relative_tolerance: f64,
    /// Consecutive iterations on which a change must count as none.
    pub consecutive: usize,
    /// Largest entry of the projected gradient of the Lagrangian, times the variable's range, over the objective's size or
    /// steepest slope, whichever is more, below which first-order conditions hold.
    pub stationarity_tolerance: f64,
    /// Most iterations.
    pub max_iterations: usize,
    /// Largest move of a variable in the first iteration, as a fraction of its range.
    pub first_move: f64,
    /// Consecutive infeasible iterations after which the search for a feasible design is given up.
    pub infeasible_iterations: usize,
    /// A feasible run stops when it costs this many times what brought it to within 0.1 % of its best value; 0: never.
    pub stall_factor: f64,
}

impl Default for SqpOptions {
    fn default() -> Self {
        Self {
            gradient: GradientSource::Model,
            eager_gradients: false,
            difference_step: 1e-3,
            least_difference_step: 1e-4,
            violation_tolerance: 1e-4,
            absolute_tolerance: None,
            relative_tolerance: 1e-4,
            consecutive: 2,
            stationarity_tolerance: 1e-4,
            max_iterations: 100,
            first_move: 0.3,
            infeasible_iterations: 20,
            stall_factor: 3.0,
        }
    }
}

impl SqpOptions {
    pub(super) fn common(&self) -> Common {
        Common {
            gradient: self.gradient,
            eager_gradients: self.eager_gradients,
            difference_step: self.difference_step,
            least_difference_step: self.least_difference_step,
            absolute_tolerance: self.absolute_tolerance,
            absolute_share: 1e-8,
            rules: Rules {
                relative_tolerance: self.relative_tolerance,
                consecutive: self.consecutive,
                stall_factor: self.stall_factor,
                violation_tolerance: self.violation_tolerance,
            },
        }
    }

    /// Notes every option outside its range, under `path`.
    pub fn faults(&self, path: &str, faults: &mut Faults) {
        positive(
            path,
            &[
                ("difference_step", self.difference_step),
                ("least_difference_step", self.least_difference_step),
                ("violation_tolerance", self.violation_tolerance),
                ("first_move", self.first_move),
            ],
            faults,
        );
        not_negative(
            path,
            &[
                ("relative_tolerance", self.relative_tolerance),
                ("absolute_tolerance", self.absolute_tolerance.unwrap_or(0.0)),
                ("stationarity_tolerance", self.stationarity_tolerance),
                ("stall_factor", self.stall_factor),
            ],
            faults,
        );
        at_least_one(
            path,
            &[
                ("consecutive", self.consecutive),
                ("max_iterations", self.max_iterations),
                ("infeasible_iterations", self.infeasible_iterations),
            ],
            faults,
        );
        if self.first_move > 1.0 {
            let message = format!("must be at most 1, found {}", self.first_move);
            faults.add(format!("{path}.first_move"), message);
        }
    }
}
