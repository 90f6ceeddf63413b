//! From a file's surface elements to counter-clockwise elements of our kinds.

use std::collections::HashMap;

use super::error::GmshError;
use super::file::{GmshElement, GmshElementKind, GmshFile};
use super::jacobian::least_jacobian;
use super::model::NodeOrigin;
use crate::mesh::{ElementBlock, ElementKind, Mesh};

/// A Jacobian below this, over the element's scale, is no longer told from zero.
const COLLAPSED: f64 = 1e-10;

/// Elements and nodes, with the way back to the file.
pub(super) struct Solid {
    /// Nodes and elements; every material index is 0.
    pub mesh: Mesh,
    /// Where each node comes from.
    pub origins: Vec<NodeOrigin>,
    /// Node of each tag that the solid uses.
    pub node_of_tag: HashMap<u64, u32>,
    /// Mid-side node of each edge (lower node first); `None` on a two-node edge.
    pub mid_of_edge: HashMap<[u32; 2], Option<u32>>,
    /// Block and place of each surface element by tag.
    pub place_of_element: HashMap<u64, (usize, usize)>,
}

/// An edge's nodes in ascending order.
pub(super) fn edge_key(a: u32, b: u32) -> [u32; 2] {
    [a.min(b), a.max(b)]
}

/// Builds the solid. A file of 4-node quadrilaterals alone stays as it is; where other kinds are present everything is
/// raised to the quadratic family, so that neighbours conform.
pub(super) fn solid(file: &GmshFile) -> Result<Solid, GmshError> {
    let surfaces: Vec<&GmshElement> = file
        .elements
        .iter()
        .filter(|e| e.kind.dimension() == 2)
        .collect();
    if surfaces.is_empty() {
        return Err(GmshError::NoSolid);
    }
    let mut builder = Builder::with_nodes_of(file, &surfaces)?;
    let mut elements: Vec<Vec<u32>> = surfaces
        .iter()
        .map(|e| e.nodes.iter().map(|t| builder.node_of_tag[t]).collect())
        .collect();
    orient(&surfaces, &mut elements, &builder.nodes)?;
    let raise = surfaces.iter().any(|e| e.kind != GmshElementKind::Quad4);
    builder.note_mid_sides(&surfaces, &elements)?;
    let mut blocks: Vec<ElementBlock> = Vec::new();
    let mut place_of_element = HashMap::new();
    let mut inverted = Vec::new();
    for (source, nodes) in surfaces.iter().zip(&mut elements) {
        let kind = if raise {
            builder.raise(source.kind, nodes)
        } else {
            ElementKind::Quad4
        };
        let at: Vec<[f64; 2]> = nodes.iter().map(|n| builder.nodes[*n as usize]).collect();
        if least_jacobian(kind, &at) <= COLLAPSED {
            inverted.push(source.tag);
        }
        let index = blocks
            .iter()
            .position(|b| b.kind == kind)
            .unwrap_or_else(|| {
                blocks.push(ElementBlock {
                    kind,
                    nodes: Vec::new(),
                    material: Vec::new(),
                    tag: Vec::new(),
                });
                blocks.len() - 1
            });
        let block = &mut blocks[index];
        place_of_element.insert(source.tag, (index, block.len()));
        block.nodes.extend_from_slice(nodes);
        block.material.push(0);
        block
            .tag
            .push(u32::try_from(source.tag).unwrap_or(u32::MAX));
    }
    if !inverted.is_empty() {
        return Err(GmshError::Inverted { tags: inverted });
    }
    Ok(Solid {
        mesh: Mesh {
            nodes: builder.nodes,
            blocks,
        },
        origins: builder.origins,
        node_of_tag: builder.node_of_tag,
        mid_of_edge: builder
            .mid_of_edge
            .into_iter()
            .map(|(edge, (mid, _))| (edge, mid))
            .collect(),
        place_of_element,
    })
}

fn corners(kind: GmshElementKind) -> usize {
    match kind {
        GmshElementKind::Triangle3 | GmshElementKind::Triangle6 => 3,
        _ => 4,
    }
}

/// Reverses a mesh that is clockwise as a whole.
fn orient(
    surfaces: &[&GmshElement],
    elements: &mut [Vec<u32>],
    at: &[[f64; 2]],
) -> Result<(), GmshError> {
    let clockwise: Vec<bool> = surfaces
        .iter()
        .zip(elements.iter())
        .map(|(source, nodes)| {
            let n = corners(source.kind);
            let twice: f64 = (0..n)
                .map(|i| (at[nodes[i] as usize], at[nodes[(i + 1) % n] as usize]))
                .map(|(p, q)| p[0] * q[1] - p[1] * q[0])
                .sum();
            twice < 0.0
        })
        .collect();
    let count = clockwise.iter().filter(|c| **c).count();
    if count == 0 {
        return Ok(());
    }
    if count < surfaces.len() {
        let minority = count <= surfaces.len() / 2;
        return Err(GmshError::MixedOrientation {
            clockwise: count,
            elements: surfaces.len(),
            tags: surfaces
                .iter()
                .zip(&clockwise)
                .filter(|(_, c)| **c == minority)
                .map(|(e, _)| e.tag)
                .collect(),
        });
    }
    for (source, nodes) in surfaces.iter().zip(elements) {
        let n = corners(source.kind);
        nodes[1..n].reverse();
        if nodes.len() >= 2 * n {
            // Side k of the reversed element is side n - 1 - k of the old one.
            nodes[n..2 * n].reverse();
        }
    }
    Ok(())
}

struct Builder {
    nodes: Vec<[f64; 2]>,
    origins: Vec<NodeOrigin>,
    node_of_tag: HashMap<u64, u32>,
    /// Mid-side node and the element that first named the edge.
    mid_of_edge: HashMap<[u32; 2], (Option<u32>, u64)>,
}

impl Builder {
    /// Keeps the nodes of the surfaces, in the file's order; others (centres of arcs) are dropped.
    fn with_nodes_of(file: &GmshFile, surfaces: &[&GmshElement]) -> Result<Self, GmshError> {
        let used: std::collections::HashSet<u64> = surfaces
            .iter()
            .flat_map(|e| e.nodes.iter().copied())
            .collect();
        let kept: Vec<_> = file
            .nodes
            .iter()
            .filter(|n| used.contains(&n.tag))
            .collect();
        let size = kept
            .iter()
            .flat_map(|n| n.at_mm[..2].iter())
            .fold(0.0, |size: f64, x| size.max(x.abs()));
        let plane = kept.first().map_or(0.0, |n| n.at_mm[2]);
        if let Some(off) = kept
            .iter()
            .find(|n| (n.at_mm[2] - plane).abs() > 1e-9 * size)
        {
            return Err(GmshError::OffPlane {
                node: off.tag,
                z_mm: off.at_mm[2],
                plane_mm: plane,
            });
        }
        Ok(Self {
            nodes: kept.iter().map(|n| [n.at_mm[0], n.at_mm[1]]).collect(),
            origins: kept.iter().map(|n| NodeOrigin::File(n.tag)).collect(),
            node_of_tag: kept
                .iter()
                .enumerate()
                .map(|(i, n)| (n.tag, i as u32))
                .collect(),
            mid_of_edge: HashMap::new(),
        })
    }

    /// Notes the edges and the mid-side nodes that the file gives.
    fn note_mid_sides(
        &mut self,
        surfaces: &[&GmshElement],
        elements: &[Vec<u32>],
    ) -> Result<(), GmshError> {
        for (source, nodes) in surfaces.iter().zip(elements) {
            let n = corners(source.kind);
            for side in 0..n {
                let key = edge_key(nodes[side], nodes[(side + 1) % n]);
                let mid = nodes
                    .get(n + side)
                    .copied()
                    .filter(|_| nodes.len() >= 2 * n);
                let known = self.mid_of_edge.entry(key).or_insert((mid, source.tag));
                match (known.0, mid) {
                    (Some(a), Some(b)) if a != b => {
                        return Err(GmshError::HangingNode {
                            first: known.1,
                            second: source.tag,
                        });
                    }
                    (None, Some(_)) => *known = (mid, source.tag),
                    _ => {}
                }
            }
        }
        Ok(())
    }

    /// Completes an element to seven or nine nodes.
    fn raise(&mut self, kind: GmshElementKind, nodes: &mut Vec<u32>) -> ElementKind {
        let n = corners(kind);
        if nodes.len() < 2 * n {
            for side in 0..n {
                let (a, b) = (nodes[side], nodes[(side + 1) % n]);
                let mid = self.mid_side(a, b);
                nodes.push(mid);
            }
        }
        if nodes.len() == 2 * n {
            // The serendipity shape at the centre of the square; the quadratic shape at the centroid of the triangle.
            let (corner, mid) = if n == 3 {
                (-1.0 / 9.0, 4.0 / 9.0)
            } else {
                (-0.25, 0.5)
            };
            let parents = nodes
                .iter()
                .enumerate()
                .map(|(i, node)| (*node, if i < n { corner } else { mid }))
                .collect();
            let centre = self.add(parents);
            nodes.push(centre);
        }
        if n == 3 {
            ElementKind::Tri7
        } else {
            ElementKind::Quad9
        }
    }

    fn mid_side(&mut self, a: u32, b: u32) -> u32 {
        let key = edge_key(a, b);
        if let Some((Some(mid), _)) = self.mid_of_edge.get(&key) {
            return *mid;
        }
        let mid = self.add(vec![(a, 0.5), (b, 0.5)]);
        self.mid_of_edge.entry(key).or_insert((None, 0)).0 = Some(mid);
        mid
    }

    fn add(&mut self, parents: Vec<(u32, f64)>) -> u32 {
        let mut at = [0.0; 2];
        for (node, weight) in &parents {
            for i in 0..2 {
                at[i] += weight * self.nodes[*node as usize][i];
            }
        }
        self.nodes.push(at);
        self.origins.push(NodeOrigin::Mean(parents));
        self.nodes.len() as u32 - 1
    }
}
