//! Straight and quadratic boundary edges.

use crate::mesh::BoundaryEdge;

/// Nodes of an edge: two, or three with the mid-side node last.
pub fn nodes(edge: &BoundaryEdge) -> ([u32; 3], usize) {
    match edge.mid {
        Some(mid) => ([edge.ends[0], edge.ends[1], mid], 3),
        None => ([edge.ends[0], edge.ends[1], edge.ends[0]], 2),
    }
}

/// Shape functions on an edge at t in [-1, 1]: start, end, mid.
pub fn shape(t: f64, count: usize) -> [f64; 3] {
    if count == 3 {
        [0.5 * t * (t - 1.), 0.5 * t * (t + 1.), 1. - t * t]
    } else {
        [0.5 * (1. - t), 0.5 * (1. + t), 0.]
    }
}

/// Their derivatives.
pub fn shape_derivative(t: f64, count: usize) -> [f64; 3] {
    if count == 3 {
        [t - 0.5, t + 0.5, -2. * t]
    } else {
        [-0.5, 0.5, 0.]
    }
}

/// A point of an edge with given node positions.
pub fn point(edge: &BoundaryEdge, position: &[[f64; 2]], t: f64) -> [f64; 2] {
    let (nodes, count) = nodes(edge);
    let n = shape(t, count);
    std::array::from_fn(|i| {
        (0..count)
            .map(|a| n[a] * position[nodes[a] as usize][i])
            .sum()
    })
}
