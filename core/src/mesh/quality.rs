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
