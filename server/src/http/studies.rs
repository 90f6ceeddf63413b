//! Studies: submit, list, show, cancel, pause, resume.

use std::sync::Arc;

use axum::Json;
use axum::extract::State;
use axum::http::{HeaderMap, HeaderValue, StatusCode, header};
use axum::response::{IntoResponse, Response};
use salp_core::document::{parse_json, parse_toml};
use salp_protocol::problem::{self, Problem};
use salp_protocol::{
    Best, EvaluationId, StepState, StepView, StudyCreated, StudyId, StudyPage, StudyState,
    StudyView,
};
use serde::Deserialize;
use serde_json::Value;
use sha2::{Digest, Sha256};

use super::Shared;
use super::answer::{Body, Parameters, PathId, Refusal, unknown_study};
use crate::config::hex;
use crate::coordinator::{Coordinator, CoordinatorError, Submission};
use crate::machine::StudyMachine;
use crate::store::{Command, Commanded, StoredBest, StoredStudy};

/// Longest Idempotency-Key.
const LONGEST_KEY: usize = 255;

/// Takes a study: JSON, or TOML with `Content-Type: application/toml`.
pub async fn submit(
    State(coordinator): Shared,
    headers: HeaderMap,
    Body(body): Body,
) -> Result<Response, Refusal> {
    let document = read_document(&headers, &body)?;
    let key = idempotency_key(&headers)?;
    let sha256 = hex(&Sha256::digest(&body));
    let (status, id) = match coordinator.submit(document, sha256, key).await? {
        Submission::Created(id) | Submission::Repeated(id) => (StatusCode::CREATED, id),
        Submission::KeyReused(id) => {
            return Err(Problem::new(
                problem::KEY_REUSED,
                format!("the key belongs to study {id}, whose body was another"),
            )
            .into());
        }
    };
    let url = format!("/v1/studies/{id}");
    let mut response = (
        status,
        Json(StudyCreated {
            id,
            url: url.clone(),
        }),
    )
        .into_response();
    if let Ok(location) = HeaderValue::from_str(&url) {
        response.headers_mut().insert(header::LOCATION, location);
    }
    Ok(response)
}

fn read_document(headers: &HeaderMap, body: &[u8]) -> Result<Value, Refusal> {
    let text = std::str::from_utf8(body)
        .map_err(|fault| Problem::new(problem::INVALID_BODY, fault.to_string()))?;
    let is_toml = headers
        .get(header::CONTENT_TYPE)
        .and_then(|value| value.to_str().ok())
        .is_some_and(|value| value.contains("toml"));
    let document = if is_toml {
        parse_toml(text)
    } else {
        parse_json(text)
    };
    document.map_err(|faults| CoordinatorError::Faults(faults).into())
}

fn idempotency_key(headers: &HeaderMap) -> Result<Option<String>, Refusal> {
    let Some(value) = headers.get("idempotency-key") else {
        return Ok(None);
    };
    match value.to_str() {
        Ok(key) if !key.is_empty() && key.len() <= LONGEST_KEY => Ok(Some(key.to_owned())),
        _ => Err(Problem::new(
            problem::INVALID_QUERY,
            format!("an Idempotency-Key has 1 to {LONGEST_KEY} visible ASCII characters"),
        )
        .into()),
    }
}

/// Parameters of a list.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ListParameters {
    cursor: Option<i64>,
    state: Option<StudyState>,
    limit: Option<i64>,
}

/// Studies, latest first.
pub async fn list(
    State(coordinator): Shared,
    Parameters(parameters): Parameters<ListParameters>,
) -> Result<Json<StudyPage>, Refusal> {
    let limit = parameters.limit.unwrap_or(50).clamp(1, 500);
    let stored = coordinator
        .store
        .studies(parameters.cursor, parameters.state, limit)
        .await?;
    let next = (stored.len() as i64 == limit)
        .then(|| stored.last().map(|last| last.number.to_string()))
        .flatten();
    let mut studies = Vec::with_capacity(stored.len());
    for study in stored {
        studies.push(view(&coordinator, study).await?);
    }
    Ok(Json(StudyPage { studies, next }))
}

/// A study.
pub async fn show(
    State(coordinator): Shared,
    PathId(id): PathId<String>,
) -> Result<Json<StudyView>, Refusal> {
    let stored = find(&coordinator, id).await?;
    Ok(Json(view(&coordinator, stored).await?))
}

/// A study's document as submitted.
pub async fn document(
    State(coordinator): Shared,
    PathId(id): PathId<String>,
) -> Result<Json<Value>, Refusal> {
    let document = coordinator.store.document(&StudyId(id.clone())).await?;
    document.map(Json).ok_or_else(|| unknown_study(&id))
}

/// Ends a study.
pub async fn cancel(
    State(coordinator): Shared,
    PathId(id): PathId<String>,
) -> Result<Json<StudyView>, Refusal> {
    obey(&coordinator, id, Command::Cancel).await
}

/// Hands out nothing of a study.
pub async fn pause(
    State(coordinator): Shared,
    PathId(id): PathId<String>,
) -> Result<Json<StudyView>, Refusal> {
    obey(&coordinator, id, Command::Pause).await
}

/// Hands out a paused study again.
pub async fn resume(
    State(coordinator): Shared,
    PathId(id): PathId<String>,
) -> Result<Json<StudyView>, Refusal> {
    obey(&coordinator, id, Command::Resume).await
}

async fn obey(
    coordinator: &Arc<Coordinator>,
    id: String,
    command: Command,
) -> Result<Json<StudyView>, Refusal> {
    let id = StudyId(id);
    match coordinator.command(&id, command).await? {
        Commanded::Now(_) => {
            let stored = find(coordinator, id.0).await?;
            Ok(Json(view(coordinator, stored).await?))
        }
        Commanded::Refused(state) => {
            Err(Problem::new(problem::WRONG_STATE, format!("study {id} is {state}")).into())
        }
        Commanded::Unknown => Err(unknown_study(&id.0)),
    }
}

/// The stored study, or the refusal that it is unknown.
pub async fn find(coordinator: &Arc<Coordinator>, id: String) -> Result<StoredStudy, Refusal> {
    let id = StudyId(id);
    coordinator
        .store
        .study(&id)
        .await?
        .ok_or_else(|| unknown_study(&id.0))
}

async fn view(coordinator: &Arc<Coordinator>, stored: StoredStudy) -> Result<StudyView, Refusal> {
    let counts = coordinator.store.counts(&stored.id).await?;
    let bests = coordinator.store.bests(&stored.id).await?;
    let stored_steps = coordinator.store.steps(&stored.id).await?;
    let machine = match coordinator.machine(&stored.id).await {
        Ok(machine) => Some(machine),
        // One study of another build must not hide all the others.
        Err(CoordinatorError::Unreadable { .. }) => None,
        Err(failure) => return Err(failure.into()),
    };
    let ids = machine.as_ref().map_or_else(Vec::new, |m| m.steps());
    let competes = |machine: &Arc<StudyMachine>| (0..ids.len()).any(|k| machine.competes(k));
    let restarts = if machine.as_ref().is_some_and(competes) {
        coordinator.store.restarts(&stored.id).await?
    } else {
        Vec::new()
    };
    let race = |step: usize| {
        let of_step = restarts.iter().filter(|r| r.step == step);
        let summaries: Vec<&Value> = of_step.map(|r| &r.summary).collect();
        machine.as_ref()?.race(step, &summaries)
    };
    let steps: Vec<StepView> = ids
        .into_iter()
        .zip(stored_steps)
        .map(|(id, step)| {
            let blocked = step.state == StepState::Blocked;
            let reason = step.result.as_ref().filter(|_| blocked);
            StepView {
                id,
                state: step.state,
                reason: reason.and_then(|r| Some(r["reason"].as_str()?.to_owned())),
                inputs: step.inputs,
                result: step.result.filter(|_| !blocked),
                began_ms: step.began_ms,
                ended_ms: step.ended_ms,
                best: best_of_step(&bests, step.step),
                race: race(step.step),
            }
        })
        .collect();
    Ok(StudyView {
        id: stored.id,
        name: stored.name,
        state: stored.state,
        failure: stored.failure,
        fingerprint: stored.fingerprint,
        best: steps.iter().rev().find_map(|step| step.best.clone()),
        steps,
        counts,
        created_ms: stored.created_ms,
        started_ms: stored.started_ms,
        ended_ms: stored.ended_ms,
    })
}

/// The least objective; the first restart among equals.
fn best_of_step(bests: &[StoredBest], step: usize) -> Option<Best> {
    let mut least: Option<Best> = None;
    for best in bests.iter().filter(|best| best.step == step) {
        let found = best_point(best);
        if least
            .as_ref()
            .is_none_or(|least| found.objective < least.objective)
        {
            least = Some(found);
        }
    }
    least
}

/// A stored best point as the API shows it.
pub fn best_point(best: &StoredBest) -> Best {
    Best {
        x: best.request.x.clone(),
        objective: best.outcome.objective.unwrap_or(f64::INFINITY),
        max_violation: best.max_violation,
        evaluation: EvaluationId(best.evaluation.0),
        restart: best.restart,
    }
}
