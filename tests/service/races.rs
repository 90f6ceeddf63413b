//! Restarts that compete: the same with one worker and with two, and brought back after they were stopped.

use std::process::Command;

use salp_protocol::problem::{UNKNOWN_RESTART, WRONG_STATE};
use salp_protocol::{RestartState, StudyId};
use serde_json::{Value, json};

use super::support::{Coordinator, Folder, SALP, assert_sound, race, serve, undisturbed_of, work};

fn stops(coordinator: &Coordinator, id: &StudyId) -> Vec<String> {
    let restarts = coordinator.client.restarts(id).unwrap();
    let reason = |summary: &Value| summary["stop"]["reason"].as_str().unwrap().to_owned();
    restarts.iter().map(|r| reason(&r.summary)).collect()
}

#[test]
fn a_race_is_the_same_for_any_number_of_workers_and_stopped_restarts_come_back() {
    let folder = Folder::new("race");
    let coordinator = serve(&folder, "127.0.0.1:0", &[]);
    let _workers = [
        work(&folder, &coordinator.url, &[]),
        work(&folder, &coordinator.url, &[]),
    ];
    let id = coordinator.submit(&race(0.005));
    let view = coordinator.until_done(&id);
    assert_sound(&coordinator.ledger(&id));
    let histories = coordinator.histories(&id);
    assert_eq!(histories, undisturbed_of(&race(0.0)));
    let before = stops(&coordinator, &id);
    let stopped = before.iter().position(|stop| stop == "not_promoted");
    let stopped = stopped.unwrap_or_else(|| panic!("{before:?}"));
    let summary = view.steps[0].race.clone().unwrap();
    let rung = &summary.rungs[0];
    assert_eq!(rung.reached, before.len());
    assert!(!rung.promoted.contains(&stopped) && rung.promoted.contains(&0));
    assert!(summary.resumed.is_empty());
    let answered = view.counts.answered;

    // By the command line; the study goes on with it and ends again.
    let (index, of_study) = (stopped.to_string(), id.to_string());
    let output = Command::new(SALP)
        .args(["resume", &of_study, "--restart", &index, "--json"])
        .args(["--url", &coordinator.url])
        .output()
        .unwrap();
    assert!(output.status.success(), "{output:?}");
    let resumed: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(resumed["index"], json!(stopped));
    let view = coordinator.until_done(&id);
    assert!(view.counts.answered > answered);
    let after = stops(&coordinator, &id);
    let restarts = coordinator.client.restarts(&id).unwrap();
    for (k, restart) in restarts.iter().enumerate() {
        assert_eq!(restart.state, RestartState::Done);
        let is_it = k == stopped;
        assert_eq!(restart.history_sha256 == histories[k], !is_it);
        assert_eq!(after[k] == before[k], !is_it, "{after:?}");
    }
    assert_eq!(view.steps[0].race.clone().unwrap().resumed, [stopped]);
    assert_eq!(restarts[stopped].summary["race"]["resumed"], json!(true));

    // It ended by itself now, and there is no restart of so large an index.
    let refused = coordinator.client.resume_restart(&id, 0, stopped);
    assert_eq!(refused.unwrap_err().problem(), Some(WRONG_STATE));
    let unknown = coordinator.client.resume_restart(&id, 0, 99);
    assert_eq!(unknown.unwrap_err().problem(), Some(UNKNOWN_RESTART));
}

#[test]
fn what_another_step_has_taken_from_is_closed() {
    let mut document = race(0.0);
    let mut then = document["step"][0].clone();
    then["id"] = json!("then");
    then["optimiser"]["max_iterations"] = json!(1);
    then["takes"] = json!([{"step": "solve", "as": "starts"}]);
    then["restarts"] = json!({"start": "taken"});
    document["step"].as_array_mut().unwrap().push(then);
    let folder = Folder::new("race-taken");
    let coordinator = serve(&folder, "127.0.0.1:0", &[]);
    let _worker = work(&folder, &coordinator.url, &[]);
    let id = coordinator.submit(&document);
    coordinator.until_done(&id);
    let stopped = stops(&coordinator, &id)
        .iter()
        .position(|s| s == "not_promoted");
    let refused = coordinator.client.resume_restart(&id, 0, stopped.unwrap());
    let refused = refused.unwrap_err();
    assert_eq!(refused.problem(), Some(WRONG_STATE));
    assert!(refused.to_string().contains("\"then\""), "{refused}");
}
