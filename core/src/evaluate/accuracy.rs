//! Element and size of a study's meshes, chosen for an error: `mesh = { error = 0.01 }`.
//!
//! The design that stands for the step is solved on three nested `quad9` meshes, whose extrapolation is the reference; then
//! the meshes of a convergence study are tried from the cheapest on, and the first whose error, with the reference's own
//! uncertainty, is within the wanted one is taken. What is cheap is told by a formula of counts, not by a clock, so that
//! the choice is the same wherever it is made. Load steps stay the study's own: its objective is defined by them.

use super::converge::{
    Bench, CannotConverge, Clock, Family, NESTED, QUAD4_SIZES, QUAD9_SIZES, Setting, error,
    reference,
};
use super::scene::plan_element;
use crate::fault::Faults;
use crate::geometry::MeshPlan;
use crate::scene::{Body, ElementChoice, Scene};
use crate::study::Study;
use crate::study::spec::{ChosenMesh, Model};

/// The reference is solved at least as tightly as this.
const TIGHT: f64 = 1e-8;
/// Microseconds of a factorised Newton step per element (assembly) and per unknown (factorisation), as measured.
const ASSEMBLY_US: [f64; 2] = [3.2, 0.46];
const FACTOR_US: f64 = 1.1;

/// The study with element and size chosen wherever its models ask for an error.
///
/// # Errors
/// A fault at `step[i].model.mesh.error` where no mesh that was tried is good enough, or the reference does not converge.
pub fn choose_meshes(study: &Study, clock: &mut dyn Clock) -> Result<Study, Faults> {
    let mut chosen = study.clone();
    let mut faults = Faults::default();
    for (i, step) in study.steps.iter().enumerate() {
        let model = step.model.finite_elements();
        let Some(accuracy) = model.and_then(|m| m.accuracy.as_ref()) else {
            continue;
        };
        if accuracy.chosen.is_some() {
            continue;
        }
        let path = format!("step[{i}].model.mesh.error");
        let scene = study.accuracy_design(i).and_then(|(at, x)| {
            let scene = study.scene(i, &x, None)?;
            Ok((at, scene))
        });
        let (at, scene) = match scene {
            Ok(found) => found,
            Err(why) => {
                faults.add(path, why.to_string());
                continue;
            }
        };
        match choose(&scene, accuracy.error, clock) {
            Ok(found) => {
                let (Model::FeCascade(model) | Model::FeDirect(model)) = &mut chosen.steps[i].model
                else {
                    continue;
                };
                model.element = found.element;
                model.max_size_mm = found.max_size_mm;
                if let Some(accuracy) = &mut model.accuracy {
                    accuracy.chosen = Some(ChosenMesh {
                        at,
                        tip_error: found.tip_error,
                        area_error: found.area_error,
                        uncertainty: found.uncertainty,
                        elements: found.elements,
                    });
                }
            }
            Err(why) => faults.add(path, why),
        }
    }
    faults.check(chosen)
}

/// A mesh with what was seen of it.
struct Found {
    element: ElementChoice,
    max_size_mm: Option<f64>,
    tip_error: f64,
    area_error: Option<f64>,
    uncertainty: f64,
    elements: usize,
}

fn choose(scene: &Scene, wanted: f64, clock: &mut dyn Clock) -> Result<Found, String> {
    let (Body::Actuator(chain), Some(probe)) = (&scene.body, scene.probes.first()) else {
        return Err("needs an actuator and a probe".into());
    };
    let told = |why: CannotConverge| why.to_string();
    let base = Setting {
        family: Family::Reference,
        element: ElementChoice::Quad9,
        max_size_mm: None,
        refined: 1,
        tolerance: scene.relative_residual_force_tolerance.min(TIGHT),
        load_steps_per_leg: scene.actuation.load_steps_per_leg,
    };
    let mut bench = Bench::new(scene, &probe.name, clock);
    let mut nested = Vec::new();
    for refined in NESTED {
        let setting = Setting {
            refined,
            ..base.clone()
        };
        let sample = bench.solve(setting).map_err(told)?;
        nested.push(sample.ok_or_else(|| {
            format!(
                "the design by which a mesh is chosen has no complete path (each element split {refined} by {refined}): give max_size_mm, or a start"
            )
        })?);
    }
    let reference = reference(&nested, &bench);
    let uncertainty = reference
        .area_uncertainty
        .map_or(reference.tip_uncertainty, |area| {
            area.max(reference.tip_uncertainty)
        });
    let scale = (chain.actuator.unit_mm[0] * chain.actuator.unit_mm[1]).sqrt() / 80.0;
    let mut candidates = Vec::new();
    for (element, sizes, kind) in [
        (ElementChoice::Quad9, QUAD9_SIZES, 0),
        (ElementChoice::Quad4, QUAD4_SIZES, 1),
    ] {
        if scene.mesh.element != ElementChoice::Auto && scene.mesh.element != element {
            continue;
        }
        for size in sizes {
            let size = size.map(|s| s * scale);
            let plan = MeshPlan::choose(&chain.actuator, plan_element(element), size);
            let elements = plan.map_err(|why| why.to_string())?.elements() as f64;
            let unknowns_per_element = [8.0, 2.0][kind];
            let cost = elements * (ASSEMBLY_US[kind] + FACTOR_US * unknowns_per_element);
            candidates.push((cost, element, size));
        }
    }
    candidates.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut best = f64::INFINITY;
    for (_, element, max_size_mm) in candidates {
        bench
            .solve(Setting {
                family: Family::Mesh,
                element,
                max_size_mm,
                tolerance: scene.relative_residual_force_tolerance,
                ..base.clone()
            })
            .map_err(told)?;
        let runs = bench.assess(&nested, &reference);
        let Some((run, own)) = runs.last().and_then(|run| Some((run, error(run)?))) else {
            continue;
        };
        if own + uncertainty <= wanted {
            return Ok(Found {
                element,
                max_size_mm,
                tip_error: run.tip_error.unwrap_or(own),
                area_error: run.area_error,
                uncertainty,
                elements: run.elements,
            });
        }
        best = best.min(own + uncertainty);
    }
    Err(format!(
        "no mesh that was tried is within {wanted}: the best has {best:.2e}, of which {uncertainty:.2e} is the reference's uncertainty"
    ))
}
