//! The restart machine with a mesh plan: a stand-in for the finite-element model that grows the chambers.

use super::*;
use crate::optimiser::AskKind;

/// Twice the area of both chambers (shoelace) and its gradient over the corners.
fn twice_area(corners: &[f64]) -> (f64, Vec<f64>) {
    let mut gradient = vec![0.0; corners.len()];
    let mut area = 0.0;
    for chamber in 0..2 {
        for k in 0..4 {
            let (i, j) = (8 * chamber + 2 * k, 8 * chamber + 2 * ((k + 1) % 4));
            area += corners[i] * corners[j + 1] - corners[j] * corners[i + 1];
            gradient[i] += corners[j + 1];
            gradient[j + 1] += corners[i];
            gradient[j] -= corners[i + 1];
            gradient[i + 1] -= corners[j];
        }
    }
    (area, gradient)
}

/// Large chambers are good; the stretch rows limit their area to 1000 mm^2; the plan shifts the objective a little.
fn answer(study: &Study, request: &EvaluationRequest) -> Outcome {
    let (mut values, mut rows) = study.geometry_rows(0, &request.x).expect("rows");
    let (area, gradient) = twice_area(&study.corners(0, &request.x).expect("corners"));
    let base = request.plan_base.as_ref().expect("a plan base");
    let plan = study.mesh_plan(0, base).expect("chambers").expect("a plan");
    while values.len() < study.constraint_count(0).expect("rows") {
        values.push(area / 2000.0 - 1.0);
        rows.push(gradient.iter().map(|g| g / 2000.0).collect());
    }
    let mut outcome = Outcome::without_values(OutcomeStatus::Ok);
    outcome.objective = Some(-area * (1.0 + 1e-6 * plan.elements() as f64));
    outcome.constraints = values;
    if request.want_gradient {
        let slope = -(1.0 + 1e-6 * plan.elements() as f64);
        outcome.gradient = Some(gradient.iter().map(|g| slope * g).collect());
        outcome.constraint_gradients = Some(rows);
    }
    outcome
}

fn bending() -> Study {
    study(&with(
        &example("asymmetric-bending"),
        &["step[0].optimiser.max_iterations=40"],
    ))
}

/// Runs the first restart; `fail` says which request of the history fails, by its number and itself.
fn run(
    study: &Study,
    fail: impl Fn(usize, &EvaluationRequest) -> bool,
    store: bool,
) -> (RestartState, Vec<EvaluationRequest>) {
    let spec = &study.restarts(0, &StepInputs::default()).expect("restarts")[0];
    let (mut state, mut asks) = begin(study, spec).expect("begins");
    let mut history = Vec::new();
    while !asks.is_empty() {
        if store {
            let text = serde_json::to_string(&state).expect("serialises");
            state = serde_json::from_str(&text).expect("reads back");
        }
        let mut outcomes = Vec::new();
        for request in &asks {
            outcomes.push(if fail(history.len(), request) {
                let reason = "folds".into();
                Outcome::without_values(OutcomeStatus::InfeasibleGeometry { reason })
            } else {
                answer(study, request)
            });
            history.push(request.clone());
        }
        let next = step(study, &state, &outcomes).expect("goes on");
        (state, asks) = (next.state, next.asks);
        assert!(history.len() < 5000);
    }
    (state, history)
}

#[test]
fn rows_are_spikes_walls_stretch_margin_and_gaps() {
    let study = bending();
    assert_eq!(study.constraint_count(0), Ok(8 + 24 + 8 + 8));
    let apart = super::study(&with(
        &example("asymmetric-bending"),
        &["step[0].constraints.wall_gap_mm=0.2"],
    ));
    assert_eq!(apart.constraint_count(0), Ok(8 + 24 + 8 + 8 + 2));
    let off = super::study(&example("paper-hierarchical"));
    assert_eq!(off.constraint_count(0), Ok(8 + 24));
    let start = study.restarts(0, &StepInputs::default()).expect("restarts")[0]
        .x0
        .clone();
    let (values, gradients) = study.geometry_rows(0, &start).expect("rows");
    assert!(values.iter().all(|v| *v <= 0.0));
    assert!(gradients.iter().all(|row| row.len() == 16));
    let sharper = super::study(&with(
        &example("asymmetric-bending"),
        &["step[0].constraints.spike_deg=30"],
    ));
    let (sharp, _) = sharper.geometry_rows(0, &start).expect("rows");
    assert!(
        (sharp[0] + 30_f64.to_radians().cos()).abs() < 1e-12,
        "a right angle"
    );
    assert_eq!(sharp[8..], values[8..]);
}

/// The same in short steps, none of which is far.
fn creeping() -> Study {
    study(&with(
        &example("asymmetric-bending"),
        &[
            "step[0].optimiser.max_iterations=40",
            "step[0].optimiser.first_move=0.01",
        ],
    ))
}

/// The design from which an evaluation has its counts.
fn base(request: &EvaluationRequest) -> &[f64] {
    request.plan_base.as_deref().expect("a plan base")
}

#[test]
fn a_far_trial_brings_its_plan_along_and_is_not_evaluated_again() {
    let study = bending();
    let (state, history) = run(&study, |_, _| false, false);
    let bases: Vec<_> = history.chunk_by(|a, b| base(a) == base(b)).collect();
    let mut changes = 0;
    for pair in bases.windows(2) {
        let [before, first] = [pair[0].last().unwrap(), &pair[1][0]];
        let is_own = base(first) == first.x;
        assert!(
            is_own || pair[1].iter().all(|r| base(r) != r.x),
            "a plan is the design's own or the one before"
        );
        if first.kind == AskKind::Trial && is_own {
            assert!(study.is_far(0, base(before), &first.x).unwrap());
            assert!(!study.plan_serves(0, base(before), &first.x).unwrap());
            changes += 1;
        }
    }
    assert!(changes > 1 && changes >= state.replans, "{changes}");
    assert!(state.replans > 1);
    let again = history.iter().filter(|r| r.kind == AskKind::Replan);
    assert!(again.count() < state.replans);
    let best = state.best.expect("a design");
    assert!((best.objective + 2000.0).abs() < 40.0, "{}", best.objective);
}

#[test]
fn a_trial_that_its_own_plan_folds_is_evaluated_on_the_base() {
    let study = bending();
    let fails = |_: usize, r: &EvaluationRequest| {
        base(r) == r.x && matches!(r.kind, AskKind::Trial | AskKind::Return)
    };
    let (state, history) = run(&study, fails, false);
    let folded = history.windows(2).filter(|pair| fails(0, &pair[0]));
    let mut count = 0;
    for pair in folded {
        count += 1;
        assert_eq!((&pair[1].x, pair[1].kind), (&pair[0].x, pair[0].kind));
        assert_ne!(base(&pair[1]), base(&pair[0]));
    }
    assert!(count > 1);
    let best = state.best.expect("a design");
    assert!((best.objective + 2000.0).abs() < 40.0, "{}", best.objective);
}

#[test]
fn short_steps_change_the_plan_between_iterations_only() {
    let study = creeping();
    let (state, history) = run(&study, |_, _| false, false);
    let is_again = |r: &&EvaluationRequest| r.kind == AskKind::Replan;
    assert!(history.iter().any(|r| is_again(&r)) && state.best.is_some());
    assert!(history.iter().filter(is_again).all(|r| base(r) == r.x));
    let short = history.windows(2).filter(|pair| {
        let moved = study.is_far(0, &pair[0].x, &pair[1].x).expect("corners");
        pair[1].kind == AskKind::Trial && !moved
    });
    for pair in short {
        assert_eq!(base(&pair[0]), base(&pair[1]));
    }
}

#[test]
fn a_replanned_restart_is_restored_bit_by_bit() {
    let study = bending();
    assert_eq!(
        run(&study, |_, _| false, true),
        run(&study, |_, _| false, false)
    );
}

#[test]
fn a_failed_replan_goes_on_with_the_plan_that_it_had() {
    let study = creeping();
    let (state, history) = run(&study, |k, r| k > 0 && base(r) == r.x, false);
    let start = &history[0].x;
    for request in &history {
        assert!(base(request) == request.x || base(request) == start);
    }
    assert!(history.iter().any(|r| r.kind == AskKind::Replan));
    let best = state.best.expect("a design");
    assert!((best.objective + 2000.0).abs() < 40.0, "{}", best.objective);
}

#[test]
fn a_plan_that_cannot_follow_a_trial_is_changed_at_the_next_iteration() {
    let study = bending();
    let (_, plain) = run(&study, |_, _| false, false);
    let trial = plain
        .iter()
        .rposition(|r| r.kind == AskKind::Trial)
        .expect("a trial");
    let (state, history) = run(&study, |k, _| k == trial, false);
    let iteration = history[trial].iteration;
    let before = history[..trial]
        .iter()
        .filter(|r| r.kind == AskKind::Replan)
        .count();
    assert!(state.replans >= before);
    let next = history.iter().find(|r| r.iteration > iteration);
    assert!(next.is_none_or(|r| r.kind == AskKind::Replan), "{next:?}");
}

#[test]
fn a_run_that_settles_keeps_its_plan() {
    let study = bending();
    let (state, history) = run(&study, |_, _| false, false);
    let last = history
        .iter()
        .map(|r| r.iteration)
        .max()
        .expect("iterations");
    assert!(state.replans <= last / 2 + 1, "{} of {last}", state.replans);
    assert_eq!(
        history.last().map(|r| r.kind == AskKind::Replan),
        Some(false)
    );
}

#[test]
fn guesses_are_what_is_asked_next_and_keep_the_plan_and_the_budget() {
    let of = |more: &[&str]| {
        let few = [
            "step[0].optimiser.max_iterations=8",
            "step[0].optimiser.gradient=differences",
            "speculate=true",
        ];
        study(&with(
            &example("asymmetric-bending"),
            &[&few[..], more].concat(),
        ))
    };
    let follow = |study: &Study| {
        let specs = study.restarts(0, &StepInputs::default()).expect("restarts");
        let (mut state, mut asks) = begin(study, &specs[0]).expect("begins");
        let (mut guessed, mut batches, mut replans, mut most) = (0, 0, 0, 0);
        while !asks.is_empty() {
            let guesses = speculate(study, &state).expect("guesses");
            let key = |request: &EvaluationRequest| request.key(study, "").expect("a key");
            let keys: Vec<String> = guesses.iter().map(key).collect();
            let outcomes: Vec<_> = asks.iter().map(|request| answer(study, request)).collect();
            most = most.max(state.evaluations + asks.len() + guesses.len());
            let one = asks.len() == 1;
            let next = step(study, &state, &outcomes).expect("goes on");
            (state, asks) = (next.state, next.asks);
            if one && asks.len() > 1 {
                batches += 1;
                guessed += usize::from(asks.iter().all(|ask| keys.contains(&key(ask))));
            } else if one && asks.first().is_some_and(|ask| ask.kind == AskKind::Replan) {
                replans += 1;
                let differences = guesses.iter().any(|g| g.kind == AskKind::Gradient);
                assert!(!differences, "of another plan");
            }
        }
        (state, [guessed, batches, replans], most)
    };
    let (_, [guessed, batches, replans], _) = follow(&of(&["step[0].optimiser.first_move=0.01"]));
    assert!(replans > 0 && guessed + replans >= batches);
    let study = of(&[]);
    let (state, [guessed, batches, _], _) = follow(&study);
    assert!(batches > 4 && guessed == batches, "{guessed} of {batches}");
    let off = of(&["speculate=false"]);
    let (same, [none, ..], _) = follow(&off);
    assert_eq!(none, 0);
    assert_eq!(same.history_sha256, state.history_sha256);
    let restarts = study.restarts(0, &StepInputs::default()).expect("restarts");
    let share = 60;
    let budget = format!("step[0].budget.evaluations={}", share * restarts.len());
    let (_, _, most) = follow(&of(&[&budget]));
    // At most one batch of sixteen differences and what follows a failure are looked ahead.
    assert!(most > share - 20 && most <= share + 1, "{most}");
}
