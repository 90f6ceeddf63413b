//! Results. A report is written only where its fence still holds; a repeated one is answered the same.

use salp_protocol::{StudyId, StudyState};
use salp_server::machine::Judgement;
use salp_server::store::{AcceptedReport, Reported, RestartId, StoreError};

use crate::SqliteStore;
use crate::claim::exists;
use crate::rows::{Answered, database, end_if_complete, enter_state, now_ms, store_answer};

const DOING: &str = "store a result";

impl SqliteStore {
    /// Stores a report. With `retry_below`, the report was nonsense: as long as fewer attempts were made, the evaluation
    /// goes back into the queue instead.
    pub(crate) async fn store_report(
        &self,
        report: AcceptedReport,
        retry_below: Option<i64>,
    ) -> Result<Reported, StoreError> {
        let mut tx = self.write(DOING).await?;
        let row = sqlx::query!(
            r#"SELECT q.state AS "state!: String", q.fence AS "fence!: i64", q.attempt AS "attempt!: i64",
                      q.study AS "study!: String", s.state AS "study_state!: String",
                      e.restart AS "restart!: i64", e.result_key AS "result_key!: String", e.band_of, e.guess AS "guess!: i64",
                      r.step AS "step!: i64", r.restart_index AS "restart_index!: i64"
               FROM queue q JOIN evaluations e ON e.id = q.evaluation JOIN restarts r ON r.id = e.restart
                    JOIN studies s ON s.id = q.study
               WHERE q.evaluation = ?"#,
            report.evaluation.0
        )
        .fetch_optional(&mut *tx)
        .await
        .map_err(database(DOING))?;
        let Some(row) = row else {
            let answered = sqlx::query!(
                "SELECT status, fence FROM results WHERE evaluation = ?",
                report.evaluation.0
            )
            .fetch_optional(&mut *tx)
            .await
            .map_err(database(DOING))?;
            return Ok(match answered {
                Some(row) if row.fence == report.fence => Reported::Repeated { status: row.status },
                Some(_) => Reported::Stale,
                None if exists(&mut tx, &report.evaluation).await? => Reported::Stale,
                None => Reported::Unknown,
            });
        };
        if row.state != "leased" || row.fence != report.fence {
            return Ok(Reported::Stale);
        }
        let study = StudyId(row.study);
        let cancelling = row.study_state == StudyState::Cancelling.as_str();
        let guess = row.guess != 0;
        if guess && retry_below.is_some() {
            sqlx::query!(
                "DELETE FROM queue WHERE evaluation = ?",
                report.evaluation.0
            )
            .execute(&mut *tx)
            .await
            .map_err(database(DOING))?;
            tx.commit().await.map_err(database(DOING))?;
            return Ok(Reported::PutBack);
        }
        if retry_below.is_some_and(|cap| row.attempt < cap) && !cancelling {
            sqlx::query!(
                "UPDATE queue SET state = 'ready', lease_until_ms = NULL, worker = NULL WHERE evaluation = ?",
                report.evaluation.0
            )
            .execute(&mut *tx)
            .await
            .map_err(database(DOING))?;
            tx.commit().await.map_err(database(DOING))?;
            return Ok(Reported::PutBack);
        }
        let now = now_ms(&mut tx).await?;
        let answer = Answered {
            evaluation: report.evaluation.clone(),
            study: &study,
            restart: row.restart,
            step: row.step,
            restart_index: row.restart_index,
            band_of: row.band_of,
            guess,
            key: &row.result_key,
            outcome: &report.outcome,
            // A guess says what is known, and is no point of the study.
            judgement: if guess {
                &Judgement::WITHOUT_VALUES
            } else {
                &report.judgement
            },
            cached_from: report.cached_from.as_ref(),
            worker: Some(&report.worker.id.0),
            built: Some((&report.worker.build, &report.worker.instruction_set)),
            fence: row.fence,
            attempt: row.attempt,
        };
        store_answer(&mut tx, answer, now).await?;
        sqlx::query!(
            "DELETE FROM queue WHERE evaluation = ?",
            report.evaluation.0
        )
        .execute(&mut *tx)
        .await
        .map_err(database(DOING))?;
        let computed = i64::from(report.cached_from.is_none());
        sqlx::query!(
            "UPDATE workers SET last_seen_ms = ?, evaluations = evaluations + ? WHERE id = ?",
            now,
            computed,
            report.worker.id.0
        )
        .execute(&mut *tx)
        .await
        .map_err(database(DOING))?;
        if cancelling {
            let left = sqlx::query_scalar!(
                r#"SELECT COUNT(*) AS "left!: i64" FROM queue WHERE study = ?"#,
                study.0
            )
            .fetch_one(&mut *tx)
            .await
            .map_err(database(DOING))?;
            if left == 0 {
                enter_state(&mut tx, &study, StudyState::Cancelled, now).await?;
            }
        }
        if row.band_of.is_some() {
            end_if_complete(&mut tx, &study, now).await?;
        }
        tx.commit().await.map_err(database(DOING))?;
        let told = row.band_of.is_none() && !guess;
        Ok(Reported::Stored {
            status: report.outcome.status.name().to_owned(),
            restart: told.then_some(RestartId(row.restart)),
        })
    }
}
