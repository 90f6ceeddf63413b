//! Meshes chosen for an error.

use serde_json::json;

use super::super::{Clock, Run, choose_meshes};
use crate::equilibrium::{Observer, Phase};
use crate::scene::ElementChoice;
use crate::study::spec::{AccuracyDesign, FeModel};
use crate::study::{Study, read_study};

struct NoClock;

impl Observer for NoClock {
    fn enter(&mut self, _: Phase) {}
}

impl Clock for NoClock {
    fn cpu_s(&self) -> f64 {
        0.0
    }

    fn done(&mut self, _: &Run) {}
}

fn study(error: f64, element: &str) -> Study {
    let document = json!({
        "name": "accuracy",
        "actuator": {"units": 1},
        "material": "mold-star-30",
        "actuation": {"schedule": [[0, 0], [10, 0]], "load_steps_per_leg": 1},
        "step": [{
            "id": "one",
            "target": {"kind": "displacement", "probe_mm": [80, 40], "component": "y", "leg": 0},
            "model": {"kind": "fe_cascade", "element": element, "mesh": {"error": error}},
            "optimiser": {"method": "gcmma"},
            "restarts": {"start": "paper"}
        }]
    });
    read_study(&document, true).unwrap_or_else(|faults| panic!("{faults}"))
}

fn model(study: &Study) -> &FeModel {
    study.steps[0].model.finite_elements().expect("a model")
}

#[test]
fn a_mesh_is_chosen_once_and_for_all() {
    let open = study(0.03, "auto");
    assert_eq!(open.unchosen_meshes().0[0].path, "step[0].model.mesh");
    let chosen = choose_meshes(&open, &mut NoClock).unwrap_or_else(|f| panic!("{f}"));
    assert!(chosen.unchosen_meshes().0.is_empty());
    let found = model(&chosen)
        .accuracy
        .as_ref()
        .and_then(|a| a.chosen.as_ref());
    let found = found.expect("a choice");
    assert_eq!((found.at, found.area_error), (AccuracyDesign::Middle, None));
    assert!(found.tip_error + found.uncertainty <= 0.03);
    // It reads back, is not chosen again, and would be the same elsewhere.
    assert_eq!(read_study(&chosen.document(), true), Ok(chosen.clone()));
    assert_eq!(choose_meshes(&chosen, &mut NoClock), Ok(chosen.clone()));
    assert_ne!(chosen.fingerprint(), open.fingerprint());
    // A smaller error takes more elements; a named element is kept.
    let finer = choose_meshes(&study(0.01, "quad9"), &mut NoClock);
    let finer = finer.unwrap_or_else(|f| panic!("{f}"));
    assert_eq!(model(&finer).element, ElementChoice::Quad9);
    let of = |study: &Study| model(study).accuracy.clone().and_then(|a| a.chosen);
    assert!(of(&finer).is_some_and(|c| c.tip_error + c.uncertainty <= 0.01));
    let faults = choose_meshes(&study(1e-6, "auto"), &mut NoClock).unwrap_err();
    assert_eq!(faults.0[0].path, "step[0].model.mesh.error");
}
