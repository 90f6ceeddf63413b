//! A Gmsh file as it stands.

/// Groups, nodes and elements of a file.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct GmshFile {
    /// Named physical groups.
    pub groups: Vec<PhysicalGroup>,
    /// Nodes, in the file's order.
    pub nodes: Vec<GmshNode>,
    /// Elements of every dimension, in the file's order.
    pub elements: Vec<GmshElement>,
}

/// A named physical group. One name may stand for groups of several dimensions.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PhysicalGroup {
    /// 0 points, 1 lines, 2 surfaces.
    pub dimension: u8,
    /// Its number, unique in its dimension.
    pub tag: u32,
    /// Its name.
    pub name: String,
}

/// A node.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GmshNode {
    /// Its number, unique in the file.
    pub tag: u64,
    /// Position, mm.
    pub at_mm: [f64; 3],
}

/// An element.
#[derive(Clone, Debug, PartialEq)]
pub struct GmshElement {
    /// Its number, unique in the file.
    pub tag: u64,
    /// Shape and order.
    pub kind: GmshElementKind,
    /// Tags of its nodes: corners, mid-sides, centre.
    pub nodes: Vec<u64>,
    /// Indices into [`GmshFile::groups`] of the groups that hold it.
    pub groups: Vec<usize>,
}

/// The shapes that a plane body may use.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum GmshElementKind {
    /// A point.
    Point,
    /// A straight edge.
    Line2,
    /// An edge with a mid-side node.
    Line3,
    /// A straight triangle.
    Triangle3,
    /// A triangle with mid-side nodes.
    Triangle6,
    /// A straight quadrilateral.
    Quad4,
    /// A quadrilateral with mid-side nodes.
    Quad8,
    /// A quadrilateral with mid-side nodes and a centre.
    Quad9,
}

impl GmshElementKind {
    /// All kinds.
    pub const ALL: [Self; 8] = [
        Self::Point,
        Self::Line2,
        Self::Line3,
        Self::Triangle3,
        Self::Triangle6,
        Self::Quad4,
        Self::Quad8,
        Self::Quad9,
    ];

    /// The number of the kind in a file.
    pub fn number(self) -> u32 {
        match self {
            Self::Point => 15,
            Self::Line2 => 1,
            Self::Line3 => 8,
            Self::Triangle3 => 2,
            Self::Triangle6 => 9,
            Self::Quad4 => 3,
            Self::Quad8 => 16,
            Self::Quad9 => 10,
        }
    }

    /// The kind of a number, if a plane body may use it.
    pub fn from_number(number: u32) -> Option<Self> {
        Self::ALL.into_iter().find(|kind| kind.number() == number)
    }

    /// Dimension of the shape.
    pub fn dimension(self) -> u8 {
        match self {
            Self::Point => 0,
            Self::Line2 | Self::Line3 => 1,
            _ => 2,
        }
    }

    /// Nodes of an element.
    pub fn nodes(self) -> usize {
        match self {
            Self::Point => 1,
            Self::Line2 => 2,
            Self::Line3 | Self::Triangle3 => 3,
            Self::Quad4 => 4,
            Self::Triangle6 => 6,
            Self::Quad8 => 8,
            Self::Quad9 => 9,
        }
    }
}

impl GmshFile {
    /// Whether a group of this name exists, of any dimension.
    pub fn has_group(&self, name: &str) -> bool {
        self.groups.iter().any(|group| group.name == name)
    }

    /// The elements of every group of this name.
    pub fn elements_of<'a>(&'a self, name: &'a str) -> impl Iterator<Item = &'a GmshElement> + 'a {
        self.elements
            .iter()
            .filter(move |e| e.groups.iter().any(|g| self.groups[*g].name == name))
    }
}
