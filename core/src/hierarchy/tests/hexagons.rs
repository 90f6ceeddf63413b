//! Chambers of six corners take what those of four hand on.

use super::*;

/// What four corners found is where six begin; six are no four.
#[test]
fn a_step_of_hexagons_begins_with_quadrilaterals() {
    let text = include_str!("../../../../examples/asymmetric-bending.toml");
    let mut document = toml::from_str::<Value>(text).expect("valid TOML");
    let mut six = document["step"][0].clone();
    six["id"] = json!("six");
    six["level"] = json!(1);
    six["variables"] = json!({"parametrisation": "corners", "corners": 6});
    six["takes"] = json!([{"step": document["step"][0]["id"], "as": "starts"}]);
    six["restarts"] = json!({"start": "taken"});
    document["step"].as_array_mut().expect("steps").push(six);
    let study = study(&document);
    assert_eq!(super::study(&study.document()), study);
    assert_eq!(study.variables(0).expect("variables").lower.len(), 16);
    assert_eq!(study.variables(1).expect("variables").lower.len(), 24);
    let four = study.body_of(0).expect("a step").expect("chambers");
    let x = four.actuator.boxes().rectangles([50.0, 20.0]);
    let found = Progress::Done(StepResult {
        candidates: vec![Candidate {
            restart: 0,
            evaluation: 0,
            x,
            objective: -1.0,
            max_violation: 0.0,
            orientation: None,
            given: Given::default(),
        }],
    });
    let next = due(&study, &[found, Progress::Waiting])
        .expect("sound")
        .remove(0);
    let Due::Begin { step: 1, inputs } = next else {
        panic!("the step of six corners is due");
    };
    let own = study.body_of(1).expect("a step").expect("chambers");
    let same = own.actuator.boxes().rectangles([50.0, 20.0]);
    assert_eq!(inputs.designs[0].x, same);
    let within = study.variables(1).expect("variables");
    let bounds = within.lower.iter().zip(&within.upper);
    assert!(bounds.zip(&same).all(|((a, b), x)| a <= x && x <= b));
    // The other way round corners would be lost.
    document["actuator"]["corners"] = json!(6);
    document["step"][1]["variables"]["corners"] = json!(4);
    assert_eq!(paths(&document), ["step[1].takes[0].as"]);
}
