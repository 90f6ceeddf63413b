//! The free variables and what their steps are measured in.

use serde::{Deserialize, Serialize};

use crate::optimiser::problem::Problem;

/// Bounds farther apart than this many times the start's size are no measure of the variable.
const WIDE: f64 = 100.0;

/// Variables that can move, each with its range: the distance of its bounds, or where these are too far apart to say
/// anything ten times the start (at least 10).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Frame {
    pub free: Vec<usize>,
    pub range: Vec<f64>,
}

impl Frame {
    pub fn new(problem: &Problem, x0: &[f64]) -> Self {
        let free: Vec<usize> = (0..x0.len())
            .filter(|i| problem.lower[*i] < problem.upper[*i])
            .collect();
        let range = |&i: &usize| {
            let between = problem.upper[i] - problem.lower[i];
            let size = x0[i].abs().max(1.0);
            if between > WIDE * size {
                10.0 * size
            } else {
                between
            }
        };
        let range = free.iter().map(range).collect();
        Self { free, range }
    }

    /// Number of free variables.
    pub fn len(&self) -> usize {
        self.free.len()
    }

    /// A gradient by steps.
    pub fn pull(&self, gradient: &[f64]) -> Vec<f64> {
        let entries = self.free.iter().zip(&self.range);
        entries.map(|(&i, range)| gradient[i] * range).collect()
    }

    /// The step between two designs.
    pub fn step(&self, from: &[f64], to: &[f64]) -> Vec<f64> {
        let entries = self.free.iter().zip(&self.range);
        entries
            .map(|(&i, range)| (to[i] - from[i]) / range)
            .collect()
    }

    /// The design at part of a step, inside the bounds.
    pub fn point(&self, problem: &Problem, x: &[f64], part: f64, step: &[f64]) -> Vec<f64> {
        let mut point = x.to_vec();
        for ((&i, range), d) in self.free.iter().zip(&self.range).zip(step) {
            point[i] += part * range * d;
        }
        problem.clip(&mut point);
        point
    }
}
