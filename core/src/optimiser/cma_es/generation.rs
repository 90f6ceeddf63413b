//! From a generation's answers to the next generation, or to the end.

use super::{
    CmaEs, Offspring, Phase,
    distribution::Distribution,
    ranking::{Ranking, Standing},
    stall::Stall,
    strategy::Strategy,
};
use crate::optimiser::{
    contract::Told,
    method::Refuses,
    point::{Point, keep_best},
    stop::{StopReason, UNBOUNDED},
};

/// Condition number of the covariance beyond which its axes are rounding (tutorial, appendix B.3).
const CONDITION: f64 = 1e14;
/// Generations without a single value, each with half the last one's step, after which a run is over.
const FRUITLESS: usize = 10;
/// Generations that may be refused as a whole, one after the other, before one is asked for as it is.
const REFUSED: usize = 200;
/// Halvings of the way from a valid design to a refused one.
const HALVINGS: usize = 8;

impl CmaEs {
    /// Draws the next generation.
    pub(super) fn draw(&mut self) {
        self.screened = false;
        self.mean_refused = None;
        self.pending = (0..self.population)
            .map(|_| Offspring {
                z: self.normal(),
                refused: None,
                repaired: None,
            })
            .collect();
    }

    fn normal(&mut self) -> Vec<f64> {
        let n = self.coordinates.dimension();
        (0..n).map(|_| self.stream.next_normal()).collect()
    }

    fn strategy(&self) -> Strategy {
        Strategy::new(self.coordinates.dimension(), self.population)
    }

    /// Books a point outside any generation.
    pub(super) fn told_point(&mut self, x: Vec<f64>, told: Option<&Told>) {
        self.analyses += 1;
        if let Some(values) = self.problem.usable(told) {
            let point = Point::new(&self.problem, x, values);
            keep_best(&mut self.best, &point, self.options.violation_tolerance);
        }
    }

    pub(super) fn told_generation(&mut self, told: &[Told]) {
        let tolerance = self.options.violation_tolerance;
        let mut told = told.iter();
        let mut iterate = None;
        let mut answers = Vec::with_capacity(self.pending.len());
        for offspring in &self.pending {
            let asked = offspring.is_asked();
            self.analyses += usize::from(asked);
            let values = self.problem.usable(asked.then(|| told.next()).flatten());
            if let Some(values) = values {
                let point = Point::new(&self.problem, self.x(offspring), values);
                keep_best(&mut iterate, &point, tolerance);
            }
            answers.push(match (values, offspring.refused) {
                (Some(values), refused) => Standing::Evaluated(values, refused.unwrap_or(0.0)),
                (None, Some(violation)) if !asked => Standing::Refused(violation),
                (None, _) => Standing::Failed,
            });
        }
        self.phase = Phase::Generation;
        self.learn(&answers);
        self.fruitless = if iterate.is_some() {
            0
        } else {
            self.fruitless + 1
        };
        if let Some(point) = iterate {
            let feasible = (point.violation <= tolerance).then_some(point.objective);
            self.bests.push(feasible);
            let surplus = self.bests.len().saturating_sub(self.window());
            self.bests.drain(..surplus);
            keep_best(&mut self.best, &point, tolerance);
            let spent = self.spent();
            self.stall.note(&point, &spent, tolerance);
            self.iterate = Some(point);
        }
        self.iteration += 1;
        self.boundary = self.iterate.is_some();
        self.close();
    }

    /// Moves the distribution by what is known of the pending points.
    fn learn(&mut self, points: &[Standing<'_>]) {
        let tolerance = self.options.violation_tolerance;
        let strategy = self.strategy();
        let failed = |standing: &&Standing<'_>| matches!(standing, Standing::Failed);
        let usable = points.len() - points.iter().filter(failed).count();
        if usable == 0 {
            self.distribution.shrink();
            return;
        }
        let order = self.ranking.order(&self.problem, tolerance, points);
        let z: Vec<&[f64]> = order.iter().map(|k| &self.pending[*k].z[..]).collect();
        self.distribution.update(&strategy, &z, usable);
        let weights = strategy.weights(usable);
        let parents = order.iter().map(|k| &points[*k]);
        let parents = parents.zip(&weights[..strategy.mu]);
        let n = self.coordinates.dimension();
        let refused = self.mean_refused;
        self.ranking
            .follow(&self.problem, tolerance, parents, refused, n);
    }

    /// Ends the run, begins it again with twice the population, or draws the next generation.
    fn close(&mut self) {
        if let Some(best) = &self.best
            && best.violation <= self.options.violation_tolerance
        {
            let tolerance = (1e-8 * best.objective.abs()).max(1e-20);
            self.absolute_tolerance.get_or_insert(tolerance);
        }
        let mut reason = self.hopeless();
        if reason.is_none()
            && let Some(converged) = self.converged()
        {
            if self.doubled < self.options.doublings {
                self.begin_again();
            } else {
                reason = Some(converged);
            }
        }
        let limit = self
            .options
            .max_evaluations
            .unwrap_or(1000 * self.coordinates.dimension());
        if reason.is_none() && self.analyses + self.population > limit {
            reason = Some(StopReason::EvaluationLimit { evaluations: limit });
        }
        match reason {
            Some(reason) => self.phase = Phase::Done(reason),
            None => self.draw(),
        }
    }

    /// What ends a run whatever it could try next.
    fn hopeless(&self) -> Option<StopReason> {
        if let Some(best) = &self.best
            && best.objective < UNBOUNDED
        {
            let objective = best.objective;
            return Some(StopReason::Unbounded { objective });
        }
        (self.fruitless >= FRUITLESS).then(|| match self.best {
            Some(_) => StopReason::Blocked {
                directions: self.fruitless * self.population,
            },
            None => StopReason::FailedStart {
                attempts: self.analyses,
            },
        })
    }

    /// Generations over which best values must agree (tutorial, appendix B.3).
    fn window(&self) -> usize {
        10 + (30 * self.coordinates.dimension()).div_ceil(self.population)
    }

    /// What ends a run that has found what this population can find.
    fn converged(&self) -> Option<StopReason> {
        let best = self.best.as_ref()?;
        let full = self.bests.len() >= self.window();
        let recent: Option<Vec<f64>> = self.bests.iter().copied().collect();
        if let Some(recent) = recent.filter(|_| full) {
            let least = recent.iter().copied().fold(f64::INFINITY, f64::min);
            let most = recent.iter().copied().fold(f64::NEG_INFINITY, f64::max);
            let change = most - least;
            if let Some(tolerance) = self.absolute_tolerance.filter(|t| change <= *t) {
                return Some(StopReason::Absolute { change, tolerance });
            }
            let change = change / least.abs().max(f64::MIN_POSITIVE);
            let tolerance = self.options.relative_tolerance;
            if change <= tolerance {
                return Some(StopReason::Relative { change, tolerance });
            }
        }
        let (step, tolerance) = (self.distribution.step(), self.options.step_tolerance);
        if step <= tolerance {
            return Some(if best.violation > self.options.violation_tolerance {
                StopReason::NoFeasibleDesign {
                    iterations: self.iteration,
                    violation: best.violation,
                }
            } else {
                StopReason::SmallSteps { step, tolerance }
            });
        }
        let condition = self.distribution.condition();
        if condition > CONDITION {
            let limit = CONDITION;
            return Some(StopReason::Condition { condition, limit });
        }
        let options = &self.options;
        let tolerance = options.violation_tolerance;
        self.stall
            .reason(options.stall_factor, &self.spent(), tolerance)
    }

    /// From a random mean with twice the population.
    fn begin_again(&mut self) {
        self.doubled += 1;
        self.population *= 2;
        let n = self.coordinates.dimension();
        let mean = (0..n).map(|_| self.stream.next_unit()).collect();
        self.distribution = Distribution::new(mean, self.options.first_step);
        self.ranking = Ranking::new();
        self.bests.clear();
        self.stall = Stall::after(self.analyses);
    }

    /// Repairs what is refused, and moves on without analyses where a whole generation is.
    pub(super) fn screen_generation(&mut self, refuses: &mut Refuses<'_>) {
        for _ in 0..REFUSED {
            self.screened = true;
            for k in 0..self.pending.len() {
                // A design without any mesh is infinitely refused, which JSON cannot hold.
                let refused = refuses(&self.x(&self.pending[k]));
                self.pending[k].refused = refused.map(|violation| violation.min(f64::MAX));
            }
            let mean_refused = refuses(&self.design(&self.distribution.mean)).is_some();
            self.mean_refused = Some(mean_refused);
            let valid = self.pending.iter().find(|o| o.refused.is_none());
            let anchor = match valid {
                _ if !mean_refused => self.distribution.mean.clone(),
                Some(valid) => self.distribution.point(&valid.z),
                None => {
                    let violations = self.pending.iter().map(|o| o.refused.unwrap_or(0.0));
                    let points: Vec<_> = violations.map(Standing::Refused).collect();
                    self.learn(&points);
                    self.iteration += 1;
                    self.draw();
                    continue;
                }
            };
            for k in 0..self.pending.len() {
                if self.pending[k].refused.is_some() {
                    let repaired = self.repaired(&self.pending[k], &anchor, refuses);
                    self.pending[k].repaired = Some(repaired);
                }
            }
            return;
        }
        self.screened = true;
        // A start far from any valid geometry: the evaluation shall say what is wrong with it.
    }

    /// The last valid design found by halving the way from a valid anchor to a refused point.
    fn repaired(&self, refused: &Offspring, anchor: &[f64], refuses: &mut Refuses<'_>) -> Vec<f64> {
        let target = self.distribution.point(&refused.z);
        let (mut valid, mut invalid) = (0.0, 1.0);
        let along = |share: f64| -> Vec<f64> {
            let ends = anchor.iter().zip(&target);
            self.design(&ends.map(|(a, b)| a + share * (b - a)).collect::<Vec<_>>())
        };
        for _ in 0..HALVINGS {
            let middle = 0.5 * (valid + invalid);
            if refuses(&along(middle)).is_none() {
                valid = middle;
            } else {
                invalid = middle;
            }
        }
        along(valid)
    }
}
