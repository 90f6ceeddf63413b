//! What an answer leads to, phase by phase.

use super::{
    BACKOFFS, Gcmma, GradientSource, Phase, Trial,
    model::{Function, Model},
    subproblem::Subproblem,
};
use crate::optimiser::{
    contract::{Told, Values},
    convergence::Rules,
    differences::Differences,
    point::{Point, keep_best},
    problem::NUDGES,
    rows::Gradient,
    stop::{StopReason, UNBOUNDED},
    vector::largest,
};

/// Trials that may be rejected at an iterate, and that may fail one after the other.
const MOST_REJECTED: usize = 12;
const MOST_FAILED: usize = 12;
/// rho of the method without globalisation.
const MMA_RHO: f64 = 1e-5;
/// First rho of an iteration as a share of the mean slope: of the objective; of a row in the first iteration; of a row at
/// least.
const OBJECTIVE_RHO: f64 = 0.03;
const FIRST_RHO: f64 = 0.1;
const LEAST_RHO: f64 = 1e-3;
/// A row's first rho is this share of what would meet its value at the last iterate.
const PART_WAY: f64 = 0.7;
/// Bounds of all first rho, the steepest slope being 1.
const TINY_RHO: f64 = 1e-6;
const MOST_FIRST_RHO: f64 = 10.0;
/// rho after a rejection: beyond what would have been right, and at most so many times as large.
const BEYOND: f64 = 1.1;
const MOST_GROWTH: f64 = 10.0;
/// A trial need not be conservative where it brings this share of what was expected.
const ENOUGH: f64 = 0.1;
/// A trial may violate constraints by this much at first, and by so much less at each iteration: returning to the boundary
/// exactly at every step costs more evaluations than it brings.
const FIRST_BAND: f64 = 0.05;
const BAND_SHRINKS: f64 = 0.8;
/// Rounding in scaled values.
const ROUNDING: f64 = 1e-9;
/// A variable this close to a bound, in units of the asymptotes' distance, is at it.
const AT_BOUND: f64 = 1e-6;
/// A step shorter than this, in units of the asymptotes' distance, is none.
const SHORTEST: f64 = 1e-9;

impl Gcmma {
    fn note(&mut self, x: Vec<f64>, values: &Values) -> (Point, Option<Gradient>) {
        let point = Point::new(&self.problem, x, values);
        keep_best(&mut self.best, &point, self.options.violation_tolerance);
        self.note_progress();
        let gradient = Gradient::of(&self.problem, values);
        if gradient.is_some() {
            self.gradients += 1;
        }
        (point, gradient)
    }

    fn note_progress(&mut self) {
        self.convergence.note(
            self.cost(),
            self.iteration,
            self.best.as_ref(),
            self.options.violation_tolerance,
        );
    }

    /// What the run has cost: analyses, and the model's gradients.
    fn cost(&self) -> usize {
        match self.options.gradient {
            GradientSource::Model => self.analyses + self.gradients,
            GradientSource::Differences => self.analyses,
        }
    }

    pub(super) fn told_start(&mut self, attempt: usize, replan: bool, told: &[Told]) {
        self.analyses += 1;
        let x = self.problem.nudged(&self.x, attempt);
        let Some(values) = self.problem.usable(told.first()) else {
            self.phase = if attempt + 1 < NUDGES.len() {
                Phase::Start {
                    attempt: attempt + 1,
                    replan,
                }
            } else {
                Phase::Done(StopReason::FailedStart {
                    attempts: attempt + 1,
                })
            };
            return;
        };
        let (point, gradient) = self.note(x, values);
        if !replan {
            self.convergence.absolute_tolerance = self
                .options
                .absolute_tolerance
                .unwrap_or_else(|| (1e-8 * point.objective.abs()).max(1e-20));
        }
        if attempt > 0 {
            self.previous = None;
        }
        if let (Some(old), Some(previous)) = (&self.iterate, &mut self.previous) {
            let constraints = previous.constraints.iter_mut();
            for (value, (new, old)) in
                constraints.zip(point.constraints.iter().zip(&old.constraints))
            {
                *value += new - old;
            }
        }
        self.x.clone_from(&point.x);
        self.iterate = Some(point);
        self.gradient = gradient;
        self.open_iteration();
    }

    pub(super) fn told_gradient(&mut self, backoff: usize, told: &[Told]) {
        if backoff > 0 {
            self.analyses += 1;
        }
        if let Some(values) = self.problem.usable(told.first())
            && Gradient::of(&self.problem, values).is_some()
        {
            if backoff > 0 {
                let (point, gradient) = self.note(self.backed_off(backoff), values);
                self.x.clone_from(&point.x);
                self.iterate = Some(point);
                self.gradient = gradient;
            } else {
                self.gradients += 1;
                self.gradient = Gradient::of(&self.problem, values);
            }
            self.open_trial();
        } else if self.previous.is_some() && backoff < BACKOFFS {
            self.phase = Phase::ModelGradient {
                backoff: backoff + 1,
            };
        } else {
            self.ask_differences();
        }
    }

    fn ask_differences(&mut self) {
        let options = &self.options;
        let differences = Differences::new(
            &self.problem,
            &self.x,
            options.difference_step,
            options.least_difference_step,
        );
        self.phase = if differences.len() == 0 {
            Phase::Done(StopReason::KuhnTucker { residual: 0.0 })
        } else {
            Phase::Differences(differences)
        };
    }

    pub(super) fn told_differences(&mut self, mut differences: Differences, told: &[Told]) {
        let points = differences.points(&self.x);
        for (k, x) in points.into_iter().enumerate() {
            self.analyses += 1;
            if let Some(values) = self.problem.usable(told.get(k)) {
                let point = Point::new(&self.problem, x, values);
                keep_best(&mut self.best, &point, self.options.violation_tolerance);
                self.note_progress();
            }
        }
        let Some(at) = &self.iterate else { return };
        if !differences.tell(&self.problem, at, told) {
            self.phase = Phase::Differences(differences);
        } else if let Some(gradient) = differences.gradient(self.problem.constraints()) {
            self.gradient = Some(gradient);
            self.gradients += 1;
            self.open_trial();
        } else {
            self.phase = Phase::Done(StopReason::NoGradient {
                attempts: differences.attempts(),
            });
        }
    }

    /// Opens an iteration at the iterate: its gradient, unless known, then a trial.
    fn open_iteration(&mut self) {
        self.boundary = true;
        if self.gradient.is_some() {
            self.open_trial();
        } else if self.options.gradient == GradientSource::Model {
            self.phase = Phase::ModelGradient { backoff: 0 };
        } else {
            self.ask_differences();
        }
    }

    fn model(&self) -> Option<Model> {
        let (iterate, gradient) = (self.iterate.as_ref()?, self.gradient.as_ref()?);
        Some(Model::new(
            &self.problem,
            &self.asymptotes,
            iterate,
            gradient,
        ))
    }

    /// The first trial of an iteration, unless first-order conditions hold.
    fn open_trial(&mut self) {
        let Some(model) = self.model() else { return };
        let residual = self.stationarity(&model);
        if residual <= self.options.stationarity_tolerance {
            self.phase = Phase::Done(StopReason::KuhnTucker { residual });
            return;
        }
        let rho = self.first_rho(&model);
        self.try_with(&model, rho, 0, 0);
    }

    /// Asks for the minimum of the approximations.
    fn try_with(&mut self, model: &Model, rho: Vec<f64>, rejected: usize, failed: usize) {
        let (lower, upper) = self.asymptotes.bounds(&self.problem, &self.x);
        let solution = Subproblem {
            model,
            rho: &rho,
            lower: &lower,
            upper: &upper,
        }
        .solve();
        let objective = model.functions[0].scale;
        self.multipliers = solution
            .multipliers
            .iter()
            .zip(&model.functions[1..])
            .map(|(multiplier, row)| multiplier * objective / row.scale)
            .collect();
        let x = self
            .asymptotes
            .point(&self.problem, &self.x, &solution.step);
        if largest(&solution.step) < SHORTEST || x == self.x {
            self.end_without_step(model, rejected, failed);
            return;
        }
        self.phase = Phase::Trial(Box::new(Trial {
            x,
            rho,
            rejected,
            failed,
        }));
    }

    /// No approximation leads anywhere.
    fn end_without_step(&mut self, model: &Model, rejected: usize, failed: usize) {
        if rejected > 0 {
            self.close_iteration(None);
            return;
        }
        let violation = self.iterate.as_ref().map_or(0.0, |at| at.violation);
        self.phase = Phase::Done(if violation > self.options.violation_tolerance {
            StopReason::NoFeasibleDesign {
                iterations: self.infeasible,
                violation,
            }
        } else if failed > 0 {
            StopReason::Blocked { directions: failed }
        } else {
            StopReason::KuhnTucker {
                residual: self.stationarity(model),
            }
        });
    }

    /// Largest entry of the projected gradient of the Lagrangian, and of what is left of complementarity, in units
    /// of the asymptotes' distances and of the objective's steepest slope; infinite outside the feasible region.
    fn stationarity(&self, model: &Model) -> f64 {
        let Some(iterate) = &self.iterate else {
            return f64::INFINITY;
        };
        if iterate.violation > self.options.violation_tolerance {
            return f64::INFINITY;
        }
        let scale = model.functions[0].scale;
        let mut slope = vec![0.0; self.x.len()];
        let mut slack: f64 = 0.0;
        for (i, function) in model.functions.iter().enumerate() {
            let weight = if i == 0 {
                1.0
            } else {
                self.multipliers[i - 1] * function.scale / scale
            };
            if i > 0 {
                slack = slack.max(weight * function.value.abs());
            }
            for &(j, g) in &function.slopes {
                slope[j] += weight * g;
            }
        }
        let projected = |j: usize| {
            let bound = if slope[j] > 0.0 {
                self.problem.lower[j]
            } else {
                self.problem.upper[j]
            };
            let room = (bound - self.x[j]).abs();
            if room > AT_BOUND * self.asymptotes.unit(j) {
                slope[j].abs()
            } else {
                0.0
            }
        };
        (0..self.x.len()).map(projected).fold(slack, f64::max)
    }

    /// The rho to begin with. The objective begins anew: what its last step was like says little about the next. Rows go
    /// most of the way to the value that they had at the last iterate.
    fn first_rho(&self, model: &Model) -> Vec<f64> {
        let slopes = model.mean_slopes();
        if !self.options.globalise {
            let rho = |function: &Function| if function.linear { 0.0 } else { MMA_RHO };
            return model.functions.iter().map(rho).collect();
        }
        let known = self.previous.as_ref().and_then(|previous| {
            let (without, factor) = model.at(&self.asymptotes.step(&self.x, &previous.x))?;
            let values = model.scaled(&self.problem, previous);
            (factor > 0.0).then(|| -> Vec<f64> {
                values
                    .iter()
                    .zip(without)
                    .map(|(value, without)| (value - without) / factor)
                    .collect()
            })
        });
        let first = |(i, slope): (usize, &f64)| {
            if model.functions[i].linear {
                return 0.0;
            }
            let rho = match &known {
                _ if i == 0 => OBJECTIVE_RHO * slope,
                Some(known) => (PART_WAY * known[i]).max(LEAST_RHO * slope),
                None => FIRST_RHO * slope,
            };
            rho.clamp(TINY_RHO, MOST_FIRST_RHO)
        };
        slopes.iter().enumerate().map(first).collect()
    }

    pub(super) fn told_trial(&mut self, trial: Trial, told: &[Told]) {
        self.analyses += 1;
        let Some(model) = self.model() else { return };
        let Some(values) = self.problem.usable(told.first()) else {
            self.trial_failed(trial);
            return;
        };
        let (point, gradient) = self.note(trial.x.clone(), values);
        let step = self.asymptotes.step(&self.x, &point.x);
        let found = model.scaled(&self.problem, &point);
        let Some((without, factor)) = model.at(&step) else {
            return;
        };
        let excess: Vec<f64> = found
            .iter()
            .zip(without.iter().zip(&trial.rho))
            .map(|(found, (without, rho))| found - without - rho * factor)
            .collect();
        let expected = without[0] + trial.rho[0] * factor;
        if !self.options.globalise || self.accepts(&excess, expected, found[0], &point) {
            self.close_iteration(Some((point, gradient)));
        } else if trial.rejected >= MOST_REJECTED {
            self.close_iteration(None);
        } else {
            // Nothing but a shorter step brings a tangent nearer to its equality.
            let strayed = |(row, found): (&Function, &f64)| {
                row.linear && found * row.scale > self.options.violation_tolerance
            };
            if model.functions.iter().zip(&found).any(strayed) {
                self.asymptotes.failed(&step);
            }
            let slopes = model.mean_slopes();
            let rho = trial
                .rho
                .iter()
                .zip(excess.iter().zip(&slopes).zip(&model.functions))
                .map(|(&rho, ((&excess, slope), function))| {
                    if excess > 0.0 && !function.linear {
                        let right = BEYOND * (rho + excess / factor);
                        right.min(MOST_GROWTH * rho.max(FIRST_RHO * slope))
                    } else {
                        rho
                    }
                })
                .collect();
            self.try_with(&model, rho, trial.rejected + 1, 0);
        }
    }

    /// Whether a trial becomes the iterate: conservative approximations, or a good point whatever they said.
    fn accepts(&self, excess: &[f64], expected: f64, found: f64, point: &Point) -> bool {
        let tolerance = self.options.violation_tolerance;
        if excess.iter().all(|excess| *excess <= ROUNDING) {
            return true;
        }
        let Some(iterate) = &self.iterate else {
            return true;
        };
        if iterate.violation > tolerance
            && (point.violation <= tolerance
                || point.violation < (1.0 - ENOUGH) * iterate.violation)
        {
            return true;
        }
        let band = tolerance.max(FIRST_BAND * BAND_SHRINKS.powi(self.iteration as i32));
        point.violation <= band && (excess[0] <= ROUNDING || found < ENOUGH * expected.min(0.0))
    }

    fn trial_failed(&mut self, trial: Trial) {
        let failed = trial.failed + 1;
        if failed >= MOST_FAILED {
            self.phase = Phase::Done(StopReason::Blocked { directions: failed });
            return;
        }
        let step = self.asymptotes.step(&self.x, &trial.x);
        self.asymptotes.failed(&step);
        if let Some(model) = self.model() {
            self.try_with(&model, trial.rho, trial.rejected, failed);
        }
    }

    /// Moves to the accepted point, tests the stop rules, and opens the next iteration.
    fn close_iteration(&mut self, accepted: Option<(Point, Option<Gradient>)>) {
        let Some(from) = self.iterate.clone() else {
            return;
        };
        self.iteration += 1;
        if let Some((point, gradient)) = accepted {
            self.asymptotes.moved(&from.x, &point.x);
            self.x.clone_from(&point.x);
            self.iterate = Some(point);
            self.gradient = gradient;
            self.previous = Some(from.clone());
        } else {
            self.asymptotes.stuck();
        }
        let Some(to) = &self.iterate else { return };
        if let Some(reason) = self.reason_to_stop(&from, &to.clone()) {
            self.phase = Phase::Done(reason);
        } else {
            self.open_iteration();
        }
    }

    fn reason_to_stop(&mut self, from: &Point, to: &Point) -> Option<StopReason> {
        let options = &self.options;
        if to.objective < UNBOUNDED {
            return Some(StopReason::Unbounded {
                objective: to.objective,
            });
        }
        if to.violation > options.violation_tolerance {
            self.infeasible += 1;
            if self.infeasible >= options.infeasible_iterations {
                return Some(StopReason::NoFeasibleDesign {
                    iterations: self.infeasible,
                    violation: to.violation,
                });
            }
        } else {
            self.infeasible = 0;
        }
        let rules = Rules {
            relative_tolerance: options.relative_tolerance,
            consecutive: options.consecutive,
            stall_factor: options.stall_factor,
            violation_tolerance: options.violation_tolerance,
        };
        let cost = self.cost();
        let ahead = match options.gradient {
            GradientSource::Differences => 1 + self.x.len(),
            GradientSource::Model => 2,
        };
        self.convergence
            .close(&rules, from, to, self.iteration, [cost, ahead])
            .or((self.iteration >= self.options.max_iterations).then_some(
                StopReason::IterationLimit {
                    iterations: self.iteration,
                },
            ))
    }
}
