//! The discrete body of a scene that names a mesh file.

use super::boundary::Boundary;
use super::file::GmshFile;
use super::groups;
use super::read::read;
use super::solid::solid;
use crate::fault::Faults;
use crate::material::MaterialLaw;
use crate::mesh::{Discretisation, ElementKind, Regions};
use crate::scene::{ElementChoice, MeshFileBody};

/// A mesh file, ready for assembly, with the way back to the file's nodes.
#[derive(Clone, Debug)]
pub struct MeshFileModel {
    /// Nodes, elements and what acts on them.
    pub discretisation: Discretisation,
    /// Laws; elements hold indices into them.
    pub laws: Vec<MaterialLaw>,
    /// Where each node comes from.
    pub origins: Vec<NodeOrigin>,
}

/// Where a node comes from.
#[derive(Clone, Debug, PartialEq)]
pub enum NodeOrigin {
    /// From the file, with its tag.
    File(u64),
    /// Added: a weighted mean of nodes with smaller indices, which it follows when they move.
    Mean(Vec<(u32, f64)>),
}

impl MeshFileModel {
    /// Pulls a gradient with respect to all node positions back to the file's nodes: what an added node has is shared
    /// among those that it follows. Entries of added nodes are zero afterwards.
    pub fn pull_back(&self, gradient: &mut [[f64; 2]]) {
        for (node, origin) in self.origins.iter().enumerate().rev() {
            if let NodeOrigin::Mean(parents) = origin {
                let g = std::mem::take(&mut gradient[node]);
                for (parent, weight) in parents {
                    for i in 0..2 {
                        gradient[*parent as usize][i] += weight * g[i];
                    }
                }
            }
        }
    }

    /// Nodes of the pressure groups that come from the file, as (tag, node), ascending in the tag.
    pub fn pressure_nodes(&self) -> Vec<(u64, u32)> {
        let mut nodes: Vec<(u64, u32)> = self
            .discretisation
            .cavities
            .iter()
            .flat_map(|cavity| &cavity.edges)
            .flat_map(|edge| edge.ends.into_iter().chain(edge.mid))
            .filter_map(|node| match self.origins[node as usize] {
                NodeOrigin::File(tag) => Some((tag, node)),
                NodeOrigin::Mean(_) => None,
            })
            .collect();
        nodes.sort_unstable();
        nodes.dedup();
        nodes
    }
}

/// Reads a scene's mesh file; `channels` is the number of channels of its schedule. The answer is the body and its laws.
///
/// # Errors
/// Every fault of the file and of what the scene says about its groups, at `mesh_file`, `mesh.element`, `supports[i]`,
/// `tractions[i]`, `pressures[i]` and `materials[i]`.
pub fn discretise(
    body: &MeshFileBody,
    channels: usize,
    element: ElementChoice,
) -> Result<(Discretisation, Vec<MaterialLaw>), Faults> {
    load(body, channels, element).map(|model| (model.discretisation, model.laws))
}

/// As [`discretise`], with the way back to the file's nodes.
///
/// # Errors
/// As [`discretise`].
pub fn load(
    body: &MeshFileBody,
    channels: usize,
    element: ElementChoice,
) -> Result<MeshFileModel, Faults> {
    let file = read(&body.path).map_err(|e| mesh_file_fault(&e))?;
    build(&file, body, channels, element)
}

fn mesh_file_fault(error: &super::GmshError) -> Faults {
    let mut faults = Faults::default();
    faults.add("mesh_file", error.to_string());
    faults
}

/// As [`load`], from a file that is already read; the body's path is not looked at.
///
/// # Errors
/// As [`discretise`].
pub fn build(
    file: &GmshFile,
    body: &MeshFileBody,
    channels: usize,
    element: ElementChoice,
) -> Result<MeshFileModel, Faults> {
    let mut faults = Faults::default();
    groups::check_names(body, file, channels, &mut faults);
    let built =
        solid(file).and_then(|solid| Boundary::of(&solid).map(|boundary| (solid, boundary)));
    let (mut solid, boundary) = match built {
        Ok(both) => both,
        Err(error) => {
            faults.0.extend(mesh_file_fault(&error).0);
            return Err(faults);
        }
    };
    check_element(element, &solid.mesh, &mut faults);
    let laws = groups::materials(body, file, &mut solid, &mut faults);
    let supports = groups::supports(body, file, &solid, &mut faults);
    let tractions = groups::tractions(body, file, &solid, &boundary, &mut faults);
    let cavities = groups::pressures(body, file, &solid, &boundary, &supports, &mut faults);
    let partners = groups::partners(body, file, &solid, &boundary, &mut faults);
    let loops = boundary.loops(&solid.mesh.nodes);
    faults.check(MeshFileModel {
        discretisation: Discretisation {
            mesh: solid.mesh,
            supports,
            cavities,
            tractions,
            boundary: loops,
            obstacles: Vec::new(),
            contact: None,
            partners,
            regions: Regions::default(),
        },
        laws,
        origins: solid.origins,
    })
}

/// The file decides what its elements are; a scene may only agree.
fn check_element(element: ElementChoice, mesh: &crate::mesh::Mesh, faults: &mut Faults) {
    let wanted = match element {
        ElementChoice::Auto => return,
        ElementChoice::Quad4 => ElementKind::Quad4,
        ElementChoice::Quad9 => ElementKind::Quad9,
    };
    let others: Vec<&str> = mesh
        .blocks
        .iter()
        .filter(|b| b.kind != wanted)
        .map(|b| match b.kind {
            ElementKind::Quad4 => "quad4",
            ElementKind::Quad9 => "quad9",
            ElementKind::Tri7 => "tri7",
        })
        .collect();
    if !others.is_empty() {
        faults.add(
            "mesh.element",
            format!(
                "the mesh file runs with {}; expected \"auto\"",
                others.join(" and ")
            ),
        );
    }
}
