//! Contact in scenes and studies.

use std::path::Path;

use serde_json::{Value, json};

use super::ask::Asked;
use super::{named_scene, solved};
use crate::equilibrium::Unobserved;
use crate::evaluate::{SceneOptions, SceneStatus, solve_scene};
use crate::scene::read_scene;
use crate::study::{Study, read_study};

/// Pairs of trapezia whose sharp corners zip shut; none has walls that tie, or a line of the mesh through the probe.
const DESIGNS: [[f64; 16]; 3] = [
    [
        30.3, 3.1, 50.2, 3.4, 75.7, 37.6, 4.4, 38.1, 4.3, 42.4, 75.5, 41.9, 50.4, 76.6, 29.6, 77.2,
    ],
    [
        27.3, 3.2, 52.6, 3.3, 76.2, 37.4, 3.7, 37.9, 4.6, 41.8, 76.3, 42.3, 53.1, 76.8, 28.2, 77.1,
    ],
    [
        33.1, 4.4, 46.7, 3.7, 75.9, 37.9, 5.3, 37.2, 3.9, 42.7, 74.8, 42.2, 47.5, 77.3, 33.8, 76.2,
    ],
];

fn study() -> Study {
    let document = json!({
        "name": "contact",
        "actuator": {"units": 1},
        "material": "mold-star-30-soft",
        "actuation": {"schedule": "hold", "pressure_kpa": 15, "load_steps_per_leg": 2},
        "step": [{
            "id": "one",
            "target": {"kind": "enclosed_area", "probe_mm": [80, 40], "orientation": "clockwise"},
            "model": {
                "kind": "fe_cascade",
                "element": "quad9",
                "max_size_mm": 8,
                "relative_residual_force_tolerance": 1e-12
            },
            "constraints": {"stretch": 1.5, "load_margin": 1.1},
            "optimiser": {"method": "gcmma"},
            "restarts": {"start": ["paper"]}
        }]
    });
    read_study(&document, false).unwrap_or_else(|faults| panic!("{faults}"))
}

#[test]
fn gradients_through_contact_match_differences() {
    let study = study();
    for base in &DESIGNS {
        let asked = Asked {
            study: &study,
            base,
            orientation: Some(crate::scene::Orientation::Clockwise),
        };
        let outcome = asked.at(base, false);
        let report = outcome.report.expect("a report");
        assert!(
            report.left_out.is_empty(),
            "contact acts: {:?}",
            report.left_out
        );
        asked.check_gradients(base, 1, 1e-4, 1e-6);
    }
}

#[test]
fn walls_that_meet_do_not_pass_and_the_body_comes_back_to_rest() {
    let mut scene = named_scene("trapezia-wide-inside");
    scene["contact"] = json!("auto");
    scene["actuation"]["load_steps_per_leg"] = json!(4);
    let answer = solved(&scene, &SceneOptions::default());
    assert_eq!(answer.status, SceneStatus::Ok, "{:?}", answer.reason);
    let contact = answer.contact.expect("contact");
    assert_eq!(contact.penetration_mm, 0.0);
    let gap = contact.least_distance_mm.expect("walls touch");
    assert!(gap > 0.02 && gap < 0.2, "{gap} mm");
    assert!(answer.walls_overlap.is_none(), "an independent search");
    let last = answer.path.last().expect("states");
    for u in last.displacement_mm.values().flatten() {
        assert!(u.abs() < 1e-6, "{u} mm at zero pressure");
    }
    // Off, the walls cross.
    scene["contact"] = json!("off");
    let off = solved(&scene, &SceneOptions::default());
    assert!(off.walls_overlap.is_some() && off.contact.is_none());
}

#[test]
fn a_gap_narrower_than_twice_the_activation_distance_is_a_fault_or_lowers_it() {
    let mut document = named_scene("chambers-40x15");
    document["actuator"]["repeat"] = json!(1);
    document["actuator"]["chambers_mm"][1] = json!([[20, 55], [60, 55], [60, 55.15], [20, 55.15]]);
    document["probes"] = json!({"tip": [80, 40]});
    document["actuation"] = json!({"schedule": [[0, 0], [2, 0]], "load_steps_per_leg": 1});
    document["objective"] = json!(null);
    let solve = |document: &Value| {
        let scene = read_scene(document, Path::new("")).expect("a scene");
        solve_scene(&scene, &SceneOptions::default(), &mut Unobserved)
    };
    document["contact"] = json!("on");
    let Err(faults) = solve(&document) else {
        panic!("a fault");
    };
    assert!(
        faults.to_string().contains("contact_activation_mm"),
        "{faults}"
    );
    document["contact"] = json!("auto");
    let answer = solve(&document).expect("an answer").answer;
    assert_eq!(answer.status, SceneStatus::Ok, "{:?}", answer.reason);
    let note = answer
        .notes
        .iter()
        .find(|n| n.about == "contact_activation_mm");
    assert!(
        note.is_some_and(|n| n.message.contains("0.075 mm")),
        "{:?}",
        answer.notes
    );
}

#[test]
fn a_scene_whose_walls_stay_apart_does_the_work_of_one_without_contact() {
    let mut scene = named_scene("chambers-40x15");
    let off = solved(&scene, &SceneOptions::default());
    scene["contact"] = json!("auto");
    let auto = solved(&scene, &SceneOptions::default());
    assert_eq!(auto.work.newton_iterations, off.work.newton_iterations);
    assert_eq!(auto.work.factorisations, off.work.factorisations);
    assert_eq!(auto.enclosed_area_mm2, off.enclosed_area_mm2);
    let why = auto.left_out.iter().find(|l| l.what == "self-contact");
    assert!(why.is_some_and(|l| l.why.contains("least gap")));
}

#[test]
fn an_obstacle_presses_back_with_the_force_that_it_takes() {
    // Both chambers under pressure push the free end of a unit against a wall; its fixed end takes the force.
    let mut scene = named_scene("chambers-40x15");
    scene["contact"] = json!("auto");
    scene["actuator"]["repeat"] = json!(1);
    scene["actuator"]["chambers_mm"] = json!([
        [[10, 5], [70, 5], [70, 35], [10, 35]],
        [[10, 45], [70, 45], [70, 75], [10, 75]]
    ]);
    scene["actuation"] = json!({"schedule": [[0, 0], [15, 15]], "load_steps_per_leg": 3});
    scene["objective"] = json!(null);
    scene["probes"] = json!({"tip": [80, 40]});
    scene["obstacles"] = json!([
        {"name": "wall", "shape": "line", "points_mm": [[80.5, -40], [80.5, 120]]}
    ]);
    let free = {
        let mut scene = scene.clone();
        scene["obstacles"] = json!([]);
        solved(&scene, &SceneOptions::default())
    };
    let held = solved(&scene, &SceneOptions::default());
    assert_eq!(held.status, SceneStatus::Ok, "{:?}", held.reason);
    let reach = |answer: &crate::evaluate::SceneAnswer| {
        answer.path.last().expect("states").displacement_mm["tip"]
    };
    assert!(reach(&free)[0] > 0.5, "{:?}", reach(&free));
    assert!(reach(&held)[0] < 0.5, "{:?}", reach(&held));
    let last = held.path.last().and_then(|s| s.contact.as_ref());
    let force = last.expect("contact").obstacle_force_n_per_mm["wall"];
    // The wall is pushed outwards, and nothing rubs on it.
    assert!(force[0] > 0.1, "{force:?}");
    assert!(force[1].abs() < 1e-3 * force[0], "{force:?}");
}
