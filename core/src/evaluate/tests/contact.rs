//! Contact in scenes and studies.

use serde_json::json;

use super::ask::Asked;
use super::{named_scene, solved};
use crate::evaluate::{SceneOptions, SceneStatus};
use crate::study::{Study, read_study};

/// Trapezia whose sharp corners zip shut; a slanted pair; a wide and flat one.
const DESIGNS: [[f64; 16]; 3] = [
    [
        30., 3., 50., 3., 76., 38., 4., 38., 4., 42., 76., 42., 50., 77., 30., 77.,
    ],
    [
        20.0, 3.0, 61.0, 2.5, 58.0, 38.5, 24.0, 39.0, 22.0, 41.5, 64.0, 43.0, 59.0, 60.5, 38.0,
        63.0,
    ],
    [
        12., 6., 68., 5., 66., 36., 14., 37., 16., 44., 62., 45., 64., 72., 18., 70.,
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
