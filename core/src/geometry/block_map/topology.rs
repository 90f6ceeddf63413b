//! Vertices, unknowns and blocks of the units that a map solves for.

use super::envelope::Envelope;
use crate::geometry::{Actuator, InfeasibleGeometry, MeshPlan, Point};

/// No such vertex or unknown.
pub(super) const NONE: u32 = u32::MAX;

/// A block: its vertices counter-clockwise from the lower left, and where it is.
#[derive(Clone, Copy, Debug)]
pub(super) struct Block {
    pub(super) vertices: [u32; 4],
    pub(super) unit: usize,
    pub(super) column: usize,
    pub(super) row: usize,
}

/// What does not change while vertices move.
#[derive(Clone, Debug)]
pub(super) struct Topology {
    /// Per solved unit: vertex by `row line * (columns + 1) + column line`; `NONE` inside a chamber.
    pub(super) grids: Vec<Vec<u32>>,
    /// Blocks of all solved units.
    pub(super) blocks: Vec<Block>,
    /// Unknown of each component of each vertex; `NONE` where prescribed.
    pub(super) unknowns: Vec<[u32; 2]>,
    /// Vertices of the rim of each chamber of each solved unit, in the order of the plan's stations.
    pub(super) rims: Vec<Vec<Vec<u32>>>,
    /// Lowest coupled unknown of each unknown.
    first: Vec<usize>,
}

impl Topology {
    pub(super) fn new(plan: &MeshPlan) -> Self {
        let repeated = plan.base.repeated;
        let lines_y = plan.rows.len() + 1;
        let mut vertices = 0;
        let mut grids: Vec<Vec<u32>> = vec![];
        let mut blocks = vec![];
        let mut rims = vec![];
        for (u, unit) in plan.units.iter().enumerate() {
            let lines_x = unit.columns.len() + 1;
            let mut grid = vec![NONE; lines_x * lines_y];
            let inside = |i: usize, j: usize| {
                unit.chambers
                    .iter()
                    .any(|c| c.columns[0] < i && i < c.columns[1] && c.rows[0] < j && j < c.rows[1])
            };
            for i in 0..lines_x {
                for j in 0..lines_y {
                    if u > 0 && i == 0 {
                        // The face is shared with the unit before.
                        let before = plan.units[u - 1].columns.len() + 1;
                        grid[j * lines_x] = grids[u - 1][j * before + before - 1];
                    } else if !inside(i, j) {
                        grid[j * lines_x + i] = vertices;
                        vertices += 1;
                    }
                }
            }
            for j in 0..lines_y - 1 {
                for i in 0..lines_x - 1 {
                    let open = unit.chambers.iter().any(|c| {
                        (c.columns[0]..c.columns[1]).contains(&i)
                            && (c.rows[0]..c.rows[1]).contains(&j)
                    });
                    if !open {
                        let at = |i: usize, j: usize| grid[j * lines_x + i];
                        blocks.push(Block {
                            vertices: [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)],
                            unit: u,
                            column: i,
                            row: j,
                        });
                    }
                }
            }
            rims.push(
                unit.chambers
                    .iter()
                    .map(|c| {
                        let ([i0, i1], [j0, j1]) = (c.columns, c.rows);
                        let bottom = (i0..i1).map(|i| (i, j0));
                        let right = (j0..j1).map(|j| (i1, j));
                        let top = (i0 + 1..=i1).rev().map(|i| (i, j1));
                        let left = (j0 + 1..=j1).rev().map(|j| (i0, j));
                        bottom
                            .chain(right)
                            .chain(top)
                            .chain(left)
                            .map(|(i, j)| grid[j * lines_x + i])
                            .collect()
                    })
                    .collect::<Vec<Vec<u32>>>(),
            );
            grids.push(grid);
        }
        let mut topology = Self {
            grids,
            blocks,
            unknowns: vec![[NONE; 2]; vertices as usize],
            rims,
            first: vec![],
        };
        topology.number_unknowns(plan, repeated);
        topology
    }

    /// Numbers the unknowns along the longer direction of the chain, so that the envelope stays narrow.
    fn number_unknowns(&mut self, plan: &MeshPlan, repeated: bool) {
        let lines_y = plan.rows.len() + 1;
        let mut on_rim = vec![false; self.unknowns.len()];
        for v in self.rims.iter().flatten().flatten() {
            on_rim[*v as usize] = true;
        }
        let mut order = vec![];
        for (u, unit) in plan.units.iter().enumerate() {
            let lines_x = unit.columns.len() + 1;
            if repeated {
                order.extend((0..lines_y).flat_map(|j| (0..lines_x).map(move |i| (u, i, j))));
            } else {
                order.extend((0..lines_x).flat_map(|i| (0..lines_y).map(move |j| (u, i, j))));
            }
        }
        let mut count = 0;
        let mut next = || {
            count += 1;
            count - 1
        };
        for (u, i, j) in order {
            let lines_x = plan.units[u].columns.len() + 1;
            let v = self.grids[u][j * lines_x + i];
            if v == NONE || on_rim[v as usize] || self.unknowns[v as usize] != [NONE; 2] {
                continue;
            }
            let on_face = i == 0 || i == lines_x - 1;
            let on_rail = j == 0 || j == lines_y - 1;
            self.unknowns[v as usize] = match (on_face, on_rail) {
                (true, true) => [NONE; 2],
                (true, false) if repeated && i > 0 => {
                    [NONE, self.unknowns[self.grids[u][j * lines_x] as usize][1]]
                }
                (true, false) => [NONE, next()],
                (false, true) => [next(), NONE],
                (false, false) => [next(), next()],
            };
        }
        self.first = (0..count as usize).collect();
        for block in &self.blocks {
            let all: Vec<usize> = self.unknowns_of(block).collect();
            let lowest = all.iter().copied().min().unwrap_or(0);
            for k in all {
                self.first[k] = self.first[k].min(lowest);
            }
        }
    }

    fn unknowns_of(&self, block: &Block) -> impl Iterator<Item = usize> + '_ {
        block
            .vertices
            .into_iter()
            .flat_map(|v| self.unknowns[v as usize])
            .filter(|k| *k != NONE)
            .map(|k| k as usize)
    }

    /// Number of unknowns.
    pub(super) fn size(&self) -> usize {
        self.first.len()
    }

    /// An empty matrix over the unknowns.
    pub(super) fn matrix(&self) -> Envelope {
        Envelope::new(self.first.clone())
    }

    /// Positions with everything prescribed in place, and the sliding and free vertices at the even spacing.
    pub(super) fn start(
        &self,
        plan: &MeshPlan,
        actuator: &Actuator,
    ) -> Result<Vec<Point>, InfeasibleGeometry> {
        let mismatch = |unit: usize| InfeasibleGeometry::UnsupportedLayout {
            unit,
            detail: "the design does not have the units, chambers and corners of the mesh plan"
                .into(),
        };
        if actuator.unit_mm != plan.base.unit_mm
            || actuator.units.len() != plan.base.units.len()
            || actuator.repeated != plan.base.repeated
        {
            return Err(mismatch(0));
        }
        let [width, height] = actuator.unit_mm;
        let mut positions = vec![[0.0; 2]; self.unknowns.len()];
        for (u, unit) in plan.units.iter().enumerate() {
            let lines_x = unit.columns.len() + 1;
            let x0 = u as f64 * width;
            for (k, v) in self.grids[u].iter().enumerate() {
                if *v != NONE {
                    positions[*v as usize] = [
                        x0 + width * (k % lines_x) as f64 / (lines_x - 1) as f64,
                        height * (k / lines_x) as f64 / plan.rows.len() as f64,
                    ];
                }
            }
            let (now, base) = (
                &actuator.units[u].chambers_mm,
                &plan.base.units[u].chambers_mm,
            );
            if now.len() != base.len() || now.iter().zip(base).any(|(a, b)| a.len() != b.len()) {
                return Err(mismatch(u));
            }
            for (c, (chamber, rim)) in unit.chambers.iter().zip(&self.rims[u]).enumerate() {
                let rounded = actuator.rounded(u, c);
                for (station, v) in chamber.ring.iter().zip(rim) {
                    let p = rounded.at(*station);
                    positions[*v as usize] = [x0 + p[0], p[1]];
                }
            }
        }
        Ok(positions)
    }

    /// Moves the vertices by a step in the unknowns.
    pub(super) fn moved(&self, positions: &[Point], step: &[f64], scale: f64) -> Vec<Point> {
        positions
            .iter()
            .zip(&self.unknowns)
            .map(|(p, unknowns)| {
                [0, 1].map(|c| match unknowns[c] {
                    NONE => p[c],
                    k => p[c] + scale * step[k as usize],
                })
            })
            .collect()
    }

    /// Adds a block's gradient and the lower triangle of its Hessian.
    pub(super) fn scatter(
        &self,
        block: &Block,
        gradient: &[f64; 8],
        hessian: &[[f64; 8]; 8],
        total: &mut [f64],
        matrix: &mut Envelope,
    ) {
        let slots: [u32; 8] =
            std::array::from_fn(|p| self.unknowns[block.vertices[p / 2] as usize][p % 2]);
        for p in 0..8 {
            if slots[p] == NONE {
                continue;
            }
            let i = slots[p] as usize;
            total[i] += gradient[p];
            for q in 0..8 {
                // Tied unknowns can meet in one block: then both (p, q) and (q, p) count on the diagonal.
                if slots[q] != NONE && slots[q] as usize <= i {
                    matrix.add(i, slots[q] as usize, hessian[p][q]);
                }
            }
        }
    }
}
