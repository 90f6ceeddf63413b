//! A run: the best so far against what was spent.

/// The best value so far of a run, minimised, against its cost: CPU seconds, or a count of analyses.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Trace {
    /// (cost, best) where the best changes, both in order.
    steps: Vec<(f64, f64)>,
    total: f64,
}

/// The runs of a method, and what it spent before the first of them: on the steps that it rests on.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Sample {
    /// Cost before the first run.
    pub before: f64,
    /// The runs.
    pub runs: Vec<Trace>,
}

impl Sample {
    /// Cost of all.
    pub fn total(&self) -> f64 {
        self.before + self.runs.iter().map(Trace::total).sum::<f64>()
    }

    /// The best value of all runs.
    pub fn best(&self) -> Option<f64> {
        self.runs.iter().filter_map(Trace::best).reduce(f64::min)
    }
}

impl Trace {
    /// Of points (cost so far, value if it counts), in ascending cost; the last one says what the run cost in all.
    pub fn new(points: impl IntoIterator<Item = (f64, Option<f64>)>) -> Self {
        let mut trace = Self::default();
        for (cost, value) in points {
            trace.total = trace.total.max(cost);
            let Some(value) = value.filter(|v| v.is_finite()) else {
                continue;
            };
            if trace.best().is_none_or(|best| value < best) {
                trace.steps.push((trace.total, value));
            }
        }
        trace
    }

    /// What the whole run cost.
    pub fn total(&self) -> f64 {
        self.total
    }

    /// Its best value; `None` where nothing counts.
    pub fn best(&self) -> Option<f64> {
        self.steps.last().map(|step| step.1)
    }

    /// The best value that it had for a cost.
    pub fn at(&self, cost: f64) -> Option<f64> {
        let known = self.steps.partition_point(|step| step.0 <= cost);
        self.steps[..known].last().map(|step| step.1)
    }

    /// What it cost to come to a value or below it.
    pub fn cost_to(&self, target: f64) -> Option<f64> {
        let later = self.steps.partition_point(|step| step.1 > target);
        self.steps.get(later).map(|step| step.0)
    }

    /// (cost, best) where the best changes.
    pub fn steps(&self) -> &[(f64, f64)] {
        &self.steps
    }

    /// This run and then another one, as one.
    #[must_use]
    pub fn then(&self, next: &Self) -> Self {
        let mut both = self.clone();
        both.total += next.total;
        let later = next.steps.iter().map(|(cost, v)| (self.total + cost, *v));
        let best = self.best().unwrap_or(f64::INFINITY);
        both.steps.extend(later.filter(|step| step.1 < best));
        both
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_what_counts_and_improves_is_kept() {
        let trace = Trace::new([
            (1.0, None),
            (2.0, Some(5.0)),
            (3.0, Some(7.0)),
            (4.0, Some(f64::NAN)),
            (5.0, Some(1.0)),
            (6.0, None),
        ]);
        assert_eq!(trace.steps(), [(2.0, 5.0), (5.0, 1.0)]);
        assert_eq!((trace.total(), trace.best()), (6.0, Some(1.0)));
        assert_eq!(trace.at(1.9), None);
        assert_eq!((trace.at(2.0), trace.at(9.0)), (Some(5.0), Some(1.0)));
        assert_eq!(trace.cost_to(5.0), Some(2.0));
        assert_eq!(trace.cost_to(4.0), Some(5.0));
        assert_eq!(trace.cost_to(0.5), None);
    }

    #[test]
    fn one_run_after_another_is_a_run() {
        let first = Trace::new([(2.0, Some(3.0)), (4.0, None)]);
        let second = Trace::new([(1.0, Some(8.0)), (2.0, Some(2.0))]);
        let both = first.then(&second);
        assert_eq!(both.steps(), [(2.0, 3.0), (6.0, 2.0)]);
        assert_eq!(both.total(), 6.0);
        assert_eq!(Trace::default().then(&first), first);
    }
}
