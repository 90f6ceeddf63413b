//! A verification problem as a user's files would say it, and its solution.

use serde_json::Value;

use crate::assembly::{Load, System};
use crate::equilibrium::{Observer, PathEnd, Settings};
use crate::evaluate::analysis::{Analysis, Wanted, analyse};
use crate::evaluate::contact::{ContactState, contact_of};
use crate::geometry::Point;
use crate::mesh::gmsh::{self, GmshElementKind, GmshFile};
use crate::mesh::{ElementKind, Support, locate};
use crate::objective::probe::ProbePoint;
use crate::scene::{Body, read_scene};

/// Name under which a scene of a problem expects its mesh.
pub const MESH_FILE: &str = "mesh.msh";

/// A mesh with the scene that acts on it.
pub struct Problem {
    /// The mesh.
    pub mesh: GmshFile,
    /// The scene; its `mesh_file` is [`MESH_FILE`], for whoever writes both to a folder.
    pub scene: Value,
    /// Displacements that no scene can say: those of a node at a reference place, one increment per channel, which replace
    /// the node's supports.
    pub driven: Option<Box<Drive>>,
}

/// Increments of displacement (mm) by channel of a node at a place; `None` where the node is not driven.
pub type Drive = dyn Fn(Point) -> Option<Vec<Point>>;

/// Why a problem has no solution to look at.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum Unsolved {
    /// The problem itself is wrong.
    #[error("failed to read the problem: {0}")]
    Faults(#[from] crate::fault::Faults),
    /// The body cannot be analysed.
    #[error("failed to prepare the body: {0}")]
    Body(String),
    /// The path ended early.
    #[error("failed to complete the path: {0}")]
    Path(String),
}

/// A complete path.
pub struct Solved {
    /// System, states and displacement fields.
    pub analysis: Analysis,
}

impl Problem {
    /// Solves it; every state must be reached.
    ///
    /// # Errors
    /// A problem that is wrong in itself, and a path that ends early.
    pub fn solve(&self, observer: &mut dyn Observer) -> Result<Solved, Unsolved> {
        let scene = read_scene(&self.scene, std::path::Path::new(""))?;
        let Body::MeshFile(file) = &scene.body else {
            return Err(Unsolved::Body("it has no mesh".to_owned()));
        };
        let model = gmsh::build(
            &self.mesh,
            file,
            scene.actuation.channels(),
            scene.mesh.element,
        )?;
        let mut body = model.discretisation;
        if let Some(drive) = &self.driven {
            replace_supports(drive, &body.mesh.nodes, &mut body.supports);
        }
        body.obstacles.clone_from(&scene.obstacles);
        body.contact = contact_of(scene.contact, scene.contact_activation_mm, &body)?.0;
        let probes = scene
            .probes
            .iter()
            .map(|probe| {
                let at = locate(&body.mesh, probe.at_mm)?;
                Some(ProbePoint::new(&body.mesh, at.block, at.element, at.local))
            })
            .collect::<Option<Vec<_>>>()
            .ok_or_else(|| Unsolved::Body("a probe is not in the solid".to_owned()))?;
        let settings = Settings {
            tolerance: scene.relative_residual_force_tolerance,
            ..Settings::default()
        };
        let wanted = Wanted {
            fields: true,
            ..Wanted::default()
        };
        let analysis = analyse(
            body,
            &model.laws,
            &scene.actuation,
            &probes,
            &settings,
            &wanted,
            observer,
        )
        .map_err(|error| Unsolved::Body(error.to_string()))?;
        match &analysis.end {
            PathEnd::Complete => Ok(Solved { analysis }),
            PathEnd::NoEquilibrium(limit) => Err(Unsolved::Path(format!("{limit:?}"))),
            PathEnd::NotConverged(why) => Err(Unsolved::Path(why.to_string())),
        }
    }
}

fn replace_supports(drive: &Drive, nodes: &[Point], supports: &mut Vec<Support>) {
    let of_node: Vec<Option<Vec<Point>>> = nodes.iter().map(|x| drive(*x)).collect();
    supports.retain(|s| of_node[s.node as usize].is_none());
    for (node, increments) in of_node.iter().enumerate() {
        for (channel, increment) in increments.iter().flatten().enumerate() {
            for component in 0..2_u8 {
                supports.push(Support {
                    node: node as u32,
                    component,
                    displacement_mm: increment[component as usize],
                    channel,
                });
            }
        }
    }
}

impl Solved {
    /// Displacement of a probe at a state of the path, mm.
    pub fn displacement(&self, probe: usize, state: usize) -> Point {
        self.analysis.states[state].displacement[probe]
    }

    /// Index of the last state.
    pub fn last(&self) -> usize {
        self.analysis.states.len() - 1
    }

    /// Internal forces of the nodes at a state, N per mm of depth: where nothing but supports acts, their reactions.
    pub fn internal_forces(&self, state: usize) -> Vec<Point> {
        let system: &System = &self.analysis.system;
        let channels = self.analysis.states[state].point.pressure_kpa.len();
        let unloaded = Load {
            pressure: vec![0.0; channels],
            share: vec![0.0; channels],
        };
        let mut at = system.rest();
        at.u.clone_from(&self.analysis.fields[state]);
        let mut work = system.workspace();
        work.contact_acts = false;
        system.assemble(&mut at, &unloaded, true, false, &mut work);
        work.residual
    }

    /// Contact at a state.
    ///
    /// # Errors
    /// Nothing acts.
    pub fn contact(&self, state: usize) -> Result<&ContactState, Unsolved> {
        let none = || Unsolved::Path("no surfaces touch".to_owned());
        self.analysis.states[state]
            .contact
            .as_ref()
            .ok_or_else(none)
    }

    /// Forces of the contact on the nodes at a state, N per mm of depth.
    pub fn contact_forces(&self, state: usize) -> Vec<Point> {
        let system: &System = &self.analysis.system;
        let mut at = system.rest();
        at.u.clone_from(&self.analysis.fields[state]);
        let mut forces = vec![[0.0; 2]; at.u.len()];
        if let (Some(contact), Some(touches)) =
            (&system.contact, system.touches(&at, &self.load(state)))
        {
            touches.add_gradient(contact, &mut forces);
        }
        forces.iter_mut().flatten().for_each(|f| *f = -*f);
        forces
    }

    /// The load at a state.
    fn load(&self, state: usize) -> Load {
        let states = &self.analysis.states;
        let kpa = &states[state].point.pressure_kpa;
        let largest = |channel: usize| {
            let all = states.iter().map(|s| s.point.pressure_kpa[channel].abs());
            all.fold(f64::MIN_POSITIVE, f64::max)
        };
        Load {
            pressure: kpa.iter().map(|p| 1e-3 * p).collect(),
            share: kpa
                .iter()
                .enumerate()
                .map(|(c, p)| p / largest(c))
                .collect(),
        }
    }

    /// Deformed positions of the nodes at a state, mm.
    pub fn positions(&self, state: usize) -> Vec<Point> {
        let nodes = &self.analysis.system.body.mesh.nodes;
        let moved = nodes.iter().zip(&self.analysis.fields[state]);
        moved.map(|(x, u)| [x[0] + u[0], x[1] + u[1]]).collect()
    }
}

/// The kind of a mesh file's elements that runs as `element`.
pub fn file_kind(element: ElementKind) -> GmshElementKind {
    match element {
        ElementKind::Quad4 => GmshElementKind::Quad4,
        ElementKind::Quad9 => GmshElementKind::Quad9,
        ElementKind::Tri7 => GmshElementKind::Triangle6,
    }
}
