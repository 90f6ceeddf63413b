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

use super::{HyperelasticModel, MaterialLaw};
use crate::lane::Pack;

/// Parameters of the polynomial family W = c1 (I1b - 3) + c2 (I1b - 3)^2 + c3 (I1b - 3)^3 + c01 (I2b - 3), which holds
/// neo-Hookean, Mooney-Rivlin and Yeoh laws, and the bulk modulus; MPa.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Parameters {
    /// Coefficients of the powers of I1b - 3.
    pub c: [Pack; 3],
    /// Coefficient of I2b - 3.
    pub c01: Pack,
    /// Bulk modulus K.
    pub bulk: Pack,
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
        };
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

/// Evaluates the isochoric energy at s = F:F and J = det F > 0.
#[inline(always)]
pub fn isochoric(m: &Parameters, s: Pack, j: Pack) -> Isochoric {
    let k = Pack::splat;
    let root = j.map(|j| 1.0 / j.cbrt()); // J^(-1/3)
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
    Isochoric {
        w: t * (m.c[0] + t * (m.c[1] + t * m.c[2])) + m.c01 * (y - k(3.0)),
        s: w1 * a + m.c01 * b,
        j: w1 * zj + m.c01 * yj,
        ss: w2 * a * a,
        sj: w2 * a * zj + w1 * zsj + m.c01 * ysj,
        jj: w2 * zj * zj + w1 * zjj + m.c01 * yjj,
    }
}
