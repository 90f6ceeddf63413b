//! What a run remembers from one iteration to the next, and the stop rules that read it.

use serde::{Deserialize, Serialize};

use super::{
    direction::{Conjugacy, Direction},
    metric::Moves,
};
use crate::optimiser::{
    convergence::Convergence, options::MmfdOptions, point::Point, problem::Problem,
    stop::StopReason,
};

const FIRST_PHI: f64 = 5.0;
const LARGEST_PHI: f64 = 1000.0;
/// Iterations for which a variable stopped by failed evaluations is held, and how many such stops end a run.
const BLOCKED_FOR: usize = 5;
const MOST_JAMS: usize = 3;
/// A first step aims at this relative change of the objective at most: an objective that starts near nothing (a void
/// that is still a point) grows by orders of magnitude before percentages mean anything.
const MOST_OBJECTIVE_CHANGE: f64 = 10.0;
/// However small the objective, a first step is this share of what the moves allow.
const LEAST_SHARE: f64 = 0.2;

/// An iteration that has ended.
pub(super) struct Closing<'a> {
    pub from: &'a Point,
    pub to: &'a Point,
    /// Whether the search found something better.
    pub moved: bool,
    /// Iterations completed.
    pub iteration: usize,
    pub cost: usize,
}

/// Memories of the method.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Memory {
    /// s: the method works in x / s.
    pub scale: Vec<f64>,
    /// The largest scale that each variable has had.
    largest_scale: Vec<f64>,
    /// Iteration at which the scales are due again.
    scale_due: usize,
    /// CT, from which rows are active.
    pub ct: f64,
    pub phi: f64,
    pub conjugacy: Conjugacy,
    pub moves: Moves,
    /// Relative change of the objective that a first step aims at (DOBJ).
    objective_change: f64,
    /// Largest relative move that a first step allows (DX).
    relative_move: f64,
    /// Consecutive iterations outside the feasible region.
    pub infeasible: usize,
    /// Variables that failed evaluations have stopped, each with the iteration at which it is free again.
    blocked: Vec<(usize, usize)>,
    /// Consecutive iterations that failed evaluations have stopped.
    jams: usize,
}

impl Memory {
    pub fn new(options: &MmfdOptions, n: usize) -> Self {
        Self {
            scale: vec![1.0; n],
            largest_scale: vec![0.0; n],
            scale_due: 0,
            ct: options.active_from,
            phi: FIRST_PHI,
            conjugacy: Conjugacy::default(),
            moves: Moves::default(),
            objective_change: options.first_objective_change,
            relative_move: options.first_move,
            infeasible: 0,
            blocked: Vec::new(),
            jams: 0,
        }
    }

    /// Forgets what rests on values that are no longer comparable: no stop test spans a change of the model.
    pub fn forget_values(&mut self) {
        self.conjugacy = Conjugacy::default();
        self.infeasible = 0;
    }

    /// Takes the scales |x| again where they are due, and restarts conjugacy. No scale exceeds the distance of the bounds:
    /// the coordinates of a corner say more about the origin than about how far it can go. A variable on its way through
    /// zero keeps a tenth of the largest scale that it had, else its small scale would hold it there.
    pub fn rescale(
        &mut self,
        options: &MmfdOptions,
        problem: &Problem,
        x: &[f64],
        iteration: usize,
    ) {
        let every = options.scale_every.unwrap_or(x.len());
        if every > 0 && iteration >= self.scale_due {
            for (i, (scale, largest)) in self
                .scale
                .iter_mut()
                .zip(&mut self.largest_scale)
                .enumerate()
            {
                let range = problem.upper[i] - problem.lower[i];
                let range = if range > 0.0 { range } else { f64::INFINITY };
                let x = x[i];
                *scale = x.abs().max(0.1 * *largest).min(range);
                if *scale <= 1e-10 {
                    *scale = 1.0;
                }
                *largest = largest.max(*scale);
            }
            self.scale_due = iteration + every;
            self.conjugacy = Conjugacy::default();
        }
    }

    /// The first step of a search.
    pub fn first_step(
        &self,
        direction: &Direction,
        at: &Point,
        g: &[f64],
        feasible: bool,
        options: &MmfdOptions,
    ) -> f64 {
        let mut alpha = self.objective_change * at.objective.abs()
            / direction.slope.abs().max(f64::MIN_POSITIVE);
        let mut longest = f64::INFINITY;
        for ((x, step), scale) in at.x.iter().zip(&direction.step).zip(&self.scale) {
            if x.abs() >= 0.1 * scale && *step != 0.0 {
                longest = longest.min(self.relative_move * x.abs().min(*scale) / step.abs());
            }
        }
        if longest.is_infinite() {
            longest = self.relative_move;
        }
        if alpha <= 1e-6 {
            alpha = longest;
        }
        alpha = match direction.natural {
            Some(natural) => natural.min(10.0 * longest),
            None => alpha.max(LEAST_SHARE * longest).min(longest).max(1e-6),
        };
        let tolerance = options.descent.violation_tolerance;
        if feasible {
            // Not beyond the first boundary ahead, unless that is next to nothing.
            for (row, &slope) in direction.row_slopes.iter().enumerate() {
                let tangent = direction.tangent.iter().any(|&(tangent, _)| tangent == row);
                if slope > 0.0 && !tangent {
                    let at = (0.5 * tolerance - g[row]) / slope;
                    if at > 0.1 * alpha {
                        alpha = alpha.min(at);
                    }
                }
            }
            if !direction.tangent.is_empty()
                && let Some(bound) = direction.to_bound.filter(|bound| *bound > 0.1 * alpha)
            {
                // Beyond a bound the ray bends, and is no longer tangent.
                alpha = alpha.min(bound);
            }
            alpha
        } else {
            let to_boundary = g
                .iter()
                .zip(&direction.row_slopes)
                .filter(|&(&g, &slope)| g > tolerance && slope < 0.0)
                .map(|(g, slope)| -g / slope)
                .fold(0.0, f64::max);
            if to_boundary > 0.0 {
                to_boundary.min(10.0 * alpha)
            } else {
                alpha
            }
        }
    }

    /// Learns from a search that failed evaluations have stopped: the edge of what the model can do is no constraint
    /// with a gradient, so the variable that moved most is held for a while and the others go on.
    pub fn block(&mut self, direction: &Direction, iteration: usize) -> Option<StopReason> {
        let moves = direction
            .step
            .iter()
            .zip(&self.scale)
            .map(|(dx, scale)| (dx / scale).abs());
        let most = moves
            .enumerate()
            .max_by(|a, b| a.1.total_cmp(&b.1).then(b.0.cmp(&a.0)));
        if let Some((variable, _)) = most {
            self.blocked.push((variable, iteration + BLOCKED_FOR));
        }
        self.relative_move = (0.1 * self.relative_move).max(1e-3);
        self.conjugacy = Conjugacy::default();
        self.jams += 1;
        (self.jams > MOST_JAMS.min(self.scale.len() - 1)).then_some(StopReason::Blocked {
            directions: self.jams,
        })
    }

    /// Variables that are held at an iteration.
    pub fn frozen(&self, iteration: usize) -> Vec<usize> {
        self.blocked
            .iter()
            .filter(|(_, until)| iteration < *until)
            .map(|(variable, _)| *variable)
            .collect()
    }

    /// Learns from an iteration, and says whether it was the last.
    pub fn close(
        &mut self,
        options: &MmfdOptions,
        convergence: &mut Convergence,
        closing: &Closing<'_>,
    ) -> Option<StopReason> {
        let &Closing {
            from,
            to,
            moved,
            iteration,
            cost,
        } = closing;
        self.jams = 0;
        let tolerance = options.descent.violation_tolerance;
        let change = (to.objective - from.objective).abs();
        let both_feasible = from.violation <= tolerance && to.violation <= tolerance;
        if moved {
            let largest =
                to.x.iter()
                    .zip(&from.x)
                    .zip(&self.scale)
                    .map(|((to, from), scale)| {
                        (to - from).abs() / from.abs().min(*scale).max(0.1 * scale)
                    })
                    .fold(0.0, f64::max);
            self.relative_move = f64::midpoint(self.relative_move, largest)
                .max(largest)
                .clamp(1e-3, 1.0);
            if both_feasible {
                let seen = change / from.objective.abs().max(f64::MIN_POSITIVE);
                self.objective_change =
                    f64::midpoint(self.objective_change, seen).clamp(1e-3, MOST_OBJECTIVE_CHANGE);
            }
        } else {
            self.relative_move = (0.1 * self.relative_move).max(1e-3);
            self.conjugacy = Conjugacy::default();
        }
        if to.violation > tolerance {
            self.infeasible += 1;
            self.phi = (10.0 * self.phi).min(LARGEST_PHI);
            if self.infeasible >= options.descent.infeasible_iterations {
                return Some(StopReason::NoFeasibleDesign {
                    iterations: self.infeasible,
                    violation: to.violation,
                });
            }
        } else {
            self.infeasible = 0;
            self.phi = FIRST_PHI;
        }
        let rules = options.descent.rules();
        if let Some(reason) = convergence.close(&rules, from, to, iteration, [cost, 0]) {
            return Some(reason);
        }
        if convergence.is_slow() {
            self.shrink(options);
        }
        if iteration >= options.descent.max_iterations {
            return Some(StopReason::IterationLimit {
                iterations: iteration,
            });
        }
        None
    }

    /// Narrows the band of active rows: slow progress may be due to rows that are not yet at their boundary.
    fn shrink(&mut self, options: &MmfdOptions) {
        let tolerance = options.descent.violation_tolerance;
        let factor = (tolerance / options.active_from.abs())
            .powf(1.0 / options.descent.consecutive as f64)
            .min(1.0);
        self.ct = -(self.ct.abs() * factor).max(tolerance);
    }
}
