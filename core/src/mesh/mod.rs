//! Meshes: the mesher of fixed topology, its smooth map from the design, and meshes from files.

mod discretisation;
pub mod gmsh;
mod locate;
mod mapped;
pub mod quality;
pub mod vtu;

pub use discretisation::{
    BoundaryEdge, BoundaryLoop, Cavity, Contact, Discretisation, ElementBlock, ElementKind, Mesh,
    Obstacle, Partners, Regions, Support, Traction,
};
pub use locate::{Location, locate};
pub use mapped::{MappedMesh, build};
