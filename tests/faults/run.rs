//! `salp run` that is killed, interrupted or asked for twice.

use std::fs::File;
use std::process::{Command, Stdio};
use std::time::Duration;

use serde_json::{Value, json};

use super::bad_input::{refused, salp};
use super::support::{Folder, Process, SALP, is_alive, study, undisturbed, until};

const SOON: Duration = Duration::from_secs(30);
const ARGUMENTS: [&str; 7] = [
    "run",
    "study.json",
    "--allow-commands",
    "--out",
    "out",
    "--workers",
    "2",
];

fn start(folder: &Folder) -> Process {
    let log = folder.0.join("run.log");
    let child = Command::new(SALP)
        .args(ARGUMENTS)
        .current_dir(&folder.0)
        .stdout(Stdio::null())
        .stderr(File::create(&log).unwrap())
        .spawn()
        .unwrap();
    Process::new(child, log)
}

fn record(folder: &Folder) -> Value {
    let text = std::fs::read_to_string(folder.0.join("out/run.json")).unwrap_or_default();
    serde_json::from_str(&text).unwrap_or(Value::Null)
}

/// Workers once some evaluations were answered.
fn workers_at_work(folder: &Folder, run: &Process) -> Vec<u32> {
    until("workers take part", SOON, || {
        run.said().contains("evaluations")
            && record(folder)["workers"]
                .as_array()
                .is_some_and(|w| w.len() == 2)
    });
    let workers = record(folder)["workers"].clone();
    serde_json::from_value(workers).unwrap()
}

fn finish(folder: &Folder) {
    let (code, document) = salp(&folder.0, &ARGUMENTS);
    assert_eq!(
        (code, &document["status"]),
        (0, &json!("done")),
        "{document}"
    );
    let step = &document["steps"][0];
    let histories: Vec<&str> = step["restarts"]
        .as_array()
        .unwrap()
        .iter()
        .map(|restart| restart["history_sha256"].as_str().unwrap())
        .collect();
    assert_eq!(histories, undisturbed());
    for restart in step["restarts"].as_array().unwrap() {
        assert!(restart["analyses"].as_u64().unwrap() > 1);
        let last = restart["history"].as_array().unwrap().last().unwrap();
        assert_eq!(last["outcome"], "ok");
        assert_eq!(last["constraints"].as_array().unwrap().len(), 1);
    }
    let best = step["best"]["objective"].as_f64().unwrap();
    assert_eq!(step["candidates"][0]["objective"], json!(best));
    for file in [
        "curve.csv",
        "curve.svg",
        "ledger.csv",
        "best.json",
        "summary.txt",
        "result.json",
    ] {
        assert!(folder.0.join("out/report").join(file).exists(), "{file}");
    }
}

#[test]
fn a_run_killed_in_the_middle_takes_its_children_along_and_goes_on() {
    let folder = Folder::new("kill-run");
    std::fs::write(folder.0.join("study.json"), study(0.05).to_string()).unwrap();
    let mut run = start(&folder);
    let workers = workers_at_work(&folder, &run);
    assert!(workers.iter().all(|worker| is_alive(*worker)));
    let paths = refused(&folder.0, &ARGUMENTS);
    assert_eq!(paths, ["out"], "the folder is in use");
    run.kill();
    until("the workers ended with it", SOON, || {
        workers.iter().all(|worker| !is_alive(*worker))
    });
    finish(&folder);
}

#[test]
fn ctrl_c_pauses_and_the_same_command_goes_on() {
    let folder = Folder::new("interrupt-run");
    std::fs::write(folder.0.join("study.json"), study(0.05).to_string()).unwrap();
    let mut run = start(&folder);
    let workers = workers_at_work(&folder, &run);
    run.signal("INT");
    assert_eq!(run.exit_code(SOON), Some(3));
    assert!(workers.iter().all(|worker| !is_alive(*worker)));
    let changed = [
        &ARGUMENTS[..],
        &["--set", "step[0].optimiser.max_iterations=3"],
    ]
    .concat();
    assert_eq!(refused(&folder.0, &changed), ["out"], "another study");
    finish(&folder);
    // Done: nothing is computed again.
    finish(&folder);
    let (code, fresh) = salp(&folder.0, &[&changed[..], &["--fresh"]].concat());
    assert_eq!((code, &fresh["status"]), (0, &json!("done")));
}

#[test]
fn a_worker_that_dies_is_replaced() {
    let folder = Folder::new("kill-worker-of-run");
    std::fs::write(folder.0.join("study.json"), study(0.05).to_string()).unwrap();
    let mut run = start(&folder);
    let workers = workers_at_work(&folder, &run);
    let killed = Command::new("kill")
        .args(["-9", &workers[0].to_string()])
        .status();
    assert!(killed.unwrap().success());
    until("another one takes its place", SOON, || {
        let now = record(&folder)["workers"].clone();
        let now: Vec<u32> = serde_json::from_value(now).unwrap_or_default();
        now.len() == 2 && !now.contains(&workers[0])
    });
    // Its lease of 15 s must expire first.
    assert_eq!(run.exit_code(2 * SOON), Some(0));
    finish(&folder);
}
