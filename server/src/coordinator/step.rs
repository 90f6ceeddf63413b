//! The optimiser's step: computed outside any lock, saved where the restart still is the version that was read.

use std::sync::Arc;
use std::time::Duration;

use salp_core::study::EvaluationRequest;
use salp_protocol::StudyId;
use tracing::{Instrument, Span, error, field, info, info_span, warn};

use super::{Coordinator, CoordinatorError};
use crate::machine::{Advance, MachineError, StudyMachine};
use crate::store::{Batch, NewAsk, NewRestart, NewStep, RestartId, Saved};

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

    /// Begins the next step or ends the study; tries again while the store fails.
    pub(super) fn follow_step_in_background(self: &Arc<Self>, study: StudyId, step: usize) {
        let this = Arc::clone(self);
        tokio::spawn(async move {
            let mut pause = Duration::from_millis(100);
            while let Err(failure) = this.follow_step(&study, step).await {
                warn!(%study, step, %failure, "cannot go on after a step; trying again in {pause:?}");
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
                self.follow_step_in_background(study, step);
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
                let judgement = machine.judge(&ask.request, &known.outcome)?;
                ask.known = Some((known, judgement));
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

/// The restarts of a step with their first asks.
pub async fn begin_step(
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
