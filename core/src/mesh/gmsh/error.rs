//! What can be wrong with a Gmsh file.

use std::path::PathBuf;

/// Why a file cannot be read or used.
#[derive(Debug, thiserror::Error)]
pub enum GmshError {
    /// The file cannot be opened or read.
    #[error("cannot read {path}: {source}")]
    Unreadable {
        /// The file.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// There is no `$MeshFormat`.
    #[error("not a Gmsh mesh: no $MeshFormat section")]
    NotGmsh,
    /// Another version of the format.
    #[error("MSH version {found}; expected 4.1 (gmsh -format msh41)")]
    Version {
        /// What the file says.
        found: String,
    },
    /// A binary file.
    #[error("a binary MSH file; expected ASCII (gmsh -setnumber Mesh.Binary 0)")]
    Binary,
    /// Bytes that are no text.
    #[error("line {line} is not text")]
    NotText {
        /// Line, from 1.
        line: usize,
    },
    /// A section does not end.
    #[error("truncated: section ${section} of line {line} has no $End{section}")]
    Unclosed {
        /// Its name.
        section: String,
        /// Where it starts, from 1.
        line: usize,
    },
    /// A section is missing.
    #[error("no section ${section}")]
    MissingSection {
        /// Its name.
        section: &'static str,
    },
    /// A section appears twice.
    #[error("section ${section} appears again on line {line}")]
    RepeatedSection {
        /// Its name.
        section: String,
        /// Line, from 1.
        line: usize,
    },
    /// Text between sections.
    #[error("line {line}: expected a section, found \"{found}\"")]
    Stray {
        /// Line, from 1.
        line: usize,
        /// What is there.
        found: String,
    },
    /// A section ends before what it announces.
    #[error("truncated: section ${section} ends on line {line} before {what}")]
    Short {
        /// Its name.
        section: &'static str,
        /// Line, from 1.
        line: usize,
        /// What was expected.
        what: &'static str,
    },
    /// A section goes on after what it announces.
    #[error("line {line}: section ${section} has more than it announces")]
    Long {
        /// Its name.
        section: &'static str,
        /// Line, from 1.
        line: usize,
    },
    /// A word that cannot be what it should be.
    #[error("line {line}: expected {what}, found \"{found}\"")]
    Malformed {
        /// Line, from 1.
        line: usize,
        /// What was expected.
        what: &'static str,
        /// What is there.
        found: String,
    },
    /// A mesh cut into parts.
    #[error("a partitioned mesh; save it unpartitioned")]
    Partitioned,
    /// An entity that is not declared.
    #[error("line {line}: entity {tag} of dimension {dimension} is not in $Entities")]
    UnknownEntity {
        /// Line, from 1.
        line: usize,
        /// Dimension.
        dimension: u8,
        /// Its number.
        tag: i64,
    },
    /// An element type that a plane body cannot use.
    #[error(
        "line {line}: element type {number}; expected points, 2- and 3-node lines, 3- and 6-node triangles, 4-, 8- and 9-node quadrilaterals"
    )]
    ElementType {
        /// Line, from 1.
        line: usize,
        /// The number of the type.
        number: u32,
    },
    /// A number is used twice.
    #[error("line {line}: {what} {tag} is given twice")]
    RepeatedTag {
        /// Line, from 1.
        line: usize,
        /// Node or element.
        what: &'static str,
        /// Its number.
        tag: u64,
    },
    /// An element names a node that does not exist.
    #[error("line {line}: element {element} names node {node}, which does not exist")]
    UnknownNode {
        /// Line, from 1.
        line: usize,
        /// Element.
        element: u64,
        /// Node.
        node: u64,
    },
    /// An element names a node twice.
    #[error("line {line}: element {element} names node {node} twice")]
    RepeatedNode {
        /// Line, from 1.
        line: usize,
        /// Element.
        element: u64,
        /// Node.
        node: u64,
    },
    /// No surface.
    #[error("no triangles and no quadrilaterals")]
    NoSolid,
    /// A node outside the plane.
    #[error("node {node} is off the plane of the others: z = {z_mm} mm, expected {plane_mm} mm")]
    OffPlane {
        /// Node.
        node: u64,
        /// Its z.
        z_mm: f64,
        /// z of the first node.
        plane_mm: f64,
    },
    /// Some elements are numbered clockwise and some counter-clockwise.
    #[error("{clockwise} of {elements} elements are numbered clockwise: {}", list(.tags))]
    MixedOrientation {
        /// How many are clockwise.
        clockwise: usize,
        /// How many there are.
        elements: usize,
        /// Tags of the smaller party.
        tags: Vec<u64>,
    },
    /// Elements that are folded or collapsed.
    #[error("{} inverted or collapsed (Jacobian <= 0): {}", count(.tags.len(), "element is", "elements are"), list(.tags))]
    Inverted {
        /// Their tags.
        tags: Vec<u64>,
    },
    /// An edge with several mid-side nodes or a hanging one.
    #[error("elements {first} and {second} share an edge but not its mid-side node")]
    HangingNode {
        /// Element or line.
        first: u64,
        /// Element or line.
        second: u64,
    },
    /// Two elements lie on the same side of an edge.
    #[error("elements {first} and {second} overlap: both lie on the same side of an edge")]
    Overlapping {
        /// Element.
        first: u64,
        /// Element.
        second: u64,
    },
}

fn count(n: usize, one: &str, many: &str) -> String {
    format!("{n} {}", if n == 1 { one } else { many })
}

/// The first tags of a list and how many more there are.
pub(super) fn list(tags: &[u64]) -> String {
    const SHOWN: usize = 8;
    let shown: Vec<String> = tags.iter().take(SHOWN).map(u64::to_string).collect();
    match tags.len().saturating_sub(SHOWN) {
        0 => shown.join(", "),
        more => format!("{} and {more} more", shown.join(", ")),
    }
}
