//! One design at one p/mu.

use serde::Serialize;
use serde_json::json;

use super::super::bench::CpuClock;
use super::super::bench::kind_name;
use super::confirm::{Confirmation, confirm};
use super::{MATERIALS, Sample};
use crate::equilibrium::LimitKind;
use crate::evaluate::{SceneAnswer, SceneOptions, SceneStatus, solve_scene};
use crate::fault::Faults;
use crate::geometry::LayoutBoxes;
use crate::scene::{Scene, read_scene};

/// A limit as the table says it.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct LimitLine {
    /// Its kind.
    pub kind: LimitKind,
    /// Leg, from 0.
    pub leg: usize,
    /// Pressures, kPa.
    pub pressure_kpa: Vec<f64>,
}

impl LimitLine {
    /// Name of its kind.
    pub fn kind_name(&self) -> String {
        kind_name(self.kind)
    }
}

/// A design at one p/mu.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct DesignLine {
    /// Index of the design.
    pub design: usize,
    /// Where it comes from.
    pub stratum: super::Origin,
    /// Its 16 coordinates, mm.
    pub x: Vec<f64>,
    /// p/mu at 15 kPa.
    pub p_over_mu: f64,
    /// How it ended; a limit that was not confirmed is `not_converged`.
    pub status: SceneStatus,
    /// Why it did not converge, or was not meshed.
    pub reason: Option<String>,
    /// The limit, if there is one.
    pub limit: Option<LimitLine>,
    /// What the second path said of it.
    pub confirmation: Option<Confirmation>,
    /// Newton iterations.
    pub newton_iterations: usize,
    /// Factorisations.
    pub factorisations: usize,
    /// Largest averaged stretch over the path.
    pub max_stretch: f64,
    /// Most negative pivots of a state of the path.
    pub negative_pivots: usize,
    /// Whether walls cross, corner folds apart.
    pub walls_overlap: bool,
    /// Newton iterations at which surfaces act on each other.
    pub contact_steps: usize,
    /// Penetration of surfaces over the path, mm.
    pub penetration_mm: f64,
    /// CPU seconds, without the second path.
    pub cpu_s: f64,
    /// CPU seconds of the second path.
    pub confirm_cpu_s: f64,
}

/// The scene of a design; `contact` is `off` or `auto`.
///
/// # Errors
/// Faults of a design that is no stacked pair of simple chambers.
pub(super) fn scene(x: &[f64], material: &str, contact: bool) -> Result<Scene, Faults> {
    let contact = if contact { "auto" } else { "off" };
    let units = LayoutBoxes::PAPER.units(x).unwrap_or_default();
    let chambers = units.first().map(|unit| unit.chambers_mm.clone());
    let document = json!({
        "version": 1,
        "actuator": {"repeat": 3, "chambers_mm": chambers.unwrap_or_default()},
        "material": material,
        "actuation": {"schedule": "hold", "pressure_kpa": 15, "load_steps_per_leg": 4},
        "contact": contact,
        "probes": {"tip": [160, 40]},
        "objective": {"kind": "enclosed_area", "probe": "tip"}
    });
    read_scene(&document, std::path::Path::new(""))
}

/// Solves a design at the p/mu of an entry of [`MATERIALS`], with contact or without, and confirms a limit.
///
/// # Errors
/// Faults of a design that is no stacked pair of simple chambers.
pub fn solve_design(
    sample: &Sample,
    material: usize,
    contact: bool,
    clock: &mut dyn CpuClock,
) -> Result<DesignLine, Faults> {
    let (p_over_mu, record) = MATERIALS[material % MATERIALS.len()];
    let scene = scene(&sample.x, record, contact)?;
    let started = clock.cpu_s();
    let answer = solve_scene(&scene, &SceneOptions::default(), clock)?.answer;
    let solved = clock.cpu_s();
    let confirmation = answer
        .limit
        .as_ref()
        .map(|limit| confirm(&scene, limit, clock));
    let mut line = line(sample, p_over_mu, &answer);
    line.cpu_s = solved - started;
    line.confirm_cpu_s = clock.cpu_s() - solved;
    if let Some(refuted) = confirmation.as_ref().filter(|c| !c.confirmed) {
        line.status = SceneStatus::NotConverged;
        line.reason = Some(format!("the second path: {}", refuted.said));
    }
    line.confirmation = confirmation;
    Ok(line)
}

fn line(sample: &Sample, p_over_mu: f64, answer: &SceneAnswer) -> DesignLine {
    DesignLine {
        design: sample.index,
        stratum: sample.origin,
        x: sample.x.clone(),
        p_over_mu,
        status: answer.status,
        reason: answer.reason.clone(),
        limit: answer.limit.as_ref().map(|limit| LimitLine {
            kind: limit.kind,
            leg: limit.leg,
            pressure_kpa: limit.pressure_kpa.clone(),
        }),
        confirmation: None,
        newton_iterations: answer.work.newton_iterations,
        factorisations: answer.work.factorisations,
        max_stretch: answer.path.iter().fold(1.0, |m, s| m.max(s.max_stretch)),
        negative_pivots: answer
            .path
            .iter()
            .map(|s| s.negative_pivots)
            .max()
            .unwrap_or(0),
        walls_overlap: answer
            .walls_overlap
            .as_ref()
            .is_some_and(|w| !w.corner_fold),
        contact_steps: answer.work.contact_steps,
        penetration_mm: answer.contact.as_ref().map_or(0.0, |c| c.penetration_mm),
        cpu_s: 0.0,
        confirm_cpu_s: 0.0,
    }
}
