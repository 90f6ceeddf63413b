//! The scheduler: submission, claim with long poll, report, and the optimiser's step outside any lock.

use std::collections::HashMap;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use salp_core::fault::Faults;
use salp_core::study::{EvaluationRequest, Outcome, OutcomeStatus};
use salp_protocol::{
    Claim, ClaimRequest, EvaluationId, ReportRequest, StudyId, StudyState, WorkerIdentity,
};
use serde_json::Value;
use tokio::sync::watch;
use tokio::time::Instant;
use tracing::{Instrument, error, info, info_span, warn};

use crate::config::{ConfigError, ServerConfig, random_hex};
use crate::machine::{Advance, MachineError, StudyMachine};
use crate::store::{
    AcceptedReport, Batch, Claimed, Command, Commanded, NewAsk, NewRestart, NewStep, NewStudy,
    Reported, RestartId, Saved, Store, StoreError, Submitted,
};

/// Longest time for which a claim is held back, s.
pub const LONGEST_WAIT_S: f64 = 20.0;
/// How often a held claim looks for leases that expired, which nobody announces.
const LOOK_AGAIN: Duration = Duration::from_secs(1);
/// Studies whose read documents are kept at hand.
const KEPT_STUDIES: usize = 256;

/// Why the coordinator could not do something.
#[derive(Debug, thiserror::Error)]
pub enum CoordinatorError {
    /// The store.
    #[error(transparent)]
    Store(#[from] StoreError),
    /// The document has faults; nothing was stored.
    #[error("the study has {} faults", .0.0.len())]
    Faults(Faults),
    /// An optimiser that cannot even begin; nothing was stored.
    #[error(transparent)]
    Machine(#[from] MachineError),
    /// A stored study that this build cannot read.
    #[error("study {study} was stored by another build and has {} faults for this one", .faults.0.len())]
    Unreadable {
        /// The study.
        study: StudyId,
        /// Its faults.
        faults: Faults,
    },
    /// No such study.
    #[error("there is no study {0}")]
    UnknownStudy(StudyId),
    /// No random numbers for an id.
    #[error(transparent)]
    Id(#[from] ConfigError),
}

/// The coordinator's one state beside the store: nothing in it is needed after a restart.
pub struct Coordinator {
    /// The store.
    pub store: Arc<dyn Store>,
    /// Set-up.
    pub config: ServerConfig,
    machines: Mutex<HashMap<StudyId, Arc<StudyMachine>>>,
    /// Changes when work appears.
    work: watch::Sender<u64>,
    /// Changes when events appear.
    news: watch::Sender<u64>,
    /// True once the coordinator is going down.
    stopping: watch::Receiver<bool>,
}

/// What became of a submission.
#[derive(Debug, PartialEq, Eq)]
pub enum Submission {
    /// Stored.
    Created(StudyId),
    /// Was stored before, by the same key.
    Repeated(StudyId),
    /// The key belongs to another body.
    KeyReused(StudyId),
}

impl Coordinator {
    /// A coordinator on a store.
    pub fn new(
        config: ServerConfig,
        store: Arc<dyn Store>,
        stopping: watch::Receiver<bool>,
    ) -> Arc<Self> {
        Arc::new(Self {
            store,
            config,
            machines: Mutex::default(),
            work: watch::Sender::new(0),
            news: watch::Sender::new(0),
            stopping,
        })
    }

    /// Takes up what a crash left behind: results without their step, ended steps, cancellations.
    pub async fn recover(self: &Arc<Self>) -> Result<(), StoreError> {
        if self.config.workers_end_with_it {
            self.store.release_all().await?;
        }
        for restart in self.store.unstepped().await? {
            info!(
                restart = restart.0,
                "stepping a restart that was left behind"
            );
            self.advance_in_background(restart);
        }
        for (study, step) in self.store.ended_steps().await? {
            let this = Arc::clone(self);
            tokio::spawn(async move {
                if let Err(failure) = this.follow_step(&study, step).await {
                    error!(%study, %failure, "cannot go on after a step");
                }
            });
        }
        for study in self.store.cancelling().await? {
            self.settle_in_background(study);
        }
        Ok(())
    }

    /// A receiver that changes when events appear.
    pub fn news(&self) -> watch::Receiver<u64> {
        self.news.subscribe()
    }

    /// A receiver that becomes true when the coordinator goes down.
    pub fn stopping(&self) -> watch::Receiver<bool> {
        self.stopping.clone()
    }

    fn announce(&self) {
        self.work.send_modify(|count| *count += 1);
        self.news.send_modify(|count| *count += 1);
    }

    /// The machine of a stored study.
    pub async fn machine(&self, study: &StudyId) -> Result<Arc<StudyMachine>, CoordinatorError> {
        if let Some(machine) = self.kept().get(study) {
            return Ok(Arc::clone(machine));
        }
        let document = self
            .store
            .document(study)
            .await?
            .ok_or_else(|| CoordinatorError::UnknownStudy(study.clone()))?;
        // Whether it may start programs was decided when it was submitted.
        let machine =
            StudyMachine::read(&document, true).map_err(|faults| CoordinatorError::Unreadable {
                study: study.clone(),
                faults,
            })?;
        let machine = Arc::new(machine);
        let mut kept = self.kept();
        if kept.len() >= KEPT_STUDIES {
            kept.clear();
        }
        kept.insert(study.clone(), Arc::clone(&machine));
        Ok(machine)
    }

    fn kept(&self) -> std::sync::MutexGuard<'_, HashMap<StudyId, Arc<StudyMachine>>> {
        // A map of read documents cannot be left half-changed.
        self.machines.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Checks a study and stores it with the first asks of its first step.
    pub async fn submit(
        &self,
        document: Value,
        body_sha256: String,
        idempotency_key: Option<String>,
    ) -> Result<Submission, CoordinatorError> {
        let machine = StudyMachine::read(&document, self.config.allow_commands)
            .map_err(CoordinatorError::Faults)?;
        let machine = Arc::new(machine);
        let restarts = begin_step(&machine, 0).await?;
        let id = StudyId(random_hex(6)?);
        let study = NewStudy {
            id: id.clone(),
            name: machine.study().name.clone(),
            document,
            fingerprint: machine.study().fingerprint(),
            steps: machine.steps().len(),
            mixed_hardware: machine.study().mixed_hardware,
            idempotency_key,
            body_sha256,
            restarts,
        };
        Ok(match self.store.submit(study).await? {
            Submitted::Created => {
                info!(study = %id, name = machine.study().name, "submitted");
                self.kept().insert(id.clone(), machine);
                self.announce();
                Submission::Created(id)
            }
            Submitted::Repeated(id) => Submission::Repeated(id),
            Submitted::KeyReused(id) => Submission::KeyReused(id),
        })
    }

    /// Hands out work, and holds the answer back as long as there is none and the worker is willing to wait.
    pub async fn claim(
        self: &Arc<Self>,
        request: &ClaimRequest,
    ) -> Result<Claimed, CoordinatorError> {
        let wait = if request.wait_s.is_finite() {
            request.wait_s.clamp(0.0, LONGEST_WAIT_S)
        } else {
            0.0
        };
        let until = Instant::now() + Duration::from_secs_f64(wait);
        let lease_ms = self.config.lease.as_millis() as i64;
        let mut work = self.work.subscribe();
        let mut stopping = self.stopping();
        loop {
            work.borrow_and_update();
            let answer = self
                .store
                .claim(request, lease_ms, self.config.attempts)
                .await?;
            for restart in answer.lost {
                self.advance_in_background(restart);
            }
            if let Claimed::Work { claim, key } = &answer.claimed {
                info!(study = %claim.study, evaluation = %claim.evaluation, fence = claim.fence,
                    attempt = claim.attempt, worker = %request.worker.id, "claimed");
                self.announce_news();
                if self.complete_known(&request.worker, claim, key).await? {
                    continue;
                }
            }
            if !matches!(answer.claimed, Claimed::Nothing) {
                return Ok(answer.claimed);
            }
            let left = until.saturating_duration_since(Instant::now());
            if left.is_zero() || *stopping.borrow() {
                return Ok(Claimed::Nothing);
            }
            tokio::select! {
                _ = work.changed() => {}
                _ = stopping.changed() => {}
                () = tokio::time::sleep(left.min(LOOK_AGAIN)) => {}
            }
        }
    }

    /// Completes a claimed evaluation whose result has become known since it was asked for, or was known all along but
    /// not to be used before a worker's claim bound the study to a build; false if it is to be computed.
    async fn complete_known(
        self: &Arc<Self>,
        worker: &WorkerIdentity,
        claim: &Claim,
        key: &String,
    ) -> Result<bool, CoordinatorError> {
        let machine = self.machine(&claim.study).await?;
        let bound_to = (worker.build.clone(), worker.instruction_set.clone());
        let within = machine.starts_programs(claim.request.step);
        let within = within.then_some(&claim.study);
        let keys = std::slice::from_ref(key);
        let known = self.store.known(keys, &bound_to, within).await?;
        let Some(known) = known.into_iter().flatten().next() else {
            return Ok(false);
        };
        let mut payer = worker.clone();
        if let Some(id) = known.worker {
            payer.id = id;
        }
        let report = AcceptedReport {
            evaluation: claim.evaluation.clone(),
            fence: claim.fence,
            worker: payer,
            verdict: machine.verdict(&claim.request, &known.outcome)?,
            outcome: known.outcome,
            cached_from: Some(known.evaluation),
        };
        if let Reported::Stored { restart, .. } = self.store.accept_result(report).await? {
            self.announce_news();
            self.advance_in_background(restart);
        }
        Ok(true)
    }

    fn announce_news(&self) {
        self.news.send_modify(|count| *count += 1);
    }

    /// Takes a report. The step, if the batch is complete now, follows in the background.
    pub async fn report(
        self: &Arc<Self>,
        evaluation: EvaluationId,
        report: ReportRequest<Value>,
    ) -> Result<Reported, CoordinatorError> {
        let Some(asked) = self.store.asked(&evaluation).await? else {
            return Ok(Reported::Unknown);
        };
        let machine = self.machine(&asked.study).await?;
        let (outcome, nonsense) = match serde_json::from_value::<Outcome>(report.outcome) {
            Ok(outcome) => machine.checked(&asked.request, &outcome)?,
            Err(fault) => {
                let reason = fault.to_string();
                let status = OutcomeStatus::InvalidResult {
                    reason: reason.clone(),
                };
                (Outcome::without_values(status), Some(reason))
            }
        };
        let worker = report.worker;
        let given_up = matches!(
            outcome.status,
            OutcomeStatus::Cancelled | OutcomeStatus::Lost
        );
        // Only a study that is being cancelled has cancelled results: any other evaluation is tried again, as after nonsense.
        let retried = nonsense.is_some() || given_up;
        if let Some(reason) = nonsense {
            warn!(study = %asked.study, %evaluation, worker = %worker.id, reason, "a worker reported nonsense");
        }
        let fence = report.fence;
        let report = AcceptedReport {
            evaluation: evaluation.clone(),
            fence,
            worker,
            verdict: machine.verdict(&asked.request, &outcome)?,
            outcome,
            cached_from: None,
        };
        let reported = if retried {
            let attempts = self.config.attempts;
            self.store.reject_result(report, attempts).await?
        } else {
            self.store.accept_result(report).await?
        };
        match &reported {
            Reported::Stored { status, restart } => {
                info!(study = %asked.study, restart = restart.0, %evaluation, fence, status, "reported");
                self.announce_news();
                self.advance_in_background(*restart);
            }
            Reported::PutBack => self.announce(),
            Reported::Stale => {
                info!(study = %asked.study, %evaluation, fence, "refused a stale report");
            }
            Reported::Repeated { .. } | Reported::Unknown => {}
        }
        Ok(reported)
    }

    /// Gives an evaluation back; false where the fence does not hold.
    pub async fn release(&self, evaluation: &EvaluationId, fence: i64) -> Result<bool, StoreError> {
        let released = self.store.release(evaluation, fence).await?;
        if released {
            self.announce();
        }
        Ok(released)
    }

    /// A user's command.
    pub async fn command(
        self: &Arc<Self>,
        study: &StudyId,
        command: Command,
    ) -> Result<Commanded, StoreError> {
        let answer = self.store.command(study, command).await?;
        if let Commanded::Now(state) = answer {
            info!(%study, %state, "commanded");
            if state == StudyState::Cancelling {
                self.settle_in_background(study.clone());
            }
            self.announce();
        }
        Ok(answer)
    }

    /// A worker that died during a cancellation never reports: looks again until no lease is held.
    fn settle_in_background(self: &Arc<Self>, study: StudyId) {
        let this = Arc::clone(self);
        let mut stopping = self.stopping();
        tokio::spawn(async move {
            loop {
                tokio::select! {
                    () = tokio::time::sleep(this.config.lease / 3) => {}
                    _ = stopping.changed() => return,
                }
                match this.store.settle(&study).await {
                    Ok(StudyState::Cancelling) => {}
                    Ok(_) => return this.announce_news(),
                    Err(failure) => warn!(%study, %failure, "cannot settle a cancellation yet"),
                }
            }
        });
    }

    /// Steps a restart as long as its batches are answered; tries again while the store fails.
    pub fn advance_in_background(self: &Arc<Self>, restart: RestartId) {
        let this = Arc::clone(self);
        let mut stopping = self.stopping();
        let span = info_span!("step", restart = restart.0);
        tokio::spawn(
            async move {
                let mut pause = Duration::from_millis(100);
                while let Err(failure) = this.advance(restart).await {
                    warn!(%failure, "cannot step a restart; trying again in {pause:?}");
                    tokio::select! {
                        () = tokio::time::sleep(pause) => {}
                        _ = stopping.changed() => return,
                    }
                    pause = (pause * 2).min(Duration::from_secs(10));
                }
            }
            .instrument(span),
        );
    }

    async fn advance(self: &Arc<Self>, restart: RestartId) -> Result<(), CoordinatorError> {
        while let Some(batch) = self.store.batch(restart).await? {
            let machine = self.machine(&batch.study).await?;
            let study = batch.study.clone();
            let (step, index, version) = (batch.step, batch.index, batch.version);
            let bound_to = batch.bound_to.clone();
            let stepped = match compute_step(&machine, batch).await {
                Ok(stepped) => stepped,
                Err(broken) => {
                    error!(%study, step, restart = index, failure = %broken, "an optimiser broke");
                    self.store.fail(&study, &broken.to_string()).await?;
                    self.announce_news();
                    return Ok(());
                }
            };
            let asks = self
                .asks(&machine, &study, step, bound_to.as_ref(), stepped.asks)
                .await?;
            let saved = self
                .store
                .save_step(NewStep {
                    restart,
                    version,
                    machine: stepped.state,
                    summary: stepped.summary,
                    done: stepped.done,
                    asks,
                })
                .await?;
            let Saved::Yes { step_ended } = saved else {
                return Ok(());
            };
            self.announce();
            if step_ended {
                self.follow_step(&study, step).await?;
            }
        }
        Ok(())
    }

    /// Completes at once the asks whose results are known. Those of programs are known only within their own study:
    /// a program can change without its study.
    async fn asks(
        &self,
        machine: &Arc<StudyMachine>,
        study: &StudyId,
        step: usize,
        bound_to: Option<&(String, String)>,
        requests: Vec<EvaluationRequest>,
    ) -> Result<Vec<NewAsk>, CoordinatorError> {
        let mut asks = new_asks(machine, step, requests)?;
        let Some(bound_to) = bound_to else {
            return Ok(asks);
        };
        let keys: Vec<String> = asks.iter().map(|ask| ask.key.clone()).collect();
        let within = machine.starts_programs(step).then_some(study);
        let known = self.store.known(&keys, bound_to, within).await?;
        for (ask, known) in asks.iter_mut().zip(known) {
            if let Some(known) = known {
                let verdict = machine.verdict(&ask.request, &known.outcome)?;
                ask.known = Some((known, verdict));
            }
        }
        Ok(asks)
    }

    /// After the last restart of a step: begins the next one, or ends the study.
    async fn follow_step(&self, study: &StudyId, step: usize) -> Result<(), CoordinatorError> {
        let machine = self.machine(study).await?;
        if step + 1 >= machine.steps().len() {
            self.store.finish(study).await?;
            self.kept().remove(study);
            info!(%study, "the last step ended");
        } else {
            match begin_step(&machine, step + 1).await {
                Ok(restarts) => {
                    self.store.begin_step(study, step + 1, restarts).await?;
                }
                Err(broken) => self.store.fail(study, &broken.to_string()).await?,
            }
        }
        self.announce();
        Ok(())
    }
}

fn new_asks(
    machine: &StudyMachine,
    step: usize,
    requests: Vec<EvaluationRequest>,
) -> Result<Vec<NewAsk>, MachineError> {
    let command = machine.starts_programs(step);
    requests
        .into_iter()
        .map(|request| {
            Ok(NewAsk {
                key: machine.key(&request)?,
                request,
                command,
                known: None,
            })
        })
        .collect()
}

async fn begin_step(
    machine: &Arc<StudyMachine>,
    step: usize,
) -> Result<Vec<NewRestart>, MachineError> {
    let worker = Arc::clone(machine);
    let begun = tokio::task::spawn_blocking(move || worker.begin(step)).await;
    begun
        .unwrap_or_else(|panic| Err(broken(step, 0, &panic)))?
        .into_iter()
        .enumerate()
        .map(|(index, advance)| {
            Ok(NewRestart {
                index,
                machine: advance.state,
                summary: advance.summary,
                asks: new_asks(machine, step, advance.asks)?,
            })
        })
        .collect()
}

async fn compute_step(machine: &Arc<StudyMachine>, batch: Batch) -> Result<Advance, MachineError> {
    let (step, restart) = (batch.step, batch.index);
    let worker = Arc::clone(machine);
    let stepped = tokio::task::spawn_blocking(move || {
        worker.advance(step, restart, batch.machine, &batch.outcomes)
    });
    stepped
        .await
        .unwrap_or_else(|panic| Err(broken(step, restart, &panic)))
}

fn broken(step: usize, restart: usize, panic: &tokio::task::JoinError) -> MachineError {
    MachineError {
        step,
        restart,
        reason: format!("go on: {panic}"),
    }
}
