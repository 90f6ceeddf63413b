//! The file of a body that was meshed here, so that other programs, and a scene with `mesh_file`, can take it up.

use std::collections::HashSet;

use super::file::{GmshElement, GmshElementKind, GmshFile, GmshNode, PhysicalGroup};
use crate::mesh::{BoundaryEdge, Discretisation, ElementBlock, ElementKind};

/// Name of the group of edges that are held in both components.
const HELD: &str = "left";

/// The body as a file with the line groups `left` (edges fixed in x and y) and `channel-I` (the walls of every chamber
/// of channel I), and the surface group `solid`, or `material-I` per law where there are several. Tags count nodes and
/// elements from 1; node I of the body has the tag I + 1. A seven-node triangle is written with six: its centre node
/// is a mean of the others, as the reader makes it.
///
/// Prescribed motions, supports of single components and tractions have no group: chains of units have none.
pub fn export(body: &Discretisation) -> GmshFile {
    let mut file = GmshFile::default();
    let held: HashSet<(u32, u8)> = (body.supports.iter())
        .filter(|s| s.displacement_mm == 0.0)
        .map(|s| (s.node, s.component))
        .collect();
    let is_held = |node: &u32| held.contains(&(*node, 0)) && held.contains(&(*node, 1));
    let clamped: Vec<BoundaryEdge> = (body.boundary.iter())
        .flat_map(|l| &l.edges)
        .filter(|edge| edge.ends.iter().chain(&edge.mid).all(is_held))
        .copied()
        .collect();
    if !clamped.is_empty() {
        let group = add_group(&mut file, 1, HELD.to_owned());
        add_edges(&mut file, group, &clamped);
    }
    for channel in 0..=body.cavities.iter().map(|c| c.channel).max().unwrap_or(0) {
        let walls: Vec<BoundaryEdge> = (body.cavities.iter())
            .filter(|c| c.channel == channel)
            .flat_map(|c| &c.edges)
            .copied()
            .collect();
        if !walls.is_empty() {
            let group = add_group(&mut file, 1, format!("channel-{channel}"));
            add_edges(&mut file, group, &walls);
        }
    }

    let blocks = &body.mesh.blocks;
    let mut laws: Vec<u16> = (blocks.iter().flat_map(|b| &b.material)).copied().collect();
    laws.sort_unstable();
    laws.dedup();
    for law in &laws {
        let name = if laws.len() == 1 {
            "solid".to_owned()
        } else {
            format!("material-{law}")
        };
        let group = add_group(&mut file, 2, name);
        for block in blocks {
            add_surfaces(&mut file, group, block, *law);
        }
    }

    let used: HashSet<u64> = (file.elements.iter())
        .flat_map(|e| e.nodes.iter().copied())
        .collect();
    file.nodes = (1_u64..)
        .zip(&body.mesh.nodes)
        .filter(|(tag, _)| used.contains(tag))
        .map(|(tag, [x, y])| GmshNode {
            tag,
            at_mm: [*x, *y, 0.0],
        })
        .collect();
    file
}

fn tag(node: u32) -> u64 {
    u64::from(node) + 1
}

/// Adds a group and answers its index.
fn add_group(file: &mut GmshFile, dimension: u8, name: String) -> usize {
    let index = file.groups.len();
    file.groups.push(PhysicalGroup {
        dimension,
        tag: index as u32 + 1,
        name,
    });
    index
}

fn add(file: &mut GmshFile, kind: GmshElementKind, nodes: Vec<u64>, group: usize) {
    file.elements.push(GmshElement {
        tag: file.elements.len() as u64 + 1,
        kind,
        nodes,
        groups: vec![group],
    });
}

fn add_edges(file: &mut GmshFile, group: usize, edges: &[BoundaryEdge]) {
    for edge in edges {
        let kind = match edge.mid {
            None => GmshElementKind::Line2,
            Some(_) => GmshElementKind::Line3,
        };
        let nodes = edge.ends.into_iter().chain(edge.mid).map(tag).collect();
        add(file, kind, nodes, group);
    }
}

fn add_surfaces(file: &mut GmshFile, group: usize, block: &ElementBlock, law: u16) {
    let kind = match block.kind {
        ElementKind::Quad4 => GmshElementKind::Quad4,
        ElementKind::Quad9 => GmshElementKind::Quad9,
        ElementKind::Tri7 => GmshElementKind::Triangle6,
    };
    let of_law = (block.nodes.chunks(block.kind.nodes()))
        .zip(&block.material)
        .filter(|(_, material)| **material == law);
    for (nodes, _) in of_law {
        let nodes = nodes[..kind.nodes()].iter().copied().map(tag).collect();
        add(file, kind, nodes, group);
    }
}
