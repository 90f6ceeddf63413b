//! The best of N restarts against what they cost.

use super::resampling::{Resampling, quantile};
use super::trace::{Sample, Trace};

/// Quantiles of the best value that restarts have found for each cost, one restart after the other, each drawn with
/// replacement out of the runs that were made: for each cost the values at `levels`; `None` where that share of the
/// resamples has found nothing yet. Costs ascend.
pub fn best_of_n(
    sample: &Sample,
    costs: &[f64],
    levels: &[f64],
    resampling: Resampling,
) -> Vec<Vec<Option<f64>>> {
    let runs = &sample.runs;
    let spent: f64 = runs.iter().map(Trace::total).sum();
    let end = costs.last().copied().unwrap_or(0.0);
    let mut found = vec![Vec::with_capacity(resampling.resamples); costs.len()];
    if spent > 0.0 && end.is_finite() {
        let mut draws = resampling.stream();
        for _ in 0..resampling.resamples {
            let (mut before, mut best, mut at) = (sample.before, f64::INFINITY, 0);
            while before <= end {
                let run = &runs[draws.index(runs.len())];
                for (cost, value) in run.steps() {
                    while at < costs.len() && costs[at] < before + cost {
                        found[at].push(best);
                        at += 1;
                    }
                    best = value.min(best);
                }
                before += run.total();
                while at < costs.len() && costs[at] < before {
                    found[at].push(best);
                    at += 1;
                }
            }
        }
    }
    let of_cost = |values: &mut Vec<f64>| {
        let level = |level: &f64| quantile(values, *level).filter(|v| v.is_finite());
        levels.iter().map(level).collect()
    };
    found.iter_mut().map(of_cost).collect()
}

/// The same at the ends of whole runs, in closed form: the best of `count` values drawn with replacement is at most the
/// k-th smallest of N with probability 1 - (1 - k/N)^count; this is the smallest value where that reaches `level`. Values
/// that are not there count as infinite.
pub fn quantile_of_best(values: &[Option<f64>], count: f64, level: f64) -> Option<f64> {
    let mut sorted: Vec<f64> = values.iter().map(|v| v.unwrap_or(f64::INFINITY)).collect();
    sorted.sort_by(f64::total_cmp);
    let total = sorted.len() as f64;
    let reaches = |k: &usize| 1.0 - (1.0 - (k + 1) as f64 / total).powf(count) >= level - 1e-12;
    let k = (0..sorted.len()).find(reaches)?;
    Some(sorted[k]).filter(|v| v.is_finite())
}

#[cfg(test)]
mod tests {
    use super::*;

    const LEVELS: [f64; 3] = [0.05, 0.5, 0.95];

    fn whole(cost: f64, value: Option<f64>) -> Trace {
        Trace::new([(cost, value)])
    }

    #[test]
    fn the_closed_form_of_two_values() {
        // Of a and b > a: after n draws b is still the best with probability 2^-n.
        let values = [Some(2.0), Some(1.0)];
        for (count, level, expected) in [
            (1.0, 0.5, 1.0),
            (1.0, 0.51, 2.0),
            (4.0, 0.9375, 1.0),
            (4.0, 0.94, 2.0),
        ] {
            assert_eq!(quantile_of_best(&values, count, level), Some(expected));
        }
        assert_eq!(quantile_of_best(&[None, Some(1.0)], 1.0, 0.9), None);
        assert_eq!(quantile_of_best(&[], 3.0, 0.5), None);
    }

    #[test]
    fn resamples_meet_the_closed_form() {
        // Ten runs of cost 1: for a cost of n they are the best of n draws. Levels between those of the closed form's
        // jumps, which no sampling error of 20000 resamples (0.35 % at most) reaches.
        let values: Vec<Option<f64>> = (0..10).map(|i| Some(f64::from(i * i))).collect();
        let runs = values.iter().map(|v| whole(1.0, *v)).collect();
        let sample = Sample { before: 0.0, runs };
        let many = Resampling {
            resamples: 20_000,
            seed: 5,
        };
        let found = best_of_n(&sample, &[1.0, 2.0, 5.0, 10.0], &LEVELS, many);
        for (count, found) in [1.0, 2.0, 5.0, 10.0].into_iter().zip(found) {
            for (level, found) in LEVELS.into_iter().zip(found) {
                let near = [-0.011, 0.011].map(|d| quantile_of_best(&values, count, level + d));
                assert!(
                    near[0] <= found && found <= near[1],
                    "{count} {level} {found:?}"
                );
            }
        }
    }

    #[test]
    fn nothing_is_known_before_it_is_paid_for() {
        let runs = vec![Trace::new([
            (1.0, None),
            (2.0, Some(3.0)),
            (4.0, Some(1.0)),
        ])];
        let [three, one] = [Some(3.0), Some(1.0)];
        for before in [0.0, 7.0] {
            let costs = [0.0, 1.9, 2.0, 3.9, 4.0, 40.0].map(|c| before + c);
            let runs = runs.clone();
            let sample = Sample { before, runs };
            let found = best_of_n(&sample, &costs, &[0.5], Resampling::default());
            let median: Vec<Option<f64>> = found.into_iter().map(|v| v[0]).collect();
            assert_eq!(median, [None, None, three, three, one, one]);
        }
        // Runs that cost nothing, or none at all, say nothing.
        for runs in [vec![], vec![Trace::default()]] {
            let sample = Sample { before: 0.0, runs };
            let found = best_of_n(&sample, &[1.0], &LEVELS, Resampling::default());
            assert_eq!(found, [[None; 3]]);
        }
    }
}
