//! Starts: their number, order, seeds and senses.

use super::*;
use crate::scene::Orientation::{Clockwise, CounterClockwise};
use crate::study::spec::StartKind;

#[test]
fn each_start_has_a_twin_of_the_other_sense() {
    let study = study(&example("asymmetric-bending"));
    let restarts = study.restarts(0, &StepInputs::default()).expect("restarts");
    assert_eq!(restarts.len(), 8);
    assert_eq!(study.steps[0].restart_count(), 8);
    for (i, restart) in restarts.iter().enumerate() {
        assert_eq!(restart.index, i);
        let sense = if i % 2 == 0 {
            CounterClockwise
        } else {
            Clockwise
        };
        assert_eq!(restart.orientation, Some(sense));
        assert_eq!(restart.x0, restarts[i - i % 2].x0);
        let kind = if i < 2 {
            StartKind::Paper
        } else {
            StartKind::Random
        };
        assert_eq!(restart.start_kind, Some(kind));
    }
    assert_ne!(restarts[2].x0, restarts[4].x0);
}

#[test]
fn seeds_reproduce_starts_and_more_starts_keep_the_first() {
    let document = example("asymmetric-bending");
    let restarts = |assignments: &[&str]| {
        study(&with(&document, assignments))
            .restarts(0, &StepInputs::default())
            .expect("restarts")
    };
    let first = restarts(&[]);
    assert_eq!(restarts(&[]), first);
    assert_eq!(restarts(&["step[0].restarts.count=7"])[..8], first);
    assert_ne!(restarts(&["step[0].restarts.seed=2"])[2].x0, first[2].x0);
}

#[test]
fn random_starts_lie_in_the_bounds() {
    let study = study(&with(
        &example("asymmetric-bending"),
        &[
            "step[0].restarts.count=50",
            "step[0].target.orientation=clockwise",
        ],
    ));
    let v = study.variables(0).expect("variables");
    for restart in study.restarts(0, &StepInputs::default()).expect("restarts") {
        let inside = |k: usize| (v.lower[k]..=v.upper[k]).contains(&restart.x0[k]);
        assert!((0..16).all(inside), "{restart:?}");
    }
}

#[test]
fn a_sweep_analyses_each_point_once() {
    let document = example("rectangles");
    for (orientation, sense) in [("either", None), ("clockwise", Some(Clockwise))] {
        let assignment = format!("step[0].target.orientation={orientation}");
        let study = study(&with(&document, &[&assignment]));
        let restarts = study.restarts(0, &StepInputs::default()).expect("restarts");
        assert_eq!((restarts.len(), study.steps[0].restart_count()), (1, 1));
        assert_eq!(restarts[0].start_kind, None);
        let (_, asks) = begin(&study, &restarts[0]).expect("begins");
        assert_eq!(asks.len(), 16 * 6);
        for ask in &asks {
            assert_eq!(ask.plan_base.as_ref(), Some(&ask.x));
            assert_eq!(ask.orientation, sense);
        }
    }
}

#[test]
fn the_best_of_a_sweep_says_its_sense() {
    let mut document = example("rectangles");
    document["step"][0]["optimiser"] =
        serde_json::json!({ "method": "sweep", "points": [[20, 10], [30, 20], [40, 20]] });
    let study = study(&document);
    let (state, asks) = begin(
        &study,
        &study.restarts(0, &StepInputs::default()).expect("restarts")[0],
    )
    .expect("begins");
    let rows = study.constraint_count(0).expect("rows");
    let outcomes = [2.0, -5.0, 3.0].map(|area: f64| Outcome {
        objective: Some(-area.abs()),
        constraints: vec![-1.0; rows],
        report: Some(EvaluationReport {
            enclosed_area_mm2: Some(area),
            ..EvaluationReport::default()
        }),
        ..Outcome::without_values(OutcomeStatus::Ok)
    });
    let best = step(&study, &state, &outcomes).expect("steps").best;
    let best = best.expect("a best point");
    assert_eq!((best.x, best.objective), (asks[1].x.clone(), -5.0));
    assert_eq!(best.orientation, Some(Clockwise));
}
