//! Writing a Gmsh file.

use std::fmt::Write as _;

use super::file::{GmshElementKind, GmshFile};

/// The text of a file (MSH 4.1 ASCII). Elements of one dimension and the same groups form one entity; coordinates are
/// written so that they read back to the same bits.
///
/// # Errors
/// None in practice: writing to a string does not fail.
pub fn write(file: &GmshFile) -> Result<String, std::fmt::Error> {
    let mut out = String::from("$MeshFormat\n4.1 0 8\n$EndMeshFormat\n");
    if !file.groups.is_empty() {
        writeln!(out, "$PhysicalNames\n{}", file.groups.len())?;
        for group in &file.groups {
            writeln!(out, "{} {} \"{}\"", group.dimension, group.tag, group.name)?;
        }
        writeln!(out, "$EndPhysicalNames")?;
    }

    let entities = entities(file);
    let (low, high) = bounding_box(file);
    writeln!(out, "$Entities")?;
    let counts: Vec<String> = (0..4)
        .map(|d| {
            entities
                .iter()
                .filter(|e| e.dimension == d)
                .count()
                .to_string()
        })
        .collect();
    writeln!(out, "{}", counts.join(" "))?;
    for entity in &entities {
        write!(out, "{}", entity.tag)?;
        let corners = if entity.dimension == 0 {
            &[low][..]
        } else {
            &[low, high][..]
        };
        for [x, y, z] in corners {
            write!(out, " {x} {y} {z}")?;
        }
        write!(out, " {}", entity.groups.len())?;
        for group in entity.groups {
            write!(out, " {}", file.groups[*group].tag)?;
        }
        writeln!(out, "{}", if entity.dimension > 0 { " 0" } else { "" })?;
    }
    writeln!(out, "$EndEntities")?;

    let (least, largest) = range(file.nodes.iter().map(|n| n.tag));
    let home = entities.last().map_or((2, 1), |e| (e.dimension, e.tag));
    writeln!(out, "$Nodes\n1 {} {least} {largest}", file.nodes.len())?;
    writeln!(out, "{} {} 0 {}", home.0, home.1, file.nodes.len())?;
    for node in &file.nodes {
        writeln!(out, "{}", node.tag)?;
    }
    for node in &file.nodes {
        let [x, y, z] = node.at_mm;
        writeln!(out, "{x} {y} {z}")?;
    }
    writeln!(out, "$EndNodes")?;

    let (least, largest) = range(file.elements.iter().map(|e| e.tag));
    let blocks: usize = entities.iter().map(|e| e.blocks.len()).sum();
    writeln!(
        out,
        "$Elements\n{blocks} {} {least} {largest}",
        file.elements.len()
    )?;
    for entity in &entities {
        for (kind, members) in &entity.blocks {
            writeln!(
                out,
                "{} {} {} {}",
                entity.dimension,
                entity.tag,
                kind.number(),
                members.len()
            )?;
            for member in members {
                let element = &file.elements[*member];
                write!(out, "{}", element.tag)?;
                for node in &element.nodes {
                    write!(out, " {node}")?;
                }
                writeln!(out)?;
            }
        }
    }
    writeln!(out, "$EndElements")?;
    Ok(out)
}

struct Entity<'a> {
    dimension: u8,
    tag: usize,
    groups: &'a [usize],
    blocks: Vec<(GmshElementKind, Vec<usize>)>,
}

/// Elements by dimension and groups, in ascending dimension.
fn entities(file: &GmshFile) -> Vec<Entity<'_>> {
    let mut found: Vec<Entity<'_>> = Vec::new();
    for (index, element) in file.elements.iter().enumerate() {
        let dimension = element.kind.dimension();
        let place = found
            .iter()
            .position(|e| e.dimension == dimension && e.groups == element.groups)
            .unwrap_or_else(|| {
                let tag = 1 + found.iter().filter(|e| e.dimension == dimension).count();
                found.push(Entity {
                    dimension,
                    tag,
                    groups: &element.groups,
                    blocks: Vec::new(),
                });
                found.len() - 1
            });
        let blocks = &mut found[place].blocks;
        match blocks.iter_mut().find(|(kind, _)| *kind == element.kind) {
            Some((_, members)) => members.push(index),
            None => blocks.push((element.kind, vec![index])),
        }
    }
    found.sort_by_key(|e| e.dimension);
    found
}

fn bounding_box(file: &GmshFile) -> ([f64; 3], [f64; 3]) {
    let mut low = [f64::INFINITY; 3];
    let mut high = [f64::NEG_INFINITY; 3];
    for node in &file.nodes {
        for i in 0..3 {
            low[i] = low[i].min(node.at_mm[i]);
            high[i] = high[i].max(node.at_mm[i]);
        }
    }
    if file.nodes.is_empty() {
        ([0.0; 3], [0.0; 3])
    } else {
        (low, high)
    }
}

fn range(tags: impl Iterator<Item = u64> + Clone) -> (u64, u64) {
    (tags.clone().min().unwrap_or(0), tags.max().unwrap_or(0))
}
