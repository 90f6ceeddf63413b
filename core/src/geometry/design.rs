//! The design vector of the stacked pair (Eq. 2 of the paper), its side constraints (Fig. 5a), and rectangle pairs.
//!
//! A unit has two quadrilateral chambers, lower and upper, and the design vector [x1, y1, ..., x8, y8] in the unit's own
//! coordinates: corners 1-4 of the lower chamber, then 5-8 of the upper one, each counter-clockwise from its lower left.
//! A list of free units has their vectors one after the other.

use serde::{Deserialize, Serialize};

use super::{Point, Unit};

/// Variables of one unit.
pub const VARIABLES_PER_UNIT: usize = 16;

/// The boxes of a stacked pair: each corner lives in its own quadrant of its chamber's domain.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct StackedPair {
    /// Width and height of the unit, mm.
    pub unit_mm: [f64; 2],
    /// Least wall to the unit's outline and between the two chambers, mm.
    pub wall_mm: f64,
    /// Distance that every corner keeps from its domain's centre lines, mm.
    pub clearance_mm: f64,
}

impl StackedPair {
    /// The paper's unit: 80 x 80 with walls of 2 mm, and 0.5 mm clear of the centre lines.
    pub const PAPER: Self = Self {
        unit_mm: [80.0, 80.0],
        wall_mm: 2.0,
        clearance_mm: 0.5,
    };

    /// Lowest and highest corner of the domain of the lower (0) and the upper (1) chamber.
    pub fn domains(&self) -> [[Point; 2]; 2] {
        let [width, height] = self.unit_mm;
        let w = self.wall_mm;
        let (left, right) = (w, width - w);
        let (below, above) = (0.5 * (height - w), 0.5 * (height + w));
        [
            [[left, w], [right, below]],
            [[left, above], [right, height - w]],
        ]
    }

    /// Centres of the two domains.
    pub fn centres(&self) -> [Point; 2] {
        self.domains()
            .map(|[low, high]| [0, 1].map(|c| f64::midpoint(low[c], high[c])))
    }

    /// Lower and upper bounds of the 16 variables.
    pub fn bounds(&self) -> [Vec<f64>; 2] {
        let (mut lower, mut upper) = (vec![], vec![]);
        for ([low, high], centre) in self.domains().into_iter().zip(self.centres()) {
            for sides in QUADRANTS {
                for c in 0..2 {
                    if sides[c] < 0.0 {
                        lower.push(low[c]);
                        upper.push(centre[c] - self.clearance_mm);
                    } else {
                        lower.push(centre[c] + self.clearance_mm);
                        upper.push(high[c]);
                    }
                }
            }
        }
        [lower, upper]
    }

    /// The paper's common start: at every domain's centre the smallest void that the boxes allow (1 x 1 mm), which lies
    /// at the corner of all eight boxes.
    pub fn common_start(&self) -> Vec<f64> {
        let side = 2.0 * self.clearance_mm;
        self.rectangles([side, side])
    }

    /// The design vector of two equal rectangles of a width and a height, centred in the domains.
    pub fn rectangles(&self, size_mm: [f64; 2]) -> Vec<f64> {
        self.centres()
            .iter()
            .flat_map(|centre| {
                QUADRANTS
                    .iter()
                    .flat_map(|s| [0, 1].map(|c| centre[c] + 0.5 * s[c] * size_mm[c]))
            })
            .collect()
    }

    /// d (16 variables) / d (width, height) of [`StackedPair::rectangles`], one row per variable.
    pub fn rectangle_jacobian() -> [[f64; 2]; VARIABLES_PER_UNIT] {
        std::array::from_fn(|k| {
            let slope = 0.5 * QUADRANTS[(k / 2) % 4][k % 2];
            if k % 2 == 0 {
                [slope, 0.0]
            } else {
                [0.0, slope]
            }
        })
    }

    /// Bounds of width and height.
    pub fn rectangle_bounds(&self) -> [[f64; 2]; 2] {
        let [low, high] = self.domains()[0];
        let least = 2.0 * self.clearance_mm;
        [[least; 2], [high[0] - low[0], high[1] - low[1]]]
    }
}

/// Side of the centre on which corners 1 to 4 lie, (x, y).
const QUADRANTS: [[f64; 2]; 4] = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]];

/// Units of stacked pairs from a design vector; `None` if its length is not a positive multiple of 16.
pub fn units_of_design(x: &[f64]) -> Option<Vec<Unit>> {
    if x.is_empty() || !x.len().is_multiple_of(VARIABLES_PER_UNIT) {
        return None;
    }
    let chamber = |x: &[f64]| x.chunks_exact(2).map(|p| [p[0], p[1]]).collect();
    Some(
        x.chunks_exact(VARIABLES_PER_UNIT)
            .map(|x| Unit {
                chambers_mm: x
                    .chunks_exact(VARIABLES_PER_UNIT / 2)
                    .map(chamber)
                    .collect(),
            })
            .collect(),
    )
}

/// The design vector of units: all corners in order.
pub fn design_of_units(units: &[Unit]) -> Vec<f64> {
    units
        .iter()
        .flat_map(|u| u.chambers_mm.iter().flatten().flatten().copied())
        .collect()
}

/// A gradient per unit, chamber and corner as one over the design vector: summed over the units where they are copies.
pub fn design_gradient(corners: &[Vec<Vec<Point>>], repeated: bool) -> Vec<f64> {
    let unit = |u: &Vec<Vec<Point>>| u.iter().flatten().flatten().copied().collect::<Vec<f64>>();
    if !repeated {
        return corners.iter().flat_map(unit).collect();
    }
    let mut sum: Vec<f64> = vec![];
    for u in corners.iter().map(unit) {
        sum.resize(u.len(), 0.0);
        for (s, g) in sum.iter_mut().zip(u) {
            *s += g;
        }
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_common_start_is_the_corner_of_all_eight_boxes() {
        let [lower, upper] = StackedPair::PAPER.bounds();
        let start = StackedPair::PAPER.common_start();
        assert_eq!(start[..8], [39.5, 20.0, 40.5, 20.0, 40.5, 21.0, 39.5, 21.0]);
        for k in 0..VARIABLES_PER_UNIT {
            let inner = if lower[k] == start[k] {
                lower[k]
            } else {
                upper[k]
            };
            assert_eq!(start[k], inner);
        }
        assert_eq!(lower[..4], [2.0, 2.0, 40.5, 2.0]);
        assert_eq!(upper[..4], [39.5, 20.0, 78.0, 20.0]);
        assert_eq!(
            (lower[8], lower[9], upper[12], upper[13]),
            (2.0, 41.0, 78.0, 78.0)
        );
    }

    #[test]
    fn rectangles_are_linear_in_their_size() {
        let a = StackedPair::PAPER.rectangles([40.0, 15.0]);
        assert_eq!(a[..4], [20.0, 13.0, 60.0, 13.0]);
        let b = StackedPair::PAPER.rectangles([41.0, 17.0]);
        let jacobian = StackedPair::rectangle_jacobian();
        for k in 0..VARIABLES_PER_UNIT {
            let change = jacobian[k][0] + 2.0 * jacobian[k][1];
            assert!((b[k] - a[k] - change).abs() < 1e-13);
        }
    }

    #[test]
    fn units_and_vectors_go_both_ways() {
        let x: Vec<f64> = (0..32).map(f64::from).collect();
        let units = units_of_design(&x).unwrap();
        assert_eq!(units.len(), 2);
        assert_eq!(units[1].chambers_mm[1][3], [30.0, 31.0]);
        assert_eq!(design_of_units(&units), x);
        assert!(units_of_design(&x[..15]).is_none());
        let gradient = [units[0].chambers_mm.clone(), units[1].chambers_mm.clone()];
        assert_eq!(design_gradient(&gradient, false), x);
        assert_eq!(design_gradient(&gradient, true)[1], 18.0);
    }
}
