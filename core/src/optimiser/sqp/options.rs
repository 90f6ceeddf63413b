//! Options of sequential quadratic programming.

use serde::{Deserialize, Serialize};

use crate::{
    fault::Faults,
    optimiser::{
        descent::DescentOptions,
        options::{not_negative, positive},
    },
};

/// Options of sequential quadratic programming.
///
/// Constraints are expected in normalised form (of order one). The objective may have any size, and change it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SqpOptions {
    /// What it has in common with others.
    #[serde(flatten)]
    pub descent: DescentOptions,
    /// Largest entry of the projected gradient of the Lagrangian, times the variable's range, over the objective's size or
    /// steepest slope, whichever is more, below which first-order conditions hold.
    pub stationarity_tolerance: f64,
    /// Largest move of a variable in the first iteration, as a fraction of its range.
    pub first_move: f64,
}

impl Default for SqpOptions {
    fn default() -> Self {
        Self {
            descent: DescentOptions::new(1e-4, 1e-4),
            stationarity_tolerance: 1e-4,
            first_move: 0.3,
        }
    }
}

impl SqpOptions {
    /// Notes every option outside its range, under `path`.
    pub fn faults(&self, path: &str, faults: &mut Faults) {
        self.descent.faults(path, faults);
        positive(path, &[("first_move", self.first_move)], faults);
        not_negative(
            path,
            &[("stationarity_tolerance", self.stationarity_tolerance)],
            faults,
        );
        if self.first_move > 1.0 {
            let message = format!("must be at most 1, found {}", self.first_move);
            faults.add(format!("{path}.first_move"), message);
        }
    }
}
