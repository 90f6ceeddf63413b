//! What an answer leads to, phase by phase.

use super::{
    Phase, Place, Sqp, Trial,
    hessian::Hessian,
    quadratic::{Quadratic, Solution},
};
use crate::optimiser::{
    contract::Told,
    linearisation::Next,
    point::Point,
    rows::{self, Gradient},
    stop::StopReason,
    vector::{dot, largest},
};

/// Farthest that any variable goes in one iteration, in its range.
pub(super) const FARTHEST: f64 = 1.0;
/// Step, in the variables' ranges, that the first matrix would allow the steepest of them.
const NEARLY_LINEAR: f64 = 100.0;
/// A step may lead no farther out of the feasible region than this, or than it began.
const BAND: f64 = 0.5;
/// Part of the merit's slope that a step must bring.
const ENOUGH: f64 = 1e-4;
/// A refused step is shortened to between these parts of it.
const SHORTER: [f64; 2] = [0.1, 0.5];
/// Part of the smallest change that counts for which it is not worth to shorten a step.
const LEAST_GAIN: f64 = 0.1;
/// Trials that may be refused at an iterate, and that may fail one after the other.
const MOST_REFUSED: usize = 8;
const MOST_FAILED: usize = 6;
/// After a failure a variable may go half as far as it went, but at least this part of what the farthest one went.
const LEAST_SHARE: f64 = 0.05;
/// Growth of a reach after an accepted trial.
pub(super) const RECOVERY: f64 = 2.0;
/// Iterations for which a variable stopped by failed evaluations is held, and how many such stops end a run.
const HELD_FOR: usize = 5;
const MOST_JAMS: usize = 10;
/// A variable this close to a bound, in its range, is at it.
const AT_BOUND: f64 = 1e-9;
/// A step shorter than this, in the variables' ranges, is none.
const SHORTEST: f64 = 1e-10;

/// The problem at the iterate, in steps of the free variables.
struct Local {
    gradient: Vec<f64>,
    rows: Vec<Vec<f64>>,
    values: Vec<f64>,
    lower: Vec<f64>,
    upper: Vec<f64>,
}

impl Sqp {
    /// Goes where an answer about the iterate leads.
    pub(super) fn follow(&mut self, next: Next) {
        match next {
            Next::Ask(pending) => self.phase = Phase::Linearise(pending),
            Next::Linearised => {
                self.learn();
                self.open_step();
            }
            Next::Over(reason) => self.phase = Phase::Done(reason),
        }
    }

    /// Learns curvature from the move to the iterate.
    fn learn(&mut self) {
        let (Some(departure), Some(gradient), Some(hessian)) = (
            self.departure.take(),
            &self.here.gradient,
            &mut self.hessian,
        ) else {
            return;
        };
        let here = gradient.lagrangian(&self.here.problem, &departure.multipliers);
        let change: Vec<f64> = here
            .iter()
            .zip(&departure.lagrangian)
            .map(|(to, from)| to - from)
            .collect();
        let moved = self.frame.step(&departure.x, &self.here.x);
        let change = self.frame.pull(&change);
        if !self.learnt {
            let product = dot(&moved, &change);
            if product > 1e-8 * dot(&moved, &moved) {
                *hessian = Hessian::multiple(moved.len(), dot(&change, &change) / product);
            }
            self.learnt = true;
        }
        hessian.learn(&moved, &change);
    }

    fn local(&self) -> Option<Local> {
        let (iterate, gradient) = (self.here.iterate.as_ref()?, self.here.gradient.as_ref()?);
        let problem = &self.here.problem;
        let held = |k: usize| {
            self.held
                .iter()
                .any(|(held, until)| *held == k && self.here.iteration < *until)
        };
        let side = |k: usize, bound: &[f64], sign: f64| {
            let i = self.frame.free[k];
            let room = sign * (bound[i] - iterate.x[i]) / self.frame.range[k];
            if held(k) {
                0.0
            } else {
                sign * room.max(0.0).min(self.reach[k])
            }
        };
        let objective = self.frame.pull(&gradient.objective);
        Some(Local {
            gradient: if self.merit.restoring {
                vec![0.0; objective.len()]
            } else {
                objective
            },
            rows: (0..rows::count(problem))
                .map(|row| self.frame.pull(&rows::gradient(problem, gradient, row)))
                .collect(),
            values: rows::values(problem, &iterate.constraints),
            lower: (0..self.frame.len())
                .map(|k| side(k, &problem.lower, -1.0))
                .collect(),
            upper: (0..self.frame.len())
                .map(|k| side(k, &problem.upper, 1.0))
                .collect(),
        })
    }

    /// B, made anew where there is none: hardly any at the start, so that the first step goes to a corner of what the rows
    /// and the first move leave; later such that a step without rows would be the first move.
    fn matrix(&mut self, local: &Local) -> Hessian {
        let steepest = largest(&local.gradient);
        let size = if steepest > 0.0 {
            let farthest = if self.here.iteration == 0 {
                NEARLY_LINEAR
            } else {
                self.options.first_move
            };
            steepest / farthest
        } else {
            1.0
        };
        self.hessian
            .get_or_insert_with(|| Hessian::multiple(local.gradient.len(), size))
            .clone()
    }

    fn solve(hessian: &Hessian, local: &Local, values: &[f64]) -> Solution {
        Quadratic {
            factor: &hessian.factor(),
            gradient: &local.gradient,
            rows: &local.rows,
            values,
            lower: &local.lower,
            upper: &local.upper,
        }
        .solve()
    }

    /// The step from the iterate, unless first-order conditions hold.
    fn open_step(&mut self) {
        self.step_within(0);
    }

    fn step_within(&mut self, failed: usize) {
        let (Some(local), Some(iterate)) = (self.local(), self.here.iterate.clone()) else {
            return;
        };
        let hessian = self.matrix(&local);
        let solution = Self::solve(&hessian, &local, &local.values);
        let feasible = iterate.violation <= self.options.descent.violation_tolerance;
        if !self.merit.restoring && !solution.relaxed {
            self.multipliers.clone_from(&solution.multipliers);
        }
        if feasible && failed == 0 {
            let residual = self.stationarity(&local, &iterate, &solution);
            self.residual = residual;
            if residual <= self.options.stationarity_tolerance {
                self.conclude(&local, residual);
                return;
            }
        }
        let curvature = dot(&solution.step, &hessian.times(&solution.step));
        let slope = self.merit.price(
            &solution,
            &local.gradient,
            &local.rows,
            &local.values,
            curvature,
        );
        let x = self
            .frame
            .point(&self.here.problem, &iterate.x, 1.0, &solution.step);
        if slope >= 0.0 || largest(&solution.step) < SHORTEST || x == iterate.x {
            self.end_without_step(&local, &iterate, &solution, failed);
            return;
        }
        let multipliers = if solution.relaxed {
            let penalties = solution.multipliers.iter().zip(&self.merit.penalties);
            penalties.map(|(m, penalty)| m.min(*penalty)).collect()
        } else {
            solution.multipliers
        };
        self.phase = Phase::Trial(Box::new(Trial {
            place: Place::OnStep,
            x,
            step: solution.step,
            part: 1.0,
            slope,
            multipliers,
            next_part: 0.5,
            refused: 0,
            failed,
        }));
    }

    /// Ends the run at first-order conditions, after a look beside a start without a slope.
    fn conclude(&mut self, local: &Local, residual: f64) {
        if self.here.iteration == 0 && largest(&local.gradient) == 0.0 {
            let x = self.beside(&self.here.x);
            if x != self.here.x {
                self.phase = Phase::Trial(Box::new(Trial {
                    place: Place::Nudged,
                    x,
                    step: Vec::new(),
                    part: 1.0,
                    slope: 0.0,
                    multipliers: vec![0.0; local.rows.len()],
                    next_part: 0.5,
                    refused: 0,
                    failed: 0,
                }));
                return;
            }
        }
        self.phase = Phase::Done(StopReason::KuhnTucker { residual });
    }

    /// A point about a hundredth of the ranges away, by another amount in each variable: where the objective has no slope for
    /// reasons of symmetry, it is found off the symmetry.
    fn beside(&self, x: &[f64]) -> Vec<f64> {
        let problem = &self.here.problem;
        let away = |k: usize| {
            let i = self.frame.free[k];
            let amount = 0.01 * (0.5 + (0.618_033_988_75 * (k + 1) as f64).fract());
            if problem.upper[i] - x[i] >= x[i] - problem.lower[i] {
                amount
            } else {
                -amount
            }
        };
        let step: Vec<f64> = (0..self.frame.len()).map(away).collect();
        self.frame.point(problem, x, 1.0, &step)
    }

    /// The subproblem leads nowhere.
    fn end_without_step(
        &mut self,
        local: &Local,
        iterate: &Point,
        solution: &Solution,
        failed: usize,
    ) {
        let violation = iterate.violation;
        if violation > self.options.descent.violation_tolerance {
            if self.merit.restoring {
                self.phase = Phase::Done(StopReason::NoFeasibleDesign {
                    iterations: self.infeasible,
                    violation,
                });
            } else {
                self.restore();
                self.open_step();
            }
        } else if failed > 0 {
            self.phase = Phase::Done(StopReason::Blocked { directions: failed });
        } else {
            let residual = self.stationarity(local, iterate, solution);
            if self.doubtful(residual) {
                self.renew();
                self.held.clear();
                self.reach.fill(self.options.first_move);
                self.step_within(0);
                return;
            }
            self.phase = Phase::Done(StopReason::KuhnTucker { residual });
        }
    }

    /// From here on violations alone count, until the iterate is feasible.
    pub(super) fn restore(&mut self) {
        self.merit.restoring = true;
        self.hessian = None;
        self.learnt = false;
    }

    /// Largest entry of the projected gradient of the Lagrangian, and of what is left of complementarity, over the
    /// objective's size or steepest slope.
    fn stationarity(&self, local: &Local, iterate: &Point, solution: &Solution) -> f64 {
        let mut slope = local.gradient.clone();
        let mut slack: f64 = 0.0;
        for ((a, c), multiplier) in local
            .rows
            .iter()
            .zip(&local.values)
            .zip(&solution.multipliers)
        {
            if *multiplier > 0.0 {
                slack = slack.max(multiplier * c.abs());
                for (slope, a) in slope.iter_mut().zip(a) {
                    *slope += multiplier * a;
                }
            }
        }
        let problem = &self.here.problem;
        let projected = |k: usize| {
            let i = self.frame.free[k];
            let bound = if slope[k] > 0.0 {
                problem.lower[i]
            } else {
                problem.upper[i]
            };
            if (bound - iterate.x[i]).abs() > AT_BOUND * self.frame.range[k] {
                slope[k].abs()
            } else {
                0.0
            }
        };
        let size = largest(&local.gradient)
            .max(iterate.objective.abs())
            .max(f64::MIN_POSITIVE);
        (0..slope.len()).map(projected).fold(slack, f64::max) / size
    }

    pub(super) fn told_trial(&mut self, trial: Trial, told: &[Told]) {
        let common = &self.options.descent;
        let Some(iterate) = self.here.iterate.clone() else {
            return;
        };
        let answer = self.here.told_point(trial.x.clone(), common, told);
        if trial.place == Place::Nudged {
            self.told_nudge(&iterate, answer);
            return;
        }
        let Some((point, gradient)) = answer else {
            self.trial_failed(trial);
            return;
        };
        let problem = &self.here.problem;
        let merit = |point: &Point| {
            let rows = rows::values(problem, &point.constraints);
            self.merit.of(point.objective, &rows)
        };
        let (before, found) = (merit(&iterate), merit(&point));
        let band = self.merit.restoring || point.violation <= iterate.violation.max(BAND);
        if band && found <= before + ENOUGH * trial.part * trial.slope {
            self.close_iteration(Some((point, gradient)), &trial);
            return;
        }
        if trial.place == Place::Corrected {
            self.shorten(trial);
            return;
        }
        // The minimum of the parabola through both merits with the slope at the iterate.
        let bend = found - before - trial.part * trial.slope;
        let best = if bend > 0.0 {
            -0.5 * trial.slope * trial.part / bend
        } else {
            SHORTER[1]
        };
        let next_part = trial.part * best.clamp(SHORTER[0], SHORTER[1]);
        let trial = Trial { next_part, ..trial };
        if let Some(x) = self.corrected(&trial, &point) {
            self.phase = Phase::Trial(Box::new(Trial {
                place: Place::Corrected,
                x,
                ..trial
            }));
        } else {
            self.shorten(trial);
        }
    }

    /// The full step again, with the rows' values at its end instead of their tangents'.
    fn corrected(&self, trial: &Trial, end: &Point) -> Option<Vec<f64>> {
        if trial.part < 1.0 || trial.refused > 0 {
            return None;
        }
        let (local, hessian) = (self.local()?, self.hessian.as_ref()?);
        let values: Vec<f64> = rows::values(&self.here.problem, &end.constraints)
            .iter()
            .zip(&local.rows)
            .map(|(value, a)| value - dot(a, &trial.step))
            .collect();
        let strayed = values
            .iter()
            .zip(&local.values)
            .any(|(corrected, tangent)| {
                (corrected - tangent).abs() > self.options.descent.violation_tolerance
            });
        let solution = strayed.then(|| Self::solve(hessian, &local, &values))?;
        let x = self
            .frame
            .point(&self.here.problem, &self.here.x, 1.0, &solution.step);
        (!solution.relaxed && x != end.x && x != self.here.x).then_some(x)
    }

    fn shorten(&mut self, trial: Trial) {
        let part = trial.next_part;
        let x = self
            .frame
            .point(&self.here.problem, &self.here.x, part, &trial.step);
        // What a shorter step could still bring.
        let objective = self
            .here
            .iterate
            .as_ref()
            .map_or(0.0, |at| at.objective.abs());
        let worth = LEAST_GAIN * self.options.descent.relative_tolerance * objective;
        if trial.refused >= MOST_REFUSED || x == self.here.x || -part * trial.slope < worth {
            self.close_iteration(None, &trial);
            return;
        }
        self.phase = Phase::Trial(Box::new(Trial {
            place: Place::OnStep,
            x,
            part,
            refused: trial.refused + 1,
            failed: 0,
            ..trial
        }));
    }

    fn told_nudge(&mut self, iterate: &Point, answer: Option<(Point, Option<Gradient>)>) {
        let least = self.here.convergence.absolute_tolerance;
        match answer {
            Some((point, gradient))
                if point.violation <= self.options.descent.violation_tolerance
                    && point.objective < iterate.objective - least =>
            {
                self.here.move_to(point, gradient, &self.options.descent);
                self.here.iteration += 1;
                let next = self.here.open(&self.options.descent);
                self.follow(next);
            }
            _ => self.phase = Phase::Done(StopReason::KuhnTucker { residual: 0.0 }),
        }
    }

    /// A step is found anew within what the failure has taught.
    fn trial_failed(&mut self, trial: Trial) {
        let failed = trial.failed + 1;
        if trial.place == Place::Corrected {
            self.shorten(trial);
            return;
        }
        let moves: Vec<f64> = trial
            .step
            .iter()
            .map(|step| (trial.part * step).abs())
            .collect();
        if failed >= MOST_FAILED {
            self.block(&moves);
            return;
        }
        let farthest = largest(&moves);
        for (reach, step) in self.reach.iter_mut().zip(&moves) {
            *reach = (0.5 * step).max(LEAST_SHARE * farthest).min(0.5 * *reach);
        }
        self.step_within(failed);
    }

    /// Learns from a search that failed evaluations have stopped: the edge of what the model can do is no constraint
    /// with a gradient, so the variable that moved most is held for a while and the others go on.
    fn block(&mut self, moves: &[f64]) {
        let most = moves
            .iter()
            .enumerate()
            .max_by(|a, b| a.1.total_cmp(b.1).then(b.0.cmp(&a.0)));
        if let Some((variable, _)) = most {
            self.held
                .push((variable, self.here.iteration + 1 + HELD_FOR));
        }
        self.jams += 1;
        self.here.iteration += 1;
        if self.jams > MOST_JAMS.min(self.frame.len() - 1)
            || self.here.iteration >= self.options.descent.max_iterations
        {
            self.phase = Phase::Done(StopReason::Blocked {
                directions: self.jams,
            });
            return;
        }
        for reach in &mut self.reach {
            *reach = (RECOVERY.powi(MOST_FAILED as i32) * *reach).min(FARTHEST);
        }
        self.here.boundary = true;
        self.open_step();
    }
}
