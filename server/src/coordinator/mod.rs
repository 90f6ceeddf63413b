//! The scheduler: submission and commands here, claims and reports in `work`, the optimiser's step in `step`,
//! restarts that compete in `race`.

mod race;
mod step;
mod work;

use std::collections::HashMap;
use std::sync::{Arc, Mutex, PoisonError};

use salp_core::fault::Faults;
use salp_protocol::{StudyId, StudyState};
use serde_json::Value;
use tokio::sync::watch;
use tracing::{info, warn};

use crate::config::{ConfigError, ServerConfig, random_hex};
use crate::machine::{MachineError, StudyMachine};
use crate::store::{Command, Commanded, NewStudy, Store, StoreError, Submitted};
pub use race::Resumed;
use step::begin_first;

/// Longest time for which a claim is held back, s.
pub const LONGEST_WAIT_S: f64 = 20.0;
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

    /// Takes up what a crash left behind: results without their step, ended steps and those that wait for them, cancellations.
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
        for study in self.store.under_way().await? {
            self.follow_in_background(study);
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

    /// Checks a study and stores it with the first asks of the steps that take nothing from others.
    pub async fn submit(
        &self,
        document: Value,
        body_sha256: String,
        idempotency_key: Option<String>,
    ) -> Result<Submission, CoordinatorError> {
        let machine = StudyMachine::read(&document, self.config.allow_commands)
            .map_err(CoordinatorError::Faults)?;
        let machine = Arc::new(machine);
        let begun = begin_first(&machine).await?;
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
            begun,
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

    fn announce_news(&self) {
        self.news.send_modify(|count| *count += 1);
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
}
