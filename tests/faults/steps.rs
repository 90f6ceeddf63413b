//! Steps that take results of others: run side by side, killed in between, or left without anything to take.

use std::time::Duration;

use salp_core::hierarchy::StepResult;
use salp_core::study::StepInputs;
use salp_protocol::{StepState, StudyId, StudyState};
use serde_json::{Value, json};

use super::LEASE;
use super::support::{Coordinator, Folder, assert_sound, serve, study, until, work};

/// Two steps side by side, one that begins from the first one's candidates, and a sweep of those of the third.
fn graph(pause_s: f64) -> Value {
    let mut document = study(pause_s);
    let mut step = document["step"][0].clone();
    step["optimiser"]["max_iterations"] = json!(2);
    step["level"] = json!(2);
    let named = |id: &str| {
        let mut step = step.clone();
        step["id"] = json!(id);
        step
    };
    let mut first = named("first");
    first["keeps"] = json!(2);
    let mut beside = named("beside");
    beside["restarts"]["points"] = json!([[0.9, -0.2, 0.1]]);
    let mut then = named("then");
    then["level"] = json!(1);
    then["takes"] = json!([{"step": "first", "as": "starts"}]);
    then["restarts"] = json!({"start": "taken"});
    let mut last = named("last");
    last["level"] = json!(1);
    last["takes"] = json!([{"step": "then", "as": "geometry"}]);
    last["optimiser"] = json!({"method": "sweep", "points": "taken"});
    last["restarts"].take();
    let steps = [first, beside, then, last].map(|mut step| {
        step.as_object_mut()
            .unwrap()
            .retain(|_, value| !value.is_null());
        step
    });
    document["step"] = json!(steps);
    document
}

/// What a step took, and what it handed on.
type TakenAndGiven = (Option<Value>, Option<Value>);

/// Histories, and what each step took and handed on.
fn found(coordinator: &Coordinator, id: &StudyId) -> (Vec<String>, Vec<TakenAndGiven>) {
    let steps = coordinator.view(id).steps.into_iter();
    (
        coordinator.histories(id),
        steps.map(|step| (step.inputs, step.result)).collect(),
    )
}

fn undisturbed() -> (Vec<String>, Vec<TakenAndGiven>) {
    let folder = Folder::new("steps-undisturbed");
    let coordinator = serve(&folder, "127.0.0.1:0", &[]);
    let _worker = work(&folder, &coordinator.url, &[]);
    let id = coordinator.submit(&graph(0.0));
    coordinator.until_done(&id);
    found(&coordinator, &id)
}

#[test]
fn steps_take_results_whoever_is_killed_in_between() {
    let folder = Folder::new("steps-killed");
    let mut coordinator = serve(&folder, "127.0.0.1:0", LEASE);
    let address = coordinator.url.trim_start_matches("http://").to_owned();
    let mut first = work(&folder, &coordinator.url, &[]);
    let _second = work(&folder, &coordinator.url, &[]);
    let id = coordinator.submit(&graph(0.02));
    until("both steps run", Duration::from_secs(20), || {
        let view = coordinator.view(&id);
        view.steps[..2]
            .iter()
            .all(|step| step.state == StepState::Running)
            && view.steps[2].state == StepState::Waiting
    });
    let all = undisturbed();
    // The coordinator in the middle of each step, the worker once.
    for (k, answered) in [5, 12, 25, 32, 40].into_iter().enumerate() {
        until("some more are answered", Duration::from_secs(30), || {
            let view = coordinator.view(&id);
            view.counts.answered >= answered || view.state == StudyState::Done
        });
        coordinator.process.kill();
        if k == 2 {
            first.kill();
        }
        coordinator = serve(&folder, &address, LEASE);
    }
    coordinator.until_done(&id);
    assert_sound(&coordinator.ledger(&id));
    let steps = coordinator.view(&id).steps;
    assert!(steps.iter().all(|step| step.state == StepState::Done));
    let inputs: StepInputs = serde_json::from_value(steps[2].inputs.clone().unwrap()).unwrap();
    let handed_on: StepResult = serde_json::from_value(steps[0].result.clone().unwrap()).unwrap();
    let taken: Vec<_> = inputs.designs.iter().map(|d| &d.x).collect();
    let kept: Vec<_> = handed_on.candidates.iter().map(|c| &c.x).collect();
    assert!(!kept.is_empty());
    assert_eq!(taken, kept);
    assert_eq!(found(&coordinator, &id), all);
}

#[test]
fn a_step_that_finds_nothing_feasible_ends_the_study_with_what_was_found() {
    let folder = Folder::new("steps-nothing");
    let coordinator = serve(&folder, "127.0.0.1:0", LEASE);
    let _worker = work(&folder, &coordinator.url, &[]);
    let mut document = graph(0.0);
    // One point, outside what the constraint allows.
    let steps = document["step"].as_array_mut().unwrap();
    steps[0]["optimiser"] = json!({"method": "sweep", "points": [[4.0, 4.0, 4.0]]});
    steps[0].as_object_mut().unwrap().remove("restarts");
    let id = coordinator.submit(&document);
    until("it ends", Duration::from_secs(30), || {
        coordinator.view(&id).state.is_final()
    });
    let view = coordinator.view(&id);
    assert_eq!(view.state, StudyState::Failed);
    let states: Vec<_> = view.steps.iter().map(|step| step.state).collect();
    let expected = [
        StepState::Done,
        StepState::Done,
        StepState::Blocked,
        StepState::Blocked,
    ];
    assert_eq!(states, expected);
    let reason = view.failure.unwrap();
    assert!(
        reason.contains("\"first\" found nothing feasible"),
        "{reason}"
    );
    // What the other branch found is kept.
    assert!(view.steps[1].best.is_some() && view.best.is_some());
}
