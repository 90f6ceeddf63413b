//! Bad input: exit code 2, every fault at once with its path, nothing stored.

use std::path::Path;
use std::process::Command;

use salp_core::mesh::gmsh::{GmshElementKind, structured, write};
use serde_json::{Value, json};

use super::support::{Folder, SALP, serve, study};

/// Exit code and document of a verb with `--json`.
pub fn salp(folder: &Path, arguments: &[&str]) -> (i32, Value) {
    let output = Command::new(SALP)
        .args(arguments)
        .arg("--json")
        .current_dir(folder)
        .output()
        .unwrap();
    let text = String::from_utf8(output.stdout).unwrap();
    let document = serde_json::from_str(&text).unwrap_or_else(|_| {
        panic!(
            "no document in {text:?}: {}",
            String::from_utf8_lossy(&output.stderr)
        )
    });
    (output.status.code().unwrap(), document)
}

/// Paths of the faults of a refusal.
pub fn refused(folder: &Path, arguments: &[&str]) -> Vec<String> {
    let (code, document) = salp(folder, arguments);
    assert_eq!(code, 2, "{document}");
    assert_eq!(document["status"], "bad_input");
    let faults = document["faults"].as_array().unwrap();
    faults
        .iter()
        .map(|fault| {
            assert!(!fault["message"].as_str().unwrap().is_empty());
            fault["path"].as_str().unwrap().to_owned()
        })
        .collect()
}

fn put(folder: &Folder, name: &str, document: &Value) {
    std::fs::write(folder.0.join(name), document.to_string()).unwrap();
}

#[test]
fn every_fault_of_a_scene_is_told_at_once() {
    let folder = Folder::new("scene");
    put(
        &folder,
        "scene.json",
        &json!({
            "version": 1,
            "actuator": {"repeat": 1, "chambers_mm": [[[20, 13], [90, 13], [60, 28], [20, 28]]]},
            "material": {"model": "neo_hookean", "c10_mpa": -0.1},
            "actuation": {"schedule": [[0, 0]]},
            "objektive": null
        }),
    );
    for verb in ["solve", "gradient"] {
        let paths = refused(&folder.0, &[verb, "scene.json"]);
        for path in [
            "objektive",
            "actuator.chambers_mm[0]",
            "material.c10_mpa",
            "actuation.schedule",
        ] {
            assert!(
                paths.iter().any(|p| p.starts_with(path)),
                "{path} in {paths:?}"
            );
        }
    }
    std::fs::write(folder.0.join("broken.json"), "{\"version\": 1,").unwrap();
    assert_eq!(refused(&folder.0, &["solve", "broken.json"]), [""]);
    assert_eq!(refused(&folder.0, &["solve", "missing.json"]), [""]);
    assert_eq!(refused(&folder.0, &["solve"]), ["arguments"]);
}

#[test]
fn overrides_act_and_their_faults_are_told() {
    let folder = Folder::new("set");
    put(
        &folder,
        "scene.json",
        &json!({
            "version": 1,
            "actuator": {"repeat": 1, "chambers_mm": []},
            "material": "mold-star-30",
            "actuation": {"schedule": "ramp"}
        }),
    );
    let scene = |more: &[&str]| refused(&folder.0, &[&["solve", "scene.json"], more].concat());
    assert_eq!(
        scene(&["--set", "mesh.max_size_mm=-1"]),
        ["mesh.max_size_mm"]
    );
    assert_eq!(
        scene(&["--set", "a..b=1", "--set", "version[0]=1"]),
        ["a..b", "version[0]"]
    );
}

#[test]
fn every_fault_of_a_study_is_told_and_nothing_is_stored() {
    let folder = Folder::new("study");
    let mut wrong = study(0.0);
    wrong["colour"] = json!("red");
    wrong["step"][0]["variables"]["lower"] = json!([5.0, -4.0, -4.0]);
    wrong["step"][0]["restarts"] = json!({"start": "random", "count": 0});
    put(&folder, "study.json", &wrong);
    let coordinator = serve(&folder, "127.0.0.1:0", &[]);
    let url = coordinator.url.clone();
    for arguments in [
        vec!["run", "study.json", "--allow-commands", "--out", "out"],
        vec!["submit", "study.json", "--url", &url],
    ] {
        let paths = refused(&folder.0, &arguments);
        for path in ["colour", "step[0].variables", "step[0].restarts"] {
            assert!(
                paths.iter().any(|p| p.starts_with(path)),
                "{path} in {paths:?}"
            );
        }
    }
    assert!(!folder.0.join("out").exists());
    assert_eq!(coordinator.client.studies(None).unwrap().studies.len(), 0);
    // A program needs leave.
    put(&folder, "study.json", &study(0.0));
    assert_eq!(
        refused(&folder.0, &["run", "study.json", "--out", "out"]),
        ["step[0].model"]
    );
    assert!(!folder.0.join("out").exists());
    assert_eq!(
        refused(&folder.0, &["show", "no-such-study", "--url", &url]),
        ["study"]
    );
    assert_eq!(
        refused(&folder.0, &["show", "x", "--url", "ftp://y"]),
        ["url"]
    );
}

#[test]
fn mesh_files_that_cannot_be_used_are_refused() {
    let folder = Folder::new("mesh");
    let mut mesh = structured(GmshElementKind::Quad9, [2, 2], |s, t| [s, t]);
    let good = write(&mesh).unwrap();
    let last = mesh.elements.last_mut().unwrap();
    last.nodes.swap(1, 3);
    let inverted = write(&mesh).unwrap();
    let scene = json!({
        "version": 1,
        "mesh_file": "x.msh",
        "material": {"model": "neo_hookean", "c10_mpa": 0.5},
        "actuation": {"schedule": "ramp"},
        "supports": [{"group": "left", "fix": ["x", "y"]}],
        "tractions": [{"group": "right", "mpa": [0, 0.01], "channel": 0}],
        "probes": {"tip": [1, 1]},
        "objective": {"kind": "displacement", "probe": "tip", "component": "y", "state": 1, "sign": 1}
    });
    put(&folder, "scene.json", &scene);
    let verbs = |bytes: Option<&[u8]>| {
        let file = folder.0.join("x.msh");
        match bytes {
            Some(bytes) => std::fs::write(file, bytes).unwrap(),
            None => drop(std::fs::remove_file(file)),
        }
        ["solve", "gradient"].map(|verb| refused(&folder.0, &[verb, "scene.json"]))
    };
    for bytes in [
        None,
        Some(&good.as_bytes()[..good.len() / 2]),
        Some(good.replace("4.1 0 8", "2.2 0 8").as_bytes()),
        Some(
            &[
                good.replace("4.1 0 8", "4.1 1 8").as_bytes(),
                &[0, 255, 254],
            ]
            .concat(),
        ),
        Some(inverted.as_bytes()),
        Some(b"solid cube\n"),
    ] {
        for paths in verbs(bytes) {
            assert_eq!(paths, ["mesh_file"]);
        }
    }
    std::fs::write(folder.0.join("x.msh"), good).unwrap();
    let faults = |path: &str, value: &str| {
        let set = format!("{path}={value}");
        refused(&folder.0, &["solve", "scene.json", "--set", &set])
    };
    assert_eq!(faults("supports[0].group", "wall"), ["supports[0].group"]);
    assert_eq!(
        faults("tractions[0].group", "solid"),
        ["tractions[0].group"]
    );
    assert_eq!(faults("mesh", "{\"element\": \"quad4\"}"), ["mesh.element"]);
    let asked = |flags: &[&str]| refused(&folder.0, &[&["solve", "scene.json"], flags].concat());
    assert_eq!(asked(&["--numerical-error"]), ["mesh_file"]);
    assert_eq!(asked(&["--refine", "2"]), ["refine"]);
    assert_eq!(asked(&["--threads", "2"]), ["arguments"]);
    let (code, answer) = salp(&folder.0, &["solve", "scene.json"]);
    assert_eq!((code, &answer["status"]), (0, &json!("ok")));
}

#[test]
fn a_numerical_error_needs_an_objective() {
    let folder = Folder::new("no-objective");
    put(
        &folder,
        "scene.json",
        &json!({
            "version": 1,
            "actuator": {"repeat": 1, "chambers_mm": [[[20, 13], [60, 13], [60, 28], [20, 28]]]},
            "material": "mold-star-30",
            "actuation": {"schedule": "ramp", "pressure_kpa": 1}
        }),
    );
    let paths = refused(&folder.0, &["solve", "scene.json", "--numerical-error"]);
    assert_eq!(paths, ["objective"]);
}

#[test]
fn a_map_needs_two_channels_an_odd_grid_and_schedules_in_its_range() {
    let folder = Folder::new("map");
    let scene = |schedule: Value| {
        json!({
            "version": 1,
            "actuator": {"repeat": 1, "chambers_mm": [
                [[20, 13], [60, 13], [60, 28], [20, 28]],
                [[20, 52], [60, 52], [60, 67], [20, 67]]
            ]},
            "material": "mold-star-30",
            "mesh": {"element": "quad4", "max_size_mm": 20},
            "actuation": {"schedule": schedule},
            "probes": {"tip": [80, 40]}
        })
    };
    put(&folder, "scene.json", &scene(json!([[0, 0], [3, 0]])));
    put(&folder, "one.json", &scene(json!([[0], [3]])));
    let map = |more: &[&str]| refused(&folder.0, &[&["map"], more].concat());
    let outside = "[[0,0],[3,3.5],[0,0]]";
    let wrong = [
        "scene.json",
        "--schedule",
        outside,
        "--schedule",
        "hold",
        "--schedule",
        "[[0],[1]]",
    ];
    assert_eq!(map(&wrong), ["schedule[0]", "schedule[2]"]);
    assert_eq!(map(&["scene.json", "--grid", "6"]), ["grid"]);
    assert_eq!(map(&["scene.json", "--schedule", "wave"]), ["schedule[0]"]);
    assert!(!map(&["one.json", "--schedule", "[[0,0],[1,0]]"]).is_empty());
    let own = "[[0,0],[3,1],[1,3],[0,0]]";
    let (code, answer) = salp(
        &folder.0,
        &[
            "map",
            "scene.json",
            "--grid",
            "5",
            "--schedule",
            own,
            "--csv",
            "map.csv",
        ],
    );
    assert_eq!(
        (code, &answer["status"], &answer["unique"]),
        (0, &json!("ok"), &json!(true)),
        "{answer}"
    );
    let score = &answer["schedules"][0]["scores"]["tip"];
    assert!(
        score["area_mm2"].as_f64().unwrap() != 0.0 && score["error_mm2"].as_f64().unwrap() > 0.0
    );
    let table = std::fs::read_to_string(folder.0.join("map.csv")).unwrap();
    assert_eq!(table.lines().count(), 26);
    assert!(
        table.starts_with("first_kpa,second_kpa,tip_u_x_mm,tip_u_y_mm\n0,0,0,0\n"),
        "{table}"
    );
}
