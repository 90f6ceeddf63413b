//! `salp gradient`: the objective's gradient in the shape of the input, and its check against central differences.

use std::collections::BTreeMap;

use serde::Serialize;

use super::answer::{SceneAnswer, SceneStatus};
use super::scene::{BodySource, SceneOptions, SceneSolution, solve_scene};
use crate::equilibrium::Observer;
use crate::fault::Faults;
use crate::geometry::Unit;
use crate::scene::{Body, Scene};

/// The gradient in the shape of the input, d objective / d mm.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(untagged)]
pub enum GradientAnswer {
    /// Of a repeated unit: summed over its copies.
    Repeated {
        /// Per chamber, corner, component.
        chambers_mm: Vec<Vec<[f64; 2]>>,
    },
    /// Of a list of units.
    Units {
        /// Per unit.
        units: Vec<Unit>,
    },
    /// Of a mesh file: nodes of its pressure groups by tag.
    Nodes {
        /// Per node.
        nodes_mm: BTreeMap<String, [f64; 2]>,
    },
}

/// One central difference.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Difference {
    /// Step, mm.
    pub step_mm: f64,
    /// (J(x + h) - J(x - h)) / 2h.
    pub value: f64,
    /// |a - d| / max(|a|, 1e-3 max_j |a_j|).
    pub error: f64,
}

/// A variable's check.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct CheckLine {
    /// Index of the variable.
    pub index: usize,
    /// Derivative by the adjoint.
    pub adjoint: f64,
    /// By differences.
    pub differences: Vec<Difference>,
    /// Least error over the steps.
    pub best_error: f64,
}

/// Bound on the best error of every variable of an answer.
pub fn check_bound(answer: &SceneAnswer) -> f64 {
    if answer.contact.is_some() { 1e-6 } else { 1e-7 }
}

/// Steps of the sweep, mm.
const STEPS_MM: [f64; 5] = [3e-2, 1e-2, 3e-3, 1e-3, 3e-4];
/// The same where surfaces act on each other: the distances over which they do near corners are hundredths of a millimetre.
const STEPS_OF_CONTACT_MM: [f64; 5] = [3e-3, 1e-3, 3e-4, 1e-4, 3e-5];
/// Tolerance of both sides of a check.
const CHECK_TOLERANCE: f64 = 1e-12;
/// Nodes of a mesh file that are checked.
const CHECKED_NODES: usize = 8;

impl SceneSolution {
    /// The gradient in the shape of the input.
    pub fn gradient(&self) -> Option<GradientAnswer> {
        let mut nodes = self.node_gradient.clone()?;
        match self.source.as_ref()? {
            BodySource::Mapped(mesh) => {
                let units = mesh.pull_back(&nodes);
                if mesh.plan().base.repeated {
                    let mut sum = units.first()?.clone();
                    for unit in &units[1..] {
                        for (s, g) in sum
                            .iter_mut()
                            .flatten()
                            .flatten()
                            .zip(unit.iter().flatten().flatten())
                        {
                            *s += g;
                        }
                    }
                    Some(GradientAnswer::Repeated { chambers_mm: sum })
                } else {
                    let units = units
                        .into_iter()
                        .map(|chambers_mm| Unit { chambers_mm })
                        .collect();
                    Some(GradientAnswer::Units { units })
                }
            }
            BodySource::File(model) => {
                model.pull_back(&mut nodes);
                let nodes_mm = model
                    .pressure_nodes()
                    .into_iter()
                    .map(|(tag, node)| (tag.to_string(), nodes[node as usize]))
                    .collect();
                Some(GradientAnswer::Nodes { nodes_mm })
            }
        }
    }
}

impl GradientAnswer {
    /// All numbers in order.
    pub fn flat(&self) -> Vec<f64> {
        match self {
            Self::Repeated { chambers_mm } => {
                chambers_mm.iter().flatten().flatten().copied().collect()
            }
            Self::Units { units } => units
                .iter()
                .flat_map(|u| u.chambers_mm.iter().flatten().flatten())
                .copied()
                .collect(),
            Self::Nodes { nodes_mm } => nodes_mm.values().flatten().copied().collect(),
        }
    }
}

/// Checks the gradient of a scene of units against central differences: both sides at tolerance 1e-12 and with the element
/// counts of the unperturbed design. Returns the answer of the unperturbed scene and a line per variable.
///
/// # Errors
/// Faults of the scene; a scene without an objective; a mesh file, whose nodes are not design variables.
pub fn check_gradient(
    scene: &Scene,
    observer: &mut dyn Observer,
) -> Result<(SceneAnswer, Vec<CheckLine>), Faults> {
    let mut faults = Faults::default();
    let mut scene = scene.clone();
    scene.relative_residual_force_tolerance = CHECK_TOLERANCE;
    if scene.objective.is_none() {
        faults.add("objective", "a gradient needs one");
        return Err(faults);
    }
    let base = solve_scene(
        &scene,
        &SceneOptions {
            gradient: true,
            path_only: true,
            ..Default::default()
        },
        observer,
    )?;
    let (Some(gradient), SceneStatus::Ok) = (base.gradient(), base.answer.status) else {
        return Ok((base.answer, Vec::new()));
    };
    let BodySource::Mapped(mesh) = base.source.as_ref().ok_or_else(Faults::default)? else {
        faults.add(
            "mesh_file",
            format!(
                "a check needs chambers; the gradient itself has {CHECKED_NODES} nodes or more"
            ),
        );
        return Err(faults);
    };
    let adjoint = gradient.flat();
    let scale = 1e-3 * adjoint.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
    let steps = match base.answer.contact {
        None => STEPS_MM,
        Some(_) => STEPS_OF_CONTACT_MM,
    };
    let mut lines = Vec::new();
    for (index, &a) in adjoint.iter().enumerate() {
        let mut line = CheckLine {
            index,
            adjoint: a,
            differences: Vec::new(),
            best_error: f64::INFINITY,
        };
        for step_mm in steps {
            let mut sides = [0.0; 2];
            let mut complete = true;
            for (side, sign) in sides.iter_mut().zip([1.0, -1.0]) {
                let mut moved = scene.clone();
                perturb(&mut moved, index, sign * step_mm);
                let options = SceneOptions {
                    plan: Some(mesh.plan().clone()),
                    path_only: true,
                    ..Default::default()
                };
                match solve_scene(&moved, &options, observer)?.answer.objective {
                    Some(value) => *side = value,
                    None => complete = false,
                }
            }
            if complete {
                let value = (sides[0] - sides[1]) / (2.0 * step_mm);
                let error = (a - value).abs() / a.abs().max(scale).max(f64::MIN_POSITIVE);
                line.best_error = line.best_error.min(error);
                line.differences.push(Difference {
                    step_mm,
                    value,
                    error,
                });
            }
        }
        lines.push(line);
    }
    Ok((base.answer, lines))
}

/// Moves one coordinate of the input.
fn perturb(scene: &mut Scene, index: usize, by: f64) {
    let Body::Actuator(chain) = &mut scene.body else {
        return;
    };
    let repeated = chain.actuator.repeated;
    if repeated {
        for unit in &mut chain.actuator.units {
            if let Some(v) = unit.chambers_mm.iter_mut().flatten().flatten().nth(index) {
                *v += by;
            }
        }
    } else if let Some(v) = chain
        .actuator
        .units
        .iter_mut()
        .flat_map(|u| u.chambers_mm.iter_mut().flatten().flatten())
        .nth(index)
    {
        *v += by;
    }
}
