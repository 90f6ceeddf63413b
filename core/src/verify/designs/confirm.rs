//! A second path to a limit.

use serde::Serialize;

use super::super::bench::{CpuClock, kind_name};
use crate::equilibrium::{Control, Limit, LimitKind};
use crate::evaluate::{SceneOptions, SceneStatus, solve_scene};
use crate::geometry::{MeshPlan, PlanElement};
use crate::scene::{Body, Scene};

/// Admissible relative distance of the two limits' loads.
const WITHIN: f64 = 0.02;
/// Load steps a leg of the second path: none of them is a state of the first one's but the rows of the schedule.
const STEPS: usize = 3;

/// What the second path said.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Confirmation {
    /// Whether it found a limit of the same kind within 2 % of the load.
    pub confirmed: bool,
    /// Kind of its limit.
    pub kind: Option<LimitKind>,
    /// Pressures of its limit, kPa.
    pub pressure_kpa: Option<Vec<f64>>,
    /// What it found, for people.
    pub said: String,
}

impl Confirmation {
    /// Name of the kind that it found; empty where it found none.
    pub fn kind_name(&self) -> String {
        self.kind.map_or(String::new(), kind_name)
    }
}

/// Goes to a limit again, led by the area of the cavities, with steps of its own, every element split in two by two.
pub fn confirm(scene: &Scene, limit: &Limit, clock: &mut dyn CpuClock) -> Confirmation {
    let mut again = scene.clone();
    again.actuation.load_steps_per_leg = STEPS;
    let plan = match &scene.body {
        Body::Actuator(chain) => {
            MeshPlan::choose(&chain.actuator, PlanElement::Quad9, scene.mesh.size())
                .ok()
                .map(|plan| plan.refined(2))
        }
        Body::MeshFile(_) => None,
    };
    let options = SceneOptions {
        plan,
        control: Control::CavityArea,
        ..SceneOptions::default()
    };
    let answer = match solve_scene(&again, &options, clock) {
        Ok(solution) => solution.answer,
        Err(faults) => return refused(faults.to_string()),
    };
    let Some(second) = answer.limit else {
        return refused(match (answer.status, answer.reason) {
            (SceneStatus::Ok, _) => "every state has an equilibrium".to_owned(),
            (status, reason) => format!("{status:?}: {}", reason.unwrap_or_default()),
        });
    };
    let confirmed = second.kind == limit.kind
        && second.leg == limit.leg
        && distance(&second.pressure_kpa, &limit.pressure_kpa) <= WITHIN;
    Confirmation {
        confirmed,
        kind: Some(second.kind),
        said: format!(
            "{:?} on leg {} at {:?} kPa",
            second.kind, second.leg, second.pressure_kpa
        ),
        pressure_kpa: Some(second.pressure_kpa),
    }
}

fn refused(said: String) -> Confirmation {
    Confirmation {
        confirmed: false,
        kind: None,
        pressure_kpa: None,
        said,
    }
}

/// Distance of two loads over the larger one.
fn distance(a: &[f64], b: &[f64]) -> f64 {
    let size = |p: &[f64]| p.iter().fold(0.0, |m: f64, p| m.max(p.abs()));
    let apart: Vec<f64> = a.iter().zip(b).map(|(a, b)| a - b).collect();
    size(&apart) / size(a).max(size(b)).max(f64::MIN_POSITIVE)
}
