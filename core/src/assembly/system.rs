//! The global system of one body: residual and tangent at a state under a load.

use super::block::{PointSample, PointSensitivity, Pressures};
use super::{BlockKernel, DofMap, Pattern};
use crate::force::self_contact::{ContactLaw, PRESSURE_OVER_MODULUS, SelfContact, Touches};
use crate::force::{cavity_pressure, traction};
use crate::linear::{AnalysisFailed, Coupling, Elements, Solver, nested_dissection};
use crate::material::MaterialLaw;
use crate::mesh::{Discretisation, Obstacle};

/// An element whose Jacobian is not positive in the reference shape.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("an element near {tag} of block {block} has a Jacobian that is not positive")]
pub struct FoldedReference {
    /// Block of elements.
    pub block: usize,
    /// Tag of the first element of its pack.
    pub tag: u32,
}

/// Displacements and the independent pressures of the linearisation.
#[derive(Clone, Debug)]
pub struct State {
    /// Nodal displacements, mm.
    pub u: Vec<[f64; 2]>,
    /// Independent pressures per block, MPa.
    pub p_lin: Vec<Pressures>,
}

/// Channel values: pressure in MPa, and the share of each channel's largest absolute value (for dead tractions and
/// prescribed displacements).
#[derive(Clone, Debug, PartialEq)]
pub struct Load {
    /// MPa.
    pub pressure: Vec<f64>,
    /// Dimensionless.
    pub share: Vec<f64>,
}

/// Result of an assembly.
#[derive(Clone, Copy, Debug)]
pub struct Assembled {
    /// Smallest J over the quadrature points; where it is not positive, or surfaces are crushed into each other, nothing
    /// else is valid.
    pub least_j: f64,
    /// Largest absolute free component of the residual, N/mm.
    pub residual: f64,
    /// Largest absolute component of external nodal forces and reactions, N/mm.
    pub force: f64,
}

/// A body with its unknowns, pattern and element blocks.
pub struct System {
    /// The body.
    pub body: Discretisation,
    /// Its unknowns.
    pub dofs: DofMap,
    /// Pattern of the tangent.
    pub pattern: Pattern,
    blocks: Vec<BlockKernel>,
    /// (slot, channel, d2V entry) of every cavity.
    cavity_entries: Vec<(u32, u32, f64)>,
    traction_forces: Vec<Vec<[f64; 2]>>,
    /// Reference area of the solid, mm^2.
    pub area: f64,
    /// The surfaces that may meet; `None` leaves contact out.
    pub contact: Option<SelfContact>,
}

/// Vectors of one assembly, allocated once.
pub struct Workspace {
    /// Internal minus external nodal forces.
    pub residual: Vec<[f64; 2]>,
    external: Vec<[f64; 2]>,
    position: Vec<[f64; 2]>,
    /// Values of the tangent's lower triangle.
    pub tangent: Vec<f64>,
    /// Whether contact acts: it is left out until surfaces come near.
    pub contact_acts: bool,
    /// The contact of the last assembly.
    pub touches: Touches,
    /// Its part of the tangent.
    couplings: Vec<Coupling>,
}

impl System {
    /// Prepares a body whose elements refer to `laws`.
    pub fn new(body: Discretisation, laws: &[MaterialLaw]) -> Result<Self, FoldedReference> {
        let dofs = DofMap::new(&body);
        let pattern = Pattern::new(&body, &dofs);
        let mut blocks: Vec<BlockKernel> = body
            .mesh
            .blocks
            .iter()
            .map(|b| BlockKernel::new(b, laws, &dofs, &pattern))
            .collect();
        for (index, block) in blocks.iter_mut().enumerate() {
            if let Some(element) = block.set_reference(&body.mesh.nodes) {
                return Err(FoldedReference {
                    block: index,
                    tag: body.mesh.blocks[index].tag[element],
                });
            }
        }
        let mut cavity_entries = Vec::new();
        for cavity in &body.cavities {
            cavity_pressure::hessian(cavity, |a, i, b, j, value| {
                let slot = pattern.slot(dofs.unknown(a, i), dofs.unknown(b, j));
                if slot != Pattern::NONE {
                    cavity_entries.push((slot, cavity.channel as u32, value));
                }
            });
        }
        let traction_forces = body
            .tractions
            .iter()
            .map(|t| {
                let mut force = vec![[0.0; 2]; body.mesh.nodes.len()];
                traction::add_force(t, &body.mesh.nodes, 1.0, &mut force);
                force
            })
            .collect();
        let zero = vec![[0.0; 2]; body.mesh.nodes.len()];
        let area = blocks.iter().map(|b| b.gradient_moment(&zero).0).sum();
        let this = Self {
            body,
            dofs,
            pattern,
            blocks,
            cavity_entries,
            traction_forces,
            area,
            contact: None,
        };
        Ok(this.with_contact(laws))
    }

    fn with_contact(mut self, laws: &[MaterialLaw]) -> Self {
        let modulus = laws
            .iter()
            .map(MaterialLaw::shear_modulus_mpa)
            .fold(f64::INFINITY, f64::min);
        self.contact = self.body.contact.map(|contact| {
            let law = ContactLaw {
                activation_mm: contact.activation_mm,
                pressure_mpa: PRESSURE_OVER_MODULUS * modulus,
            };
            let body = &self.body;
            let partners = body.partners.as_ref();
            let nodes = &body.mesh.nodes;
            SelfContact::new(law, &body.boundary, &body.obstacles, partners, nodes)
        });
        self
    }

    /// Analyses the tangent's pattern, ordered by nested dissection of the elements.
    pub fn solver(&self) -> Result<Solver, AnalysisFailed> {
        let order = self.elimination_order(&[]);
        Solver::new(&self.pattern.column_start, &self.pattern.row, &order)
    }

    /// Factorises the tangent of the last assembly; `false` if it is not positive definite. Where surfaces have come near
    /// that were not, the pattern is analysed anew first.
    pub fn factorise(&self, solver: &mut Solver, work: &Workspace) -> bool {
        self.take_couplings(solver, work);
        solver.factorise(&work.tangent)
    }

    /// Factorises a tangent of any inertia and counts its negative pivots.
    pub fn factorise_indefinite(&self, solver: &mut Solver, work: &Workspace) -> usize {
        self.take_couplings(solver, work);
        solver.factorise_indefinite(&work.tangent)
    }

    fn take_couplings(&self, solver: &mut Solver, work: &Workspace) {
        if !solver.covers(&work.couplings) && solver.failed_extension.is_none() {
            let nodes: Vec<Vec<u32>> = work
                .couplings
                .iter()
                .map(|c| c.nodes.iter().copied().flatten().collect())
                .collect();
            let (start, row) = (&self.pattern.column_start, &self.pattern.row);
            let order = self.elimination_order(&nodes);
            solver.extend(start, row, &work.couplings, &order);
        }
        solver.set_couplings(&work.couplings);
    }

    /// The order in which unknowns are eliminated: nested dissection of the elements, and of groups of nodes that couple.
    fn elimination_order(&self, groups: &[Vec<u32>]) -> Vec<u32> {
        let mesh = &self.body.mesh;
        let nodes: Vec<&[u32]> = mesh
            .blocks
            .iter()
            .flat_map(|b| b.nodes.chunks_exact(b.kind.nodes()))
            .chain(groups.iter().map(Vec::as_slice))
            .collect();
        let centroid = nodes
            .iter()
            .map(|element| {
                let share = 1.0 / element.len() as f64;
                element.iter().fold([0.0; 2], |c, &v| {
                    let x = mesh.nodes[v as usize];
                    [c[0] + share * x[0], c[1] + share * x[1]]
                })
            })
            .collect();
        nested_dissection(&Elements { nodes, centroid }, mesh.nodes.len())
            .iter()
            .flat_map(|&node| [self.dofs.unknown(node, 0), self.dofs.unknown(node, 1)])
            .filter(|&u| u != DofMap::FIXED)
            .collect()
    }

    /// The undeformed state.
    pub fn rest(&self) -> State {
        State {
            u: vec![[0.0; 2]; self.body.mesh.nodes.len()],
            p_lin: self
                .blocks
                .iter()
                .map(|b| vec![0.0; b.pressures()])
                .collect(),
        }
    }

    /// Vectors for [`Self::assemble`].
    pub fn workspace(&self) -> Workspace {
        let n = self.body.mesh.nodes.len();
        Workspace {
            residual: vec![[0.0; 2]; n],
            external: vec![[0.0; 2]; n],
            position: vec![[0.0; 2]; n],
            tangent: vec![0.0; self.pattern.row.len()],
            contact_acts: self.body.contact.is_some_and(|c| c.from_start),
            touches: Touches::default(),
            couplings: Vec::new(),
        }
    }

    /// Displacement of each obstacle under a load, mm.
    pub fn travel(&self, load: &Load) -> Vec<[f64; 2]> {
        let moved = |o: &Obstacle| {
            let share = load.share[o.channel];
            [share * o.travel_mm[0], share * o.travel_mm[1]]
        };
        self.body.obstacles.iter().map(moved).collect()
    }

    /// Whether surfaces of a state act on each other.
    pub fn is_touching(&self, state: &State, load: &Load) -> bool {
        self.contact
            .as_ref()
            .is_some_and(|c| c.is_touching(&self.position(state), &self.travel(load)))
    }

    /// The contact of a state.
    pub fn touches(&self, state: &State, load: &Load) -> Option<Touches> {
        let contact = self.contact.as_ref()?;
        Some(contact.touches(&self.position(state), &self.travel(load), false))
    }

    /// How far surfaces of a state have passed into each other, mm.
    pub fn penetration(&self, state: &State, load: &Load) -> f64 {
        self.contact.as_ref().map_or(0.0, |c| {
            c.penetration(&self.position(state), &self.travel(load))
        })
    }

    /// The share of an increment that brings no two surfaces through each other; the load was `before`.
    pub fn free_share(&self, state: &State, du: &[[f64; 2]], before: &Load, load: &Load) -> f64 {
        self.contact.as_ref().map_or(1.0, |c| {
            let travel = [self.travel(before), self.travel(load)];
            c.free_share(&self.position(state), du, [&travel[0], &travel[1]])
        })
    }

    /// Largest nodal external force at a load in the reference shape, N/mm.
    pub fn reference_force(&self, load: &Load) -> f64 {
        let mut external = vec![[0.0; 2]; self.body.mesh.nodes.len()];
        self.add_external(load, &self.body.mesh.nodes, &mut external);
        external
            .iter()
            .flatten()
            .fold(0.0, |m: f64, v| m.max(v.abs()))
    }

    fn add_pressures(&self, load: &Load, x: &[[f64; 2]], out: &mut [[f64; 2]]) {
        for cavity in &self.body.cavities {
            let p = load.pressure[cavity.channel];
            if p != 0.0 {
                cavity_pressure::add_gradient(cavity, x, p, out);
            }
        }
    }

    fn add_external(&self, load: &Load, x: &[[f64; 2]], out: &mut [[f64; 2]]) {
        self.add_pressures(load, x, out);
        for (t, force) in self.body.tractions.iter().zip(&self.traction_forces) {
            let share = load.share[t.channel];
            for (o, f) in out.iter_mut().zip(force) {
                o[0] += share * f[0];
                o[1] += share * f[1];
            }
        }
    }

    /// Residual and, if `tangent`, the tangent; with `refresh` the independent pressures become p(u) first.
    pub fn assemble(
        &self,
        state: &mut State,
        load: &Load,
        refresh: bool,
        tangent: bool,
        work: &mut Workspace,
    ) -> Assembled {
        work.residual.fill([0.0; 2]);
        work.external.fill([0.0; 2]);
        if tangent {
            work.tangent.fill(0.0);
        }
        let mut least_j = f64::INFINITY;
        for (block, p_lin) in self.blocks.iter().zip(&mut state.p_lin) {
            let values = tangent.then_some(work.tangent.as_mut_slice());
            least_j =
                least_j.min(block.assemble(&state.u, p_lin, refresh, &mut work.residual, values));
            if least_j <= 0.0 {
                return Assembled {
                    least_j,
                    residual: f64::INFINITY,
                    force: 0.0,
                };
            }
        }
        for ((x, reference), u) in work
            .position
            .iter_mut()
            .zip(&self.body.mesh.nodes)
            .zip(&state.u)
        {
            *x = [reference[0] + u[0], reference[1] + u[1]];
        }
        self.add_external(load, &work.position, &mut work.external);
        if let Some(contact) = self.contact.as_ref().filter(|_| work.contact_acts) {
            work.touches = contact.touches(&work.position, &self.travel(load), tangent);
            if work.touches.is_crushed() {
                return Assembled {
                    least_j: f64::NEG_INFINITY,
                    residual: f64::INFINITY,
                    force: 0.0,
                };
            }
            work.touches.add_gradient(contact, &mut work.residual);
            if tangent {
                work.couplings = work
                    .touches
                    .couplings(contact, |node, i| self.dofs.unknown(node, i));
            }
        }
        if tangent {
            for &(slot, channel, value) in &self.cavity_entries {
                work.tangent[slot as usize] -= load.pressure[channel as usize] * value;
            }
        }
        let (mut residual, mut force) = (0.0_f64, 0.0_f64);
        let components = self.dofs.components();
        for (node, (r, e)) in work.residual.iter_mut().zip(&work.external).enumerate() {
            for i in 0..2 {
                r[i] -= e[i];
                force = force.max(e[i].abs());
                if components[2 * node + i] == DofMap::FIXED {
                    force = force.max(r[i].abs());
                } else {
                    residual = residual.max(r[i].abs());
                }
            }
        }
        if residual.is_nan() {
            residual = f64::INFINITY;
        }
        Assembled {
            least_j,
            residual,
            force,
        }
    }

    /// Moves the state by `du` and the independent pressures by their linear update, that of the tangent at the
    /// displacements `at`, or at those of the state.
    pub fn advance(&self, state: &mut State, du: &[[f64; 2]], at: Option<&[[f64; 2]]>) {
        for (block, p_lin) in self.blocks.iter().zip(&mut state.p_lin) {
            block.update_pressure(&state.u, at.unwrap_or(&state.u), du, p_lin);
        }
        for (u, d) in state.u.iter_mut().zip(du) {
            u[0] += d[0];
            u[1] += d[1];
        }
    }

    /// Makes of the residual at a state what a step with the tangent at the displacements `at` solves for.
    ///
    /// Displacements and independent pressures are Newton's unknowns: with a tangent of elsewhere the step's residual is
    /// r(u, p_lin) + B_at' (p(u) - p_lin). Only with B of the state itself is that the residual R(u) = r(u, p(u)).
    pub fn freeze(&self, state: &State, at: &[[f64; 2]], residual: &mut [[f64; 2]]) {
        for (block, p_lin) in self.blocks.iter().zip(&state.p_lin) {
            block.add_frozen_pressure(&state.u, at, p_lin, residual);
        }
    }

    /// Adds the external forces of a load at the present positions.
    pub fn add_forces(&self, state: &State, load: &Load, out: &mut [[f64; 2]]) {
        self.add_external(load, &self.position(state), out);
    }

    /// Adds the forces of its pressures alone at the present positions.
    pub fn add_pressure_forces(&self, state: &State, load: &Load, out: &mut [[f64; 2]]) {
        self.add_pressures(load, &self.position(state), out);
    }

    /// The conjugate of a load: the sum of pressures times areas of cavities and of tractions times displacements, whose
    /// derivative with respect to displacements are the load's forces.
    pub fn conjugate(&self, state: &State, load: &Load) -> f64 {
        let x = self.position(state);
        let mut sum = 0.0;
        for cavity in &self.body.cavities {
            let p = load.pressure[cavity.channel];
            if p != 0.0 {
                sum += p * cavity_pressure::area(cavity, &x);
            }
        }
        for (t, force) in self.body.tractions.iter().zip(&self.traction_forces) {
            let share = load.share[t.channel];
            let work = |(f, u): (&[f64; 2], &[f64; 2])| f[0] * u[0] + f[1] * u[1];
            sum += share * force.iter().zip(&state.u).map(work).sum::<f64>();
        }
        sum
    }

    fn position(&self, state: &State) -> Vec<[f64; 2]> {
        let moved = |(x, u): (&[f64; 2], &[f64; 2])| [x[0] + u[0], x[1] + u[1]];
        self.body
            .mesh
            .nodes
            .iter()
            .zip(&state.u)
            .map(moved)
            .collect()
    }

    /// Size of a displacement increment: (mean over the worst hundredth of the area of |grad du|^8)^(1/8). A pointwise
    /// maximum would stall on fine meshes at re-entrant corners.
    pub fn gradient_size(&self, du: &[[f64; 2]]) -> f64 {
        let moment: f64 = self.blocks.iter().map(|b| b.gradient_moment(du).1).sum();
        (moment / (0.01 * self.area)).powf(0.125)
    }

    /// Adds d(lambda . R)/dX at a state under a load.
    pub fn add_shape_derivative(
        &self,
        state: &State,
        load: &Load,
        lambda: &[[f64; 2]],
        out: &mut [[f64; 2]],
    ) {
        for block in &self.blocks {
            block.add_shape_derivative(&state.u, lambda, out);
        }
        for cavity in &self.body.cavities {
            let p = load.pressure[cavity.channel];
            if p != 0.0 {
                cavity_pressure::add_hessian_product(cavity, lambda, -p, out);
            }
        }
        for t in &self.body.tractions {
            let share = load.share[t.channel];
            if share != 0.0 {
                traction::add_shape_derivative(t, &self.body.mesh.nodes, lambda, -share, out);
            }
        }
        if let Some(contact) = &self.contact {
            let x = self.position(state);
            contact.add_shape_derivative(&x, &self.travel(load), lambda, out);
        }
    }

    /// Visits every quadrature point in a fixed order.
    pub fn sample(&self, u: &[[f64; 2]], mut visit: impl FnMut(PointSample)) {
        let mut first = 0;
        for (kernel, block) in self.blocks.iter().zip(&self.body.mesh.blocks) {
            kernel.sample(&self.body.mesh.nodes, u, first, &mut visit);
            first += block.len();
        }
    }

    /// The transpose of [`Self::sample`]: derivatives with respect to u and X are added.
    pub fn sample_transpose(
        &self,
        u: &[[f64; 2]],
        sensitivities: &[PointSensitivity],
        d_u: &mut [[f64; 2]],
        d_x: &mut [[f64; 2]],
    ) {
        let mut iterator = sensitivities.iter();
        let mut next = || iterator.next().copied().unwrap_or_default();
        for block in &self.blocks {
            block.sample_transpose(u, &mut next, d_u, d_x);
        }
    }
}
