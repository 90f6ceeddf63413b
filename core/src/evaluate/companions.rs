//! What becomes of a design's enclosed area beyond its own scene: with another law of the same initial modulus (*model
//! spread*, apart from the numerical error), and in a chain of nine units, for which three stand.

use serde::Serialize;

use super::answer::SceneStatus;
use super::scene::{SceneOptions, solve_scene};
use crate::equilibrium::Observer;
use crate::fault::Faults;
use crate::geometry::MeshPlan;
use crate::material::counterpart::counterpart;
use crate::objective::enclosed_area::area;
use crate::scene::{Body, Measure, Probe, Scene};

/// Units of the whole actuator.
const WHOLE: usize = 9;

/// What differs from the design's own scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Kind {
    /// The law.
    ModelSpread,
    /// The number of units.
    NineUnits,
}

/// A scene beside a design's own.
#[derive(Clone, Debug)]
pub struct Companion {
    kind: Kind,
    setting: String,
    scene: Scene,
    plan: Option<MeshPlan>,
}

/// How a companion ended.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct CompanionAnswer {
    /// What differs.
    pub kind: Kind,
    /// The same in words.
    pub setting: String,
    /// How it ended.
    pub status: SceneStatus,
    /// Enclosed area of each tip, mm^2, counter-clockwise positive; empty where the path is not complete.
    pub areas: Vec<TipArea>,
    /// Largest averaged stretch of the states that were reached.
    pub max_stretch: f64,
}

/// The area that a point of the centre line encloses.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct TipArea {
    /// The point, mm.
    pub tip_mm: [f64; 2],
    /// Its area, mm^2.
    pub enclosed_area_mm2: f64,
}

/// The companions of a scene whose objective is an area that the tip of a chain encloses, on `plan` where it has as many units;
/// none of any other. Nine units repeat the middle one, and their tips are the ends of units 8 and 9.
pub fn companions(scene: &Scene, plan: Option<&MeshPlan>) -> Vec<Companion> {
    let (Body::Actuator(chain), Some(goal)) = (&scene.body, &scene.objective) else {
        return Vec::new();
    };
    let Measure::EnclosedArea { probe, .. } = &goal.measure else {
        return Vec::new();
    };
    let Some(tip) = scene.probes.iter().find(|p| p.name == *probe) else {
        return Vec::new();
    };
    let mut other_law = scene.clone();
    let mut words = String::new();
    if let Body::Actuator(chain) = &mut other_law.body {
        for law in &mut chain.materials {
            (*law, words) = counterpart(law);
        }
    }
    other_law.probes = vec![tip.clone()];
    let mut all = vec![Companion {
        kind: Kind::ModelSpread,
        setting: words,
        scene: other_law,
        plan: plan.cloned(),
    }];
    let units = chain.actuator.units.len();
    if units < WHOLE {
        let mut whole = scene.clone();
        if let Body::Actuator(body) = &mut whole.body {
            let middle = units / 2;
            let more = WHOLE - units;
            let unit = chain.actuator.units[middle].clone();
            let law = chain.materials[middle];
            body.actuator.units.splice(middle..middle, vec![unit; more]);
            body.materials.splice(middle..middle, vec![law; more]);
        }
        let width = chain.actuator.unit_mm[0];
        whole.probes = [WHOLE - 1, WHOLE]
            .map(|unit| Probe {
                name: format!("unit-{unit}"),
                at_mm: [unit as f64 * width, tip.at_mm[1]],
            })
            .to_vec();
        whole.objective = None;
        all.push(Companion {
            kind: Kind::NineUnits,
            setting: format!("{WHOLE} units"),
            scene: whole,
            plan: None,
        });
    }
    all
}

impl Companion {
    /// Solves it.
    ///
    /// # Errors
    /// As [`solve_scene`].
    pub fn solve(&self, observer: &mut dyn Observer) -> Result<CompanionAnswer, Faults> {
        let options = SceneOptions {
            plan: self.plan.clone(),
            ..SceneOptions::default()
        };
        let answer = solve_scene(&self.scene, &options, observer)?.answer;
        let tip_area = |probe: &Probe| {
            let points: Vec<[f64; 2]> = answer
                .path
                .iter()
                .filter_map(|state| state.displacement_mm.get(&probe.name).copied())
                .collect();
            TipArea {
                tip_mm: probe.at_mm,
                enclosed_area_mm2: area(&points),
            }
        };
        let whole = answer.status == SceneStatus::Ok;
        let stretches = answer.path.iter().map(|state| state.max_stretch);
        Ok(CompanionAnswer {
            kind: self.kind,
            setting: self.setting.clone(),
            status: answer.status,
            areas: if whole {
                self.scene.probes.iter().map(tip_area).collect()
            } else {
                Vec::new()
            },
            max_stretch: stretches.fold(1.0, f64::max),
        })
    }
}
