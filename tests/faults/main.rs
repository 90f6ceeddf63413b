//! Faults: processes that are killed, stopped or lie. The oracle: the history is that of an undisturbed run, no
//! evaluation is lost, and every stale write is refused.

#[path = "../support/mod.rs"]
mod support;

mod bad_input;
mod races;
mod run;
mod steps;

use std::time::{Duration, Instant};

use salp_protocol::problem::{STALE_LEASE, UNKNOWN_EVALUATION};
use salp_protocol::{ClaimRequest, ReportRequest, WorkerId, WorkerIdentity};
use salp_worker::Client;
use serde_json::{Value, json};
use support::{
    Coordinator, Folder, assert_sound, is_alive, serve, study, undisturbed, until, work,
};

const LEASE: &[&str] = &["--lease", "1"];
const SOON: Duration = Duration::from_secs(20);

#[test]
fn a_worker_killed_in_mid_evaluation_changes_nothing() {
    let folder = Folder::new("kill-worker");
    let coordinator = serve(&folder, "127.0.0.1:0", LEASE);
    let mut first = work(&folder, &coordinator.url, &[]);
    let id = coordinator.submit(&study(0.04));
    coordinator.until_answered(&id, 3);
    until("a lease is held", SOON, || {
        coordinator.view(&id).counts.leased > 0
    });
    let programs = first.children();
    assert!(!programs.is_empty());
    first.kill();
    until("its programs ended with it", SOON, || {
        programs.iter().all(|program| !is_alive(*program))
    });
    let _second = work(&folder, &coordinator.url, &[]);
    coordinator.until_done(&id);
    let ledger = coordinator.ledger(&id);
    assert_sound(&ledger);
    assert!(
        ledger.iter().any(|row| row.attempt == 2),
        "nothing was claimed again"
    );
    assert_eq!(coordinator.histories(&id), undisturbed());
}

#[test]
fn a_coordinator_killed_in_mid_run_changes_nothing() {
    let folder = Folder::new("kill-coordinator");
    let mut coordinator = serve(&folder, "127.0.0.1:0", LEASE);
    let url = coordinator.url.clone();
    let address = url.trim_start_matches("http://").to_owned();
    let worker = work(&folder, &url, &[]);
    let id = coordinator.submit(&study(0.03));
    for answered in [4, 12, 20] {
        coordinator.until_answered(&id, answered);
        coordinator.process.kill();
        std::thread::sleep(Duration::from_millis(300));
        coordinator = serve(&folder, &address, LEASE);
    }
    coordinator.until_done(&id);
    assert_sound(&coordinator.ledger(&id));
    assert_eq!(coordinator.histories(&id), undisturbed());
    assert!(worker.said().contains("waiting"), "{}", worker.said());
}

#[test]
fn two_coordinators_on_one_store_change_nothing() {
    let folder = Folder::new("two-coordinators");
    let first = serve(&folder, "127.0.0.1:0", LEASE);
    let second = serve(&folder, "127.0.0.1:0", LEASE);
    let _workers = [
        work(&folder, &first.url, &[]),
        work(&folder, &second.url, &[]),
    ];
    let id = first.submit(&study(0.02));
    second.until_done(&id);
    let ledger = second.ledger(&id);
    assert_sound(&ledger);
    assert!(ledger.iter().any(|row| row.worker != ledger[0].worker));
    assert_eq!(first.histories(&id), undisturbed());
}

#[test]
fn a_worker_stopped_beyond_its_lease_is_refused_and_goes_on() {
    let folder = Folder::new("stop-worker");
    let coordinator = serve(&folder, "127.0.0.1:0", LEASE);
    let first = work(&folder, &coordinator.url, &[]);
    let id = coordinator.submit(&study(0.04));
    coordinator.until_answered(&id, 3);
    until("a lease is held", SOON, || {
        coordinator.view(&id).counts.leased > 0
    });
    first.signal("STOP");
    let _second = work(&folder, &coordinator.url, &[]);
    until("claimed again", SOON, || {
        coordinator.ledger(&id).iter().any(|row| row.attempt == 2)
    });
    first.signal("CONT");
    coordinator.until_done(&id);
    assert_sound(&coordinator.ledger(&id));
    assert_eq!(coordinator.histories(&id), undisturbed());
}

fn somebody(name: &str) -> WorkerIdentity {
    WorkerIdentity {
        id: WorkerId(name.into()),
        host: "here".into(),
        pid: 1,
        build: "1".into(),
        instruction_set: "abacus".into(),
    }
}

fn claim(client: &Client, name: &str) -> salp_protocol::Claim {
    let request = ClaimRequest {
        worker: somebody(name),
        allow_commands: true,
        wait_s: 10.0,
        known_studies: Vec::new(),
    };
    client.claim(&request).unwrap().expect("there is work")
}

fn outcome(objective: f64) -> salp_core::study::Outcome {
    serde_json::from_value(json!({
        "status": "ok", "objective": objective, "constraints": [-1.0], "gradient": null,
        "constraint_gradients": null, "report": null, "wall_s": 0.1, "cpu_s": 0.1
    }))
    .unwrap()
}

fn report(fence: i64, name: &str, objective: f64) -> ReportRequest {
    ReportRequest {
        fence,
        worker: somebody(name),
        outcome: outcome(objective),
    }
}

#[test]
fn stale_reports_are_refused_and_repeated_ones_answered_the_same() {
    let folder = Folder::new("stale");
    let coordinator = serve(&folder, "127.0.0.1:0", &["--lease", "0.3"]);
    let client = &coordinator.client;
    let id = coordinator.submit(&study(0.0));
    let early = claim(client, "early");
    // Two evaluations are ready; the second claim must not be the first one's until the lease has expired.
    let other = claim(client, "other");
    assert_ne!(early.evaluation, other.evaluation);
    std::thread::sleep(Duration::from_millis(400));
    let late = claim(client, "late");
    assert_eq!(early.evaluation, late.evaluation);
    assert_eq!((late.fence, late.attempt), (early.fence + 1, 2));

    let stale = client.heartbeat(&early.evaluation, early.fence);
    assert_eq!(stale.unwrap_err().problem(), Some(STALE_LEASE));
    let stale = client.report(&early.evaluation, &report(early.fence, "early", 7.0));
    assert_eq!(stale.unwrap_err().problem(), Some(STALE_LEASE));
    let stored = client.report(&late.evaluation, &report(late.fence, "late", 3.0));
    assert_eq!(stored.unwrap().status, "ok");
    let repeated = client.report(&late.evaluation, &report(late.fence, "late", 9.0));
    assert_eq!(repeated.unwrap().status, "ok");
    let stale = client.report(&early.evaluation, &report(early.fence, "early", 7.0));
    assert_eq!(stale.unwrap_err().problem(), Some(STALE_LEASE));
    let unknown = salp_protocol::EvaluationId(4711);
    let refused = client.report(&unknown, &report(1, "late", 3.0));
    assert_eq!(refused.unwrap_err().problem(), Some(UNKNOWN_EVALUATION));

    let ledger = coordinator.ledger(&id);
    let row = ledger
        .iter()
        .find(|row| row.evaluation == late.evaluation)
        .unwrap();
    assert_eq!(row.objective, Some(3.0));
    assert_eq!(row.worker, Some(WorkerId("late".into())));
}

#[test]
fn nonsense_is_tried_again_and_stored_as_such_at_last() {
    let folder = Folder::new("nonsense");
    let coordinator = serve(&folder, "127.0.0.1:0", &[]);
    let client = &coordinator.client;
    let id = coordinator.submit(&study(0.0));
    let send = |claim: &salp_protocol::Claim, outcome: Value| -> Value {
        let body = json!({ "fence": claim.fence, "worker": somebody("liar"), "outcome": outcome });
        put(
            &coordinator,
            &format!("/v1/evaluations/{}/result", claim.evaluation),
            &body,
        )
    };
    let sane = serde_json::to_value(outcome(1.0)).unwrap();
    let lies = [
        ("objective", Value::Null),
        ("constraints", json!([1.0, 2.0])),
        ("constraints", json!([null])),
        ("gradient", json!([1.0])),
        ("status", json!("splendid")),
    ];
    let mut first = None;
    for (attempt, (field, lie)) in lies.into_iter().enumerate() {
        let claim = claim(client, "liar");
        assert_eq!(
            first.get_or_insert(claim.evaluation.clone()),
            &claim.evaluation
        );
        let mut outcome = sane.clone();
        outcome[field] = lie;
        let answer = send(&claim, outcome);
        let expected = if attempt < 4 {
            "put_back"
        } else {
            "invalid_result"
        };
        assert_eq!(answer["status"], expected, "{field}: {answer}");
    }
    assert_eq!(coordinator.view(&id).counts.alarms, 1);
}

#[test]
fn a_lease_that_expires_too_often_is_lost_and_the_study_goes_on() {
    let folder = Folder::new("lost");
    let coordinator = serve(&folder, "127.0.0.1:0", &["--lease", "0.1"]);
    let client = &coordinator.client;
    let id = coordinator.submit(&study(0.0));
    let started = Instant::now();
    while coordinator.view(&id).counts.alarms == 0 {
        assert!(started.elapsed() < SOON);
        let request = ClaimRequest {
            worker: somebody("sleepy"),
            allow_commands: true,
            wait_s: 0.0,
            known_studies: Vec::new(),
        };
        let _ = client.claim(&request).unwrap();
        std::thread::sleep(Duration::from_millis(120));
    }
    let lost = coordinator
        .ledger(&id)
        .into_iter()
        .find(|row| row.status == "lost");
    assert_eq!(lost.unwrap().attempt, 5);
}

#[test]
fn a_worker_that_died_while_it_waited_takes_no_work() {
    let folder = Folder::new("dead-claim");
    let coordinator = serve(&folder, "127.0.0.1:0", &[]);
    let mut first = work(&folder, &coordinator.url, &[]);
    std::thread::sleep(Duration::from_millis(500));
    first.kill();
    let id = coordinator.submit(&study(0.0));
    let _second = work(&folder, &coordinator.url, &[]);
    coordinator.until_done(&id);
    assert!(coordinator.ledger(&id).iter().all(|row| row.attempt == 1));
}

#[test]
fn a_worker_ends_with_its_parent_and_takes_its_program_along() {
    let folder = Folder::new("parent");
    let coordinator = serve(&folder, "127.0.0.1:0", LEASE);
    let mut worker = work(&folder, &coordinator.url, &["--die-with-parent"]);
    coordinator.submit(&study(30.0));
    until("its program runs", SOON, || !worker.children().is_empty());
    let programs = worker.children();
    worker.close_input();
    assert!(worker.ends_well(SOON));
    until("its program ended", SOON, || {
        programs.iter().all(|program| !is_alive(*program))
    });
}

fn put(coordinator: &Coordinator, path: &str, body: &Value) -> Value {
    let agent = ureq::Agent::new_with_defaults();
    let mut answer = agent
        .put(format!("{}{path}", coordinator.url))
        .send_json(body)
        .unwrap();
    answer.body_mut().read_json().unwrap()
}
