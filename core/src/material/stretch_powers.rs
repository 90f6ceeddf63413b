//! l1^a + l2^a as a smooth function of s = l1^2 + l2^2 and J = l1 l2.
//!
//! With l1, l2 = J^(1/2) exp(+-theta/2) and c = s / (2 J) = cosh theta,
//!
//! l1^a + l2^a = 2 J^(a/2) T_n(c),   n = a/2,   T_n(cosh theta) = cosh(n theta),
//!
//! T_n the Chebyshev function of (any real) degree n. It is analytic at c = 1, where the stretches coalesce, although
//! theta is not: nothing but the arithmetic needs care there. With shc(z) = sinh(z) / z = 1 + z^2 h(z),
//!
//! T_n'  = n sinh(n theta) / sinh(theta) = n^2 shc(n theta) / shc(theta),
//! T_n'' = n (n cosh(n theta) sinh(theta) - sinh(n theta) cosh(theta)) / sinh(theta)^3
//!       = n (n^2 - 1) ((n + 1)^2 h((n + 1) theta) - (n - 1)^2 h((n - 1) theta)) / (2 shc(theta)^3),
//!
//! the last by the addition theorems. Of its two terms the first is at least (n + 1)^2 / (n - 1)^2 times the second (n > 0),
//! so that few digits cancel, and h is a power series below |z| = 1.

/// Angle of a pair of stretches, and what all degrees share.
#[derive(Clone, Copy, Debug)]
pub struct Angle {
    theta: f64,
    /// exp(theta).
    exp: f64,
    /// 1 / shc(theta).
    inverse_shc: f64,
}

/// T_n(c) and its first two derivatives by c.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Chebyshev {
    /// T_n.
    pub value: f64,
    /// T_n'.
    pub first: f64,
    /// T_n''.
    pub second: f64,
}

impl Angle {
    /// From c = s / (2 J); what round-off makes less than 1 is 1.
    pub fn new(c: f64) -> Self {
        let x = (c - 1.0).max(0.0);
        let sinh = (x * (x + 2.0)).sqrt();
        let theta = (x + sinh).ln_1p();
        Self {
            theta,
            exp: 1.0 + x + sinh,
            inverse_shc: if theta > 0.0 { theta / sinh } else { 1.0 },
        }
    }

    /// T_n for any real degree n.
    pub fn chebyshev(&self, n: f64) -> Chebyshev {
        let z = n * self.theta;
        let e = z.exp();
        let middle = remainder(z, e);
        let above = remainder(z + self.theta, e * self.exp);
        let below = remainder(z - self.theta, e / self.exp);
        let (up, down) = ((n + 1.0) * (n + 1.0), (n - 1.0) * (n - 1.0));
        let r = self.inverse_shc;
        Chebyshev {
            value: 0.5 * (e + e.recip()),
            first: n * n * (1.0 + z * z * middle) * r,
            second: 0.5 * n * (n * n - 1.0) * (up * above - down * below) * (r * r * r),
        }
    }
}

/// h(z) = (sinh(z) / z - 1) / z^2, with exp(z) given.
fn remainder(z: f64, exp: f64) -> f64 {
    let y = z * z;
    if y < 1.0 {
        // 1/3! + y/5! + y^2/7! + ...; the first term left out is below 1e-20.
        const TERMS: [f64; 9] = [
            1.0 / 6.0,
            1.0 / 120.0,
            1.0 / 5040.0,
            1.0 / 362_880.0,
            1.0 / 39_916_800.0,
            1.0 / 6_227_020_800.0,
            1.0 / 1_307_674_368_000.0,
            1.0 / 355_687_428_096_000.0,
            1.0 / 121_645_100_408_832_000.0,
        ];
        TERMS.iter().rev().fold(0.0, |sum, t| sum * y + t)
    } else {
        (0.5 * (exp - exp.recip()) / z - 1.0) / y
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// T_n, T_n', T_n'' rounded from arithmetic with 60 digits: cosh(n acosh c), its derivative, and the Chebyshev
    /// equation.
    const REFERENCE: &[(f64, f64, [f64; 3])] = &include!("stretch_powers/reference.in");

    #[test]
    fn values_are_those_of_arbitrary_precision_near_and_far_from_coalescence() {
        assert!(REFERENCE.len() > 60);
        for &(n, c, expected) in REFERENCE {
            let t = Angle::new(c).chebyshev(n);
            // The argument's own round-off is a relative error of T'' / T' (or T''' / T'') times eps c.
            let bound = 4e-14 * (1.0 + n * n);
            for (found, expected) in [t.value, t.first, t.second].into_iter().zip(expected) {
                assert!(
                    (found - expected).abs() <= bound * expected.abs().max(1e-300),
                    "n {n}, c {c}: {found:e} against {expected:e}"
                );
            }
        }
    }

    #[test]
    fn degrees_1_and_2_are_polynomials() {
        for c in [1.0, 1.0 + 1e-12, 1.001, 1.3, 7.0, 1e3] {
            let (one, two) = (Angle::new(c).chebyshev(1.0), Angle::new(c).chebyshev(2.0));
            assert!((one.value / c - 1.0).abs() < 1e-14 && (one.first - 1.0).abs() < 1e-14);
            assert_eq!(one.second, 0.0);
            assert!((two.value / (2.0 * c * c - 1.0) - 1.0).abs() < 1e-14);
            assert!((two.first / (4.0 * c) - 1.0).abs() < 1e-14);
            assert!((two.second - 4.0).abs() < 1e-13, "{c}: {}", two.second);
        }
    }

    #[test]
    fn the_limit_at_coalescence_is_that_of_the_chebyshev_equation() {
        for n in [-2.5, -1.0, 0.5, 0.65, 1.5, 6.0, 25.0] {
            let t = Angle::new(1.0).chebyshev(n);
            assert_eq!(t.value, 1.0);
            assert!((t.first - n * n).abs() <= 1e-15 * n * n);
            assert!((t.second - n * n * (n * n - 1.0) / 3.0).abs() <= 1e-14 * n.powi(4));
        }
    }

    #[test]
    fn a_ratio_that_round_off_puts_below_1_counts_as_1() {
        assert_eq!(
            Angle::new(1.0 - 1e-15).chebyshev(0.7),
            Angle::new(1.0).chebyshev(0.7)
        );
    }
}
