//! A body that was meshed here, written to a Gmsh file and read back through `mesh_file`, is the same body.

use std::path::Path;

use serde_json::{Value, json};

use super::super::{SceneOptions, SceneSolution, SceneStatus, solve_scene};
use crate::equilibrium::Unobserved;
use crate::mesh::gmsh::{export, write};
use crate::scene::read_scene;

fn solved(scene: &Value, folder: &Path) -> SceneSolution {
    let scene = read_scene(scene, folder).unwrap_or_else(|faults| panic!("{faults}"));
    let solution = solve_scene(&scene, &SceneOptions::default(), &mut Unobserved);
    let solution = solution.unwrap_or_else(|faults| panic!("{faults}"));
    assert_eq!(solution.answer.status, SceneStatus::Ok);
    solution
}

/// Two units of different stiffness, one chamber slanted, by way of a file of this name.
fn round_trip(element: &str, max_size_mm: f64, file: &str) {
    let soft = json!({"model": "neo_hookean", "c10_mpa": 0.11});
    let stiff = json!({"model": "yeoh", "c_mpa": [0.2, 0.01, 0.0]});
    let mut scene = json!({
        "version": 1,
        "actuator": {"repeat": 2, "chambers_mm": [
            [[20, 13], [60, 10], [58, 28], [20, 28]],
            [[20, 52], [60, 52], [60, 67], [20, 67]]
        ]},
        "material": soft,
        "unit_materials": [soft, stiff],
        "actuation": {"schedule": "overlap", "pressure_kpa": 20, "load_steps_per_leg": 1},
        "mesh": {"element": element, "max_size_mm": max_size_mm},
        "probes": {"tip": [160, 40]},
        "objective": {"kind": "enclosed_area", "probe": "tip", "orientation": "clockwise"}
    });
    let folder = std::env::temp_dir();
    let first = solved(&scene, &folder);
    let exported = export(first.body.as_ref().expect("a body"));
    let names: Vec<&str> = exported.groups.iter().map(|g| g.name.as_str()).collect();
    let expected = ["left", "channel-0", "channel-1", "material-0", "material-1"];
    assert_eq!(names, expected);

    let path = folder.join(format!("salp-{}-{file}", std::process::id()));
    std::fs::write(&path, write(&exported).expect("text")).expect("a file");
    let document = scene.as_object_mut().expect("an object");
    for key in ["actuator", "unit_materials", "mesh"] {
        document.remove(key);
    }
    document.insert("mesh_file".into(), json!(path));
    document.insert(
        "supports".into(),
        json!([{"group": "left", "fix": ["x", "y"]}]),
    );
    document.insert(
        "pressures".into(),
        json!([{"group": "channel-0", "channel": 0}, {"group": "channel-1", "channel": 1}]),
    );
    document.insert(
        "materials".into(),
        json!([{"group": "material-0", "material": soft}, {"group": "material-1", "material": stiff}]),
    );
    let second = solved(&scene, &folder);
    std::fs::remove_file(&path).expect("the file");

    let (first, second) = (first.answer, second.answer);
    assert_eq!(
        (&first.mesh.element, first.mesh.elements, first.mesh.dofs),
        (&second.mesh.element, second.mesh.elements, second.mesh.dofs)
    );
    for (a, b) in first.path.iter().zip(&second.path) {
        for i in 0..2 {
            let difference = a.displacement_mm["tip"][i] - b.displacement_mm["tip"][i];
            assert!(difference.abs() < 1e-9, "{a:?} {b:?}");
            assert!((a.cavity_area_mm2[i] - b.cavity_area_mm2[i]).abs() < 1e-7);
        }
    }
    let (a, b) = (
        first.objective.expect("one"),
        second.objective.expect("one"),
    );
    assert!((a - b).abs() < 1e-7 && a.abs() > 0.1, "{a} {b}");
}

#[test]
fn an_exported_mesh_solves_to_the_same_answer() {
    round_trip("quad9", 16.0, "quad9.msh");
    round_trip("quad4", 8.0, "quad4.msh");
}
