//! What several transactions share: the clock, results, events, and reading columns back.

use salp_core::study::Outcome;
use salp_protocol::{EvaluationId, StudyId, StudyState};
use salp_server::machine::Verdict;
use salp_server::store::StoreError;
use serde::de::DeserializeOwned;
use serde_json::{Value, json};
use sqlx::{Sqlite, Transaction};

/// A transaction.
pub type Tx = Transaction<'static, Sqlite>;

/// Wraps what the database said with what was to be done.
pub fn database(doing: &'static str) -> impl Fn(sqlx::Error) -> StoreError {
    move |source| StoreError::Database {
        doing,
        source: Box::new(source),
    }
}

/// Reads a stored document back.
pub fn from_json<T: DeserializeOwned>(what: &'static str, text: &str) -> Result<T, StoreError> {
    serde_json::from_str(text).map_err(|source| StoreError::Corrupt { what, source })
}

/// Writes a document to be stored.
pub fn to_json<T: serde::Serialize>(what: &'static str, value: &T) -> Result<String, StoreError> {
    serde_json::to_string(value).map_err(|source| StoreError::Corrupt { what, source })
}

/// Reads a study's state back.
pub fn study_state(text: &str) -> Result<StudyState, StoreError> {
    StudyState::parse(text).ok_or_else(|| StoreError::UnknownWord {
        what: "state of a study",
        found: text.to_owned(),
    })
}

/// The database's clock, ms since 1970 UTC.
pub async fn now_ms(tx: &mut Tx) -> Result<i64, StoreError> {
    sqlx::query_scalar!(r#"SELECT CAST(unixepoch('subsec') * 1000 AS INTEGER) AS "now!: i64""#)
        .fetch_one(&mut **tx)
        .await
        .map_err(database("read its clock"))
}

/// Notes an event.
pub async fn note(
    tx: &mut Tx,
    study: &StudyId,
    kind: &str,
    data: &Value,
    now: i64,
) -> Result<(), StoreError> {
    let data = to_json("event", data)?;
    sqlx::query!(
        "INSERT INTO events (study, kind, data, created_ms) VALUES (?, ?, ?, ?)",
        study.0,
        kind,
        data,
        now
    )
    .execute(&mut **tx)
    .await
    .map_err(database("note an event"))?;
    Ok(())
}

/// Changes a study's state and notes it.
pub async fn enter_state(
    tx: &mut Tx,
    study: &StudyId,
    state: StudyState,
    now: i64,
) -> Result<(), StoreError> {
    let (word, ended) = (state.as_str(), state.is_final().then_some(now));
    sqlx::query!(
        "UPDATE studies SET state = ?, ended_ms = ? WHERE id = ?",
        word,
        ended,
        study.0
    )
    .execute(&mut **tx)
    .await
    .map_err(database("change a study's state"))?;
    note(tx, study, "state", &json!({ "state": state }), now).await
}

/// An answered evaluation about to be stored.
pub struct Answered<'a> {
    pub evaluation: EvaluationId,
    pub study: &'a StudyId,
    pub step: i64,
    pub restart_index: i64,
    pub key: &'a str,
    pub outcome: &'a Outcome,
    pub verdict: Verdict,
    pub cached_from: Option<&'a EvaluationId>,
    pub worker: Option<&'a str>,
    /// Build and instruction set of the worker.
    pub built: Option<(&'a str, &'a str)>,
    pub fence: i64,
    pub attempt: i64,
}

/// Stores a result and notes it.
pub async fn store_answer(tx: &mut Tx, answer: Answered<'_>, now: i64) -> Result<(), StoreError> {
    let status = answer.outcome.status.name();
    let outcome = to_json("outcome", answer.outcome)?;
    let (build, instruction_set) = answer.built.unzip();
    let Verdict {
        max_violation,
        feasible,
        overlap,
        counts,
    } = answer.verdict;
    let cached_from = answer.cached_from.map(|id| id.0);
    sqlx::query!(
        "INSERT INTO results (evaluation, study, status, outcome, objective, max_violation, feasible, overlap,
             counts, result_key, cached_from, wall_s, cpu_s, worker, build, instruction_set, fence, attempt, finished_ms)
         VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?)",
        answer.evaluation.0,
        answer.study.0,
        status,
        outcome,
        answer.outcome.objective,
        max_violation,
        feasible,
        overlap,
        counts,
        answer.key,
        cached_from,
        answer.outcome.wall_s,
        answer.outcome.cpu_s,
        answer.worker,
        build,
        instruction_set,
        answer.fence,
        answer.attempt,
        now
    )
    .execute(&mut **tx)
    .await
    .map_err(database("store a result"))?;
    let data = json!({
        "evaluation": answer.evaluation,
        "step": answer.step,
        "restart": answer.restart_index,
        "status": status,
        "objective": answer.outcome.objective,
        "feasible": feasible,
        "overlap": overlap,
        "worker": answer.worker,
        "cached": cached_from.is_some(),
    });
    note(tx, answer.study, "evaluation", &data, now).await
}
