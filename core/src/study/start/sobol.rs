//! Sobol's sequence (Sobol 1967), scrambled after Owen (1995) by hashing (Burley 2020), with the direction numbers of Joe and
//! Kuo (2008): any 2^m points in a row from a multiple of 2^m lie evenly in the cube.

use sobol_burley::{NUM_DIMENSIONS, sample};

use crate::random::SplitMix64;

/// Points of one scramble.
const LENGTH: usize = 1 << 16;

/// A sequence of points in the unit cube. More dimensions than the direction numbers know are padded with other scrambles, and
/// so are more points.
pub(super) struct Sobol {
    seed: u64,
    dimensions: usize,
    next: usize,
}

impl Sobol {
    pub(super) fn new(seed: u64, dimensions: usize) -> Self {
        Self {
            seed,
            dimensions,
            next: 0,
        }
    }

    /// The next point.
    pub(super) fn next_point(&mut self) -> Vec<f64> {
        let (round, index) = (self.next / LENGTH, (self.next % LENGTH) as u32);
        self.next += 1;
        let block = NUM_DIMENSIONS as usize;
        (0..self.dimensions)
            .map(|d| {
                let scramble = scramble(self.seed, d / block, round);
                sample(index, (d % block) as u32, scramble).into()
            })
            .collect()
    }
}

/// The crate's seeds have 32 bits, ours 64.
fn scramble(seed: u64, block: usize, round: usize) -> u32 {
    let other = ((block as u64) << 32) | round as u64;
    let mixed = SplitMix64::new(other).next_u64();
    (SplitMix64::new(seed ^ mixed).next_u64() >> 32) as u32
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn powers_of_two_fill_every_elementary_interval() {
        let mut sobol = Sobol::new(7, 300);
        let points: Vec<Vec<f64>> = (0..64).map(|_| sobol.next_point()).collect();
        for d in [0, 1, 15, 143, 255, 256, 299] {
            let mut strata: Vec<usize> = points.iter().map(|p| (p[d] * 64.0) as usize).collect();
            strata.sort_unstable();
            assert_eq!(strata, (0..64).collect::<Vec<_>>(), "dimension {d}");
        }
        // The first two dimensions together are a (0, 6, 2)-net.
        for (a, b) in [(8, 8), (2, 32), (16, 4)] {
            let mut cells: Vec<usize> = (points.iter())
                .map(|p| (p[0] * a as f64) as usize * b + (p[1] * b as f64) as usize)
                .collect();
            cells.sort_unstable();
            assert_eq!(cells, (0..64).collect::<Vec<_>>(), "{a} x {b}");
        }
    }

    #[test]
    fn another_seed_is_another_scramble() {
        let first = |seed| Sobol::new(seed, 16).next_point();
        assert_eq!(first(1), first(1));
        assert_ne!(first(1), first(2));
        assert_ne!(scramble(1, 0, 0), scramble(1, 1, 0));
        assert_ne!(scramble(1, 1, 0), scramble(1, 0, 1));
    }
}
