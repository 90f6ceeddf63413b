//! What an answer leads to, phase by phase.

use super::{
    Gcmma, Phase, Trial,
    model::{Function, Model},
    subproblem::Subproblem,
};
use crate::optimiser::{
    contract::Told,
    linearisation::Next,
    options::GradientSource,
    point::Point,
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
    /// Goes where an answer about the iterate leads.
    pub(super) fn follow(&mut self, next: Next) {
        match next {
            Next::Ask(pending) => self.phase = Phase::Linearise(pending),
            Next::Linearised => self.open_trial(),
            Next::Over(reason) => self.phase = Phase::Done(reason),
        }
    }

    fn model(&self) -> Option<Model> {
        let (iterate, gradient) = (self.here.iterate.as_ref()?, self.here.gradient.as_ref()?);
        Some(Model::new(
            &self.here.problem,
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
        let (lower, upper) = self.asymptotes.bounds(&self.here.problem, &self.here.x);
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
            .point(&self.here.problem, &self.here.x, &solution.step);
        if largest(&solution.step) < SHORTEST || x == self.here.x {
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
        let violation = self.here.iterate.as_ref().map_or(0.0, |at| at.violation);
        self.phase = Phase::Done(if violation > self.options.descent.violation_tolerance {
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
        let Some(iterate) = &self.here.iterate else {
            return f64::INFINITY;
        };
        if iterate.violation > self.options.descent.violation_tolerance {
            return f64::INFINITY;
        }
        let scale = model.functions[0].scale;
        let mut slope = vec![0.0; self.here.x.len()];
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
                self.here.problem.lower[j]
            } else {
                self.here.problem.upper[j]
            };
            let room = (bound - self.here.x[j]).abs();
            if room > AT_BOUND * self.asymptotes.unit(j) {
                slope[j].abs()
            } else {
                0.0
            }
        };
        (0..self.here.x.len()).map(projected).fold(slack, f64::max)
    }

    /// The rho to begin with. The objective begins anew: what its last step was like says little about the next. Rows go
    /// most of the way to the value that they had at the last iterate.
    fn first_rho(&self, model: &Model) -> Vec<f64> {
        let slopes = model.mean_slopes();
        if !self.options.globalise {
            let rho = |function: &Function| if function.linear { 0.0 } else { MMA_RHO };
            return model.functions.iter().map(rho).collect();
        }
        let known = self.here.previous.as_ref().and_then(|previous| {
            let (without, factor) = model.at(&self.asymptotes.step(&self.here.x, &previous.x))?;
            let values = model.scaled(&self.here.problem, previous);
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
        let Some(model) = self.model() else { return };
        let common = &self.options.descent;
        let Some((point, gradient)) = self.here.told_point(trial.x.clone(), common, told) else {
            self.trial_failed(trial);
            return;
        };
        let step = self.asymptotes.step(&self.here.x, &point.x);
        let found = model.scaled(&self.here.problem, &point);
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
                row.linear && found * row.scale > self.options.descent.violation_tolerance
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
        let tolerance = self.options.descent.violation_tolerance;
        if excess.iter().all(|excess| *excess <= ROUNDING) {
            return true;
        }
        let Some(iterate) = &self.here.iterate else {
            return true;
        };
        if iterate.violation > tolerance
            && (point.violation <= tolerance
                || point.violation < (1.0 - ENOUGH) * iterate.violation)
        {
            return true;
        }
        let band = tolerance.max(FIRST_BAND * BAND_SHRINKS.powi(self.here.iteration as i32));
        point.violation <= band && (excess[0] <= ROUNDING || found < ENOUGH * expected.min(0.0))
    }

    fn trial_failed(&mut self, trial: Trial) {
        let failed = trial.failed + 1;
        if failed >= MOST_FAILED {
            self.phase = Phase::Done(StopReason::Blocked { directions: failed });
            return;
        }
        let step = self.asymptotes.step(&self.here.x, &trial.x);
        self.asymptotes.failed(&step);
        if let Some(model) = self.model() {
            self.try_with(&model, trial.rho, trial.rejected, failed);
        }
    }

    /// Moves to the accepted point, tests the stop rules, and opens the next iteration.
    fn close_iteration(&mut self, accepted: Option<(Point, Option<Gradient>)>) {
        let Some(from) = self.here.iterate.clone() else {
            return;
        };
        self.here.iteration += 1;
        if let Some((point, gradient)) = accepted {
            self.asymptotes.moved(&from.x, &point.x);
            self.here.move_to(point, gradient, &self.options.descent);
        } else {
            self.asymptotes.stuck();
        }
        let Some(to) = &self.here.iterate else { return };
        if let Some(reason) = self.reason_to_stop(&from, &to.clone()) {
            self.phase = Phase::Done(reason);
        } else {
            let next = self.here.open(&self.options.descent);
            self.follow(next);
        }
    }

    fn reason_to_stop(&mut self, from: &Point, to: &Point) -> Option<StopReason> {
        let options = &self.options;
        if to.objective < UNBOUNDED {
            return Some(StopReason::Unbounded {
                objective: to.objective,
            });
        }
        if to.violation > options.descent.violation_tolerance {
            self.infeasible += 1;
            if self.infeasible >= options.descent.infeasible_iterations {
                return Some(StopReason::NoFeasibleDesign {
                    iterations: self.infeasible,
                    violation: to.violation,
                });
            }
        } else {
            self.infeasible = 0;
        }
        let common = &options.descent;
        let cost = self.here.cost(common);
        let ahead = match common.gradient {
            GradientSource::Differences => 1 + self.here.x.len(),
            GradientSource::Model => 2,
        };
        self.here
            .convergence
            .close(
                &common.rules(),
                from,
                to,
                self.here.iteration,
                [cost, ahead],
            )
            .or(
                (self.here.iteration >= self.options.descent.max_iterations).then_some(
                    StopReason::IterationLimit {
                        iterations: self.here.iteration,
                    },
                ),
            )
    }
}
