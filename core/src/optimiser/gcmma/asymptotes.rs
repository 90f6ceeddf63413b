//! How far a variable may go: asymptotes, and reaches that failed evaluations have taught.
//!
//! Distances and reaches are in fractions of a variable's range: the distance of its bounds, or where these are too far apart
//! to say anything, ten times the start (at least 10). Steps are in units of the asymptotes' distance, so that the
//! asymptotes are at -1 and 1.

use serde::{Deserialize, Serialize};

use crate::optimiser::{problem::Problem, vector::largest};

/// Distance of the asymptotes from the iterate: at the start, at least, at most.
const FIRST: f64 = 0.5;
const LEAST: f64 = 0.01;
const MOST: f64 = 10.0;
/// Factor of the distance where a variable oscillates, and where it keeps its course.
const NARROWER: f64 = 0.7;
const WIDER: f64 = 1.2;
/// Share of the distance to an asymptote that a trial may go.
const SHARE: f64 = 0.9;
/// Farthest that any variable goes in one iteration.
const FARTHEST: f64 = 0.5;
/// After a failure a variable may go half as far as it went, but at least this share of what the farthest one went.
const LEAST_SHARE: f64 = 0.05;
/// Growth of a reach after an accepted trial.
const RECOVERY: f64 = 2.0;
/// Bounds farther apart than this many times the start's size are no measure of the variable.
const WIDE: f64 = 100.0;

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Asymptotes {
    /// Range of each variable; 0 where it is fixed.
    range: Vec<f64>,
    /// Distance of both asymptotes from the iterate.
    distance: Vec<f64>,
    /// Largest move of the next trial.
    reach: Vec<f64>,
    /// The iterate before the last.
    before: Option<Vec<f64>>,
}

impl Asymptotes {
    pub fn new(problem: &Problem, x0: &[f64], first_move: f64) -> Self {
        let range = |i: usize| {
            let between = problem.upper[i] - problem.lower[i];
            let size = x0[i].abs().max(1.0);
            if between > WIDE * size {
                10.0 * size
            } else {
                between
            }
        };
        let n = x0.len();
        Self {
            range: (0..n).map(range).collect(),
            distance: vec![FIRST; n],
            reach: vec![first_move; n],
            before: None,
        }
    }

    /// Learns from the move to a new iterate.
    pub fn moved(&mut self, from: &[f64], to: &[f64]) {
        if let Some(before) = &self.before {
            for j in 0..to.len() {
                let turn = (to[j] - from[j]) * (from[j] - before[j]);
                let factor = if turn < 0.0 {
                    NARROWER
                } else if turn > 0.0 {
                    WIDER
                } else {
                    1.0
                };
                self.distance[j] = (factor * self.distance[j]).clamp(LEAST, MOST);
            }
        }
        self.before = Some(from.to_vec());
        for reach in &mut self.reach {
            *reach = (RECOVERY * *reach).min(FARTHEST);
        }
    }

    /// Learns from a trial at `step` that failed.
    pub fn failed(&mut self, step: &[f64]) {
        let moves: Vec<f64> = step
            .iter()
            .zip(&self.distance)
            .map(|(step, distance)| step * distance)
            .collect();
        let farthest = largest(&moves);
        for (reach, step) in self.reach.iter_mut().zip(&moves) {
            *reach = (0.5 * step.abs())
                .max(LEAST_SHARE * farthest)
                .min(0.5 * *reach);
        }
    }

    /// Learns from an iterate that no trial improved on.
    pub fn stuck(&mut self) {
        for reach in &mut self.reach {
            *reach *= 0.1;
        }
    }

    /// What steps of a variable are measured in; 0 where it is fixed.
    pub fn unit(&self, j: usize) -> f64 {
        self.range[j] * self.distance[j]
    }

    /// The box of the next trial, as steps from `x`.
    pub fn bounds(&self, problem: &Problem, x: &[f64]) -> (Vec<f64>, Vec<f64>) {
        let within = |j: usize| SHARE.min(self.reach[j] / self.distance[j]);
        let side = |j: usize, bound: f64, sign: f64| {
            if self.range[j] > 0.0 {
                sign * within(j).min((sign * (bound - x[j]) / self.unit(j)).max(0.0))
            } else {
                0.0
            }
        };
        let n = x.len();
        (
            (0..n).map(|j| side(j, problem.lower[j], -1.0)).collect(),
            (0..n).map(|j| side(j, problem.upper[j], 1.0)).collect(),
        )
    }

    /// The design at a step, inside the bounds.
    pub fn point(&self, problem: &Problem, x: &[f64], step: &[f64]) -> Vec<f64> {
        let mut point: Vec<f64> = (0..x.len())
            .map(|j| x[j] + self.unit(j) * step[j])
            .collect();
        problem.clip(&mut point);
        point
    }

    /// The step to a design.
    pub fn step(&self, x: &[f64], point: &[f64]) -> Vec<f64> {
        let one = |j: usize| {
            if self.range[j] > 0.0 {
                (point[j] - x[j]) / self.unit(j)
            } else {
                0.0
            }
        };
        (0..x.len()).map(one).collect()
    }
}
