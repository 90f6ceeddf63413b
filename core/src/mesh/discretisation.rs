//! The discrete body: nodes, elements, supports, cavities, tractions, boundary loops.
//!
//! Node numbering of an element: corners counter-clockwise, then mid-side nodes in the order of the sides (side k runs
//! from corner k to corner k + 1), then the centre node. `Tri7`: 3 corners, 3 mid-sides, the bubble's node at the
//! centroid of the corners' and mid-sides' shape.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

pub use crate::geometry::Obstacle;

/// Finite elements, each with its pressure condensed inside it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ElementKind {
    /// Bilinear displacement, constant pressure (mean dilatation), 4 nodes.
    Quad4,
    /// Biquadratic displacement, discontinuous linear pressure, 9 nodes.
    Quad9,
    /// P2 with bubble, discontinuous linear pressure (Crouzeix-Raviart), 7 nodes.
    Tri7,
}

impl ElementKind {
    /// Nodes of an element.
    pub fn nodes(self) -> usize {
        match self {
            Self::Quad4 => 4,
            Self::Quad9 => 9,
            Self::Tri7 => 7,
        }
    }
}

/// Elements of one kind.
#[derive(Clone, Debug)]
pub struct ElementBlock {
    /// Their kind.
    pub kind: ElementKind,
    /// Node indices, `kind.nodes()` per element.
    pub nodes: Vec<u32>,
    /// Index into the list of material laws, one per element.
    pub material: Vec<u16>,
    /// Tag in the source file, one per element (for an actuator its index), for messages.
    pub tag: Vec<u32>,
}

impl ElementBlock {
    /// Number of elements.
    pub fn len(&self) -> usize {
        self.material.len()
    }

    /// Whether the block is empty.
    pub fn is_empty(&self) -> bool {
        self.material.is_empty()
    }
}

/// Reference positions (mm) and elements.
#[derive(Clone, Debug, Default)]
pub struct Mesh {
    /// Node positions.
    pub nodes: Vec<[f64; 2]>,
    /// Elements by kind.
    pub blocks: Vec<ElementBlock>,
}

/// An edge of the boundary; `mid` is `None` for a straight two-node edge.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BoundaryEdge {
    /// First and last node.
    pub ends: [u32; 2],
    /// Mid-side node.
    pub mid: Option<u32>,
}

/// A closed loop of the boundary with the solid on its left.
#[derive(Clone, Debug, Default)]
pub struct BoundaryLoop {
    /// Edges in order.
    pub edges: Vec<BoundaryEdge>,
    /// For each edge whether its first node is a corner of the shape.
    pub starts_at_corner: Vec<bool>,
}

/// A cavity under pressure: work p * area.
#[derive(Clone, Debug)]
pub struct Cavity {
    /// The pressure channel.
    pub channel: usize,
    /// Edges in order with the cavity on their left, so that 1/2 the integral of (x dy - y dx) is its area.
    pub edges: Vec<BoundaryEdge>,
    /// Empty where the edges close; else the fixed points through which a polyline from the last edge's end to the first
    /// edge's start closes the area. An end that slides on a straight support is followed by a point of that line.
    pub closing_points_mm: Vec<[f64; 2]>,
    /// Whether the edges close on themselves.
    pub closed: bool,
}

/// A prescribed displacement component of a node. Those of several channels add up, so that a schedule can lead a node along
/// any polyline.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Support {
    /// Node.
    pub node: u32,
    /// 0 for x, 1 for y.
    pub component: u8,
    /// Displacement at the full value of the channel, mm.
    pub displacement_mm: f64,
    /// The channel with which it ramps.
    pub channel: usize,
}

/// A dead traction per reference length on edges.
#[derive(Clone, Debug)]
pub struct Traction {
    /// The channel that scales it.
    pub channel: usize,
    /// MPa at the channel's largest absolute value.
    pub mpa: [f64; 2],
    /// Edges.
    pub edges: Vec<BoundaryEdge>,
}

/// A body ready for assembly.
#[derive(Clone, Debug, Default)]
pub struct Discretisation {
    /// Nodes and elements.
    pub mesh: Mesh,
    /// Prescribed displacements, at most one per node, component and channel.
    pub supports: Vec<Support>,
    /// Cavities under pressure; several may share a channel.
    pub cavities: Vec<Cavity>,
    /// Dead tractions.
    pub tractions: Vec<Traction>,
    /// All boundary loops of the solid, for gaps, crossings and pictures: outlines first, then voids.
    pub boundary: Vec<BoundaryLoop>,
    /// Rigid obstacles.
    pub obstacles: Vec<Obstacle>,
    /// How surfaces that meet act on each other; `None`: not at all.
    pub contact: Option<Contact>,
    /// Which parts of the boundary may act on each other; `None`: all.
    pub partners: Option<Partners>,
    /// Region of each element, over all blocks in order, for limits that are stated part by part; empty: one region.
    pub regions: Regions,
}

/// Contact of a body with itself and with obstacles.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Contact {
    /// Surfaces farther apart than this do not act on each other, mm.
    pub activation_mm: f64,
    /// Whether it is computed from the start; else from the state on at which surfaces first come that near.
    pub from_start: bool,
}

/// Parts of the boundary that may act on each other, where not all do. Obstacles act on every part.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Partners {
    /// Named groups in which a boundary edge is, as bits of their numbers, by its two end nodes.
    pub of_edge: BTreeMap<[u32; 2], u64>,
    /// Groups of which the edges may act on each other, by their numbers.
    pub pairs: Vec<[u32; 2]>,
}

impl Partners {
    /// The groups of an edge.
    pub fn groups(&self, edge: &BoundaryEdge) -> u64 {
        self.of_edge.get(&edge.ends).copied().unwrap_or(0)
    }

    /// Whether edges in these groups may act on each other.
    pub fn meet(&self, a: u64, b: u64) -> bool {
        let are = |[p, q]: [u32; 2]| (a >> p) & (b >> q) & 1 == 1;
        self.pairs.iter().any(|&[p, q]| are([p, q]) || are([q, p]))
    }
}

/// A partition of the solid that follows the elements, so that it does not change as nodes move.
#[derive(Clone, Debug, Default)]
pub struct Regions {
    /// Number of regions.
    pub count: usize,
    /// Region per element, over all blocks in order.
    pub of_element: Vec<u16>,
}

impl Regions {
    /// Merges the regions whose indices are the same but for a multiple of `period`.
    pub fn fold(&mut self, period: usize) {
        if period == 0 || self.count <= period {
            return;
        }
        for region in &mut self.of_element {
            *region %= period as u16;
        }
        self.count = period;
    }
}
