//! From an infeasible iterate: one return from each trial, until the violation has clearly fallen.

use super::{MOST_REDUCTIONS, Next, Pending, Sample, Search, Setting};

impl Search {
    pub(super) fn next_infeasible(&mut self, setting: &Setting<'_>) -> Next {
        let start = setting.origin.violation;
        let newest = self.trials.iter().chain(&self.returned).last().cloned();
        let best = self.best(setting);
        if let Some(best) = &best
            && (best.point.violation <= setting.ctmin || best.point.violation < 0.2 * start)
        {
            let feasible = self.lowest_feasible(setting);
            return Next::Accept(Box::new(feasible.unwrap_or_else(|| best.clone())));
        }
        // From each trial one return: Newton's method on the violated rows.
        if let Pending::Trial { alpha } = self.pending
            && let Some(trial) = self
                .trials
                .iter()
                .find(|sample| sample.alpha == alpha)
                .cloned()
            && let Some(x) = self.back(setting, &trial)
        {
            self.pending = Pending::Return { alpha, x, count: 1 };
            return Next::Evaluate;
        }
        let alpha = self.pending.alpha();
        match best {
            Some(best) if best.point.violation < 0.8 * start => Next::Accept(Box::new(best)),
            Some(best)
                if newest.is_some_and(|newest| newest.alpha == best.alpha)
                    && self.extensions < 3 =>
            {
                self.extensions += 1;
                self.try_at(1.5 * alpha)
            }
            Some(best) if best.point.violation < (1.0 - 1e-3) * start => {
                Next::Accept(Box::new(best))
            }
            _ if self.reductions < MOST_REDUCTIONS => {
                self.reductions += 1;
                let shortest = self
                    .trials
                    .iter()
                    .map(|sample| sample.alpha)
                    .chain(self.bad.iter().copied());
                let alpha = shortest.fold(alpha, f64::min);
                self.try_at(0.4 * alpha)
            }
            Some(best) => Next::Accept(Box::new(best)),
            None => Next::Fail,
        }
    }

    fn lowest_feasible(&self, setting: &Setting<'_>) -> Option<Sample> {
        let points = self.trials.iter().chain(&self.returned);
        points
            .filter(|sample| sample.point.violation <= setting.ctmin)
            .min_by(|a, b| a.point.objective.total_cmp(&b.point.objective))
            .cloned()
    }
}
