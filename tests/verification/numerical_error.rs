//! `--numerical-error` of `salp solve` and `salp run`: the terms, their sum, the words; the same on one thread and on two.

use std::process::Command;

use serde_json::{Value, json};

use super::Folder;

/// One unit of `chambers-60x25`, two load steps a leg, on a mesh as coarse as the walls let it be.
fn solve(arguments: &[&str]) -> String {
    let scene = concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/examples/scenes/chambers-60x25.json"
    );
    let output = Command::new(env!("CARGO_BIN_EXE_salp"))
        .args(["solve", scene])
        .args(["--set", "actuator.repeat=1"])
        .args(["--set", r#"probes={"tip":[80,40]}"#])
        .args(["--set", "actuation.load_steps_per_leg=2"])
        .args(["--set", "mesh.max_size_mm=10"])
        .args(["--numerical-error"])
        .args(arguments)
        .output()
        .unwrap();
    let text = String::from_utf8(output.stdout).unwrap();
    assert_eq!(output.status.code(), Some(0), "{text}");
    text
}

#[test]
fn the_terms_make_the_error_on_any_number_of_threads() {
    let said = |threads: &str| -> Value {
        let text = solve(&["--threads", threads, "--json"]);
        let document: Value = serde_json::from_str(&text).unwrap();
        assert_eq!(
            document["numerical_error"]["own_mesh"]["value"],
            document["objective"]
        );
        document["numerical_error"].clone()
    };
    let found = said("2");
    assert_eq!(found, said("1"));
    let number = |value: &Value| value.as_f64().unwrap();
    let terms = found["terms"].as_array().unwrap();
    let sources: Vec<&str> = terms
        .iter()
        .map(|t| t["source"].as_str().unwrap())
        .collect();
    assert_eq!(sources, ["mesh", "tolerance", "path", "contact", "bulk"]);
    let sum: f64 = terms.iter().map(|term| number(&term["error"])).sum();
    assert!((sum - number(&found["error"])).abs() <= 1e-12 * sum);
    let moved = (number(&found["value"]) - number(&found["own_mesh"]["value"])).abs();
    assert!((number(&found["own_mesh"]["error"]) - sum - moved).abs() <= 1e-12 * sum);
    let meshes = terms[0]["solves"].as_array().unwrap();
    assert_eq!(
        meshes[1]["elements"],
        4 * meshes[0]["elements"].as_u64().unwrap()
    );
    assert_eq!(meshes[1]["value"], found["value"]);
    assert_eq!(terms[3]["why"], "contact did not act");
    let sentence = found["sentence"].as_str().unwrap();
    assert!(solve(&[]).contains(sentence), "{sentence}");
}

#[test]
fn a_run_says_it_of_its_winner() {
    let study = json!({
        "name": "winner",
        "material": "mold-star-30",
        "actuator": {"units": 1},
        "actuation": {"schedule": "hold", "load_steps_per_leg": 1},
        "step": [{
            "id": "one",
            "target": {"kind": "enclosed_area", "probe_mm": [80, 40], "orientation": "clockwise"},
            "model": {"kind": "fe_cascade", "element": "quad9", "max_size_mm": 10},
            "constraints": {"load_margin": "off"},
            "optimiser": {"method": "gcmma", "max_iterations": 1},
            "restarts": {"start": ["paper"]}
        }]
    });
    let folder = std::env::temp_dir().join(format!("salp-winner-{}", std::process::id()));
    let folder = Folder(folder);
    std::fs::create_dir_all(&folder.0).unwrap();
    std::fs::write(folder.0.join("study.json"), study.to_string()).unwrap();
    let output = Command::new(env!("CARGO_BIN_EXE_salp"))
        .current_dir(&folder.0)
        .args(["run", "study.json", "--out", "out", "--workers", "1"])
        .args(["--numerical-error", "--json"])
        .output()
        .unwrap();
    let text = String::from_utf8(output.stdout).unwrap();
    assert_eq!(output.status.code(), Some(0), "{text}");
    let document: Value = serde_json::from_str(&text).unwrap();
    let best = document["steps"][0]["best"]["objective"].as_f64().unwrap();
    let own = &document["numerical_error"]["own_mesh"];
    assert!((own["value"].as_f64().unwrap() - best).abs() <= 1e-6 * best.abs());
    assert!(own["error"].as_f64().unwrap() > 0.0);
    let summary = std::fs::read_to_string(folder.0.join("out/report/summary.txt")).unwrap();
    let sentence = document["numerical_error"]["sentence"].as_str().unwrap();
    assert!(summary.contains(sentence), "{summary}");
}
