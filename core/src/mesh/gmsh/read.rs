//! Reading a Gmsh file.

use std::collections::{HashMap, HashSet};
use std::path::Path;

use super::error::GmshError;
use super::file::{GmshElement, GmshElementKind, GmshFile, GmshNode, PhysicalGroup};
use super::section::{Section, Words, sections};

/// Reads a file.
pub fn read(path: &Path) -> Result<GmshFile, GmshError> {
    let bytes = std::fs::read(path).map_err(|source| GmshError::Unreadable {
        path: path.to_owned(),
        source,
    })?;
    parse(&bytes)
}

/// Reads the bytes of a file.
pub fn parse(bytes: &[u8]) -> Result<GmshFile, GmshError> {
    check_format(bytes)?;
    let text = std::str::from_utf8(bytes).map_err(|e| GmshError::NotText {
        line: bytes[..e.valid_up_to()].split(|b| *b == b'\n').count(),
    })?;
    let sections = sections(text)?;
    let find = |name: &'static str| -> Result<Option<&Section<'_>>, GmshError> {
        let mut all = sections.iter().filter(|s| s.name == name);
        let first = all.next();
        match all.next() {
            Some(again) => Err(GmshError::RepeatedSection {
                section: name.to_owned(),
                line: again.line,
            }),
            None => Ok(first),
        }
    };
    let need = |name: &'static str| find(name)?.ok_or(GmshError::MissingSection { section: name });
    if find("PartitionedEntities")?.is_some() {
        return Err(GmshError::Partitioned);
    }
    let groups = match find("PhysicalNames")? {
        Some(section) => physical_names(section)?,
        None => Vec::new(),
    };
    let entities = match find("Entities")? {
        Some(section) => Some(entity_groups(section, &groups)?),
        None => None,
    };
    let nodes = nodes(need("Nodes")?)?;
    let elements = elements(need("Elements")?, &nodes, entities.as_ref())?;
    Ok(GmshFile {
        groups,
        nodes,
        elements,
    })
}

/// Looks at the header before anything is taken for text: a binary file is told as such.
fn check_format(bytes: &[u8]) -> Result<(), GmshError> {
    const HEADER: &[u8] = b"$MeshFormat";
    let start = bytes
        .windows(HEADER.len())
        .position(|w| w == HEADER)
        .ok_or(GmshError::NotGmsh)?;
    let line = bytes[start + HEADER.len()..]
        .split(|b| *b == b'\n')
        .nth(1)
        .unwrap_or_default();
    let line = String::from_utf8_lossy(line);
    let mut words = line.split_whitespace();
    let version = words.next().unwrap_or("(none)");
    if version != "4.1" {
        return Err(GmshError::Version {
            found: version.chars().take(20).collect(),
        });
    }
    match words.next() {
        Some("0") => Ok(()),
        Some("1") => Err(GmshError::Binary),
        other => Err(GmshError::Malformed {
            line: 2,
            what: "0 for ASCII",
            found: other.unwrap_or_default().chars().take(20).collect(),
        }),
    }
}

/// Names are quoted and may hold spaces, so this section is read line by line.
fn physical_names(section: &Section<'_>) -> Result<Vec<PhysicalGroup>, GmshError> {
    let mut lines = section
        .body
        .iter()
        .enumerate()
        .map(|(i, l)| (section.line + 1 + i, l.trim()))
        .filter(|(_, l)| !l.is_empty());
    let malformed = |line: usize, what: &'static str, found: &str| GmshError::Malformed {
        line,
        what,
        found: found.chars().take(40).collect(),
    };
    let short = |what| GmshError::Short {
        section: "PhysicalNames",
        line: section.line + section.body.len() + 1,
        what,
    };
    let (line, count) = lines.next().ok_or(short("the number of names"))?;
    let count: usize = count
        .parse()
        .map_err(|_| malformed(line, "the number of names", count))?;
    let mut groups = Vec::new();
    for _ in 0..count {
        let (line, text) = lines.next().ok_or(short("a name"))?;
        let mut parts = text.splitn(3, char::is_whitespace);
        let dimension = parts.next().and_then(|d| d.parse().ok());
        let tag = parts.next().and_then(|t| t.parse().ok());
        let name = parts
            .next()
            .map(str::trim)
            .and_then(|n| n.strip_prefix('"')?.strip_suffix('"'));
        let (Some(dimension), Some(tag), Some(name)) = (dimension, tag, name) else {
            return Err(malformed(line, "dimension, tag and \"name\"", text));
        };
        groups.push(PhysicalGroup {
            dimension,
            tag,
            name: name.to_owned(),
        });
    }
    match lines.next() {
        Some((line, _)) => Err(GmshError::Long {
            section: "PhysicalNames",
            line,
        }),
        None => Ok(groups),
    }
}

/// For each entity (dimension, tag) the indices of its named groups.
type EntityGroups = HashMap<(u8, i64), Vec<usize>>;

fn entity_groups(
    section: &Section<'_>,
    groups: &[PhysicalGroup],
) -> Result<EntityGroups, GmshError> {
    let mut words = Words::new("Entities", section);
    let mut counts = [0_usize; 4];
    for count in &mut counts {
        *count = words.number("a number of entities")?;
    }
    let mut found = EntityGroups::new();
    for (dimension, count) in counts.into_iter().enumerate() {
        let dimension = dimension as u8;
        for _ in 0..count {
            let tag: i64 = words.number("the tag of an entity")?;
            words.skip(
                if dimension == 0 { 3 } else { 6 },
                "a coordinate of an entity",
            )?;
            let physical: usize = words.number("a number of physical tags")?;
            let mut of_entity = Vec::new();
            for _ in 0..physical {
                // A negative tag says that the entity is reversed in the group; groups here have no direction.
                let tag: i64 = words.number("a physical tag")?;
                let tag = tag.unsigned_abs();
                of_entity.extend(
                    groups
                        .iter()
                        .position(|g| g.dimension == dimension && u64::from(g.tag) == tag),
                );
            }
            if dimension > 0 {
                let bounding: usize = words.number("a number of bounding entities")?;
                words.skip(bounding, "a bounding entity")?;
            }
            found.insert((dimension, tag), of_entity);
        }
    }
    words.end()?;
    Ok(found)
}

fn nodes(section: &Section<'_>) -> Result<Vec<GmshNode>, GmshError> {
    let mut words = Words::new("Nodes", section);
    let blocks: usize = words.number("a number of blocks")?;
    let total: usize = words.number("a number of nodes")?;
    let _: u64 = words.number("the least node tag")?;
    let _: u64 = words.number("the largest node tag")?;
    let mut nodes = Vec::new();
    let mut seen = HashSet::new();
    for _ in 0..blocks {
        let dimension: usize = words.number("the dimension of a block")?;
        let _: i64 = words.number("the entity of a block")?;
        let parametric: u8 = words.number("the parametric flag of a block")?;
        let count: usize = words.number("the number of nodes of a block")?;
        let first = nodes.len();
        for _ in 0..count {
            let tag = words.number("a node tag")?;
            if !seen.insert(tag) {
                return Err(GmshError::RepeatedTag {
                    line: words.line,
                    what: "node",
                    tag,
                });
            }
            nodes.push(GmshNode {
                tag,
                at_mm: [0.0; 3],
            });
        }
        for node in &mut nodes[first..] {
            for x in &mut node.at_mm {
                *x = words.finite("a finite coordinate")?;
            }
            if parametric != 0 {
                words.skip(dimension.min(3), "a parametric coordinate")?;
            }
        }
    }
    if nodes.len() != total {
        return Err(GmshError::Malformed {
            line: section.line + 1,
            what: "the number of nodes in the blocks",
            found: total.to_string(),
        });
    }
    words.end()?;
    Ok(nodes)
}

fn elements(
    section: &Section<'_>,
    nodes: &[GmshNode],
    entities: Option<&EntityGroups>,
) -> Result<Vec<GmshElement>, GmshError> {
    let known: HashSet<u64> = nodes.iter().map(|n| n.tag).collect();
    let mut words = Words::new("Elements", section);
    let blocks: usize = words.number("a number of blocks")?;
    let total: usize = words.number("a number of elements")?;
    let _: u64 = words.number("the least element tag")?;
    let _: u64 = words.number("the largest element tag")?;
    let mut elements = Vec::new();
    let mut seen = HashSet::new();
    for _ in 0..blocks {
        let dimension: u8 = words.number("the dimension of a block")?;
        let entity: i64 = words.number("the entity of a block")?;
        let number: u32 = words.number("an element type")?;
        let line = words.line;
        let kind = GmshElementKind::from_number(number)
            .filter(|kind| kind.dimension() == dimension)
            .ok_or(GmshError::ElementType { line, number })?;
        let groups = match entities {
            None => Vec::new(),
            Some(entities) => entities
                .get(&(dimension, entity))
                .ok_or(GmshError::UnknownEntity {
                    line,
                    dimension,
                    tag: entity,
                })?
                .clone(),
        };
        let count: usize = words.number("the number of elements of a block")?;
        for _ in 0..count {
            let tag = words.number("an element tag")?;
            let mut corners = Vec::with_capacity(kind.nodes());
            for _ in 0..kind.nodes() {
                let node: u64 = words.number("a node of an element")?;
                let line = words.line;
                if !known.contains(&node) {
                    return Err(GmshError::UnknownNode {
                        line,
                        element: tag,
                        node,
                    });
                }
                if corners.contains(&node) {
                    return Err(GmshError::RepeatedNode {
                        line,
                        element: tag,
                        node,
                    });
                }
                corners.push(node);
            }
            if !seen.insert(tag) {
                return Err(GmshError::RepeatedTag {
                    line: words.line,
                    what: "element",
                    tag,
                });
            }
            elements.push(GmshElement {
                tag,
                kind,
                nodes: corners,
                groups: groups.clone(),
            });
        }
    }
    if elements.len() != total {
        return Err(GmshError::Malformed {
            line: section.line + 1,
            what: "the number of elements in the blocks",
            found: total.to_string(),
        });
    }
    words.end()?;
    Ok(elements)
}
