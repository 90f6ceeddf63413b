//! Claim, renewal, release. An evaluation can be claimed when it is ready, or leased and expired; there is no reaper.

use salp_core::study::{Outcome, OutcomeStatus};
use salp_protocol::{Claim, ClaimRequest, EvaluationId, StudyId, StudyState, WorkerId};
use salp_server::machine::Judgement;
use salp_server::store::{ClaimAnswer, Claimed, Held, RestartId, StoreError};

use crate::SqliteStore;
use crate::guess::forget_expired;
use crate::rows::{
    Answered, Tx, database, end_if_complete, enter_state, from_json, now_ms, store_answer,
    study_state,
};

const DOING: &str = "claim an evaluation";

impl SqliteStore {
    pub(crate) async fn claim_evaluation(
        &self,
        request: &ClaimRequest,
        lease_ms: i64,
        attempts: i64,
    ) -> Result<ClaimAnswer, StoreError> {
        if !self.something_waits().await? {
            return Ok(ClaimAnswer {
                claimed: Claimed::Nothing,
                lost: Vec::new(),
            });
        }
        let mut tx = self.write(DOING).await?;
        let now = now_ms(&mut tx).await?;
        forget_expired(&mut tx, now).await?;
        let lost = give_up_on(&mut tx, attempts, now).await?;
        let claimed = if is_draining(&mut tx, request).await? {
            Claimed::Drain
        } else {
            take_best(&mut tx, request, lease_ms, now).await?
        };
        tx.commit().await.map_err(database(DOING))?;
        Ok(ClaimAnswer { claimed, lost })
    }

    /// A read beforehand, so that idle workers take no write lock.
    async fn something_waits(&self) -> Result<bool, StoreError> {
        let waits = sqlx::query_scalar!(
            r#"SELECT (EXISTS (SELECT 1 FROM queue WHERE state = 'ready')
                 OR EXISTS (SELECT 1 FROM queue WHERE state = 'leased'
                            AND lease_until_ms <= CAST(unixepoch('subsec') * 1000 AS INTEGER))
                 OR EXISTS (SELECT 1 FROM workers WHERE draining = 1)) AS "waits!: i64""#
        )
        .fetch_one(&self.readers)
        .await
        .map_err(database(DOING))?;
        Ok(waits != 0)
    }

    pub(crate) async fn renew_lease(
        &self,
        evaluation: &EvaluationId,
        fence: i64,
        lease_ms: i64,
    ) -> Result<Held, StoreError> {
        const DOING: &str = "renew a lease";
        let mut tx = self.write(DOING).await?;
        let row = sqlx::query!(
            r#"SELECT q.state AS "state!: String", q.fence AS "fence!: i64", q.worker,
                      s.state AS "study_state!: String", COALESCE(w.draining, 0) AS "draining!: i64"
               FROM queue q JOIN studies s ON s.id = q.study LEFT JOIN workers w ON w.id = q.worker
               WHERE q.evaluation = ?"#,
            evaluation.0
        )
        .fetch_optional(&mut *tx)
        .await
        .map_err(database(DOING))?;
        let Some(row) = row else {
            return exists(&mut tx, evaluation)
                .await
                .map(|known| if known { Held::Stale } else { Held::Unknown });
        };
        if row.state != "leased" || row.fence != fence {
            return Ok(Held::Stale);
        }
        let now = now_ms(&mut tx).await?;
        let until = now + lease_ms;
        sqlx::query!(
            "UPDATE queue SET lease_until_ms = ? WHERE evaluation = ?",
            until,
            evaluation.0
        )
        .execute(&mut *tx)
        .await
        .map_err(database(DOING))?;
        sqlx::query!(
            "UPDATE workers SET last_seen_ms = ? WHERE id = ?",
            now,
            row.worker
        )
        .execute(&mut *tx)
        .await
        .map_err(database(DOING))?;
        tx.commit().await.map_err(database(DOING))?;
        Ok(Held::Yes {
            state: study_state(&row.study_state)?,
            drain: row.draining != 0,
        })
    }

    pub(crate) async fn release_lease(
        &self,
        evaluation: &EvaluationId,
        fence: i64,
    ) -> Result<bool, StoreError> {
        const DOING: &str = "release a lease";
        let mut tx = self.write(DOING).await?;
        let released = sqlx::query!(
            "UPDATE queue SET state = 'ready', attempt = attempt - 1, lease_until_ms = NULL, worker = NULL
             WHERE evaluation = ? AND fence = ? AND state = 'leased' AND kind <> 'guess'",
            evaluation.0,
            fence
        )
        .execute(&mut *tx)
        .await
        .map_err(database(DOING))?;
        let forgotten = sqlx::query!(
            "DELETE FROM queue WHERE evaluation = ? AND fence = ? AND state = 'leased' AND kind = 'guess'",
            evaluation.0,
            fence
        )
        .execute(&mut *tx)
        .await
        .map_err(database(DOING))?;
        tx.commit().await.map_err(database(DOING))?;
        Ok(released.rows_affected() + forgotten.rows_affected() == 1)
    }

    pub(crate) async fn release_all_leases(&self) -> Result<(), StoreError> {
        const DOING: &str = "release all leases";
        let mut tx = self.write(DOING).await?;
        forget_expired(&mut tx, i64::MAX).await?;
        sqlx::query!(
            "UPDATE queue SET state = 'ready', attempt = attempt - 1, lease_until_ms = NULL, worker = NULL
             WHERE state = 'leased'"
        )
        .execute(&mut *tx)
        .await
        .map_err(database(DOING))?;
        tx.commit().await.map_err(database(DOING))
    }

    pub(crate) async fn drain_worker(&self, worker: &WorkerId) -> Result<bool, StoreError> {
        const DOING: &str = "drain a worker";
        let mut tx = self.write(DOING).await?;
        let told = sqlx::query!("UPDATE workers SET draining = 1 WHERE id = ?", worker.0)
            .execute(&mut *tx)
            .await
            .map_err(database(DOING))?;
        tx.commit().await.map_err(database(DOING))?;
        Ok(told.rows_affected() == 1)
    }
}

/// Whether an evaluation was ever asked for.
pub async fn exists(tx: &mut Tx, evaluation: &EvaluationId) -> Result<bool, StoreError> {
    let count = sqlx::query_scalar!(
        r#"SELECT COUNT(*) AS "count!: i64" FROM evaluations WHERE id = ?"#,
        evaluation.0
    )
    .fetch_one(&mut **tx)
    .await
    .map_err(database("look an evaluation up"))?;
    Ok(count == 1)
}

async fn is_draining(tx: &mut Tx, request: &ClaimRequest) -> Result<bool, StoreError> {
    let draining = sqlx::query_scalar!(
        "SELECT draining FROM workers WHERE id = ?",
        request.worker.id.0
    )
    .fetch_optional(&mut **tx)
    .await
    .map_err(database(DOING))?;
    Ok(draining == Some(1))
}

/// Ends as `lost` what was claimed as often as the cap allows and expired again.
async fn give_up_on(tx: &mut Tx, attempts: i64, now: i64) -> Result<Vec<RestartId>, StoreError> {
    let rows = sqlx::query!(
        r#"SELECT q.evaluation AS "evaluation!: i64", q.study AS "study!: String", q.fence AS "fence!: i64",
                  q.attempt AS "attempt!: i64", q.worker, e.restart AS "restart!: i64",
                  e.result_key AS "result_key!: String", e.band_of, r.step AS "step!: i64",
                  r.restart_index AS "restart_index!: i64"
           FROM queue q JOIN evaluations e ON e.id = q.evaluation JOIN restarts r ON r.id = e.restart
           WHERE q.state = 'leased' AND q.lease_until_ms <= ? AND q.attempt >= ?"#,
        now,
        attempts
    )
    .fetch_all(&mut **tx)
    .await
    .map_err(database(DOING))?;
    let mut lost = Vec::new();
    for row in rows {
        let study = StudyId(row.study);
        let answer = Answered {
            evaluation: EvaluationId(row.evaluation),
            study: &study,
            restart: row.restart,
            step: row.step,
            restart_index: row.restart_index,
            band_of: row.band_of,
            guess: false,
            key: &row.result_key,
            outcome: &Outcome::without_values(OutcomeStatus::Lost),
            judgement: &Judgement::WITHOUT_VALUES,
            cached_from: None,
            worker: row.worker.as_deref(),
            built: None,
            fence: row.fence,
            attempt: row.attempt,
        };
        store_answer(tx, answer, now).await?;
        sqlx::query!("DELETE FROM queue WHERE evaluation = ?", row.evaluation)
            .execute(&mut **tx)
            .await
            .map_err(database(DOING))?;
        if row.band_of.is_some() {
            end_if_complete(tx, &study, now).await?;
        } else {
            lost.push(RestartId(row.restart));
        }
    }
    Ok(lost)
}

async fn take_best(
    tx: &mut Tx,
    request: &ClaimRequest,
    lease_ms: i64,
    now: i64,
) -> Result<Claimed, StoreError> {
    let best = match best_of_kind(tx, request, "optimiser", now).await? {
        Some(best) => Some(best),
        // In a moment it asks for more.
        None if an_optimiser_is_to_step(tx).await? => return Ok(Claimed::Nothing),
        None => match best_of_kind(tx, request, "band", now).await? {
            Some(best) => Some(best),
            None => best_of_kind(tx, request, "guess", now).await?,
        },
    };
    let Some(best) = best else {
        return why_nothing(tx, request, now).await;
    };
    let (build, set) = (&request.worker.build, &request.worker.instruction_set);
    let study = StudyId(best.id);
    let until = now + lease_ms;
    let claim = sqlx::query!(
        r#"UPDATE queue SET state = 'leased', fence = fence + 1, attempt = attempt + 1, lease_until_ms = ?, worker = ?
           WHERE evaluation = ? RETURNING fence AS "fence!: i64", attempt AS "attempt!: i64""#,
        until,
        request.worker.id.0,
        best.next
    )
    .fetch_one(&mut **tx)
    .await
    .map_err(database(DOING))?;
    if study_state(&best.state)? == StudyState::Queued {
        sqlx::query!(
            "UPDATE studies SET build = ?, instruction_set = ?, started_ms = ? WHERE id = ? AND started_ms IS NULL",
            build,
            set,
            now,
            study.0
        )
        .execute(&mut **tx)
        .await
        .map_err(database(DOING))?;
        enter_state(tx, &study, StudyState::Running, now).await?;
    }
    see_worker(tx, request, now).await?;
    let asked = sqlx::query!(
        r#"SELECT e.request AS "request!: String", e.result_key AS "result_key!: String", r.restart_index AS "restart_index!: i64",
                  s.document AS "document!: String"
           FROM evaluations e JOIN restarts r ON r.id = e.restart JOIN studies s ON s.id = e.study WHERE e.id = ?"#,
        best.next
    )
    .fetch_one(&mut **tx)
    .await
    .map_err(database(DOING))?;
    let document = if request.known_studies.contains(&study) {
        None
    } else {
        Some(from_json("study", &asked.document)?)
    };
    let claim = Box::new(Claim {
        evaluation: EvaluationId(best.next),
        fence: claim.fence,
        attempt: claim.attempt,
        lease_s: lease_ms as f64 / 1000.0,
        study,
        restart: asked.restart_index as usize,
        document,
        request: from_json("request", &asked.request)?,
    });
    Ok(Claimed::Work {
        claim,
        key: asked.result_key,
    })
}

/// What may be claimed first.
struct Best {
    id: String,
    state: String,
    next: i64,
}

async fn best_of_kind(
    tx: &mut Tx,
    request: &ClaimRequest,
    kind: &str,
    now: i64,
) -> Result<Option<Best>, StoreError> {
    let commands = i64::from(request.allow_commands);
    // Expired leases come back in the order of place and age like everything else. What is being evaluated as a guess is not
    // begun again: its result will be known.
    sqlx::query_as!(
        Best,
        r#"SELECT id AS "id!: String", state AS "state!: String", next AS "next!: i64" FROM (
               SELECT s.id, s.state, s.priority,
                      (SELECT COUNT(*) FROM queue q WHERE q.study = s.id AND q.state = 'leased' AND q.lease_until_ms > ?1) AS running,
                      (SELECT q.evaluation FROM queue q WHERE q.study = s.id AND q.kind = ?5 AND (q.command = 0 OR ?2)
                           AND (q.state = 'ready' OR (q.state = 'leased' AND q.lease_until_ms <= ?1))
                           AND NOT EXISTS (SELECT 1 FROM queue g JOIN evaluations ge ON ge.id = g.evaluation JOIN evaluations qe ON qe.id = q.evaluation
                                           WHERE g.study = q.study AND g.kind = 'guess' AND g.state = 'leased'
                                             AND ge.id <> qe.id AND ge.result_key = qe.result_key)
                       ORDER BY q.place, q.evaluation LIMIT 1) AS next
               FROM studies s
               WHERE s.state IN ('queued', 'running')
                 AND (s.mixed_hardware OR s.build IS NULL OR (s.build = ?3 AND s.instruction_set = ?4)))
           WHERE next IS NOT NULL ORDER BY priority DESC, running, next LIMIT 1"#,
        now,
        commands,
        request.worker.build,
        request.worker.instruction_set,
        kind
    )
    .fetch_optional(&mut **tx)
    .await
    .map_err(database(DOING))
}

/// Whether bands and guesses wait while a batch is answered whose optimiser has still to be stepped.
async fn an_optimiser_is_to_step(tx: &mut Tx) -> Result<bool, StoreError> {
    let steps = sqlx::query_scalar!(
        r#"SELECT (EXISTS (SELECT 1 FROM queue WHERE kind <> 'optimiser')
             AND EXISTS (SELECT 1 FROM restarts r JOIN studies s ON s.id = r.study
                         WHERE r.state = 'running' AND r.waits = 0 AND s.state IN ('queued', 'running')
                           AND NOT EXISTS (SELECT 1 FROM evaluations e LEFT JOIN results a ON a.evaluation = e.id
                                           WHERE e.restart = r.id AND e.batch = r.batch AND a.evaluation IS NULL))) AS "steps!: i64""#
    )
    .fetch_one(&mut **tx)
    .await
    .map_err(database(DOING))?;
    Ok(steps != 0)
}

/// Tells a worker that gets nothing whether something waits for others.
async fn why_nothing(tx: &mut Tx, request: &ClaimRequest, now: i64) -> Result<Claimed, StoreError> {
    let waiting = sqlx::query!(
        r#"SELECT s.id AS "id!: String", s.build, s.instruction_set,
                  s.mixed_hardware AS "mixed_hardware!: i64", MIN(q.command) AS "command!: i64"
           FROM queue q JOIN studies s ON s.id = q.study
           WHERE s.state IN ('queued', 'running')
             AND (q.state = 'ready' OR (q.state = 'leased' AND q.lease_until_ms <= ?))
             AND NOT EXISTS (SELECT 1 FROM queue g JOIN evaluations ge ON ge.id = g.evaluation JOIN evaluations qe ON qe.id = q.evaluation
                             WHERE g.study = q.study AND g.kind = 'guess' AND g.state = 'leased'
                               AND ge.id <> qe.id AND ge.result_key = qe.result_key)
           GROUP BY s.id ORDER BY s.number LIMIT 1"#,
        now
    )
    .fetch_optional(&mut **tx)
    .await
    .map_err(database(DOING))?;
    let Some(waiting) = waiting else {
        return Ok(Claimed::Nothing);
    };
    let study = StudyId(waiting.id);
    if waiting.command != 0 && !request.allow_commands {
        return Ok(Claimed::CommandsNotAllowed { study });
    }
    Ok(match (waiting.build, waiting.instruction_set) {
        (Some(build), Some(instruction_set)) => Claimed::Mismatch {
            build,
            instruction_set,
            study,
        },
        _ => Claimed::Nothing,
    })
}

async fn see_worker(tx: &mut Tx, request: &ClaimRequest, now: i64) -> Result<(), StoreError> {
    let worker = &request.worker;
    let pid = i64::from(worker.pid);
    sqlx::query!(
        "INSERT INTO workers (id, host, pid, build, instruction_set, first_seen_ms, last_seen_ms, evaluations)
         VALUES (?, ?, ?, ?, ?, ?, ?, 0) ON CONFLICT (id) DO UPDATE SET last_seen_ms = excluded.last_seen_ms",
        worker.id.0,
        worker.host,
        pid,
        worker.build,
        worker.instruction_set,
        now,
        now
    )
    .execute(&mut **tx)
    .await
    .map_err(database(DOING))?;
    Ok(())
}
