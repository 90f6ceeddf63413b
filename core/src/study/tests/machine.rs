//! The restart machine against a cheap stand-in for the model.

use super::*;
use crate::optimiser::AskKind;

/// Minimum of a quadratic in the bounds of a command study: f = sum (x - 3)^2, g = 5 - sum x <= 0.
fn answer(request: &EvaluationRequest) -> Outcome {
    let x = &request.x;
    let mut outcome = Outcome::without_values(OutcomeStatus::Ok);
    outcome.objective = Some(x.iter().map(|v| (v - 3.0).powi(2)).sum());
    outcome.constraints = vec![1.0 - x.iter().sum::<f64>() / 5.0];
    if request.want_gradient {
        outcome.gradient = Some(x.iter().map(|v| 2.0 * (v - 3.0)).collect());
        outcome.constraint_gradients = Some(vec![vec![-0.2; x.len()]]);
    }
    outcome
}

fn quadratic() -> Study {
    study(
        &crate::document::parse_toml(
            r#"
name = "quadratic"
[[step]]
id = "solve"
model = { kind = "command", argv = ["x"], time_limit_s = 1, gradient = true }
variables = { lower = [0, 0, 0], upper = [2, 10, 10] }
constraints = { inequalities = 1 }
optimiser = { method = "mmfd" }
restarts = { start = ["given", "random"], points = [[1, 1, 1]], count = 2, seed = 5 }
"#,
        )
        .expect("TOML"),
    )
}

/// Runs a restart to its end, `between` acting on the state and on the outcomes of each batch.
fn run(
    study: &Study,
    index: usize,
    mut between: impl FnMut(usize, RestartState, Vec<Outcome>) -> (RestartState, Vec<Outcome>),
) -> RestartState {
    let spec = &study.restarts(0, &StepInputs::default()).expect("restarts")[index];
    let (mut state, mut asks) = begin(study, spec).expect("begins");
    for batch in 0..10_000 {
        let (seen, outcomes) = between(batch, state, asks.iter().map(answer).collect());
        let next = step(study, &seen, &outcomes).expect("goes on");
        state = next.state;
        asks = next.asks;
        if next.done.is_some() {
            assert!(asks.is_empty());
            return state;
        }
    }
    panic!("the restart does not end");
}

#[test]
fn a_restart_ends_at_the_optimum() {
    let study = quadratic();
    for index in 0..3 {
        let state = run(&study, index, |_, state, outcomes| (state, outcomes));
        let best = state.best.expect("a feasible design");
        assert!((best.objective - 1.0).abs() < 0.01, "{best:?}");
        assert_eq!(
            state.best_with_overlap.map(|b| b.evaluation),
            Some(best.evaluation)
        );
        assert!(state.stop.expect("a reason").name().len() > 3);
        assert!(state.evaluations > 3);
    }
}

#[test]
fn a_state_that_was_stored_goes_on_bit_by_bit() {
    let study = quadratic();
    let plain = run(&study, 1, |_, state, outcomes| (state, outcomes));
    let stored = run(&study, 1, |_, state, outcomes| {
        let text = serde_json::to_string(&state).expect("serialises");
        (serde_json::from_str(&text).expect("reads back"), outcomes)
    });
    assert_eq!(stored, plain);
    assert_eq!(stored.history_sha256, plain.history_sha256);
}

#[test]
fn failures_and_nonsense_do_not_end_a_restart() {
    let study = quadratic();
    for bad_batch in 1..8 {
        for nonsense in [false, true] {
            let state = run(&study, 0, |batch, state, mut outcomes| {
                if batch == bad_batch {
                    if nonsense {
                        outcomes[0].objective = Some(f64::NAN);
                    } else {
                        outcomes[0] = Outcome::without_values(OutcomeStatus::WorkLimit);
                    }
                }
                (state, outcomes)
            });
            let best = state.best.expect("a feasible design");
            assert!(
                (best.objective - 1.0).abs() < 0.05,
                "batch {bad_batch}: {best:?}"
            );
        }
    }
}

#[test]
fn nonsense_is_an_invalid_result() {
    let study = quadratic();
    let spec = &study.restarts(0, &StepInputs::default()).expect("restarts")[0];
    let (_, asks) = begin(&study, spec).expect("begins");
    let mut request = asks[0].clone();
    request.want_gradient = true;
    let good = answer(&request);
    assert_eq!(study.checked(&request, &good).expect("checked"), good);
    let spoil: [fn(&mut Outcome); 6] = [
        |o| o.objective = None,
        |o| o.objective = Some(f64::INFINITY),
        |o| o.constraints.push(0.0),
        |o| o.gradient = Some(vec![1.0]),
        |o| o.constraint_gradients = Some(Vec::new()),
        |o| o.constraint_gradients = Some(vec![vec![0.0, f64::NAN, 0.0]]),
    ];
    for spoil in spoil {
        let mut bad = good.clone();
        spoil(&mut bad);
        let checked = study.checked(&request, &bad).expect("checked");
        assert_eq!(checked.status.name(), "invalid_result");
        assert_eq!((checked.objective, checked.constraints.len()), (None, 0));
    }
}

#[test]
fn overlapping_walls_feed_the_optimiser_but_do_not_count() {
    let study = quadratic();
    let state = run(&study, 0, |_, state, mut outcomes| {
        for (request, outcome) in state.pending.iter().zip(&mut outcomes) {
            if request.x[1] > 2.5 {
                outcome.report = Some(EvaluationReport {
                    walls_overlap: Some(OverlapReport {
                        leg: 0,
                        fraction: 1.0,
                        pressure_kpa: vec![1.0],
                        at_mm: [0.0, 0.0],
                        corner_fold: false,
                    }),
                    ..EvaluationReport::default()
                });
            }
        }
        (state, outcomes)
    });
    let dashed = state.best_with_overlap.expect("a design");
    assert!(dashed.walls_overlap && (dashed.objective - 1.0).abs() < 0.01);
    assert!(
        state
            .best
            .is_none_or(|best| best.x[1] <= 2.5 && best.objective > dashed.objective)
    );
}

#[test]
fn a_budget_is_shared_by_the_restarts() {
    let mut document = quadratic().document();
    document["step"][0]["budget"]["evaluations"] = serde_json::json!(15);
    let study = study(&document);
    let state = run(&study, 2, |_, state, outcomes| (state, outcomes));
    assert_eq!(state.stop.expect("a reason").name(), "evaluation_budget");
    assert!(state.evaluations <= 5);
}

#[test]
fn histories_are_equal_where_everything_is() {
    let study = quadratic();
    let mut lines = Vec::new();
    let state = run(&study, 0, |_, state, outcomes| {
        for (request, outcome) in state.pending.iter().zip(&outcomes) {
            lines.push((request.clone(), outcome.clone()));
        }
        (state, outcomes)
    });
    let hash = |lines: &[(EvaluationRequest, Outcome)]| {
        history_sha256(lines.iter().map(|(r, o)| HistoryEntry::new(0, r, o)))
    };
    assert_eq!(hash(&lines), state.history_sha256);
    let last = lines.len() - 1;
    let objective = lines[last].1.objective.expect("ok");
    lines[last].1.objective = Some(f64::from_bits(objective.to_bits() + 1));
    assert_ne!(hash(&lines), state.history_sha256);
    assert_eq!(lines[0].0.kind, AskKind::Initial);
}

#[test]
fn keys_tell_evaluations_apart() {
    let study = study(&example("asymmetric-bending"));
    let spec = &study.restarts(0, &StepInputs::default()).expect("restarts")[0];
    let (_, asks) = begin(&study, spec).expect("begins");
    let request = &asks[0];
    let key = |r: &EvaluationRequest| r.key(&study, "build").expect("a key");
    assert_eq!(key(request), key(&request.clone()));
    let changes: [fn(&mut EvaluationRequest); 4] = [
        |r| r.x[0] = r.x[0].next_up(),
        |r| r.want_gradient = !r.want_gradient,
        |r| r.plan_base = None,
        |r| r.orientation = None,
    ];
    for change in changes {
        let mut other = request.clone();
        change(&mut other);
        assert_ne!(key(&other), key(request));
    }
    assert_ne!(request.key(&study, "another"), request.key(&study, "build"));
    let mut later = request.clone();
    later.iteration = 9;
    assert_eq!(
        key(&later),
        key(request),
        "who asks, and when, does not matter"
    );
}
