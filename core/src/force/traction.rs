//! Dead tractions: force per reference length, R = -int N t dS, its derivative with respect to node positions beside it.

use super::edge;
use crate::mesh::Traction;

const GAUSS: [(f64, f64); 3] = [
    (-0.774_596_669_241_483_4, 5.0 / 9.0),
    (0.0, 8.0 / 9.0),
    (0.774_596_669_241_483_4, 5.0 / 9.0),
];

/// Adds `scale` times the nodal forces int N t dS in the reference shape `x`.
pub fn add_force(traction: &Traction, x: &[[f64; 2]], scale: f64, out: &mut [[f64; 2]]) {
    for e in &traction.edges {
        let (nodes, count) = edge::nodes(e);
        for (t, w) in GAUSS {
            let (n, d) = (edge::shape(t, count), edge::shape_derivative(t, count));
            let tangent: [f64; 2] =
                std::array::from_fn(|i| (0..count).map(|a| d[a] * x[nodes[a] as usize][i]).sum());
            let length = w * tangent[0].hypot(tangent[1]);
            for a in 0..count {
                for i in 0..2 {
                    out[nodes[a] as usize][i] += scale * length * n[a] * traction.mpa[i];
                }
            }
        }
    }
}

/// Adds the derivative of `scale` times lambda . int N t dS with respect to node positions.
pub fn add_shape_derivative(
    traction: &Traction,
    x: &[[f64; 2]],
    lambda: &[[f64; 2]],
    scale: f64,
    out: &mut [[f64; 2]],
) {
    for e in &traction.edges {
        let (nodes, count) = edge::nodes(e);
        for (t, w) in GAUSS {
            let (n, d) = (edge::shape(t, count), edge::shape_derivative(t, count));
            let tangent: [f64; 2] =
                std::array::from_fn(|i| (0..count).map(|a| d[a] * x[nodes[a] as usize][i]).sum());
            let length = tangent[0].hypot(tangent[1]);
            let work: f64 = (0..count)
                .map(|a| {
                    n[a] * (lambda[nodes[a] as usize][0] * traction.mpa[0]
                        + lambda[nodes[a] as usize][1] * traction.mpa[1])
                })
                .sum();
            for a in 0..count {
                for i in 0..2 {
                    out[nodes[a] as usize][i] += scale * w * work * d[a] * tangent[i] / length;
                }
            }
        }
    }
}
