//! The boundary of a solid: its directed edges, its loops, and chains of some of its edges.

use std::collections::HashMap;
use std::f64::consts::TAU;

use super::error::GmshError;
use super::solid::{Solid, edge_key};
use crate::mesh::{BoundaryEdge, BoundaryLoop, ElementKind};

/// A turn of the boundary by more than this is a corner of the shape; a circle in 24 straight edges turns by less.
const CORNER_TURN: f64 = 20.0 * std::f64::consts::PI / 180.0;

/// The boundary edges with the solid on their left.
pub(super) struct Boundary {
    pub edges: Vec<BoundaryEdge>,
    /// Index of each edge by its ends, lower node first.
    pub index: HashMap<[u32; 2], usize>,
    /// The edge that follows each edge along the boundary.
    next: Vec<usize>,
}

/// Some edges in order.
pub(super) struct Chain {
    /// Indices into [`Boundary::edges`].
    pub edges: Vec<usize>,
    /// Whether the last edge ends where the first starts.
    pub closed: bool,
}

impl Boundary {
    /// Finds the edges that belong to one element.
    pub fn of(solid: &Solid) -> Result<Self, GmshError> {
        let mut sides: HashMap<[u32; 2], u32> = HashMap::new();
        let mut in_order = Vec::new();
        for block in &solid.mesh.blocks {
            let n = if block.kind == ElementKind::Tri7 {
                3
            } else {
                4
            };
            for (nodes, tag) in block.nodes.chunks(block.kind.nodes()).zip(&block.tag) {
                for side in 0..n {
                    let ends = [nodes[side], nodes[(side + 1) % n]];
                    if let Some(other) = sides.insert(ends, *tag) {
                        return Err(GmshError::Overlapping {
                            first: other.into(),
                            second: (*tag).into(),
                        });
                    }
                    in_order.push(ends);
                }
            }
        }
        let edges: Vec<BoundaryEdge> = in_order
            .into_iter()
            .filter(|[a, b]| !sides.contains_key(&[*b, *a]))
            .map(|ends| BoundaryEdge {
                ends,
                mid: solid.mid_of_edge[&edge_key(ends[0], ends[1])],
            })
            .collect();
        let next = successors(&edges, &solid.mesh.nodes);
        let index = edges
            .iter()
            .enumerate()
            .map(|(i, e)| (edge_key(e.ends[0], e.ends[1]), i))
            .collect();
        Ok(Self { edges, index, next })
    }

    /// Chains of the chosen edges along the boundary, in the order of their first edges.
    pub fn chains(&self, chosen: &[bool]) -> Vec<Chain> {
        let mut follows = vec![false; self.edges.len()];
        for (i, next) in self.next.iter().enumerate() {
            follows[*next] |= chosen[i];
        }
        let mut used = vec![false; self.edges.len()];
        let mut chains = Vec::new();
        // Open chains start at an edge that follows none; what is then left runs in loops.
        for open in [true, false] {
            for start in 0..self.edges.len() {
                if !chosen[start] || used[start] || (open && follows[start]) {
                    continue;
                }
                let mut edges = Vec::new();
                let mut edge = start;
                while chosen[edge] && !used[edge] {
                    used[edge] = true;
                    edges.push(edge);
                    edge = self.next[edge];
                }
                chains.push(Chain {
                    closed: edge == start,
                    edges,
                });
            }
        }
        chains
    }

    /// All loops: outlines (counter-clockwise) first, then voids.
    pub fn loops(&self, at: &[[f64; 2]]) -> Vec<BoundaryLoop> {
        let mut loops: Vec<(f64, BoundaryLoop)> = self
            .chains(&vec![true; self.edges.len()])
            .into_iter()
            .map(|chain| {
                let edges: Vec<BoundaryEdge> = chain.edges.iter().map(|i| self.edges[*i]).collect();
                let starts_at_corner = (0..edges.len())
                    .map(|i| {
                        let before = edges[(i + edges.len() - 1) % edges.len()];
                        let turn =
                            angle(tangents(&edges[i], at)[0]) - angle(tangents(&before, at)[1]);
                        (turn + 1.5 * TAU).rem_euclid(TAU) - TAU / 2.0
                    })
                    .map(|turn| turn.abs() > CORNER_TURN)
                    .collect();
                let area: f64 = edges.iter().map(|e| edge_area(e, at)).sum();
                (
                    area,
                    BoundaryLoop {
                        edges,
                        starts_at_corner,
                    },
                )
            })
            .collect();
        loops.sort_by_key(|(area, _)| *area < 0.0);
        loops.into_iter().map(|(_, l)| l).collect()
    }
}

/// 1/2 the integral of (x dy - y dx) along an edge, exact for straight and quadratic edges.
fn edge_area(edge: &BoundaryEdge, at: &[[f64; 2]]) -> f64 {
    let cross = |a: u32, b: u32| {
        let (p, q) = (at[a as usize], at[b as usize]);
        p[0] * q[1] - p[1] * q[0]
    };
    let [a, b] = edge.ends;
    match edge.mid {
        None => cross(a, b) / 2.0,
        Some(m) => (4.0 * cross(a, m) + 4.0 * cross(m, b) - cross(a, b)) / 6.0,
    }
}

/// Directions at the start and at the end of an edge.
fn tangents(edge: &BoundaryEdge, at: &[[f64; 2]]) -> [[f64; 2]; 2] {
    let [a, b] = edge.ends.map(|n| at[n as usize]);
    match edge.mid.map(|m| at[m as usize]) {
        None => [[b[0] - a[0], b[1] - a[1]]; 2],
        Some(m) => [
            [0, 1].map(|i| -3.0 * a[i] + 4.0 * m[i] - b[i]),
            [0, 1].map(|i| a[i] - 4.0 * m[i] + 3.0 * b[i]),
        ],
    }
}

fn angle(direction: [f64; 2]) -> f64 {
    direction[1].atan2(direction[0])
}

/// For each edge the one that follows it. Where solids touch in one node there are several candidates: the one that
/// bounds the same fan of elements is the first met when turning clockwise from the way back.
fn successors(edges: &[BoundaryEdge], at: &[[f64; 2]]) -> Vec<usize> {
    let mut leaving: HashMap<u32, Vec<usize>> = HashMap::new();
    for (i, edge) in edges.iter().enumerate() {
        leaving.entry(edge.ends[0]).or_default().push(i);
    }
    edges
        .iter()
        .map(|edge| {
            // A boundary edge always has a follower: the fan of elements at its end has another side.
            let candidates = &leaving[&edge.ends[1]];
            let back = angle(tangents(edge, at)[1].map(|x| -x));
            let clockwise = |i: &usize| {
                let turn = (back - angle(tangents(&edges[*i], at)[0])).rem_euclid(TAU);
                if turn == 0.0 { TAU } else { turn }
            };
            *candidates
                .iter()
                .min_by(|a, b| clockwise(a).total_cmp(&clockwise(b)))
                .unwrap_or(&candidates[0])
        })
        .collect()
}
