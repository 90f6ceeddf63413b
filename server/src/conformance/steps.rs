//! Steps that wait, begin, end and are given up, and restarts that wait.

use salp_protocol::{StepState, StudyId, StudyState};
use serde_json::json;

use super::{answer, ask, begun, claim, end, submit};
use crate::store::{NewAsk, NewStep, NewStudy, Saved, Store, Submitted};

/// A study of three steps: the second begins after the first, the third is given up.
pub async fn steps_begin_end_and_block_once(store: &dyn Store) {
    let study = StudyId("steps".to_owned());
    let new = NewStudy {
        id: study.clone(),
        name: "steps".to_owned(),
        document: json!({}),
        fingerprint: "f".to_owned(),
        steps: 3,
        mixed_hardware: false,
        idempotency_key: None,
        body_sha256: "b".to_owned(),
        begun: vec![begun(0, &[1.0])],
    };
    assert_eq!(store.submit(new).await.unwrap(), Submitted::Created);
    let states = async || {
        let steps = store.steps(&study).await.unwrap();
        steps.iter().map(|s| s.state).collect::<Vec<_>>()
    };
    let result = json!({ "candidates": [] });
    let end = async |objective| {
        let claim = claim(store).await;
        let restart = answer(store, &claim, objective).await;
        let batch = store.batch(restart).await.unwrap().expect("complete");
        let step = NewStep {
            restart,
            version: batch.version,
            machine: json!({ "batch": 1 }),
            summary: json!({}),
            done: true,
            waits: false,
            asks: Vec::new(),
            guesses: Vec::new(),
            bands: Vec::new(),
        };
        store.save_step(step).await.unwrap()
    };
    assert_eq!(
        states().await,
        [StepState::Running, StepState::Waiting, StepState::Waiting]
    );
    // Not before its restarts have ended, and only once.
    assert_eq!(store.ended_restarts(&study, 0).await.unwrap(), None);
    assert!(!store.end_step(&study, 0, &result).await.unwrap());
    assert_eq!(end(1.0).await, Saved::Yes { step_ended: true });
    let ended = store.ended_restarts(&study, 0).await.unwrap();
    assert_eq!(ended, Some(vec![(0, json!({ "batch": 1 }))]));
    assert!(store.end_step(&study, 0, &result).await.unwrap());
    assert!(!store.end_step(&study, 0, &result).await.unwrap());
    store.finish(&study).await.unwrap();
    assert!(store.under_way().await.unwrap().contains(&study));
    assert!(store.begin_step(&study, begun(1, &[2.0])).await.unwrap());
    assert!(!store.begin_step(&study, begun(1, &[2.0])).await.unwrap());
    assert!(!store.block_step(&study, 1, "why").await.unwrap());
    assert!(
        store
            .block_step(&study, 2, "nothing was found")
            .await
            .unwrap()
    );
    assert!(!store.begin_step(&study, begun(2, &[3.0])).await.unwrap());
    assert_eq!(end(2.0).await, Saved::Yes { step_ended: true });
    assert!(store.end_step(&study, 1, &result).await.unwrap());
    store.finish(&study).await.unwrap();
    assert_eq!(
        states().await,
        [StepState::Done, StepState::Done, StepState::Blocked]
    );
    let steps = store.steps(&study).await.unwrap();
    assert_eq!(steps[1].inputs, Some(json!({ "of": 1 })));
    assert_eq!(steps[0].result, Some(result));
    let view = store.study(&study).await.unwrap().expect("stored");
    assert_eq!(view.state, StudyState::Failed);
    assert_eq!(view.failure.as_deref(), Some("nothing was found"));
    assert!(!store.under_way().await.unwrap().contains(&study));
}

/// One that waits is not stepped; one that is done is brought back once, with its step and its study.
pub async fn restarts_wait_and_come_back(store: &dyn Store) {
    let study = submit(store, "waits", &[1.0]).await;
    let first = claim(store).await;
    let restart = answer(store, &first, 10.0).await;
    assert!(store.idle(restart).await.unwrap().is_none());
    let step = |version, done, waits, asks: Vec<NewAsk>| NewStep {
        restart,
        version,
        machine: json!({ "version": version + 1 }),
        summary: json!({ "race": version + 1 }),
        done,
        waits,
        asks,
        guesses: Vec::new(),
        bands: Vec::new(),
    };
    let saved = store.save_step(step(0, false, true, Vec::new())).await;
    assert_eq!(saved.unwrap(), Saved::Yes { step_ended: false });
    assert!(store.batch(restart).await.unwrap().is_none());
    assert!(!store.unstepped().await.unwrap().contains(&restart));
    let idle = store.idle(restart).await.unwrap().expect("it waits");
    assert_eq!((idle.version, idle.machine), (1, json!({ "version": 1 })));
    let stored = &store.restarts(&study).await.unwrap()[0];
    assert!(stored.waits && !stored.done);
    assert_eq!(store.ended_restarts(&study, 0).await.unwrap(), None);
    assert!(
        !store
            .reopen(step(1, false, false, vec![ask(2.0)]), &[])
            .await
            .unwrap()
    );
    store
        .save_step(step(1, true, false, Vec::new()))
        .await
        .unwrap();
    assert!(store.end_step(&study, 0, &json!({})).await.unwrap());
    store.finish(&study).await.unwrap();
    let state = async || store.study(&study).await.unwrap().expect("stored").state;
    assert_eq!(state().await, StudyState::Done);
    assert!(store.idle(restart).await.unwrap().is_some());
    let back = step(2, false, false, vec![ask(2.0)]);
    assert!(
        !store.reopen(back.clone(), &[0]).await.unwrap(),
        "step 0 has begun"
    );
    assert!(store.reopen(back.clone(), &[]).await.unwrap());
    assert!(!store.reopen(back, &[]).await.unwrap());
    assert_eq!(state().await, StudyState::Running);
    let view = &store.steps(&study).await.unwrap()[0];
    assert_eq!((view.state, &view.result), (StepState::Running, &None));
    let second = claim(store).await;
    assert_eq!(second.request.x, [2.0]);
    answer(store, &second, 5.0).await;
    assert!(store.batch(restart).await.unwrap().is_some());
    store
        .save_step(step(3, true, false, Vec::new()))
        .await
        .unwrap();
    assert!(store.end_step(&study, 0, &json!({})).await.unwrap());
    store.finish(&study).await.unwrap();
    assert_eq!(state().await, StudyState::Done);
    let cancelled = submit(store, "waits-not", &[1.0]).await;
    end(store, &cancelled).await;
    let restart = store.restarts(&cancelled).await.unwrap()[0].id;
    let back = NewStep {
        restart,
        ..step(0, false, false, Vec::new())
    };
    assert!(!store.reopen(back, &[]).await.unwrap());
}
