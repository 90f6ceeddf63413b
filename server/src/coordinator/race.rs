//! Restarts that compete: the decisions that are due, taken; and one that is brought back after it was stopped.

use std::sync::Arc;

use salp_core::study::StepInputs;
use salp_protocol::{StepState, StudyId};
use serde_json::Value;
use tracing::info;

use super::step::broken;
use super::{Coordinator, CoordinatorError};
use crate::machine::{MachineError, StudyMachine};
use crate::store::{Batch, Saved, StoredStep};

/// What became of the wish to bring a restart back.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Resumed {
    /// It goes on.
    Yes,
    /// It does not, for this reason.
    Refused(String),
    /// There is no such restart.
    Unknown,
}

impl Coordinator {
    /// Takes the decisions that are due among the restarts of a running step; whether there were any. They follow from what is
    /// stored, so that whoever takes them, and how often, makes no difference.
    pub(super) async fn decide(
        self: &Arc<Self>,
        study: &StudyId,
        machine: &Arc<StudyMachine>,
        step: &StoredStep,
    ) -> Result<bool, CoordinatorError> {
        let mut restarts = self.store.restarts(study).await?;
        restarts.retain(|restart| restart.step == step.step);
        if restarts.iter().all(|restart| !restart.waits) {
            return Ok(false);
        }
        let inputs = step.inputs.clone().unwrap_or(Value::Null);
        let inputs: StepInputs = serde_json::from_value(inputs).unwrap_or_default();
        let summaries: Vec<&Value> = restarts.iter().map(|r| &r.summary).collect();
        let mut decided = false;
        for (index, decision) in machine.decisions(step.step, &inputs, &summaries)? {
            let Some(stored) = restarts.get(index) else {
                continue;
            };
            let Some(idle) = self.store.idle(stored.id).await? else {
                continue;
            };
            // Decided by another one meanwhile.
            if idle.version != stored.version {
                continue;
            }
            let (bound_to, version) = (idle.bound_to.clone(), idle.version);
            let passes = decision.clone();
            let advance = compute(machine, idle, move |machine, idle| {
                machine.pass(idle.step, idle.index, idle.machine, &passes)
            })
            .await?;
            let stop = decision
                .stop
                .map(|stop| serde_json::json!(stop).to_string());
            let to_store = (stored.id, version, bound_to);
            let new = self.new_step(machine, study, (step.step, index), to_store, advance);
            if let Saved::Yes { .. } = self.store.save_step(new.await?).await? {
                info!(%study, step = step.step, restart = index, rank = decision.rank, of = decision.of,
                    race_off = decision.race_off, stop, "decided");
                decided = true;
                // Its results may all be known.
                self.advance_in_background(stored.id);
            }
        }
        Ok(decided)
    }

    /// Brings back a restart that the competition stopped: it goes on to its own end, out of competition. Where its step or its
    /// study had ended, they go on with it.
    pub async fn resume_restart(
        self: &Arc<Self>,
        study: &StudyId,
        step: usize,
        index: usize,
    ) -> Result<Resumed, CoordinatorError> {
        let machine = self.machine(study).await?;
        let restarts = self.store.restarts(study).await?;
        let stored = restarts.iter().find(|r| (r.step, r.index) == (step, index));
        let Some(stored) = stored else {
            return Ok(Resumed::Unknown);
        };
        let running = || Resumed::Refused(format!("restart {index} has not ended"));
        let idle = self.store.idle(stored.id).await?;
        let Some(idle) = idle.filter(|_| stored.done) else {
            return Ok(running());
        };
        let takers = machine.takers(step);
        let begun = self.store.steps(study).await?;
        let begun = begun
            .iter()
            .find(|s| takers.contains(&s.step) && s.state != StepState::Waiting);
        if let Some(begun) = begun {
            let ids = machine.steps();
            let id = ids.get(begun.step).map_or("", String::as_str);
            let why = format!("step \"{id}\" has already taken the results of this one");
            return Ok(Resumed::Refused(why));
        }
        let (bound_to, version) = (idle.bound_to.clone(), idle.version);
        let machine_of = |machine: &StudyMachine, idle: Batch| {
            machine.resume(idle.step, idle.index, idle.machine)
        };
        let Some(advance) = compute(&machine, idle, machine_of).await? else {
            let why = stored.summary["stop"]["reason"].as_str().unwrap_or("done");
            let why = format!("restart {index} was not stopped by the competition: {why}");
            return Ok(Resumed::Refused(why));
        };
        let to_store = (stored.id, version, bound_to);
        let new = self.new_step(&machine, study, (step, index), to_store, advance);
        if !self.store.reopen(new.await?, &takers).await? {
            let state = self.store.study(study).await?.map(|s| s.state.to_string());
            let state = state.unwrap_or_default();
            return Ok(Resumed::Refused(format!("study {study} is {state}")));
        }
        info!(%study, step, restart = index, "brought back");
        self.announce();
        self.advance_in_background(stored.id);
        self.follow_in_background(study.clone());
        Ok(Resumed::Yes)
    }
}

/// Computes outside the threads that answer requests.
async fn compute<T: Send + 'static>(
    machine: &Arc<StudyMachine>,
    idle: Batch,
    what: impl FnOnce(&StudyMachine, Batch) -> Result<T, MachineError> + Send + 'static,
) -> Result<T, MachineError> {
    let (step, restart) = (idle.step, idle.index);
    let machine = Arc::clone(machine);
    let computed = tokio::task::spawn_blocking(move || what(&machine, idle)).await;
    computed.unwrap_or_else(|panic| Err(broken(step, restart, &panic)))
}
