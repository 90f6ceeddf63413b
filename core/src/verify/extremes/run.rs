//! Runs an extreme scene and what its numbers are held against.

use serde::Serialize;
use serde_json::json;

use super::super::bench::{CpuClock, kind_name, serde_name};
use super::{Against, Expected, Extreme, is_ballooning};
use crate::evaluate::{SceneAnswer, SceneOptions, SceneStatus, StateAnswer, solve_scene};
use crate::mesh::ElementKind;
use crate::scene::read_scene;

/// Equal paths by other load steps differ by no more than this part.
const SAME: f64 = 1e-5;
/// Below this reach of the tip a difference is not divided by it, mm.
const LEAST_REACH_MM: f64 = 0.01;

/// One extreme scene on one element.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ExtremeLine {
    /// What is driven to an extreme.
    pub group: &'static str,
    /// How far.
    pub name: String,
    /// The element.
    pub element: ElementKind,
    /// How it ended, with kind and pressure of a limit.
    pub status: String,
    /// How it must end.
    pub expected: String,
    /// Why.
    pub why: &'static str,
    /// Newton iterations.
    pub newton_iterations: usize,
    /// Factorisations.
    pub factorisations: usize,
    /// What the error is.
    pub against: String,
    /// Error; `None` where there is none to compare.
    pub error: Option<f64>,
    /// The largest that passes.
    pub bound: f64,
    /// Whether status and error are as they must be.
    pub passed: bool,
    /// CPU seconds of the scene itself.
    pub cpu_s: f64,
    /// CPU seconds with what it is held against.
    pub cpu_in_all_s: f64,
}

/// Solves a document; a fault of it is a status as well.
fn solve(document: &serde_json::Value, clock: &mut dyn CpuClock) -> Result<SceneAnswer, String> {
    let scene = read_scene(document, std::path::Path::new("")).map_err(|f| f.to_string())?;
    solve_scene(&scene, &SceneOptions::default(), clock)
        .map(|solution| solution.answer)
        .map_err(|faults| faults.to_string())
}

fn status(answer: &Result<SceneAnswer, String>) -> String {
    match answer {
        Err(faults) => format!("bad input: {faults}"),
        Ok(answer) => match (answer.status, &answer.limit) {
            (SceneStatus::Ok, _) => "ok".into(),
            (SceneStatus::NoEquilibrium, Some(limit)) => format!(
                "no_equilibrium, {} at {:.4} kPa",
                kind_name(limit.kind),
                limit.pressure_kpa.first().unwrap_or(&0.0)
            ),
            (status, _) => format!(
                "{}: {}",
                serde_name(&status),
                answer.reason.as_deref().unwrap_or("no reason")
            ),
        },
    }
}

/// Largest relative difference of two paths at the rows of their schedule: of the tip, and of the chambers' areas.
fn difference(a: &SceneAnswer, b: &SceneAnswer) -> f64 {
    let rows = |answer: &SceneAnswer| -> Vec<StateAnswer> {
        let rows = answer.path.iter().filter(|s| s.fraction == 1.0);
        rows.cloned().collect()
    };
    let tip = |state: &StateAnswer| state.displacement_mm["tip"];
    let (a, b) = (rows(a), rows(b));
    let reach = b
        .iter()
        .map(|state| tip(state)[0].hypot(tip(state)[1]))
        .fold(LEAST_REACH_MM, f64::max);
    let mut worst = 0.0_f64;
    for (one, other) in a.iter().zip(&b) {
        let (p, q) = (tip(one), tip(other));
        worst = worst.max((p[0] - q[0]).hypot(p[1] - q[1]) / reach);
        for (p, q) in one.cavity_area_mm2.iter().zip(&other.cavity_area_mm2) {
            worst = worst.max(((p - q) / q).abs());
        }
    }
    worst
}

/// Runs an extreme scene on an element.
pub fn run_extreme(
    extreme: &Extreme,
    element: ElementKind,
    clock: &mut dyn CpuClock,
) -> ExtremeLine {
    let started = clock.cpu_s();
    let document = extreme.document(element);
    let answer = solve(&document, clock);
    let cpu_s = clock.cpu_s() - started;
    let as_expected = match (&answer, &extreme.expected) {
        (Ok(answer), Expected::Ok) => answer.status == SceneStatus::Ok,
        (Ok(answer), Expected::NoEquilibrium { .. }) => {
            answer.limit.as_ref().is_some_and(|l| is_ballooning(l.kind))
        }
        (Err(_), _) => false,
    };
    let mut other = |change: &dyn Fn(&mut serde_json::Value)| {
        let mut document = document.clone();
        change(&mut document);
        let other = solve(&document, clock).ok()?;
        let answer = answer.as_ref().ok()?;
        (as_expected && other.status == SceneStatus::Ok).then(|| difference(answer, &other))
    };
    let (against, error, bound) = match (&extreme.against, &extreme.expected) {
        (Against::OtherSteps(steps), _) => {
            let error = other(&|d| d["actuation"]["load_steps_per_leg"] = json!(steps));
            (format!("{steps} load steps a leg"), error, SAME)
        }
        (Against::Incompressible { slope }, _) => {
            let bulk = document["material"]["bulk_over_shear"]
                .as_f64()
                .unwrap_or(1e6);
            let error = if bulk == 1e6 {
                other(&|d| d["actuation"]["load_steps_per_leg"] = json!(3))
            } else {
                other(&|d| d["material"]["bulk_over_shear"] = json!(1e6))
            };
            ("K/mu = 1e6".into(), error, slope / bulk + SAME)
        }
        (
            Against::Limit,
            Expected::NoEquilibrium {
                pressure_kpa,
                within,
            },
        ) => {
            let found = answer.as_ref().ok().and_then(|a| a.limit.as_ref());
            let error = found
                .and_then(|l| l.pressure_kpa.first())
                .map(|p| (p / pressure_kpa - 1.0).abs());
            (format!("limit {pressure_kpa:.4} kPa"), error, *within)
        }
        (Against::Limit, Expected::Ok) => ("nothing".into(), Some(0.0), 0.0),
    };
    let work = answer.as_ref().map(|a| a.work).unwrap_or_default();
    ExtremeLine {
        group: extreme.group,
        name: extreme.name.clone(),
        element,
        status: status(&answer),
        expected: match extreme.expected {
            Expected::Ok => "ok".into(),
            Expected::NoEquilibrium { .. } => "no_equilibrium".into(),
        },
        why: extreme.why,
        newton_iterations: work.newton_iterations,
        factorisations: work.factorisations,
        against,
        error,
        bound,
        passed: as_expected && error.is_some_and(|e| e <= bound),
        cpu_s,
        cpu_in_all_s: clock.cpu_s() - started,
    }
}
