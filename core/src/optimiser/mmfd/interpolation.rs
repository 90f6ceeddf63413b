//! Polynomial predictions along the ray.

/// Where a function with value `f0` and slope `s0` at 0 (s0 < 0) has its minimum: a parabola through one more point, a
/// cubic through two. Infinite where the prediction falls for ever.
pub(super) fn minimum(f0: f64, s0: f64, (a1, f1): (f64, f64), second: Option<(f64, f64)>) -> f64 {
    if let Some((a2, f2)) = second
        && a2 > 0.0
        && a1 != a2
    {
        // f = f0 + s0 a + c a^2 + d a^3: two equations for (c, d).
        let r1 = (f1 - f0 - s0 * a1) / (a1 * a1);
        let r2 = (f2 - f0 - s0 * a2) / (a2 * a2);
        let d = (r1 - r2) / (a1 - a2);
        let c = r1 - d * a1;
        let discriminant = c * c - 3.0 * d * s0;
        if discriminant >= 0.0 {
            // The root with positive curvature, in the form without cancellation.
            let denominator = c + discriminant.sqrt();
            if denominator > 0.0 {
                return -s0 / denominator;
            }
        }
        if d != 0.0 || c <= 0.0 {
            return f64::INFINITY;
        }
    }
    let curvature = 2.0 * (f1 - f0 - s0 * a1) / (a1 * a1);
    if curvature > 0.0 {
        -s0 / curvature
    } else {
        f64::INFINITY
    }
}

/// The first step at which a function with value `g0` and slope `s0` at 0 and value `g1` at `a1` reaches `target` from
/// below, by a parabola. Infinite where it does not.
pub(super) fn crossing(g0: f64, s0: f64, a1: f64, g1: f64, target: f64) -> f64 {
    let below = target - g0;
    if below <= 0.0 {
        // Already there: only a rise counts, and then at once.
        return if g1 > g0 { 0.0 } else { f64::INFINITY };
    }
    let c = (g1 - g0 - s0 * a1) / (a1 * a1);
    // c a^2 + s0 a - below = 0
    let discriminant = s0 * s0 + 4.0 * c * below;
    if discriminant < 0.0 {
        return f64::INFINITY;
    }
    let denominator = s0 + discriminant.sqrt();
    if denominator > 0.0 {
        2.0 * below / denominator
    } else {
        f64::INFINITY
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn minima_and_crossings_of_polynomials_are_exact() {
        let parabola = |a: f64| 3.0 - 2.0 * a + 0.5 * a * a;
        assert!((minimum(3.0, -2.0, (1.0, parabola(1.0)), None) - 2.0).abs() < 1e-14);
        assert!(
            (minimum(3.0, -2.0, (1.0, parabola(1.0)), Some((5.0, parabola(5.0)))) - 2.0).abs()
                < 1e-12
        );
        let cubic = |a: f64| 1.0 - 3.0 * a + a * a * a;
        assert!(
            (minimum(1.0, -3.0, (0.5, cubic(0.5)), Some((2.0, cubic(2.0)))) - 1.0).abs() < 1e-12
        );
        assert_eq!(minimum(0.0, -1.0, (1.0, -1.5), None), f64::INFINITY);
        let g = |a: f64| -1.0 + 0.5 * a + 0.25 * a * a;
        let at = crossing(-1.0, 0.5, 3.0, g(3.0), 0.0);
        assert!(g(at).abs() < 1e-12 && at > 0.0);
        assert_eq!(crossing(-1.0, 0.1, 1.0, -1.5, 0.0), f64::INFINITY);
    }
}
