//! Methods without gradients in a study: documents, requests, seeds, what they hand on.

use super::*;
use crate::optimiser::{CmaEsOptions, OptimiserOptions, OptimiserState};

const METHODS: [&str; 2] = [
    r#"{"method": "cma_es", "population": 6}"#,
    r#"{"method": "random_search", "evaluations": 40, "batch": 16}"#,
];

#[test]
fn they_read_with_defaults_and_every_fault_has_its_path() {
    let optimiser = |text: &str| format!("step[0].optimiser={text}");
    let truss = |text: &str| with(&example("three-bar-truss"), &[&optimiser(text)]);
    let plain = study(&truss(r#"{"method": "cma_es"}"#));
    assert_eq!(
        plain.steps[0].optimiser,
        OptimiserOptions::CmaEs(CmaEsOptions::default())
    );
    for text in METHODS {
        let read = study(&truss(text));
        assert_eq!(study(&read.document()), read, "{text}: read again");
    }
    for (text, expected) in [
        (
            r#"{"method": "cma_es", "population": 3, "first_step": 2, "doublings": 11, "gradient": "model"}"#,
            &["gradient"][..],
        ),
        (
            r#"{"method": "cma_es", "population": 3, "first_step": 2, "doublings": 11, "relative_tolerance": -1}"#,
            &[
                "relative_tolerance",
                "first_step",
                "population",
                "doublings",
            ],
        ),
        (
            r#"{"method": "random_search", "batch": 0, "seed": -1}"#,
            &["seed", "evaluations", "batch"],
        ),
    ] {
        let expected: Vec<String> = expected
            .iter()
            .map(|field| format!("step[0].optimiser.{field}"))
            .collect();
        let found = faults(&truss(text));
        for field in &expected {
            assert!(found.contains(field), "{text}: {found:?}");
        }
    }
}

#[test]
fn they_ask_for_values_alone_and_only_of_valid_geometry() {
    for optimiser in METHODS {
        let study = study(&with(
            &example("asymmetric-bending"),
            &[
                &format!("step[0].optimiser={optimiser}"),
                "step[0].restarts={\"start\": \"random\", \"count\": 2}",
                "step[0].constraints.spike_deg=30",
                "step[0].keeps=2",
            ],
        ));
        let specs = study.restarts(0, &StepInputs::default()).expect("restarts");
        let is_sample = study.steps[0].optimiser.is_sample();
        // A random search runs in no sense: each of its points counts in its better one.
        assert_eq!(specs.len(), if is_sample { 2 } else { 4 });
        let rows = study.problem(0).expect("a problem").constraints();
        let mut firsts = Vec::new();
        for spec in &specs {
            let (mut state, mut asks) = begin(&study, spec).expect("begins");
            firsts.push(asks[1].x.clone());
            let mut batches = 0;
            while state.stop.is_none() && batches < 4 {
                let mut outcomes = Vec::new();
                for request in &asks {
                    assert!(!request.want_gradient);
                    assert_eq!(
                        request.plan_base.as_ref(),
                        Some(&request.x),
                        "a plan of its own"
                    );
                    let geometry = study.geometry_values(0, &request.x).expect("rows");
                    assert!(geometry.iter().all(|row| *row <= 0.003), "{optimiser}");
                    let mut outcome = Outcome::without_values(OutcomeStatus::Ok);
                    outcome.objective = Some(request.x.iter().sum());
                    outcome.constraints = vec![-1.0; rows];
                    outcomes.push(outcome);
                }
                let next = step(&study, &state, &outcomes).expect("goes on");
                (state, asks) = (next.state, next.asks);
                batches += 1;
            }
            assert_eq!(state.replans, 0);
            assert_eq!(state.candidates().len() > 1, is_sample);
        }
        firsts.dedup();
        assert_eq!(
            firsts.len(),
            specs.len(),
            "every restart draws its own points"
        );
    }
}

#[test]
fn a_random_search_ends_with_its_share_of_the_budget() {
    let truss = with(
        &example("three-bar-truss"),
        &[
            r#"step[0].optimiser={"method": "random_search", "evaluations": 500}"#,
            r#"step[0].restarts={"start": "random", "count": 3}"#,
            "step[0].budget.evaluations=300",
        ],
    );
    let study = study(&truss);
    let spec = &study.restarts(0, &StepInputs::default()).expect("restarts")[1];
    let (mut state, mut asks) = begin(&study, spec).expect("begins");
    while state.stop.is_none() {
        let lost: Vec<Outcome> = asks
            .iter()
            .map(|_| Outcome::without_values(OutcomeStatus::Lost))
            .collect();
        let next = step(&study, &state, &lost).expect("goes on");
        (state, asks) = (next.state, next.asks);
    }
    assert_eq!(state.evaluations, 100);
    assert_eq!(state.stop.expect("a reason").name(), "search_complete");
    assert!(matches!(state.optimiser, OptimiserState::RandomSearch(_)));
}
