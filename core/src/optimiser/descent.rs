//! Options of every method that follows gradients.

use serde::{Deserialize, Serialize};

use super::{
    convergence::Rules,
    options::{GradientSource, at_least_one, not_negative, positive},
};
use crate::fault::Faults;

/// What the methods that follow gradients have in common; names in brackets are those of DOT. Each has its own defaults.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct DescentOptions {
    /// Where gradients come from.
    pub gradient: GradientSource,
    /// Ask for the gradient with every evaluation and skip the gradient phase where the accepted point's is known:
    /// for models whose adjoint costs a few per cent of the value. Ignored with differences.
    pub eager_gradients: bool,
    /// Relative step of forward differences (FDCH).
    pub difference_step: f64,
    /// Least absolute step of forward differences (FDCHM).
    pub least_difference_step: f64,
    /// A constraint is violated above this value (CTMIN).
    pub violation_tolerance: f64,
    /// Absolute change of the objective that counts as none (DABOBJ); `None`: a share of |F0| that the method says, at least
    /// 1e-20.
    pub absolute_tolerance: Option<f64>,
    /// Relative change of the objective that counts as none (DELOBJ).
    pub relative_tolerance: f64,
    /// Consecutive iterations on which a change must count as none (ITRMOP).
    pub consecutive: usize,
    /// Most iterations (ITMAX).
    pub max_iterations: usize,
    /// Consecutive infeasible iterations after which the search for a feasible design is given up.
    pub infeasible_iterations: usize,
    /// A feasible run stops when it costs this many times what brought it to within 0.1 % of its best value; 0: never.
    pub stall_factor: f64,
}

impl DescentOptions {
    /// Those of a method with two tolerances of its own.
    pub(super) fn new(violation_tolerance: f64, relative_tolerance: f64) -> Self {
        Self {
            gradient: GradientSource::Model,
            eager_gradients: false,
            difference_step: 1e-3,
            least_difference_step: 1e-4,
            violation_tolerance,
            absolute_tolerance: None,
            relative_tolerance,
            consecutive: 2,
            max_iterations: 100,
            infeasible_iterations: 20,
            stall_factor: 3.0,
        }
    }

    /// Whether trials are asked for with their gradients.
    pub(super) fn eager(&self) -> bool {
        self.eager_gradients && self.gradient == GradientSource::Model
    }

    /// What small changes and the stall guard go by.
    pub(super) fn rules(&self) -> Rules {
        Rules {
            relative_tolerance: self.relative_tolerance,
            consecutive: self.consecutive,
            stall_factor: self.stall_factor,
            violation_tolerance: self.violation_tolerance,
        }
    }

    /// Notes every option outside its range, under `path`.
    pub(super) fn faults(&self, path: &str, faults: &mut Faults) {
        positive(
            path,
            &[
                ("difference_step", self.difference_step),
                ("least_difference_step", self.least_difference_step),
                ("violation_tolerance", self.violation_tolerance),
            ],
            faults,
        );
        not_negative(
            path,
            &[
                ("relative_tolerance", self.relative_tolerance),
                ("absolute_tolerance", self.absolute_tolerance.unwrap_or(0.0)),
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
    }
}
