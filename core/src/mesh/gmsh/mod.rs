//! Gmsh files (MSH 4.1 ASCII): reading with named physical groups, writing, and the discrete body of a scene that
//! names a mesh file; and the way out, [`export`], for a body that was meshed here.
//!
//! A file travels through four stages: [`read`] gives its groups, nodes and elements as they stand ([`GmshFile`]);
//! `solid` turns them into counter-clockwise elements of our kinds, raising lower orders; `boundary` finds the outline,
//! the voids and the chains of edges; [`load`] adds what acts on the groups.
//!
//! Source of the format: Gmsh reference manual, section "MSH file format", version 4.1.

mod boundary;
mod cavity;
mod error;
mod export;
mod file;
mod groups;
mod jacobian;
mod model;
mod read;
mod section;
mod solid;
mod structured;
#[cfg(test)]
mod tests;
mod write;

pub use error::GmshError;
pub use export::export;
pub use file::{GmshElement, GmshElementKind, GmshFile, GmshNode, PhysicalGroup};
pub use model::{MeshFileModel, NodeOrigin, build, discretise, load};
pub use read::{parse, read};
pub use structured::structured;
pub use write::write;
