//! Unknowns: free displacement components.

use crate::mesh::Discretisation;

/// Number of a displacement component among the unknowns.
#[derive(Clone, Debug)]
pub struct DofMap {
    /// Unknown of (node, component) at `2 * node + component`; `FIXED` where prescribed.
    unknown: Vec<u32>,
    free: usize,
}

impl DofMap {
    /// Marks a prescribed component.
    pub const FIXED: u32 = u32::MAX;

    /// Numbers the free components node by node.
    pub fn new(body: &Discretisation) -> Self {
        let mut unknown = vec![0; 2 * body.mesh.nodes.len()];
        for s in &body.supports {
            unknown[2 * s.node as usize + s.component as usize] = Self::FIXED;
        }
        let mut free = 0;
        for u in &mut unknown {
            if *u != Self::FIXED {
                *u = free;
                free += 1;
            }
        }
        Self {
            unknown,
            free: free as usize,
        }
    }

    /// Number of unknowns.
    pub fn free(&self) -> usize {
        self.free
    }

    /// Unknown of a component of a node, or [`Self::FIXED`].
    #[inline]
    pub fn unknown(&self, node: u32, component: usize) -> u32 {
        self.unknown[2 * node as usize + component]
    }

    /// All components in node order.
    pub fn components(&self) -> &[u32] {
        &self.unknown
    }

    /// Adds `scale` times a vector of unknowns to a nodal field.
    pub fn add_to_field(&self, scale: f64, unknowns: &[f64], field: &mut [[f64; 2]]) {
        for (node, value) in field.iter_mut().enumerate() {
            for i in 0..2 {
                let u = self.unknown[2 * node + i];
                if u != Self::FIXED {
                    value[i] += scale * unknowns[u as usize];
                }
            }
        }
    }

    /// The free components of a nodal field.
    pub fn gather(&self, field: &[[f64; 2]], unknowns: &mut [f64]) {
        for (node, value) in field.iter().enumerate() {
            for i in 0..2 {
                let u = self.unknown[2 * node + i];
                if u != Self::FIXED {
                    unknowns[u as usize] = value[i];
                }
            }
        }
    }
}
