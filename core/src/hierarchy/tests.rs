//! Tests of the framework: what is due when, what is taken, which graphs are no graphs.

mod hexagons;
mod sequences;

use serde_json::{Value, json};

use super::candidate::DISTINCT;
use super::*;
use crate::geometry::{Layout, LayoutBoxes};
use crate::scene::Orientation;
use crate::study::takes::StepInputs;
use crate::study::{BestPoint, Given, Study, read_study};

/// Two halves of one finger, designed side by side, and the finger that they make.
fn finger() -> Value {
    let half = |id: &str| {
        json!({
            "id": id, "level": 2, "simplifies": [{"kind": "split"}, {"kind": "repeat"}],
            "target": {"kind": "enclosed_area", "probe_mm": [160, 40], "orientation": "either"},
            "model": {"kind": "fe_cascade", "units": 2},
            "optimiser": {"method": "gcmma"},
            "restarts": {"start": ["paper", "random"], "count": 1},
            "keeps": 2,
        })
    };
    json!({
        "name": "finger",
        "actuator": {"units": 3},
        "actuation": {"schedule": "hold", "pressure_kpa": 15, "load_steps_per_leg": 2},
        "step": [half("root"), half("end"), {
            "id": "whole", "level": 1,
            "takes": [
                {"step": "root", "as": "geometry", "units": [1, 2]},
                {"step": "end", "as": "geometry", "units": [3], "candidates": 1},
            ],
            "target": {"kind": "enclosed_area", "probe_mm": [240, 40], "orientation": "either"},
            "model": {"kind": "fe_direct"},
            "optimiser": {"method": "sweep", "points": "taken"},
        }],
    })
}

fn study(document: &Value) -> Study {
    read_study(document, false).unwrap_or_else(|faults| panic!("{faults}"))
}

/// Paths of the faults of a document.
fn paths(document: &Value) -> Vec<String> {
    match read_study(document, false) {
        Ok(_) => Vec::new(),
        Err(faults) => faults.0.into_iter().map(|f| f.path).collect(),
    }
}

fn candidate(x: Vec<f64>, objective: f64) -> Candidate {
    Candidate {
        restart: 0,
        evaluation: 0,
        x,
        objective,
        max_violation: 0.0,
        orientation: Some(Orientation::Clockwise),
        given: Given::default(),
    }
}

fn pair(side: f64) -> Vec<f64> {
    LayoutBoxes::PAPER.rectangles([side, 20.0])
}

fn done(candidates: Vec<Candidate>) -> Progress {
    Progress::Done(StepResult { candidates })
}

#[test]
fn steps_side_by_side_are_joined_by_the_units_that_they_give() {
    let study = study(&finger());
    assert_eq!(read_study(&study.document(), false).as_ref(), Ok(&study));
    let begins = |progress: &[Progress]| -> Vec<usize> {
        let due = due(&study, progress).unwrap();
        let step = |due: &Due| match due {
            Due::Begin { step, .. } => Some(*step),
            Due::Block { .. } => None,
        };
        due.iter().filter_map(step).collect()
    };
    let waiting = Progress::Waiting;
    assert_eq!(
        begins(&[waiting.clone(), waiting.clone(), waiting.clone()]),
        [0, 1]
    );
    let root = done(vec![
        candidate(pair(50.0), -9.0),
        candidate(pair(40.0), -8.0),
    ]);
    let end = done(vec![
        candidate(pair(30.0), -3.0),
        candidate(pair(20.0), -2.0),
    ]);
    assert!(begins(&[root.clone(), Progress::Running, waiting.clone()]).is_empty());
    let Due::Begin { step: 2, inputs } = &due(&study, &[root, end, waiting]).unwrap()[0] else {
        panic!("the whole is due");
    };
    // Both candidates of the root, the best one of the end; units 1 and 2 are copies of the root's.
    let designs: Vec<_> = inputs.designs.iter().map(|d| d.x.clone()).collect();
    let whole = |root: f64| [pair(root), pair(root), pair(30.0)].concat();
    assert_eq!(designs, [whole(50.0), whole(40.0)]);
    assert_eq!(inputs.designs[1].from[0].candidate, 1);
    assert_eq!(inputs.designs[1].from[1].objective, -3.0);
    // A joined design runs round its area in a sense of its own.
    assert_eq!(inputs.designs[0].orientation, None);
    let restarts = study.restarts(2, inputs).unwrap();
    assert_eq!(restarts.len(), 1);
    assert_eq!(restarts[0].points, designs);
}

#[test]
fn a_step_alone_brings_what_it_takes_from_and_no_more() {
    let study = study(&finger());
    let ids = |id: &str| -> Option<Vec<String>> {
        let needed = study.needed_for(id)?;
        // It is a sound study of its own.
        assert_eq!(read_study(&needed.document(), false).as_ref(), Ok(&needed));
        Some(needed.steps.into_iter().map(|step| step.id).collect())
    };
    assert_eq!(ids("end").unwrap(), ["end"]);
    assert_eq!(ids("whole").unwrap(), ["root", "end", "whole"]);
    assert_eq!(ids("tip"), None);
}

#[test]
fn a_step_without_candidates_blocks_what_follows_and_no_more() {
    let study = study(&finger());
    let blocked = due(
        &study,
        &[done(vec![]), Progress::Running, Progress::Waiting],
    )
    .unwrap();
    let [Due::Block { step: 2, reason }] = &blocked[..] else {
        panic!("{blocked:?}");
    };
    assert!(
        reason.contains("\"root\" found nothing feasible"),
        "{reason}"
    );
    let rest = due(
        &study,
        &[Progress::Blocked, Progress::Running, Progress::Waiting],
    )
    .unwrap();
    assert!(matches!(&rest[..], [Due::Block { step: 2, .. }]));
}

#[test]
fn candidates_are_the_best_that_differ() {
    let study = study(&finger());
    let point = |side: f64, objective: f64| BestPoint {
        evaluation: 0,
        x: pair(side),
        objective,
        constraints: Vec::new(),
        max_violation: 0.0,
        plan_base: None,
        walls_overlap: false,
        orientation: None,
    };
    // A corner has 37.5 mm of room, and a rectangle moves it by half its change.
    let near = 40.0 + 2.0 * 37.5 * 0.5 * DISTINCT;
    let kept = [
        (0, point(30.0, -1.0)),
        (1, point(near, -2.9)),
        (2, point(40.0, -3.0)),
        (3, point(50.0, -2.0)),
    ];
    let result = StepResult::of(&study, 0, &Given::default(), &kept).unwrap();
    let restarts: Vec<_> = result.candidates.iter().map(|c| c.restart).collect();
    assert_eq!(restarts, [2, 3]);
}

/// The layout step's choice reaches the next step: its boxes, its number of variables, its starts.
#[test]
fn a_chosen_layout_is_handed_on_with_its_boxes() {
    let document = json!({
        "name": "layouts",
        "actuator": {"units": 3},
        "actuation": {"schedule": "hold", "pressure_kpa": 15, "load_steps_per_leg": 2},
        "step": [
            {"id": "motion", "pass": "forward", "level": 2, "simplifies": [{"kind": "reduce"}],
             "target": {"kind": "enclosed_area", "probe_mm": [240, 40]},
             "model": {"kind": "linear_transform", "actuations": 2},
             "optimiser": {"method": "gcmma"}, "restarts": {"start": "random", "count": 1}},
            {"id": "layout", "level": 3, "takes": [{"step": "motion", "as": "behaviour"}],
             "model": {"kind": "fe_layouts", "layouts": ["stacked_pair", "three_chambers"]},
             "optimiser": {"method": "sweep", "grid": [[0, 1], [0.5], [0.8]]}, "keeps": 2},
            {"id": "corners", "level": 2, "takes": [{"step": "layout", "as": "starts"}],
             "target": {"kind": "enclosed_area", "probe_mm": [160, 40], "orientation": "either"},
             "model": {"kind": "fe_cascade"}, "optimiser": {"method": "gcmma"},
             "restarts": {"start": ["paper", "taken"]}},
        ],
    });
    let study = study(&document);
    assert_eq!(read_study(&study.document(), false).as_ref(), Ok(&study));
    let entries = vec![1.1, 0.1, -0.1, 1.0, 1.2, 0.0, 0.0, 1.0];
    let motion = done(vec![candidate(entries, -100.0)]);
    let waiting = Progress::Waiting;
    let first = due(&study, &[motion.clone(), waiting.clone(), waiting.clone()]).unwrap();
    let [Due::Begin { step: 1, inputs }] = &first[..] else {
        panic!("{first:?}");
    };
    assert_eq!(inputs.given.behaviour[0].x_sh, 0.1);
    assert_eq!(inputs.given.behaviour.len(), 2);
    let of_layout = |best: f64, second: f64| {
        done(vec![
            candidate(vec![best, 0.5, 0.8], 0.3),
            candidate(vec![second, 0.5, 0.8], 0.4),
        ])
    };
    let inputs = |result: Progress| -> StepInputs {
        match due(&study, &[motion.clone(), result, waiting.clone()])
            .unwrap()
            .remove(0)
        {
            Due::Begin { step: 2, inputs } => inputs,
            other => panic!("{other:?}"),
        }
    };
    let three = inputs(of_layout(1.0, 0.0));
    assert_eq!(three.given.layout, Some(Layout::ThreeChambers));
    // The stacked pair is another layout, so only one design is left.
    assert_eq!(three.designs.len(), 1);
    assert_eq!(three.designs[0].x.len(), 24);
    let restarts = study.restarts(2, &three).unwrap();
    // In both senses from the paper's start, in the one in which the candidate counts from there.
    let lengths: Vec<_> = restarts.iter().map(|r| r.x0.len()).collect();
    assert_eq!(lengths, [24, 24, 24]);
    let of_three = study.given(2, &three.given);
    assert_eq!(of_three.variables(2).unwrap().lower.len(), 24);
    // The actuator's own layout needs no saying, and keys of evaluations stay what they are without.
    assert_eq!(inputs(of_layout(0.0, 1.0)).given, Given::default());
}

fn faults(change: impl FnOnce(&mut Value)) -> Vec<(String, String)> {
    let mut document = finger();
    change(&mut document);
    match read_study(&document, false) {
        Ok(_) => Vec::new(),
        Err(faults) => faults.0.into_iter().map(|f| (f.path, f.message)).collect(),
    }
}

/// Asserts one fault at a path that says something.
#[track_caller]
fn refused(path: &str, says: &str, change: impl FnOnce(&mut Value)) {
    let faults = faults(change);
    assert!(
        faults
            .iter()
            .any(|(at, message)| at == path && message.contains(says)),
        "{faults:?}"
    );
}

#[test]
fn what_is_no_graph_is_refused_before_anything_runs() {
    assert_eq!(faults(|_| {}), []);
    refused("step[2].takes[1].step", "no step is named \"tip\"", |d| {
        d["step"][2]["takes"][1]["step"] = json!("tip");
    });
    refused("step[0].takes", "wait for each other: root, end", |d| {
        for (step, from) in [(0, "end"), (1, "root")] {
            d["step"][step]["takes"] = json!([{"step": from, "as": "starts"}]);
            d["step"][step]["restarts"]["start"] = json!(["taken", "random"]);
        }
    });
    refused("step[0].takes[0].step", "cannot take from itself", |d| {
        d["step"][0]["takes"] = json!([{"step": "root", "as": "starts"}]);
        d["step"][0]["restarts"]["start"] = json!(["taken", "random"]);
    });
    refused("step[2].takes", "nothing gives unit 2", |d| {
        d["step"][2]["takes"][0]["units"] = json!([1]);
    });
    refused("step[2].takes", "unit 3 is taken from two steps", |d| {
        d["step"][2]["takes"][0]["units"] = json!([1, 2, 3]);
    });
    refused("step[2].takes", "unit 4 of 3", |d| {
        d["step"][2]["takes"][1]["units"] = json!([3, 4]);
    });
    refused("step[2].takes[1].candidates", "keeps 2", |d| {
        d["step"][2]["takes"][1]["candidates"] = json!(3);
    });
    refused("step[2].optimiser.points", "needs an entry of takes", |d| {
        d["step"][2]["takes"] = json!([]);
    });
    refused("step[2].takes[0].as", "no starts", |d| {
        d["step"][2]["takes"][0]["as"] = json!("starts");
    });
    refused("step[0].takes[0].step", "from the last level up", |d| {
        d["step"][0]["takes"] = json!([{"step": "whole", "as": "starts"}]);
        d["step"][0]["restarts"]["start"] = json!(["taken", "random"]);
    });
    refused("step[0].simplifies[0]", "no part of the actuator", |d| {
        d["step"][0]["model"]["units"] = json!(3);
    });
    refused("step[2].simplifies[0]", "repeats none", |d| {
        d["step"][2]["simplifies"] = json!([{"kind": "repeat"}]);
    });
    refused("step[0].simplifies[1]", "not symmetric", |d| {
        d["step"][0]["simplifies"][1] = json!({"kind": "symmetry"});
    });
    refused("step[0].model.units", "the actuator has 3 units", |d| {
        d["step"][0]["model"]["units"] = json!(4);
    });
}
