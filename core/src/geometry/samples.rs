//! Random units in strata, for whatever must hold for any accepted design: those that keep g1 (no spike) and g2
//! (no thin wall). A seed and an index name a design for ever, on every machine, and designs may be drawn in any order.

use super::validity::Validity;
use super::{LayoutBoxes, Point, cascade, polygon};
use crate::random::{SplitMix64, start_seed};

/// How far from its outer bounds a corner lies that is near them, mm.
const NEAR_MM: f64 = 3.0;
/// How often a corner of [`Stratum::NearOuterEdges`] is near them.
const OFTEN: f64 = 0.8;
/// Least height of a chamber of [`Stratum::NearOuterEdges`], as a part of its domain's (33 of 37 mm).
const TALL: f64 = 33.0 / 37.0;
/// How far from a bound a coordinate of [`Stratum::NearBounds`] lies, as a part of its range.
const PART: f64 = 0.03;

/// Where in the boxes designs are drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stratum {
    /// Anywhere, uniformly.
    Uniform,
    /// Each corner with probability 0.8 within 3 mm of both outer bounds of its box, else anywhere in it; chambers at
    /// least 33 mm tall (of the paper's 37): thin walls, almost the largest voids, and some deep notches.
    NearOuterEdges,
    /// Every coordinate within 3 % of its lower or of its upper bound, evenly: slivers, notches and tiny voids.
    NearBounds,
}

impl Stratum {
    /// All strata.
    pub const ALL: [Self; 3] = [Self::Uniform, Self::NearOuterEdges, Self::NearBounds];

    /// The accepted design of a seed and an index: its coordinates, mm.
    pub fn design(self, boxes: &LayoutBoxes, seed: u64, index: usize) -> Vec<f64> {
        let mut stream = SplitMix64::new(start_seed(seed, index));
        loop {
            let x = self.draw(boxes, &mut stream);
            if is_accepted(boxes, &x) {
                return x;
            }
        }
    }

    /// One draw, accepted or not.
    fn draw(self, boxes: &LayoutBoxes, stream: &mut SplitMix64) -> Vec<f64> {
        let [lower, upper] = boxes.bounds();
        let within = |k: usize, t: f64| (lower[k] + (upper[k] - lower[k]) * t).min(upper[k]);
        match self {
            Self::Uniform => (0..boxes.variables())
                .map(|k| within(k, stream.next_unit()))
                .collect(),
            Self::NearBounds => (0..boxes.variables())
                .map(|k| {
                    let high = stream.next_unit() < 0.5;
                    let t = PART * stream.next_unit();
                    within(k, if high { 1.0 - t } else { t })
                })
                .collect(),
            Self::NearOuterEdges => {
                let mut x = vec![0.0; boxes.variables()];
                for (chamber, [low, high]) in boxes.domains().into_iter().enumerate() {
                    let of_chamber = boxes.variables_per_chamber();
                    let all = of_chamber * chamber..of_chamber * (chamber + 1);
                    loop {
                        for k in all.clone().step_by(2) {
                            let near = stream.next_unit() < OFTEN;
                            for k in [k, k + 1] {
                                let t = stream.next_unit();
                                // The outer bound is the one on the domain's own outline.
                                let inward = NEAR_MM.min(upper[k] - lower[k]) * t;
                                x[k] = match (near, lower[k] == low[k % 2]) {
                                    (false, _) => within(k, t),
                                    (true, true) => lower[k] + inward,
                                    (true, false) => upper[k] - inward,
                                };
                            }
                        }
                        let corners: Vec<Point> = x[all.clone()]
                            .chunks_exact(2)
                            .map(|p| [p[0], p[1]])
                            .collect();
                        let [bottom, top] = polygon::bounding_box(&corners).map(|p| p[1]);
                        if top - bottom >= TALL * (high[1] - low[1]) {
                            break;
                        }
                    }
                }
                x
            }
        }
    }
}

/// Whether a design vector of one unit keeps g1, g2 and g3.
pub fn is_accepted(boxes: &LayoutBoxes, x: &[f64]) -> bool {
    boxes.units(x).is_some_and(|units| {
        let actuator = cascade(&units[0], boxes.unit_mm, 1);
        let validity = Validity::in_boxes(&actuator, boxes);
        // Walls at the bound exactly are accepted whatever the last bit says.
        validity.g1() <= 0.0 && validity.g2() <= 1e-12 && validity.g3() <= 1e-12
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    const PAIR: LayoutBoxes = LayoutBoxes::PAPER;

    #[test]
    fn strata_lie_where_they_say() {
        let [lower, upper] = PAIR.bounds();
        for stratum in Stratum::ALL {
            let (mut near_bound, mut near_edge, mut convex) = (0, 0, 0);
            let count = 300;
            for index in 0..count {
                let x = stratum.design(&PAIR, 20_230_328, index);
                assert!(is_accepted(&PAIR, &x));
                let range = |k: usize| upper[k] - lower[k];
                assert!((0..16).all(|k| lower[k] <= x[k] && x[k] <= upper[k]));
                near_bound += (0..16)
                    .filter(|k| (x[*k] - lower[*k]).min(upper[*k] - x[*k]) <= 0.0301 * range(*k))
                    .count();
                near_edge += (0..8)
                    .filter(|c| {
                        (2 * c..2 * c + 2).all(|k| {
                            let inner = LayoutBoxes::PAPER.common_start()[k];
                            (x[k] - inner).abs() >= range(k) - 3.0
                        })
                    })
                    .count();
                for chamber in &PAIR.units(&x).unwrap()[0].chambers_mm {
                    let [low, high] = polygon::bounding_box(chamber);
                    assert!(stratum != Stratum::NearOuterEdges || high[1] - low[1] >= 33.0);
                    let turns = (0..4).all(|k| {
                        let p = |j: usize| chamber[(k + j) % 4];
                        polygon::cross(
                            polygon::difference(p(0), p(1)),
                            polygon::difference(p(1), p(2)),
                        ) > 0.0
                    });
                    convex += usize::from(turns);
                }
            }
            match stratum {
                Stratum::NearBounds => assert_eq!(near_bound, 16 * count),
                Stratum::NearOuterEdges => {
                    assert!((0.78..0.9).contains(&(near_edge as f64 / (8.0 * count as f64))));
                }
                Stratum::Uniform => assert!(near_bound < 2 * count),
            }
            assert!(convex > count && convex < 2 * count, "{convex}");
        }
    }

    #[test]
    fn a_design_has_a_name() {
        let of = |index| Stratum::Uniform.design(&PAIR, 1, index);
        assert_eq!(of(5), of(5));
        assert_ne!(of(5), of(6));
    }
}
