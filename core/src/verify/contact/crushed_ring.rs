//! The thin ring between two plates: an inextensible elastica (Frisch-Fay, Flexible bars, 1962, chapter 3).
//!
//! ```text
//!   ____________          s along the centre line from the lower plate, theta its slope, q = P R^2 / EI.
//!    .-''''''-.           The section force is P/2 upright everywhere, so EI dk/ds = P/2 cos(theta) and
//!   (          )          k^2 = kc^2 + (P/EI) sin(theta), with kc the curvature where the ring leaves the plate.
//!    '-......-'           A quarter is R pi/2 long, and its height is h:
//!   ------------            point contact, kc > 0:  int dtheta/k = R pi/2,  h = int sin(theta)/k dtheta
//!                           kc = 0 from q = 2.786 on, h = 0.7178 R: a flat part grows, P = EI (1.19814 / h)^2
//! ```

use std::f64::consts::FRAC_PI_2;

const INTERVALS: usize = 4000;

/// Integral of (sin theta)^power (m + sin theta)^(-1/2) from 0 to pi/2, by Simpson's rule in the root of theta.
fn integral(power: i32, m: f64) -> f64 {
    let step = FRAC_PI_2.sqrt() / INTERVALS as f64;
    let value = |k: usize| {
        let root = step * k as f64;
        let sin = (root * root).sin();
        // sin / theta -> 1 at the start.
        if k == 0 {
            return if power == 0 && m == 0.0 { 2.0 } else { 0.0 };
        }
        2.0 * root * sin.powi(power) / (m + sin).sqrt()
    };
    let weight = |k: usize| match k {
        0 | INTERVALS => 1.0,
        k if k % 2 == 1 => 4.0,
        _ => 2.0,
    };
    (0..=INTERVALS).map(|k| weight(k) * value(k)).sum::<f64>() * step / 3.0
}

/// P R^2 / EI of the whole ring whose half height is `h` R; 0 < h <= 1.
pub fn force(h: f64) -> f64 {
    let flat = integral(1, 0.0);
    // sqrt(q) for the curvature kc^2 = m P / EI at the plate.
    let root = |m: f64| integral(0, m) / FRAC_PI_2;
    if h <= flat / root(0.0) {
        return (flat / h).powi(2);
    }
    // h rises with m.
    let (mut low, mut high) = (-30.0_f64, 30.0_f64);
    for _ in 0..80 {
        let middle = 0.5 * (low + high);
        let m = middle.exp();
        if integral(1, m) / root(m) < h {
            low = middle;
        } else {
            high = middle;
        }
    }
    root((0.5 * (low + high)).exp()).powi(2)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn small_and_flat_forces_are_those_of_the_books() {
        // Timoshenko: the diameter under two point loads falls by (pi/4 - 2/pi) P R^3 / EI.
        let closing = 1e-4;
        let compliance = FRAC_PI_2 / 2.0 - 1.0 / FRAC_PI_2;
        let linear = 2.0 * closing / compliance;
        assert!((force(1.0 - closing) / linear - 1.0).abs() < 1e-3);
        // The flat part begins: 4 K(1/2) (2 E(1/2) - K(1/2)) of complete elliptic integrals is in h, K^2 in q.
        let (k, e) = (1.854_074_677_301_372, 1.350_643_881_047_675_5);
        let (q, h) = (
            2.0 * k * k / FRAC_PI_2.powi(2),
            FRAC_PI_2 * (2.0 * e - k) / k,
        );
        assert!((force(h * (1.0 - 1e-9)) - q).abs() < 1e-6, "{q} {h}");
        assert!((force(h * (1.0 + 1e-6)) - q).abs() < 1e-3);
        assert!((force(0.25) - 4.0 * force(0.5)).abs() < 1e-9);
    }
}
