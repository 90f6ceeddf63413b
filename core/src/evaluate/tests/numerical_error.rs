//! The numerical error of an objective against references that are far finer, and its limits.

use std::path::Path;

use serde_json::{Value, json};

use super::super::numerical_error::{ErrorTerm, NumericalError, Source, check, variants};
use super::super::{SceneOptions, SceneStatus, solve_scene};
use crate::equilibrium::Unobserved;
use crate::geometry::MeshPlan;
use crate::scene::{Body, Scene, read_scene};

/// One unit of `chambers-40x15`.
fn document() -> Value {
    json!({
        "version": 1,
        "actuator": {"chambers_mm": [
            [[20, 13], [60, 13], [60, 28], [20, 28]], [[20, 52], [60, 52], [60, 67], [20, 67]]
        ]},
        "material": "mold-star-30-soft",
        "actuation": {"schedule": "hold", "pressure_kpa": 15, "load_steps_per_leg": 2},
        "mesh": {"element": "quad9", "max_size_mm": 10},
        "contact": "off",
        "relative_residual_force_tolerance": 1e-6,
        "probes": {"tip": [80, 40]},
        "objective": {"kind": "enclosed_area", "probe": "tip", "orientation": "counter_clockwise"}
    })
}

fn scene(document: &Value) -> Scene {
    read_scene(document, Path::new("")).unwrap_or_else(|faults| panic!("{faults}"))
}

fn error_of(scene: &Scene) -> NumericalError {
    let own = solve_scene(scene, &SceneOptions::default(), &mut Unobserved)
        .unwrap_or_else(|faults| panic!("{faults}"))
        .answer;
    NumericalError::solve(scene, None, &own, &mut Unobserved)
        .unwrap_or_else(|faults| panic!("{faults}"))
}

fn term(error: &NumericalError, source: Source) -> &ErrorTerm {
    let mut terms = error.terms.iter();
    terms.find(|t| t.source == source).expect("a term")
}

/// The objective on elements split 8 by 8, at 8 steps a leg, K/mu = 1e5 and a tolerance of 1e-11.
fn overkill(scene: &Scene) -> f64 {
    let mut scene = scene.clone();
    let Body::Actuator(chain) = &mut scene.body else {
        unreachable!("an actuator");
    };
    for law in &mut chain.materials {
        law.bulk_over_shear = 1e5;
    }
    let plan = MeshPlan::choose(
        &chain.actuator,
        super::super::scene::plan_element(scene.mesh.element),
        scene.mesh.max_size_mm,
    );
    scene.actuation.load_steps_per_leg *= 4;
    scene.relative_residual_force_tolerance = 1e-11;
    let options = SceneOptions {
        plan: Some(plan.expect("a plan").refined(8)),
        path_only: true,
        ..SceneOptions::default()
    };
    let solution = solve_scene(&scene, &options, &mut Unobserved);
    let answer = solution.unwrap_or_else(|faults| panic!("{faults}")).answer;
    answer.objective.expect("a complete path")
}

#[test]
fn the_error_is_within_its_bound() {
    let scene = scene(&document());
    let found = error_of(&scene);
    let reference = overkill(&scene);
    for bounded in [&found.finest, &found.own_mesh] {
        let off = (bounded.value.unwrap() - reference).abs();
        let bound = bounded.error.unwrap();
        assert!(off <= bound, "off by {off:e}, bound {bound:e}\n{found:#?}");
        // It says something: two load steps a leg alone are good for half a percent.
        assert!(bound <= 0.1 * reference.abs(), "{found:#?}");
    }
    assert_eq!(found.terms.len(), 5);
    let contact = term(&found, Source::Contact);
    assert_eq!(contact.error, Some(0.0));
    assert_eq!(contact.why.as_deref(), Some("contact did not act"));
    let sum: f64 = found.terms.iter().map(|t| t.error.unwrap()).sum();
    assert_eq!(found.finest.error, Some(sum));
    assert!(found.sentence.contains("model as stated"));
}

#[test]
fn terms_vanish_in_their_limits() {
    let mut document = document();
    document["relative_residual_force_tolerance"] = json!(1e-12);
    document["material"] = json!({"model": "neo_hookean", "c10_mpa": 0.11, "bulk_over_shear": 1e5});
    // One state: its displacement does not depend on how many come before it.
    document["actuation"] = json!({"schedule": [[0, 0], [15, 0]], "load_steps_per_leg": 1});
    document["objective"] =
        json!({"kind": "displacement", "probe": "tip", "component": "y", "state": 1});
    let found = error_of(&scene(&document));
    let size = found.finest.value.unwrap().abs();
    assert!(size > 0.05, "{found:#?}");
    assert!(term(&found, Source::Tolerance).error.unwrap() < 1e-9 * size);
    assert!(term(&found, Source::Path).error.unwrap() < 1e-9 * size);
    let bulk = term(&found, Source::Bulk).error.unwrap();
    assert!(bulk > 0.0 && bulk < 1e-3 * size);
    // A looser tolerance, a softer bulk: more of each.
    document["relative_residual_force_tolerance"] = json!(1e-1);
    document["material"]["bulk_over_shear"] = json!(1e3);
    let loose = error_of(&scene(&document));
    assert!(term(&loose, Source::Tolerance).error.unwrap() > 1e-9 * size);
    assert!(term(&loose, Source::Bulk).error.unwrap() > 50.0 * bulk);
}

#[test]
fn a_variant_that_does_not_end_leaves_the_error_open() {
    let scene = scene(&document());
    let own = solve_scene(&scene, &SceneOptions::default(), &mut Unobserved)
        .unwrap_or_else(|faults| panic!("{faults}"))
        .answer;
    let others = &variants(&scene, None, &own).unwrap()[1..];
    let mut solves: Vec<_> = others
        .iter()
        .map(|v| v.solve(&mut Unobserved).unwrap())
        .collect();
    let mut finest = solves[0].clone();
    finest.setting = "each element split 4 by 4".into();
    finest.status = SceneStatus::NotConverged;
    finest.value = None;
    solves.insert(0, finest);
    let found = NumericalError::of(&scene, &own, &solves);
    assert_eq!((found.finest.value, found.finest.error), (None, None));
    assert_eq!(found.own_mesh.error, None);
    assert!(term(&found, Source::Bulk).error.is_some());
    assert_eq!(
        found.sentence,
        "numerical error not known: each element split 4 by 4 ended with not_converged"
    );
    // A scene that does not end has nothing to be bounded, and nothing more is solved.
    let mut limited = own;
    limited.status = SceneStatus::NoEquilibrium;
    assert!(variants(&scene, None, &limited).unwrap().is_empty());
    let found = NumericalError::of(&scene, &limited, &[]);
    assert_eq!((found.finest.error, found.terms.len()), (None, 0));
    assert_eq!(
        found.sentence,
        "numerical error not known: the scene ended with no_equilibrium"
    );
}

#[test]
fn a_scene_without_objective_is_a_fault() {
    let mut document = document();
    document.as_object_mut().unwrap().remove("objective");
    let scene = scene(&document);
    let faults = check(&scene).unwrap_err();
    assert_eq!(faults.0.len(), 1);
    assert_eq!(faults.0[0].path, "objective");
}
