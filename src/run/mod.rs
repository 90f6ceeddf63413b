//! `salp run`: a whole study on this machine. The coordinator runs in this process on a SQLite file in DIR, workers are
//! child processes, and a report is written at the end. The same study in the same DIR goes on where it was.

pub mod active;
mod coordinator;
pub mod document;
mod finer;
mod folder;
mod optima;
mod page;
mod progress;
pub mod report;
pub mod reproduce;
pub mod steps;
mod sweep;
mod winner;
mod workers;

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use clap::Args;
use salp_core::document::Sweep;
use salp_core::fault::Faults;
use salp_core::study::spec::Model;
use salp_core::study::{Study, read_study};
use salp_protocol::{StudyId, StudyState};
use salp_worker::Client;
use serde_json::Value;
use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM};
use signal_hook::flag;

use crate::failure::Failure;
use crate::input::DocumentArguments;
use crate::output::{Output, note};
use crate::parallel::cores;
use coordinator::Coordinator;
use document::Results;
use folder::RunFolder;
use progress::Progress;
use report::Settings;
use workers::Workers;

/// Questions to the coordinator in a row that may find no answer, each within a minute, and the time between them.
const MOST_IN_VAIN: usize = 30;
const BETWEEN_ASKS: Duration = Duration::from_secs(1);

/// Arguments of `salp run`.
#[derive(Args)]
pub struct Run {
    #[command(flatten)]
    study: DocumentArguments,
    /// Worker processes [default: one per core]
    #[arg(long, value_parser = clap::value_parser!(u16).range(1..=1024))]
    workers: Option<u16>,
    /// Folder of the results [default: salp-out/NAME-HASH, the first 8 digits of the study's hash]
    #[arg(long)]
    out: Option<PathBuf>,
    /// Starts over: removes what an earlier run left in the folder
    #[arg(long)]
    fresh: bool,
    /// Only this step and those that it takes from
    #[arg(long, value_name = "ID")]
    step: Option<String>,
    /// Folder of an earlier run of the same build: what was evaluated there is known here
    #[arg(long, value_name = "DIR")]
    known: Option<PathBuf>,
    /// Says how far the best design's objective is from that of its model: six more solves when the study has ended
    #[arg(long)]
    numerical_error: bool,
    /// Lets the study start its programs
    #[arg(long)]
    allow_commands: bool,
    /// Runs the study at several values of a field, each in a folder of its own: p_over_mu=0.02..0.07:6,
    /// `step[0].constraints.stretch=1.5,1.85,2.0`
    #[arg(long, value_name = "PATH=VALUES")]
    sweep: Option<String>,
}

/// A study that has ended, or was paused.
struct Ended {
    state: StudyState,
    results: Results,
    document: Value,
    /// The summary; empty of a paused study.
    text: String,
}

impl Ended {
    fn well(&self) -> Result<(), Failure> {
        match (self.state, self.results.failure()) {
            (StudyState::Failed, why) => Err(Failure::Study(why.unwrap_or_default().to_owned())),
            (StudyState::Cancelled, _) => Err(Failure::Study("it was cancelled".into())),
            _ => Ok(()),
        }
    }
}

impl Run {
    /// Runs, resumes, or reports again.
    pub fn run(self, output: Output) -> Result<(), Failure> {
        let document = self.study.read()?;
        let interrupted = interrupted()?;
        if let Some(sweep) = &self.sweep {
            return self.sweep(&document, &Sweep::read(sweep)?, &interrupted, output);
        }
        let mut study = read_study(&document, true)?;
        if let Some(step) = &self.step {
            study = study.needed_for(step).ok_or_else(|| {
                let ids: Vec<&str> = study.steps.iter().map(|s| s.id.as_str()).collect();
                let message = format!("no step is named \"{step}\"; there are {}", ids.join(", "));
                Failure::fault("step", message)
            })?;
        }
        self.check_programs(&study)?;
        let ended = self.carry_out(&study, self.folder(&study), &interrupted)?;
        if ended.state == StudyState::Paused {
            if output.json {
                output.line(&ended.document.to_string());
            }
            return Err(Failure::Paused);
        }
        output.print(&ended.document, || ended.text.clone());
        ended.well()
    }

    fn carry_out(
        &self,
        study: &Study,
        folder: PathBuf,
        interrupted: &AtomicBool,
    ) -> Result<Ended, Failure> {
        let programs = self.allow_commands.then(|| self.study.folder().to_owned());
        let setting = Setting {
            workers: self.workers.map_or_else(cores, usize::from),
            fresh: self.fresh,
            known: self.known.clone(),
            numerical_error: self.numerical_error,
            programs,
        };
        setting.carry_out(study, folder, interrupted)
    }

    fn folder(&self, study: &Study) -> PathBuf {
        self.out.clone().unwrap_or_else(|| {
            let hash: String = study.fingerprint().chars().take(8).collect();
            PathBuf::from("salp-out").join(format!("{}-{hash}", study.name))
        })
    }

    fn check_programs(&self, study: &Study) -> Result<(), Failure> {
        let mut faults = Faults::default();
        for (i, step) in study.steps.iter().enumerate() {
            if matches!(step.model, Model::Command(_)) && !self.allow_commands {
                faults.add(
                    format!("step[{i}].model"),
                    "starts a program: say --allow-commands if you trust it",
                );
            }
        }
        Ok(faults.check(())?)
    }
}

/// How studies are run.
struct Setting {
    /// Worker processes.
    workers: usize,
    /// Whether what an earlier run left is removed.
    fresh: bool,
    /// Folder whose results are known.
    known: Option<PathBuf>,
    /// Whether the best design's numerical error is computed.
    numerical_error: bool,
    /// Where programs are looked up, if the study may start any.
    programs: Option<PathBuf>,
}

impl Setting {
    /// A study in its folder, until it ends or is interrupted.
    fn carry_out(
        &self,
        study: &Study,
        folder: PathBuf,
        interrupted: &AtomicBool,
    ) -> Result<Ended, Failure> {
        let count = self.workers;
        let mut folder = RunFolder::open(folder, study, self.fresh)?;
        if let Some(earlier) = &self.known {
            folder.know(earlier)?;
        }
        let study = &folder.with_meshes(study)?;
        let coordinator = Coordinator::start(&folder.store(), self.programs.is_some())?;
        let client = coordinator.client();
        // The resolved document: the same study is the same text, whatever its file looks like.
        let created = client.submit(&study.document(), Some(&study.fingerprint()))?;
        folder.begun(&created.id, coordinator.url())?;
        let job = Job {
            client: &client,
            id: &created.id,
            coordinator: &coordinator,
            workers: count,
            programs: self.programs.as_deref(),
        };
        let state = job.carry_out(study, &mut folder, interrupted)?;
        folder.ended()?;
        let results = Results::fetch(&client, &created.id, study, folder.seconds())?;
        coordinator.stop()?;
        let mut document = results.document(state);
        let text = if state == StudyState::Paused {
            String::new()
        } else {
            let settings = Settings {
                threads: count,
                numerical_error: self.numerical_error,
            };
            report::write(
                &folder.at("report"),
                study,
                &results,
                &mut document,
                &settings,
            )?
        };
        Ok(Ended {
            state,
            results,
            document,
            text,
        })
    }
}

/// Set at the first SIGINT, SIGTERM or SIGHUP; the second one ends this process at once, and its children with it.
fn interrupted() -> Result<Arc<AtomicBool>, Failure> {
    let interrupted = Arc::new(AtomicBool::new(false));
    for signal in [SIGINT, SIGTERM, SIGHUP] {
        flag::register_conditional_shutdown(signal, 3, Arc::clone(&interrupted))
            .and_then(|_| flag::register(signal, Arc::clone(&interrupted)))
            .map_err(|source| Failure::System {
                doing: "take signals",
                source,
            })?;
    }
    Ok(interrupted)
}

/// A submitted study and who is to work on it.
struct Job<'a> {
    client: &'a Client,
    id: &'a StudyId,
    coordinator: &'a Coordinator,
    workers: usize,
    programs: Option<&'a Path>,
}

impl Job<'_> {
    /// The study's state, and what has happened since the last look.
    fn look(&self, progress: &mut Progress, at_once: bool) -> Result<StudyState, Failure> {
        let state = self.client.study(self.id)?.state;
        let wait_s = if state.is_final() || at_once {
            0.0
        } else {
            0.4
        };
        progress.follow(self.client, self.id, wait_s)?;
        Ok(state)
    }

    /// Follows the study until it ends or is interrupted; then it is paused, and every worker has ended.
    fn carry_out(
        &self,
        study: &Study,
        folder: &mut RunFolder,
        interrupted: &AtomicBool,
    ) -> Result<StudyState, Failure> {
        let mut state = self.client.study(self.id)?.state;
        if state == StudyState::Paused {
            state = self.client.command(self.id, "resume")?.state;
        }
        if state.is_final() {
            return Ok(state);
        }
        let url = self.coordinator.url();
        let mut workers = Workers::start(folder, url, self.workers, self.programs)?;
        let mut progress = Progress::new(study);
        let mut in_vain = 0;
        loop {
            let asked_to_end = interrupted.load(Ordering::Relaxed);
            match self.look(&mut progress, asked_to_end) {
                Ok(found) => {
                    (state, in_vain) = (found, 0);
                    if state.is_final() || asked_to_end {
                        break;
                    }
                }
                // On a machine with other work to do an answer may take its time: nothing is lost by waiting for it.
                Err(Failure::Client(failure))
                    if failure.is_passing()
                        && self.coordinator.is_running()
                        && in_vain < MOST_IN_VAIN =>
                {
                    in_vain += 1;
                    note(&format!("asking again: {failure}"));
                    std::thread::sleep(BETWEEN_ASKS);
                }
                Err(failure) => return Err(failure),
            }
            workers.look_after(folder)?;
            folder.tick()?;
        }
        progress.finish();
        if !state.is_final() {
            note("pausing: evaluations under way are given back");
            state = match self.client.command(self.id, "pause") {
                Ok(view) => view.state,
                // It may have ended in this very moment.
                Err(_) => self.client.study(self.id)?.state,
            };
        }
        workers.end(!state.is_final());
        Ok(state)
    }
}
