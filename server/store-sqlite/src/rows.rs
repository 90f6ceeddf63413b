//! What several transactions share: the clock, results, events, and reading columns back.

use salp_core::study::Outcome;
use salp_protocol::{EvaluationId, StudyId, StudyState};
use salp_server::machine::{BandAsk, Judgement, Verdict};
use salp_server::store::StoreError;
use serde::de::DeserializeOwned;
use serde_json::{Value, json};
use sqlx::{Sqlite, Transaction};

use crate::guess::forget_all;

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
    pub restart: i64,
    pub step: i64,
    pub restart_index: i64,
    /// The evaluation whose band this is.
    pub band_of: Option<i64>,
    /// Whether no optimiser has asked for it.
    pub guess: bool,
    pub key: &'a str,
    pub outcome: &'a Outcome,
    pub judgement: &'a Judgement,
    pub cached_from: Option<&'a EvaluationId>,
    pub worker: Option<&'a str>,
    /// Build and instruction set of the worker.
    pub built: Option<(&'a str, &'a str)>,
    pub fence: i64,
    pub attempt: i64,
}

/// Stores a result and notes it, unless it is a guess, and queues its band where it is the best so far of its step.
pub async fn store_answer(tx: &mut Tx, answer: Answered<'_>, now: i64) -> Result<(), StoreError> {
    let status = answer.outcome.status.name();
    let outcome = to_json("outcome", answer.outcome)?;
    let (build, instruction_set) = answer.built.unzip();
    let Verdict {
        max_violation,
        feasible,
        overlap,
        counts,
    } = answer.judgement.verdict;
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
    if let Some(band) = &answer.judgement.band
        && is_best_so_far(tx, &answer, now).await?
    {
        queue_band(
            tx,
            answer.study,
            answer.restart,
            answer.evaluation.0,
            band,
            now,
        )
        .await?;
    }
    if answer.guess {
        return Ok(());
    }
    let mut data = json!({
        "evaluation": answer.evaluation,
        "step": answer.step,
        "restart": answer.restart_index,
        "status": status,
        "objective": answer.outcome.objective,
        "feasible": feasible,
        "overlap": overlap,
        "counts": counts,
        "worker": answer.worker,
        "cached": cached_from.is_some(),
    });
    if let Some(of) = answer.band_of {
        data["band_of"] = json!(EvaluationId(of));
    }
    note(tx, answer.study, "evaluation", &data, now).await
}

/// Whether nothing that counts and was stored before it in the step is as good; what is being cancelled has no best.
async fn is_best_so_far(tx: &mut Tx, answer: &Answered<'_>, now: i64) -> Result<bool, StoreError> {
    let no = sqlx::query_scalar!(
        r#"SELECT EXISTS (
               SELECT 1 FROM results a JOIN evaluations e ON e.id = a.evaluation JOIN restarts r ON r.id = e.restart
               WHERE a.study = ?1 AND a.counts = 1 AND a.objective <= ?2 AND r.step = ?3
                 AND (a.finished_ms < ?4 OR (a.finished_ms = ?4 AND a.evaluation < ?5)))
             OR EXISTS (SELECT 1 FROM studies WHERE id = ?1 AND state = 'cancelling') AS "no!: i64""#,
        answer.study.0,
        answer.outcome.objective,
        answer.step,
        now,
        answer.evaluation.0
    )
    .fetch_one(&mut **tx)
    .await
    .map_err(database("look for a better result"))?;
    Ok(no == 0)
}

/// Queues the error band of an evaluation that has none.
pub async fn queue_band(
    tx: &mut Tx,
    study: &StudyId,
    restart: i64,
    band_of: i64,
    band: &BandAsk,
    now: i64,
) -> Result<(), StoreError> {
    const DOING: &str = "queue an error band";
    let request = to_json("request", &band.request)?;
    let id = sqlx::query_scalar!(
        r#"INSERT INTO evaluations (study, restart, batch, batch_index, request, result_key, created_ms, band_of)
           VALUES (?1, ?2, -1, ?3, ?4, ?5, ?6, ?3) RETURNING id AS "id!: i64""#,
        study.0,
        restart,
        band_of,
        request,
        band.key,
        now
    )
    .fetch_one(&mut **tx)
    .await
    .map_err(database(DOING))?;
    // Only finite-element steps have bands: none starts a program.
    sqlx::query!(
        "INSERT INTO queue (evaluation, study, state, command, fence, attempt, kind)
         VALUES (?, ?, 'ready', 0, 0, 0, 'band')",
        id,
        study.0
    )
    .execute(&mut **tx)
    .await
    .map_err(database(DOING))?;
    Ok(())
}

/// Ends a study whose steps have all ended, if nothing of it is queued but guesses. One with a blocked step has failed, with its reasons.
pub async fn end_if_complete(tx: &mut Tx, study: &StudyId, now: i64) -> Result<(), StoreError> {
    const DOING: &str = "end a study";
    let complete = sqlx::query_scalar!(
        r#"SELECT EXISTS (SELECT 1 FROM studies WHERE id = ?1 AND state IN ('queued', 'running', 'paused'))
             AND NOT EXISTS (SELECT 1 FROM steps WHERE study = ?1 AND state IN ('waiting', 'running'))
             AND NOT EXISTS (SELECT 1 FROM queue WHERE study = ?1 AND kind <> 'guess') AS "complete!: i64""#,
        study.0
    )
    .fetch_one(&mut **tx)
    .await
    .map_err(database(DOING))?;
    if complete == 0 {
        return Ok(());
    }
    forget_all(tx, study).await?;
    let failure = sqlx::query_scalar!(
        r#"SELECT GROUP_CONCAT(json_extract(result, '$.reason'), '; ') AS "failure?: String"
           FROM steps WHERE study = ? AND state = 'blocked'"#,
        study.0
    )
    .fetch_one(&mut **tx)
    .await
    .map_err(database(DOING))?;
    let state = if failure.is_some() {
        StudyState::Failed
    } else {
        StudyState::Done
    };
    sqlx::query!(
        "UPDATE studies SET failure = ? WHERE id = ?",
        failure,
        study.0
    )
    .execute(&mut **tx)
    .await
    .map_err(database(DOING))?;
    enter_state(tx, study, state, now).await
}
