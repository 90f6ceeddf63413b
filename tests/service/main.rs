//! The API and its promises, over loopback and by real processes.

#[path = "../support/mod.rs"]
mod support;

mod bands;
mod races;
mod speculation;
mod verbs;

use std::collections::BTreeSet;
use std::process::Command;
use std::time::{Duration, Instant};

use salp_protocol::problem::{INVALID_STUDY, KEY_REUSED, UNKNOWN_STUDY, WRONG_STATE};
use salp_protocol::{
    Axis, ClaimRequest, ReportRequest, StudyId, StudyState, WorkerId, WorkerIdentity,
};
use salp_worker::{Client, ClientError};
use serde_json::{Value, json};
use support::{Folder, assert_sound, serve, study, text, undisturbed, until, work};

const SOON: Duration = Duration::from_secs(20);

#[test]
fn one_worker_and_two_give_the_same_history_and_a_curve_that_climbs() {
    let folder = Folder::new("two-workers");
    let coordinator = serve(&folder, "127.0.0.1:0", &[]);
    let _first = work(&folder, &coordinator.url, &[]);
    let id = coordinator.submit(&study(0.02));
    coordinator.until_answered(&id, 3);
    let mut second = work(&folder, &coordinator.url, &[]);
    until("the second one takes part", SOON, || {
        let workers = coordinator.client.workers().unwrap();
        workers
            .iter()
            .filter(|worker| worker.evaluations > 1)
            .count()
            == 2
    });
    second.signal("TERM");
    assert!(second.ends_well(SOON));
    let view = coordinator.until_done(&id);
    let ledger = coordinator.ledger(&id);
    assert_sound(&ledger);
    let workers: BTreeSet<_> = ledger.iter().filter_map(|row| row.worker.clone()).collect();
    assert_eq!(workers.len(), 2);
    assert_eq!(coordinator.histories(&id), undisturbed());

    let best = view.best.unwrap();
    let curve = coordinator.client.curve(&id, Axis::Cpu).unwrap();
    assert_eq!(curve.restarts.len(), 2);
    for restart in &curve.restarts {
        let bests: Vec<f64> = restart.points.iter().filter_map(|p| p.best).collect();
        assert!(bests.windows(2).all(|pair| pair[1] <= pair[0]));
        assert!(bests[bests.len() - 1] < bests[0]);
        assert!(
            restart
                .points
                .windows(2)
                .all(|pair| pair[1].t_s >= pair[0].t_s)
        );
    }
    let last = curve.best.last().unwrap();
    assert_eq!(last.point.best, Some(best.objective));
    assert_eq!(last.point.evaluations, ledger.len() as u64);
    let candidates = coordinator.client.candidates(&id).unwrap();
    assert_eq!(candidates[0].x, best.x);
    let core = &coordinator.client.restarts(&id).unwrap()[best.restart].summary;
    assert_eq!(core["best"]["objective"], json!(best.objective));
}

#[test]
fn curl_alone_is_enough() {
    let folder = Folder::new("curl");
    let coordinator = serve(&folder, "127.0.0.1:0", &[]);
    let _worker = work(&folder, &coordinator.url, &[]);
    let file = folder.0.join("study.toml");
    std::fs::write(&file, toml::to_string(&study(0.01)).unwrap()).unwrap();
    let at = |path: &str| format!("{}{path}", coordinator.url);
    let body = format!("@{}", text(&file));
    let created = curl(&[
        "-H",
        "Content-Type: application/toml",
        "--data-binary",
        &body,
        &at("/v1/studies"),
    ]);
    let created: Value = serde_json::from_str(&created).unwrap();
    let study = at(created["url"].as_str().unwrap());
    let mut lengths = Vec::new();
    let started = Instant::now();
    loop {
        let csv = curl(&[&format!("{study}/curve?axis=wall&format=csv")]);
        assert!(csv.starts_with("step,restart,t_s,evaluations,objective,best"));
        lengths.push(csv.lines().count());
        let view: Value = serde_json::from_str(&curl(&[&study])).unwrap();
        if view["state"] == "done" {
            break;
        }
        assert!(started.elapsed() < SOON, "{view}");
        std::thread::sleep(Duration::from_millis(100));
    }
    assert!(lengths.windows(2).all(|pair| pair[1] >= pair[0]));
    assert!(
        lengths.iter().collect::<BTreeSet<_>>().len() > 2,
        "{lengths:?}"
    );

    // The stream ends with the study; it can be taken up after any event.
    let all = curl(&["-N", &format!("{study}/events")]);
    let ids: Vec<i64> = all
        .lines()
        .filter_map(|line| line.strip_prefix("id:"))
        .map(|id| id.trim().parse().unwrap())
        .collect();
    assert!(ids.windows(2).all(|pair| pair[0] < pair[1]));
    assert!(all.contains(r#"{"state":"done"}"#));
    let middle = ids[ids.len() / 2];
    let last = format!("Last-Event-ID: {middle}");
    let rest = curl(&["-N", "-H", &last, &format!("{study}/events")]);
    assert_eq!(
        rest.matches("\nid:").count() + usize::from(rest.starts_with("id:")),
        ids.iter().filter(|id| **id > middle).count()
    );
    let page: Value =
        serde_json::from_str(&curl(&[&format!("{study}/events?after={middle}&wait=0")])).unwrap();
    assert_eq!(page["events"][0]["id"], json!(ids[ids.len() / 2 + 1]));
    let ledger = curl(&[&format!("{study}/evaluations?format=csv")]);
    assert!(ledger.lines().count() > 10 && ledger.contains(",trial,"));
}

#[test]
fn bad_requests_get_problem_documents_and_store_nothing() {
    let folder = Folder::new("bad");
    let coordinator = serve(&folder, "127.0.0.1:0", &[]);
    let client = &coordinator.client;
    let unknown = client.study(&StudyId("nothing".into())).unwrap_err();
    assert_eq!(unknown.problem(), Some(UNKNOWN_STUDY));

    let mut bad = study(0.0);
    bad["name"] = json!(7);
    bad["step"][0]["variables"]["lower"] = json!([9.0, 9.0, 9.0]);
    bad["step"][0]["surprise"] = json!(true);
    let Err(ClientError::Refused(problem)) = client.submit(&bad, None) else {
        panic!("taken");
    };
    assert_eq!(
        (problem.kind.as_str(), problem.status),
        (INVALID_STUDY, 422)
    );
    let paths: Vec<_> = problem
        .faults
        .iter()
        .map(|fault| fault.path.as_str())
        .collect();
    assert!(
        paths.contains(&"name") && paths.contains(&"step[0].surprise"),
        "{paths:?}"
    );
    assert!(
        paths
            .iter()
            .any(|path| path.starts_with("step[0].variables")),
        "{paths:?}"
    );
    assert!(client.studies(None).unwrap().studies.is_empty());

    let at = |path: &str| format!("{}{path}", coordinator.url);
    for (arguments, status, kind) in [
        (
            vec!["--data", "{", "-H", "Content-Type: application/json"],
            422,
            "invalid-study",
        ),
        (vec!["--data", "[]"], 422, "invalid-study"),
        (vec!["-X", "DELETE"], 405, "method-not-allowed"),
        (
            vec!["-H", "Origin: http://evil.example"],
            403,
            "foreign-origin",
        ),
        (vec!["-H", "Host: evil.example"], 403, "foreign-origin"),
    ] {
        let url = at("/v1/studies");
        let answer = curl(&[arguments, vec!["-i", &url]].concat());
        assert!(answer.contains(&format!(" {status} ")), "{answer}");
        assert!(
            answer
                .to_lowercase()
                .contains("content-type: application/problem+json")
        );
        assert!(answer.contains(&format!("urn:salp:{kind}")), "{answer}");
    }
    for path in ["/v1/nothing", "/v1/studies/x/curve", "/v1/studies/x/events"] {
        assert!(curl(&["-i", &at(path)]).contains(" 404 "), "{path}");
    }
    let large = folder.0.join("large");
    std::fs::write(&large, vec![b' '; 5 << 20]).unwrap();
    let answer = curl(&[
        "-i",
        "-H",
        "Expect:",
        "--data-binary",
        &format!("@{}", text(&large)),
        &at("/v1/studies"),
    ]);
    assert!(answer.contains(" 413 "), "{answer}");
    assert!(curl(&[&at("/livez")]).contains("ok"));
    assert!(curl(&[&at("/readyz")]).contains("ok"));
}

#[test]
fn a_repeated_submission_is_one_study() {
    let folder = Folder::new("repeat");
    let coordinator = serve(&folder, "127.0.0.1:0", &[]);
    let client = &coordinator.client;
    let first = client.submit(&study(0.0), Some("a")).unwrap();
    let again = client.submit(&study(0.0), Some("a")).unwrap();
    assert_eq!(first, again);
    let clash = client.submit(&study(0.1), Some("a")).unwrap_err();
    assert_eq!(clash.problem(), Some(KEY_REUSED));
    let other = client.submit(&study(0.0), Some("b")).unwrap();
    assert_ne!(first.id, other.id);
    let page = client.studies(None).unwrap();
    let ids: Vec<_> = page.studies.iter().map(|study| study.id.clone()).collect();
    assert_eq!(ids, [other.id, first.id]);
    assert_eq!(client.document(&ids[0]).unwrap(), study(0.0));
}

#[test]
fn cancel_pause_and_resume() {
    let folder = Folder::new("cancel");
    let coordinator = serve(&folder, "127.0.0.1:0", &["--lease", "1"]);
    let client = &coordinator.client;
    let mut worker = work(&folder, &coordinator.url, &[]);

    let paused = coordinator.submit(&study(0.02));
    coordinator.until_answered(&paused, 3);
    assert_eq!(
        client.command(&paused, "pause").unwrap().state,
        StudyState::Paused
    );
    until("its evaluations end", SOON, || {
        coordinator.view(&paused).counts.leased == 0
    });
    let before = coordinator.view(&paused).counts.answered;
    std::thread::sleep(Duration::from_millis(300));
    assert_eq!(coordinator.view(&paused).counts.answered, before);

    // A long evaluation is stopped by the next heartbeat.
    let long = coordinator.submit(&study(30.0));
    until("it is at hand", SOON, || {
        coordinator.view(&long).counts.leased == 1
    });
    let asked = Instant::now();
    assert_eq!(
        client.command(&long, "cancel").unwrap().state,
        StudyState::Cancelling
    );
    until("it is cancelled", SOON, || {
        coordinator.view(&long).state == StudyState::Cancelled
    });
    assert!(asked.elapsed() < Duration::from_secs(5));
    let refused = client.command(&long, "resume").unwrap_err();
    assert_eq!(refused.problem(), Some(WRONG_STATE));
    assert_eq!(
        client.command(&long, "cancel").unwrap().state,
        StudyState::Cancelled
    );

    // One whose worker dies is cancelled when the lease ends.
    let orphan = coordinator.submit(&study(30.0));
    until("it is at hand", SOON, || {
        coordinator.view(&orphan).counts.leased == 1
    });
    worker.kill();
    client.command(&orphan, "cancel").unwrap();
    until("it is cancelled", SOON, || {
        coordinator.view(&orphan).state == StudyState::Cancelled
    });

    assert_eq!(
        client.command(&paused, "resume").unwrap().state,
        StudyState::Running
    );
    let _worker = work(&folder, &coordinator.url, &[]);
    coordinator.until_done(&paused);
    assert_eq!(coordinator.histories(&paused), undisturbed());
}

#[test]
fn a_worker_waits_for_its_coordinator_and_says_so() {
    let folder = Folder::new("wait");
    let coordinator = serve(&folder, "127.0.0.1:0", &[]);
    let (url, address) = (coordinator.url.clone(), coordinator.url[7..].to_owned());
    drop(coordinator);
    let mut worker = work(&folder, &url, &[]);
    until("it says so", SOON, || {
        let said = worker.said();
        said.contains("waiting") && said.contains(&format!("cannot reach {url}"))
    });
    let coordinator = serve(&folder, &address, &[]);
    let id = coordinator.submit(&study(0.0));
    coordinator.until_done(&id);
    worker.signal("TERM");
    let asked = Instant::now();
    assert!(worker.ends_well(SOON));
    assert!(
        asked.elapsed() < Duration::from_secs(2),
        "an idle worker ends at once"
    );
}

#[test]
fn a_known_evaluation_is_not_computed_again_and_is_charged_what_it_cost() {
    let folder = Folder::new("known");
    let coordinator = serve(&folder, "127.0.0.1:0", &[]);
    let client = &coordinator.client;
    let worker = WorkerIdentity {
        id: WorkerId("first".into()),
        host: "here".into(),
        pid: 1,
        build: "1".into(),
        instruction_set: "abacus".into(),
    };
    let claim = || {
        let request = ClaimRequest {
            worker: worker.clone(),
            allow_commands: false,
            wait_s: 0.5,
            known_studies: Vec::new(),
        };
        client.claim(&request).unwrap()
    };
    let outcome = json!({
        "status": "infeasible_geometry", "reason": "none", "objective": null, "constraints": [], "gradient": null,
        "constraint_gradients": null, "report": null, "wall_s": 3.0, "cpu_s": 2.0
    });
    let document = json!({ "preset": "asymmetric-bending", "name": "twice" });
    let first = coordinator.submit(&document);
    let mut computed = 0;
    while let Some(claim) = claim() {
        let report = ReportRequest {
            fence: claim.fence,
            worker: worker.clone(),
            outcome: serde_json::from_value(outcome.clone()).unwrap(),
        };
        client.report(&claim.evaluation, &report).unwrap();
        computed += 1;
    }
    coordinator.until_done(&first);
    let second = coordinator.submit(&document);
    assert!(claim().is_none(), "everything was known");
    coordinator.until_done(&second);
    let (paid, ledger) = (coordinator.ledger(&first), coordinator.ledger(&second));
    assert_eq!((paid.len(), ledger.len()), (computed, computed));
    for row in &ledger {
        let payer = paid
            .iter()
            .find(|p| Some(&p.evaluation) == row.cached_from.as_ref());
        let payer = payer.expect("cached");
        assert_eq!(payer.x, row.x);
        assert_eq!((row.cpu_s, row.wall_s), (Some(2.0), Some(3.0)));
        assert_eq!(row.worker, payer.worker);
    }
    assert_eq!(
        coordinator.histories(&first),
        coordinator.histories(&second)
    );
}

#[test]
fn workers_of_another_build_and_without_programs_are_told_why() {
    let folder = Folder::new("mismatch");
    let coordinator = serve(&folder, "127.0.0.1:0", &["--lease", "0.2"]);
    let claim = |build: &str, allow_commands: bool| {
        let request = ClaimRequest {
            worker: WorkerIdentity {
                id: WorkerId(format!("{build}-{allow_commands}")),
                host: "here".into(),
                pid: 1,
                build: build.into(),
                instruction_set: "abacus".into(),
            },
            allow_commands,
            wait_s: 0.0,
            known_studies: Vec::new(),
        };
        coordinator.client.claim(&request)
    };
    assert!(claim("1", true).unwrap().is_none());
    coordinator.submit(&study(0.0));
    let refused = claim("1", false).unwrap_err();
    assert!(
        refused.to_string().contains("--allow-commands"),
        "{refused}"
    );
    assert!(claim("1", true).unwrap().is_some());
    let refused = claim("2", true).unwrap_err();
    assert!(
        refused
            .to_string()
            .contains("is bound to build 1 on abacus"),
        "{refused}"
    );
    let mut mixed = study(0.0);
    mixed["mixed_hardware"] = json!(true);
    let mixed = coordinator.submit(&mixed);
    for build in ["2", "3"] {
        assert_eq!(claim(build, true).unwrap().unwrap().study, mixed);
    }
}

#[test]
fn a_token_is_needed_where_the_world_can_reach_it() {
    let folder = Folder::new("token");
    let salp = env!("CARGO_BIN_EXE_salp");
    let refused = Command::new(salp)
        .args(["serve", "--listen", "0.0.0.0:0", "--store"])
        .arg(folder.0.join("other.db"))
        .output()
        .unwrap();
    assert!(!refused.status.success());
    assert!(String::from_utf8_lossy(&refused.stderr).contains("a token is needed"));

    let token = "0123456789abcdef0123456789abcdef";
    let file = folder.0.join("token");
    std::fs::write(&file, token).unwrap();
    let coordinator = serve(&folder, "127.0.0.1:0", &["--token-file", &text(&file)]);
    let refused = coordinator.client.studies(None).unwrap_err();
    assert!(refused.to_string().contains("Bearer"), "{refused}");
    let trusted = Client::new(&coordinator.url, Some(token), Duration::from_secs(5));
    assert!(trusted.studies(None).unwrap().studies.is_empty());
    let _worker = work(&folder, &coordinator.url, &["--token-file", &text(&file)]);
    let id = trusted.submit(&study(0.0), None).unwrap().id;
    until("done", SOON, || {
        trusted.study(&id).unwrap().state == StudyState::Done
    });
}

fn curl(arguments: &[&str]) -> String {
    let output = Command::new("curl")
        .args(["-sS", "--max-time", "20", "--noproxy", "*"])
        .args(arguments)
        .output()
        .expect("curl is installed");
    assert!(
        output.status.success(),
        "{}",
        String::from_utf8_lossy(&output.stderr)
    );
    String::from_utf8(output.stdout).unwrap()
}
