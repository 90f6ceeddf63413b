//! Derivatives with respect to node positions by the adjoint equation, at one accepted state of the path.
//!
//! For a functional J(u, X) at an equilibrium R(u, X) = 0 and the symmetric tangent K = dR/du,
//!
//! dJ/dX = dJ/dX|_u + lambda . dR/dX,   K lambda = -dJ/du.
//!
//! The factor of K is there: it is that of the accepted state, on which a visitor with adjoints insists. A probe is fixed in space, so moving nodes by V
//! changes its interpolated displacement by -grad u V at the probe beside the change of u.

use crate::assembly::PointSensitivity;
use crate::equilibrium::{AcceptedState, LimitPoint};
use crate::force::cavity_pressure;
use crate::objective::probe::ProbePoint;

/// A derivative with respect to all node positions.
pub type NodeGradient = Vec<[f64; 2]>;

/// A functional's derivatives with respect to nodal displacements and, at fixed displacements, to nodal positions.
pub struct Functional {
    /// dJ/du.
    pub u: NodeGradient,
    /// dJ/dX at fixed u.
    pub x: NodeGradient,
}

impl Functional {
    /// A functional given by its sensitivities at the quadrature points.
    pub fn of_points(accepted: &AcceptedState<'_>, sensitivities: &[PointSensitivity]) -> Self {
        let system = accepted.system;
        let nodes = system.body.mesh.nodes.len();
        let (mut u, mut x) = (vec![[0.0; 2]; nodes], vec![[0.0; 2]; nodes]);
        system.sample_transpose(&accepted.state.u, sensitivities, &mut u, &mut x);
        Self { u, x }
    }

    /// A displacement component of a probe.
    pub fn of_probe(accepted: &AcceptedState<'_>, probe: &ProbePoint, component: usize) -> Self {
        let nodes = accepted.system.body.mesh.nodes.len();
        let (mut u, mut x) = (vec![[0.0; 2]; nodes], vec![[0.0; 2]; nodes]);
        let h = probe.displacement_gradient(&accepted.state.u);
        for (node, weight) in probe.nodes.iter().zip(&probe.weight) {
            u[*node as usize][component] += weight;
            for m in 0..2 {
                x[*node as usize][m] -= weight * h[component][m];
            }
        }
        Self { u, x }
    }

    /// The deformed area of a channel's chambers, a function of X + u.
    pub fn of_chamber_area(accepted: &AcceptedState<'_>, channel: usize) -> Self {
        let body = &accepted.system.body;
        let mut u = vec![[0.0; 2]; body.mesh.nodes.len()];
        let deformed = deformed(&body.mesh.nodes, &accepted.state.u);
        for cavity in body.cavities.iter().filter(|c| c.channel == channel) {
            cavity_pressure::add_gradient(cavity, &deformed, 1.0, &mut u);
        }
        let x = u.clone();
        Self { u, x }
    }
}

/// Deformed node positions, mm.
pub fn deformed(x: &[[f64; 2]], u: &[[f64; 2]]) -> Vec<[f64; 2]> {
    x.iter()
        .zip(u)
        .map(|(x, u)| [x[0] + u[0], x[1] + u[1]])
        .collect()
}

/// Derivatives of a functional at an accepted state.
pub struct Derivative {
    /// dJ/dX.
    pub nodes: NodeGradient,
    /// dJ/d ln p: by the logarithm of a factor on all pressures of the schedule.
    pub pressure: f64,
}

/// Derivatives of several functionals, solved together. A factor s on the pressures p changes the residual by
/// dR/d ln s = -sum p_i dV_i/du, so that dJ/d ln s = -lambda . sum p_i dV_i/du at fixed explicit terms, of which J has none.
pub fn of_functionals(
    accepted: &mut AcceptedState<'_>,
    functionals: Vec<Functional>,
) -> Vec<Derivative> {
    let system = accepted.system;
    let n = system.dofs.free();
    let mut rhs = vec![0.0; n * functionals.len()];
    for (functional, part) in functionals.iter().zip(rhs.chunks_mut(n)) {
        system.dofs.gather(&functional.u, part);
        for v in part {
            *v = -*v;
        }
    }
    if !functionals.is_empty() {
        accepted.solver.solve(&mut rhs, functionals.len());
    }
    let nodes = system.body.mesh.nodes.len();
    let mut forces = vec![[0.0; 2]; nodes];
    system.add_pressure_forces(accepted.state, accepted.load, &mut forces);
    let mut field = vec![[0.0; 2]; nodes];
    functionals
        .into_iter()
        .zip(rhs.chunks(n))
        .map(|(functional, part)| {
            field.fill([0.0; 2]);
            system.dofs.add_to_field(1.0, part, &mut field);
            let mut out = functional.x;
            system.add_shape_derivative(accepted.state, accepted.load, &field, &mut out);
            let work = |(l, f): (&[f64; 2], &[f64; 2])| l[0] * f[0] + l[1] * f[1];
            Derivative {
                nodes: out,
                pressure: -field.iter().zip(&forces).map(work).sum::<f64>(),
            }
        })
        .collect()
}

/// d fraction / dX of a limit point: with K psi = 0, R(u, l, X) = 0 and f = -dR/dl, it is psi . dR/dX / (psi . f), in
/// fractions of the schedule's leg.
pub fn of_limit_point(point: &LimitPoint<'_>) -> NodeGradient {
    let system = point.system;
    let nodes = system.body.mesh.nodes.len();
    let mut forces = vec![[0.0; 2]; nodes];
    system.add_forces(point.state, point.rate, &mut forces);
    let work = |(f, m): (&[f64; 2], &[f64; 2])| f[0] * m[0] + f[1] * m[1];
    let scale = point.span / forces.iter().zip(point.mode).map(work).sum::<f64>();
    let mut out = vec![[0.0; 2]; nodes];
    system.add_shape_derivative(point.state, point.load, point.mode, &mut out);
    out.iter_mut().flatten().for_each(|g| *g *= scale);
    out
}
