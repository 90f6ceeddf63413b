//! Which four places of a chamber's boundary become the corners of its rectangle of blocks.

use super::Station;
use crate::geometry::{Point, polygon};

/// Lower left, lower right, upper right, upper left: the corners (or, where there are too few or they point along the
/// axes, the mid-points of edges) that lie best along the diagonals of the chamber's bounding box.
pub(super) fn logical_corners(corners: &[Point]) -> [Station; 4] {
    let centre = polygon::centroid(corners);
    let [low, high] = polygon::bounding_box(corners);
    let half = [0.5 * (high[0] - low[0]), 0.5 * (high[1] - low[1])];
    let mid_penalty = if corners.len() == 4 { 1.3 } else { 0.8 };
    let candidates: Vec<(Station, f64, f64)> = (0..2 * corners.len())
        .map(|k| {
            let station = Station {
                edge: k / 2,
                fraction: 0.5 * (k % 2) as f64,
            };
            let p = station.at(corners);
            let angle = ((p[1] - centre[1]) / half[1]).atan2((p[0] - centre[0]) / half[0]);
            (station, angle, mid_penalty * (k % 2) as f64)
        })
        .collect();
    let quarter = std::f64::consts::FRAC_PI_2;
    let cost = |k: usize, corner: usize| {
        let (_, angle, penalty) = candidates[k % candidates.len()];
        let wanted = quarter * (corner as f64 - 1.5);
        let turn = (angle - wanted).rem_euclid(4.0 * quarter);
        let off = turn.min(4.0 * quarter - turn) / (0.5 * quarter);
        // Lower left is corner 0 at -135 degrees.
        off * off + penalty
    };
    let n = candidates.len();
    let mut best = (f64::INFINITY, [0; 4]);
    for a in 0..n {
        for b in a + 1..a + n {
            for c in b + 1..a + n {
                let partial = cost(a, 0) + cost(b, 1) + cost(c, 2);
                if partial >= best.0 {
                    continue;
                }
                for d in c + 1..a + n {
                    let total = partial + cost(d, 3);
                    if total < best.0 - 1e-9 {
                        best = (total, [a, b, c, d]);
                    }
                }
            }
        }
    }
    best.1.map(|k| candidates[k % n].0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_quadrilateral_keeps_its_corners_and_a_triangle_borrows_one() {
        let quad = [[6.0, 6.0], [60.0, 12.0], [74.0, 34.0], [25.0, 30.0]];
        let corners = logical_corners(&quad);
        assert_eq!(corners.map(|s| s.edge), [0, 1, 2, 3]);
        assert!(corners.iter().all(|s| s.fraction == 0.0));
        let triangle = [[20.0, 20.0], [60.0, 20.0], [40.0, 60.0]];
        let corners = logical_corners(&triangle);
        assert!(corners.iter().any(|s| s.fraction > 0.0));
        assert_eq!((corners[0].edge, corners[1].edge), (0, 1));
    }
}
