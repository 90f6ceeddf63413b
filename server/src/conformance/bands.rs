//! Error bands: asked with each new best, evaluated after all else.

use salp_core::study::{EvaluationRequest, OutcomeStatus};
use salp_protocol::{Claim, StudyId, StudyState};
use serde_json::json;

use super::{LEASE_MS, claim, claim_for, end, report, submit};
use crate::machine::{BandAsk, Judgement};
use crate::store::{AcceptedReport, NewStep, Reported, Store};

/// As [`report`], of a point that may have a band.
pub fn with_band(claim: &Claim, objective: f64) -> AcceptedReport {
    let request = EvaluationRequest {
        second_mesh: true,
        ..claim.request.clone()
    };
    let key = format!("band {objective}");
    let mut report = report(claim, objective);
    report.judgement.band = Some(BandAsk { request, key });
    report
}

/// As [`report`], of a band.
pub fn of_band(claim: &Claim, status: OutcomeStatus, value: Option<f64>) -> AcceptedReport {
    let mut report = report(claim, 0.0);
    report.outcome.status = status;
    report.outcome.objective = value;
    report.judgement = Judgement::WITHOUT_VALUES;
    report
}

pub async fn each_best_gets_a_band_after_all_else(store: &dyn Store) {
    let study = submit(store, "bands", &[1.0, 2.0, 3.0]).await;
    let (first, second) = (claim(store).await, claim(store).await);
    let mut restart = None;
    for (claim, objective) in [(&first, 5.0), (&second, 7.0)] {
        let stored = store.accept_result(with_band(claim, objective)).await;
        let Reported::Stored { restart: of, .. } = stored.unwrap() else {
            panic!("not stored");
        };
        restart = of;
    }
    let bands = |counts: salp_protocol::Counts| (counts.bands.evaluations, counts.bands.answered);
    // 7 is no better than 5.
    assert_eq!(bands(store.counts(&study).await.unwrap()), (1, 0));
    // What an optimiser waits for goes first, also of a study that came later.
    let later = submit(store, "bands-later", &[1.0]).await;
    let claims = [claim(store).await, claim(store).await];
    assert!(claims.iter().all(|claim| !claim.request.second_mesh));
    let of = |id: &StudyId| claims.iter().find(|claim| claim.study == *id).unwrap();
    end(store, &later).await;
    store.accept_result(report(of(&later), 1.0)).await.unwrap();
    let held = claim(store).await;
    assert!(held.request.second_mesh);
    assert!(store.release(&held.evaluation, held.fence).await.unwrap());
    // While an optimiser is about to ask for more, bands wait.
    store
        .accept_result(with_band(of(&study), 3.0))
        .await
        .unwrap();
    assert!(claim_for(store, LEASE_MS).await.is_none());
    let batch = store.batch(restart.unwrap()).await.unwrap().unwrap();
    assert_eq!(batch.outcomes.len(), 3);
    // The end of a restart asks for the bands of what it may hand on: of 7 too, of 5 no second one.
    let again = |evaluation: &Claim| BandAsk {
        request: EvaluationRequest {
            second_mesh: true,
            ..evaluation.request.clone()
        },
        key: "band of a candidate".to_owned(),
    };
    let step = NewStep {
        restart: batch.restart,
        version: batch.version,
        machine: json!({}),
        summary: json!({}),
        done: true,
        waits: false,
        asks: Vec::new(),
        guesses: Vec::new(),
        bands: vec![(0, again(&first)), (1, again(&second))],
    };
    store.save_step(step).await.unwrap();
    assert!(store.end_step(&study, 0, &json!({})).await.unwrap());
    store.finish(&study).await.unwrap();
    let state = async || store.study(&study).await.unwrap().unwrap().state;
    assert_eq!(state().await, StudyState::Running, "bands are out");
    let band = claim(store).await;
    let value = of_band(&band, OutcomeStatus::Ok, Some(4.8));
    let stored = store.accept_result(value).await.unwrap();
    assert!(matches!(stored, Reported::Stored { restart: None, .. }));
    let band = claim(store).await;
    let value = of_band(&band, OutcomeStatus::Ok, Some(2.9));
    store.accept_result(value).await.unwrap();
    assert_eq!(state().await, StudyState::Running, "a band is out");
    // One whose solve fails ends the study all the same.
    let band = claim(store).await;
    let status = OutcomeStatus::NotConverged {
        reason: "why".to_owned(),
        load_fraction: 0.5,
    };
    store
        .accept_result(of_band(&band, status, None))
        .await
        .unwrap();
    assert_eq!(state().await, StudyState::Done);
    let counts = store.counts(&study).await.unwrap();
    assert_eq!(
        (counts.evaluations, counts.answered, counts.alarms),
        (3, 3, 0)
    );
    assert_eq!((counts.bands.answered, counts.bands.without_values), (3, 1));
    let points = store.points(&study).await.unwrap();
    let values: Vec<_> = points
        .iter()
        .map(|p| (p.objective, p.second_mesh))
        .collect();
    let expected = [
        (Some(5.0), Some(4.8)),
        (Some(7.0), None),
        (Some(3.0), Some(2.9)),
    ];
    assert_eq!(values, expected);
    let ledger = store.ledger(&study, 0, 10, false).await.unwrap();
    let of: Vec<_> = ledger
        .iter()
        .filter_map(|row| row.band_of.as_ref())
        .collect();
    assert_eq!(of, [0, 2, 1].map(|k: usize| &points[k].evaluation));
    assert!(
        ledger
            .iter()
            .all(|row| (row.kind == "band") == row.band_of.is_some())
    );
    assert_eq!(
        store.bests(&study).await.unwrap()[0].outcome.objective,
        Some(3.0)
    );
}

pub async fn a_cancelled_study_asks_for_no_band(store: &dyn Store) {
    let study = submit(store, "bands-cancelled", &[1.0, 2.0]).await;
    let first = claim(store).await;
    store.accept_result(with_band(&first, 5.0)).await.unwrap();
    end(store, &study).await;
    assert!(claim_for(store, LEASE_MS).await.is_none());
    let view = store.study(&study).await.unwrap().unwrap();
    assert_eq!(view.state, StudyState::Cancelled);
    let ledger = store.ledger(&study, 0, 10, false).await.unwrap();
    let band = ledger.iter().find(|row| row.band_of.is_some()).unwrap();
    assert_eq!(band.status, "withdrawn");
}
