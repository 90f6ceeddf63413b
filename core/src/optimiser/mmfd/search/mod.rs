//! The one-dimensional search, as a record that is asked "what next?" after every evaluation.
//!
//! From a feasible iterate trials are judged by F + sum lambda_j g_j over the rows that the direction is tangent to: to
//! first order the objective after a return to the boundary, so that a return is paid for once, at the end. From an
//! infeasible one they are judged by their violation.

mod alike;
mod feasible;
mod infeasible;

use serde::{Deserialize, Serialize};

use super::{
    boundary,
    direction::Direction,
    metric::{Metric, Moves},
};
use crate::optimiser::{
    point::Point,
    problem::Problem,
    rows::{self, Gradient},
};

/// Trials that may shorten the step while nothing better than the iterate is known.
const MOST_REDUCTIONS: usize = 8;
/// Returns to the boundary from one trial.
const MOST_RETURNS: usize = 2;

/// What a search is made from; the same at every call.
pub(super) struct Setting<'a> {
    pub problem: &'a Problem,
    pub origin: &'a Point,
    pub gradient: &'a Gradient,
    /// What the direction's metric was made of.
    pub moves: Option<&'a Moves>,
    pub scale: &'a [f64],
    pub ctmin: f64,
    /// Change of the objective that counts as none.
    pub small_change: f64,
}

/// An evaluated point of a search.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Sample {
    /// Step along the direction.
    pub alpha: f64,
    pub point: Point,
    /// What trials are compared by.
    pub merit: f64,
    /// Gradients, where they came with the values.
    pub gradient: Option<Gradient>,
}

/// What is being evaluated.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(super) enum Pending {
    Trial {
        alpha: f64,
    },
    Return {
        alpha: f64,
        x: Vec<f64>,
        count: usize,
    },
}

impl Pending {
    /// Step along the direction, before any return.
    pub fn alpha(&self) -> f64 {
        match self {
            Self::Trial { alpha } | Self::Return { alpha, .. } => *alpha,
        }
    }
}

/// A search between two evaluations.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Search {
    pub direction: Direction,
    pub pending: Pending,
    feasible: bool,
    /// Trials as evaluated on the ray.
    trials: Vec<Sample>,
    /// Points after a return.
    returned: Vec<Sample>,
    /// Steps at which nothing could be evaluated, or from which no return led to a better point.
    bad: Vec<f64>,
    extensions: usize,
    reductions: usize,
    refinements: usize,
    /// Points that could not be evaluated.
    pub failures: usize,
}

/// What follows an evaluation.
pub(super) enum Next {
    Evaluate,
    Accept(Box<Sample>),
    /// Nothing better than the iterate was found.
    Fail,
}

impl Search {
    pub fn new(direction: Direction, alpha: f64, feasible: bool) -> Self {
        Self {
            direction,
            pending: Pending::Trial { alpha },
            feasible,
            trials: Vec::new(),
            returned: Vec::new(),
            bad: Vec::new(),
            extensions: 0,
            reductions: 0,
            refinements: 0,
            failures: 0,
        }
    }

    /// The point that is being evaluated.
    pub fn x(&self, setting: &Setting<'_>) -> Vec<f64> {
        match &self.pending {
            Pending::Trial { alpha } => self.on_ray(setting, *alpha),
            Pending::Return { x, .. } => x.clone(),
        }
    }

    fn on_ray(&self, setting: &Setting<'_>, alpha: f64) -> Vec<f64> {
        let mut x: Vec<f64> = setting
            .origin
            .x
            .iter()
            .zip(&self.direction.step)
            .map(|(x, step)| x + alpha * step)
            .collect();
        setting.problem.clip(&mut x);
        x
    }

    /// Takes the values at the pending point, `None` where it failed.
    pub fn tell(&mut self, setting: &Setting<'_>, told: Option<(Point, Option<Gradient>)>) -> Next {
        let pending = self.pending.clone();
        self.failures += usize::from(told.is_none());
        match (pending, told) {
            (Pending::Trial { alpha }, None) => self.bad.push(alpha),
            (Pending::Trial { alpha }, Some((point, gradient))) => {
                let merit = self.estimate(setting, &point);
                self.trials.push(Sample {
                    alpha,
                    point,
                    merit,
                    gradient,
                });
            }
            (Pending::Return { alpha, .. }, None) => return self.judge_returns(setting, alpha),
            (Pending::Return { alpha, count, .. }, Some((point, gradient))) => {
                let merit = self.actual(setting, &point);
                let sample = Sample {
                    alpha,
                    point,
                    merit,
                    gradient,
                };
                self.returned.push(sample.clone());
                if sample.point.violation > setting.ctmin
                    && count < MOST_RETURNS
                    && let Some(x) = self.back(setting, &sample)
                {
                    self.pending = Pending::Return {
                        alpha,
                        x,
                        count: count + 1,
                    };
                    return Next::Evaluate;
                }
                return self.judge_returns(setting, alpha);
            }
        }
        if self.feasible {
            self.next_feasible(setting)
        } else {
            self.next_infeasible(setting)
        }
    }

    /// Merit of a trial if it were brought back to the boundary.
    fn estimate(&self, setting: &Setting<'_>, point: &Point) -> f64 {
        if !self.feasible {
            return point.violation;
        }
        let g = rows::values(setting.problem, &point.constraints);
        point.objective
            + self
                .direction
                .tangent
                .iter()
                .map(|&(row, multiplier)| multiplier * g[row])
                .sum::<f64>()
    }

    /// Merit of a point as it is: violations within the tolerance are priced, slack is not.
    fn actual(&self, setting: &Setting<'_>, point: &Point) -> f64 {
        if !self.feasible {
            return point.violation;
        }
        let g = rows::values(setting.problem, &point.constraints);
        let tangent = self.direction.tangent.iter();
        point.objective
            + tangent
                .map(|&(row, multiplier)| multiplier * g[row].max(0.0))
                .sum::<f64>()
    }

    fn try_at(&mut self, alpha: f64) -> Next {
        self.pending = Pending::Trial { alpha };
        Next::Evaluate
    }

    /// Returns the best trial to the boundary if that pays, or accepts it.
    fn finalise(&mut self, setting: &Setting<'_>, best: &Sample) -> Next {
        let already = self
            .returned
            .iter()
            .any(|sample| sample.alpha == best.alpha);
        let actual = self.actual(setting, &best.point);
        let gained = self.estimate(setting, setting.origin) - best.merit;
        let worth = actual - best.merit > (0.5 * setting.small_change).max(0.1 * gained);
        if !already
            && (best.point.violation > setting.ctmin || worth)
            && let Some(x) = self.back(setting, best)
        {
            self.pending = Pending::Return {
                alpha: best.alpha,
                x,
                count: 1,
            };
            return Next::Evaluate;
        }
        self.settle_or_shorten(setting, best.alpha)
    }

    fn back(&self, setting: &Setting<'_>, sample: &Sample) -> Option<Vec<f64>> {
        let g = rows::values(setting.problem, &sample.point.constraints);
        boundary::back(&boundary::From {
            problem: setting.problem,
            x: &sample.point.x,
            g: &g,
            gradient: sample.gradient.as_ref().unwrap_or(setting.gradient),
            metric: &Metric::of(setting.moves, setting.scale),
            tangent: &self.direction.tangent,
            held: &self.direction.held,
            ctmin: setting.ctmin,
        })
    }

    fn judge_returns(&mut self, setting: &Setting<'_>, alpha: f64) -> Next {
        if self.feasible {
            self.settle_or_shorten(setting, alpha)
        } else {
            self.next_infeasible(setting)
        }
    }

    /// Accepts the best point if it is better than the iterate, else shortens the step.
    fn settle_or_shorten(&mut self, setting: &Setting<'_>, alpha: f64) -> Next {
        if let Some(best) = self.best(setting) {
            return Next::Accept(Box::new(best));
        }
        if self.reductions >= MOST_REDUCTIONS {
            return Next::Fail;
        }
        self.reductions += 1;
        self.bad.push(alpha);
        self.trials.retain(|sample| sample.alpha < alpha);
        self.try_at(0.4 * alpha)
    }

    /// The best point met that improves on the iterate.
    fn best(&self, setting: &Setting<'_>) -> Option<Sample> {
        let start = self.actual(setting, setting.origin);
        let mut best: Option<Sample> = None;
        for sample in self.trials.iter().chain(&self.returned) {
            let merit = self.actual(setting, &sample.point);
            let allowed = !self.feasible || sample.point.violation <= setting.ctmin;
            if allowed && merit < best.as_ref().map_or(start, |best| best.merit) {
                best = Some(Sample {
                    merit,
                    ..sample.clone()
                });
            }
        }
        best
    }
}
