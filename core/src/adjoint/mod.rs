//! Derivatives with respect to node positions by the adjoint equation, at one accepted state of the path.
//!
//! For a functional J(u, X) at an equilibrium R(u, X) = 0 and the symmetric tangent K = dR/du,
//!
//! dJ/dX = dJ/dX|_u + lambda . dR/dX,   K lambda = -dJ/du.
//!
//! The factor of K is there already: it is that of the accepted state. A probe is fixed in space, so moving nodes by V
//! changes its interpolated displacement by -grad u V at the probe beside the change of u.

use crate::assembly::PointSensitivity;
use crate::equilibrium::AcceptedState;
use crate::objective::probe::ProbePoint;

/// A derivative with respect to all node positions.
pub type NodeGradient = Vec<[f64; 2]>;

/// d (u_x, u_y)(probe) / dX.
pub fn of_probe(accepted: &mut AcceptedState<'_>, probe: &ProbePoint) -> [NodeGradient; 2] {
    let system = accepted.system;
    let (n, nodes) = (system.dofs.free(), system.body.mesh.nodes.len());
    let mut rhs = vec![0.0; 2 * n];
    let mut field = vec![[0.0; 2]; nodes];
    for component in 0..2 {
        field.fill([0.0; 2]);
        for (node, weight) in probe.nodes.iter().zip(&probe.weight) {
            field[*node as usize][component] = -weight;
        }
        system
            .dofs
            .gather(&field, &mut rhs[component * n..(component + 1) * n]);
    }
    accepted.solver.solve(&mut rhs, 2);
    let h = probe.displacement_gradient(&accepted.state.u);
    std::array::from_fn(|component| {
        field.fill([0.0; 2]);
        system
            .dofs
            .add_to_field(1.0, &rhs[component * n..(component + 1) * n], &mut field);
        let mut out = vec![[0.0; 2]; nodes];
        system.add_shape_derivative(accepted.state, accepted.load, &field, &mut out);
        for (node, weight) in probe.nodes.iter().zip(&probe.weight) {
            for m in 0..2 {
                out[*node as usize][m] -= weight * h[component][m];
            }
        }
        out
    })
}

/// Derivative of a functional given by its sensitivities at the quadrature points.
pub fn of_points(
    accepted: &mut AcceptedState<'_>,
    sensitivities: &[PointSensitivity],
) -> NodeGradient {
    let system = accepted.system;
    let nodes = system.body.mesh.nodes.len();
    let (mut d_u, mut out) = (vec![[0.0; 2]; nodes], vec![[0.0; 2]; nodes]);
    system.sample_transpose(&accepted.state.u, sensitivities, &mut d_u, &mut out);
    d_u.iter_mut().flatten().for_each(|v| *v = -*v);
    let mut rhs = vec![0.0; system.dofs.free()];
    system.dofs.gather(&d_u, &mut rhs);
    accepted.solver.solve(&mut rhs, 1);
    d_u.fill([0.0; 2]);
    system.dofs.add_to_field(1.0, &rhs, &mut d_u);
    system.add_shape_derivative(accepted.state, accepted.load, &d_u, &mut out);
    out
}
