//! Uniform pressure in a cavity, from its potential -p V.
//!
//! V = 1/2 closed integral of (x dy - y dx) over the element's own edges, exactly: with x(t) = sum N_a(t) x_a an edge adds
//! 1/2 sum_{a<b} c_ab (x_a x x_b), c_ab = int (N_a N_b' - N_b N_a') dt: 1 for a straight edge; -1/3 (start, end) and
//! 4/3 (start, mid; mid, end) for a quadratic one. So V is a quadratic form of the node positions, its gradient linear
//! and its Hessian constant; it depends on x = X + u alone, so its derivative with respect to X is the one with respect
//! to u. An open chain is closed by a polyline through fixed points: an end that slides on a straight support is followed
//! by a point of that line, which makes the end terms of the variation vanish along the line.

use super::edge;
use crate::mesh::Cavity;

const PAIRS: [(usize, usize, f64); 3] = [(0, 1, -1.0 / 3.0), (0, 2, 4.0 / 3.0), (2, 1, 4.0 / 3.0)];

fn cross(a: [f64; 2], b: [f64; 2]) -> f64 {
    a[0] * b[1] - a[1] * b[0]
}

fn pairs(count: usize) -> &'static [(usize, usize, f64)] {
    const STRAIGHT: [(usize, usize, f64); 1] = [(0, 1, 1.0)];
    if count == 3 { &PAIRS } else { &STRAIGHT }
}

/// Visits the couples (a, b, c): V is the sum of c/2 (x_a x x_b).
fn couples(cavity: &Cavity, mut visit: impl FnMut(u32, u32, f64)) {
    for e in &cavity.edges {
        let (nodes, count) = edge::nodes(e);
        for &(a, b, c) in pairs(count) {
            visit(nodes[a], nodes[b], c);
        }
    }
}

/// A node at the end of an open chain, and the fixed point beside it.
type End = (u32, [f64; 2]);

/// The ends of an open chain with the fixed points beside them, (last, after), (first, before).
fn open_ends(cavity: &Cavity) -> Option<(End, End)> {
    if cavity.closed {
        return None;
    }
    let last = cavity.edges.last()?.ends[1];
    let first = cavity.edges.first()?.ends[0];
    let after = cavity.closing_points_mm.first()?;
    let before = cavity.closing_points_mm.last()?;
    Some(((last, *after), (first, *before)))
}

fn chord(cavity: &Cavity) -> Option<(u32, u32)> {
    (!cavity.closed && cavity.closing_points_mm.is_empty())
        .then(|| Some((cavity.edges.last()?.ends[1], cavity.edges.first()?.ends[0])))
        .flatten()
}

/// Area of the cavity at node positions `x`, mm^2.
pub fn area(cavity: &Cavity, x: &[[f64; 2]]) -> f64 {
    let mut twice = 0.0;
    couples(cavity, |a, b, c| {
        twice += c * cross(x[a as usize], x[b as usize]);
    });
    if let Some(((last, after), (first, before))) = open_ends(cavity) {
        twice += cross(x[last as usize], after) + cross(before, x[first as usize]);
        for pair in cavity.closing_points_mm.windows(2) {
            twice += cross(pair[0], pair[1]);
        }
    }
    if let Some((last, first)) = chord(cavity) {
        twice += cross(x[last as usize], x[first as usize]);
    }
    0.5 * twice
}

/// Adds `scale` times dV/dx.
pub fn add_gradient(cavity: &Cavity, x: &[[f64; 2]], scale: f64, out: &mut [[f64; 2]]) {
    let s = 0.5 * scale;
    let mut couple = |a: u32, b: u32, c: f64| {
        let (xa, xb) = (x[a as usize], x[b as usize]);
        out[a as usize][0] += s * c * xb[1];
        out[a as usize][1] -= s * c * xb[0];
        out[b as usize][0] -= s * c * xa[1];
        out[b as usize][1] += s * c * xa[0];
    };
    couples(cavity, &mut couple);
    if let Some((last, first)) = chord(cavity) {
        couple(last, first, 1.0);
    }
    if let Some(((last, after), (first, before))) = open_ends(cavity) {
        out[last as usize][0] += s * after[1];
        out[last as usize][1] -= s * after[0];
        out[first as usize][0] -= s * before[1];
        out[first as usize][1] += s * before[0];
    }
}

/// Visits the entries (node a, component, node b, component, value) of d2V/dx2 above and below the diagonal once each:
/// for every couple the entries of (a, b); the transposed ones are the caller's.
pub fn hessian(cavity: &Cavity, mut visit: impl FnMut(u32, usize, u32, usize, f64)) {
    let mut couple = |a: u32, b: u32, c: f64| {
        visit(a, 0, b, 1, 0.5 * c);
        visit(a, 1, b, 0, -0.5 * c);
    };
    couples(cavity, &mut couple);
    if let Some((last, first)) = chord(cavity) {
        couple(last, first, 1.0);
    }
}

/// Adds `scale` times (d2V/dx2) v: with scale = -p this is the derivative of v . R with respect to X.
pub fn add_hessian_product(cavity: &Cavity, v: &[[f64; 2]], scale: f64, out: &mut [[f64; 2]]) {
    hessian(cavity, |a, i, b, j, value| {
        out[a as usize][i] += scale * value * v[b as usize][j];
        out[b as usize][j] += scale * value * v[a as usize][i];
    });
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::BoundaryEdge;

    /// A half disc by two quadratic arcs; the straight side is the closing line.
    fn arcs() -> (Cavity, Vec<[f64; 2]>) {
        let at = |t: f64| [t.cos(), t.sin()];
        let quarter = std::f64::consts::FRAC_PI_4;
        let x: Vec<_> = (0..5).map(|k| at(f64::from(k) * quarter)).collect();
        let edge = |a, b, m| BoundaryEdge {
            ends: [a, b],
            mid: Some(m),
        };
        let cavity = Cavity {
            channel: 0,
            edges: vec![edge(0, 2, 1), edge(2, 4, 3)],
            closing_points_mm: vec![[0.0, 0.0]],
            closed: false,
        };
        (cavity, x)
    }

    #[test]
    fn area_of_a_quadratic_half_disc() {
        // Each parabolic segment adds 2/3 of chord times sagitta to its triangle.
        let (cavity, x) = arcs();
        let chord = 2f64.sqrt();
        let exact = 2.0 * (0.5 + 2.0 / 3.0 * chord * (1.0 - chord / 2.0));
        assert!((area(&cavity, &x) - exact).abs() < 1e-14);
    }

    #[test]
    fn gradient_and_hessian_match_differences() {
        let (cavity, x) = arcs();
        let mut gradient = vec![[0.0; 2]; 5];
        add_gradient(&cavity, &x, 1.0, &mut gradient);
        for node in 0..5 {
            for i in 0..2 {
                let mut shifted = x.clone();
                shifted[node][i] += 0.5;
                let up = area(&cavity, &shifted);
                shifted[node][i] -= 1.0;
                let down = area(&cavity, &shifted);
                // V is quadratic: central differences are exact.
                assert!((gradient[node][i] - (up - down)).abs() < 1e-14);
                let mut direction = vec![[0.0; 2]; 5];
                direction[node][i] = 1.0;
                let mut product = vec![[0.0; 2]; 5];
                add_hessian_product(&cavity, &direction, 1.0, &mut product);
                shifted[node][i] += 1.5;
                let mut moved = vec![[0.0; 2]; 5];
                add_gradient(&cavity, &shifted, 1.0, &mut moved);
                for k in 0..5 {
                    for j in 0..2 {
                        assert!((product[k][j] - (moved[k][j] - gradient[k][j])).abs() < 1e-14);
                    }
                }
            }
        }
    }

    #[test]
    fn a_sliding_end_feels_no_force_along_its_line() {
        // The ends slide on y = 0; the force of a pressure on the arc has no component along x there beyond the arc's
        // own: moving both ends outwards along the line changes the area by the consistent edge integral alone.
        let (cavity, x) = arcs();
        let mut gradient = vec![[0.0; 2]; 5];
        add_gradient(&cavity, &x, 1.0, &mut gradient);
        // Consistent nodal value: int N_0 dy over the first edge.
        let dy = |t: f64| edge::shape_derivative(t, 3);
        let (mut sum, g) = (0.0, 0.6f64.sqrt());
        for (t, w) in [(-g, 5. / 9.), (0., 8. / 9.), (g, 5. / 9.)] {
            let d = dy(t);
            let y_t = d[0] * x[0][1] + d[1] * x[2][1] + d[2] * x[1][1];
            sum += w * edge::shape(t, 3)[0] * y_t;
        }
        assert!((gradient[0][0] - sum).abs() < 1e-14);
    }
}
