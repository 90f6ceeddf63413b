//! Whether an element's map from its reference shape folds.

use crate::mesh::ElementKind;

/// Samples along a side of the reference shape, both ends included.
const SAMPLES: usize = 7;

/// The least sampled Jacobian of an element over its scale (the square of its largest corner distance from corner 0).
///
/// `Quad4`: exact, the Jacobian is linear and least at a corner. `Quad9` and `Tri7`: a regular grid of 49 and 28 points
/// with corners and sides; the bubble's node does not bend a triangle.
pub(super) fn least_jacobian(kind: ElementKind, at: &[[f64; 2]]) -> f64 {
    let last = (SAMPLES - 1) as f64;
    let mut least = f64::INFINITY;
    let mut sample = |derivatives: &[[f64; 2]]| {
        let mut j = [[0.0; 2]; 2];
        for (p, d) in at.iter().zip(derivatives) {
            for a in 0..2 {
                for b in 0..2 {
                    j[a][b] += p[a] * d[b];
                }
            }
        }
        least = f64::min(least, j[0][0] * j[1][1] - j[0][1] * j[1][0]);
    };
    match kind {
        ElementKind::Quad4 => {
            for [s, t] in [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]] {
                sample(&bilinear(s, t));
            }
        }
        ElementKind::Quad9 => {
            for i in 0..SAMPLES {
                for k in 0..SAMPLES {
                    let s = 2.0 * i as f64 / last - 1.0;
                    let t = 2.0 * k as f64 / last - 1.0;
                    sample(&biquadratic(s, t));
                }
            }
        }
        ElementKind::Tri7 => {
            for i in 0..SAMPLES {
                for k in 0..SAMPLES - i {
                    sample(&quadratic_triangle(i as f64 / last, k as f64 / last));
                }
            }
        }
    }
    let corners = if kind == ElementKind::Tri7 { 3 } else { 4 };
    let scale = at[1..corners]
        .iter()
        .map(|p| (p[0] - at[0][0]).powi(2) + (p[1] - at[0][1]).powi(2))
        .fold(0.0, f64::max);
    if scale > 0.0 { least / scale } else { 0.0 }
}

fn bilinear(s: f64, t: f64) -> [[f64; 2]; 4] {
    [
        [-(1.0 - t) / 4.0, -(1.0 - s) / 4.0],
        [(1.0 - t) / 4.0, -(1.0 + s) / 4.0],
        [(1.0 + t) / 4.0, (1.0 + s) / 4.0],
        [-(1.0 + t) / 4.0, (1.0 - s) / 4.0],
    ]
}

fn biquadratic(s: f64, t: f64) -> [[f64; 2]; 9] {
    // Per direction: the shape functions of -1, 0, 1 and their derivatives.
    let line = |s: f64| {
        (
            [s * (s - 1.0) / 2.0, 1.0 - s * s, s * (s + 1.0) / 2.0],
            [s - 0.5, -2.0 * s, s + 0.5],
        )
    };
    let ((ns, ds), (nt, dt)) = (line(s), line(t));
    let places = [
        [0, 0],
        [2, 0],
        [2, 2],
        [0, 2],
        [1, 0],
        [2, 1],
        [1, 2],
        [0, 1],
        [1, 1],
    ];
    places.map(|[i, k]| [ds[i] * nt[k], ns[i] * dt[k]])
}

fn quadratic_triangle(r: f64, s: f64) -> [[f64; 2]; 6] {
    let q = 1.0 - r - s;
    [
        [1.0 - 4.0 * q, 1.0 - 4.0 * q],
        [4.0 * r - 1.0, 0.0],
        [0.0, 4.0 * s - 1.0],
        [4.0 * (q - r), -4.0 * r],
        [4.0 * s, 4.0 * r],
        [-4.0 * s, 4.0 * (q - s)],
    ]
}
