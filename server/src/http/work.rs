//! Workers: claim, heartbeat, report, release, list, drain.

use axum::Json;
use axum::extract::State;
use axum::response::{IntoResponse, Response};
use salp_protocol::problem::{self, Problem};
use salp_protocol::{
    ClaimRequest, Directive, EvaluationId, HeartbeatAnswer, HeartbeatRequest, ReleaseRequest,
    ReportAnswer, ReportRequest, StudyState, WorkerId, WorkerView,
};
use serde_json::Value;

use super::answer::{JsonBody, PathId, Refusal};
use super::{Shared, nothing};
use crate::store::{Claimed, Held, Reported};

/// Longest text of a worker's identity.
const LONGEST_NAME: usize = 200;

/// Hands out an evaluation; 204 if there is none.
pub async fn claim(
    State(coordinator): Shared,
    JsonBody(request): JsonBody<ClaimRequest>,
) -> Result<Response, Refusal> {
    let worker = &request.worker;
    let texts = [
        &worker.id.0,
        &worker.host,
        &worker.build,
        &worker.instruction_set,
    ];
    if worker.id.0.is_empty() || texts.iter().any(|text| text.len() > LONGEST_NAME) {
        return Err(Problem::new(
            problem::INVALID_BODY,
            format!("a worker's identity has texts of at most {LONGEST_NAME} bytes and an id"),
        )
        .into());
    }
    Ok(match coordinator.claim(&request).await? {
        Claimed::Work { claim, .. } => Json(claim).into_response(),
        Claimed::Nothing => nothing(),
        Claimed::Mismatch {
            build,
            instruction_set,
            study,
        } => {
            let detail = format!(
                "study {study} is bound to build {build} on {instruction_set}; this worker is build {} on {}. Start a \
                 worker of that build, or submit the study with mixed_hardware = true",
                worker.build, worker.instruction_set
            );
            return Err(Problem::new(problem::WORKER_MISMATCH, detail).into());
        }
        Claimed::CommandsNotAllowed { study } => {
            let detail =
                format!("study {study} starts programs: start a worker with --allow-commands");
            return Err(Problem::new(problem::COMMANDS_NOT_ALLOWED, detail).into());
        }
        Claimed::Drain => {
            return Err(Problem::new(problem::DRAINED, "this worker was told to end").into());
        }
    })
}

/// Renews a lease.
pub async fn heartbeat(
    State(coordinator): Shared,
    PathId(id): PathId<i64>,
    JsonBody(request): JsonBody<HeartbeatRequest>,
) -> Result<Json<HeartbeatAnswer>, Refusal> {
    let id = EvaluationId(id);
    let lease_ms = coordinator.config.lease.as_millis() as i64;
    let directive = match coordinator
        .store
        .renew(&id, request.fence, lease_ms)
        .await?
    {
        Held::Unknown => return Err(unknown(&id)),
        Held::Stale => return Err(stale(&id, request.fence)),
        Held::Yes {
            state: StudyState::Cancelling | StudyState::Cancelled | StudyState::Failed,
            ..
        } => Directive::Cancel,
        Held::Yes { drain: true, .. } => Directive::Drain,
        Held::Yes { .. } => Directive::Continue,
    };
    Ok(Json(HeartbeatAnswer { directive }))
}

/// Takes an outcome.
pub async fn result(
    State(coordinator): Shared,
    PathId(id): PathId<i64>,
    JsonBody(report): JsonBody<ReportRequest<Value>>,
) -> Result<Json<ReportAnswer>, Refusal> {
    let (id, fence) = (EvaluationId(id), report.fence);
    match coordinator.report(id.clone(), report).await? {
        Reported::Stored { status, .. } | Reported::Repeated { status } => {
            Ok(Json(ReportAnswer { status }))
        }
        Reported::PutBack => Ok(Json(ReportAnswer {
            status: "put_back".to_owned(),
        })),
        Reported::Stale => Err(stale(&id, fence)),
        Reported::Unknown => Err(unknown(&id)),
    }
}

/// Takes an evaluation back.
pub async fn release(
    State(coordinator): Shared,
    PathId(id): PathId<i64>,
    JsonBody(request): JsonBody<ReleaseRequest>,
) -> Result<Response, Refusal> {
    let id = EvaluationId(id);
    if coordinator.release(&id, request.fence).await? {
        Ok(nothing())
    } else {
        Err(stale(&id, request.fence))
    }
}

/// Workers, the latest seen first.
pub async fn list(State(coordinator): Shared) -> Result<Json<Vec<WorkerView>>, Refusal> {
    Ok(Json(coordinator.store.workers().await?))
}

/// Tells a worker to end after its evaluation.
pub async fn drain(
    State(coordinator): Shared,
    PathId(id): PathId<String>,
) -> Result<Response, Refusal> {
    if coordinator.store.drain(&WorkerId(id.clone())).await? {
        Ok(nothing())
    } else {
        Err(Problem::new(problem::NOT_FOUND, format!("there is no worker {id}")).into())
    }
}

fn stale(id: &EvaluationId, fence: i64) -> Refusal {
    Problem::new(
        problem::STALE_LEASE,
        format!(
            "fence {fence} of evaluation {id} is not the latest, or the evaluation is answered"
        ),
    )
    .into()
}

fn unknown(id: &EvaluationId) -> Refusal {
    Problem::new(
        problem::UNKNOWN_EVALUATION,
        format!("there is no evaluation {id}"),
    )
    .into()
}
