//! The contract with the database, in transactions of the domain: each method is one transaction, or one read of one
//! snapshot. Nothing is held over a wait for the network or for an optimiser.

use async_trait::async_trait;
use salp_core::study::{EvaluationRequest, Outcome};
use salp_protocol::{
    Claim, ClaimRequest, Counts, EvaluationId, EvaluationRow, Event, StepState, StudyId,
    StudyState, WorkerId, WorkerIdentity, WorkerView,
};
use serde_json::Value;

use crate::machine::{BandAsk, Judgement};

/// Why a transaction failed.
#[derive(Debug, thiserror::Error)]
pub enum StoreError {
    /// The database said no: disk full, read-only, locked beyond the timeout.
    #[error("the database failed while it was to {doing}: {source}")]
    Database {
        /// What was to be done.
        doing: &'static str,
        /// What it said.
        source: Box<dyn std::error::Error + Send + Sync>,
    },
    /// A stored document cannot be read back.
    #[error("stored {what} cannot be read: {source}")]
    Corrupt {
        /// Which.
        what: &'static str,
        /// Why.
        source: serde_json::Error,
    },
    /// A stored word is none that this build knows.
    #[error("stored {what} is \"{found}\", which this build does not know")]
    UnknownWord {
        /// Which column.
        what: &'static str,
        /// What it holds.
        found: String,
    },
}

/// Id of a restart in the store; not part of the API.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct RestartId(pub i64);

/// A study to be stored with the restarts of the steps that begin at once.
#[derive(Clone, Debug)]
pub struct NewStudy {
    /// Id, chosen by the coordinator.
    pub id: StudyId,
    /// Name.
    pub name: String,
    /// Document as submitted.
    pub document: Value,
    /// Hash of the resolved document.
    pub fingerprint: String,
    /// Number of steps.
    pub steps: usize,
    /// Whether any worker may join.
    pub mixed_hardware: bool,
    /// Idempotency-Key.
    pub idempotency_key: Option<String>,
    /// Hash of the body.
    pub body_sha256: String,
    /// The steps that take nothing from others; the rest waits.
    pub begun: Vec<BegunStep>,
}

/// A step that begins, with all that its restarts ask for at first.
#[derive(Clone, Debug)]
pub struct BegunStep {
    /// Index in the study.
    pub step: usize,
    /// What it takes from other steps, which only the core reads.
    pub inputs: Value,
    /// Its restarts.
    pub restarts: Vec<NewRestart>,
}

/// What became of a submission.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Submitted {
    /// Stored.
    Created,
    /// The key was used for the same body before.
    Repeated(StudyId),
    /// The key was used for another body before.
    KeyReused(StudyId),
}

/// A restart to be stored.
#[derive(Clone, Debug)]
pub struct NewRestart {
    /// Index in the step.
    pub index: usize,
    /// Optimiser's state.
    pub machine: Value,
    /// What the optimiser says of itself.
    pub summary: Value,
    /// First batch; empty: the restart is done before it began.
    pub asks: Vec<NewAsk>,
    /// As in [`NewStep`].
    pub guesses: Vec<NewAsk>,
}

/// An evaluation to be queued, or completed at once where its result is known.
#[derive(Clone, Debug)]
pub struct NewAsk {
    /// What is asked.
    pub request: EvaluationRequest,
    /// Key of the result.
    pub key: String,
    /// Whether it starts a program.
    pub command: bool,
    /// What is handed out first within a study; equal places by age.
    pub place: i64,
    /// The known result.
    pub known: Option<(KnownResult, Judgement)>,
}

/// A result that was paid for before.
#[derive(Clone, Debug)]
pub struct KnownResult {
    /// Who paid.
    pub evaluation: EvaluationId,
    /// The outcome; its times are those of the payer.
    pub outcome: Outcome,
    /// Worker of the payer.
    pub worker: Option<WorkerId>,
}

/// Answer to a claim.
#[derive(Clone, Debug)]
pub enum Claimed {
    /// Work.
    Work {
        /// For the worker.
        claim: Box<Claim>,
        /// Key of the result.
        key: String,
    },
    /// None.
    Nothing,
    /// None for this worker: the waiting work belongs to another build or instruction set.
    Mismatch {
        /// Build that the study is bound to.
        build: String,
        /// Instruction set that the study is bound to.
        instruction_set: String,
        /// The study.
        study: StudyId,
    },
    /// None for this worker: the waiting work starts programs.
    CommandsNotAllowed {
        /// The study.
        study: StudyId,
    },
    /// The worker was told to end.
    Drain,
}

/// A claim, and what the query for it had to give up.
#[derive(Clone, Debug)]
pub struct ClaimAnswer {
    /// The claim.
    pub claimed: Claimed,
    /// Restarts whose optimiser got a `lost` result: perhaps their batch is complete now.
    pub lost: Vec<RestartId>,
}

/// Whether a lease is held.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Held {
    /// Held, and the study in this state.
    Yes {
        /// State of the study.
        state: StudyState,
        /// Whether the worker was told to end.
        drain: bool,
    },
    /// Another claim holds it, or it is answered.
    Stale,
    /// No such evaluation.
    Unknown,
}

/// An evaluation as the coordinator needs it to judge its outcome.
#[derive(Clone, Debug)]
pub struct Asked {
    /// Study.
    pub study: StudyId,
    /// What was asked.
    pub request: EvaluationRequest,
}

/// A report that made sense.
#[derive(Clone, Debug)]
pub struct AcceptedReport {
    /// The evaluation.
    pub evaluation: EvaluationId,
    /// Fence.
    pub fence: i64,
    /// Who reports.
    pub worker: WorkerIdentity,
    /// Outcome.
    pub outcome: Outcome,
    /// Whether the point counts, and its band.
    pub judgement: Judgement,
    /// Who paid for the outcome, where it was known; the worker is that of the payer then.
    pub cached_from: Option<EvaluationId>,
}

/// What became of a report.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Reported {
    /// Stored.
    Stored {
        /// Status under which it was stored.
        status: String,
        /// Its restart, whose batch may be complete now; `None` of a band or a guess, for which no optimiser waits.
        restart: Option<RestartId>,
    },
    /// Stored before, by this very fence.
    Repeated {
        /// Status under which it was stored.
        status: String,
    },
    /// Put back into the queue: a report of nonsense, with attempts left. A guess is forgotten instead.
    PutBack,
    /// The fence is not the latest.
    Stale,
    /// No such evaluation.
    Unknown,
}

/// A complete batch, ready for the optimiser.
#[derive(Clone, Debug)]
pub struct Batch {
    /// Restart.
    pub restart: RestartId,
    /// Study.
    pub study: StudyId,
    /// Index of the step.
    pub step: usize,
    /// Index of the restart in the step.
    pub index: usize,
    /// Version that was read.
    pub version: i64,
    /// Optimiser's state.
    pub machine: Value,
    /// Answers, in the batch's order.
    pub outcomes: Vec<Outcome>,
    /// Build and instruction set that the study is bound to.
    pub bound_to: Option<(String, String)>,
}

/// A computed step.
#[derive(Clone, Debug)]
pub struct NewStep {
    /// Restart.
    pub restart: RestartId,
    /// Version that was read.
    pub version: i64,
    /// Optimiser's new state.
    pub machine: Value,
    /// What the optimiser says of itself.
    pub summary: Value,
    /// Whether the optimiser stopped.
    pub done: bool,
    /// Whether the restart waits for a decision, with nothing asked.
    pub waits: bool,
    /// Next batch.
    pub asks: Vec<NewAsk>,
    /// What it will probably ask after that, in the place of what was guessed before and nobody has claimed: for workers that
    /// nothing else needs. Their results are known results, and nothing else comes of them.
    pub guesses: Vec<NewAsk>,
    /// Error bands of evaluations of the restart, each with its place in the optimiser's order, from 0. Those that have theirs
    /// get no second one.
    pub bands: Vec<(usize, BandAsk)>,
}

/// What became of a computed step.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Saved {
    /// Saved.
    Yes {
        /// Whether every restart of its step is done now.
        step_ended: bool,
    },
    /// Another one was faster, or the study ended; this one is discarded.
    Discarded,
}

/// A command of a user.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Command {
    /// End it.
    Cancel,
    /// Hand out nothing.
    Pause,
    /// Hand out again.
    Resume,
}

/// What became of a command.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Commanded {
    /// The state now.
    Now(StudyState),
    /// The state does not allow it.
    Refused(StudyState),
    /// No such study.
    Unknown,
}

/// A study as stored.
#[derive(Clone, Debug)]
pub struct StoredStudy {
    /// Order of submission.
    pub number: i64,
    /// Id.
    pub id: StudyId,
    /// Name.
    pub name: String,
    /// State.
    pub state: StudyState,
    /// Why it failed.
    pub failure: Option<String>,
    /// Hash of the resolved document.
    pub fingerprint: String,
    /// Submitted.
    pub created_ms: i64,
    /// First claim.
    pub started_ms: Option<i64>,
    /// End.
    pub ended_ms: Option<i64>,
}

/// A step as stored.
#[derive(Clone, Debug, PartialEq)]
pub struct StoredStep {
    /// Index in the study.
    pub step: usize,
    /// State.
    pub state: StepState,
    /// What it took from other steps.
    pub inputs: Option<Value>,
    /// What it hands on; of a blocked one `{"reason": ...}`.
    pub result: Option<Value>,
    /// Begun, ms.
    pub began_ms: Option<i64>,
    /// Done or blocked, ms.
    pub ended_ms: Option<i64>,
}

/// A restart as stored.
#[derive(Clone, Debug)]
pub struct StoredRestart {
    /// Id.
    pub id: RestartId,
    /// Index of the step.
    pub step: usize,
    /// Index in the step.
    pub index: usize,
    /// Whether the optimiser stopped.
    pub done: bool,
    /// Whether it waits for a decision, with nothing asked.
    pub waits: bool,
    /// Steps so far.
    pub version: i64,
    /// What the optimiser says of itself.
    pub summary: Value,
}

/// A best point as stored.
#[derive(Clone, Debug)]
pub struct StoredBest {
    /// Index of the step.
    pub step: usize,
    /// Index of the restart.
    pub restart: usize,
    /// The evaluation.
    pub evaluation: EvaluationId,
    /// What was asked.
    pub request: EvaluationRequest,
    /// What was answered.
    pub outcome: Outcome,
    /// Largest violation.
    pub max_violation: f64,
}

/// A point of a curve as stored, in the optimiser's order within its restart.
#[derive(Clone, Debug)]
#[expect(
    clippy::struct_excessive_bools,
    reason = "what is stored of a point, column by column"
)]
pub struct StoredPoint {
    /// Index of the step.
    pub step: usize,
    /// Index of the restart.
    pub restart: usize,
    /// The evaluation.
    pub evaluation: EvaluationId,
    /// Objective.
    pub objective: Option<f64>,
    /// Largest violation.
    pub max_violation: Option<f64>,
    /// Within the tolerance.
    pub feasible: bool,
    /// Walls cross.
    pub overlap: bool,
    /// May be a best point.
    pub counts: bool,
    /// CPU time, s.
    pub cpu_s: f64,
    /// Stored, ms.
    pub finished_ms: i64,
    /// Below the study's own fidelity.
    pub coarse: bool,
    /// Objective on the second mesh, of a band that is answered with a value.
    pub second_mesh: Option<f64>,
}

/// The store.
#[async_trait]
pub trait Store: Send + Sync {
    /// Stores a study with its steps, the restarts of those that begin at once, and their asks.
    async fn submit(&self, study: NewStudy) -> Result<Submitted, StoreError>;
    /// The steps of a study, in order.
    async fn steps(&self, study: &StudyId) -> Result<Vec<StoredStep>, StoreError>;
    /// Indices and optimisers' states of the restarts of a step, in order; `None` while one of them runs.
    async fn ended_restarts(
        &self,
        study: &StudyId,
        step: usize,
    ) -> Result<Option<Vec<(usize, Value)>>, StoreError>;
    /// Begins a step of a study under way, if it still waits; false otherwise.
    async fn begin_step(&self, study: &StudyId, begun: BegunStep) -> Result<bool, StoreError>;
    /// Ends a step of a study under way all of whose restarts are done, with what it hands on; false otherwise.
    async fn end_step(
        &self,
        study: &StudyId,
        step: usize,
        result: &Value,
    ) -> Result<bool, StoreError>;
    /// Gives up a step of a study under way that waits for what will never be there; false if it does not wait.
    async fn block_step(
        &self,
        study: &StudyId,
        step: usize,
        reason: &str,
    ) -> Result<bool, StoreError>;
    /// Ends a study whose steps have all ended, if nothing of it is queued but guesses: the last band to be answered ends it otherwise. A
    /// study with a blocked step has failed.
    async fn finish(&self, study: &StudyId) -> Result<(), StoreError>;
    /// Ends a study whose optimiser broke.
    async fn fail(&self, study: &StudyId, failure: &str) -> Result<(), StoreError>;
    /// Hands out the best evaluation that is ready, or leased and expired: bands after everything that an optimiser waits
    /// for, guesses after bands, then by priority, least running share of its study, age. Fence and attempt grow by one; attempts
    /// beyond the cap end as `lost`. A guess whose lease has expired is forgotten; what an optimiser waits for is held back while
    /// it is being evaluated as a guess.
    async fn claim(
        &self,
        request: &ClaimRequest,
        lease_ms: i64,
        attempts: i64,
    ) -> Result<ClaimAnswer, StoreError>;
    /// Renews a lease.
    async fn renew(
        &self,
        evaluation: &EvaluationId,
        fence: i64,
        lease_ms: i64,
    ) -> Result<Held, StoreError>;
    /// Stores a result where the fence holds, and queues the band of a result that is the best so far of its step.
    async fn accept_result(&self, report: AcceptedReport) -> Result<Reported, StoreError>;
    /// Puts an evaluation back whose report was nonsense; over the cap the given outcome is stored.
    async fn reject_result(
        &self,
        report: AcceptedReport,
        attempts: i64,
    ) -> Result<Reported, StoreError>;
    /// Puts an evaluation back that its worker gave up, or forgets it where it is a guess; the attempt does not count. False where the fence does not hold.
    async fn release(&self, evaluation: &EvaluationId, fence: i64) -> Result<bool, StoreError>;
    /// Puts every leased evaluation back but guesses, whose workers are known to have ended; the attempts do not count.
    async fn release_all(&self) -> Result<(), StoreError>;
    /// The batch of a restart, if all of it is answered and the restart wants a step.
    async fn batch(&self, restart: RestartId) -> Result<Option<Batch>, StoreError>;
    /// A restart with nothing asked: one that waits for a decision, or is done; without outcomes.
    async fn idle(&self, restart: RestartId) -> Result<Option<Batch>, StoreError>;
    /// Brings a done restart back, if it still is the version that was read: its step and its study go on with it. False
    /// otherwise, where the study was cancelled or failed, and where one of the steps `untouched` has begun.
    async fn reopen(&self, step: NewStep, untouched: &[usize]) -> Result<bool, StoreError>;
    /// Saves a step, if the restart is still the version that was read.
    async fn save_step(&self, step: NewStep) -> Result<Saved, StoreError>;
    /// Known results for keys, from this build and instruction set; `study` restricts them to one study.
    async fn known(
        &self,
        keys: &[String],
        bound_to: &(String, String),
        study: Option<&StudyId>,
    ) -> Result<Vec<Option<KnownResult>>, StoreError>;
    /// Restarts of studies under way whose batch is answered: what a crash left behind.
    async fn unstepped(&self) -> Result<Vec<RestartId>, StoreError>;
    /// Studies under way: a crash may have left one of their steps behind.
    async fn under_way(&self) -> Result<Vec<StudyId>, StoreError>;
    /// Studies that are being cancelled.
    async fn cancelling(&self) -> Result<Vec<StudyId>, StoreError>;
    /// Ends the cancellation of a study when no lease is held any more.
    async fn settle(&self, study: &StudyId) -> Result<StudyState, StoreError>;
    /// A user's command.
    async fn command(&self, study: &StudyId, command: Command) -> Result<Commanded, StoreError>;
    /// Tells a worker to end after its evaluation; false if it is unknown.
    async fn drain(&self, worker: &WorkerId) -> Result<bool, StoreError>;

    /// A study's document.
    async fn document(&self, study: &StudyId) -> Result<Option<Value>, StoreError>;
    /// A study.
    async fn study(&self, study: &StudyId) -> Result<Option<StoredStudy>, StoreError>;
    /// Studies with a number below `before`, latest first.
    async fn studies(
        &self,
        before: Option<i64>,
        state: Option<StudyState>,
        limit: i64,
    ) -> Result<Vec<StoredStudy>, StoreError>;
    /// Counts of a study.
    async fn counts(&self, study: &StudyId) -> Result<Counts, StoreError>;
    /// Restarts of a study, by step and index.
    async fn restarts(&self, study: &StudyId) -> Result<Vec<StoredRestart>, StoreError>;
    /// Best point of each restart among those that count, the earliest among equals.
    async fn bests(&self, study: &StudyId) -> Result<Vec<StoredBest>, StoreError>;
    /// Points of all curves: by restart, then in the optimiser's order; those that have a band with it.
    async fn points(&self, study: &StudyId) -> Result<Vec<StoredPoint>, StoreError>;
    /// The ledger after an evaluation.
    async fn ledger(
        &self,
        study: &StudyId,
        after: i64,
        limit: i64,
        with_outcome: bool,
    ) -> Result<Vec<EvaluationRow>, StoreError>;
    /// What an evaluation asks.
    async fn asked(&self, evaluation: &EvaluationId) -> Result<Option<Asked>, StoreError>;
    /// Events after one.
    async fn events(
        &self,
        study: &StudyId,
        after: i64,
        limit: i64,
    ) -> Result<Vec<Event>, StoreError>;
    /// Workers, the latest seen first.
    async fn workers(&self) -> Result<Vec<WorkerView>, StoreError>;
    /// Whether the store answers.
    async fn ping(&self) -> Result<(), StoreError>;
}
