//! A probe: a point fixed in the reference shape, its displacement interpolated from its element.

use crate::element::shape;
use crate::mesh::{ElementKind, Mesh};

/// Interpolation at a point of the reference shape.
#[derive(Clone, Debug)]
pub struct ProbePoint {
    /// Nodes of the element that holds it.
    pub nodes: Vec<u32>,
    /// Shape functions there.
    pub weight: Vec<f64>,
    /// Their gradients in the reference shape, 1/mm.
    pub gradient: Vec<[f64; 2]>,
}

impl ProbePoint {
    /// At local coordinates of an element.
    pub fn new(mesh: &Mesh, block: usize, element: usize, local: [f64; 2]) -> Self {
        let block = &mesh.blocks[block];
        let count = block.kind.nodes();
        let nodes = block.nodes[element * count..(element + 1) * count].to_vec();
        let (weight, derivative): (Vec<f64>, Vec<[f64; 2]>) = match block.kind {
            ElementKind::Quad4 => {
                let (n, d) = shape::quad4(local[0], local[1]);
                (n.to_vec(), d.to_vec())
            }
            ElementKind::Quad9 => {
                let (n, d) = shape::quad9(local[0], local[1]);
                (n.to_vec(), d.to_vec())
            }
            ElementKind::Tri7 => {
                let (n, d) = shape::tri7(local[0], local[1]);
                (n.to_vec(), d.to_vec())
            }
        };
        let mut t = [[0.0; 2]; 2];
        for (node, d) in nodes.iter().zip(&derivative) {
            let x = mesh.nodes[*node as usize];
            for i in 0..2 {
                for k in 0..2 {
                    t[i][k] += x[i] * d[k];
                }
            }
        }
        let det = t[0][0] * t[1][1] - t[0][1] * t[1][0];
        let gradient = derivative
            .iter()
            .map(|d| {
                [
                    (t[1][1] * d[0] - t[1][0] * d[1]) / det,
                    (t[0][0] * d[1] - t[0][1] * d[0]) / det,
                ]
            })
            .collect();
        Self {
            nodes,
            weight,
            gradient,
        }
    }

    /// Its displacement, mm.
    pub fn displacement(&self, u: &[[f64; 2]]) -> [f64; 2] {
        let mut value = [0.0; 2];
        for (node, n) in self.nodes.iter().zip(&self.weight) {
            for i in 0..2 {
                value[i] += n * u[*node as usize][i];
            }
        }
        value
    }

    /// Displacement gradient there.
    pub fn displacement_gradient(&self, u: &[[f64; 2]]) -> [[f64; 2]; 2] {
        let mut h = [[0.0; 2]; 2];
        for (node, g) in self.nodes.iter().zip(&self.gradient) {
            for i in 0..2 {
                for k in 0..2 {
                    h[i][k] += u[*node as usize][i] * g[k];
                }
            }
        }
        h
    }
}
