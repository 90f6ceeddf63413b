//! Latin hypercube designs (McKay, Beckman and Conover 1979): of n points each has one of n equal strata of every variable to
//! itself. Of several designs the one whose nearest points are farthest apart (maximin; Johnson, Moore and Ylvisaker 1990).

use super::space::{Found, MAX_DRAWS, StartSpace};
use crate::random::SplitMix64;
use crate::study::error::StudyError;

/// Designs of which the best is taken, at most.
const DESIGNS: u64 = 32;
/// Differences of coordinates that may be looked at for that.
const WORK: u64 = 20_000_000;

/// Points in the unit cube.
struct LatinHypercube {
    stream: SplitMix64,
    /// Per point and dimension the stratum, from 0.
    strata: Vec<Vec<usize>>,
    /// Per point and dimension the place in the stratum, in [0, 1).
    places: Vec<Vec<f64>>,
}

impl LatinHypercube {
    /// The first of `seed`'s designs.
    fn new(stream: &mut SplitMix64, points: usize, dimensions: usize) -> Self {
        let mut strata = vec![vec![0; dimensions]; points];
        for d in 0..dimensions {
            let mut order: Vec<usize> = (0..points).collect();
            for k in (1..points).rev() {
                order.swap(k, below(stream, k + 1));
            }
            for (point, stratum) in strata.iter_mut().zip(order) {
                point[d] = stratum;
            }
        }
        let mut place = |_| stream.next_unit();
        let mut of_point = |_| (0..dimensions).map(&mut place).collect();
        let places = (0..points).map(&mut of_point).collect();
        Self {
            stream: stream.clone(),
            strata,
            places,
        }
    }

    /// Of a few designs the one whose nearest points are farthest apart.
    fn maximin(seed: u64, points: usize, dimensions: usize) -> Self {
        let mut stream = SplitMix64::new(seed);
        let work = (points * points * dimensions).max(1) as u64;
        let mut best = Self::new(&mut stream, points, dimensions);
        let mut most = best.least_distance_squared();
        for _ in 1..(WORK / work).clamp(1, DESIGNS) {
            let design = Self::new(&mut stream, points, dimensions);
            let distance = design.least_distance_squared();
            if distance > most {
                (best, most) = (design, distance);
            }
        }
        best
    }

    fn least_distance_squared(&self) -> f64 {
        let points: Vec<Vec<f64>> = (0..self.strata.len()).map(|k| self.point(k)).collect();
        let mut least = f64::INFINITY;
        for (k, a) in points.iter().enumerate() {
            for b in &points[..k] {
                least = least.min(a.iter().zip(b).map(|(a, b)| (a - b) * (a - b)).sum());
            }
        }
        least
    }

    fn point(&self, k: usize) -> Vec<f64> {
        let n = self.strata.len() as f64;
        let coordinates = self.strata[k].iter().zip(&self.places[k]);
        coordinates.map(|(s, p)| (*s as f64 + p) / n).collect()
    }

    /// Some variables of a point anew, in their strata.
    fn place_anew(&mut self, k: usize, dimensions: &[usize]) {
        for d in dimensions {
            self.places[k][*d] = self.stream.next_unit();
        }
    }

    /// Exchanges a variable's strata, places included, of two points.
    fn exchange(&mut self, a: usize, b: usize, d: usize) {
        let stratum = self.strata[a][d];
        self.strata[a][d] = std::mem::replace(&mut self.strata[b][d], stratum);
        let place = self.places[a][d];
        self.places[a][d] = std::mem::replace(&mut self.places[b][d], place);
    }
}

/// A number below `n`, which is far below 2^53.
fn below(stream: &mut SplitMix64, n: usize) -> usize {
    ((stream.next_unit() * n as f64) as usize).min(n - 1)
}

/// The designs of a Latin hypercube, made valid and apart from `others` and each other: a point that is refused is, in turns, drawn
/// anew in the strata that offend and exchanges one of these with another point, so that the design stays a Latin hypercube. What is
/// still refused is moved into validity, out of its strata if need be: a stratum may hold nothing valid at all.
pub(super) fn latin_hypercube(
    space: &StartSpace<'_>,
    seed: u64,
    count: usize,
    apart: f64,
    others: &[&[f64]],
) -> Result<Vec<Found>, StudyError> {
    let mut cube = LatinHypercube::maximin(seed, count, space.dimensions());
    let mut designs: Vec<Vec<f64>> = (0..count).map(|k| space.design(cube.point(k))).collect();
    // Whether a design can stand beside the settled ones, which are those before `settled`.
    let is_good = |designs: &[Vec<f64>], k: usize, settled: usize| -> Result<bool, StudyError> {
        if space.refusal(&designs[k])? > 0.0 {
            return Ok(false);
        }
        let before = (0..settled).filter(|j| *j != k).map(|j| &designs[j][..]);
        Ok(space.distance(&designs[k], others.iter().copied().chain(before)) >= apart)
    };
    let mut tries = vec![0; count];
    let mut repaired: Vec<Option<Found>> = (0..count).map(|_| None).collect();
    for k in 0..count {
        let mut good = is_good(&designs, k, k)?;
        while !good && tries[k] < MAX_DRAWS {
            tries[k] += 1;
            let offending = space.offending(&designs[k])?;
            let other = below(&mut cube.stream, count);
            if tries[k] % 2 == 1 || other == k || repaired[other].is_some() {
                cube.place_anew(k, &offending);
                designs[k] = space.design(cube.point(k));
            } else {
                let d = offending[below(&mut cube.stream, offending.len())];
                cube.exchange(k, other, d);
                let before = [k, other].map(|j| {
                    let moved = space.design(cube.point(j));
                    std::mem::replace(&mut designs[j], moved)
                });
                if other < k && !is_good(&designs, other, k)? {
                    cube.exchange(k, other, d);
                    for (j, design) in [k, other].into_iter().zip(before) {
                        designs[j] = design;
                    }
                }
            }
            good = is_good(&designs, k, k)?;
        }
        if !good && space.refusal(&designs[k])? > 0.0 {
            let found = space.repaired(designs[k].clone(), tries[k])?;
            designs[k].clone_from(&found.x);
            repaired[k] = Some(found);
        }
    }
    let found = designs.into_iter().zip(repaired).zip(tries);
    Ok(found
        .map(|((x, repaired), tries)| repaired.unwrap_or_else(|| Found::valid(x, tries)))
        .collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn assert_latin(cube: &LatinHypercube) {
        let n = cube.strata.len();
        for d in 0..cube.strata[0].len() {
            let mut strata: Vec<usize> = (0..n)
                .map(|k| (cube.point(k)[d] * n as f64) as usize)
                .collect();
            strata.sort_unstable();
            assert_eq!(strata, (0..n).collect::<Vec<_>>(), "dimension {d}");
        }
    }

    #[test]
    fn every_stratum_of_every_variable_has_one_point() {
        let mut cube = LatinHypercube::maximin(3, 10, 16);
        assert_latin(&cube);
        cube.place_anew(4, &[0, 3]);
        cube.exchange(2, 7, 5);
        assert_latin(&cube);
    }

    #[test]
    fn the_best_of_several_designs_is_taken() {
        let one = LatinHypercube::new(&mut SplitMix64::new(3), 10, 2);
        let best = LatinHypercube::maximin(3, 10, 2);
        assert!(best.least_distance_squared() > one.least_distance_squared());
        assert_eq!(LatinHypercube::maximin(3, 10, 2).strata, best.strata);
    }
}
