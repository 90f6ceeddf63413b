//! How far elements are from folding.

use super::discretisation::{ElementKind, Mesh};
use crate::geometry::{Point, polygon};

/// Least scaled corner Jacobian of a mesh that is accepted: the sine of a corner angle of 1.15 degrees.
pub const SCALED_JACOBIAN_FLOOR: f64 = 0.02;

/// Corner positions, and at each corner the tangents along the side that leaves it and back along the one that enters.
fn corner_tangents(kind: ElementKind, x: &[Point]) -> Vec<(Point, Point)> {
    let corners = match kind {
        ElementKind::Quad4 | ElementKind::Quad9 => 4,
        ElementKind::Tri7 => 3,
    };
    let tangent = |from: usize, to: usize, side: usize| -> Point {
        if kind == ElementKind::Quad4 {
            return polygon::difference(x[from], x[to]);
        }
        // Derivative of the quadratic side at its end.
        let mid = x[corners + side];
        [0, 1].map(|c| 4.0 * mid[c] - 3.0 * x[from][c] - x[to][c])
    };
    (0..corners)
        .map(|k| {
            let (next, before) = ((k + 1) % corners, (k + corners - 1) % corners);
            (tangent(k, next, k), tangent(k, before, before))
        })
        .collect()
}

/// Least sine of a corner angle (scaled Jacobian) of an element; negative where a corner is turned inside out.
pub fn scaled_jacobian(kind: ElementKind, x: &[Point]) -> f64 {
    corner_tangents(kind, x)
        .into_iter()
        .map(|(u, v)| {
            let lengths = u[0].hypot(u[1]) * v[0].hypot(v[1]);
            if lengths > 0.0 {
                polygon::cross(u, v) / lengths
            } else {
                0.0
            }
        })
        .fold(f64::INFINITY, f64::min)
}

/// The least scaled corner Jacobian of a mesh and the index of its element in its block; `None` for an empty mesh.
pub fn least_scaled_jacobian(mesh: &Mesh) -> Option<(f64, usize)> {
    let mut worst: Option<(f64, usize)> = None;
    for block in &mesh.blocks {
        for (e, nodes) in block.nodes.chunks_exact(block.kind.nodes()).enumerate() {
            let x: Vec<Point> = nodes.iter().map(|n| mesh.nodes[*n as usize]).collect();
            let scaled = scaled_jacobian(block.kind, &x);
            if worst.is_none_or(|(least, _)| scaled < least || scaled.is_nan()) {
                worst = Some((scaled, e));
            }
        }
    }
    worst
}

/// Place of the shape function of each node along both directions.
const PLACES: [[usize; 2]; 9] = [
    [0, 0],
    [1, 0],
    [1, 1],
    [0, 1],
    [2, 0],
    [1, 2],
    [2, 1],
    [0, 2],
    [2, 2],
];

/// d(x, y)/d(xi, eta) of a quadrilateral of 4 or 9 nodes on [0, 1]^2.
fn jacobian(x: &[Point], [xi, eta]: [f64; 2]) -> f64 {
    // Values and slopes of the shape functions along one direction, by place: 0, 1 and, of 9 nodes, 1/2.
    let along = |t: f64| match x.len() {
        4 => ([1.0 - t, t, 0.0], [-1.0, 1.0, 0.0]),
        _ => (
            [
                (2.0 * t - 1.0) * (t - 1.0),
                t * (2.0 * t - 1.0),
                4.0 * t * (1.0 - t),
            ],
            [4.0 * t - 3.0, 4.0 * t - 1.0, 4.0 - 8.0 * t],
        ),
    };
    let ((n, dn), (m, dm)) = (along(xi), along(eta));
    let (mut u, mut v) = ([0.0; 2], [0.0; 2]);
    for (p, [i, j]) in x.iter().zip(PLACES) {
        for c in 0..2 {
            u[c] += dn[i] * m[j] * p[c];
            v[c] += n[i] * dm[j] * p[c];
        }
    }
    polygon::cross(u, v)
}

/// A lower bound of the Jacobian over a quadrilateral of 4 or 9 nodes: the least of its 4 x 4 Bezier coefficients, for it
/// is a polynomial of degree 3 at most in each direction. Sharp for straight sides.
pub fn jacobian_bound(x: &[Point]) -> f64 {
    // From values at 0, 1/3, 2/3, 1 to the coefficients of the Bernstein polynomials of degree 3.
    const BEZIER: [[f64; 4]; 4] = [
        [1.0, 0.0, 0.0, 0.0],
        [-5.0 / 6.0, 3.0, -1.5, 1.0 / 3.0],
        [1.0 / 3.0, -1.5, 3.0, -5.0 / 6.0],
        [0.0, 0.0, 0.0, 1.0],
    ];
    let values: [[f64; 4]; 4] = std::array::from_fn(|i| {
        std::array::from_fn(|j| jacobian(x, [i as f64 / 3.0, j as f64 / 3.0]))
    });
    let mut least = f64::INFINITY;
    for row in BEZIER {
        for column in BEZIER {
            let coefficient: f64 = (0..16)
                .map(|k| row[k / 4] * column[k % 4] * values[k / 4][k % 4])
                .sum();
            least = least.min(coefficient);
        }
    }
    least
}

/// The least [`jacobian_bound`] of a mesh's quadrilaterals, mm^2; infinite without any.
pub fn least_jacobian_bound(mesh: &Mesh) -> f64 {
    let mut least = f64::INFINITY;
    for block in &mesh.blocks {
        if block.kind == ElementKind::Tri7 {
            continue;
        }
        for nodes in block.nodes.chunks_exact(block.kind.nodes()) {
            let x: Vec<Point> = nodes.iter().map(|n| mesh.nodes[*n as usize]).collect();
            least = least.min(jacobian_bound(&x));
        }
    }
    least
}

/// The longest chord between neighbouring corners of an element.
pub fn longest_edge(mesh: &Mesh) -> f64 {
    let mut longest = 0.0_f64;
    for block in &mesh.blocks {
        let corners = if block.kind == ElementKind::Tri7 {
            3
        } else {
            4
        };
        for nodes in block.nodes.chunks_exact(block.kind.nodes()) {
            for k in 0..corners {
                let (a, b) = (nodes[k] as usize, nodes[(k + 1) % corners] as usize);
                longest = longest.max(polygon::distance(mesh.nodes[a], mesh.nodes[b]));
            }
        }
    }
    longest
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_bound_is_sharp_for_straight_sides_and_below_a_fold() {
        let straight = [[0.0, 0.0], [2.0, 0.0], [3.0, 2.0], [0.0, 1.0]];
        let corners = [2.0, 4.0, 5.0, 3.0];
        let exact = corners.iter().copied().fold(f64::INFINITY, f64::min);
        assert!((jacobian_bound(&straight) - exact).abs() < 1e-12);
        // The same with its mid-sides and centre, then with a side that bulges through the element.
        let mid = |a: Point, b: Point| [0.5 * (a[0] + b[0]), 0.5 * (a[1] + b[1])];
        let [a, b, c, d] = straight;
        let centre = mid(mid(a, b), mid(d, c));
        let mut nine = vec![
            a,
            b,
            c,
            d,
            mid(a, b),
            mid(b, c),
            mid(c, d),
            mid(d, a),
            centre,
        ];
        assert!((jacobian_bound(&nine) - exact).abs() < 1e-12);
        nine[4] = [1.0, 1.2];
        let sampled = (0..=100)
            .map(|k| jacobian(&nine, [0.5, 0.01 * f64::from(k)]))
            .fold(f64::INFINITY, f64::min);
        assert!(sampled < 0.0 && jacobian_bound(&nine) <= sampled);
    }
}
