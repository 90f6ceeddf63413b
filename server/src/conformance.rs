//! What every store must do, as one suite over [`Store`]; each back end runs it on a fresh store.

mod bands;
mod guesses;
mod steps;

use std::time::Duration;

use salp_core::optimiser::AskKind;
use salp_core::study::{EvaluationRequest, Given, Outcome, OutcomeStatus};
use salp_protocol::{Claim, ClaimRequest, StudyId, StudyState, WorkerId, WorkerIdentity};
use serde_json::json;

use crate::machine::{Judgement, Verdict};
use crate::store::{
    AcceptedReport, BegunStep, Claimed, Command, Commanded, Held, NewAsk, NewRestart, NewStep,
    NewStudy, Reported, RestartId, Saved, Store, Submitted,
};

const LEASE_MS: i64 = 60_000;
const ATTEMPTS: i64 = 3;

/// Runs all of it. Panics where the store breaks the contract.
pub async fn run(store: &dyn Store) {
    leases_are_fenced(store).await;
    expired_leases_are_claimed_again_up_to_the_cap(store).await;
    a_batch_is_stepped_once_and_in_its_order(store).await;
    claims_share_workers_between_studies(store).await;
    known_results_belong_to_one_build(store).await;
    what_a_crash_leaves_is_found(store).await;
    commands_follow_the_states(store).await;
    a_repeated_key_is_one_study(store).await;
    every_outcome_is_stored(store).await;
    bands::each_best_gets_a_band_after_all_else(store).await;
    bands::a_cancelled_study_asks_for_no_band(store).await;
    steps::steps_begin_end_and_block_once(store).await;
    steps::restarts_wait_and_come_back(store).await;
    places_come_before_age(store).await;
    guesses::guesses_fill_the_known_results_and_nothing_else(store).await;
    guesses::guesses_are_forgotten(store).await;
}

fn ask(x: f64) -> NewAsk {
    NewAsk {
        request: EvaluationRequest {
            step: 0,
            kind: AskKind::Initial,
            iteration: 0,
            x: vec![x],
            want_gradient: false,
            plan_base: None,
            orientation: None,
            second_mesh: false,
            fidelity: None,
            given: Given::default(),
        },
        key: format!("key {x}"),
        command: false,
        place: 0,
        known: None,
    }
}

async fn submit(store: &dyn Store, id: &str, asks: &[f64]) -> StudyId {
    let study = NewStudy {
        id: StudyId(id.to_owned()),
        name: id.to_owned(),
        document: json!({ "name": id }),
        fingerprint: "f".to_owned(),
        steps: 1,
        mixed_hardware: false,
        idempotency_key: None,
        body_sha256: "b".to_owned(),
        begun: vec![begun(0, asks)],
    };
    assert_eq!(store.submit(study).await.unwrap(), Submitted::Created);
    StudyId(id.to_owned())
}

fn begun(step: usize, asks: &[f64]) -> BegunStep {
    BegunStep {
        step,
        inputs: json!({ "of": step }),
        restarts: vec![NewRestart {
            index: 0,
            machine: json!({ "batch": 0 }),
            summary: json!({}),
            asks: asks.iter().copied().map(ask).collect(),
            guesses: Vec::new(),
        }],
    }
}

fn worker(name: &str) -> WorkerIdentity {
    WorkerIdentity {
        id: WorkerId(name.to_owned()),
        host: "host".to_owned(),
        pid: 1,
        build: "build".to_owned(),
        instruction_set: "set".to_owned(),
    }
}

fn wish(name: &str) -> ClaimRequest {
    ClaimRequest {
        worker: worker(name),
        allow_commands: false,
        wait_s: 0.0,
        known_studies: Vec::new(),
    }
}

async fn claim_for(store: &dyn Store, lease_ms: i64) -> Option<Claim> {
    let answer = store.claim(&wish("w"), lease_ms, ATTEMPTS).await.unwrap();
    match answer.claimed {
        Claimed::Work { claim, .. } => Some(*claim),
        _ => None,
    }
}

async fn claim(store: &dyn Store) -> Claim {
    claim_for(store, LEASE_MS).await.expect("there is work")
}

fn report(claim: &Claim, objective: f64) -> AcceptedReport {
    let mut outcome = Outcome::without_values(OutcomeStatus::Ok);
    outcome.objective = Some(objective);
    AcceptedReport {
        evaluation: claim.evaluation.clone(),
        fence: claim.fence,
        worker: worker("w"),
        outcome,
        judgement: Judgement {
            verdict: Verdict {
                max_violation: Some(0.0),
                feasible: true,
                overlap: false,
                counts: true,
            },
            band: None,
        },
        cached_from: None,
    }
}

async fn answer(store: &dyn Store, claim: &Claim, objective: f64) -> RestartId {
    match store.accept_result(report(claim, objective)).await.unwrap() {
        Reported::Stored { restart, .. } => restart.expect("an optimiser asked"),
        other => panic!("not stored: {other:?}"),
    }
}

/// Ends a study so that the next test finds no work.
async fn end(store: &dyn Store, study: &StudyId) {
    store.command(study, Command::Cancel).await.unwrap();
}

async fn leases_are_fenced(store: &dyn Store) {
    let study = submit(store, "fenced", &[1.0]).await;
    let first = claim(store).await;
    assert_eq!((first.fence, first.attempt), (1, 1));
    assert!(
        claim_for(store, LEASE_MS).await.is_none(),
        "a held lease was claimed"
    );
    let held = store.renew(&first.evaluation, 1, LEASE_MS).await.unwrap();
    assert!(matches!(held, Held::Yes { .. }));
    assert!(store.release(&first.evaluation, 1).await.unwrap());
    assert!(!store.release(&first.evaluation, 1).await.unwrap());
    claim(store).await;
    store.release_all().await.unwrap();
    let second = claim(store).await;
    assert_eq!(
        (second.fence, second.attempt),
        (3, 1),
        "a release costs no attempt"
    );
    let stale = store.renew(&first.evaluation, 1, LEASE_MS).await.unwrap();
    assert_eq!(stale, Held::Stale);
    let stale = store.accept_result(report(&first, 9.0)).await.unwrap();
    assert_eq!(stale, Reported::Stale);
    answer(store, &second, 1.0).await;
    let again = store.accept_result(report(&second, 5.0)).await.unwrap();
    assert_eq!(
        again,
        Reported::Repeated {
            status: "ok".to_owned()
        }
    );
    let row = &store.ledger(&study, 0, 10, true).await.unwrap()[0];
    assert_eq!((row.objective, row.fence), (Some(1.0), 3));
    end(store, &study).await;
}

/// Every status with fields of no meaning. A new one is a new row here, and needs a place in the store's schema.
fn every_status() -> Vec<OutcomeStatus> {
    let (kind, reason) = ("limit_point".to_owned(), "why".to_owned());
    let (load_fraction, factor, missing) = (0.5, 1.05, 0.05);
    let first = OutcomeStatus::Ok;
    // So that the compiler asks for the new one.
    match first {
        OutcomeStatus::Ok
        | OutcomeStatus::InfeasibleGeometry { .. }
        | OutcomeStatus::NoEquilibrium { .. }
        | OutcomeStatus::NoMargin { .. }
        | OutcomeStatus::NotUnique { .. }
        | OutcomeStatus::NotConverged { .. }
        | OutcomeStatus::InvalidResult { .. }
        | OutcomeStatus::Failed { .. }
        | OutcomeStatus::WorkLimit
        | OutcomeStatus::Cancelled
        | OutcomeStatus::Lost => {}
    }
    vec![
        first,
        OutcomeStatus::InfeasibleGeometry {
            reason: reason.clone(),
        },
        OutcomeStatus::NoEquilibrium {
            kind: kind.clone(),
            load_fraction,
        },
        OutcomeStatus::NoMargin {
            kind,
            factor,
            missing,
        },
        OutcomeStatus::NotUnique { load_fraction },
        OutcomeStatus::NotConverged {
            reason: reason.clone(),
            load_fraction,
        },
        OutcomeStatus::InvalidResult {
            reason: reason.clone(),
        },
        OutcomeStatus::Failed { reason },
        OutcomeStatus::WorkLimit,
        OutcomeStatus::Cancelled,
        OutcomeStatus::Lost,
    ]
}

async fn every_outcome_is_stored(store: &dyn Store) {
    let statuses = every_status();
    let xs: Vec<f64> = (0..statuses.len()).map(|k| k as f64).collect();
    let study = submit(store, "statuses", &xs).await;
    for status in statuses {
        let claim = claim(store).await;
        let name = status.name();
        let mut report = report(&claim, 1.0);
        report.outcome = Outcome::without_values(status);
        match store.accept_result(report).await.unwrap() {
            Reported::Stored { status, .. } => assert_eq!(status, name),
            other => panic!("{name} was not stored: {other:?}"),
        }
    }
    end(store, &study).await;
}

async fn expired_leases_are_claimed_again_up_to_the_cap(store: &dyn Store) {
    let study = submit(store, "expired", &[1.0]).await;
    let mut last = None;
    for attempt in 1..=ATTEMPTS {
        let claim = claim_for(store, 1).await.expect("expired");
        assert_eq!((claim.attempt, claim.fence), (attempt, attempt));
        tokio::time::sleep(Duration::from_millis(5)).await;
        last = Some(claim);
    }
    // A late report is taken as long as nobody else has claimed; here the cap comes first.
    let lost = store.claim(&wish("w"), LEASE_MS, ATTEMPTS).await.unwrap();
    assert!(matches!(lost.claimed, Claimed::Nothing));
    assert_eq!(lost.lost.len(), 1);
    let batch = store.batch(lost.lost[0]).await.unwrap().expect("complete");
    assert_eq!(batch.outcomes[0].status, OutcomeStatus::Lost);
    let late = report(&last.expect("claimed"), 1.0);
    let fence = late.fence;
    let late = store.accept_result(late).await.unwrap();
    assert_eq!(
        late,
        Reported::Repeated {
            status: "lost".to_owned()
        },
        "fence {fence}"
    );
    end(store, &study).await;
}

async fn a_batch_is_stepped_once_and_in_its_order(store: &dyn Store) {
    let study = submit(store, "batch", &[1.0, 2.0]).await;
    let (first, second) = (claim(store).await, claim(store).await);
    let restart = answer(store, &second, 20.0).await;
    assert!(store.batch(restart).await.unwrap().is_none());
    assert_eq!(answer(store, &first, 10.0).await, restart);
    let batch = store.batch(restart).await.unwrap().expect("complete");
    let objectives: Vec<_> = batch.outcomes.iter().map(|o| o.objective).collect();
    assert_eq!(objectives, [Some(10.0), Some(20.0)]);
    assert_eq!(batch.machine, json!({ "batch": 0 }));
    let step = NewStep {
        restart,
        version: batch.version,
        machine: json!({ "batch": 1 }),
        summary: json!({}),
        done: false,
        waits: false,
        asks: vec![ask(3.0)],
        guesses: Vec::new(),
        bands: Vec::new(),
    };
    let saved = store.save_step(step.clone()).await.unwrap();
    assert_eq!(saved, Saved::Yes { step_ended: false });
    assert_eq!(store.save_step(step).await.unwrap(), Saved::Discarded);
    assert!(store.batch(restart).await.unwrap().is_none());
    let third = claim(store).await;
    answer(store, &third, 30.0).await;
    let batch = store.batch(restart).await.unwrap().expect("complete");
    assert_eq!((batch.version, batch.outcomes.len()), (1, 1));
    let step = NewStep {
        restart,
        version: 1,
        machine: json!({}),
        summary: json!({}),
        done: true,
        waits: false,
        asks: Vec::new(),
        guesses: Vec::new(),
        bands: Vec::new(),
    };
    let saved = store.save_step(step).await.unwrap();
    assert_eq!(saved, Saved::Yes { step_ended: true });
    let ended = store.ended_restarts(&study, 0).await.unwrap();
    assert_eq!(ended, Some(vec![(0, json!({}))]));
    assert!(store.end_step(&study, 0, &json!({})).await.unwrap());
    store.finish(&study).await.unwrap();
    let view = store.study(&study).await.unwrap().expect("stored");
    assert_eq!(view.state, StudyState::Done);
    let best = &store.bests(&study).await.unwrap()[0];
    assert_eq!(best.outcome.objective, Some(10.0));
}

async fn places_come_before_age(store: &dyn Store) {
    let study = submit(store, "places", &[]).await;
    end(store, &study).await;
    let mut begun = begun(0, &[1.0, 2.0, 3.0]);
    for (ask, place) in begun.restarts[0].asks.iter_mut().zip([2, 0, 1]) {
        ask.place = place;
    }
    let study = StudyId("in-places".to_owned());
    let new = NewStudy {
        id: study.clone(),
        name: "places".to_owned(),
        document: json!({}),
        fingerprint: "f".to_owned(),
        steps: 1,
        mixed_hardware: false,
        idempotency_key: None,
        body_sha256: "b".to_owned(),
        begun: vec![begun],
    };
    assert_eq!(store.submit(new).await.unwrap(), Submitted::Created);
    let mut order = Vec::new();
    for _ in 0..3 {
        order.push(claim(store).await.request.x[0]);
    }
    assert_eq!(order, [2.0, 3.0, 1.0]);
    end(store, &study).await;
}

async fn claims_share_workers_between_studies(store: &dyn Store) {
    let first = submit(store, "share-1", &[1.0, 2.0, 3.0]).await;
    let second = submit(store, "share-2", &[1.0, 2.0, 3.0]).await;
    let mut order = Vec::new();
    for _ in 0..6 {
        order.push(claim(store).await.study);
    }
    let (a, b) = (first.clone(), second.clone());
    assert_eq!(order, [&a, &b, &a, &b, &a, &b].map(Clone::clone));
    end(store, &first).await;
    end(store, &second).await;
}

async fn known_results_belong_to_one_build(store: &dyn Store) {
    let study = submit(store, "known", &[77.0]).await;
    let claim = claim(store).await;
    answer(store, &claim, 7.0).await;
    let keys = ["key 77".to_owned(), "key 78".to_owned()];
    let here = ("build".to_owned(), "set".to_owned());
    let known = store.known(&keys, &here, None).await.unwrap();
    let found = known[0].as_ref().expect("known");
    assert_eq!(found.outcome.objective, Some(7.0));
    assert_eq!(found.evaluation, claim.evaluation);
    assert!(known[1].is_none());
    let there = ("build".to_owned(), "other".to_owned());
    assert!(store.known(&keys, &there, None).await.unwrap()[0].is_none());
    let other = StudyId("another".to_owned());
    let known = store.known(&keys, &here, Some(&other)).await.unwrap();
    assert!(known[0].is_none());
    end(store, &study).await;
}

async fn what_a_crash_leaves_is_found(store: &dyn Store) {
    let study = submit(store, "crash", &[1.0]).await;
    assert!(store.unstepped().await.unwrap().is_empty());
    let claim = claim(store).await;
    let restart = answer(store, &claim, 1.0).await;
    assert_eq!(store.unstepped().await.unwrap(), [restart]);
    end(store, &study).await;
    assert!(store.unstepped().await.unwrap().is_empty());
}

async fn commands_follow_the_states(store: &dyn Store) {
    let study = submit(store, "commands", &[1.0, 2.0]).await;
    let command = |command| store.command(&study, command);
    let now = |state| Commanded::Now(state);
    assert_eq!(
        command(Command::Pause).await.unwrap(),
        now(StudyState::Paused)
    );
    assert!(claim_for(store, LEASE_MS).await.is_none());
    assert_eq!(
        command(Command::Resume).await.unwrap(),
        now(StudyState::Queued)
    );
    let claim = claim(store).await;
    assert_eq!(
        command(Command::Cancel).await.unwrap(),
        now(StudyState::Cancelling)
    );
    let held = store.renew(&claim.evaluation, claim.fence, LEASE_MS).await;
    let Held::Yes { state, .. } = held.unwrap() else {
        panic!("the lease is gone");
    };
    assert_eq!(state, StudyState::Cancelling);
    answer(store, &claim, 1.0).await;
    let view = store.study(&study).await.unwrap().expect("stored");
    assert_eq!(view.state, StudyState::Cancelled);
    let refused = command(Command::Resume).await.unwrap();
    assert_eq!(refused, Commanded::Refused(StudyState::Cancelled));
    let unknown = StudyId("unknown".to_owned());
    let answer = store.command(&unknown, Command::Cancel).await.unwrap();
    assert_eq!(answer, Commanded::Unknown);
}

async fn a_repeated_key_is_one_study(store: &dyn Store) {
    let study = |id: &str, body: &str| NewStudy {
        id: StudyId(id.to_owned()),
        name: id.to_owned(),
        document: json!({}),
        fingerprint: "f".to_owned(),
        steps: 1,
        mixed_hardware: false,
        idempotency_key: Some("key".to_owned()),
        body_sha256: body.to_owned(),
        begun: Vec::new(),
    };
    let first = StudyId("key-1".to_owned());
    let submit = |id, body| store.submit(study(id, body));
    assert_eq!(submit("key-1", "a").await.unwrap(), Submitted::Created);
    let again = submit("key-2", "a").await.unwrap();
    assert_eq!(again, Submitted::Repeated(first.clone()));
    let clash = submit("key-3", "b").await.unwrap();
    assert_eq!(clash, Submitted::KeyReused(first.clone()));
    end(store, &first).await;
}
