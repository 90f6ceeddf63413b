//! Several mapped rectangles as one mesh.

use std::collections::HashMap;

use crate::geometry::Point;
use crate::mesh::gmsh::{GmshElement, GmshElementKind, GmshFile, GmshNode, PhysicalGroup};

/// Nodes nearer than this are one, mm.
const SAME_MM: f64 = 1e-7;

/// Joins mapped rectangles: nodes at the same place become one. Of each rectangle those sides are kept that are named, as groups of
/// the new names; and every place of `points` that has a node becomes a group of its name.
pub fn joined(parts: &[(GmshFile, &[(&str, &str)])], points: &[(&str, Point)]) -> GmshFile {
    let mut file = GmshFile::default();
    let mut near = Near::default();
    for (part, sides) in parts {
        let tags: HashMap<u64, u64> = part
            .nodes
            .iter()
            .map(|n| (n.tag, near.tag(&mut file, [n.at_mm[0], n.at_mm[1]])))
            .collect();
        for e in &part.elements {
            let name = part.groups[e.groups[0]].name.as_str();
            let dimension = e.kind.dimension();
            let name = if dimension == 2 {
                name
            } else if let Some((_, name)) = sides.iter().find(|(side, _)| *side == name) {
                name
            } else {
                continue;
            };
            let nodes = e.nodes.iter().map(|t| tags[t]).collect();
            add(&mut file, e.kind, nodes, name);
        }
    }
    for (name, place) in points {
        let tag = near.tag(&mut file, *place);
        add(&mut file, GmshElementKind::Point, vec![tag], name);
    }
    file
}

fn add(file: &mut GmshFile, kind: GmshElementKind, nodes: Vec<u64>, name: &str) {
    let dimension = kind.dimension();
    let known = file
        .groups
        .iter()
        .position(|g| g.dimension == dimension && g.name == name);
    let group = known.unwrap_or_else(|| {
        file.groups.push(PhysicalGroup {
            dimension,
            tag: file.groups.len() as u32 + 1,
            name: name.to_owned(),
        });
        file.groups.len() - 1
    });
    file.elements.push(GmshElement {
        tag: file.elements.len() as u64 + 1,
        kind,
        nodes,
        groups: vec![group],
    });
}

/// Nodes by the cell of a grid in which they lie.
#[derive(Default)]
struct Near(HashMap<[i64; 2], Vec<u64>>);

impl Near {
    /// The tag of the node at a place, which is added where there is none.
    fn tag(&mut self, file: &mut GmshFile, at: Point) -> u64 {
        let cell = at.map(|v| (v / SAME_MM).floor() as i64);
        for i in -1..=1 {
            for k in -1..=1 {
                for tag in self
                    .0
                    .get(&[cell[0] + i, cell[1] + k])
                    .into_iter()
                    .flatten()
                {
                    let p = file.nodes[*tag as usize - 1].at_mm;
                    if (p[0] - at[0]).hypot(p[1] - at[1]) < SAME_MM {
                        return *tag;
                    }
                }
            }
        }
        let tag = file.nodes.len() as u64 + 1;
        file.nodes.push(GmshNode {
            tag,
            at_mm: [at[0], at[1], 0.0],
        });
        self.0.entry(cell).or_default().push(tag);
        tag
    }
}
