//! Meshes: the mesher of fixed topology, its smooth map from the design, and meshes from files.

mod discretisation;
pub mod gmsh;

pub use discretisation::{
    BoundaryEdge, BoundaryLoop, Cavity, Discretisation, ElementBlock, ElementKind, Mesh, Support,
    Traction,
};
