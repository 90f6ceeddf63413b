//! Options of CMA-ES.

use serde::{Deserialize, Serialize};

use crate::{
    fault::Faults,
    optimiser::options::{not_negative, positive},
};

/// Options of the evolution strategy with covariance matrix adaptation.
///
/// Constraints are expected in normalised form (of order one). The objective may have any size: unconstrained, only its
/// order counts.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct CmaEsOptions {
    /// Seed of its random numbers.
    pub seed: u64,
    /// Points of a generation, all asked at once; `None`: 4 + 3 ln n.
    pub population: Option<usize>,
    /// Standard deviation of the first generation, as a fraction of the distance of the bounds.
    pub first_step: f64,
    /// Times that the run begins again with twice the population from a random point, once it has converged (IPOP).
    pub doublings: usize,
    /// Most evaluations; `None`: 1000 per variable.
    pub max_evaluations: Option<usize>,
    /// A constraint is violated above this value.
    pub violation_tolerance: f64,
    /// Absolute change of the objective that counts as none; `None`: max(1e-8 |F0|, 1e-20).
    pub absolute_tolerance: Option<f64>,
    /// Relative change of the objective that counts as none.
    pub relative_tolerance: f64,
    /// Steps, as fractions of the distance of the bounds, that count as none.
    pub step_tolerance: f64,
    /// A run ends when it costs this many times what brought it to within 0.1 % of its best value, or of its least violation
    /// as long as nothing is feasible, and at least 120 + 30 n / population generations have passed since; 0: never.
    pub stall_factor: f64,
}

impl Default for CmaEsOptions {
    fn default() -> Self {
        Self {
            seed: 1,
            population: None,
            first_step: 0.3,
            doublings: 0,
            max_evaluations: None,
            violation_tolerance: 0.003,
            absolute_tolerance: None,
            relative_tolerance: 1e-3,
            step_tolerance: 1e-6,
            stall_factor: 3.0,
        }
    }
}

/// Fewest points of a generation: two parents and as many that teach what to avoid.
const LEAST_POPULATION: usize = 4;
/// Most doublings: beyond them a generation alone is dear.
const MOST_DOUBLINGS: usize = 10;

impl CmaEsOptions {
    /// Notes every option outside its range, under `path`.
    pub fn faults(&self, path: &str, faults: &mut Faults) {
        positive(
            path,
            &[
                ("first_step", self.first_step),
                ("violation_tolerance", self.violation_tolerance),
            ],
            faults,
        );
        not_negative(
            path,
            &[
                ("relative_tolerance", self.relative_tolerance),
                ("absolute_tolerance", self.absolute_tolerance.unwrap_or(0.0)),
                ("step_tolerance", self.step_tolerance),
                ("stall_factor", self.stall_factor),
            ],
            faults,
        );
        if self.first_step > 1.0 {
            let message = format!("must be at most 1, found {}", self.first_step);
            faults.add(format!("{path}.first_step"), message);
        }
        if let Some(found) = self.population.filter(|p| *p < LEAST_POPULATION) {
            let message = format!("must be at least {LEAST_POPULATION}, found {found}");
            faults.add(format!("{path}.population"), message);
        }
        if self.doublings > MOST_DOUBLINGS {
            let message = format!("must be at most {MOST_DOUBLINGS}, found {}", self.doublings);
            faults.add(format!("{path}.doublings"), message);
        }
        if self.max_evaluations == Some(0) {
            faults.add(format!("{path}.max_evaluations"), "must be at least 1");
        }
    }
}
