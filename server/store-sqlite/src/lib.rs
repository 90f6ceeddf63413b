//! The store on SQLite: one file, one writer, readers that never wait for it (WAL). Every write is `BEGIN IMMEDIATE`, so
//! that a transaction never fails half-way for a lock, and is on the disk before it is acknowledged (`synchronous = FULL`).
//!
//! | file | transactions |
//! |---|---|
//! | `submit` | a study, the begin of a step, their restarts and asks |
//! | `hierarchy` | the end of a step, a step that is given up |
//! | `claim` | claim, renewal, release |
//! | `report` | results |
//! | `step` | the optimiser's steps, and what a crash left behind |
//! | `guess` | evaluations for workers that nothing else needs |
//! | `command` | cancel, pause, resume, the end of a study |
//! | `read`, `ledger` | reads |

mod claim;
mod command;
mod guess;
mod hierarchy;
mod ledger;
mod read;
mod report;
mod rows;
mod step;
mod submit;
#[cfg(test)]
mod tests;

use std::path::Path;
use std::time::Duration;

use async_trait::async_trait;
use salp_protocol::{
    ClaimRequest, Counts, EvaluationId, EvaluationRow, Event, StudyId, StudyState, WorkerId,
    WorkerView,
};
use salp_server::store::{
    AcceptedReport, Asked, Batch, BegunStep, ClaimAnswer, Command, Commanded, Held, KnownResult,
    NewStep, NewStudy, Reported, RestartId, Saved, Store, StoreError, StoredBest, StoredPoint,
    StoredRestart, StoredStep, StoredStudy, Submitted,
};
use serde_json::Value;
use sqlx::sqlite::{
    SqliteConnectOptions, SqliteJournalMode, SqlitePool, SqlitePoolOptions, SqliteSynchronous,
};

use rows::{Tx, database};

/// A SQLite file.
pub struct SqliteStore {
    writer: SqlitePool,
    readers: SqlitePool,
}

impl SqliteStore {
    /// Opens a file, creates it if need be, and brings its schema up to date.
    ///
    /// # Errors
    /// [`StoreError::Database`] where the file cannot be opened, written, or belongs to a later build.
    pub async fn open(path: &Path) -> Result<Self, StoreError> {
        let options = SqliteConnectOptions::new()
            .filename(path)
            .create_if_missing(true)
            .journal_mode(SqliteJournalMode::Wal)
            .synchronous(SqliteSynchronous::Full)
            .foreign_keys(true)
            .busy_timeout(Duration::from_secs(10));
        let writer = SqlitePoolOptions::new()
            .max_connections(1)
            .connect_with(options.clone())
            .await
            .map_err(database("open its file"))?;
        sqlx::migrate!("../../migrations/sqlite")
            .run(&writer)
            .await
            .map_err(|source| StoreError::Database {
                doing: "bring its schema up to date",
                source: Box::new(source),
            })?;
        let readers = SqlitePoolOptions::new()
            .max_connections(4)
            .connect_with(options.pragma("query_only", "ON"))
            .await
            .map_err(database("open its file for reading"))?;
        Ok(Self { writer, readers })
    }

    /// Waits for what is under way and closes the file.
    pub async fn close(&self) {
        self.readers.close().await;
        self.writer.close().await;
    }

    async fn write(&self, doing: &'static str) -> Result<Tx, StoreError> {
        self.writer
            .begin_with("BEGIN IMMEDIATE")
            .await
            .map_err(database(doing))
    }

    async fn snapshot(&self, doing: &'static str) -> Result<Tx, StoreError> {
        self.readers.begin().await.map_err(database(doing))
    }
}

#[async_trait]
impl Store for SqliteStore {
    async fn submit(&self, study: NewStudy) -> Result<Submitted, StoreError> {
        self.submit_study(study).await
    }

    async fn steps(&self, study: &StudyId) -> Result<Vec<StoredStep>, StoreError> {
        self.read_steps(study).await
    }

    async fn ended_restarts(
        &self,
        study: &StudyId,
        step: usize,
    ) -> Result<Option<Vec<(usize, Value)>>, StoreError> {
        self.read_ended_restarts(study, step).await
    }

    async fn begin_step(&self, study: &StudyId, begun: BegunStep) -> Result<bool, StoreError> {
        self.begin_waiting_step(study, begun).await
    }

    async fn end_step(
        &self,
        study: &StudyId,
        step: usize,
        result: &Value,
    ) -> Result<bool, StoreError> {
        self.end_running_step(study, step, result).await
    }

    async fn block_step(
        &self,
        study: &StudyId,
        step: usize,
        reason: &str,
    ) -> Result<bool, StoreError> {
        self.block_waiting_step(study, step, reason).await
    }

    async fn finish(&self, study: &StudyId) -> Result<(), StoreError> {
        self.finish_study(study).await
    }

    async fn fail(&self, study: &StudyId, failure: &str) -> Result<(), StoreError> {
        self.fail_study(study, failure).await
    }

    async fn claim(
        &self,
        request: &ClaimRequest,
        lease_ms: i64,
        attempts: i64,
    ) -> Result<ClaimAnswer, StoreError> {
        self.claim_evaluation(request, lease_ms, attempts).await
    }

    async fn renew(
        &self,
        evaluation: &EvaluationId,
        fence: i64,
        lease_ms: i64,
    ) -> Result<Held, StoreError> {
        self.renew_lease(evaluation, fence, lease_ms).await
    }

    async fn accept_result(&self, report: AcceptedReport) -> Result<Reported, StoreError> {
        self.store_report(report, None).await
    }

    async fn reject_result(
        &self,
        report: AcceptedReport,
        attempts: i64,
    ) -> Result<Reported, StoreError> {
        self.store_report(report, Some(attempts)).await
    }

    async fn release(&self, evaluation: &EvaluationId, fence: i64) -> Result<bool, StoreError> {
        self.release_lease(evaluation, fence).await
    }

    async fn release_all(&self) -> Result<(), StoreError> {
        self.release_all_leases().await
    }

    async fn batch(&self, restart: RestartId) -> Result<Option<Batch>, StoreError> {
        self.complete_batch(restart).await
    }

    async fn idle(&self, restart: RestartId) -> Result<Option<Batch>, StoreError> {
        self.idle_restart(restart).await
    }

    async fn reopen(&self, step: NewStep, untouched: &[usize]) -> Result<bool, StoreError> {
        self.reopen_restart(step, untouched).await
    }

    async fn save_step(&self, step: NewStep) -> Result<Saved, StoreError> {
        self.save_computed_step(step).await
    }

    async fn known(
        &self,
        keys: &[String],
        bound_to: &(String, String),
        study: Option<&StudyId>,
    ) -> Result<Vec<Option<KnownResult>>, StoreError> {
        self.known_results(keys, bound_to, study).await
    }

    async fn unstepped(&self) -> Result<Vec<RestartId>, StoreError> {
        self.unstepped_restarts().await
    }

    async fn under_way(&self) -> Result<Vec<StudyId>, StoreError> {
        self.studies_under_way().await
    }

    async fn cancelling(&self) -> Result<Vec<StudyId>, StoreError> {
        self.cancelling_studies().await
    }

    async fn settle(&self, study: &StudyId) -> Result<StudyState, StoreError> {
        self.settle_cancellation(study).await
    }

    async fn command(&self, study: &StudyId, command: Command) -> Result<Commanded, StoreError> {
        self.obey(study, command).await
    }

    async fn drain(&self, worker: &WorkerId) -> Result<bool, StoreError> {
        self.drain_worker(worker).await
    }

    async fn document(&self, study: &StudyId) -> Result<Option<Value>, StoreError> {
        self.read_document(study).await
    }

    async fn study(&self, study: &StudyId) -> Result<Option<StoredStudy>, StoreError> {
        self.read_study(study).await
    }

    async fn studies(
        &self,
        before: Option<i64>,
        state: Option<StudyState>,
        limit: i64,
    ) -> Result<Vec<StoredStudy>, StoreError> {
        self.read_studies(before, state, limit).await
    }

    async fn counts(&self, study: &StudyId) -> Result<Counts, StoreError> {
        self.read_counts(study).await
    }

    async fn restarts(&self, study: &StudyId) -> Result<Vec<StoredRestart>, StoreError> {
        self.read_restarts(study).await
    }

    async fn bests(&self, study: &StudyId) -> Result<Vec<StoredBest>, StoreError> {
        self.read_bests(study).await
    }

    async fn points(&self, study: &StudyId) -> Result<Vec<StoredPoint>, StoreError> {
        self.read_points(study).await
    }

    async fn ledger(
        &self,
        study: &StudyId,
        after: i64,
        limit: i64,
        with_outcome: bool,
    ) -> Result<Vec<EvaluationRow>, StoreError> {
        self.read_ledger(study, after, limit, with_outcome).await
    }

    async fn asked(&self, evaluation: &EvaluationId) -> Result<Option<Asked>, StoreError> {
        self.read_asked(evaluation).await
    }

    async fn events(
        &self,
        study: &StudyId,
        after: i64,
        limit: i64,
    ) -> Result<Vec<Event>, StoreError> {
        self.read_events(study, after, limit).await
    }

    async fn workers(&self) -> Result<Vec<WorkerView>, StoreError> {
        self.read_workers().await
    }

    async fn ping(&self) -> Result<(), StoreError> {
        self.read_one().await
    }
}
