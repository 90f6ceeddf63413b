//! What `salp solve` answers (`formats.md`): one document, its fields in a fixed order.

use std::collections::BTreeMap;

use serde::Serialize;

use super::contact::ContactAnswer;
use crate::equilibrium::{Limit, LossOfUniqueness, PathWork};
use crate::study::{Note, OverlapReport};

/// How a scene ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum SceneStatus {
    /// Every state was reached.
    Ok,
    /// No equilibrium beyond a load.
    NoEquilibrium,
    /// The shape cannot be meshed.
    InfeasibleGeometry,
    /// A failure of ours.
    NotConverged,
}

/// What was left out, and why.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct LeftOut {
    /// The part.
    pub what: String,
    /// The reason.
    pub why: String,
}

/// A state of the path.
#[derive(Clone, Debug, Serialize)]
pub struct StateAnswer {
    /// Leg, from 0.
    pub leg: usize,
    /// Fraction of the leg.
    pub fraction: f64,
    /// Channel pressures, kPa.
    pub pressure_kpa: Vec<f64>,
    /// Displacement of each probe, mm.
    pub displacement_mm: BTreeMap<String, [f64; 2]>,
    /// Area per channel, mm^2.
    pub cavity_area_mm2: Vec<f64>,
    /// Largest averaged stretch.
    pub max_stretch: f64,
    /// Largest stretch at a quadrature point; depends on the mesh.
    pub max_stretch_raw: f64,
    /// Least gap across a void, mm.
    pub min_gap_mm: Option<f64>,
    /// Negative pivots of the tangent.
    pub negative_pivots: usize,
    /// Residual over the force scale.
    pub residual: f64,
    /// Smallest J.
    pub min_jacobian: f64,
    /// Contact, where surfaces act on each other.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub contact: Option<StateContactAnswer>,
}

/// The mesh that ran.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct MeshAnswer {
    /// Element kinds, joined by `+`.
    pub element: String,
    /// Number of elements.
    pub elements: usize,
    /// Free displacement unknowns.
    pub dofs: usize,
    /// Longest element edge, mm.
    pub max_size_mm: f64,
    /// Least scaled corner Jacobian of a mapped mesh.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub scaled_jacobian: Option<f64>,
}

/// Contact at a state.
#[derive(Clone, Debug, Serialize)]
pub struct StateContactAnswer {
    /// Least distance of two points that act, away from corners that fold shut, mm; `None` where only such corners act.
    pub least_distance_mm: Option<f64>,
    /// Largest contact pressure, kPa.
    pub max_pressure_kpa: f64,
    /// Energy of the contact per mm of depth, N.
    pub energy_n: f64,
    /// Force on each obstacle per mm of depth, N/mm.
    pub obstacle_force_n_per_mm: BTreeMap<String, [f64; 2]>,
}

/// The answer to a scene. `seconds` is the caller's to add: the core has no clock.
#[derive(Clone, Debug, Serialize)]
pub struct SceneAnswer {
    /// How it ended.
    pub status: SceneStatus,
    /// The reason of a failure.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub reason: Option<String>,
    /// (leg + fraction) / legs at the last converged state.
    pub load_fraction_reached: f64,
    /// Where equilibrium ended.
    pub limit: Option<Limit>,
    /// Whether no second branch met the path.
    pub unique: bool,
    /// The first state at which one did.
    pub loss_of_uniqueness: Option<LossOfUniqueness>,
    /// First state where walls cross.
    pub walls_overlap: Option<OverlapReport>,
    /// States of the path.
    pub path: Vec<StateAnswer>,
    /// The objective, where there is one and the path is complete.
    pub objective: Option<f64>,
    /// Enclosed area of the objective's probe, counter-clockwise positive, mm^2.
    pub enclosed_area_mm2: Option<f64>,
    /// Whether that path crosses itself.
    pub self_crossing: bool,
    /// What the polygon misses of a smooth path, mm^2.
    pub area_sampling_error_mm2: Option<f64>,
    /// The mesh.
    pub mesh: MeshAnswer,
    /// The scene as it acted.
    pub resolved: serde_json::Value,
    /// Counts.
    pub work: PathWork,
    /// Contact, where surfaces acted on each other.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub contact: Option<ContactAnswer>,
    /// What was left out.
    pub left_out: Vec<LeftOut>,
    /// What a reader of the numbers should know: laws used beyond their range.
    pub notes: Vec<Note>,
}
