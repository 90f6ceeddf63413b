//! The energy of one block: how far its shape at each of its four corners is from its target rectangle.
//!
//! At a corner let u and v be the block's edge vectors along its row and its column, and U = u / w, V = v / h with the
//! target width w and height h. With s = (|U|^2 + |V|^2) / 2 and d = U x V,
//!
//! e = (1 - g) s / chi(d) + g (d^2 + 1) / (2 chi(d)),   chi(d) = (d + sqrt(d^2 + eps^2)) / 2,
//!
//! the regularised shape and size measures of foldover-free maps (Garanzha et al., ACM Trans. Graph. 40(4), 2021). With
//! eps = 0 it is a barrier: infinite where d <= 0. Both parts are polyconvex: convex in (U, V, d).

use crate::geometry::Point;

/// Weight g of the size measure.
const SIZE_WEIGHT: f64 = 0.15;

/// Corners as pairs (row edge, column edge); edges: 0 bottom (a to b), 1 top (d to c), 2 left (a to d), 3 right (b to c).
const CORNERS: [[usize; 2]; 4] = [[0, 2], [0, 3], [1, 3], [1, 2]];
/// Edge = to - from, by vertex of the block (a, b, c, d counter-clockwise from the lower left).
const EDGES: [[usize; 2]; 4] = [[0, 1], [3, 2], [0, 3], [1, 2]];

/// Target width and height of a block, mm.
pub(super) type Target = [f64; 2];

fn chi(d: f64, eps: f64) -> [f64; 3] {
    if eps == 0.0 {
        return [d, 1.0, 0.0];
    }
    let r = (d * d + eps * eps).sqrt();
    // The conjugate form where d < 0 keeps the digits.
    let value = if d > 0.0 {
        0.5 * (d + r)
    } else {
        0.5 * eps * eps / (r - d)
    };
    [value, value / r, 0.5 * eps * eps / (r * r * r)]
}

fn scaled_edges(x: &[Point; 4], target: Target) -> [Point; 4] {
    EDGES
        .map(|[from, to]| [x[to][0] - x[from][0], x[to][1] - x[from][1]])
        .iter()
        .enumerate()
        .fold([[0.0; 2]; 4], |mut edges, (k, e)| {
            let length = target[usize::from(k >= 2)];
            edges[k] = [e[0] / length, e[1] / length];
            edges
        })
}

/// Determinant d at the four corners.
pub(super) fn determinants(x: &[Point; 4], target: Target) -> [f64; 4] {
    let e = scaled_edges(x, target);
    CORNERS.map(|[u, v]| e[u][0] * e[v][1] - e[u][1] * e[v][0])
}

/// Energy of a block; infinite where it is folded and `eps` is 0.
pub(super) fn value(x: &[Point; 4], target: Target, eps: f64) -> f64 {
    let e = scaled_edges(x, target);
    let mut sum = 0.0;
    for [u, v] in CORNERS {
        let (u, v) = (e[u], e[v]);
        let d = u[0] * v[1] - u[1] * v[0];
        let [c, _, _] = chi(d, eps);
        if c.is_nan() || c <= 0.0 {
            return f64::INFINITY;
        }
        let s = 0.5 * (u[0] * u[0] + u[1] * u[1] + v[0] * v[0] + v[1] * v[1]);
        sum += ((1.0 - SIZE_WEIGHT) * s + 0.5 * SIZE_WEIGHT * (d * d + 1.0)) / c;
    }
    sum
}

/// Gradient (2 components of 4 vertices) and Hessian of a block's energy; `convex` leaves out the terms that can make
/// the Hessian indefinite.
pub(super) fn derivatives(
    x: &[Point; 4],
    target: Target,
    eps: f64,
    convex: bool,
) -> ([f64; 8], [[f64; 8]; 8]) {
    let e = scaled_edges(x, target);
    let mut edge_gradient = [0.0; 8];
    let mut edge_hessian = [[0.0; 8]; 8];
    for [ku, kv] in CORNERS {
        let (u, v) = (e[ku], e[kv]);
        let d = u[0] * v[1] - u[1] * v[0];
        let s = 0.5 * (u[0] * u[0] + u[1] * u[1] + v[0] * v[0] + v[1] * v[1]);
        let [c, c1, c2] = chi(d, eps);
        let c2 = if convex { 0.0 } else { c2 };
        let (a, g) = (1.0 - SIZE_WEIGHT, SIZE_WEIGHT);
        let e_s = a / c;
        let e_d = -a * s * c1 / (c * c) + g * (d / c - 0.5 * (d * d + 1.0) * c1 / (c * c));
        let e_sd = -a * c1 / (c * c);
        let bend = c1 * c1 / (c * c * c);
        let e_dd = a * s * (2.0 * bend - c2 / (c * c))
            + g * (1.0 / c - 2.0 * d * c1 / (c * c) + (d * d + 1.0) * (bend - 0.5 * c2 / (c * c)));
        let ds = [u[0], u[1], v[0], v[1]];
        let dd = [v[1], -v[0], -u[1], u[0]];
        let slot = [2 * ku, 2 * ku + 1, 2 * kv, 2 * kv + 1];
        for p in 0..4 {
            edge_gradient[slot[p]] += e_s * ds[p] + e_d * dd[p];
            for q in 0..4 {
                edge_hessian[slot[p]][slot[q]] +=
                    e_sd * (ds[p] * dd[q] + dd[p] * ds[q]) + e_dd * dd[p] * dd[q];
            }
            edge_hessian[slot[p]][slot[p]] += e_s;
        }
        if !convex {
            for (p, q, sign) in [(0, 3, 1.0), (1, 2, -1.0)] {
                edge_hessian[slot[p]][slot[q]] += sign * e_d;
                edge_hessian[slot[q]][slot[p]] += sign * e_d;
            }
        }
    }
    let mut gradient = [0.0; 8];
    let mut hessian = [[0.0; 8]; 8];
    for k in 0..4 {
        let scale_k = 1.0 / target[usize::from(k >= 2)];
        for (vertex, sign) in [(EDGES[k][1], scale_k), (EDGES[k][0], -scale_k)] {
            for i in 0..2 {
                gradient[2 * vertex + i] += sign * edge_gradient[2 * k + i];
            }
        }
        for l in 0..4 {
            let scale = scale_k / target[usize::from(l >= 2)];
            for (vk, sk) in [(EDGES[k][1], scale), (EDGES[k][0], -scale)] {
                for (vl, sl) in [(EDGES[l][1], 1.0), (EDGES[l][0], -1.0)] {
                    for i in 0..2 {
                        for j in 0..2 {
                            hessian[2 * vk + i][2 * vl + j] +=
                                sk * sl * edge_hessian[2 * k + i][2 * l + j];
                        }
                    }
                }
            }
        }
    }
    (gradient, hessian)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn derivatives_agree_with_differences() {
        let x = [[0.0, 0.1], [2.1, -0.2], [1.7, 1.3], [0.3, 0.9]];
        let target = [1.5, 0.8];
        for eps in [0.0, 0.3] {
            let (g, h) = derivatives(&x, target, eps, false);
            let step = 1e-5;
            for p in 0..8 {
                let moved = |sign: f64| {
                    let mut y = x;
                    y[p / 2][p % 2] += sign * step;
                    y
                };
                let (plus, minus) = (moved(1.0), moved(-1.0));
                let dg = (value(&plus, target, eps) - value(&minus, target, eps)) / (2.0 * step);
                assert!(
                    (dg - g[p]).abs() < 1e-7 * (1.0 + g[p].abs()),
                    "{dg} {}",
                    g[p]
                );
                let gp = derivatives(&plus, target, eps, false).0;
                let gm = derivatives(&minus, target, eps, false).0;
                for q in 0..8 {
                    let dh = (gp[q] - gm[q]) / (2.0 * step);
                    assert!((dh - h[p][q]).abs() < 1e-6 * (1.0 + dh.abs()));
                }
            }
        }
    }
}
