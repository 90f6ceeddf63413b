//! The scene: one finite-element analysis as a document, checked as a whole.
//!
//! Lengths in mm, stress in MPa, pressure in kPa. [`Scene`] is the resolved document: what every default became.

pub(crate) mod actuation;
pub(crate) mod actuator;
mod material;
pub mod measure;
mod mesh_file;
mod obstacle;
mod resolved;
mod shape;
pub(crate) mod target;
#[cfg(test)]
mod tests;
pub(crate) mod validate;

use std::path::PathBuf;

use serde::{Deserialize, Serialize};

use crate::actuation::ActuationCycle;
use crate::geometry::{Actuator, MeshSize, Obstacle, Point};
use crate::material::MaterialLaw;

pub use material::{material_document, read_material, read_per_unit};
pub use measure::{Bound, Goal, Measure, Sense};
pub use validate::{DEFAULT_ACTIVATION_MM, LEAST_ACTIVATION_MM, read_scene};

/// A resolved scene; it serialises to the document that reads back to it.
#[derive(Clone, Debug, PartialEq)]
pub struct Scene {
    /// What is analysed.
    pub body: Body,
    /// Pressures over pseudo-time.
    pub actuation: ActuationCycle,
    /// Element and size.
    pub mesh: MeshRequest,
    /// Self-contact.
    pub contact: ContactMode,
    /// Surfaces farther apart than this do not act on each other, mm.
    pub contact_activation_mm: f64,
    /// Rigid obstacles.
    pub obstacles: Vec<Obstacle>,
    /// A state is accepted when its largest free nodal residual is below this times the largest nodal force.
    pub relative_residual_force_tolerance: f64,
    /// Named points of the reference shape, in the document's order.
    pub probes: Vec<Probe>,
    /// What is evaluated over the path.
    pub objective: Option<Goal<String>>,
}

/// What is analysed.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Body {
    /// A chain of units with chambers.
    Actuator(ActuatorBody),
    /// A mesh from a file.
    MeshFile(MeshFileBody),
}

/// A chain of units with one law each.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ActuatorBody {
    /// Shape.
    #[serde(flatten)]
    pub actuator: Actuator,
    /// One law per unit.
    pub materials: Vec<MaterialLaw>,
}

/// A mesh file with what acts on its groups.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct MeshFileBody {
    /// Absolute, or relative to the working directory (already joined with the scene's folder).
    pub path: PathBuf,
    /// The law of every element whose group has none of its own.
    pub material: MaterialLaw,
    /// Laws by group.
    pub materials: Vec<GroupMaterial>,
    /// Prescribed displacements.
    pub supports: Vec<GroupSupport>,
    /// Dead tractions.
    pub tractions: Vec<GroupTraction>,
    /// Follower pressures.
    pub pressures: Vec<GroupPressure>,
    /// Pairs of groups of which the edges may act on each other by contact; empty: all edges.
    pub contact_pairs: Vec<[String; 2]>,
}

/// The law of a group of elements.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct GroupMaterial {
    /// Physical group.
    pub group: String,
    /// Its law.
    pub material: MaterialLaw,
}

/// A prescribed displacement of a group of nodes.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct GroupSupport {
    /// Physical group.
    pub group: String,
    /// Whether x and y are fixed.
    pub fix: [bool; 2],
    /// Displacement of the fixed components at the full value of the channel, mm.
    pub displacement_mm: [f64; 2],
    /// The channel with which a non-zero displacement ramps.
    pub channel: usize,
}

/// A dead traction on a group of edges.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct GroupTraction {
    /// Physical group.
    pub group: String,
    /// Force per reference area at the channel's largest absolute value, MPa.
    pub mpa: [f64; 2],
    /// The channel that scales it.
    pub channel: usize,
}

/// A follower pressure on a group of edges; positive pushes into the solid.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct GroupPressure {
    /// Physical group.
    pub group: String,
    /// The channel that drives it.
    pub channel: usize,
}

/// Which element is used.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ElementChoice {
    /// `quad9` for an actuator; the file's own elements for a mesh file.
    #[default]
    Auto,
    /// Q1P0: bilinear displacement, constant pressure.
    Quad4,
    /// Q2P1: biquadratic displacement, linear discontinuous pressure.
    Quad9,
}

/// Element and size asked for.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct MeshRequest {
    /// Element family.
    pub element: ElementChoice,
    /// No element edge longer than this; `None`: the size rule for 1 % of the tip displacement.
    pub max_size_mm: Option<f64>,
    /// As many elements as squares of this side fill the solid, in place of a longest edge.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub mean_size_mm: Option<f64>,
}

impl MeshRequest {
    /// How fine the mesh is asked for.
    pub fn size(&self) -> MeshSize {
        let mean = self.mean_size_mm.map(MeshSize::Mean);
        mean.unwrap_or_else(|| self.max_size_mm.into())
    }
}

/// Self-contact setting.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ContactMode {
    /// Computed from the state on at which surfaces come near to each other; else left out.
    #[default]
    Auto,
    /// Left out.
    Off,
    /// Computed from the start.
    On,
}

/// A named point of the reference shape.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Probe {
    /// Its name.
    pub name: String,
    /// Its place, fixed in space when a gradient is taken, mm.
    pub at_mm: Point,
}

/// Sense in which an enclosed area counts.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Orientation {
    /// The objective is -A.
    #[default]
    CounterClockwise,
    /// The objective is +A.
    Clockwise,
}

impl Orientation {
    /// The sense in which a path encloses a signed area, so that its objective is -|A|.
    pub fn of_area(area_mm2: f64) -> Self {
        if area_mm2 < 0.0 {
            Self::Clockwise
        } else {
            Self::CounterClockwise
        }
    }
}
