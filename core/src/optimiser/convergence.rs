//! Stop rules that every method with iterations shares: small changes of the objective, and the stall guard.

use serde::{Deserialize, Serialize};

use super::{point::Point, stop::StopReason};

/// A run has reached its best value when it is this close, relatively.
const REACHED: f64 = 1e-3;

/// What the rules are told by a method's options.
pub(super) struct Rules {
    /// Relative change of the objective that counts as none.
    pub relative_tolerance: f64,
    /// Consecutive iterations on which a change must count as none.
    pub consecutive: usize,
    /// Times the cost to within 0.1 % of the best value at which a run ends; 0: never.
    pub stall_factor: f64,
    pub violation_tolerance: f64,
}

/// What the rules remember.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Convergence {
    /// Absolute change of the objective that counts as none.
    pub absolute_tolerance: f64,
    /// Consecutive feasible iterations with a small absolute change, with a small relative one.
    small_absolute: usize,
    small_relative: usize,
    /// Cost and iteration at which each new best feasible objective was met.
    progress: Vec<(usize, usize, f64)>,
    /// While an answer is taken: whether it comes from another mesh than the values at the iterate.
    #[serde(skip)]
    pub on_another_mesh: bool,
}

impl Convergence {
    pub fn new(absolute_tolerance: f64) -> Self {
        Self {
            absolute_tolerance,
            small_absolute: 0,
            small_relative: 0,
            progress: Vec::new(),
            on_another_mesh: false,
        }
    }

    /// Forgets what rests on values that are no longer comparable: no rule spans a change of the model.
    pub fn forget_values(&mut self) {
        self.small_absolute = 0;
        self.small_relative = 0;
        self.progress.clear();
    }

    /// The last small change may be due to a short step: counting begins anew.
    pub fn doubt(&mut self) {
        self.small_absolute = 0;
        self.small_relative = 0;
    }

    /// Notes what the best feasible objective cost.
    pub fn note(&mut self, cost: usize, iteration: usize, best: Option<&Point>, tolerance: f64) {
        if let Some(best) = best.filter(|best| best.violation <= tolerance)
            && self
                .progress
                .last()
                .is_none_or(|(_, _, objective)| best.objective < *objective)
        {
            self.progress.push((cost, iteration, best.objective));
        }
    }

    /// Cost and iteration at which the run came within 0.1 % of the best feasible objective.
    fn reached_best(&self) -> Option<(usize, usize)> {
        let (_, _, best) = self.progress.last()?;
        let near = best + REACHED * best.abs();
        let first = self
            .progress
            .iter()
            .find(|(_, _, objective)| *objective <= near);
        first.map(|&(cost, iteration, _)| (cost, iteration))
    }

    /// Whether the last iteration changed the objective by next to nothing.
    pub fn is_slow(&self) -> bool {
        self.small_relative > 0 || self.small_absolute > 0
    }

    /// Learns from an iteration, `iteration` completed at a cost of `cost`, where the next costs at least `ahead`, and says
    /// whether it was the last.
    pub fn close(
        &mut self,
        rules: &Rules,
        from: &Point,
        to: &Point,
        iteration: usize,
        [cost, ahead]: [usize; 2],
    ) -> Option<StopReason> {
        if self.on_another_mesh && from.x != to.x {
            return None;
        }
        if to.violation > rules.violation_tolerance {
            self.small_absolute = 0;
            self.small_relative = 0;
            return None;
        }
        if from.violation > rules.violation_tolerance {
            return None;
        }
        let change = (to.objective - from.objective).abs();
        let relative = change / to.objective.abs().max(f64::MIN_POSITIVE);
        let count = |small: bool, before: usize| if small { before + 1 } else { 0 };
        self.small_absolute = count(change <= self.absolute_tolerance, self.small_absolute);
        self.small_relative = count(relative <= rules.relative_tolerance, self.small_relative);
        if self.small_absolute >= rules.consecutive {
            return Some(StopReason::Absolute {
                change,
                tolerance: self.absolute_tolerance,
            });
        }
        if self.small_relative >= rules.consecutive {
            return Some(StopReason::Relative {
                change: relative,
                tolerance: rules.relative_tolerance,
            });
        }
        // As many iterations as the other rules want must have passed in vain.
        let (cost_to_best, reached) = self.reached_best()?;
        (rules.stall_factor > 0.0
            && iteration > reached + rules.consecutive
            && (cost + ahead) as f64 > rules.stall_factor * cost_to_best as f64)
            .then_some(StopReason::Stall { cost, cost_to_best })
    }
}
