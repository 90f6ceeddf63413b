//! The repulsion of two points of facing surfaces.
//!
//! Two points at a distance r with reference lengths l_i and l_j have the energy c l_i l_j w psi(s), s = (r / r_ij)^2,
//! psi(s) = (1 - s)^3 / s below s = 1 and 0 beyond: C^2 at the distance r_ij, without bound as the points meet. It is a
//! function of r^2, so no root and no nearest point enters, and it is smooth in both points.
//!
//! r_ij is the activation distance r0, or the share [`SHRUNK`] of the reference distance D of the two points where that is less
//! (with a smooth passage): only points that have come much nearer than they were drawn act on each other. So neither neighbours
//! along a surface nor the sides of a corner do at rest; towards a corner that folds shut r_ij falls in proportion to the distance
//! from it, and the sides keep an angle rather than a gap. The pressure at half of r_ij is the same everywhere. Where a
//! corner is nearer than a fraction of r0, w ends it: 0 where D is below [`CORNER`], 1 above [`CORNER_END`].
//!
//! Two flat surfaces at a distance d press on each other with p(d) = -4 c (d / r0) int_0 psi'((d / r0)^2 + t^2) dt; c is such
//! that p(r0 / 2) is a given pressure. As d falls p grows like c pi (r0 / d)^2.

/// psi and its first two derivatives; 0 < s < 1.
pub fn psi(s: f64) -> [f64; 3] {
    let (q, inverse) = (1.0 - s, 1.0 / s);
    let (q2, i2) = (q * q, inverse * inverse);
    let q3 = q2 * q;
    [
        q3 * inverse,
        -3.0 * q2 * inverse - q3 * i2,
        6.0 * q * inverse + 6.0 * q2 * i2 + 2.0 * q3 * i2 * inverse,
    ]
}

/// p(d) / c for two flat surfaces at d = `ratio` r0.
pub fn flat_pressure(ratio: f64) -> f64 {
    const INTERVALS: usize = 400;
    let end = (1.0 - ratio * ratio).max(0.0).sqrt();
    let value = |k: usize| {
        let t = end * k as f64 / INTERVALS as f64;
        let s = ratio * ratio + t * t;
        if s < 1.0 { psi(s)[1] } else { 0.0 }
    };
    let weight = |k: usize| match k {
        0 | INTERVALS => 1.0,
        k if k % 2 == 1 => 4.0,
        _ => 2.0,
    };
    let sum: f64 = (0..=INTERVALS).map(|k| weight(k) * value(k)).sum();
    -4.0 * ratio * sum * end / (3 * INTERVALS) as f64
}

/// Points act on each other where their distance is less than this share of that in the reference shape.
pub const SHRUNK: f64 = 0.2;
/// Reference distances over r0 below which points do not act, and above which they fully do.
pub const CORNER: f64 = 0.25;
const CORNER_END: f64 = 0.5;

/// (r_ij / r0)^2 and its derivative with respect to D^2, all in units of r0^2.
pub fn radius(d2: f64) -> (f64, f64) {
    // t / (1 + t^4)^(1/4): t for small t, 1 for large ones.
    let t = SHRUNK * SHRUNK * d2;
    let root = (1.0 + t.powi(4)).powf(-0.25);
    (t * root, SHRUNK * SHRUNK * root.powi(5))
}

/// w and its derivative with respect to D^2; D^2 in units of r0^2.
pub fn weight(d2: f64) -> (f64, f64) {
    let (from, to) = (CORNER * CORNER, CORNER_END * CORNER_END);
    let width = to - from;
    let t = ((d2 - from) / width).clamp(0.0, 1.0);
    let value = t * t * t * (10.0 + t * (-15.0 + 6.0 * t));
    let slope = 30.0 * t * t * (1.0 - t) * (1.0 - t) / width;
    (value, slope)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn derivatives_agree_with_differences() {
        for s in [0.01, 0.2, 0.7, 0.99] {
            let h = 1e-6 * s;
            let (a, b) = (psi(s - h), psi(s + h));
            for k in 0..2 {
                let difference = (b[k] - a[k]) / (2.0 * h);
                let exact = psi(s)[k + 1];
                assert!(
                    (difference - exact).abs() < 1e-6 * exact.abs().max(1e-3),
                    "{s} {k}"
                );
            }
        }
        for d2 in [0.05, 0.1, 0.2, 0.3, 3.0, 9.0, 11.0, 15.9, 200.0] {
            let h = 1e-6 * d2;
            for function in [weight, radius] {
                let difference = (function(d2 + h).0 - function(d2 - h).0) / (2.0 * h);
                assert!((difference - function(d2).1).abs() < 1e-7, "{d2}");
            }
        }
    }

    #[test]
    fn the_pressure_of_flat_surfaces_is_the_slope_of_their_energy() {
        // e(d) / (c r0) = 2 int_0 psi, by the midpoint rule.
        let energy = |ratio: f64| {
            let end = (1.0 - ratio * ratio).sqrt();
            let n = 40_000;
            let t = |k: usize| end * (k as f64 + 0.5) / n as f64;
            2.0 * (0..n)
                .map(|k| psi(ratio * ratio + t(k) * t(k))[0])
                .sum::<f64>()
                * end
                / n as f64
        };
        for ratio in [0.1, 0.5, 0.9] {
            let h = 1e-5;
            let slope = (energy(ratio - h) - energy(ratio + h)) / (2.0 * h);
            let p = flat_pressure(ratio);
            assert!((p - slope).abs() < 1e-4 * p, "{ratio}: {p} {slope}");
        }
        let steep = flat_pressure(0.02) * 0.02 * 0.02;
        assert!((steep / std::f64::consts::PI - 1.0).abs() < 0.03, "{steep}");
    }
}
