//! Results: restarts, curve, ledger, candidates.

use axum::Json;
use axum::extract::State;
use axum::response::{IntoResponse, Response};
use salp_core::hierarchy::optima::{Optimum, standings};
use salp_core::study::{Study, band_half_width};
use salp_protocol::problem::{self, Problem};
use salp_protocol::{
    Axis, Candidate, LedgerPage, RestartState, RestartView, StudyId, csv as table,
};
use serde::Deserialize;

use super::Shared;
use super::answer::{Parameters, PathId, Refusal, csv};
use super::studies::{best_point, find};
use crate::coordinator::{CoordinatorError, Resumed};
use crate::curve::curve as curve_of;

/// JSON or CSV.
#[derive(Clone, Copy, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Format {
    /// JSON.
    #[default]
    Json,
    /// Comma-separated, with a header line.
    Csv,
}

/// Every restart with its best point and the hash of its history.
pub async fn restarts(
    State(coordinator): Shared,
    PathId(id): PathId<String>,
) -> Result<Json<Vec<RestartView>>, Refusal> {
    let study = find(&coordinator, id).await?;
    let bests = coordinator.store.bests(&study.id).await?;
    let mut views = Vec::new();
    for stored in coordinator.store.restarts(&study.id).await? {
        let best = bests
            .iter()
            .find(|best| (best.step, best.restart) == (stored.step, stored.index));
        views.push(RestartView {
            step: stored.step,
            index: stored.index,
            state: match (stored.done, stored.waits) {
                (true, _) => RestartState::Done,
                (false, true) => RestartState::Waiting,
                (false, false) => RestartState::Running,
            },
            version: stored.version,
            evaluations: stored.summary["evaluations"].as_u64().unwrap_or(0),
            best: best.map(best_point),
            history_sha256: stored.summary["history_sha256"]
                .as_str()
                .unwrap_or_default()
                .to_owned(),
            summary: stored.summary,
        });
    }
    Ok(Json(views))
}

/// Brings back a restart that the competition stopped.
pub async fn resume_restart(
    State(coordinator): Shared,
    PathId((id, step, index)): PathId<(String, usize, usize)>,
) -> Result<Json<RestartView>, Refusal> {
    let study = find(&coordinator, id.clone()).await?;
    match coordinator.resume_restart(&study.id, step, index).await? {
        Resumed::Yes => {}
        Resumed::Refused(why) => return Err(Problem::new(problem::WRONG_STATE, why).into()),
        Resumed::Unknown => {
            let what = format!("step {step} of study {id} has no restart {index}");
            return Err(Problem::new(problem::UNKNOWN_RESTART, what).into());
        }
    }
    let Json(views) = restarts(State(coordinator), PathId(id)).await?;
    let view = views
        .into_iter()
        .find(|v| (v.step, v.index) == (step, index));
    let gone = || Problem::new(problem::INTERNAL, "the restart is gone");
    Ok(Json(view.ok_or_else(gone)?))
}

/// Parameters of a curve.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CurveParameters {
    axis: Option<Axis>,
    #[serde(default)]
    format: Format,
}

/// Run time against best objective.
pub async fn curve(
    State(coordinator): Shared,
    PathId(id): PathId<String>,
    Parameters(parameters): Parameters<CurveParameters>,
) -> Result<Response, Refusal> {
    let study = find(&coordinator, id).await?;
    let points = coordinator.store.points(&study.id).await?;
    let axis = parameters.axis.unwrap_or(Axis::Cpu);
    let bands = coordinator.store.counts(&study.id).await?.bands;
    let curve = curve_of(axis, study.started_ms, &points, bands);
    Ok(match parameters.format {
        Format::Json => Json(curve).into_response(),
        Format::Csv => csv(table::curve(&curve)),
    })
}

/// Parameters of the ledger.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LedgerParameters {
    cursor: Option<i64>,
    limit: Option<i64>,
    #[serde(default)]
    outcome: bool,
    #[serde(default)]
    format: Format,
}

/// Every evaluation with its worker, attempt, fence and cost.
pub async fn evaluations(
    State(coordinator): Shared,
    PathId(id): PathId<String>,
    Parameters(parameters): Parameters<LedgerParameters>,
) -> Result<Response, Refusal> {
    let study = find(&coordinator, id).await?;
    let after = parameters.cursor.unwrap_or(0);
    if parameters.format == Format::Csv {
        let limit = parameters.limit.unwrap_or(i64::MAX).max(1);
        let rows = coordinator
            .store
            .ledger(&study.id, after, limit, false)
            .await?;
        return Ok(csv(table::ledger(&rows)));
    }
    let limit = parameters.limit.unwrap_or(1000).clamp(1, 10_000);
    let evaluations = coordinator
        .store
        .ledger(&study.id, after, limit, parameters.outcome)
        .await?;
    let next = (evaluations.len() as i64 == limit)
        .then(|| evaluations.last().map(|row| row.evaluation.to_string()))
        .flatten();
    Ok(Json(LedgerPage { evaluations, next }).into_response())
}

/// The best points of the restarts, best first, with their errors; equal designs once.
pub async fn candidates(
    State(coordinator): Shared,
    PathId(id): PathId<String>,
) -> Result<Json<Vec<Candidate>>, Refusal> {
    let id: StudyId = find(&coordinator, id).await?.id;
    let points = coordinator.store.points(&id).await?;
    let mut candidates: Vec<Candidate> = Vec::new();
    for best in coordinator.store.bests(&id).await? {
        let Some(objective) = best.outcome.objective else {
            continue;
        };
        if candidates
            .iter()
            .any(|other| other.step == best.step && other.x == best.request.x)
        {
            continue;
        }
        let point = points.iter().find(|p| p.evaluation == best.evaluation);
        let second = point.and_then(|point| point.second_mesh);
        let half = second.map(|second| band_half_width(objective, second));
        candidates.push(Candidate {
            band: half.map(|half| [objective - half, objective + half]),
            distance: None,
            same_as: None,
            step: best.step,
            restart: best.restart,
            evaluation: best.evaluation,
            x: best.request.x,
            objective,
            constraints: best.outcome.constraints,
            max_violation: best.max_violation,
        });
    }
    candidates.sort_by(|a, b| {
        (a.step.cmp(&b.step))
            .then(a.objective.total_cmp(&b.objective))
            .then(a.restart.cmp(&b.restart))
    });
    match coordinator.machine(&id).await {
        Ok(machine) => compare(machine.study(), &mut candidates),
        // Of another build: what is stored can be shown all the same.
        Err(CoordinatorError::Unreadable { .. }) => {}
        Err(failure) => return Err(failure.into()),
    }
    Ok(Json(candidates))
}

/// How the candidates of each step, the best first, stand to each other.
fn compare(study: &Study, candidates: &mut [Candidate]) {
    for of_step in candidates.chunk_by_mut(|a, b| a.step == b.step) {
        let optima: Vec<Optimum<'_>> = of_step
            .iter()
            .map(|c| Optimum {
                x: &c.x,
                objective: c.objective,
                half_width: c.band.map(|[low, high]| (high - low) / 2.0),
            })
            .collect();
        let step = of_step.first().map_or(0, |c| c.step);
        let standings = standings(study, step, &optima).unwrap_or_default();
        let ids: Vec<_> = of_step.iter().map(|c| c.evaluation.clone()).collect();
        for (candidate, standing) in of_step.iter_mut().zip(standings) {
            candidate.distance = Some(standing.distance).filter(|d| d.is_finite());
            candidate.same_as = standing.same_as.map(|k| ids[k].clone());
        }
    }
}
