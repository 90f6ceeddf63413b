//! A study, a later step, their restarts and asks.

use salp_protocol::{EvaluationId, StudyId, StudyState};
use salp_server::store::{BegunStep, NewAsk, NewRestart, NewStudy, StoreError, Submitted};
use serde_json::json;

use crate::SqliteStore;
use crate::guess::replace_guesses;
use crate::rows::{Answered, Tx, database, note, now_ms, store_answer, to_json};

impl SqliteStore {
    pub(crate) async fn submit_study(&self, study: NewStudy) -> Result<Submitted, StoreError> {
        const DOING: &str = "store a study";
        let mut tx = self.write(DOING).await?;
        if let Some(key) = &study.idempotency_key {
            let earlier = sqlx::query!(
                "SELECT id, body_sha256 FROM studies WHERE idempotency_key = ?",
                key
            )
            .fetch_optional(&mut *tx)
            .await
            .map_err(database(DOING))?;
            if let Some(earlier) = earlier {
                let id = StudyId(earlier.id);
                return Ok(if earlier.body_sha256 == study.body_sha256 {
                    Submitted::Repeated(id)
                } else {
                    Submitted::KeyReused(id)
                });
            }
        }
        let now = now_ms(&mut tx).await?;
        let document = to_json("study", &study.document)?;
        sqlx::query!(
            "INSERT INTO studies (id, name, document, fingerprint, state, mixed_hardware,
                 idempotency_key, body_sha256, created_ms)
             VALUES (?, ?, ?, ?, 'queued', ?, ?, ?, ?)",
            study.id.0,
            study.name,
            document,
            study.fingerprint,
            study.mixed_hardware,
            study.idempotency_key,
            study.body_sha256,
            now
        )
        .execute(&mut *tx)
        .await
        .map_err(database(DOING))?;
        let state = json!({ "state": StudyState::Queued });
        note(&mut tx, &study.id, "state", &state, now).await?;
        for step in 0..study.steps as i64 {
            sqlx::query!(
                "INSERT INTO steps (study, step, state) VALUES (?, ?, 'waiting')",
                study.id.0,
                step
            )
            .execute(&mut *tx)
            .await
            .map_err(database(DOING))?;
            if study.begun.iter().all(|begun| begun.step as i64 != step) {
                let waits = json!({ "step": step, "state": "waiting" });
                note(&mut tx, &study.id, "step", &waits, now).await?;
            }
        }
        for begun in study.begun {
            begin(&mut tx, &study.id, begun, now).await?;
        }
        tx.commit().await.map_err(database(DOING))?;
        Ok(Submitted::Created)
    }

    pub(crate) async fn begin_waiting_step(
        &self,
        study: &StudyId,
        begun: BegunStep,
    ) -> Result<bool, StoreError> {
        let mut tx = self.write(BEGIN).await?;
        let now = now_ms(&mut tx).await?;
        let begins = begin(&mut tx, study, begun, now).await?;
        tx.commit().await.map_err(database(BEGIN))?;
        Ok(begins)
    }
}

const BEGIN: &str = "begin a step";

/// Begins a step that waits; false where it does not, or its study is not under way.
async fn begin(
    tx: &mut Tx,
    study: &StudyId,
    begun: BegunStep,
    now: i64,
) -> Result<bool, StoreError> {
    let step = begun.step as i64;
    let inputs = to_json("inputs of a step", &begun.inputs)?;
    let moved = sqlx::query!(
        "UPDATE steps SET state = 'running', inputs = ?1, began_ms = ?2
         WHERE study = ?3 AND step = ?4 AND state = 'waiting'
           AND (SELECT s.state FROM studies s WHERE s.id = ?3) IN ('queued', 'running', 'paused')",
        inputs,
        now,
        study.0,
        step
    )
    .execute(&mut **tx)
    .await
    .map_err(database(BEGIN))?;
    if moved.rows_affected() == 0 {
        return Ok(false);
    }
    let data = json!({ "step": step, "state": "running" });
    note(tx, study, "step", &data, now).await?;
    insert_restarts(tx, study, step, begun.restarts, now).await?;
    Ok(true)
}

async fn insert_restarts(
    tx: &mut Tx,
    study: &StudyId,
    step: i64,
    restarts: Vec<NewRestart>,
    now: i64,
) -> Result<(), StoreError> {
    for restart in restarts {
        let index = restart.index as i64;
        let machine = to_json("optimiser state", &restart.machine)?;
        let summary = to_json("restart summary", &restart.summary)?;
        let done = restart.asks.is_empty();
        let state = if done { "done" } else { "running" };
        let ended = done.then_some(now);
        let id = sqlx::query_scalar!(
            r#"INSERT INTO restarts (study, step, restart_index, state, machine, version, batch, summary, started_ms, ended_ms)
               VALUES (?, ?, ?, ?, ?, 0, 0, ?, ?, ?) RETURNING id AS "id!: i64""#,
            study.0,
            step,
            index,
            state,
            machine,
            summary,
            now,
            ended
        )
        .fetch_one(&mut **tx)
        .await
        .map_err(database("store a restart"))?;
        let begun =
            json!({ "step": step, "restart": index, "state": state, "summary": restart.summary });
        note(tx, study, "restart", &begun, now).await?;
        let owner = Owner {
            study,
            restart: id,
            step,
            restart_index: index,
        };
        insert_asks(tx, &owner, 0, restart.asks, now).await?;
        replace_guesses(tx, &owner, 0, restart.guesses, now).await?;
    }
    Ok(())
}

/// Whose asks are inserted.
pub struct Owner<'a> {
    pub study: &'a StudyId,
    pub restart: i64,
    pub step: i64,
    pub restart_index: i64,
}

/// Stores a batch: known results at once, the rest into the queue.
pub async fn insert_asks(
    tx: &mut Tx,
    owner: &Owner<'_>,
    batch: i64,
    asks: Vec<NewAsk>,
    now: i64,
) -> Result<(), StoreError> {
    const DOING: &str = "queue an evaluation";
    for (place, ask) in asks.into_iter().enumerate() {
        let place = place as i64;
        let request = to_json("request", &ask.request)?;
        let id = sqlx::query_scalar!(
            r#"INSERT INTO evaluations (study, restart, batch, batch_index, request, result_key, created_ms)
               VALUES (?, ?, ?, ?, ?, ?, ?) RETURNING id AS "id!: i64""#,
            owner.study.0,
            owner.restart,
            batch,
            place,
            request,
            ask.key,
            now
        )
        .fetch_one(&mut **tx)
        .await
        .map_err(database(DOING))?;
        if let Some((known, judgement)) = &ask.known {
            let answer = Answered {
                evaluation: EvaluationId(id),
                study: owner.study,
                restart: owner.restart,
                step: owner.step,
                restart_index: owner.restart_index,
                band_of: None,
                guess: false,
                key: &ask.key,
                outcome: &known.outcome,
                judgement,
                cached_from: Some(&known.evaluation),
                worker: known.worker.as_ref().map(|w| w.0.as_str()),
                built: None,
                fence: 0,
                attempt: 0,
            };
            store_answer(tx, answer, now).await?;
        } else {
            sqlx::query!(
                "INSERT INTO queue (evaluation, study, state, command, fence, attempt, place) VALUES (?, ?, 'ready', ?, 0, 0, ?)",
                id,
                owner.study.0,
                ask.command,
                ask.place
            )
            .execute(&mut **tx)
            .await
            .map_err(database(DOING))?;
        }
    }
    Ok(())
}
