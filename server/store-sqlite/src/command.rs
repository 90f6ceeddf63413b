//! Cancel, pause, resume, and the end of a study.

use salp_protocol::{StudyId, StudyState};
use salp_server::store::{Command, Commanded, StoreError};

use crate::SqliteStore;
use crate::rows::{Tx, database, end_if_complete, enter_state, now_ms, study_state};

const DOING: &str = "change a study's state";

impl SqliteStore {
    pub(crate) async fn obey(
        &self,
        study: &StudyId,
        command: Command,
    ) -> Result<Commanded, StoreError> {
        use StudyState::{Cancelled, Cancelling, Paused, Queued, Running};
        let mut tx = self.write(DOING).await?;
        let Some(now_in) = state_of(&mut tx, study).await? else {
            return Ok(Commanded::Unknown);
        };
        let now = now_ms(&mut tx).await?;
        let next = match (command, now_in) {
            (Command::Cancel, Queued | Running | Paused) => {
                let left = withdraw(&mut tx, study, now).await?;
                if left == 0 { Cancelled } else { Cancelling }
            }
            (Command::Cancel, Cancelling | Cancelled)
            | (Command::Pause, Paused)
            | (Command::Resume, Queued | Running) => return Ok(Commanded::Now(now_in)),
            (Command::Pause, Queued | Running) => Paused,
            (Command::Resume, Paused) => {
                let row = sqlx::query!("SELECT started_ms FROM studies WHERE id = ?", study.0)
                    .fetch_one(&mut *tx)
                    .await
                    .map_err(database(DOING))?;
                if row.started_ms.is_some() {
                    Running
                } else {
                    Queued
                }
            }
            _ => return Ok(Commanded::Refused(now_in)),
        };
        enter_state(&mut tx, study, next, now).await?;
        tx.commit().await.map_err(database(DOING))?;
        Ok(Commanded::Now(next))
    }

    pub(crate) async fn settle_cancellation(
        &self,
        study: &StudyId,
    ) -> Result<StudyState, StoreError> {
        let mut tx = self.write(DOING).await?;
        let Some(state) = state_of(&mut tx, study).await? else {
            return Ok(StudyState::Cancelled);
        };
        if state != StudyState::Cancelling {
            return Ok(state);
        }
        let now = now_ms(&mut tx).await?;
        if withdraw(&mut tx, study, now).await? > 0 {
            return Ok(state);
        }
        enter_state(&mut tx, study, StudyState::Cancelled, now).await?;
        tx.commit().await.map_err(database(DOING))?;
        Ok(StudyState::Cancelled)
    }

    pub(crate) async fn finish_study(&self, study: &StudyId) -> Result<(), StoreError> {
        let mut tx = self.write(DOING).await?;
        let now = now_ms(&mut tx).await?;
        end_if_complete(&mut tx, study, now).await?;
        tx.commit().await.map_err(database(DOING))
    }

    pub(crate) async fn fail_study(
        &self,
        study: &StudyId,
        failure: &str,
    ) -> Result<(), StoreError> {
        let mut tx = self.write(DOING).await?;
        let under_way = state_of(&mut tx, study)
            .await?
            .is_some_and(|state| !state.is_final());
        if under_way {
            let now = now_ms(&mut tx).await?;
            sqlx::query!("DELETE FROM queue WHERE study = ?", study.0)
                .execute(&mut *tx)
                .await
                .map_err(database(DOING))?;
            sqlx::query!(
                "UPDATE studies SET failure = ? WHERE id = ?",
                failure,
                study.0
            )
            .execute(&mut *tx)
            .await
            .map_err(database(DOING))?;
            enter_state(&mut tx, study, StudyState::Failed, now).await?;
        }
        tx.commit().await.map_err(database(DOING))
    }

    pub(crate) async fn cancelling_studies(&self) -> Result<Vec<StudyId>, StoreError> {
        let ids = sqlx::query_scalar!("SELECT id FROM studies WHERE state = 'cancelling'")
            .fetch_all(&self.readers)
            .await
            .map_err(database("look for studies that are being cancelled"))?;
        Ok(ids.into_iter().map(StudyId).collect())
    }
}

async fn state_of(tx: &mut Tx, study: &StudyId) -> Result<Option<StudyState>, StoreError> {
    sqlx::query_scalar!("SELECT state FROM studies WHERE id = ?", study.0)
        .fetch_optional(&mut **tx)
        .await
        .map_err(database(DOING))?
        .map(|word| study_state(&word))
        .transpose()
}

/// Takes out of the queue what no living worker holds, and all guesses; the number that is left.
async fn withdraw(tx: &mut Tx, study: &StudyId, now: i64) -> Result<i64, StoreError> {
    sqlx::query!(
        "DELETE FROM queue WHERE study = ? AND (state = 'ready' OR kind = 'guess' OR lease_until_ms <= ?)",
        study.0,
        now
    )
    .execute(&mut **tx)
    .await
    .map_err(database(DOING))?;
    sqlx::query_scalar!(
        r#"SELECT COUNT(*) AS "left!: i64" FROM queue WHERE study = ?"#,
        study.0
    )
    .fetch_one(&mut **tx)
    .await
    .map_err(database(DOING))
}
