//! The ledger: every evaluation with who answered it, at which attempt, at what cost.

use salp_core::study::EvaluationRequest;
use salp_protocol::{EvaluationId, EvaluationRow, StudyId, WorkerId};
use salp_server::store::StoreError;

use crate::SqliteStore;
use crate::rows::{database, from_json};

impl SqliteStore {
    pub(crate) async fn read_ledger(
        &self,
        study: &StudyId,
        after: i64,
        limit: i64,
        with_outcome: bool,
    ) -> Result<Vec<EvaluationRow>, StoreError> {
        let rows = sqlx::query!(
            r#"SELECT e.id AS "id!: i64", r.step AS "step!: i64", r.restart_index AS "restart_index!: i64",
                      e.batch AS "batch!: i64", e.batch_index AS "batch_index!: i64", e.request AS "request!: String", e.band_of, e.guess AS "guess!: i64",
                      e.created_ms AS "created_ms!: i64",
                      COALESCE(a.status, q.state, 'withdrawn') AS "status!: String",
                      a.objective AS "objective?: f64", a.max_violation AS "max_violation?: f64",
                      COALESCE(a.feasible, 0) AS "feasible!: i64", COALESCE(a.overlap, 0) AS "overlap!: i64",
                      a.cached_from AS "cached_from?: i64", a.wall_s AS "wall_s?: f64", a.cpu_s AS "cpu_s?: f64",
                      COALESCE(a.worker, q.worker) AS "worker?: String",
                      COALESCE(a.attempt, q.attempt, 0) AS "attempt!: i64",
                      COALESCE(a.fence, q.fence, 0) AS "fence!: i64",
                      a.finished_ms AS "finished_ms?: i64",
                      CASE WHEN ?4 THEN a.outcome END AS "outcome?: String"
               FROM evaluations e JOIN restarts r ON r.id = e.restart
                    LEFT JOIN results a ON a.evaluation = e.id LEFT JOIN queue q ON q.evaluation = e.id
               WHERE e.study = ?1 AND e.id > ?2 ORDER BY e.id LIMIT ?3"#,
            study.0,
            after,
            limit,
            with_outcome
        )
        .fetch_all(&self.readers)
        .await
        .map_err(database("read the ledger"))?;
        rows.into_iter()
            .map(|row| {
                let request: EvaluationRequest = from_json("request", &row.request)?;
                let kind =
                    serde_json::to_value(request.kind).map_err(|source| StoreError::Corrupt {
                        what: "kind",
                        source,
                    })?;
                Ok(EvaluationRow {
                    evaluation: EvaluationId(row.id),
                    step: row.step as usize,
                    restart: row.restart_index as usize,
                    batch: row.batch,
                    batch_index: row.batch_index,
                    kind: match (row.band_of, row.guess) {
                        (Some(_), _) => "band",
                        (None, 1) => "guess",
                        _ => kind.as_str().unwrap_or_default(),
                    }
                    .to_owned(),
                    band_of: row.band_of.map(EvaluationId),
                    fidelity: request.fidelity,
                    iteration: request.iteration,
                    x: request.x,
                    status: row.status,
                    objective: row.objective,
                    max_violation: row.max_violation,
                    feasible: row.feasible != 0,
                    overlap: row.overlap != 0,
                    cached_from: row.cached_from.map(EvaluationId),
                    wall_s: row.wall_s,
                    cpu_s: row.cpu_s,
                    worker: row.worker.map(WorkerId),
                    attempt: row.attempt,
                    fence: row.fence,
                    created_ms: row.created_ms,
                    finished_ms: row.finished_ms,
                    outcome: row
                        .outcome
                        .map(|text| from_json("outcome", &text))
                        .transpose()?,
                })
            })
            .collect()
    }
}
