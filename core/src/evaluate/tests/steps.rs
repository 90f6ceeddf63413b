//! Steps without chambers of their own to move: the reduced model, and the choice of a layout.

use serde_json::{Value, json};

use super::super::evaluate;
use crate::equilibrium::Unobserved;
use crate::scene::Orientation;
use crate::study::{EvaluationRequest, Given, Outcome, OutcomeStatus, Study, read_study};

fn study(step: &Value) -> Study {
    let document = json!({
        "name": "steps",
        "material": "mold-star-30-soft",
        "actuator": {"units": 9},
        "actuation": {"schedule": "hold", "pressure_kpa": 10, "load_steps_per_leg": 1},
        "step": [step],
    });
    read_study(&document, false).unwrap_or_else(|faults| panic!("{faults}"))
}

fn at(study: &Study, x: &[f64], given: &Given, want_gradient: bool) -> Outcome {
    let request = EvaluationRequest {
        step: 0,
        kind: serde_json::from_value(json!("trial")).expect("a kind"),
        iteration: 0,
        x: x.to_vec(),
        want_gradient,
        plan_base: None,
        orientation: Some(Orientation::CounterClockwise),
        second_mesh: false,
        fidelity: None,
        given: given.clone(),
    };
    let outcome = evaluate(study, &request, &mut Unobserved);
    assert_eq!(outcome.status, OutcomeStatus::Ok);
    study
        .checked(&request, &outcome)
        .expect("an answer that fits its step")
}

#[test]
fn the_reduced_model_has_the_gradient_of_differences_and_needs_two_actuations() {
    let step = |actuations: usize| {
        study(&json!({
            "id": "motion", "pass": "forward",
            "target": {"kind": "enclosed_area", "probe_mm": [640, 40], "orientation": "counter_clockwise"},
            "model": {"kind": "linear_transform", "actuations": actuations},
            "optimiser": {"method": "gcmma"}, "restarts": {"start": "random", "count": 1},
        }))
    };
    let none = Given::default();
    let one = at(&step(1), &[1.05, 0.03, 0.02, 1.0], &none, false);
    assert_eq!(one.objective, Some(0.0));
    let x = [1.05, 0.03, 0.02, 1.0, 1.1, -0.05, 0.04, 0.98];
    let study = step(2);
    let outcome = at(&study, &x, &none, true);
    assert!(outcome.objective.expect("an area").abs() > 100.0);
    let gradient = outcome.gradient.expect("wanted");
    for k in 0..x.len() {
        let moved = |h: f64| {
            let mut y = x;
            y[k] += h;
            at(&study, &y, &none, false).objective.expect("an area")
        };
        let difference = (moved(1e-5) - moved(-1e-5)) / 2e-5;
        assert!((difference / gradient[k] - 1.0).abs() < 1e-6, "entry {k}");
    }
}

#[test]
fn the_constant_strain_model_has_the_gradient_of_differences_and_the_area_of_its_transformations() {
    let step = |id: &str, kind: &str| {
        json!({
            "id": id, "pass": "forward",
            "target": {"kind": "enclosed_area", "probe_mm": [640, 40], "orientation": "counter_clockwise"},
            "model": {"kind": kind, "actuations": 2},
            "optimiser": {"method": "gcmma"}, "restarts": {"start": "random", "count": 1},
        })
    };
    let study = study(&step("motion", "constant_strain"));
    let none = Given::default();
    let x = [0.03, 0.05, 0.02, -0.05, 0.1, 0.04];
    let outcome = at(&study, &x, &none, true);
    let objective = outcome.objective.expect("an area");
    assert!(objective.abs() > 100.0);
    let gradient = outcome.gradient.expect("wanted");
    for k in 0..x.len() {
        let moved = |h: f64| {
            let mut y = x;
            y[k] += h;
            at(&study, &y, &none, false).objective.expect("an area")
        };
        let difference = (moved(1e-5) - moved(-1e-5)) / 2e-5;
        assert!((difference / gradient[k] - 1.0).abs() < 1e-6, "entry {k}");
    }
    // What it hands on, a transformation per actuation, has the same tips in the paper's model.
    let transforms = study.transforms_of(0, &x).expect("a reduced step");
    let area = crate::reduced::area(&transforms, [80.0; 2], 8).0;
    assert!(
        (objective + area).abs() < 1e-9 * area.abs(),
        "{objective} {area}"
    );
    assert_eq!(outcome.report.expect("a report").transforms, transforms);
}

#[test]
fn the_layout_that_does_what_is_asked_comes_first() {
    let study = study(&json!({
        "id": "layout",
        "model": {"kind": "fe_layouts", "layouts": ["stacked_pair", "side_by_side", "three_chambers"], "max_size_mm": 12, "score": "distance"},
        "optimiser": {"method": "sweep", "grid": [[0, 1, 2], [0.6], [0.8]]},
    }));
    let design = |layout: f64| [layout, 0.6, 0.8];
    let reached = |layout: f64| {
        let outcome = at(&study, &design(layout), &Given::default(), false);
        assert_eq!(outcome.constraints.len(), 1);
        outcome.report.expect("a report").transforms
    };
    // One per loaded row of the schedule: the lower channel alone, then both.
    let asked = reached(2.0);
    assert_eq!(asked.len(), 2);
    assert!(asked[0].x_sh.abs() > 1e-3 && asked[1].x_scl > 1.0);
    let given = Given {
        behaviour: asked,
        ..Given::default()
    };
    let objective = |layout: f64| {
        at(&study, &design(layout), &given, false)
            .objective
            .expect("a value")
    };
    assert!(objective(2.0) < 1e-12);
    assert!(objective(0.0) > 0.05 && objective(1.0) > 0.05);
}
