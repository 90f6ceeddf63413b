//! The optimiser's steps, and what a crash left behind.

use salp_protocol::{EvaluationId, StepState, StudyId, StudyState, WorkerId};
use salp_server::store::{Batch, KnownResult, NewStep, RestartId, Saved, StoreError};
use serde_json::json;

use crate::SqliteStore;
use crate::guess::replace_guesses;
use crate::rows::{
    Tx, database, enter_state, from_json, note, now_ms, queue_band, study_state, to_json,
};
use crate::submit::{Owner, insert_asks};

impl SqliteStore {
    pub(crate) async fn complete_batch(
        &self,
        restart: RestartId,
    ) -> Result<Option<Batch>, StoreError> {
        const DOING: &str = "read a batch";
        let mut tx = self.snapshot(DOING).await?;
        let row = sqlx::query!(
            r#"SELECT r.study AS "study!: String", r.step AS "step!: i64", r.restart_index AS "restart_index!: i64",
                      r.version AS "version!: i64", r.batch AS "batch!: i64", r.machine AS "machine!: String",
                      s.mixed_hardware AS "mixed_hardware!: i64", s.build, s.instruction_set
               FROM restarts r JOIN studies s ON s.id = r.study
               WHERE r.id = ? AND r.state = 'running' AND r.waits = 0 AND s.state IN ('queued', 'running', 'paused')"#,
            restart.0
        )
        .fetch_optional(&mut *tx)
        .await
        .map_err(database(DOING))?;
        let Some(row) = row else { return Ok(None) };
        let answers = sqlx::query_scalar!(
            r#"SELECT r.outcome AS "outcome?: String"
               FROM evaluations e LEFT JOIN results r ON r.evaluation = e.id
               WHERE e.restart = ? AND e.batch = ? ORDER BY e.batch_index"#,
            restart.0,
            row.batch
        )
        .fetch_all(&mut *tx)
        .await
        .map_err(database(DOING))?;
        let Some(answers) = answers.into_iter().collect::<Option<Vec<_>>>() else {
            return Ok(None);
        };
        let outcomes = answers
            .iter()
            .map(|text| from_json("outcome", text))
            .collect::<Result<_, _>>()?;
        Ok(Some(Batch {
            restart,
            study: StudyId(row.study),
            step: row.step as usize,
            index: row.restart_index as usize,
            version: row.version,
            machine: from_json("optimiser state", &row.machine)?,
            outcomes,
            bound_to: if row.mixed_hardware == 0 {
                row.build.zip(row.instruction_set)
            } else {
                None
            },
        }))
    }

    pub(crate) async fn save_computed_step(&self, step: NewStep) -> Result<Saved, StoreError> {
        const DOING: &str = "save a step";
        let machine = to_json("optimiser state", &step.machine)?;
        let summary = to_json("restart summary", &step.summary)?;
        let state = if step.done { "done" } else { "running" };
        let mut tx = self.write(DOING).await?;
        let now = now_ms(&mut tx).await?;
        let ended = step.done.then_some(now);
        let row = sqlx::query!(
            r#"UPDATE restarts SET machine = ?, summary = ?, state = ?, ended_ms = ?, waits = ?,
                   version = version + 1, batch = batch + 1
               WHERE id = ? AND version = ? AND state = 'running'
                 AND (SELECT s.state FROM studies s WHERE s.id = restarts.study) IN ('queued', 'running', 'paused')
               RETURNING study AS "study!: String", step AS "step!: i64",
                   restart_index AS "restart_index!: i64", batch AS "batch!: i64""#,
            machine,
            summary,
            state,
            ended,
            step.waits,
            step.restart.0,
            step.version
        )
        .fetch_optional(&mut *tx)
        .await
        .map_err(database(DOING))?;
        let Some(row) = row else {
            return Ok(Saved::Discarded);
        };
        let study = StudyId(row.study);
        let owner = Owner {
            study: &study,
            restart: step.restart.0,
            step: row.step,
            restart_index: row.restart_index,
        };
        insert_asks(&mut tx, &owner, row.batch, step.asks, now).await?;
        replace_guesses(&mut tx, &owner, row.batch, step.guesses, now).await?;
        for (place, band) in &step.bands {
            if let Some(of) = without_band(&mut tx, step.restart, *place).await? {
                queue_band(&mut tx, &study, step.restart.0, of, band, now).await?;
            }
        }
        if step.waits {
            let data =
                json!({ "step": row.step, "restart": row.restart_index, "state": "waiting" });
            note(&mut tx, &study, "restart", &data, now).await?;
        }
        let mut step_ended = false;
        if step.done {
            let data = json!({ "step": row.step, "restart": row.restart_index, "state": "done", "summary": step.summary });
            note(&mut tx, &study, "restart", &data, now).await?;
            let running = sqlx::query_scalar!(
                r#"SELECT COUNT(*) AS "running!: i64" FROM restarts WHERE study = ? AND step = ? AND state = 'running'"#,
                study.0,
                row.step
            )
            .fetch_one(&mut *tx)
            .await
            .map_err(database(DOING))?;
            step_ended = running == 0;
        }
        tx.commit().await.map_err(database(DOING))?;
        Ok(Saved::Yes { step_ended })
    }

    pub(crate) async fn idle_restart(
        &self,
        restart: RestartId,
    ) -> Result<Option<Batch>, StoreError> {
        let row = sqlx::query!(
            r#"SELECT r.study AS "study!: String", r.step AS "step!: i64", r.restart_index AS "restart_index!: i64",
                      r.version AS "version!: i64", r.machine AS "machine!: String",
                      s.mixed_hardware AS "mixed_hardware!: i64", s.build, s.instruction_set
               FROM restarts r JOIN studies s ON s.id = r.study
               WHERE r.id = ? AND (r.waits = 1 OR r.state = 'done')"#,
            restart.0
        )
        .fetch_optional(&self.readers)
        .await
        .map_err(database("read a restart"))?;
        let Some(row) = row else { return Ok(None) };
        Ok(Some(Batch {
            restart,
            study: StudyId(row.study),
            step: row.step as usize,
            index: row.restart_index as usize,
            version: row.version,
            machine: from_json("optimiser state", &row.machine)?,
            outcomes: Vec::new(),
            bound_to: if row.mixed_hardware == 0 {
                row.build.zip(row.instruction_set)
            } else {
                None
            },
        }))
    }

    pub(crate) async fn reopen_restart(
        &self,
        step: NewStep,
        untouched: &[usize],
    ) -> Result<bool, StoreError> {
        const DOING: &str = "bring a restart back";
        let machine = to_json("optimiser state", &step.machine)?;
        let summary = to_json("restart summary", &step.summary)?;
        let state = if step.done { "done" } else { "running" };
        let mut tx = self.write(DOING).await?;
        let now = now_ms(&mut tx).await?;
        let ended = step.done.then_some(now);
        let row = sqlx::query!(
            r#"UPDATE restarts SET machine = ?, summary = ?, state = ?, ended_ms = ?, waits = ?,
                   version = version + 1, batch = batch + 1
               WHERE id = ? AND version = ? AND state = 'done'
                 AND (SELECT s.state FROM studies s WHERE s.id = restarts.study) IN ('queued', 'running', 'paused', 'done')
               RETURNING study AS "study!: String", step AS "step!: i64",
                   restart_index AS "restart_index!: i64", batch AS "batch!: i64",
                   (SELECT s.state FROM studies s WHERE s.id = restarts.study) AS "study_state!: String""#,
            machine,
            summary,
            state,
            ended,
            step.waits,
            step.restart.0,
            step.version
        )
        .fetch_optional(&mut *tx)
        .await
        .map_err(database(DOING))?;
        let Some(row) = row else { return Ok(false) };
        let study = StudyId(row.study);
        for other in untouched {
            let other = *other as i64;
            let begun = sqlx::query_scalar!(
                r#"SELECT COUNT(*) AS "begun!: i64" FROM steps WHERE study = ? AND step = ? AND state <> 'waiting'"#,
                study.0,
                other
            )
            .fetch_one(&mut *tx)
            .await
            .map_err(database(DOING))?;
            // Nothing is committed.
            if begun > 0 {
                return Ok(false);
            }
        }
        let reopened = sqlx::query!(
            "UPDATE steps SET state = 'running', result = NULL, ended_ms = NULL
             WHERE study = ? AND step = ? AND state = 'done'",
            study.0,
            row.step
        )
        .execute(&mut *tx)
        .await
        .map_err(database(DOING))?;
        let data = json!({ "step": row.step, "restart": row.restart_index, "state": state, "resumed": true,
            "summary": step.summary });
        note(&mut tx, &study, "restart", &data, now).await?;
        if reopened.rows_affected() > 0 {
            let data = json!({ "step": row.step, "state": StepState::Running });
            note(&mut tx, &study, "step", &data, now).await?;
        }
        if study_state(&row.study_state)? == StudyState::Done {
            enter_state(&mut tx, &study, StudyState::Running, now).await?;
        }
        let owner = Owner {
            study: &study,
            restart: step.restart.0,
            step: row.step,
            restart_index: row.restart_index,
        };
        insert_asks(&mut tx, &owner, row.batch, step.asks, now).await?;
        replace_guesses(&mut tx, &owner, row.batch, step.guesses, now).await?;
        tx.commit().await.map_err(database(DOING))?;
        Ok(true)
    }

    pub(crate) async fn known_results(
        &self,
        keys: &[String],
        bound_to: &(String, String),
        study: Option<&StudyId>,
    ) -> Result<Vec<Option<KnownResult>>, StoreError> {
        const DOING: &str = "look known results up";
        let mut tx = self.snapshot(DOING).await?;
        let study = study.map(|s| s.0.as_str());
        let mut known = Vec::with_capacity(keys.len());
        for key in keys {
            // Failures that may be chance (a program, a lost worker, a fault of ours) are tried anew.
            let row = sqlx::query!(
                r#"SELECT evaluation AS "evaluation!: i64", outcome AS "outcome!: String", worker
                   FROM results
                   WHERE result_key = ?1 AND cached_from IS NULL AND build = ?2 AND instruction_set = ?3
                     AND status IN ('ok', 'infeasible_geometry', 'no_equilibrium', 'no_margin', 'not_unique', 'work_limit')
                     AND (?4 IS NULL OR study = ?4)
                   ORDER BY evaluation LIMIT 1"#,
                key,
                bound_to.0,
                bound_to.1,
                study
            )
            .fetch_optional(&mut *tx)
            .await
            .map_err(database(DOING))?;
            known.push(match row {
                None => None,
                Some(row) => Some(KnownResult {
                    evaluation: EvaluationId(row.evaluation),
                    outcome: from_json("outcome", &row.outcome)?,
                    worker: row.worker.map(WorkerId),
                }),
            });
        }
        Ok(known)
    }

    pub(crate) async fn unstepped_restarts(&self) -> Result<Vec<RestartId>, StoreError> {
        let ids = sqlx::query_scalar!(
            r#"SELECT r.id AS "id!: i64" FROM restarts r JOIN studies s ON s.id = r.study
               WHERE r.state = 'running' AND r.waits = 0 AND s.state IN ('queued', 'running', 'paused')
                 AND NOT EXISTS (SELECT 1 FROM evaluations e LEFT JOIN results a ON a.evaluation = e.id
                                 WHERE e.restart = r.id AND e.batch = r.batch AND a.evaluation IS NULL)
               ORDER BY r.id"#
        )
        .fetch_all(&self.readers)
        .await
        .map_err(database("look for unfinished steps"))?;
        Ok(ids.into_iter().map(RestartId).collect())
    }

    pub(crate) async fn studies_under_way(&self) -> Result<Vec<StudyId>, StoreError> {
        let ids = sqlx::query_scalar!(
            "SELECT id FROM studies WHERE state IN ('queued', 'running', 'paused') ORDER BY number"
        )
        .fetch_all(&self.readers)
        .await
        .map_err(database("look for unfinished studies"))?;
        Ok(ids.into_iter().map(StudyId).collect())
    }
}

/// The evaluation at a place of a restart's history, if no band of it was asked for.
async fn without_band(
    tx: &mut Tx,
    restart: RestartId,
    place: usize,
) -> Result<Option<i64>, StoreError> {
    let place = place as i64;
    sqlx::query_scalar!(
        r#"SELECT of.id AS "id!: i64"
           FROM (SELECT id FROM evaluations WHERE restart = ? AND band_of IS NULL AND guess = 0
                 ORDER BY batch, batch_index LIMIT 1 OFFSET ?) AS of
           WHERE NOT EXISTS (SELECT 1 FROM evaluations band WHERE band.band_of = of.id)"#,
        restart.0,
        place
    )
    .fetch_optional(&mut **tx)
    .await
    .map_err(database("look for an evaluation without a band"))
}
