//! Answers to the point that is out which are alike to the search: what it asks for next then follows from its state alone.

use super::{Search, Setting};
use crate::optimiser::{contract::Told, speculate::made_up};

impl Search {
    /// Pairs of such answers: as good as the slope says, and no better than the iterate; outside the feasible region slightly
    /// better, and no better.
    pub fn alike(&self, setting: &Setting<'_>) -> Vec<[Told; 2]> {
        let alpha = self.pending.alpha();
        let change = (alpha * self.direction.slope).abs();
        let told = |change, violated, inside| made_up(setting.origin, change, violated, inside);
        if self.feasible {
            vec![
                [told(-change, 1.0, 0.01), told(-1.1 * change, 1.0, 0.02)],
                [told(change, 1.0, 0.01), told(2.0 * change, 1.0, 0.02)],
            ]
        } else {
            vec![
                [told(0.0, 0.9, 0.01), told(change, 0.95, 0.02)],
                [told(0.0, 1.1, 0.01), told(change, 1.2, 0.02)],
            ]
        }
    }
}
