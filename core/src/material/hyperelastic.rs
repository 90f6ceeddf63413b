//! Strain energy of the isochoric part and its derivatives.
//!
//! In plane strain (F33 = 1) both invariants of the 3-D deformation gradient depend on s = F:F of the in-plane part and
//! on J = det F alone: I1 = s + 1, I2 = s + J^2. So every isotropic law is a function W(s, J), and with cof F = dJ/dF
//!
//! P = 2 W_s F + W_J cof F,
//! A = 2 W_s I + 4 W_ss F(x)F + 2 W_sJ (F(x)cof F + cof F(x)F) + W_JJ cof F(x)cof F + W_J d(cof F)/dF.
//!
//! A mixed element adds its pressure p to W_J.

#![expect(
    clippy::inline_always,
    reason = "compiled once per instruction set only where inlined into the caller that enables it"
)]

use std::ops::Add;

use super::ogden::{MAX_TERMS, Ogden};
use super::stretch_powers::Angle;
use super::{HyperelasticModel, MaterialLaw};
use crate::lane::{LANES, Pack};

/// Parameters of the polynomial family W = c1 (I1b - 3) + c2 (I1b - 3)^2 + c3 (I1b - 3)^3 + c01 (I2b - 3), which holds
/// neo-Hookean, Mooney-Rivlin and Yeoh laws, those of Ogden laws, and the bulk modulus; MPa. A pack may hold laws of both
/// families: their energies are added, and where a lane has no part in one its coefficients are zero.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Parameters {
    /// Coefficients of the powers of I1b - 3.
    pub c: [Pack; 3],
    /// Coefficient of I2b - 3.
    pub c01: Pack,
    /// Ogden terms, where a lane has any.
    pub ogden: Option<Box<OgdenLanes>>,
    /// Bulk modulus K.
    pub bulk: Pack,
}

/// Ogden terms lane by lane.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct OgdenLanes {
    /// (c_p, a_p), MPa and 1.
    terms: [[(f64, f64); MAX_TERMS]; LANES],
    count: [usize; LANES],
}

impl OgdenLanes {
    fn set_lane(&mut self, lane: usize, law: &Ogden) {
        self.count[lane] = law.terms().len();
        for (slot, term) in self.terms[lane].iter_mut().zip(law.coefficients()) {
            *slot = term;
        }
    }
}

impl Parameters {
    /// Sets one lane.
    pub fn set_lane(&mut self, lane: usize, law: &MaterialLaw) {
        let (c, c01) = match law.model {
            HyperelasticModel::NeoHookean { c10_mpa } => ([c10_mpa, 0., 0.], 0.),
            HyperelasticModel::MooneyRivlin {
                c10_mpa,
                c01_mpa,
                c20_mpa,
            } => ([c10_mpa, c20_mpa, 0.], c01_mpa),
            HyperelasticModel::Yeoh { c_mpa } => (c_mpa, 0.),
            HyperelasticModel::Ogden(_) => ([0.; 3], 0.),
        };
        if let HyperelasticModel::Ogden(ogden) = &law.model {
            self.ogden.get_or_insert_default().set_lane(lane, ogden);
        }
        for i in 0..3 {
            self.c[i].0[lane] = c[i];
        }
        self.c01.0[lane] = c01;
        self.bulk.0[lane] = law.bulk_modulus_mpa();
    }
}

/// W and its first and second derivatives with respect to (s, J), MPa.
#[derive(Clone, Copy, Debug)]
pub struct Isochoric {
    /// W.
    pub w: Pack,
    /// dW/ds.
    pub s: Pack,
    /// dW/dJ.
    pub j: Pack,
    /// d2W/ds2.
    pub ss: Pack,
    /// d2W/ds dJ.
    pub sj: Pack,
    /// d2W/dJ2.
    pub jj: Pack,
}

/// J^(-1/3). A call of the library's root for each lane took 4 % of an analysis; rubber keeps J near 1, where a polynomial and two
/// of Newton's steps do.
#[inline(always)]
fn inverse_cube_root(j: Pack) -> Pack {
    const NEAR: f64 = 0.125;
    let k = Pack::splat;
    let d = j - k(1.0);
    if !d.0.iter().all(|d| d.abs() < NEAR) {
        return j.map(|j| 1.0 / j.cbrt());
    }
    // Relative errors: 35/243 d^4 < 4e-5, 3e-9, below rounding.
    let mut y = k(1.0) + d * (k(-1.0 / 3.0) + d * (k(2.0 / 9.0) - d * (14.0 / 81.0)));
    for _ in 0..2 {
        y = y * (k(4.0) - j * y * y * y) * (1.0 / 3.0);
    }
    y
}

/// Evaluates the isochoric energy at s = F:F and J = det F > 0.
#[inline(always)]
pub fn isochoric(m: &Parameters, s: Pack, j: Pack) -> Isochoric {
    let k = Pack::splat;
    let root = inverse_cube_root(j);
    let inv = root * root * root;
    let a = root * root; // J^(-2/3)
    let z = a * (s + k(1.0));
    let t = z - k(3.0);
    let w1 = m.c[0] + t * (m.c[1] * 2.0 + t * m.c[2] * 3.0);
    let w2 = m.c[1] * 2.0 + t * m.c[2] * 6.0;
    let zj = z * inv * (-2.0 / 3.0);
    let zsj = a * inv * (-2.0 / 3.0);
    let zjj = z * inv * inv * (10.0 / 9.0);
    let b = a * a; // J^(-4/3)
    let j23 = b * j * j; // J^(2/3)
    let y = s * b + j23;
    let yj = s * b * inv * (-4.0 / 3.0) + j23 * inv * (2.0 / 3.0);
    let ysj = b * inv * (-4.0 / 3.0);
    let yjj = s * b * inv * inv * (28.0 / 9.0) - j23 * inv * inv * (2.0 / 9.0);
    let polynomial = Isochoric {
        w: t * (m.c[0] + t * (m.c[1] + t * m.c[2])) + m.c01 * (y - k(3.0)),
        s: w1 * a + m.c01 * b,
        j: w1 * zj + m.c01 * yj,
        ss: w2 * a * a,
        sj: w2 * a * zj + w1 * zsj + m.c01 * ysj,
        jj: w2 * zj * zj + w1 * zjj + m.c01 * yjj,
    };
    match &m.ogden {
        None => polynomial,
        Some(terms) => polynomial + ogden(terms, s, j),
    }
}

impl Add for Isochoric {
    type Output = Self;
    #[inline(always)]
    fn add(self, b: Self) -> Self {
        Self {
            w: self.w + b.w,
            s: self.s + b.s,
            j: self.j + b.j,
            ss: self.ss + b.ss,
            sj: self.sj + b.sj,
            jj: self.jj + b.jj,
        }
    }
}

/// W = sum_p c_p (2 J^(a/6) T_(a/2)(c) + J^(-a/3) - 3), c = s / (2 J): the isochoric stretches are J^(-1/3) times l1, l2
/// and 1. Kept out of the kernels, whose registers the other laws need.
#[inline(never)]
fn ogden(lanes: &OgdenLanes, s: Pack, j: Pack) -> Isochoric {
    let zero = Pack::ZERO;
    let mut out = Isochoric {
        w: zero,
        s: zero,
        j: zero,
        ss: zero,
        sj: zero,
        jj: zero,
    };
    for lane in 0..LANES {
        let terms = &lanes.terms[lane][..lanes.count[lane]];
        if terms.is_empty() {
            continue;
        }
        let inverse = 1.0 / j.0[lane];
        let c = 0.5 * s.0[lane] * inverse;
        let (angle, log) = (Angle::new(c), j.0[lane].ln());
        for &(factor, alpha) in terms {
            let t = angle.chebyshev(0.5 * alpha);
            let (a, b) = (alpha / 6.0, -alpha / 3.0);
            let q = 2.0 * factor * (a * log).exp(); // 2 c_p J^(a/6)
            let r = factor * (b * log).exp(); // c_p J^(-a/3)
            // Derivatives of c: by s 1/(2 J), by J -c/J, mixed -1/(2 J^2), by J twice 2 c/J^2.
            let second = inverse * inverse;
            let (slope, curved) = (q * t.first, q * t.second);
            out.w.0[lane] += q * t.value + r - 3.0 * factor;
            out.s.0[lane] += 0.5 * inverse * slope;
            out.j.0[lane] += inverse * (a * q * t.value - c * slope + b * r);
            out.ss.0[lane] += 0.25 * second * curved;
            out.sj.0[lane] += 0.5 * second * ((a - 1.0) * slope - c * curved);
            out.jj.0[lane] += second
                * (a * (a - 1.0) * q * t.value
                    + (2.0 - 2.0 * a) * c * slope
                    + c * c * curved
                    + b * (b - 1.0) * r);
        }
    }
    out
}

#[cfg(test)]
mod tests;
