//! The steps of a study: what each took, what it hands on, which were given up.

use salp_protocol::{StepState, StudyId};
use salp_server::store::{StoreError, StoredStep};
use serde_json::{Value, json};

use crate::SqliteStore;
use crate::rows::{database, from_json, note, now_ms, to_json};

impl SqliteStore {
    pub(crate) async fn read_steps(&self, study: &StudyId) -> Result<Vec<StoredStep>, StoreError> {
        let rows = sqlx::query!(
            "SELECT step, state, inputs, result, began_ms, ended_ms FROM steps WHERE study = ? ORDER BY step",
            study.0
        )
        .fetch_all(&self.readers)
        .await
        .map_err(database("read the steps of a study"))?;
        rows.into_iter()
            .map(|row| {
                let json = |text: Option<String>| text.map(|text| from_json("step", &text));
                Ok(StoredStep {
                    step: row.step as usize,
                    state: StepState::parse(&row.state).ok_or(StoreError::UnknownWord {
                        what: "state of a step",
                        found: row.state,
                    })?,
                    inputs: json(row.inputs).transpose()?,
                    result: json(row.result).transpose()?,
                    began_ms: row.began_ms,
                    ended_ms: row.ended_ms,
                })
            })
            .collect()
    }

    pub(crate) async fn read_ended_restarts(
        &self,
        study: &StudyId,
        step: usize,
    ) -> Result<Option<Vec<(usize, Value)>>, StoreError> {
        let step = step as i64;
        let rows = sqlx::query!(
            "SELECT restart_index, state, machine FROM restarts WHERE study = ? AND step = ? ORDER BY restart_index",
            study.0,
            step
        )
        .fetch_all(&self.readers)
        .await
        .map_err(database("read the restarts of a step"))?;
        if rows.iter().any(|row| row.state == "running") {
            return Ok(None);
        }
        let restart = |machine: &str| from_json("optimiser state", machine);
        rows.iter()
            .map(|row| Ok((row.restart_index as usize, restart(&row.machine)?)))
            .collect::<Result<_, _>>()
            .map(Some)
    }

    pub(crate) async fn end_running_step(
        &self,
        study: &StudyId,
        step: usize,
        result: &Value,
    ) -> Result<bool, StoreError> {
        const DOING: &str = "end a step";
        let result = to_json("result of a step", result)?;
        let step = step as i64;
        let mut tx = self.write(DOING).await?;
        let now = now_ms(&mut tx).await?;
        let moved = sqlx::query!(
            "UPDATE steps SET state = 'done', result = ?1, ended_ms = ?2
             WHERE study = ?3 AND step = ?4 AND state = 'running'
               AND (SELECT s.state FROM studies s WHERE s.id = ?3) IN ('queued', 'running', 'paused')
               AND NOT EXISTS (SELECT 1 FROM restarts WHERE study = ?3 AND step = ?4 AND state = 'running')",
            result,
            now,
            study.0,
            step
        )
        .execute(&mut *tx)
        .await
        .map_err(database(DOING))?;
        if moved.rows_affected() == 0 {
            return Ok(false);
        }
        let data = json!({ "step": step, "state": "done" });
        note(&mut tx, study, "step", &data, now).await?;
        tx.commit().await.map_err(database(DOING))?;
        Ok(true)
    }

    pub(crate) async fn block_waiting_step(
        &self,
        study: &StudyId,
        step: usize,
        reason: &str,
    ) -> Result<bool, StoreError> {
        const DOING: &str = "give up a step";
        let data = json!({ "step": step, "state": "blocked", "reason": reason });
        let result = to_json("reason of a step", &json!({ "reason": reason }))?;
        let step = step as i64;
        let mut tx = self.write(DOING).await?;
        let now = now_ms(&mut tx).await?;
        let moved = sqlx::query!(
            "UPDATE steps SET state = 'blocked', result = ?1, ended_ms = ?2
             WHERE study = ?3 AND step = ?4 AND state = 'waiting'
               AND (SELECT s.state FROM studies s WHERE s.id = ?3) IN ('queued', 'running', 'paused')",
            result,
            now,
            study.0,
            step
        )
        .execute(&mut *tx)
        .await
        .map_err(database(DOING))?;
        if moved.rows_affected() == 0 {
            return Ok(false);
        }
        note(&mut tx, study, "step", &data, now).await?;
        tx.commit().await.map_err(database(DOING))?;
        Ok(true)
    }
}
