//! The area that the tip encloses (Eq. 3 of the paper), counter-clockwise positive.

use crate::geometry::polygon::signed_area_gradient;

/// A = 1/2 sum (y_i + y_{i+1}) (x_i - x_{i+1}) over the closed polygon, mm^2.
pub fn area(points: &[[f64; 2]]) -> f64 {
    let n = points.len();
    (0..n)
        .map(|i| {
            let (a, b) = (points[i], points[(i + 1) % n]);
            0.5 * (a[1] + b[1]) * (a[0] - b[0])
        })
        .sum()
}

/// dA / d point.
pub fn gradient(points: &[[f64; 2]]) -> Vec<[f64; 2]> {
    signed_area_gradient(points)
}

/// What the polygon of `steps` states a leg misses of a smooth path: through each three consecutive states of a leg a
/// parabola, whose area beyond the polygon is a third of their triangle; `None` with fewer than two states a leg.
pub fn sampling_error(points: &[[f64; 2]], steps: usize) -> Option<f64> {
    if steps < 2 {
        return None;
    }
    let mut sum = 0.0;
    for leg in points.windows(steps + 1).step_by(steps) {
        let triangles: f64 = leg
            .windows(3)
            .map(|p| {
                let (a, b) = (
                    [p[1][0] - p[0][0], p[1][1] - p[0][1]],
                    [p[2][0] - p[1][0], p[2][1] - p[1][1]],
                );
                0.5 * (a[0] * b[1] - a[1] * b[0])
            })
            .sum();
        // Each inner segment belongs to two triangles, each outer one to one.
        sum += triangles / 6.0 * steps as f64 / (steps - 1) as f64;
    }
    Some(sum.abs())
}

/// Whether the closed polygon crosses itself.
pub fn crosses_itself(points: &[[f64; 2]]) -> bool {
    let n = points.len();
    let side = |a: [f64; 2], b: [f64; 2], c: [f64; 2]| {
        (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
    };
    for i in 0..n {
        for j in i + 2..n {
            if i == 0 && j == n - 1 {
                continue;
            }
            let (a, b, c, d) = (
                points[i],
                points[(i + 1) % n],
                points[j],
                points[(j + 1) % n],
            );
            if side(a, b, c) * side(a, b, d) < 0.0 && side(c, d, a) * side(c, d, b) < 0.0 {
                return true;
            }
        }
    }
    false
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn unit_square_and_its_gradient() {
        let square = vec![[0., 0.], [1., 0.], [1., 1.], [0., 1.]];
        assert_eq!(area(&square), 1.0);
        let g = gradient(&square);
        for i in 0..4 {
            for k in 0..2 {
                let mut moved = square.clone();
                moved[i][k] += 0.25;
                assert!((area(&moved) - 1.0 - 0.25 * g[i][k]).abs() < 1e-15);
            }
        }
        assert!(!crosses_itself(&square));
        assert!(crosses_itself(&[[0., 0.], [1., 1.], [1., 0.], [0., 1.]]));
    }

    #[test]
    fn sampling_error_of_a_parabola_is_exact_to_its_interior() {
        // One leg along y = x (1 - x), one straight back: the area between is 1/6.
        let n = 8;
        let mut points: Vec<[f64; 2]> = (0..=n)
            .map(|k| k as f64 / n as f64)
            .map(|x| [x, x * (1. - x)])
            .collect();
        points.extend((1..=n).map(|k| [1.0 - k as f64 / n as f64, 0.0]));
        let missing = 1.0 / 6.0 - area(&points).abs();
        let estimate = sampling_error(&points, n).unwrap();
        assert!(
            (estimate / missing - 1.0).abs() < 1e-9,
            "{estimate} {missing}"
        );
    }

    #[test]
    fn a_retraced_path_encloses_nothing() {
        let mut points: Vec<[f64; 2]> = (0..9).map(f64::from).map(|t| [t, t * t]).collect();
        points.extend(points.clone().into_iter().rev().skip(1));
        assert!(area(&points).abs() < 1e-12);
    }
}
