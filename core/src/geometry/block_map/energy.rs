//! The energy of one block: how far its shape at each of its four corners is from its target rectangle.
//!
//! At a corner let u and v be the block's edge vectors along its row and its column, and U = u / w, V = v / h with the
//! target width w and height h. With s = (|U|^2 + |V|^2) / 2 and d = U x V,
//!
//! e = (1 - g) s / chi(d) + g (d^2 + 1) / (2 chi(d)),   chi(d) = (d + sqrt(d^2 + eps^2)) / 2,
//!
//! the regularised shape and size measures of foldover-free maps (Garanzha et al., ACM Trans. Graph. 40(4), 2021). With
//! eps = 0 it is a barrier: infinite where d <= 0. Both parts are polyconvex: convex in (U, V, d).
//!
//! The sum over the blocks would leave a few corners much sharper than they need be, so corners whose sine |d| / (|U| |V|)
//! is below s0 carry in addition, with r = |U| |V| / d,
//!
//! e_s = k (s0 r - 1)^4,
//!
//! twice continuously differentiable where it sets in, and independent of the targets.

use crate::geometry::Point;

/// Weight g of the size measure.
const SIZE_WEIGHT: f64 = 0.15;

/// Sine s0 of a corner angle below which the sliver measure acts, and its weight k.
const SLIVER_SINE: f64 = 0.3;
const SLIVER_WEIGHT: f64 = 0.3;

/// Which of the measures act.
#[derive(Clone, Copy, Debug)]
pub(super) enum Measure {
    /// Shape and size, regularised.
    Regular {
        /// Its eps, > 0.
        eps: f64,
    },
    /// Shape and size as a barrier.
    Barrier,
    /// Shape and size as a barrier, and slivers: the energy whose minimum is the map.
    Full,
}

impl Measure {
    fn eps(self) -> f64 {
        match self {
            Self::Regular { eps } => eps,
            Self::Barrier | Self::Full => 0.0,
        }
    }
}

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

/// q = (|U| |V| / d)^2, and value and two derivatives by q of the sliver measure; `None` where it does not act.
fn sliver(u: Point, v: Point, d: f64, measure: Measure) -> Option<(f64, [f64; 3])> {
    let q = (u[0] * u[0] + u[1] * u[1]) * (v[0] * v[0] + v[1] * v[1]) / (d * d);
    let r = q.sqrt();
    let excess = SLIVER_SINE * r - 1.0;
    if !matches!(measure, Measure::Full) || excess <= 0.0 {
        return None;
    }
    let (by_r, by_rr) = (
        4.0 * SLIVER_WEIGHT * SLIVER_SINE * excess.powi(3),
        12.0 * SLIVER_WEIGHT * SLIVER_SINE * SLIVER_SINE * excess * excess,
    );
    let value = SLIVER_WEIGHT * excess.powi(4);
    Some((q, [value, 0.5 * by_r / r, 0.25 * (by_rr - by_r / r) / q]))
}

/// Energy of a block; infinite where it is folded and the measure is a barrier.
pub(super) fn value(x: &[Point; 4], target: Target, measure: Measure) -> f64 {
    let eps = measure.eps();
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
        if let Some((_, [value, ..])) = sliver(u, v, d, measure) {
            sum += value;
        }
    }
    sum
}

/// Derivatives of a block's energy with respect to 2 components of 4 vertices. The Hessian is `convex` + `bent`, the first
/// positive semidefinite.
pub(super) struct Derivatives {
    pub(super) gradient: [f64; 8],
    pub(super) convex: [[f64; 8]; 8],
    pub(super) bent: [[f64; 8]; 8],
}

/// Gradient and Hessian of a block's energy.
pub(super) fn derivatives(x: &[Point; 4], target: Target, measure: Measure) -> Derivatives {
    let e = scaled_edges(x, target);
    let eps = measure.eps();
    let mut gradient = [0.0; 8];
    let (mut convex, mut bent) = ([[0.0; 8]; 8], [[0.0; 8]; 8]);
    for [ku, kv] in CORNERS {
        let (u, v) = (e[ku], e[kv]);
        let d = u[0] * v[1] - u[1] * v[0];
        let s = 0.5 * (u[0] * u[0] + u[1] * u[1] + v[0] * v[0] + v[1] * v[1]);
        let [c, c1, c2] = chi(d, eps);
        let (a, g) = (1.0 - SIZE_WEIGHT, SIZE_WEIGHT);
        let e_s = a / c;
        let e_d = -a * s * c1 / (c * c) + g * (d / c - 0.5 * (d * d + 1.0) * c1 / (c * c));
        let e_sd = -a * c1 / (c * c);
        let curl = c1 * c1 / (c * c * c);
        let e_dd =
            2.0 * a * s * curl + g * (1.0 / c - 2.0 * d * c1 / (c * c) + (d * d + 1.0) * curl);
        // From the bend of chi, which is negative only where eps > 0.
        let e_chi = -(a * s + 0.5 * g * (d * d + 1.0)) * c2 / (c * c);
        let ds = [u[0], u[1], v[0], v[1]];
        let dd = [v[1], -v[0], -u[1], u[0]];
        let slot = [2 * ku, 2 * ku + 1, 2 * kv, 2 * kv + 1];
        for p in 0..4 {
            gradient[slot[p]] += e_s * ds[p] + e_d * dd[p];
            for q in 0..4 {
                convex[slot[p]][slot[q]] +=
                    e_sd * (ds[p] * dd[q] + dd[p] * ds[q]) + e_dd * dd[p] * dd[q];
                bent[slot[p]][slot[q]] += e_chi * dd[p] * dd[q];
            }
            convex[slot[p]][slot[p]] += e_s;
        }
        // d is bilinear in U and V.
        let mut e_twist = e_d;
        if let Some((q, [_, by_q, by_qq])) = sliver(u, v, d, measure) {
            let (uu, vv) = (u[0] * u[0] + u[1] * u[1], v[0] * v[0] + v[1] * v[1]);
            let da = [2.0 * u[0], 2.0 * u[1], 0.0, 0.0];
            let db = [0.0, 0.0, 2.0 * v[0], 2.0 * v[1]];
            let by_d = -2.0 * q / d;
            let (i2, i3) = (1.0 / (d * d), 1.0 / (d * d * d));
            let dq: [f64; 4] =
                std::array::from_fn(|p| i2 * (vv * da[p] + uu * db[p]) + by_d * dd[p]);
            for p in 0..4 {
                gradient[slot[p]] += by_q * dq[p];
                for r in 0..4 {
                    let steep = 6.0 * q * i2 * dd[p] * dd[r];
                    let mixed = i2 * (da[p] * db[r] + db[p] * da[r])
                        - 2.0 * vv * i3 * (da[p] * dd[r] + dd[p] * da[r])
                        - 2.0 * uu * i3 * (db[p] * dd[r] + dd[p] * db[r]);
                    convex[slot[p]][slot[r]] += by_qq * dq[p] * dq[r] + by_q * steep;
                    bent[slot[p]][slot[r]] += by_q * mixed;
                }
                convex[slot[p]][slot[p]] += 2.0 * by_q * i2 * if p < 2 { vv } else { uu };
            }
            e_twist += by_q * by_d;
        }
        for (p, q, sign) in [(0, 3, 1.0), (1, 2, -1.0)] {
            bent[slot[p]][slot[q]] += sign * e_twist;
            bent[slot[q]][slot[p]] += sign * e_twist;
        }
    }
    let mut by_vertex = [0.0; 8];
    for k in 0..4 {
        let scale = 1.0 / target[usize::from(k >= 2)];
        for i in 0..2 {
            by_vertex[2 * EDGES[k][1] + i] += scale * gradient[2 * k + i];
            by_vertex[2 * EDGES[k][0] + i] -= scale * gradient[2 * k + i];
        }
    }
    Derivatives {
        gradient: by_vertex,
        convex: on_vertices(&convex, target),
        bent: on_vertices(&bent, target),
    }
}

/// A Hessian over the scaled edges as one over the vertices.
fn on_vertices(over_edges: &[[f64; 8]; 8], target: Target) -> [[f64; 8]; 8] {
    let mut hessian = [[0.0; 8]; 8];
    for k in 0..4 {
        for l in 0..4 {
            let scale = 1.0 / (target[usize::from(k >= 2)] * target[usize::from(l >= 2)]);
            for i in 0..2 {
                for j in 0..2 {
                    let h = scale * over_edges[2 * k + i][2 * l + j];
                    let ([k0, k1], [l0, l1]) = (EDGES[k], EDGES[l]);
                    hessian[2 * k1 + i][2 * l1 + j] += h;
                    hessian[2 * k0 + i][2 * l0 + j] += h;
                    hessian[2 * k1 + i][2 * l0 + j] -= h;
                    hessian[2 * k0 + i][2 * l1 + j] -= h;
                }
            }
        }
    }
    hessian
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn derivatives_agree_with_differences() {
        let plain = [[0.0, 0.1], [2.1, -0.2], [1.7, 1.3], [0.3, 0.9]];
        // Corner angles of 10 degrees and less: the sliver measure acts at all four.
        let sliver = [[0.0, 0.1], [3.1, 0.2], [6.7, 0.6], [3.3, 0.45]];
        let target = [1.5, 0.8];
        let cases = [
            (plain, Measure::Full),
            (sliver, Measure::Full),
            (sliver, Measure::Barrier),
            (plain, Measure::Regular { eps: 0.3 }),
        ];
        for (x, measure) in cases {
            let found = derivatives(&x, target, measure);
            let step = 1e-6;
            for p in 0..8 {
                let moved = |sign: f64| {
                    let mut y = x;
                    y[p / 2][p % 2] += sign * step;
                    y
                };
                let (plus, minus) = (moved(1.0), moved(-1.0));
                let dg =
                    (value(&plus, target, measure) - value(&minus, target, measure)) / (2.0 * step);
                let g = found.gradient[p];
                assert!((dg - g).abs() < 1e-6 * (1.0 + g.abs()), "{dg} {g}");
                let gp = derivatives(&plus, target, measure).gradient;
                let gm = derivatives(&minus, target, measure).gradient;
                for q in 0..8 {
                    let dh = (gp[q] - gm[q]) / (2.0 * step);
                    let h = found.convex[p][q] + found.bent[p][q];
                    assert!((dh - h).abs() < 1e-6 * (1.0 + dh.abs()), "{dh} {h}");
                }
            }
        }
    }

    #[test]
    fn the_sliver_measure_sets_in_smoothly() {
        // A corner whose sine passes 0.3: the Hessian's jump falls with the step.
        let at = |angle: f64| {
            let v = [angle.cos(), angle.sin()];
            [[0.0, 0.0], [1.0, 0.0], [1.0 + v[0], v[1]], v]
        };
        let jump = |step: f64| {
            let [a, b] = [-1.0, 1.0].map(|sign| {
                let x = at(SLIVER_SINE.asin() + sign * step);
                let d = derivatives(&x, [1.0, 1.0], Measure::Full);
                d.convex[4][4] + d.bent[4][4]
            });
            (a - b).abs()
        };
        assert!(jump(1e-6) < 1e-3 && jump(1e-6) < 0.2 * jump(1e-5));
    }
}
