//! Draws with replacement by a seeded stream, and quantiles of what came out.

use crate::random::SplitMix64;

/// How bands are drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Resampling {
    /// Number of resamples.
    pub resamples: usize,
    /// Seed of their stream.
    pub seed: u64,
}

impl Default for Resampling {
    /// 2000: the ends of a 90 % interval then vary by about a percent of its coverage (sqrt(0.05 0.95 / 2000) = 0.5 %).
    fn default() -> Self {
        Self {
            resamples: 2000,
            seed: 1,
        }
    }
}

impl Resampling {
    pub(super) fn stream(self) -> Draws {
        Draws(SplitMix64::new(self.seed))
    }
}

/// Indices drawn with replacement.
pub(super) struct Draws(SplitMix64);

impl Draws {
    /// One of `count` indices; `count` is at least 1.
    pub(super) fn index(&mut self, count: usize) -> usize {
        ((self.0.next_unit() * count as f64) as usize).min(count - 1)
    }
}

/// The smallest value at or below which a share `level` of the values lies (inverse of the empirical distribution, so that
/// infinite values have their place); `None` of no values. Sorts them.
pub fn quantile(values: &mut [f64], level: f64) -> Option<f64> {
    values.sort_by(f64::total_cmp);
    let rank = (level * values.len() as f64 - 1e-9).ceil().max(1.0) as usize;
    values.get(rank.min(values.len()).checked_sub(1)?).copied()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_are_values_of_the_sample() {
        let mut values = [4.0, 1.0, f64::INFINITY, 2.0, 3.0];
        for (level, expected) in [
            (0.0, 1.0),
            (0.2, 1.0),
            (0.21, 2.0),
            (0.5, 3.0),
            (0.8, 4.0),
            (1.0, f64::INFINITY),
        ] {
            assert_eq!(quantile(&mut values, level), Some(expected), "{level}");
        }
        assert_eq!(quantile(&mut [], 0.5), None);
    }

    #[test]
    fn draws_are_even_and_repeat() {
        let mut counts = [0; 7];
        let mut draws = Resampling::default().stream();
        for _ in 0..70_000 {
            counts[draws.index(7)] += 1;
        }
        // Four standard deviations of a binomial of 70000 and 1/7.
        assert!(counts.iter().all(|c: &i32| (c - 10_000).abs() < 370));
        let first = |seed| Resampling { seed, resamples: 1 }.stream().index(1 << 40);
        assert!(first(3) == first(3) && first(3) != first(4));
    }
}
