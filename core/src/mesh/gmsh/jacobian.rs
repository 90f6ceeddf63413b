//! Whether an element's map from its reference shape folds.

use crate::element::shape;
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
                sample(&shape::quad4(s, t).1);
            }
        }
        ElementKind::Quad9 => {
            for i in 0..SAMPLES {
                for k in 0..SAMPLES {
                    let s = 2.0 * i as f64 / last - 1.0;
                    let t = 2.0 * k as f64 / last - 1.0;
                    sample(&shape::quad9(s, t).1);
                }
            }
        }
        ElementKind::Tri7 => {
            for i in 0..SAMPLES {
                for k in 0..SAMPLES - i {
                    sample(&shape::tri7(i as f64 / last, k as f64 / last).1);
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
