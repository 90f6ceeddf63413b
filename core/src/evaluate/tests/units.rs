//! Other units than the paper's: hexagonal chambers, and sequences of different units.

use serde_json::{Value, json};

use super::ask::Asked;
use crate::equilibrium::Unobserved;
use crate::evaluate::evaluate;
use crate::geometry::{LayoutBoxes, Point};
use crate::scene::Orientation;
use crate::study::takes::TakenFrom;
use crate::study::{EvaluationRequest, Given, Letter, OutcomeStatus, Study, read_study};

fn step(id: &str, model: &Value) -> Value {
    json!({
        "id": id,
        "target": {"kind": "enclosed_area", "probe_mm": "tip", "orientation": "clockwise"},
        "model": model,
        "constraints": {"stretch": 1.5, "wall_gap_mm": 0.2},
        "optimiser": {"method": "gcmma"},
        "restarts": {"start": "paper"},
    })
}

fn study(actuator: &Value, steps: &Value) -> Study {
    let document = json!({
        "name": "units",
        "actuator": actuator,
        "material": "mold-star-30-soft",
        "actuation": {"schedule": "hold", "pressure_kpa": 10, "load_steps_per_leg": 2},
        "step": steps,
    });
    read_study(&document, true).unwrap_or_else(|faults| panic!("{faults}"))
}

fn model(kind: &str, max_size_mm: f64) -> Value {
    json!({
        "kind": kind, "element": "quad9", "max_size_mm": max_size_mm,
        "relative_residual_force_tolerance": 1e-11,
    })
}

/// Hexagons with a notch in the lower chamber's upper side and a roof on the upper chamber.
const HEXAGONS: [Point; 12] = [
    [20.0, 4.0],
    [44.0, 8.0],
    [61.0, 3.5],
    [58.0, 36.5],
    [37.0, 25.0],
    [24.0, 37.0],
    [22.0, 43.5],
    [41.0, 46.0],
    [64.0, 44.0],
    [59.0, 60.5],
    [47.0, 71.0],
    [18.0, 63.0],
];

#[test]
fn gradients_of_hexagons_match_differences() {
    let steps = json!([step("hexagons", &model("fe_cascade", 8.0))]);
    let study = study(&json!({"units": 2, "corners": 6}), &steps);
    let x = HEXAGONS.concat();
    let asked = Asked {
        study: &study,
        base: &x,
        orientation: Some(Orientation::Clockwise),
    };
    asked.check_gradients(&x, 2, 1e-3, 1e-6);
}

/// A sequence is worth what the units that it names are worth as free ones.
#[test]
fn a_sequence_has_the_value_of_its_units() {
    let mut mixed = step("mixed", &model("fe_direct", 20.0));
    mixed["takes"] = json!([{"step": "unit", "as": "alphabet"}]);
    mixed["variables"] = json!({"parametrisation": "sequence"});
    mixed["optimiser"] = json!({"method": "exchange"});
    if let Some(fields) = mixed.as_object_mut() {
        fields.remove("restarts");
    }
    let mut unit = step("unit", &model("fe_cascade", 20.0));
    unit["keeps"] = json!(2);
    let steps = json!([unit, mixed, step("free", &model("fe_direct", 20.0))]);
    let study = study(&json!({"units": 2}), &steps);
    let units = [40.0, 60.0].map(|side| LayoutBoxes::PAPER.rectangles([side, 20.0]));
    let letter = |corners: &Vec<f64>| Letter {
        corners: corners.clone(),
        unit: 1,
        from: TakenFrom {
            step: "unit".into(),
            candidate: 0,
            objective: 0.0,
        },
    };
    let given = Given {
        alphabet: units.iter().map(letter).collect(),
        ..Given::default()
    };
    let outcome = |step: usize, x: Vec<f64>, given: &Given| {
        let request = EvaluationRequest {
            step,
            kind: serde_json::from_value(json!("initial")).expect("a kind"),
            iteration: 0,
            plan_base: Some(x.clone()),
            x,
            want_gradient: false,
            orientation: Some(Orientation::Clockwise),
            second_mesh: false,
            fidelity: None,
            given: given.clone(),
        };
        let outcome = evaluate(&study, &request, &mut Unobserved);
        assert_eq!(outcome.status, OutcomeStatus::Ok);
        let own = study.given(step, given);
        own.checked(&request, &outcome).expect("a step")
    };
    let mut objectives = Vec::new();
    for sequence in [[0, 0], [0, 1], [1, 0]] {
        let letters = sequence.map(|k| k as f64).to_vec();
        let of_letters = outcome(1, letters, &given);
        let corners = sequence.map(|k| units[k].clone()).concat();
        let of_units = outcome(2, corners, &Given::default());
        assert_eq!(of_letters.objective, of_units.objective);
        assert_eq!(of_letters.constraints, of_units.constraints);
        objectives.push(of_letters.objective.expect("a value"));
    }
    // The order matters: the root carries the end.
    assert!((objectives[1] - objectives[2]).abs() > 1e-3 * objectives[1].abs());
}
