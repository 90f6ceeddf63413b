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
        let change = Change {
            from: StepState::Running,
            to: StepState::Done,
            result,
            doing: "end a step",
        };
        self.end(study, step, change).await
    }

    pub(crate) async fn block_waiting_step(
        &self,
        study: &StudyId,
        step: usize,
        reason: &str,
    ) -> Result<bool, StoreError> {
        let change = Change {
            from: StepState::Waiting,
            to: StepState::Blocked,
            result: &json!({ "reason": reason }),
            doing: "give up a step",
        };
        self.end(study, step, change).await
    }

    /// Ends a step of a study under way, if it is in the state from which it is to leave and none of its restarts runs: one that
    /// waits has none.
    async fn end(
        &self,
        study: &StudyId,
        step: usize,
        change: Change<'_>,
    ) -> Result<bool, StoreError> {
        let Change {
            from, to, doing, ..
        } = change;
        let mut data = json!({ "step": step, "state": to });
        if to == StepState::Blocked {
            data["reason"] = change.result["reason"].clone();
        }
        let result = to_json("result of a step", change.result)?;
        let (from, to, step) = (from.as_str(), to.as_str(), step as i64);
        let mut tx = self.write(doing).await?;
        let now = now_ms(&mut tx).await?;
        let moved = sqlx::query!(
            "UPDATE steps SET state = ?1, result = ?2, ended_ms = ?3
             WHERE study = ?4 AND step = ?5 AND state = ?6
               AND (SELECT s.state FROM studies s WHERE s.id = ?4) IN ('queued', 'running', 'paused')
               AND NOT EXISTS (SELECT 1 FROM restarts WHERE study = ?4 AND step = ?5 AND state = 'running')",
            to,
            result,
            now,
            study.0,
            step,
            from
        )
        .execute(&mut *tx)
        .await
        .map_err(database(doing))?;
        if moved.rows_affected() == 0 {
            return Ok(false);
        }
        note(&mut tx, study, "step", &data, now).await?;
        tx.commit().await.map_err(database(doing))?;
        Ok(true)
    }
}

/// The end of a step.
struct Change<'a> {
    from: StepState,
    to: StepState,
    result: &'a Value,
    doing: &'static str,
}
