//! Sequences of units: their variables, scenes and keys, what they take and hand on, faults.

use super::*;
use crate::study::restart::{begin, step};
use crate::study::{EvaluationRequest, Given, Outcome, OutcomeStatus};

/// Two areas that give units, a sequence of three units from both, and a direct step that takes what it finds.
fn document() -> Value {
    let area = |id: &str, model: Value| {
        json!({
            "id": id, "level": 2, "model": model,
            "target": {"kind": "enclosed_area", "probe_mm": [80, 40], "orientation": "either"},
            "optimiser": {"method": "gcmma"}, "restarts": {"start": "paper"}, "keeps": 3,
        })
    };
    let whole = |id: &str, takes: Value| {
        json!({
            "id": id, "level": 1, "model": {"kind": "fe_direct"}, "takes": takes,
            "target": {"kind": "enclosed_area", "probe_mm": "tip", "orientation": "either"},
        })
    };
    let mut mixed = whole(
        "mixed",
        json!([
            {"step": "one", "as": "alphabet", "candidates": 2},
            {"step": "two", "as": "alphabet", "candidates": 1, "units": [2]},
        ]),
    );
    mixed["variables"] = json!({"parametrisation": "sequence"});
    mixed["optimiser"] = json!({"method": "exchange", "enumerate_up_to": 8});
    mixed["keeps"] = json!(2);
    let mut free = whole(
        "free",
        json!([{"step": "mixed", "as": "starts", "candidates": 1}]),
    );
    free["optimiser"] = json!({"method": "gcmma"});
    free["restarts"] = json!({"start": "taken"});
    json!({
        "name": "mixed",
        "actuator": {"units": 3},
        "actuation": {"schedule": "hold", "pressure_kpa": 15, "load_steps_per_leg": 2},
        "step": [
            area("one", json!({"kind": "fe_cascade", "units": 2})),
            area("two", json!({"kind": "fe_direct", "units": 2})),
            mixed,
            free,
        ],
    })
}

fn done(candidates: Vec<Candidate>) -> Progress {
    Progress::Done(StepResult { candidates })
}

/// What the sequence takes; the second unit of `two` has rectangles of this width.
fn inputs_of(study: &Study, width: f64) -> StepInputs {
    let one = [50.0, 40.0, 30.0].map(|side| candidate(pair(side), -side));
    let two = candidate([pair(35.0), pair(width)].concat(), -9.0);
    let progress = [
        done(one.to_vec()),
        done(vec![two]),
        Progress::Waiting,
        Progress::Waiting,
    ];
    match due(study, &progress).expect("sound").remove(0) {
        Due::Begin { step: 2, inputs } => inputs,
        other => panic!("{other:?}"),
    }
}

#[test]
fn a_sequence_is_the_units_that_it_names() {
    let study = study(&document());
    assert_eq!(super::study(&study.document()), study);
    // Before anything has run: as many letters as may come.
    let before = study.variables(2).expect("variables");
    assert_eq!(before.upper, [2.0; 3]);
    assert_eq!(before.names, ["unit1", "unit2", "unit3"]);
    let rows = study.constraint_count(2).expect("rows");
    let inputs = inputs_of(&study, 20.0);
    let sides: Vec<_> = inputs.given.alphabet.iter().map(|l| &l.corners).collect();
    assert_eq!(sides, [&pair(50.0), &pair(40.0), &pair(20.0)]);
    let last = &inputs.given.alphabet[2];
    assert_eq!((last.unit, last.from.step.as_str()), (2, "two"));
    let given = study.given(2, &inputs.given);
    let x = [2.0, 0.0, 1.0];
    let corners = [pair(20.0), pair(50.0), pair(40.0)].concat();
    assert_eq!(given.corners(2, &x), Ok(corners.clone()));
    assert_eq!(given.sequence(2, &x), Some(vec![3, 1, 2]));
    assert_eq!(given.sequence(3, &corners), None);
    assert_eq!(
        given.scene(2, &x, None).expect("a scene"),
        given.scene(3, &corners, None).expect("a scene")
    );
    assert_eq!(given.constraint_count(2), Ok(rows));
    assert_eq!(given.constraint_names(2).expect("names").len(), rows);
    for wrong in [[0.5, 0.0, 0.0], [0.0, 3.0, 0.0], [0.0, 0.0, -1.0]] {
        assert!(given.corners(2, &wrong).is_err(), "{wrong:?}");
        assert_eq!(given.sequence(2, &wrong), None);
    }
    assert!(given.corners(2, &[0.0; 4]).is_err());
    assert!(
        given.geometry_rows(2, &x).is_err(),
        "letters have no slopes"
    );
    // A unit within 1 % of the boxes' widths of an earlier one is the same letter.
    let near = inputs_of(&study, 40.1);
    assert_eq!(near.given.alphabet.len(), 2);
    let of_two = study.given(2, &near.given);
    assert_eq!(of_two.variables(2).expect("variables").upper, [1.0; 3]);
}

#[test]
fn a_sequence_is_known_by_the_key_of_its_units() {
    let study = study(&document());
    let inputs = inputs_of(&study, 20.0);
    let request = |step: usize, x: Vec<f64>, given: &Given| EvaluationRequest {
        step,
        kind: serde_json::from_value(json!("initial")).expect("a kind"),
        iteration: 0,
        plan_base: Some(x.clone()),
        x,
        want_gradient: false,
        orientation: None,
        second_mesh: false,
        fidelity: None,
        given: given.clone(),
    };
    let key = |step, x: &[f64], given: &Given| {
        request(step, x.to_vec(), given)
            .key(&study, "build")
            .expect("a key")
    };
    let corners = [pair(20.0), pair(50.0), pair(40.0)].concat();
    let own = key(2, &[2.0, 0.0, 1.0], &inputs.given);
    assert_eq!(own, key(3, &corners, &Given::default()));
    assert_ne!(own, key(2, &[2.0, 1.0, 0.0], &inputs.given));
    // The same letters of another alphabet are another design.
    assert_ne!(
        own,
        key(2, &[2.0, 0.0, 1.0], &inputs_of(&study, 21.0).given)
    );
}

/// The whole of it with made-up areas: what the search asks for, which it keeps, what the next step begins with.
#[test]
fn the_best_sequence_is_found_and_handed_on_as_geometry() {
    let study = study(&document());
    let inputs = inputs_of(&study, 20.0);
    let specs = study.restarts(2, &inputs).expect("restarts");
    assert_eq!((specs.len(), study.steps[2].restart_count()), (1, 1));
    assert_eq!((specs[0].start_kind, specs[0].orientation), (None, None));
    let (mut state, mut asks) = begin(&study, &specs[0]).expect("a start");
    let uniform: Vec<_> = asks.iter().map(|ask| ask.x.clone()).collect();
    assert_eq!(uniform, [[0.0; 3], [1.0; 3], [2.0; 3]]);
    let rows = study.constraint_count(2).expect("rows");
    let wanted = [2.0, 0.0, 1.0];
    let mut asked = 0;
    while state.stop.is_none() {
        let answer = |ask: &EvaluationRequest| {
            let right = ask.x.iter().zip(&wanted).filter(|(a, b)| a == b).count();
            Outcome {
                objective: Some(-(right as f64)),
                constraints: vec![-1.0; rows],
                ..Outcome::without_values(OutcomeStatus::Ok)
            }
        };
        let outcomes: Vec<Outcome> = asks.iter().map(answer).collect();
        asked += asks.len();
        let text = serde_json::to_string(&state).expect("a state that can be written");
        let again = serde_json::from_str(&text).expect("a state that can be read");
        let next = step(&study, &again, &outcomes).expect("a step");
        (state, asks) = (next.state, next.asks);
    }
    assert!(asked < 27, "{asked}");
    let stop = json!(state.stop);
    assert_eq!(stop["reason"], "no_better_exchange", "{stop}");
    assert_eq!(
        (&stop["points"], &stop["failed"]),
        (&json!(asked), &json!(0))
    );
    let kept: Vec<_> = state.candidates().iter().map(|c| (0, c.clone())).collect();
    let result = StepResult::of(&study, 2, &inputs.given, &kept).expect("a result");
    assert_eq!(result.candidates.len(), 2);
    assert_eq!(result.candidates[0].x, wanted);
    let others = || done(vec![candidate(pair(50.0), -1.0)]);
    let progress = [
        others(),
        others(),
        Progress::Done(result),
        Progress::Waiting,
    ];
    let Due::Begin { step: 3, inputs } = due(&study, &progress).expect("sound").remove(0) else {
        panic!("the direct step is due");
    };
    assert_eq!(
        inputs.designs[0].x,
        [pair(20.0), pair(50.0), pair(40.0)].concat()
    );
    assert_eq!(inputs.given, Given::default());
}

#[test]
fn a_budget_cuts_the_search_short() {
    let mut document = document();
    document["step"][2]["budget"] = json!({"evaluations": 5});
    let study = study(&document);
    let spec = &study
        .restarts(2, &inputs_of(&study, 20.0))
        .expect("restarts")[0];
    let (state, asks) = begin(&study, spec).expect("a start");
    let lost: Vec<Outcome> = Vec::new();
    let next = step(&study, &state, &lost).expect("a step");
    assert_eq!((asks.len(), next.asks.len()), (3, 2));
    let end = step(&study, &next.state, &lost).expect("a step");
    let stop = json!(end.done);
    assert_eq!(stop["reason"], "evaluation_limit", "{stop}");
    assert_eq!(stop["evaluations"], 5);
}

#[test]
fn what_makes_no_sequence_is_refused() {
    let found = |change: &dyn Fn(&mut Value)| {
        let mut document = document();
        change(&mut document);
        paths(&document)
    };
    assert!(found(&|_| {}).is_empty());
    let mixed =
        |field: &'static str, value: Value| found(&move |d| d["step"][2][field] = value.clone());
    assert_eq!(
        mixed(
            "optimiser",
            json!({"method": "random_search", "evaluations": 9})
        ),
        ["step[2].optimiser.method", "step[2].restarts"]
    );
    assert_eq!(
        mixed("variables", json!({"parametrisation": "corners"})),
        [
            "step[2].optimiser.method",
            "step[2].takes[0].as",
            "step[2].takes[1].as"
        ]
    );
    assert_eq!(
        mixed("model", json!({"kind": "fe_cascade"})),
        ["step[2].variables.parametrisation"]
    );
    assert_eq!(
        mixed("restarts", json!({"start": "paper"})),
        ["step[2].restarts"]
    );
    assert_eq!(mixed("takes", json!([])), ["step[2].takes"]);
    assert_eq!(
        mixed(
            "takes",
            json!([{"step": "one", "as": "alphabet", "candidates": 1}])
        ),
        ["step[2].takes"]
    );
    assert_eq!(
        mixed("takes", json!([{"step": "one", "as": "starts"}])),
        ["step[2].takes[0].as"]
    );
    assert_eq!(
        mixed(
            "takes",
            json!([{"step": "one", "as": "alphabet", "units": [2]}])
        ),
        ["step[2].takes[0].units"]
    );
    assert_eq!(
        mixed(
            "model",
            json!({"kind": "fe_direct", "mesh": {"error": 0.01}})
        ),
        ["step[2].model.mesh"]
    );
    assert_eq!(
        found(&|d| d["step"][3]["takes"][0]["as"] = json!("alphabet")),
        ["step[3].takes[0].as", "step[3].restarts.start"]
    );
}
