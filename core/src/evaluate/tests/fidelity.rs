//! Evaluations below the study's own fidelity.

use serde_json::json;

use super::super::evaluate;
use crate::equilibrium::Unobserved;
use crate::study::race::Fidelity;
use crate::study::{EvaluationRequest, OutcomeStatus, StepInputs, begin, read_study};

#[test]
fn a_rung_has_fewer_elements_and_states_and_nearly_the_same_values() {
    let document = json!({
        "name": "fidelity",
        "material": "mold-star-30",
        "actuator": {"units": 1},
        "actuation": {"schedule": [[0, 0], [10, 0], [0, 0]], "load_steps_per_leg": 3},
        "step": [{
            "id": "one",
            "target": {"kind": "displacement", "probe_mm": [80, 40], "component": "y", "state": 3},
            "model": {"kind": "fe_cascade", "element": "quad9", "max_size_mm": 4},
            "optimiser": {"method": "gcmma"},
            "restarts": {"start": "given", "points": [[20, 10, 60, 10, 60, 34, 20, 34, 20, 46, 60, 46, 60, 70, 20, 70]]}
        }]
    });
    let study = read_study(&document, false).unwrap_or_else(|faults| panic!("{faults}"));
    let spec = &study.restarts(0, &StepInputs::default()).expect("a step")[0];
    let (_, asks) = begin(&study, spec).expect("it begins");
    let at = |fidelity: Option<Fidelity>| {
        let request = EvaluationRequest {
            fidelity,
            ..asks[0].clone()
        };
        let outcome = evaluate(&study, &request, &mut Unobserved);
        assert_eq!(outcome.status, OutcomeStatus::Ok);
        outcome
    };
    let coarser = |mesh: f64, load_steps_per_leg: Option<usize>| {
        at(Some(Fidelity {
            mesh,
            load_steps_per_leg,
        }))
    };
    let own = at(None);
    let size = |outcome: &crate::study::Outcome| {
        let report = outcome.report.as_ref().expect("a report");
        (report.elements, report.path.len())
    };
    let (elements, states) = size(&own);
    let half = coarser(0.5, None);
    let (fewer, same) = size(&half);
    assert!(
        fewer < elements && 8 * fewer > elements,
        "{fewer} of {elements}"
    );
    assert_eq!((states, same), (7, 7));
    assert_eq!(size(&coarser(1.0, Some(1))), (elements, 3));
    // More states than the study's are as many as the study's.
    let as_many = coarser(1.0, Some(9));
    assert_eq!(as_many.objective, own.objective);
    let (a, b) = (own.objective.expect("ok"), half.objective.expect("ok"));
    assert!(a != b && (a - b).abs() < 0.2 * a.abs(), "{a} and {b}");
    assert_eq!(half.constraints.len(), own.constraints.len());
}
