//! Health.

use axum::Json;
use axum::extract::State;
use salp_protocol::problem::{self, Problem};
use serde_json::{Value, json};

use super::Shared;
use super::answer::Refusal;

/// The process answers.
pub async fn live() -> Json<Value> {
    Json(json!({ "status": "ok" }))
}

/// The store answers, and the coordinator is not going down.
pub async fn ready(State(coordinator): Shared) -> Result<Json<Value>, Refusal> {
    if *coordinator.stopping().borrow() {
        return Err(Problem::new(problem::UNAVAILABLE, "going down").into());
    }
    coordinator.store.ping().await?;
    Ok(Json(json!({ "status": "ok" })))
}
