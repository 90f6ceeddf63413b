//! The end of an iteration: the accepted point, the stop rules, a matrix that begins anew.

use super::{
    Departure, Phase, Sqp, Trial,
    transitions::{FARTHEST, RECOVERY},
};
use crate::optimiser::{
    options::GradientSource,
    point::Point,
    rows::Gradient,
    stop::{StopReason, UNBOUNDED},
};

/// Small changes end a run only where what is left of first-order conditions is below this; else B is renewed, at most so
/// often.
const DOUBTFUL: f64 = 0.02;
const MOST_RENEWALS: usize = 2;

impl Sqp {
    /// Moves to the accepted point, tests the stop rules, and opens the next iteration.
    pub(super) fn close_iteration(
        &mut self,
        accepted: Option<(Point, Option<Gradient>)>,
        trial: &Trial,
    ) {
        let (Some(from), Some(gradient)) = (self.here.iterate.clone(), &self.here.gradient) else {
            return;
        };
        self.here.iteration += 1;
        let moved = accepted.is_some();
        if let Some((point, next_gradient)) = accepted {
            let multipliers: Vec<(usize, f64)> = if self.merit.restoring {
                Vec::new()
            } else {
                let rows = trial.multipliers.iter().copied().enumerate();
                rows.filter(|(_, multiplier)| *multiplier > 0.0).collect()
            };
            self.departure = (!self.merit.restoring).then(|| Departure {
                x: from.x.clone(),
                lagrangian: gradient.lagrangian(&self.here.problem, &multipliers),
                multipliers,
            });
            self.here
                .move_to(point, next_gradient, &self.options.descent);
            for reach in &mut self.reach {
                *reach = (RECOVERY * *reach).min(FARTHEST);
            }
            self.stuck = 0;
            self.jams = 0;
        } else {
            self.stuck += 1;
            self.hessian = None;
            self.learnt = false;
            self.merit.penalties.fill(0.0);
        }
        let Some(to) = self.here.iterate.clone() else {
            return;
        };
        if to.violation <= self.options.descent.violation_tolerance {
            if self.merit.restoring {
                self.merit.restoring = false;
                self.hessian = None;
            }
        } else if self.stuck >= 2 {
            if self.merit.restoring {
                self.phase = Phase::Done(StopReason::NoFeasibleDesign {
                    iterations: self.infeasible,
                    violation: to.violation,
                });
                return;
            }
            self.restore();
        }
        let whole = !moved || (trial.part == 1.0 && trial.failed == 0);
        if let Some(reason) = self.reason_to_stop(&from, &to, moved, whole) {
            self.phase = Phase::Done(reason);
        } else {
            let next = self.here.open(&self.options.descent);
            self.follow(next);
        }
    }

    /// Whether the iteration was the last; small changes count only after `whole` steps.
    fn reason_to_stop(
        &mut self,
        from: &Point,
        to: &Point,
        moved: bool,
        whole: bool,
    ) -> Option<StopReason> {
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
            GradientSource::Differences => 1 + self.frame.len(),
            GradientSource::Model => 2,
        };
        let reason = self.here.convergence.close(
            &common.rules(),
            from,
            to,
            self.here.iteration,
            [cost, ahead],
        );
        let limit = (self.here.iteration >= self.options.descent.max_iterations).then_some(
            StopReason::IterationLimit {
                iterations: self.here.iteration,
            },
        );
        match reason {
            Some(StopReason::Stall { .. }) => return reason,
            Some(_) if whole && moved && self.doubtful(self.residual) => self.renew(),
            Some(_) if whole => return reason,
            _ => {}
        }
        if !whole {
            self.here.convergence.doubt();
        }
        limit
    }

    /// Whether small changes may be due to a matrix that is far too stiff.
    pub(super) fn doubtful(&self, residual: f64) -> bool {
        residual > DOUBTFUL && self.renewals < MOST_RENEWALS
    }

    /// Begins anew with the matrix.
    pub(super) fn renew(&mut self) {
        self.renewals += 1;
        self.hessian = None;
        self.learnt = false;
        self.departure = None;
        self.here.convergence.doubt();
    }
}
