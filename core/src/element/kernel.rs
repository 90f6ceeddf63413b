//! Residual and tangent of four mixed elements at a time, the pressure condensed inside each.
//!
//! Energy of an element with pressure modes phi_a and amplitudes p_a:
//!
//! E = int W(s, J) dA + p . d - p' M p / (2 K),   d_a = int phi_a (J - 1) dA,   M_ab = int phi_a phi_b dA;
//!
//! stationarity in p gives p = K M^-1 d and the condensed residual and tangent
//!
//! r   = int P(F, p) : grad(du) dA,
//! K_t = int grad(du) : A(F, p_lin) : grad(du) dA + K B' M^-1 B,   B_a = int phi_a cof F : grad(du) dA.
//!
//! The pressure in the residual is p(u); the one in the linearisation, `p_lin`, is an unknown of its own that Newton's
//! step updates linearly. With p_lin = p(u) the tangent is the exact Hessian of the condensed energy.

#![expect(
    clippy::inline_always,
    reason = "compiled once per instruction set only where inlined into the caller that enables it"
)]

use super::shape::ShapeTable;
use crate::lane::Pack;
use crate::material::hyperelastic::{Isochoric, Parameters, isochoric};

/// Reference geometry of four elements.
#[derive(Clone, Debug)]
pub struct PackGeometry<const NN: usize, const NQ: usize, const NP: usize> {
    /// Gradients of the shape functions in the reference shape, 1/mm.
    pub g: [[[Pack; 2]; NN]; NQ],
    /// Weight times Jacobian, mm^2.
    pub w: [Pack; NQ],
    /// M^-1, 1/mm^2.
    pub mass_inverse: [[Pack; NP]; NP],
}

/// Kinematics at a quadrature point.
#[derive(Clone, Copy, Debug)]
pub struct Kinematics {
    /// Displacement gradient H, F = I + H.
    pub h: [[Pack; 2]; 2],
    /// Deformation gradient.
    pub f: [[Pack; 2]; 2],
    /// Its determinant.
    pub j: Pack,
}

/// cof A = d(det A)/dA.
#[inline(always)]
pub fn cofactor(a: &[[Pack; 2]; 2]) -> [[Pack; 2]; 2] {
    [[a[1][1], -a[1][0]], [-a[0][1], a[0][0]]]
}

/// A : B.
#[inline(always)]
pub fn contract(a: &[[Pack; 2]; 2], b: &[[Pack; 2]; 2]) -> Pack {
    a[0][0] * b[0][0] + a[0][1] * b[0][1] + a[1][0] * b[1][0] + a[1][1] * b[1][1]
}

/// Gradient of a nodal field.
#[inline(always)]
pub fn gradient<const FMA: bool, const NN: usize>(
    field: &[[Pack; 2]; NN],
    g: &[[Pack; 2]; NN],
) -> [[Pack; 2]; 2] {
    let mut h = [[Pack::ZERO; 2]; 2];
    for a in 0..NN {
        for i in 0..2 {
            for k in 0..2 {
                h[i][k] = field[a][i].fma::<FMA>(g[a][k], h[i][k]);
            }
        }
    }
    h
}

/// F and J from the displacement gradient. J - 1 is formed without cancellation.
#[inline(always)]
pub fn kinematics(h: [[Pack; 2]; 2]) -> (Kinematics, Pack) {
    let one = Pack::splat(1.0);
    let dilatation = h[0][0] + h[1][1] + (h[0][0] * h[1][1] - h[0][1] * h[1][0]);
    let f = [[h[0][0] + one, h[0][1]], [h[1][0], h[1][1] + one]];
    (
        Kinematics {
            h,
            f,
            j: dilatation + one,
        },
        dilatation,
    )
}

/// First Piola-Kirchhoff stress with pressure `p` for the volumetric part.
#[inline(always)]
pub fn stress(k: &Kinematics, w: &Isochoric, p: Pack) -> [[Pack; 2]; 2] {
    let c = cofactor(&k.f);
    let (a, b) = (w.s * 2.0, w.j + p);
    std::array::from_fn(|i| std::array::from_fn(|l| a * k.f[i][l] + b * c[i][l]))
}

impl<const NN: usize, const NQ: usize, const NP: usize> PackGeometry<NN, NQ, NP> {
    /// From the nodes of four elements; also the smallest Jacobian determinant over their quadrature points.
    pub fn new(table: &ShapeTable<NN, NQ, NP>, x: &[[Pack; 2]; NN]) -> (Box<Self>, f64) {
        let mut this = Box::new(Self {
            g: [[[Pack::ZERO; 2]; NN]; NQ],
            w: [Pack::ZERO; NQ],
            mass_inverse: [[Pack::ZERO; NP]; NP],
        });
        let mut least = f64::INFINITY;
        let mut mass = [[Pack::ZERO; NP]; NP];
        for q in 0..NQ {
            let mut t = [[Pack::ZERO; 2]; 2]; // t[i][k] = d X_i / d xi_k
            for a in 0..NN {
                for i in 0..2 {
                    for k in 0..2 {
                        t[i][k] += x[a][i] * table.dn[q][a][k];
                    }
                }
            }
            let det = t[0][0] * t[1][1] - t[0][1] * t[1][0];
            least = least.min(det.min_lane());
            let inv = det.recip();
            let ti = [
                [t[1][1] * inv, -(t[0][1] * inv)],
                [-(t[1][0] * inv), t[0][0] * inv],
            ];
            for a in 0..NN {
                for i in 0..2 {
                    this.g[q][a][i] = ti[0][i] * table.dn[q][a][0] + ti[1][i] * table.dn[q][a][1];
                }
            }
            this.w[q] = det * table.weight[q];
            for a in 0..NP {
                for b in 0..NP {
                    mass[a][b] += this.w[q] * (table.phi[q][a] * table.phi[q][b]);
                }
            }
        }
        this.mass_inverse = invert(mass);
        (this, least)
    }
}

/// Inverse of a small symmetric positive definite matrix, lane by lane (Gauss-Jordan without pivoting).
fn invert<const N: usize>(mut m: [[Pack; N]; N]) -> [[Pack; N]; N] {
    let mut inverse: [[Pack; N]; N] =
        std::array::from_fn(|i| std::array::from_fn(|j| Pack::splat(f64::from(u8::from(i == j)))));
    for k in 0..N {
        let pivot = m[k][k].recip();
        for j in 0..N {
            m[k][j] = m[k][j] * pivot;
            inverse[k][j] = inverse[k][j] * pivot;
        }
        for i in 0..N {
            if i != k {
                let factor = m[i][k];
                for j in 0..N {
                    m[i][j] = m[i][j] - factor * m[k][j];
                    inverse[i][j] = inverse[i][j] - factor * inverse[k][j];
                }
            }
        }
    }
    inverse
}

/// What one pass over four elements gives.
#[derive(Debug)]
pub struct ElementOutput<const NN: usize, const NP: usize> {
    /// Residual.
    pub r: [[Pack; 2]; NN],
    /// Lower blocks of the tangent: `k[a][b][i][j]` for b <= a.
    pub k: [[[[Pack; 2]; 2]; NN]; NN],
    /// Pressure amplitudes p(u).
    pub p: [Pack; NP],
    /// Smallest J per lane.
    pub least_j: Pack,
}

impl<const NN: usize, const NP: usize> ElementOutput<NN, NP> {
    /// All zero.
    pub fn new() -> Box<Self> {
        Box::new(Self {
            r: [[Pack::ZERO; 2]; NN],
            k: [[[[Pack::ZERO; 2]; 2]; NN]; NN],
            p: [Pack::ZERO; NP],
            least_j: Pack::splat(1.0),
        })
    }
}

/// Pressure amplitudes p = K M^-1 d(u), and the smallest J.
#[inline(always)]
pub fn pressure<const FMA: bool, const NN: usize, const NQ: usize, const NP: usize>(
    table: &ShapeTable<NN, NQ, NP>,
    geometry: &PackGeometry<NN, NQ, NP>,
    bulk: Pack,
    u: &[[Pack; 2]; NN],
) -> ([Pack; NP], Pack) {
    let mut d = [Pack::ZERO; NP];
    let mut least = Pack::splat(f64::INFINITY);
    for q in 0..NQ {
        let (k, dilatation) = kinematics(gradient::<FMA, NN>(u, &geometry.g[q]));
        least = Pack(std::array::from_fn(|l| least.0[l].min(k.j.0[l])));
        let v = geometry.w[q] * dilatation;
        for a in 0..NP {
            d[a] += v * table.phi[q][a];
        }
    }
    (scale_by_mass(geometry, bulk, &d), least)
}

/// K M^-1 d.
#[inline(always)]
pub fn scale_by_mass<const NN: usize, const NQ: usize, const NP: usize>(
    geometry: &PackGeometry<NN, NQ, NP>,
    bulk: Pack,
    d: &[Pack; NP],
) -> [Pack; NP] {
    std::array::from_fn(|a| {
        let mut sum = Pack::ZERO;
        for b in 0..NP {
            sum += geometry.mass_inverse[a][b] * d[b];
        }
        sum * bulk
    })
}

/// A field of the pressure modes at a quadrature point.
#[inline(always)]
pub fn interpolate<const NP: usize>(phi: &[f64; NP], p: &[Pack; NP]) -> Pack {
    let mut sum = Pack::ZERO;
    for a in 0..NP {
        sum += p[a] * phi[a];
    }
    sum
}

/// Residual, pressure and, if `TANGENT`, the tangent, of four elements with displacements `u`.
#[inline(always)]
pub fn assemble<
    const FMA: bool,
    const TANGENT: bool,
    const NN: usize,
    const NQ: usize,
    const NP: usize,
>(
    table: &ShapeTable<NN, NQ, NP>,
    geometry: &PackGeometry<NN, NQ, NP>,
    material: &Parameters,
    u: &[[Pack; 2]; NN],
    p_lin: Option<&[Pack; NP]>,
    out: &mut ElementOutput<NN, NP>,
) {
    let (p, least_j) = pressure::<FMA, NN, NQ, NP>(table, geometry, material.bulk, u);
    out.p = p;
    out.least_j = least_j;
    out.r = [[Pack::ZERO; 2]; NN];
    if least_j.min_lane() <= 0.0 {
        return;
    }
    let p_lin = p_lin.copied().unwrap_or(p);
    let mut b = [[[Pack::ZERO; 2]; NN]; NP];
    if TANGENT {
        for row in &mut out.k {
            *row = [[[Pack::ZERO; 2]; 2]; NN];
        }
    }
    for q in 0..NQ {
        let g = &geometry.g[q];
        let weight = geometry.w[q];
        let (k, _) = kinematics(gradient::<FMA, NN>(u, g));
        let s = contract(&k.f, &k.f);
        let w = isochoric(material, s, k.j);
        let cof = cofactor(&k.f);
        let ps = stress(&k, &w, interpolate(&table.phi[q], &p));
        let ps: [[Pack; 2]; 2] = ps.map(|row| row.map(|v| v * weight));
        for a in 0..NN {
            for i in 0..2 {
                out.r[a][i] =
                    ps[i][0].fma::<FMA>(g[a][0], ps[i][1].fma::<FMA>(g[a][1], out.r[a][i]));
            }
        }
        if !TANGENT {
            continue;
        }
        // Vectors f_a = F g_a and c_a = cof F g_a make every term of the tangent a product of two vectors.
        let mut f = [[Pack::ZERO; 2]; NN];
        let mut c = [[Pack::ZERO; 2]; NN];
        for a in 0..NN {
            for i in 0..2 {
                f[a][i] = k.f[i][0].fma::<FMA>(g[a][0], k.f[i][1] * g[a][1]);
                c[a][i] = cof[i][0].fma::<FMA>(g[a][0], cof[i][1] * g[a][1]);
            }
        }
        for m in 0..NP {
            let v = weight * table.phi[q][m];
            for a in 0..NN {
                for i in 0..2 {
                    b[m][a][i] = c[a][i].fma::<FMA>(v, b[m][a][i]);
                }
            }
        }
        let iso = w.s * 2.0 * weight;
        let skew = (w.j + interpolate(&table.phi[q], &p_lin)) * weight;
        let (ss, sj, jj) = (w.ss * 4.0 * weight, w.sj * 2.0 * weight, w.jj * weight);
        for l in 0..NN {
            let m: [Pack; 2] = std::array::from_fn(|i| ss.fma::<FMA>(f[l][i], sj * c[l][i]));
            let n: [Pack; 2] = std::array::from_fn(|i| sj.fma::<FMA>(f[l][i], jj * c[l][i]));
            let gi = [iso * g[l][0], iso * g[l][1]];
            let gs = [skew * g[l][0], skew * g[l][1]];
            for a in l..NN {
                let k = &mut out.k[a][l];
                let dot = g[a][0].fma::<FMA>(gi[0], g[a][1] * gi[1]);
                let h = g[a][0].fma::<FMA>(gs[1], -(g[a][1] * gs[0]));
                k[0][0] += f[a][0].fma::<FMA>(m[0], c[a][0].fma::<FMA>(n[0], dot));
                k[0][1] += f[a][0].fma::<FMA>(m[1], c[a][0].fma::<FMA>(n[1], h));
                k[1][0] += f[a][1].fma::<FMA>(m[0], c[a][1].fma::<FMA>(n[0], -h));
                k[1][1] += f[a][1].fma::<FMA>(m[1], c[a][1].fma::<FMA>(n[1], dot));
            }
        }
    }
    if TANGENT {
        for l in 0..NN {
            for j in 0..2 {
                let column: [Pack; NP] = std::array::from_fn(|m| b[m][l][j]);
                let scaled = scale_by_mass(geometry, material.bulk, &column);
                for a in l..NN {
                    for i in 0..2 {
                        for m in 0..NP {
                            out.k[a][l][i][j] = b[m][a][i].fma::<FMA>(scaled[m], out.k[a][l][i][j]);
                        }
                    }
                }
            }
        }
    }
}

/// The linear update of the independent pressure, K M^-1 (d(u) + B du), with B at the displacements `at`.
#[inline(always)]
pub fn linear_pressure<const FMA: bool, const NN: usize, const NQ: usize, const NP: usize>(
    table: &ShapeTable<NN, NQ, NP>,
    geometry: &PackGeometry<NN, NQ, NP>,
    bulk: Pack,
    u: &[[Pack; 2]; NN],
    at: &[[Pack; 2]; NN],
    du: &[[Pack; 2]; NN],
) -> [Pack; NP] {
    let mut d = [Pack::ZERO; NP];
    for q in 0..NQ {
        let (_, dilatation) = kinematics(gradient::<FMA, NN>(u, &geometry.g[q]));
        let (k, _) = kinematics(gradient::<FMA, NN>(at, &geometry.g[q]));
        let rate = contract(&cofactor(&k.f), &gradient::<FMA, NN>(du, &geometry.g[q]));
        let v = geometry.w[q] * (dilatation + rate);
        for a in 0..NP {
            d[a] += v * table.phi[q][a];
        }
    }
    scale_by_mass(geometry, bulk, &d)
}

/// What a step with B at the displacements `at` adds to the residual: (B_at - B(u))' (p(u) - p_lin), added to `out`.
#[inline(always)]
pub fn frozen_pressure<const FMA: bool, const NN: usize, const NQ: usize, const NP: usize>(
    table: &ShapeTable<NN, NQ, NP>,
    geometry: &PackGeometry<NN, NQ, NP>,
    bulk: Pack,
    u: &[[Pack; 2]; NN],
    at: &[[Pack; 2]; NN],
    p_lin: &[Pack; NP],
    out: &mut [[Pack; 2]; NN],
) {
    let (p, _) = pressure::<FMA, NN, NQ, NP>(table, geometry, bulk, u);
    let excess: [Pack; NP] = std::array::from_fn(|a| p[a] - p_lin[a]);
    let moved: [[Pack; 2]; NN] =
        std::array::from_fn(|a| std::array::from_fn(|i| at[a][i] - u[a][i]));
    for q in 0..NQ {
        let g = &geometry.g[q];
        // The cofactor is linear in the gradient.
        let cof = cofactor(&gradient::<FMA, NN>(&moved, g));
        let weight = geometry.w[q] * interpolate(&table.phi[q], &excess);
        let s = cof.map(|row| row.map(|v| v * weight));
        for a in 0..NN {
            for i in 0..2 {
                out[a][i] = s[i][0].fma::<FMA>(g[a][0], s[i][1].fma::<FMA>(g[a][1], out[a][i]));
            }
        }
    }
}

/// Derivative with respect to the node positions X of lambda . r(u, X), with u and lambda held: added to `out`.
///
/// With Lambda = grad lambda and q = K M^-1 B lambda (the adjoint of the condensed pressure), a perturbation V of the
/// node positions changes int h dA, h = P : Lambda + q (J - 1 - p / K), by int S : grad V dA with
/// S = -H' (A : Lambda + q cof F) - Lambda' P + h I.
#[inline(always)]
pub fn shape_derivative<const FMA: bool, const NN: usize, const NQ: usize, const NP: usize>(
    table: &ShapeTable<NN, NQ, NP>,
    geometry: &PackGeometry<NN, NQ, NP>,
    material: &Parameters,
    u: &[[Pack; 2]; NN],
    lambda: &[[Pack; 2]; NN],
    out: &mut [[Pack; 2]; NN],
) {
    let (p, _) = pressure::<FMA, NN, NQ, NP>(table, geometry, material.bulk, u);
    let mut rate = [Pack::ZERO; NP];
    for q in 0..NQ {
        let (k, _) = kinematics(gradient::<FMA, NN>(u, &geometry.g[q]));
        let l = gradient::<FMA, NN>(lambda, &geometry.g[q]);
        let v = geometry.w[q] * contract(&cofactor(&k.f), &l);
        for a in 0..NP {
            rate[a] += v * table.phi[q][a];
        }
    }
    let q_hat = scale_by_mass(geometry, material.bulk, &rate);
    let inverse_bulk = material.bulk.recip();
    for q in 0..NQ {
        let g = &geometry.g[q];
        let (k, dilatation) = kinematics(gradient::<FMA, NN>(u, g));
        let l = gradient::<FMA, NN>(lambda, g);
        let w = isochoric(material, contract(&k.f, &k.f), k.j);
        let (pq, qq) = (
            interpolate(&table.phi[q], &p),
            interpolate(&table.phi[q], &q_hat),
        );
        let ps = stress(&k, &w, pq);
        let (cof, cof_l) = (cofactor(&k.f), cofactor(&l));
        let (fl, cl) = (contract(&k.f, &l), contract(&cof, &l));
        let along_f = w.ss * 4.0 * fl + w.sj * 2.0 * cl;
        let along_c = w.sj * 2.0 * fl + w.jj * cl + qq;
        let t: [[Pack; 2]; 2] = std::array::from_fn(|i| {
            std::array::from_fn(|n| {
                w.s * 2.0 * l[i][n]
                    + along_f * k.f[i][n]
                    + along_c * cof[i][n]
                    + (w.j + pq) * cof_l[i][n]
            })
        });
        let h = contract(&ps, &l) + qq * (dilatation - pq * inverse_bulk);
        let weight = geometry.w[q];
        let s: [[Pack; 2]; 2] = std::array::from_fn(|m| {
            std::array::from_fn(|n| {
                let mut v = -(k.h[0][m] * t[0][n]
                    + k.h[1][m] * t[1][n]
                    + l[0][m] * ps[0][n]
                    + l[1][m] * ps[1][n]);
                if m == n {
                    v += h;
                }
                v * weight
            })
        });
        for a in 0..NN {
            for m in 0..2 {
                out[a][m] = s[m][0].fma::<FMA>(g[a][0], s[m][1].fma::<FMA>(g[a][1], out[a][m]));
            }
        }
    }
}
