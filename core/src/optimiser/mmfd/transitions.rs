//! What an answer leads to, phase by phase.

use super::{
    Conjugacy, Curvature, Departure, Linearising, Mmfd, Phase,
    direction::{self, At, Found, find},
    memory::Closing,
    metric::Metric,
    search::{self, Sample, Search},
};
use crate::optimiser::{
    contract::Told,
    linearisation::Next,
    rows,
    stop::{StopReason, UNBOUNDED},
};

impl Mmfd {
    pub(super) fn told_linearisation(&mut self, pending: Linearising, told: &[Told]) {
        let nearer = matches!(pending, Linearising::ModelGradient { backoff } if backoff > 0);
        let next = self.here.tell(pending, &self.options.descent, told);
        if nearer && matches!(next, Next::Linearised) {
            self.memory.conjugacy = Conjugacy::default();
        }
        self.follow(next);
    }

    /// Goes where an answer about the iterate leads.
    fn follow(&mut self, next: Next) {
        match next {
            Next::Ask(pending) => self.phase = Phase::Linearise(pending),
            Next::Linearised => self.open_search(),
            Next::Over(reason) => self.phase = Phase::Done(reason),
        }
    }

    fn open_search(&mut self) {
        let (Some(iterate), Some(gradient)) = (&self.here.iterate, &self.here.gradient) else {
            return;
        };
        if self.options.curvature != Curvature::Never
            && let (Some(previous), Some(departure)) = (&self.here.previous, &self.departure)
        {
            let here = gradient.lagrangian(&self.here.problem, &departure.tangent);
            let difference = |to: &[f64], from: &[f64]| {
                to.iter().zip(from).map(|(to, from)| to - from).collect()
            };
            self.memory.moves.learn(
                difference(&iterate.x, &previous.x),
                difference(&here, &departure.lagrangian),
            );
        }
        self.memory.rescale(
            &self.options,
            &self.here.problem,
            &iterate.x,
            self.here.iteration,
        );
        let g = rows::values(&self.here.problem, &iterate.constraints);
        let feasible = iterate.violation <= self.options.descent.violation_tolerance;
        let metric = Metric::of(self.moves(iterate), &self.memory.scale);
        let frozen = self.memory.frozen(self.here.iteration);
        loop {
            let at = At {
                problem: &self.here.problem,
                x: &iterate.x,
                g: &g,
                gradient,
                scale: &self.memory.scale,
                metric: &metric,
                frozen: &frozen,
                ct: self.memory.ct,
                ctmin: self.options.descent.violation_tolerance,
                phi: self.memory.phi,
                push_off: self.options.push_off,
                stationary: 0.1 * self.here.convergence.absolute_tolerance,
            };
            match find(&at, &mut self.memory.conjugacy) {
                Found::Direction(direction) => {
                    if feasible {
                        self.multipliers =
                            direction::told_multipliers(&self.here.problem, &direction.tangent);
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
                        -(0.3 * self.memory.ct.abs()).max(self.options.descent.violation_tolerance);
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
        let Some(x) = self.setting().map(|setting| search.x(&setting)) else {
            return;
        };
        let outcome = self.here.told_point(x, &self.options.descent, told);
        let Some(setting) = self.setting() else {
            return;
        };
        match search.tell(&setting, outcome) {
            search::Next::Evaluate => self.phase = Phase::Search(Box::new(search)),
            search::Next::Accept(sample) => self.close_iteration(&search, Some(*sample)),
            search::Next::Fail => self.close_iteration(&search, None),
        }
    }

    /// Moves to the accepted point, tests the stop rules, and opens the next iteration.
    fn close_iteration(&mut self, search: &Search, accepted: Option<Sample>) {
        let Some(from) = self.here.iterate.clone() else {
            return;
        };
        self.here.iteration += 1;
        let moved = accepted.is_some();
        if let Some(sample) = accepted {
            let tangent = search.direction.tangent.clone();
            self.departure = self.here.gradient.take().map(|gradient| Departure {
                lagrangian: gradient.lagrangian(&self.here.problem, &tangent),
                tangent,
            });
            self.here
                .move_to(sample.point, sample.gradient, &self.options.descent);
        }
        let Some(to) = &self.here.iterate else { return };
        let reason = if moved || search.failures == 0 {
            let closing = Closing {
                from: &from,
                to,
                moved,
                iteration: self.here.iteration,
                cost: self.here.cost(&self.options.descent),
            };
            self.memory
                .close(&self.options, &mut self.here.convergence, &closing)
        } else {
            self.memory.block(&search.direction, self.here.iteration)
        };
        let unbounded = to.objective < UNBOUNDED;
        if unbounded {
            self.phase = Phase::Done(StopReason::Unbounded {
                objective: to.objective,
            });
        } else if let Some(reason) = reason {
            self.phase = Phase::Done(reason);
        } else {
            let next = self.here.open(&self.options.descent);
            self.follow(next);
        }
    }
}
