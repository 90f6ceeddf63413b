//! What trials are judged by: the objective plus each violation times its penalty (the l1 merit function).

use serde::{Deserialize, Serialize};

use super::quadratic::Solution;
use crate::optimiser::vector::dot;

/// The directional derivative keeps at least this part of the step's curvature.
const DESCENT: f64 = 0.5;

/// Penalties of the rows; where the objective is left out each is 1.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Merit {
    pub penalties: Vec<f64>,
    /// Whether violations alone count.
    pub restoring: bool,
}

impl Merit {
    pub fn new(rows: usize) -> Self {
        Self {
            penalties: vec![0.0; rows],
            restoring: false,
        }
    }

    fn penalty(&self, row: usize) -> f64 {
        if self.restoring {
            1.0
        } else {
            self.penalties[row]
        }
    }

    /// Merit of an objective with row values.
    pub fn of(&self, objective: f64, rows: &[f64]) -> f64 {
        let objective = if self.restoring { 0.0 } else { objective };
        let violations = rows.iter().enumerate().filter(|(_, g)| **g > 0.0);
        objective
            + violations
                .map(|(row, g)| self.penalty(row) * g)
                .sum::<f64>()
    }

    /// Takes the penalties that a step's multipliers call for (Powell 1978: at least the multiplier, else the mean of it and
    /// the penalty before), and returns the merit's derivative along the step; not negative where the step leads nowhere.
    pub fn price(
        &mut self,
        solution: &Solution,
        gradient: &[f64],
        rows: &[Vec<f64>],
        values: &[f64],
        curvature: f64,
    ) -> f64 {
        // By how much each violation falls, as far as the slopes tell.
        let falls: Vec<f64> = rows
            .iter()
            .zip(values)
            .map(|(a, c)| c.max(0.0) - (c + dot(a, &solution.step)).max(0.0))
            .collect();
        let objective = if self.restoring {
            0.0
        } else {
            dot(gradient, &solution.step)
        };
        if !self.restoring && !solution.relaxed {
            for (penalty, multiplier) in self.penalties.iter_mut().zip(&solution.multipliers) {
                *penalty = multiplier.max(f64::midpoint(*penalty, *multiplier));
            }
        }
        let fall = |merit: &Self| -> f64 {
            falls
                .iter()
                .enumerate()
                .map(|(row, fall)| merit.penalty(row) * fall)
                .sum()
        };
        let wanted = objective + DESCENT * curvature;
        let paid = fall(self);
        let gained: f64 = falls.iter().filter(|fall| **fall > 0.0).sum();
        if !self.restoring && paid < wanted && gained > 0.0 {
            let more = 2.0 * (wanted - paid) / gained;
            for (penalty, fall) in self.penalties.iter_mut().zip(&falls) {
                if *fall > 0.0 {
                    *penalty += more;
                }
            }
        }
        objective - fall(self)
    }
}
