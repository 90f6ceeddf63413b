//! The sparsity pattern of the lower triangle, once per topology, in compressed columns.

use super::DofMap;
use crate::mesh::Discretisation;

/// Lower triangle (with diagonal) of the tangent in compressed columns, rows ascending.
#[derive(Clone, Debug)]
pub struct Pattern {
    /// Start of each column.
    pub column_start: Vec<u32>,
    /// Rows.
    pub row: Vec<u32>,
}

impl Pattern {
    /// Slot that stands for "not stored": a prescribed component or the upper triangle.
    pub const NONE: u32 = u32::MAX;

    /// From elements and cavity edges.
    pub fn new(body: &Discretisation, dofs: &DofMap) -> Self {
        let n = body.mesh.nodes.len();
        // Node adjacency first: it is a quarter of the size.
        let mut neighbours: Vec<Vec<u32>> = vec![Vec::new(); n];
        for block in &body.mesh.blocks {
            for element in block.nodes.chunks_exact(block.kind.nodes()) {
                for &a in element {
                    neighbours[a as usize].extend_from_slice(element);
                }
            }
        }
        for list in &mut neighbours {
            list.sort_unstable();
            list.dedup();
        }
        let mut column_start = vec![0_u32; dofs.free() + 1];
        let mut row = Vec::new();
        let mut column = 0;
        for node in 0..n as u32 {
            for component in 0..2 {
                let own = dofs.unknown(node, component);
                if own == DofMap::FIXED {
                    continue;
                }
                for &other in &neighbours[node as usize] {
                    for k in 0..2 {
                        let r = dofs.unknown(other, k);
                        if r != DofMap::FIXED && r >= own {
                            row.push(r);
                        }
                    }
                }
                column += 1;
                column_start[column] = row.len() as u32;
            }
        }
        Self { column_start, row }
    }

    /// Number of unknowns.
    pub fn size(&self) -> usize {
        self.column_start.len() - 1
    }

    /// Slot of the entry of two unknowns in the lower triangle, in either order.
    pub fn slot(&self, a: u32, b: u32) -> u32 {
        if a == DofMap::FIXED || b == DofMap::FIXED {
            return Self::NONE;
        }
        let (column, row) = (a.min(b) as usize, a.max(b));
        let start = self.column_start[column] as usize;
        let end = self.column_start[column + 1] as usize;
        self.row[start..end]
            .binary_search(&row)
            .map_or(Self::NONE, |k| (start + k) as u32)
    }

    /// Slot of each diagonal entry: the first of its column.
    pub fn diagonal(&self, column: usize) -> usize {
        self.column_start[column] as usize
    }
}
