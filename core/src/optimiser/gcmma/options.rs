//! Options of the moving asymptotes.

use serde::{Deserialize, Serialize};

use crate::{
    fault::Faults,
    optimiser::{
        descent::DescentOptions,
        options::{not_negative, positive},
    },
};

/// Options of the method of moving asymptotes, globally convergent (GCMMA) or not (MMA).
///
/// Constraints are expected in normalised form (of order one). The objective may have any size, and change it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct GcmmaOptions {
    /// What it has in common with others.
    #[serde(flatten)]
    pub descent: DescentOptions,
    /// Whether a trial that is worse than its approximation is tried again with a more conservative one (GCMMA), or every
    /// trial becomes the iterate (MMA).
    pub globalise: bool,
    /// Largest entry of the projected gradient of the Lagrangian over the objective's steepest slope, both in units of the
    /// asymptotes' distances, below which first-order conditions hold.
    pub stationarity_tolerance: f64,
    /// Largest move of a variable in the first iteration, as a fraction of the distance of its bounds.
    pub first_move: f64,
}

impl Default for GcmmaOptions {
    fn default() -> Self {
        Self {
            descent: DescentOptions::new(0.003, 1e-4),
            globalise: true,
            stationarity_tolerance: 1e-4,
            first_move: 0.5,
        }
    }
}

impl GcmmaOptions {
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
