//! Guesses: after all else, known once they are answered, and nothing else.

use std::time::Duration;

use salp_protocol::{StudyId, StudyState};
use serde_json::json;

use super::{
    ATTEMPTS, LEASE_MS, ask,
    bands::{of_band, with_band},
    begun, claim, claim_for, end, report, submit, wish,
};
use crate::store::{
    Batch, Claimed, NewAsk, NewStep, NewStudy, Reported, RestartId, Saved, Store, Submitted,
};
use salp_core::study::OutcomeStatus;

fn asks(xs: &[f64]) -> Vec<NewAsk> {
    xs.iter().copied().map(ask).collect()
}

async fn submit_with(store: &dyn Store, id: &str, asked: &[f64], guesses: &[f64]) -> StudyId {
    let mut begun = begun(0, asked);
    begun.restarts[0].guesses = asks(guesses);
    let study = NewStudy {
        id: StudyId(id.to_owned()),
        name: id.to_owned(),
        document: json!({}),
        fingerprint: "f".to_owned(),
        steps: 1,
        mixed_hardware: false,
        idempotency_key: None,
        body_sha256: "b".to_owned(),
        begun: vec![begun],
    };
    assert_eq!(store.submit(study).await.unwrap(), Submitted::Created);
    StudyId(id.to_owned())
}

fn next(batch: &Batch, asked: &[f64], guesses: &[f64]) -> NewStep {
    NewStep {
        restart: batch.restart,
        version: batch.version,
        machine: json!({}),
        summary: json!({}),
        done: asked.is_empty(),
        waits: false,
        asks: asks(asked),
        guesses: asks(guesses),
        bands: Vec::new(),
    }
}

async fn batch(store: &dyn Store, restart: RestartId) -> Batch {
    store.batch(restart).await.unwrap().expect("complete")
}

async fn save(store: &dyn Store, step: NewStep) {
    let saved = store.save_step(step).await.unwrap();
    assert!(matches!(saved, Saved::Yes { .. }));
}

async fn known(store: &dyn Store, x: f64) -> Option<f64> {
    let bound_to = ("build".to_owned(), "set".to_owned());
    let known = store.known(&[format!("key {x}")], &bound_to, None).await;
    known.unwrap()[0].as_ref()?.outcome.objective
}

pub(super) async fn guesses_fill_the_known_results_and_nothing_else(store: &dyn Store) {
    let study = submit_with(store, "guesses", &[901.0], &[902.0, 903.0, 904.0]).await;
    let out = claim(store).await;
    assert_eq!(out.request.x, [901.0]);
    // Whatever an optimiser waits for goes first, also of a study that came later.
    let later = submit(store, "guesses-later", &[1.0]).await;
    let other = claim(store).await;
    assert_eq!(other.study, later);
    end(store, &later).await;
    store.accept_result(report(&other, 1.0)).await.unwrap();
    let (first, second) = (claim(store).await, claim(store).await);
    assert_eq!(
        (&first.request.x, &second.request.x),
        (&vec![902.0], &vec![903.0])
    );
    // Better than any point, and yet none.
    let stored = store.accept_result(with_band(&first, -100.0)).await;
    assert!(matches!(
        stored.unwrap(),
        Reported::Stored { restart: None, .. }
    ));
    let counts = store.counts(&study).await.unwrap();
    assert_eq!(
        (counts.evaluations, counts.answered, counts.leased),
        (1, 0, 1)
    );
    assert_eq!((counts.bands.evaluations, counts.ready), (0, 0));
    assert_eq!((counts.guesses.answered, counts.guesses.used), (1, 0));
    assert!(store.points(&study).await.unwrap().is_empty());
    assert!(store.bests(&study).await.unwrap().is_empty());
    assert_eq!(known(store, 902.0).await, Some(-100.0));
    let events = store.events(&study, 0, 100).await.unwrap();
    assert!(events.iter().all(|event| event.kind != "evaluation"));
    // While an optimiser is about to ask for more, guesses wait.
    let restart = match store.accept_result(report(&out, 5.0)).await.unwrap() {
        Reported::Stored { restart, .. } => restart.unwrap(),
        other => panic!("{other:?}"),
    };
    assert!(claim_for(store, LEASE_MS).await.is_none());
    // What it asks for now is being evaluated as a guess: nobody begins it again, and nobody is refused for it.
    let step = next(&batch(store, restart).await, &[903.0], &[905.0]);
    save(store, step).await;
    let guess = claim(store).await;
    assert_eq!(
        guess.request.x,
        [905.0],
        "904 was withdrawn, 903 is held back"
    );
    let answer = store.claim(&wish("w"), LEASE_MS, ATTEMPTS).await.unwrap();
    assert!(matches!(answer.claimed, Claimed::Nothing));
    store.accept_result(report(&second, 3.0)).await.unwrap();
    let asked = claim(store).await;
    assert_eq!(asked.request.x, [903.0]);
    let mut answered = report(&asked, 3.0);
    answered.cached_from = Some(second.evaluation.clone());
    store.accept_result(answered).await.unwrap();
    let counts = store.counts(&study).await.unwrap();
    assert_eq!((counts.evaluations, counts.answered), (2, 2));
    assert_eq!((counts.guesses.answered, counts.guesses.used), (2, 1));
    let ledger = store.ledger(&study, 0, 10, false).await.unwrap();
    let of_kind = |kind: &str| {
        let rows = ledger
            .iter()
            .filter(|row| (row.kind == "guess") == (kind == "guess"));
        rows.map(|row| row.x[0]).collect::<Vec<_>>()
    };
    assert_eq!(of_kind("initial"), [901.0, 903.0]);
    assert_eq!(of_kind("guess"), [902.0, 903.0, 905.0]);
    // The study ends without waiting for the guess that is out, which is refused then.
    save(store, next(&batch(store, restart).await, &[], &[])).await;
    assert!(store.end_step(&study, 0, &json!({})).await.unwrap());
    store.finish(&study).await.unwrap();
    let view = store.study(&study).await.unwrap().unwrap();
    assert_eq!(view.state, StudyState::Done);
    let late = store.accept_result(report(&guess, 1.0)).await.unwrap();
    assert_eq!(late, Reported::Stale);
    assert_eq!(known(store, 905.0).await, None);
}

pub(super) async fn guesses_are_forgotten(store: &dyn Store) {
    let study = submit_with(store, "forgotten", &[911.0], &[912.0, 913.0, 914.0, 915.0]).await;
    let out = claim(store).await;
    // With their worker.
    let dies = claim_for(store, 1).await.unwrap();
    assert_eq!(dies.request.x, [912.0]);
    tokio::time::sleep(Duration::from_millis(5)).await;
    let next = claim(store).await;
    assert_eq!(next.request.x, [913.0]);
    let late = store.accept_result(report(&dies, 1.0)).await.unwrap();
    assert_eq!(late, Reported::Stale);
    // Where it gives them up, or reports nonsense.
    assert!(store.release(&next.evaluation, next.fence).await.unwrap());
    assert!(!store.release(&next.evaluation, next.fence).await.unwrap());
    let nonsense = claim(store).await;
    assert_eq!(nonsense.request.x, [914.0]);
    let invalid = OutcomeStatus::InvalidResult {
        reason: "why".to_owned(),
    };
    let refused = of_band(&nonsense, invalid, None);
    let refused = store.reject_result(refused, ATTEMPTS).await.unwrap();
    assert_eq!(refused, Reported::PutBack);
    let last = claim(store).await;
    assert_eq!(last.request.x, [915.0]);
    assert!(claim_for(store, LEASE_MS).await.is_none());
    // Cancelling waits for what an optimiser asked for, and not for guesses.
    end(store, &study).await;
    let stale = store.renew(&last.evaluation, last.fence, LEASE_MS).await;
    assert_eq!(stale.unwrap(), crate::store::Held::Stale);
    store.accept_result(report(&out, 1.0)).await.unwrap();
    let view = store.study(&study).await.unwrap().unwrap();
    assert_eq!(view.state, StudyState::Cancelled);
}
