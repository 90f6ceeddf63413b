//! The optimiser's step: computed outside any lock, saved where the restart still is the version that was read.

use std::sync::Arc;
use std::time::Duration;

use salp_core::hierarchy::{Due, Progress};
use salp_core::study::{EvaluationRequest, StepInputs};
use salp_protocol::{StepState, StudyId};
use tracing::{Instrument, Span, error, field, info, info_span, warn};

use super::{Coordinator, CoordinatorError};
use crate::machine::{Advance, MachineError, StudyMachine};
use crate::store::{Batch, BegunStep, NewAsk, NewRestart, NewStep, RestartId, Saved};

/// Longest pause between two tries while the store fails.
const LONGEST_PAUSE: Duration = Duration::from_secs(10);

impl Coordinator {
    /// Steps a restart as long as its batches are answered; tries again while the store fails.
    pub(super) fn advance_in_background(self: &Arc<Self>, restart: RestartId) {
        let this = Arc::clone(self);
        let span = info_span!("step", restart = restart.0, study = field::Empty);
        let steps = async move {
            let mut pause = Duration::from_millis(100);
            while let Err(failure) = this.advance(restart).await {
                warn!(%failure, "cannot step a restart; trying again in {pause:?}");
                if this.is_stopped_within(pause).await {
                    return;
                }
                pause = (pause * 2).min(LONGEST_PAUSE);
            }
        };
        tokio::spawn(steps.instrument(span));
    }

    /// Goes on with the steps of a study; tries again while the store fails.
    pub(super) fn follow_in_background(self: &Arc<Self>, study: StudyId) {
        let this = Arc::clone(self);
        tokio::spawn(async move {
            let mut pause = Duration::from_millis(100);
            while let Err(failure) = this.follow(&study).await {
                warn!(%study, %failure, "cannot go on with the steps; trying again in {pause:?}");
                if this.is_stopped_within(pause).await {
                    return;
                }
                pause = (pause * 2).min(LONGEST_PAUSE);
            }
        });
    }

    /// Waits; true if the coordinator goes down meanwhile.
    async fn is_stopped_within(&self, pause: Duration) -> bool {
        let mut stopping = self.stopping();
        tokio::time::timeout(pause, stopping.wait_for(|stop| *stop))
            .await
            .is_ok()
    }

    async fn advance(self: &Arc<Self>, restart: RestartId) -> Result<(), CoordinatorError> {
        while let Some(batch) = self.store.batch(restart).await? {
            Span::current().record("study", field::display(&batch.study));
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
            let shows_more = stepped.shows_more;
            let to_store = (restart, version, bound_to);
            let new = self.new_step(&machine, &study, (step, index), to_store, stepped);
            let saved = self.store.save_step(new.await?).await?;
            let Saved::Yes { step_ended } = saved else {
                return Ok(());
            };
            self.announce();
            if step_ended || shows_more {
                self.follow_in_background(study);
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
        (step, restart): (usize, usize),
        bound_to: Option<&(String, String)>,
        requests: Vec<EvaluationRequest>,
    ) -> Result<Vec<NewAsk>, CoordinatorError> {
        let mut asks = new_asks(machine, step, restart, requests)?;
        let Some(bound_to) = bound_to else {
            return Ok(asks);
        };
        let keys: Vec<String> = asks.iter().map(|ask| ask.key.clone()).collect();
        let within = machine.starts_programs(step).then_some(study);
        let known = self.store.known(&keys, bound_to, within).await?;
        for (ask, known) in asks.iter_mut().zip(known) {
            if let Some(known) = known {
                let judgement = machine.judge(&ask.request, &known.outcome)?;
                ask.known = Some((known, judgement));
            }
        }
        Ok(asks)
    }

    /// A step of a restart as it is to be stored.
    pub(super) async fn new_step(
        &self,
        machine: &Arc<StudyMachine>,
        study: &StudyId,
        of: (usize, usize),
        (restart, version, bound_to): (RestartId, i64, Option<(String, String)>),
        advance: Advance,
    ) -> Result<NewStep, CoordinatorError> {
        let bound_to = bound_to.as_ref();
        let asks = self.asks(machine, study, of, bound_to, advance.asks);
        let guesses = self.asks(machine, study, of, bound_to, advance.guesses);
        Ok(NewStep {
            restart,
            version,
            machine: advance.state,
            summary: advance.summary,
            done: advance.done,
            waits: advance.waits,
            asks: asks.await?,
            guesses: guesses.await?,
            bands: advance.bands,
        })
    }

    /// Ends the steps whose restarts have all ended, begins those that have all that they take, gives up those that never
    /// will, and ends the study after the last one. Done again it does nothing.
    async fn follow(self: &Arc<Self>, study: &StudyId) -> Result<(), CoordinatorError> {
        let machine = match self.machine(study).await {
            Ok(machine) => machine,
            // Of another build: nothing of it can move, and nobody is to try again and again.
            Err(CoordinatorError::Unreadable { faults, .. }) => {
                warn!(%study, faults = faults.0.len(), "a study of another build cannot be read");
                return Ok(());
            }
            Err(failure) => return Err(failure),
        };
        loop {
            match self.follow_once(study, &machine).await {
                Ok(true) => self.announce(),
                Ok(false) => break,
                Err(CoordinatorError::Machine(broken)) => {
                    error!(%study, failure = %broken, "a step broke");
                    self.store.fail(study, &broken.to_string()).await?;
                    break;
                }
                Err(failure) => return Err(failure),
            }
        }
        self.store.finish(study).await?;
        let stored = self.store.study(study).await?;
        if stored.is_some_and(|stored| stored.state.is_final()) {
            self.kept().remove(study);
            info!(%study, "the last step ended");
        }
        self.announce();
        Ok(())
    }

    /// One look at the steps; whether one of them moved.
    async fn follow_once(
        self: &Arc<Self>,
        study: &StudyId,
        machine: &Arc<StudyMachine>,
    ) -> Result<bool, CoordinatorError> {
        let mut moved = false;
        let mut progress = Vec::new();
        for mut step in self.store.steps(study).await? {
            if step.state == StepState::Running && machine.competes(step.step) {
                moved |= self.decide(study, machine, &step).await?;
            }
            if step.state == StepState::Running
                && let Some(restarts) = self.store.ended_restarts(study, step.step).await?
            {
                let result = machine.result(step.step, restarts)?;
                if self.store.end_step(study, step.step, &result).await? {
                    moved = true;
                    step.state = StepState::Done;
                    step.result = Some(result);
                }
            }
            progress.push(machine.progress(&step)?);
        }
        for due in machine.due(&progress)? {
            moved |= match due {
                Due::Begin { step, inputs } => {
                    let begun = begin(machine, step, inputs).await?;
                    self.store.begin_step(study, begun).await?
                }
                Due::Block { step, reason } => self.store.block_step(study, step, &reason).await?,
            };
        }
        Ok(moved)
    }
}

fn new_asks(
    machine: &StudyMachine,
    step: usize,
    restart: usize,
    requests: Vec<EvaluationRequest>,
) -> Result<Vec<NewAsk>, MachineError> {
    let command = machine.starts_programs(step);
    // Of restarts that compete the later ones wait for the earlier ones.
    let place = if machine.competes(step) {
        restart as i64
    } else {
        0
    };
    requests
        .into_iter()
        .map(|request| {
            Ok(NewAsk {
                key: machine.key(&request)?,
                request,
                command,
                place,
                known: None,
            })
        })
        .collect()
}

/// The steps that take nothing from others, with the first asks of their restarts.
pub async fn begin_first(machine: &Arc<StudyMachine>) -> Result<Vec<BegunStep>, MachineError> {
    let waiting = vec![Progress::Waiting; machine.steps().len()];
    let mut begun = Vec::new();
    for due in machine.due(&waiting)? {
        if let Due::Begin { step, inputs } = due {
            begun.push(begin(machine, step, inputs).await?);
        }
    }
    Ok(begun)
}

/// A step that has all that it takes, with the first asks of its restarts.
async fn begin(
    machine: &Arc<StudyMachine>,
    step: usize,
    inputs: StepInputs,
) -> Result<BegunStep, MachineError> {
    let stored = serde_json::to_value(&inputs).map_err(|e| MachineError {
        step,
        restart: 0,
        reason: format!("store its inputs: {e}"),
    })?;
    let worker = Arc::clone(machine);
    let advances = tokio::task::spawn_blocking(move || worker.begin(step, &inputs)).await;
    let restarts = advances
        .unwrap_or_else(|panic| Err(broken(step, 0, &panic)))?
        .into_iter()
        .enumerate()
        .map(|(index, advance)| {
            Ok(NewRestart {
                index,
                machine: advance.state,
                summary: advance.summary,
                asks: new_asks(machine, step, index, advance.asks)?,
                guesses: new_asks(machine, step, index, advance.guesses)?,
            })
        })
        .collect::<Result<_, MachineError>>()?;
    Ok(BegunStep {
        step,
        inputs: stored,
        restarts,
    })
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

pub(super) fn broken(step: usize, restart: usize, panic: &tokio::task::JoinError) -> MachineError {
    MachineError {
        step,
        restart,
        reason: format!("go on: {panic}"),
    }
}
