//! A study's models on this machine.

use std::collections::BTreeMap;
use std::collections::btree_map::Entry;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use rustix::time::{ClockId, clock_gettime};
use salp_core::equilibrium::{Observer, Phase};
use salp_core::evaluate::evaluate;
use salp_core::study::spec::{CommandModel, Model};
use salp_core::study::{EvaluationRequest, Outcome, OutcomeStatus, Study, read_study};
use serde_json::Value;
use tracing::error;

use crate::command::{Expected, Program};

/// What this worker keeps of a study: its document, its programs, what evaluations leave for the next one.
pub struct Models {
    study: Result<Study, String>,
    folder: Option<PathBuf>,
    programs: BTreeMap<usize, Program>,
}

impl Models {
    /// Reads a study. `folder` is where programs are looked up; `None`: none may be started.
    pub fn read(document: &Value, folder: Option<&Path>) -> Self {
        Self {
            study: read_study(document, true).map_err(|faults| faults.to_string()),
            folder: folder.map(Path::to_owned),
            programs: BTreeMap::new(),
        }
    }

    /// Evaluates. A panic is caught and reported as a failure of ours; what it may have left half-done is thrown away.
    pub fn evaluate(&mut self, request: &EvaluationRequest, cancel: &dyn Fn() -> bool) -> Outcome {
        let started = Instant::now();
        let evaluated = catch_unwind(AssertUnwindSafe(|| self.dispatch(request, cancel)));
        evaluated.unwrap_or_else(|panic| {
            self.programs.clear();
            let said = panic
                .downcast_ref::<String>()
                .map(String::as_str)
                .or_else(|| panic.downcast_ref::<&str>().copied())
                .unwrap_or("without a word");
            error!("the evaluation panicked: {said}");
            let mut outcome = not_converged(format!("a panic, which is a fault of Salp: {said}"));
            outcome.wall_s = started.elapsed().as_secs_f64();
            outcome
        })
    }

    fn dispatch(&mut self, request: &EvaluationRequest, cancel: &dyn Fn() -> bool) -> Outcome {
        let study = match &self.study {
            Ok(study) => study,
            Err(faults) => {
                return not_converged(format!("this worker cannot read the study: {faults}"));
            }
        };
        match study.steps.get(request.step).map(|step| &step.model) {
            Some(Model::Command(model)) => {
                let Some(folder) = &self.folder else {
                    return not_converged("this worker may not start programs".into());
                };
                let program = match self.programs.entry(request.step) {
                    Entry::Occupied(running) => running.into_mut(),
                    Entry::Vacant(place) => match program(study, request.step, model, folder) {
                        Ok(program) => place.insert(program),
                        Err(reason) => return not_converged(reason),
                    },
                };
                program.evaluate(&request.x, request.want_gradient, cancel)
            }
            Some(_) => timed(|| evaluate(study, request, &mut Watch(cancel))),
            None => not_converged(format!("the study has no step {}", request.step)),
        }
    }
}

/// Passes the cancel flag to the solver, which asks at every Newton iteration.
struct Watch<'a>(&'a dyn Fn() -> bool);

impl Observer for Watch<'_> {
    fn enter(&mut self, _phase: Phase) {}

    fn cancelled(&self) -> bool {
        (self.0)()
    }
}

fn program(
    study: &Study,
    step: usize,
    model: &CommandModel,
    folder: &Path,
) -> Result<Program, String> {
    let problem = study.problem(step).map_err(|fault| fault.to_string())?;
    let expected = Expected {
        variables: problem.dimension(),
        constraints: problem.constraints(),
        gradient: model.gradient,
    };
    let limit = Duration::try_from_secs_f64(model.time_limit_s).map_err(|e| e.to_string())?;
    Ok(Program::new(&model.argv, folder, limit, expected))
}

/// Runs on this thread and fills in the times, which the core has no clock for.
fn timed(evaluate: impl FnOnce() -> Outcome) -> Outcome {
    let (started, before) = (Instant::now(), thread_cpu_s());
    let mut outcome = evaluate();
    outcome.wall_s = started.elapsed().as_secs_f64();
    outcome.cpu_s = thread_cpu_s() - before;
    outcome
}

/// CPU time of this thread, s.
fn thread_cpu_s() -> f64 {
    let now = clock_gettime(ClockId::ThreadCPUTime);
    now.tv_sec as f64 + now.tv_nsec as f64 * 1e-9
}

fn not_converged(reason: String) -> Outcome {
    Outcome::without_values(OutcomeStatus::NotConverged {
        reason,
        load_fraction: 0.0,
    })
}
