//! Reads of studies, restarts, best points, events and workers.

use salp_protocol::{
    BandCounts, Counts, EvaluationId, Event, GuessCounts, StudyId, StudyState, WorkerId,
    WorkerIdentity, WorkerView,
};
use salp_server::store::{
    Asked, RestartId, StoreError, StoredBest, StoredPoint, StoredRestart, StoredStudy,
};
use serde_json::Value;

use crate::SqliteStore;
use crate::rows::{database, from_json, study_state};

const STUDY: &str = "read a study";

impl SqliteStore {
    pub(crate) async fn read_document(&self, study: &StudyId) -> Result<Option<Value>, StoreError> {
        sqlx::query_scalar!("SELECT document FROM studies WHERE id = ?", study.0)
            .fetch_optional(&self.readers)
            .await
            .map_err(database(STUDY))?
            .map(|text| from_json("study", &text))
            .transpose()
    }

    pub(crate) async fn read_study(
        &self,
        study: &StudyId,
    ) -> Result<Option<StoredStudy>, StoreError> {
        let number = sqlx::query_scalar!(
            r#"SELECT number AS "number!: i64" FROM studies WHERE id = ?"#,
            study.0
        )
        .fetch_optional(&self.readers)
        .await
        .map_err(database(STUDY))?;
        let Some(number) = number else {
            return Ok(None);
        };
        let page = self.read_studies(Some(number + 1), None, 1).await?;
        Ok(page.into_iter().next())
    }

    pub(crate) async fn read_studies(
        &self,
        before: Option<i64>,
        state: Option<StudyState>,
        limit: i64,
    ) -> Result<Vec<StoredStudy>, StoreError> {
        let before = before.unwrap_or(i64::MAX);
        let state = state.map(StudyState::as_str);
        let rows = sqlx::query!(
            r#"SELECT number AS "number!: i64", id, name, state, failure, fingerprint, created_ms, started_ms, ended_ms
               FROM studies WHERE number < ?1 AND (?2 IS NULL OR state = ?2) ORDER BY number DESC LIMIT ?3"#,
            before,
            state,
            limit
        )
        .fetch_all(&self.readers)
        .await
        .map_err(database(STUDY))?;
        rows.into_iter()
            .map(|row| {
                Ok(StoredStudy {
                    number: row.number,
                    id: StudyId(row.id),
                    name: row.name,
                    state: study_state(&row.state)?,
                    failure: row.failure,
                    fingerprint: row.fingerprint,
                    created_ms: row.created_ms,
                    started_ms: row.started_ms,
                    ended_ms: row.ended_ms,
                })
            })
            .collect()
    }

    pub(crate) async fn read_counts(&self, study: &StudyId) -> Result<Counts, StoreError> {
        let row = sqlx::query!(
            r#"SELECT (SELECT COUNT(*) FROM restarts WHERE study = ?1) AS "restarts!: i64",
                      (SELECT COUNT(*) FROM restarts WHERE study = ?1 AND state = 'done') AS "restarts_done!: i64",
                      COUNT(*) FILTER (WHERE e.batch >= 0) AS "evaluations!: i64",
                      COUNT(a.status) FILTER (WHERE e.batch >= 0) AS "answered!: i64",
                      COUNT(*) FILTER (WHERE e.batch >= 0 AND q.state = 'ready') AS "ready!: i64",
                      COUNT(*) FILTER (WHERE e.batch >= 0 AND q.state = 'leased') AS "leased!: i64",
                      COUNT(*) FILTER (WHERE e.batch >= 0 AND a.status <> 'ok') AS "without_values!: i64",
                      COUNT(*) FILTER (WHERE e.batch >= 0
                           AND a.status IN ('not_converged', 'invalid_result', 'lost')) AS "alarms!: i64",
                      COUNT(*) FILTER (WHERE e.band_of IS NOT NULL) AS "bands!: i64",
                      COUNT(a.status) FILTER (WHERE e.band_of IS NOT NULL) AS "bands_answered!: i64",
                      COUNT(*) FILTER (WHERE e.band_of IS NOT NULL AND a.status <> 'ok') AS "bands_without_values!: i64",
                      COALESCE(SUM(a.cpu_s) FILTER (WHERE e.band_of IS NOT NULL AND a.cached_from IS NULL), 0.0) AS "bands_cpu_s!: f64",
                      COUNT(a.status) FILTER (WHERE e.guess = 1) AS "guesses!: i64",
                      (SELECT COUNT(DISTINCT u.cached_from) FROM results u JOIN evaluations g ON g.id = u.cached_from
                       WHERE u.study = ?1 AND g.guess = 1) AS "guesses_used!: i64",
                      COALESCE(SUM(a.cpu_s) FILTER (WHERE e.guess = 1 AND a.cached_from IS NULL), 0.0) AS "guesses_cpu_s!: f64"
               FROM evaluations e LEFT JOIN results a ON a.evaluation = e.id LEFT JOIN queue q ON q.evaluation = e.id
               WHERE e.study = ?1"#,
            study.0
        )
        .fetch_one(&self.readers)
        .await
        .map_err(database("count a study"))?;
        Ok(Counts {
            restarts: row.restarts as u64,
            restarts_done: row.restarts_done as u64,
            evaluations: row.evaluations as u64,
            answered: row.answered as u64,
            ready: row.ready as u64,
            leased: row.leased as u64,
            without_values: row.without_values as u64,
            alarms: row.alarms as u64,
            bands: BandCounts {
                evaluations: row.bands as u64,
                answered: row.bands_answered as u64,
                without_values: row.bands_without_values as u64,
                cpu_s: row.bands_cpu_s,
            },
            guesses: GuessCounts {
                answered: row.guesses as u64,
                used: row.guesses_used as u64,
                cpu_s: row.guesses_cpu_s,
            },
        })
    }

    pub(crate) async fn read_restarts(
        &self,
        study: &StudyId,
    ) -> Result<Vec<StoredRestart>, StoreError> {
        let rows = sqlx::query!(
            r#"SELECT id AS "id!: i64", step, restart_index, state, waits, version, summary
               FROM restarts WHERE study = ? ORDER BY step, restart_index"#,
            study.0
        )
        .fetch_all(&self.readers)
        .await
        .map_err(database("read restarts"))?;
        rows.into_iter()
            .map(|row| {
                Ok(StoredRestart {
                    id: RestartId(row.id),
                    step: row.step as usize,
                    index: row.restart_index as usize,
                    done: row.state == "done",
                    waits: row.waits != 0,
                    version: row.version,
                    summary: from_json("restart summary", &row.summary)?,
                })
            })
            .collect()
    }

    pub(crate) async fn read_bests(&self, study: &StudyId) -> Result<Vec<StoredBest>, StoreError> {
        let rows = sqlx::query!(
            r#"SELECT evaluation AS "evaluation!: i64", step AS "step!: i64", restart_index AS "restart_index!: i64",
                      request AS "request!: String", outcome AS "outcome!: String", max_violation AS "max_violation!: f64"
               FROM (SELECT a.evaluation, r.step, r.restart_index, e.request, a.outcome, a.max_violation,
                            ROW_NUMBER() OVER (PARTITION BY e.restart ORDER BY a.objective, e.batch, e.batch_index) AS place
                     FROM results a JOIN evaluations e ON e.id = a.evaluation JOIN restarts r ON r.id = e.restart
                     WHERE a.study = ? AND a.counts = 1 AND a.objective IS NOT NULL
                       AND a.max_violation IS NOT NULL)
               WHERE place = 1 ORDER BY step, restart_index"#,
            study.0
        )
        .fetch_all(&self.readers)
        .await
        .map_err(database("read best points"))?;
        rows.into_iter()
            .map(|row| {
                Ok(StoredBest {
                    step: row.step as usize,
                    restart: row.restart_index as usize,
                    evaluation: EvaluationId(row.evaluation),
                    request: from_json("request", &row.request)?,
                    outcome: from_json("outcome", &row.outcome)?,
                    max_violation: row.max_violation,
                })
            })
            .collect()
    }

    pub(crate) async fn read_points(
        &self,
        study: &StudyId,
    ) -> Result<Vec<StoredPoint>, StoreError> {
        let rows = sqlx::query!(
            r#"SELECT a.evaluation AS "evaluation!: i64", r.step AS "step!: i64", r.restart_index AS "restart_index!: i64",
                      a.objective, a.max_violation, a.feasible AS "feasible!: i64", a.overlap AS "overlap!: i64",
                      a.counts AS "counts!: i64",
                      json_extract(e.request, '$.fidelity') IS NOT NULL AS "coarse!: i64",
                      a.cpu_s AS "cpu_s!: f64", a.finished_ms AS "finished_ms!: i64",
                      (SELECT b.objective FROM evaluations of JOIN results b ON b.evaluation = of.id
                       WHERE of.band_of = e.id) AS "second_mesh?: f64"
               FROM results a JOIN evaluations e ON e.id = a.evaluation JOIN restarts r ON r.id = e.restart
               WHERE a.study = ? AND e.batch >= 0 ORDER BY r.step, r.restart_index, e.batch, e.batch_index"#,
            study.0
        )
        .fetch_all(&self.readers)
        .await
        .map_err(database("read a curve"))?;
        Ok(rows
            .into_iter()
            .map(|row| StoredPoint {
                step: row.step as usize,
                restart: row.restart_index as usize,
                evaluation: EvaluationId(row.evaluation),
                objective: row.objective,
                max_violation: row.max_violation,
                feasible: row.feasible != 0,
                overlap: row.overlap != 0,
                counts: row.counts != 0,
                cpu_s: row.cpu_s,
                finished_ms: row.finished_ms,
                coarse: row.coarse != 0,
                second_mesh: row.second_mesh,
            })
            .collect())
    }

    pub(crate) async fn read_asked(
        &self,
        evaluation: &EvaluationId,
    ) -> Result<Option<Asked>, StoreError> {
        sqlx::query!(
            "SELECT study, request FROM evaluations WHERE id = ?",
            evaluation.0
        )
        .fetch_optional(&self.readers)
        .await
        .map_err(database("read an evaluation"))?
        .map(|row| {
            Ok(Asked {
                study: StudyId(row.study),
                request: from_json("request", &row.request)?,
            })
        })
        .transpose()
    }

    pub(crate) async fn read_events(
        &self,
        study: &StudyId,
        after: i64,
        limit: i64,
    ) -> Result<Vec<Event>, StoreError> {
        let rows = sqlx::query!(
            r#"SELECT id AS "id!: i64", kind, data, created_ms FROM events
               WHERE study = ? AND id > ? ORDER BY id LIMIT ?"#,
            study.0,
            after,
            limit
        )
        .fetch_all(&self.readers)
        .await
        .map_err(database("read events"))?;
        rows.into_iter()
            .map(|row| {
                Ok(Event {
                    id: row.id,
                    kind: row.kind,
                    created_ms: row.created_ms,
                    data: from_json("event", &row.data)?,
                })
            })
            .collect()
    }

    pub(crate) async fn read_workers(&self) -> Result<Vec<WorkerView>, StoreError> {
        let rows = sqlx::query!(
            r#"SELECT id AS "id!: String", host, pid, build, instruction_set, first_seen_ms, last_seen_ms, evaluations
               FROM workers ORDER BY last_seen_ms DESC"#
        )
        .fetch_all(&self.readers)
        .await
        .map_err(database("read workers"))?;
        Ok(rows
            .into_iter()
            .map(|row| WorkerView {
                identity: WorkerIdentity {
                    id: WorkerId(row.id),
                    host: row.host,
                    pid: row.pid as u32,
                    build: row.build,
                    instruction_set: row.instruction_set,
                },
                first_seen_ms: row.first_seen_ms,
                last_seen_ms: row.last_seen_ms,
                evaluations: row.evaluations,
            })
            .collect())
    }

    pub(crate) async fn read_one(&self) -> Result<(), StoreError> {
        sqlx::query_scalar!(r#"SELECT COUNT(*) AS "count!: i64" FROM queue"#)
            .fetch_one(&self.readers)
            .await
            .map_err(database("answer"))?;
        Ok(())
    }
}
