//! What an answer leads to, phase by phase.

use super::{
    BACKOFFS, Conjugacy, Curvature, GradientSource, Mmfd, Phase, Previous,
    direction::{self, At, Found, find},
    memory::Closing,
    metric::Metric,
    search::{Next, Sample, Search},
};
use crate::optimiser::{
    contract::{Told, Values},
    differences::Differences,
    point::{Point, keep_best},
    problem::NUDGES,
    rows::{self, Gradient},
    stop::{StopReason, UNBOUNDED},
};

impl Mmfd {
    fn note(&mut self, x: Vec<f64>, values: &Values) -> (Point, Option<Gradient>) {
        let point = Point::new(&self.problem, x, values);
        keep_best(&mut self.best, &point, self.options.violation_tolerance);
        self.memory.convergence.note(
            self.cost(),
            self.iteration,
            self.best.as_ref(),
            self.options.violation_tolerance,
        );
        let gradient = Gradient::of(&self.problem, values);
        if gradient.is_some() {
            self.gradients += 1;
        }
        (point, gradient)
    }

    /// What the run has cost: analyses, and the model's gradients.
    fn cost(&self) -> usize {
        match self.options.gradient {
            GradientSource::Model => self.analyses + self.gradients,
            GradientSource::Differences => self.analyses,
        }
    }

    pub(super) fn told_start(&mut self, attempt: usize, told: &[Told]) {
        self.analyses += 1;
        let x = self.problem.nudged(&self.x, attempt);
        let Some(values) = self.problem.usable(told.first()) else {
            self.phase = if attempt + 1 < NUDGES.len() {
                let replan = matches!(self.phase, Phase::Start { replan: true, .. });
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
        // Said once, at the start; large negative values of walls far apart do no harm.
        let first = matches!(self.phase, Phase::Start { replan: false, .. });
        if first && point.constraints.iter().any(|g| *g > 10.0) {
            tracing::warn!("constraints beyond 10 in absolute value: normalise them to order one");
        }
        if !matches!(self.phase, Phase::Start { replan: true, .. }) {
            self.memory.convergence.absolute_tolerance = self
                .options
                .absolute_tolerance
                .unwrap_or_else(|| (1e-4 * point.objective.abs()).max(1e-20));
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
                self.memory.conjugacy = Conjugacy::default();
            } else {
                self.gradients += 1;
                self.gradient = Gradient::of(&self.problem, values);
            }
            self.open_search();
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
        self.analyses += differences.len();
        let points = differences.points(&self.x);
        for (x, told) in points.into_iter().zip(told) {
            if let Some(values) = self.problem.usable(Some(told)) {
                let point = Point::new(&self.problem, x, values);
                keep_best(&mut self.best, &point, self.options.violation_tolerance);
            }
        }
        self.memory.convergence.note(
            self.cost(),
            self.iteration,
            self.best.as_ref(),
            self.options.violation_tolerance,
        );
        let Some(at) = &self.iterate else { return };
        if !differences.tell(&self.problem, at, told) {
            self.phase = Phase::Differences(differences);
            return;
        }
        if let Some(gradient) = differences.gradient(self.problem.constraints()) {
            self.gradient = Some(gradient);
            self.gradients += 1;
            self.open_search();
        } else {
            self.phase = Phase::Done(StopReason::NoGradient {
                attempts: differences.attempts(),
            });
        }
    }

    /// Opens an iteration at the iterate: its gradient, unless known, then its direction.
    fn open_iteration(&mut self) {
        self.boundary = true;
        if self.gradient.is_some() {
            self.open_search();
        } else if self.options.gradient == GradientSource::Model {
            self.phase = Phase::ModelGradient { backoff: 0 };
        } else {
            self.ask_differences();
        }
    }

    fn open_search(&mut self) {
        let (Some(iterate), Some(gradient)) = (&self.iterate, &self.gradient) else {
            return;
        };
        if self.options.curvature != Curvature::Never
            && let Some(previous) = &self.previous
        {
            let here = gradient.lagrangian(&self.problem, &previous.tangent);
            let difference = |to: &[f64], from: &[f64]| {
                to.iter().zip(from).map(|(to, from)| to - from).collect()
            };
            self.memory.moves.learn(
                difference(&iterate.x, &previous.x),
                difference(&here, &previous.lagrangian),
            );
        }
        self.memory
            .rescale(&self.options, &self.problem, &iterate.x, self.iteration);
        let g = rows::values(&self.problem, &iterate.constraints);
        let feasible = iterate.violation <= self.options.violation_tolerance;
        let metric = Metric::of(self.moves(iterate), &self.memory.scale);
        let frozen = self.memory.frozen(self.iteration);
        loop {
            let at = At {
                problem: &self.problem,
                x: &iterate.x,
                g: &g,
                gradient,
                scale: &self.memory.scale,
                metric: &metric,
                frozen: &frozen,
                ct: self.memory.ct,
                ctmin: self.options.violation_tolerance,
                phi: self.memory.phi,
                push_off: self.options.push_off,
                stationary: 0.1 * self.memory.convergence.absolute_tolerance,
            };
            match find(&at, &mut self.memory.conjugacy) {
                Found::Direction(direction) => {
                    if feasible {
                        self.multipliers =
                            direction::told_multipliers(&self.problem, &direction.tangent);
                    }
                    let alpha =
                        self.memory
                            .first_step(&direction, iterate, &g, feasible, &self.options);
                    self.phase = Phase::Search(Box::new(Search::new(direction, alpha, feasible)));
                    return;
                }
                Found::KuhnTucker {
                    residual,
                    multipliers,
                } => {
                    self.multipliers = multipliers;
                    self.phase = Phase::Done(if frozen.is_empty() {
                        StopReason::KuhnTucker { residual }
                    } else {
                        StopReason::Blocked {
                            directions: frozen.len(),
                        }
                    });
                    return;
                }
                Found::NotComplementary => {
                    self.memory.ct =
                        -(0.3 * self.memory.ct.abs()).max(self.options.violation_tolerance);
                }
                Found::None => {
                    self.phase = Phase::Done(StopReason::NoFeasibleDesign {
                        iterations: self.memory.infeasible,
                        violation: iterate.violation,
                    });
                    return;
                }
            }
        }
    }

    pub(super) fn told_search(&mut self, mut search: Search, told: &[Told]) {
        self.analyses += 1;
        let Some(x) = self.setting().map(|setting| search.x(&setting)) else {
            return;
        };
        let outcome = self
            .problem
            .usable(told.first())
            .map(|values| self.note(x, values));
        let Some(setting) = self.setting() else {
            return;
        };
        match search.tell(&setting, outcome) {
            Next::Evaluate => self.phase = Phase::Search(Box::new(search)),
            Next::Accept(sample) => self.close_iteration(&search, Some(*sample)),
            Next::Fail => self.close_iteration(&search, None),
        }
    }

    /// Moves to the accepted point, tests the stop rules, and opens the next iteration.
    fn close_iteration(&mut self, search: &Search, accepted: Option<Sample>) {
        let Some(from) = self.iterate.clone() else {
            return;
        };
        self.iteration += 1;
        let moved = accepted.is_some();
        if let Some(sample) = accepted {
            let tangent = search.direction.tangent.clone();
            self.previous = self.gradient.take().map(|gradient| Previous {
                x: from.x.clone(),
                lagrangian: gradient.lagrangian(&self.problem, &tangent),
                tangent,
            });
            self.x.clone_from(&sample.point.x);
            self.gradient = sample.gradient;
            self.iterate = Some(sample.point);
        }
        let Some(to) = &self.iterate else { return };
        let reason = if moved || search.failures == 0 {
            let closing = Closing {
                from: &from,
                to,
                moved,
                iteration: self.iteration,
                cost: self.cost(),
            };
            self.memory.close(&self.options, &closing)
        } else {
            self.memory.block(&search.direction, self.iteration)
        };
        let unbounded = to.objective < UNBOUNDED;
        if unbounded {
            self.phase = Phase::Done(StopReason::Unbounded {
                objective: to.objective,
            });
        } else if let Some(reason) = reason {
            self.phase = Phase::Done(reason);
        } else {
            self.open_iteration();
        }
    }
}
