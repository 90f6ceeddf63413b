//! Which four places of a chamber's boundary become the corners of its rectangle of blocks.

use super::Station;
use crate::geometry::{Point, polygon};

/// Sine of a block's corner angle below which a choice is punished.
const POOR_SINE: f64 = 0.3;

/// Lower left, lower right, upper right, upper left: the corners (or, where there are too few or they point along the
/// axes, the mid-points of edges) that lie best along the diagonals of the chamber's bounding box. The solid angle is
/// shared by three blocks at a corner of the rectangle and by two elsewhere, so spikes have to be corners.
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
    // What the sine of the blocks' angles at a polygon's corner costs, if it is a corner of the rectangle and if not.
    let angle_cost = |k: usize, blocks: f64| {
        let before = corners[(k + corners.len() - 1) % corners.len()];
        let (u, v) = (
            polygon::difference(corners[k], corners[(k + 1) % corners.len()]),
            polygon::difference(corners[k], before),
        );
        let dot = u[0] * v[0] + u[1] * v[1];
        let interior = polygon::cross(u, v)
            .atan2(dot)
            .rem_euclid(std::f64::consts::TAU);
        let sine = ((std::f64::consts::TAU - interior) / blocks).sin();
        ((POOR_SINE / sine.max(1e-6)).powi(2) - 1.0).max(0.0)
    };
    let angle_costs: Vec<f64> = (0..2 * corners.len())
        .map(|k| match k % 2 {
            0 => angle_cost(k / 2, 3.0) - angle_cost(k / 2, 2.0),
            _ => 0.0,
        })
        .collect();
    let quarter = std::f64::consts::FRAC_PI_2;
    let cost = |k: usize, corner: usize| {
        let (_, angle, penalty) = candidates[k % candidates.len()];
        let wanted = quarter * (corner as f64 - 1.5);
        let turn = (angle - wanted).rem_euclid(4.0 * quarter);
        let off = turn.min(4.0 * quarter - turn) / (0.5 * quarter);
        // Lower left is corner 0 at -135 degrees.
        off * off + penalty + angle_costs[k % candidates.len()]
    };
    let n = candidates.len();
    let mut best = (f64::INFINITY, [0; 4]);
    for a in 0..n {
        for b in a + 1..a + n {
            for c in b + 1..a + n {
                let partial = cost(a, 0) + cost(b, 1) + cost(c, 2);
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
