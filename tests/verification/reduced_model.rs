//! `salp reduce`: its files, its document, its words, and what it does not take.

use std::process::{Command, Output};

use serde_json::Value;

use super::Folder;

/// `chambers-40x15`, two load steps a leg, on a mesh as coarse as the walls let it be.
fn reduce(arguments: &[&str]) -> Output {
    let scene = concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/examples/scenes/chambers-40x15.json"
    );
    Command::new(env!("CARGO_BIN_EXE_salp"))
        .args(["reduce", scene])
        .args(["--set", "actuation.load_steps_per_leg=2"])
        .args(["--set", "mesh.max_size_mm=20"])
        .args(arguments)
        .output()
        .unwrap()
}

#[test]
fn it_prints_draws_and_writes_the_same() {
    let folder = std::env::temp_dir().join(format!("salp-reduce-{}", std::process::id()));
    let folder = Folder(folder);
    let [svg, csv] = ["r.svg", "r.csv"].map(|name| folder.0.join(name));
    let (svg_path, csv_path) = (svg.to_str().unwrap(), csv.to_str().unwrap());
    let output = reduce(&["--json", "--svg", svg_path, "--csv", csv_path]);
    assert_eq!(output.status.code(), Some(0));
    let found: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(found["fits"].as_array().unwrap().len(), 4);
    assert_eq!(found["predictions"].as_array().unwrap().len(), 9);
    assert_eq!(found["unit_differences"].as_array().unwrap().len(), 7);
    let last = &found["fits"][2]["states"][4];
    assert_eq!(last["pressure_kpa"], serde_json::json!([15.0, 15.0]));
    let text = std::fs::read_to_string(csv).unwrap();
    // A header, and nine states of four units.
    assert_eq!(text.lines().count(), 1 + 4 * 9);
    let line = text.lines().find(|l| l.starts_with("3,2,1,1,15,15,"));
    let x_scl = line.unwrap().split(',').nth(6).unwrap();
    assert_eq!(
        x_scl.parse::<f64>().unwrap(),
        last["transform"]["x_scl"].as_f64().unwrap()
    );
    let drawn = std::fs::read_to_string(svg).unwrap();
    assert!(drawn.contains("a cascade of 9") && !drawn.contains("NaN"));
    let said = String::from_utf8(reduce(&[]).stdout).unwrap();
    assert!(said.contains("middle of three") && said.contains("against unit 2 of 3"));
}

#[test]
fn units_that_differ_are_bad_input() {
    let output = reduce(&[
        "--json",
        "--set",
        r#"unit_materials=["mold-star-30","mold-star-30-soft","mold-star-30"]"#,
    ]);
    assert_eq!(output.status.code(), Some(2));
    let found: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(found["faults"][0]["path"], "unit_materials[1]");
}

#[test]
fn the_rod_needs_two_channels_and_a_grid() {
    for (arguments, path) in [
        (&["--rod", "4"][..], "rod"),
        (
            &[
                "--rod",
                "--set",
                "actuation.schedule=ramp",
                "--set",
                "actuator.chambers_mm=[[[20, 10], [60, 10], [60, 34], [20, 34]]]",
            ],
            "actuation.schedule",
        ),
    ] {
        let output = reduce(&[&["--json"], arguments].concat());
        assert_eq!(output.status.code(), Some(2));
        let found: Value = serde_json::from_slice(&output.stdout).unwrap();
        assert_eq!(found["faults"][0]["path"], path);
    }
}
