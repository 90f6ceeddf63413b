//! The verbs that speak to a coordinator, and those that need none.

use std::process::Command;

use salp_core::document::parse_toml;
use salp_core::study::read_study;
use serde_json::Value;

use super::support::{Folder, SALP, serve, study, work};

/// Exit code and standard output.
fn salp(folder: &Folder, arguments: &[&str]) -> (i32, String) {
    let output = Command::new(SALP)
        .args(arguments)
        .current_dir(&folder.0)
        .output()
        .unwrap();
    (
        output.status.code().unwrap(),
        String::from_utf8(output.stdout).unwrap(),
    )
}

fn document(folder: &Folder, arguments: &[&str]) -> Value {
    let (code, text) = salp(folder, &[arguments, &["--json"]].concat());
    assert_eq!(code, 0, "{text}");
    serde_json::from_str(&text).unwrap()
}

#[test]
fn a_study_is_submitted_followed_and_shown_by_the_command_line() {
    let folder = Folder::new("verbs");
    std::fs::write(folder.0.join("study.json"), study(0.0).to_string()).unwrap();
    let coordinator = serve(&folder, "127.0.0.1:0", &[]);
    let _worker = work(&folder, &coordinator.url, &[]);
    let at = ["--url", &coordinator.url];
    let ask = |arguments: &[&str]| document(&folder, &[arguments, &at].concat());
    let created = ask(&["submit", "study.json", "--set", "name=sphere-of-verbs"]);
    let id = created["id"].as_str().unwrap();

    let (code, events) = salp(&folder, &[&["watch", id, "--json"], &at[..]].concat());
    assert_eq!(code, 0);
    let events: Vec<Value> = events
        .lines()
        .map(|l| serde_json::from_str(l).unwrap())
        .collect();
    let ids: Vec<i64> = events.iter().map(|e| e["id"].as_i64().unwrap()).collect();
    assert!(ids.windows(2).all(|pair| pair[0] < pair[1]));
    assert_eq!(events.last().unwrap()["data"]["state"], "done");

    let list = ask(&["ls"]);
    assert_eq!(list["studies"][0]["name"], "sphere-of-verbs");
    let shown = ask(&["show", id]);
    assert_eq!(shown["state"], "done");
    assert_eq!(shown["restarts"].as_array().unwrap().len(), 2);
    let curve = ask(&["curve", id, "--axis", "evaluations"]);
    assert_eq!(curve["axis"], "evaluations");
    let (_, csv) = salp(&folder, &[&["curve", id], &at[..]].concat());
    assert!(csv.starts_with("step,restart,t_s,"));
    assert_eq!(
        csv.lines().filter(|line| !line.starts_with("0,,")).count() as u64,
        1 + shown["counts"]["answered"].as_u64().unwrap()
    );
    ask(&["curve", id, "--format", "svg", "--out", "curve.svg"]);
    let svg = std::fs::read_to_string(folder.0.join("curve.svg")).unwrap();
    assert!(svg.starts_with("<svg") && svg.contains("restart 1"));

    // What has ended cannot be paused: a failed run, not bad input.
    let (code, text) = salp(&folder, &[&["pause", id, "--json"], &at[..]].concat());
    let refused: Value = serde_json::from_str(&text).unwrap();
    assert_eq!((code, &refused["problem"]["status"]), (1, &409.into()));
}

#[test]
fn every_template_is_a_study() {
    let folder = Folder::new("new");
    for template in ["asymmetric-bending", "paper", "rectangles", "command"] {
        let file = format!("{template}.toml");
        let arguments = ["new", &file, "--template", template];
        assert_eq!(document(&folder, &arguments)["file"], *file);
        let text = std::fs::read_to_string(folder.0.join(&file)).unwrap();
        assert!(text.starts_with('#'), "{template} is commented");
        read_study(&parse_toml(&text).unwrap(), true).unwrap();
        assert_eq!(salp(&folder, &arguments).0, 2, "nothing is overwritten");
    }
}

#[test]
fn records_are_listed_and_shown() {
    let folder = Folder::new("material");
    let records = document(&folder, &["material", "list"])["materials"].clone();
    assert!(records.as_array().unwrap().len() >= 14);
    let record = document(&folder, &["material", "show", "mold-star-30"]);
    assert_eq!(record["shear_modulus_mpa"], 0.38);
    assert_eq!(salp(&folder, &["material", "show", "cheese"]).0, 2);
}

#[test]
fn a_tension_test_gives_a_record_that_a_scene_takes_and_its_faults_come_with_lines() {
    let folder = Folder::new("tension");
    let data = concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/examples/tension/treloar-1944.csv"
    );
    let found = document(&folder, &["material", "fit", data, "--svg", "fit.svg"]);
    assert_eq!(found["chosen"], "ogden_3");
    assert_eq!(found["laws"].as_array().unwrap().len(), 7);
    assert_eq!(found["record"]["material"]["fit_stretch"], 7.6);
    assert!(folder.0.join("fit.svg").exists());
    // The record is a material of a study, in either language.
    let toml = found["record"]["toml"].as_str().unwrap();
    assert_eq!(
        parse_toml(toml).unwrap()["material"],
        found["record"]["material"]
    );
    let bad = folder.0.join("bad.csv");
    std::fs::write(&bad, "stretch,stress_mpa\n1,0\n1.1,a\n1.2\n").unwrap();
    let (code, said) = salp(&folder, &["material", "fit", "bad.csv", "--json"]);
    assert_eq!(code, 2);
    let said: Value = serde_json::from_str(&said).unwrap();
    assert_eq!(said["faults"][0]["path"], "line 3, stress_mpa");
    assert_eq!(said["faults"][1]["path"], "line 4");
}

#[test]
fn studies_are_compared_at_equal_cpu() {
    let folder = Folder::new("compare");
    for (name, slow) in [("one", 0.0), ("two", 0.0)] {
        let mut document = study(slow);
        document["name"] = name.into();
        std::fs::write(folder.0.join(format!("{name}.json")), document.to_string()).unwrap();
        let file = format!("{name}.json");
        document_of_run(&folder, &file, name);
    }
    let found = document(&folder, &["compare", "one", "two", "--out", "both"]);
    let studies = found["studies"].as_array().unwrap();
    assert_eq!(studies.len(), 2);
    for study in studies {
        assert_eq!(study["starts"], 2);
        assert!(study["cpu_s"].as_f64().unwrap() >= found["equal_cpu_s"].as_f64().unwrap());
        assert!(study["to_target"]["chance"].as_f64().unwrap() > 0.0);
    }
    for name in ["best-of-n", "waterfall", "chance"] {
        let svg = std::fs::read_to_string(folder.0.join(format!("both/{name}.svg"))).unwrap();
        assert!(
            svg.contains("one: N = 2 starts") && svg.contains("s of CPU in all"),
            "{name}"
        );
        assert!(folder.0.join(format!("one/report/{name}.csv")).is_file());
    }
    let page = std::fs::read_to_string(folder.0.join("one/report/report.html")).unwrap();
    assert!(page.contains("The best of N starts against CPU time"));

    // Another program is another objective; what is no study is told by its place.
    let file = folder.0.join("two/report/restarts.json");
    let mut other: Value = serde_json::from_str(&std::fs::read_to_string(&file).unwrap()).unwrap();
    other["steps"][0]["conditions"]["held_to"]["objective"] = "another".into();
    std::fs::write(&file, other.to_string()).unwrap();
    let (code, text) = salp(&folder, &["compare", "one", "two", "--json"]);
    assert!(code == 2 && text.contains("objective: "), "{text}");
    let beside = document(&folder, &["compare", "one", "two", "--anyway"]);
    assert_eq!(beside["not_alike"][0]["condition"], "objective");
    let (code, text) = salp(&folder, &["compare", "one", "./none", "--json"]);
    assert!(code == 2 && text.contains("\"study[1]\""), "{text}");
}

fn document_of_run(folder: &Folder, file: &str, out: &str) {
    document(
        folder,
        &[
            "run",
            file,
            "--out",
            out,
            "--workers",
            "1",
            "--allow-commands",
        ],
    );
}
