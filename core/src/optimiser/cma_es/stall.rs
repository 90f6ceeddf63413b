//! The stall guard: ends a run that costs a multiple of what brought it to where it is. Small changes and small steps do not
//! end a run whose values are noise, or that never comes to a feasible point.

use serde::{Deserialize, Serialize};

use crate::optimiser::{point::Point, stop::StopReason};

/// A run has reached its best value when it is this close, relatively.
const REACHED: f64 = 1e-3;
/// Generations that must have passed in vain, beside 30 n / population: the least history of the tutorial's rule against
/// stagnation (appendix B.3).
const LEAST_GENERATIONS: usize = 120;

/// What was reached since the run, or its doubling, began.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct Stall {
    /// Analyses before it began.
    before: usize,
    best: Option<Point>,
    /// Cost, generation and value of each new best: its objective, or its violation as long as none is feasible.
    progress: Vec<(usize, usize, f64)>,
}

/// How far a run is.
pub(super) struct Spent {
    pub analyses: usize,
    pub generation: usize,
    pub population: usize,
    pub dimension: usize,
}

impl Stall {
    /// Of a run that begins after so many analyses.
    pub fn after(analyses: usize) -> Self {
        Self {
            before: analyses,
            ..Self::default()
        }
    }

    /// Notes the best point of a generation.
    pub fn note(&mut self, point: &Point, spent: &Spent, tolerance: f64) {
        let feasible = |point: &Point| point.violation <= tolerance;
        let before = self.best.as_ref();
        if before.is_some_and(|best| !point.better_than(best, tolerance)) {
            return;
        }
        if feasible(point) && before.is_some_and(|best| !feasible(best)) {
            self.progress.clear();
        }
        let value = if feasible(point) {
            point.objective
        } else {
            point.violation
        };
        let cost = spent.analyses - self.before;
        self.progress.push((cost, spent.generation, value));
        self.best = Some(point.clone());
    }

    /// Why a run ends that has cost `factor` times what brought it to within 0.1 % of its best value, if it has; never with a
    /// factor of 0.
    pub fn reason(&self, factor: f64, spent: &Spent, tolerance: f64) -> Option<StopReason> {
        let best = self.best.as_ref()?;
        let (_, _, last) = self.progress.last()?;
        let near = last + REACHED * last.abs();
        let mut reached = self.progress.iter();
        let (cost_to_best, reached, _) = reached.find(|(_, _, value)| *value <= near)?;
        let patience = LEAST_GENERATIONS + (30 * spent.dimension).div_ceil(spent.population);
        let in_vain = spent.generation - reached;
        let cost = spent.analyses - self.before;
        let ahead = (cost + spent.population) as f64;
        let stalls = factor > 0.0 && in_vain > patience && ahead > factor * *cost_to_best as f64;
        stalls.then_some(if best.violation <= tolerance {
            StopReason::Stall {
                cost,
                cost_to_best: *cost_to_best,
            }
        } else {
            StopReason::NoFeasibleDesign {
                iterations: in_vain,
                violation: best.violation,
            }
        })
    }
}
