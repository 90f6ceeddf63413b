//! Gradients by forward differences: one batch of independent points, failures tried again with other steps.

use serde::{Deserialize, Serialize};

use super::{contract::Told, point::Point, problem::Problem, rows::Gradient};

/// Steps tried for a variable, as multiples of its step h.
const TRIES: [f64; 4] = [1.0, -1.0, 0.5, 10.0];

/// A batch of differences between two evaluations.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Differences {
    /// Variables of the pending batch and their steps.
    pending: Vec<(usize, f64)>,
    /// Which of the steps is being tried.
    attempt: usize,
    /// d objective / d x_i and d constraint / d x_i where known.
    columns: Vec<Option<(f64, Vec<f64>)>>,
    relative: f64,
    least: f64,
}

impl Differences {
    pub fn new(problem: &Problem, x: &[f64], relative: f64, least: f64) -> Self {
        let mut differences = Self {
            pending: Vec::new(),
            attempt: 0,
            columns: vec![None; x.len()],
            relative,
            least,
        };
        let variables: Vec<usize> = (0..x.len())
            .filter(|i| problem.lower[*i] < problem.upper[*i])
            .collect();
        differences.schedule(problem, x, &variables);
        differences
    }

    fn schedule(&mut self, problem: &Problem, x: &[f64], variables: &[usize]) {
        self.pending.clear();
        for &i in variables {
            let h = (self.relative * x[i].abs()).max(self.least) * TRIES[self.attempt];
            let (below, above) = (x[i] - problem.lower[i], problem.upper[i] - x[i]);
            let fits = |h: f64| if h > 0.0 { h <= above } else { -h <= below };
            let step = if fits(h) {
                h
            } else if fits(-h) {
                -h
            } else if above >= below {
                above
            } else {
                -below
            };
            if x[i] + step != x[i] {
                self.pending.push((i, step));
            }
        }
    }

    /// The points of the batch.
    pub fn points(&self, x: &[f64]) -> Vec<Vec<f64>> {
        let point = |&(i, step): &(usize, f64)| {
            let mut point = x.to_vec();
            point[i] += step;
            point
        };
        self.pending.iter().map(point).collect()
    }

    /// Takes the answers; true when no more points are wanted.
    pub fn tell(&mut self, problem: &Problem, at: &Point, told: &[Told]) -> bool {
        let mut failed = Vec::new();
        for (k, &(i, step)) in self.pending.iter().enumerate() {
            match told.get(k) {
                Some(Told::Values(values)) if problem.accepts(values) => {
                    // The step as the machine took it.
                    let step = (at.x[i] + step) - at.x[i];
                    let constraints = values.constraints.iter().zip(&at.constraints);
                    self.columns[i] = Some((
                        (values.objective - at.objective) / step,
                        constraints
                            .map(|(there, here)| (there - here) / step)
                            .collect(),
                    ));
                }
                _ => failed.push(i),
            }
        }
        self.attempt += 1;
        self.pending.clear();
        if self.attempt < TRIES.len() {
            self.schedule(problem, &at.x, &failed);
        }
        self.pending.is_empty()
    }

    /// How many points the pending batch has.
    pub fn len(&self) -> usize {
        self.pending.len()
    }

    /// How often points were tried so far.
    pub fn attempts(&self) -> usize {
        self.attempt
    }

    /// The gradient; variables whose points all failed do not move in this iteration (their entries are zero). None if
    /// nothing is known at all.
    pub fn gradient(&self, constraints: usize) -> Option<Gradient> {
        if self.columns.iter().all(Option::is_none) {
            return None;
        }
        let objective = self
            .columns
            .iter()
            .map(|column| column.as_ref().map_or(0.0, |(slope, _)| *slope))
            .collect();
        let row = |j: usize| {
            self.columns
                .iter()
                .map(|column| column.as_ref().map_or(0.0, |(_, slopes)| slopes[j]))
                .collect()
        };
        Some(Gradient {
            objective,
            constraints: (0..constraints).map(row).collect(),
        })
    }
}
