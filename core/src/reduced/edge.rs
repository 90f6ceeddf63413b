//! The points of an edge that are followed: the nine of Gauss and Lobatto, so that sums are integrals along the edge.

use crate::geometry::Point;

/// Number of points.
pub const POINTS: usize = 9;
/// The point in the middle.
pub const MIDDLE: usize = 4;
/// Their places from -1, the lower end, to 1.
pub const PLACES: [f64; POINTS] = [
    -1.0,
    -0.899_757_995_411_460_2,
    -0.677_186_279_510_737_7,
    -0.363_117_463_826_178_2,
    0.0,
    0.363_117_463_826_178_2,
    0.677_186_279_510_737_7,
    0.899_757_995_411_460_2,
    1.0,
];
/// Their weights, 2 in all.
pub const WEIGHTS: [f64; POINTS] = [
    0.027_777_777_777_777_78,
    0.165_495_361_560_805_5,
    0.274_538_712_500_161_7,
    0.346_428_510_973_046_3,
    0.371_519_274_376_417_2,
    0.346_428_510_973_046_3,
    0.274_538_712_500_161_7,
    0.165_495_361_560_805_5,
    0.027_777_777_777_777_78,
];

/// The points of an edge at `x` of a unit's own frame, whose origin is the middle of its left edge, mm.
pub fn points(x: f64, height_mm: f64) -> [Point; POINTS] {
    PLACES.map(|y| [x, 0.5 * height_mm * y])
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Exact for polynomials up to degree 15.
    #[test]
    fn sums_are_integrals() {
        for power in (0..=14).step_by(2) {
            let sum: f64 = (PLACES.iter().zip(WEIGHTS))
                .map(|(x, w)| w * x.powi(power))
                .sum();
            assert!((sum - 2.0 / f64::from(power + 1)).abs() < 1e-14, "{power}");
        }
    }
}
