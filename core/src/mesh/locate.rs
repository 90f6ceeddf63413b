//! Which element holds a point, and where in it.
//!
//! Local coordinates: quadrilaterals (xi, eta) in [-1, 1]^2 with corner 0 at (-1, -1) and corner 1 at (1, -1); triangles
//! (xi, eta) with corner 0 at (0, 0), corner 1 at (1, 0), corner 2 at (0, 1).

use super::discretisation::{ElementKind, Mesh};
use crate::geometry::Point;

/// Where a point lies in a mesh.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Location {
    /// Index of the element block.
    pub block: usize,
    /// Index of the element in its block.
    pub element: usize,
    /// Local coordinates, inside the element to round-off.
    pub local: Point,
}

/// How far outside an element, as a part of its size, a point may lie and still belong to it.
const TOLERANCE: f64 = 1e-9;

/// The element that holds a point of the closed solid: the first in order among those that share it. `None` outside.
pub fn locate(mesh: &Mesh, point: Point) -> Option<Location> {
    for (b, block) in mesh.blocks.iter().enumerate() {
        for (element, nodes) in block.nodes.chunks_exact(block.kind.nodes()).enumerate() {
            let x: Vec<Point> = nodes.iter().map(|n| mesh.nodes[*n as usize]).collect();
            let near = (0..2).all(|c| {
                let low = x.iter().map(|p| p[c]).fold(f64::INFINITY, f64::min);
                let high = x.iter().map(|p| p[c]).fold(f64::NEG_INFINITY, f64::max);
                // A curved side may leave the box of its nodes by an eighth of it at most.
                let margin = 0.15 * (high - low) + TOLERANCE;
                point[c] >= low - margin && point[c] <= high + margin
            });
            if near && let Some(local) = local_coordinates(block.kind, &x, point) {
                return Some(Location {
                    block: b,
                    element,
                    local,
                });
            }
        }
    }
    None
}

/// Newton's inverse of an element's map; `None` where the point is outside.
fn local_coordinates(kind: ElementKind, x: &[Point], point: Point) -> Option<Point> {
    let triangle = kind == ElementKind::Tri7;
    let mut local = if triangle { [1.0 / 3.0; 2] } else { [0.0; 2] };
    for _ in 0..50 {
        let (p, j) = map(kind, x, local);
        let r = [point[0] - p[0], point[1] - p[1]];
        let det = j[0][0] * j[1][1] - j[0][1] * j[1][0];
        if det == 0.0 {
            return None;
        }
        let step = [
            (j[1][1] * r[0] - j[0][1] * r[1]) / det,
            (j[0][0] * r[1] - j[1][0] * r[0]) / det,
        ];
        let size = step[0].abs().max(step[1].abs());
        let limit = if size > 1.0 { 1.0 / size } else { 1.0 };
        local = [local[0] + limit * step[0], local[1] + limit * step[1]];
        if size < 1e-13 {
            break;
        }
        if local[0].abs() > 10.0 || local[1].abs() > 10.0 || !size.is_finite() {
            return None;
        }
    }
    let (p, j) = map(kind, x, local);
    let scale = j.iter().flatten().fold(0.0_f64, |m, v| m.max(v.abs()));
    if (p[0] - point[0]).abs().max((p[1] - point[1]).abs()) > TOLERANCE * scale {
        return None;
    }
    let inside = if triangle {
        local[0] >= -TOLERANCE && local[1] >= -TOLERANCE && local[0] + local[1] <= 1.0 + TOLERANCE
    } else {
        local.iter().all(|l| l.abs() <= 1.0 + TOLERANCE)
    };
    inside.then_some(local)
}

/// Position and Jacobian (row: component, column: local coordinate) of an element's map.
pub(crate) fn map(kind: ElementKind, x: &[Point], local: Point) -> (Point, [[f64; 2]; 2]) {
    let mut position = [0.0; 2];
    let mut jacobian = [[0.0; 2]; 2];
    let mut add = |node: usize, value: f64, slope: Point| {
        for c in 0..2 {
            position[c] += value * x[node][c];
            for d in 0..2 {
                jacobian[c][d] += slope[d] * x[node][c];
            }
        }
    };
    let [xi, eta] = local;
    match kind {
        ElementKind::Quad4 => {
            for (k, [a, b]) in [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]]
                .into_iter()
                .enumerate()
            {
                let (f, g) = (1.0 + a * xi, 1.0 + b * eta);
                add(k, 0.25 * f * g, [0.25 * a * g, 0.25 * b * f]);
            }
        }
        ElementKind::Quad9 => {
            // One-dimensional parabolas through -1, 1, 0.
            let lagrange = |t: f64| {
                [
                    (0.5 * t * (t - 1.0), t - 0.5),
                    (0.5 * t * (t + 1.0), t + 0.5),
                    (1.0 - t * t, -2.0 * t),
                ]
            };
            let (f, g) = (lagrange(xi), lagrange(eta));
            let places = [
                (0, 0),
                (1, 0),
                (1, 1),
                (0, 1),
                (2, 0),
                (1, 2),
                (2, 1),
                (0, 2),
                (2, 2),
            ];
            for (k, (a, b)) in places.into_iter().enumerate() {
                add(k, f[a].0 * g[b].0, [f[a].1 * g[b].0, f[a].0 * g[b].1]);
            }
        }
        ElementKind::Tri7 => {
            // The bubble's node follows the others: the geometry is the six-node triangle's.
            let l = [1.0 - xi - eta, xi, eta];
            let dl = [[-1.0, -1.0], [1.0, 0.0], [0.0, 1.0]];
            for k in 0..3 {
                let slope = 4.0 * l[k] - 1.0;
                add(k, l[k] * (2.0 * l[k] - 1.0), dl[k].map(|d| slope * d));
                let n = (k + 1) % 3;
                let mixed = [0, 1].map(|d| 4.0 * (dl[k][d] * l[n] + l[k] * dl[n][d]));
                add(3 + k, 4.0 * l[k] * l[n], mixed);
            }
        }
    }
    (position, jacobian)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::ElementBlock;

    fn single(kind: ElementKind, nodes: Vec<Point>) -> Mesh {
        let count = nodes.len() as u32;
        Mesh {
            nodes,
            blocks: vec![ElementBlock {
                kind,
                nodes: (0..count).collect(),
                material: vec![0],
                tag: vec![1],
            }],
        }
    }

    /// Points of an element's map are found again at their local coordinates; points beyond its curved side are not.
    fn check(mesh: &Mesh, inside: &[Point], outside: &[Point]) {
        let kind = mesh.blocks[0].kind;
        for local in inside {
            let found = locate(mesh, map(kind, &mesh.nodes, *local).0).unwrap();
            for c in 0..2 {
                assert!((found.local[c] - local[c]).abs() < 1e-9, "{local:?}");
            }
        }
        for point in outside {
            assert!(locate(mesh, *point).is_none(), "{point:?}");
        }
    }

    #[test]
    fn curved_quadrilaterals_are_inverted() {
        // A quarter ring, radii 1 and 2.
        let at = |r: f64, part: f64| {
            let a = part * std::f64::consts::FRAC_PI_2;
            [r * a.cos(), r * a.sin()]
        };
        let mesh = single(
            ElementKind::Quad9,
            vec![
                at(1.0, 0.0),
                at(2.0, 0.0),
                at(2.0, 1.0),
                at(1.0, 1.0),
                at(1.5, 0.0),
                at(2.0, 0.5),
                at(1.5, 1.0),
                at(1.0, 0.5),
                at(1.5, 0.5),
            ],
        );
        let inside = [
            [0.0, 0.0],
            [-1.0, 0.3],
            [1.0, -1.0],
            [0.9, 0.99],
            [-0.2, 1.0],
        ];
        check(&mesh, &inside, &[[0.7, 0.69], [1.43, 1.43], [-0.01, 1.5]]);
    }

    #[test]
    fn curved_triangles_are_inverted() {
        let mesh = single(
            ElementKind::Tri7,
            vec![
                [0.0, 0.0],
                [2.0, 0.0],
                [0.0, 2.0],
                [1.0, 0.0],
                [1.3, 1.3],
                [0.0, 1.0],
                [0.7, 0.7],
            ],
        );
        let inside = [[0.2, 0.3], [0.0, 0.0], [0.5, 0.5], [0.0, 0.7], [1.0, 0.0]];
        check(&mesh, &inside, &[[1.31, 1.31], [-0.01, 0.5], [1.9, 0.9]]);
    }
}
