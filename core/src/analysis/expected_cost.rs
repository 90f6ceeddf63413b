//! The chance of a run, and what a target costs.
//!
//! Runs are repeated until one comes to the target. Each is stopped there; with the chance q that a run comes to it the
//! expected cost is the mean cost of a run over q, which is the sum of the costs of all runs over the number of those that
//! came to it; what was spent before the first run is added once.

use super::resampling::{Draws, Resampling, quantile};
use super::trace::{Sample, Trace};

/// Of an interval's normal quantile: 95 %.
const Z: f64 = 1.959_963_984_540_054;
const ENDS: [f64; 2] = [0.025, 0.975];

/// Chance of a run and expected cost to a target, with 95 % intervals.
#[derive(Clone, Debug, PartialEq)]
pub struct ExpectedCost {
    /// The target: a value to come to or below.
    pub target: f64,
    /// Runs.
    pub runs: usize,
    /// Runs that came to it.
    pub hits: usize,
    /// Share of them.
    pub chance: f64,
    /// Wilson's interval of the chance (1927).
    pub chance_interval: [f64; 2],
    /// Mean cost of a run, stopped at the target.
    pub mean_cost: f64,
    /// Expected cost; `None`: infinite, no run came to it.
    pub expected: Option<f64>,
    /// Its bootstrap interval; `None`: infinite.
    pub interval: [Option<f64>; 2],
}

/// A ratio of expected costs.
#[derive(Clone, Debug, PartialEq)]
pub struct CostRatio {
    /// The ratio; `None` where it is infinite or both costs are.
    pub ratio: Option<f64>,
    /// Its 95 % bootstrap interval; `None`: infinite.
    pub interval: [Option<f64>; 2],
    /// Share of the resamples in which both costs are infinite; they say nothing and are left out.
    pub undecided: f64,
}

impl ExpectedCost {
    /// Of runs.
    pub fn of(sample: &Sample, target: f64, resampling: Resampling) -> Self {
        let runs = &sample.runs;
        let outcomes = outcomes(sample, target);
        let hits = outcomes.iter().filter(|o| o.1).count();
        let count = runs.len() as f64;
        let spent: f64 = outcomes.iter().map(|o| o.0).sum();
        let mut draws = resampling.stream();
        let mut costs: Vec<f64> = (0..resampling.resamples)
            .map(|_| sample.before + resampled(&outcomes, &mut draws))
            .collect();
        Self {
            target,
            runs: runs.len(),
            hits,
            chance: if hits == 0 { 0.0 } else { hits as f64 / count },
            chance_interval: wilson(hits, runs.len()),
            mean_cost: if runs.is_empty() { 0.0 } else { spent / count },
            expected: (hits > 0).then(|| sample.before + spent / hits as f64),
            interval: ends(&mut costs),
        }
    }
}

/// The expected cost of some runs over that of others, both resampled.
pub fn ratio(above: &Sample, below: &Sample, target: f64, resampling: Resampling) -> CostRatio {
    let before = [above.before, below.before];
    let [above, below] = [above, below].map(|sample| outcomes(sample, target));
    let value = (before[0] + cost(above.iter())) / (before[1] + cost(below.iter()));
    let mut draws = resampling.stream();
    let mut ratios: Vec<f64> = (0..resampling.resamples)
        .map(|_| {
            let above = before[0] + resampled(&above, &mut draws);
            above / (before[1] + resampled(&below, &mut draws))
        })
        .collect();
    ratios.retain(|r| !r.is_nan());
    let undecided = 1.0 - ratios.len() as f64 / resampling.resamples.max(1) as f64;
    CostRatio {
        ratio: value.is_finite().then_some(value),
        interval: ends(&mut ratios),
        undecided,
    }
}

/// What each run costs until it is stopped, and whether that is at the target.
type RunOutcome = (f64, bool);

fn outcomes(sample: &Sample, target: f64) -> Vec<RunOutcome> {
    let outcome = |run: &Trace| match run.cost_to(target) {
        Some(cost) => (cost, true),
        None => (run.total(), false),
    };
    sample.runs.iter().map(outcome).collect()
}

/// Infinite without a hit.
fn cost<'a>(outcomes: impl Iterator<Item = &'a RunOutcome>) -> f64 {
    let (mut spent, mut hits) = (0.0, 0_usize);
    for (cost, hit) in outcomes {
        spent += cost;
        hits += usize::from(*hit);
    }
    if hits == 0 {
        f64::INFINITY
    } else {
        spent / hits as f64
    }
}

fn resampled(outcomes: &[RunOutcome], draws: &mut Draws) -> f64 {
    cost((0..outcomes.len()).map(|_| &outcomes[draws.index(outcomes.len())]))
}

fn ends(values: &mut [f64]) -> [Option<f64>; 2] {
    ENDS.map(|level| quantile(values, level).filter(|v| v.is_finite()))
}

fn wilson(hits: usize, runs: usize) -> [f64; 2] {
    if runs == 0 {
        return [0.0, 1.0];
    }
    let (n, p, z2) = (runs as f64, hits as f64 / runs as f64, Z * Z);
    let middle = p + z2 / (2.0 * n);
    let half = Z * (p * (1.0 - p) / n + z2 / (4.0 * n * n)).sqrt();
    [-half, half].map(|h| ((middle + h) / (1.0 + z2 / n)).clamp(0.0, 1.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(runs: Vec<Trace>) -> Sample {
        Sample { before: 0.0, runs }
    }

    fn sample() -> Sample {
        // Two of five come to 1: after 4 of 9 and after 6; three end at 10, 20 and 30 without.
        let hit =
            |at: f64, total: f64| Trace::new([(1.0, Some(7.0)), (at, Some(1.0)), (total, None)]);
        let miss = |total: f64| Trace::new([(total, Some(2.0))]);
        of(vec![
            hit(4.0, 9.0),
            miss(10.0),
            hit(6.0, 6.0),
            miss(20.0),
            miss(30.0),
        ])
    }

    #[test]
    fn cost_by_hand() {
        let found = ExpectedCost::of(&sample(), 1.0, Resampling::default());
        assert_eq!((found.runs, found.hits, found.chance), (5, 2, 0.4));
        assert!((found.mean_cost - 14.0).abs() < 1e-12);
        // 70 / 2, which is also mean cost of a run over its chance.
        assert_eq!(found.expected, Some(35.0));
        assert!((found.mean_cost / found.chance - 35.0).abs() < 1e-12);
        // COCO's form: mean cost of hits plus (1 - q) / q times that of misses.
        assert!((5.0 + 0.6 / 0.4 * 20.0 - 35.0_f64).abs() < 1e-12);
        // Wilson 1927 for 2 of 5.
        let [low, high] = found.chance_interval;
        assert!((low - 0.11762).abs() < 1e-5 && (high - 0.76928).abs() < 1e-5);
        // 0.6^5 = 7.8 % of the resamples have no hit.
        assert!(found.interval[0].is_some_and(|low| low < 35.0));
        assert_eq!(found.interval[1], None);
        let before = Sample {
            before: 100.0,
            ..sample()
        };
        let later = ExpectedCost::of(&before, 1.0, Resampling::default());
        assert_eq!(
            (later.expected, later.mean_cost),
            (Some(135.0), found.mean_cost)
        );
    }

    #[test]
    fn two_runs_in_closed_form() {
        // One hits after 3, one misses after 5. Resamples: both hits, 3, with 1/4; one of each, 8, with 1/2; else infinite.
        let runs = vec![Trace::new([(3.0, Some(0.0))]), Trace::new([(5.0, None)])];
        let outcomes = outcomes(&of(runs), 0.0);
        let mut draws = Resampling::default().stream();
        let costs: Vec<f64> = (0..40_000)
            .map(|_| resampled(&outcomes, &mut draws))
            .collect();
        for (cost, share) in [(3.0, 0.25), (8.0, 0.5), (f64::INFINITY, 0.25)] {
            let found = costs.iter().filter(|c| **c == cost).count() as f64 / 40_000.0;
            assert!((found - share).abs() < 0.01, "{cost}: {found}");
        }
    }

    #[test]
    fn a_method_against_itself_and_against_none() {
        let four = |trace: Trace| of(vec![trace; 4]);
        let all = four(Trace::new([(2.0, Some(0.0))]));
        let twice = four(Trace::new([(4.0, Some(0.0))]));
        let never = four(Trace::new([(4.0, Some(5.0))]));
        let over = |a: &Sample, b: &Sample| ratio(a, b, 0.0, Resampling::default());
        assert_eq!(over(&twice, &all).ratio, Some(2.0));
        assert_eq!(over(&twice, &all).interval, [Some(2.0); 2]);
        assert_eq!(over(&all, &never).ratio, Some(0.0));
        assert_eq!(over(&never, &all).interval, [None; 2]);
        let neither = over(&never, &never);
        assert_eq!((neither.ratio, neither.undecided), (None, 1.0));
        let none = ExpectedCost::of(&Sample::default(), 0.0, Resampling::default());
        assert_eq!((none.chance, none.expected), (0.0, None));
    }
}
