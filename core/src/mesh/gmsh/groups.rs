//! What acts on the groups of a mesh file: laws, supports, tractions, pressures.

use std::collections::HashMap;

use super::boundary::Boundary;
use super::cavity::cavities;
use super::error::list;
use super::file::{GmshElement, GmshElementKind, GmshFile};
use super::solid::{Solid, edge_key};
use crate::fault::Faults;
use crate::material::MaterialLaw;
use crate::mesh::{BoundaryEdge, Cavity, Partners, Support, Traction};
use crate::scene::MeshFileBody;

/// Notes every group that a scene names and the file does not have, and every channel out of range.
pub(super) fn check_names(
    body: &MeshFileBody,
    file: &GmshFile,
    channels: usize,
    faults: &mut Faults,
) {
    let named = (body.supports.iter().map(|s| &s.group).enumerate())
        .map(|(i, g)| (format!("supports[{i}]"), g))
        .chain(
            (body.tractions.iter().map(|s| &s.group).enumerate())
                .map(|(i, g)| (format!("tractions[{i}]"), g)),
        )
        .chain(
            (body.pressures.iter().map(|s| &s.group).enumerate())
                .map(|(i, g)| (format!("pressures[{i}]"), g)),
        )
        .chain(
            (body.materials.iter().map(|s| &s.group).enumerate())
                .map(|(i, g)| (format!("materials[{i}]"), g)),
        )
        .map(|(path, group)| (format!("{path}.group"), group));
    let pairs = body.contact_pairs.iter().enumerate();
    let paired = pairs.flat_map(|(i, pair)| {
        (pair.iter().enumerate()).map(move |(k, group)| (format!("contact_pairs[{i}][{k}]"), group))
    });
    for (path, group) in named.chain(paired) {
        if !file.has_group(group) {
            let known: Vec<&str> = file.groups.iter().map(|g| g.name.as_str()).collect();
            faults.add(
                path,
                if known.is_empty() {
                    format!("no physical group \"{group}\": the mesh file names none")
                } else {
                    format!(
                        "no physical group \"{group}\" in the mesh file; it has {}",
                        known.join(", ")
                    )
                },
            );
        }
    }
    let driven = (body.supports.iter().map(|s| s.channel).enumerate())
        .map(|(i, c)| (format!("supports[{i}]"), c))
        .chain(
            (body.tractions.iter().map(|s| s.channel).enumerate())
                .map(|(i, c)| (format!("tractions[{i}]"), c)),
        )
        .chain(
            (body.pressures.iter().map(|s| s.channel).enumerate())
                .map(|(i, c)| (format!("pressures[{i}]"), c)),
        );
    for (path, channel) in named_out_of_range(driven, channels) {
        faults.add(
            format!("{path}.channel"),
            format!("channel {channel}; the schedule has {channels}, counted from 0"),
        );
    }
}

fn named_out_of_range(
    driven: impl Iterator<Item = (String, usize)>,
    channels: usize,
) -> Vec<(String, usize)> {
    driven.filter(|(_, c)| *c >= channels).collect()
}

/// Gives each element its law; answers the list of laws, the scene's own first.
pub(super) fn materials(
    body: &MeshFileBody,
    file: &GmshFile,
    solid: &mut Solid,
    faults: &mut Faults,
) -> Vec<MaterialLaw> {
    let mut laws = vec![body.material];
    let mut given: HashMap<u64, (u16, usize)> = HashMap::new();
    for (i, entry) in body.materials.iter().enumerate() {
        let path = format!("materials[{i}].group");
        let law = laws
            .iter()
            .position(|law| *law == entry.material)
            .unwrap_or_else(|| {
                laws.push(entry.material);
                laws.len() - 1
            }) as u16;
        let mut any = false;
        let mut clashes = Vec::new();
        for element in file.elements_of(&entry.group) {
            let Some(place) = solid.place_of_element.get(&element.tag) else {
                continue;
            };
            any = true;
            match given.insert(element.tag, (law, i)) {
                Some((other, by)) if other != law => clashes.push((element.tag, by)),
                _ => solid.mesh.blocks[place.0].material[place.1] = law,
            }
        }
        if !any && file.has_group(&entry.group) {
            faults.add(
                &path,
                format!("group \"{}\" has no surface elements", entry.group),
            );
        }
        if let Some((_, by)) = clashes.first() {
            let tags: Vec<u64> = clashes.iter().map(|(tag, _)| *tag).collect();
            faults.add(
                &path,
                format!(
                    "elements with another law from materials[{by}]: {}",
                    list(&tags)
                ),
            );
        }
    }
    laws
}

/// Prescribed displacements, one per node and component.
pub(super) fn supports(
    body: &MeshFileBody,
    file: &GmshFile,
    solid: &Solid,
    faults: &mut Faults,
) -> Vec<Support> {
    let mut found: Vec<Support> = Vec::new();
    let mut place: HashMap<(u32, u8), (usize, usize)> = HashMap::new();
    for (i, entry) in body.supports.iter().enumerate() {
        let path = format!("supports[{i}]");
        let nodes = nodes_of_group(file, &entry.group, solid, &format!("{path}.group"), faults);
        let mut clashes: Vec<(u32, usize)> = Vec::new();
        for node in nodes {
            for component in 0..2_u8 {
                if !entry.fix[component as usize] {
                    continue;
                }
                let support = Support {
                    node,
                    component,
                    displacement_mm: entry.displacement_mm[component as usize],
                    channel: entry.channel,
                };
                match place.get(&(node, component)) {
                    None => {
                        place.insert((node, component), (found.len(), i));
                        found.push(support);
                    }
                    Some((at, by)) if !same_motion(&found[*at], &support) => {
                        clashes.push((node, *by));
                    }
                    Some(_) => {}
                }
            }
        }
        if let Some((node, by)) = clashes.first() {
            let [x, y] = solid.mesh.nodes[*node as usize];
            faults.add(
                &path,
                format!(
                    "contradicts supports[{by}] at {} nodes, the first at ({x}, {y}) mm",
                    clashes.len()
                ),
            );
        }
    }
    found
}

fn same_motion(a: &Support, b: &Support) -> bool {
    a.displacement_mm == b.displacement_mm && (a.channel == b.channel || a.displacement_mm == 0.0)
}

/// The solid's nodes in a group, with the mid-sides and centres that its elements were given.
fn nodes_of_group(
    file: &GmshFile,
    group: &str,
    solid: &Solid,
    path: &str,
    faults: &mut Faults,
) -> Vec<u32> {
    let mut nodes = Vec::new();
    let mut outside = Vec::new();
    for element in file.elements_of(group) {
        if let Some((block, place)) = solid.place_of_element.get(&element.tag) {
            let block = &solid.mesh.blocks[*block];
            let n = block.kind.nodes();
            nodes.extend_from_slice(&block.nodes[place * n..(place + 1) * n]);
            continue;
        }
        for tag in &element.nodes {
            match solid.node_of_tag.get(tag) {
                Some(node) => nodes.push(*node),
                None => outside.push(*tag),
            }
        }
        if element.kind == GmshElementKind::Line2 {
            let ends = [0, 1].map(|k| solid.node_of_tag.get(&element.nodes[k]));
            if let [Some(a), Some(b)] = ends {
                nodes.extend(solid.mid_of_edge.get(&edge_key(*a, *b)).copied().flatten());
            }
        }
    }
    if !outside.is_empty() {
        outside.sort_unstable();
        outside.dedup();
        faults.add(
            path,
            format!(
                "nodes of group \"{group}\" belong to no surface element: {}",
                list(&outside)
            ),
        );
    } else if nodes.is_empty() && file.has_group(group) {
        faults.add(path, format!("group \"{group}\" is empty"));
    }
    nodes.sort_unstable();
    nodes.dedup();
    nodes
}

/// Dead tractions.
pub(super) fn tractions(
    body: &MeshFileBody,
    file: &GmshFile,
    solid: &Solid,
    boundary: &Boundary,
    faults: &mut Faults,
) -> Vec<Traction> {
    body.tractions
        .iter()
        .enumerate()
        .map(|(i, entry)| {
            let path = format!("tractions[{i}].group");
            let edges = edges_of_group(file, &entry.group, solid, boundary, &path, faults);
            Traction {
                channel: entry.channel,
                mpa: entry.mpa,
                edges: edges
                    .into_iter()
                    .map(|e| boundary.edges[e])
                    .collect::<Vec<BoundaryEdge>>(),
            }
        })
        .collect()
}

/// Which edges may act on each other; `None` where the scene names no pairs, so that all may.
pub(super) fn partners(
    body: &MeshFileBody,
    file: &GmshFile,
    solid: &Solid,
    boundary: &Boundary,
    faults: &mut Faults,
) -> Option<Partners> {
    if body.contact_pairs.is_empty() {
        return None;
    }
    let mut names: Vec<&str> = Vec::new();
    let mut partners = Partners::default();
    for (i, pair) in body.contact_pairs.iter().enumerate() {
        let mut numbers = [0; 2];
        for (k, group) in pair.iter().enumerate() {
            let known = names.iter().position(|name| name == group);
            let number = known.unwrap_or(names.len());
            numbers[k] = number as u32;
            if known.is_some() {
                continue;
            }
            names.push(group);
            let path = format!("contact_pairs[{i}][{k}]");
            for edge in edges_of_group(file, group, solid, boundary, &path, faults) {
                let ends = boundary.edges[edge].ends;
                *partners.of_edge.entry(ends).or_default() |= 1 << number;
            }
        }
        partners.pairs.push(numbers);
    }
    Some(partners)
}

/// Follower pressures as cavities.
pub(super) fn pressures(
    body: &MeshFileBody,
    file: &GmshFile,
    solid: &Solid,
    boundary: &Boundary,
    supports: &[Support],
    faults: &mut Faults,
) -> Vec<Cavity> {
    let mut found = Vec::new();
    let mut loaded: HashMap<(usize, usize), usize> = HashMap::new();
    for (i, entry) in body.pressures.iter().enumerate() {
        let path = format!("pressures[{i}].group");
        let edges = edges_of_group(file, &entry.group, solid, boundary, &path, faults);
        if let Some(by) = edges
            .iter()
            .find_map(|e| loaded.insert((*e, entry.channel), i))
        {
            faults.add(
                &path,
                format!("shares edges and channel with pressures[{by}]"),
            );
            continue;
        }
        let mut chosen = vec![false; boundary.edges.len()];
        for edge in edges {
            chosen[edge] = true;
        }
        found.extend(cavities(
            boundary,
            &boundary.chains(&chosen),
            entry.channel,
            supports,
            &solid.mesh.nodes,
            &path,
            faults,
        ));
    }
    found
}

/// Indices of the boundary edges in a group, each once.
fn edges_of_group(
    file: &GmshFile,
    group: &str,
    solid: &Solid,
    boundary: &Boundary,
    path: &str,
    faults: &mut Faults,
) -> Vec<usize> {
    let lines: Vec<&GmshElement> = file
        .elements_of(group)
        .filter(|e| e.kind.dimension() == 1)
        .collect();
    if lines.is_empty() && file.has_group(group) {
        faults.add(path, format!("group \"{group}\" has no edges"));
    }
    let mut edges = Vec::new();
    let mut outside = Vec::new();
    for line in lines {
        let node = |k: usize| solid.node_of_tag.get(&line.nodes[k]).copied();
        let edge = match (node(0), node(1)) {
            (Some(a), Some(b)) => boundary.index.get(&edge_key(a, b)).copied(),
            _ => None,
        };
        // A 3-node line must name the mid-side node of the element's edge.
        let fits = |edge: &usize| {
            line.kind == GmshElementKind::Line2 || node(2) == boundary.edges[*edge].mid
        };
        match edge.filter(fits) {
            Some(edge) => edges.push(edge),
            None => outside.push(line.tag),
        }
    }
    if !outside.is_empty() {
        faults.add(
            path,
            format!(
                "lines of group \"{group}\" are no edges of the boundary of the solid: {}",
                list(&outside)
            ),
        );
    }
    edges.sort_unstable();
    edges.dedup();
    edges
}
