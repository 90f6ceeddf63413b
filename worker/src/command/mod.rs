//! Programs as models. A program is started in an empty folder of its own, reads lines
//! `{"x": [...], "want_gradient": bool}` and answers one line each, `{"objective": f, "constraints": [...],
//! "gradient": [...] | null, "constraint_gradients": [[...]] | null}`. It is kept alive between points and started anew
//! after it ended. A non-zero exit, no line, a wrong length, a non-finite number, or a passed time limit is a failed
//! evaluation. However it ends, its whole process group ends with it.

mod answer;
mod folder;
mod process;
#[cfg(test)]
mod tests;

use std::path::Path;
use std::time::{Duration, Instant};

use salp_core::study::{Outcome, OutcomeStatus};
use serde_json::json;

use answer::Answer;
pub use answer::Expected;
use process::Running;
pub use process::kill_all;

/// A program as a model.
pub struct Program {
    argv: Vec<String>,
    time_limit: Duration,
    expected: Expected,
    running: Option<Running>,
}

/// Why there is no outcome with values.
enum Failure {
    Cancelled,
    Because(String),
}

impl Program {
    /// A program; arguments that name files in `folder` become absolute.
    pub fn new(argv: &[String], folder: &Path, time_limit: Duration, expected: Expected) -> Self {
        let argv = argv
            .iter()
            .map(|argument| {
                let file = folder.join(argument);
                // Links stay as they are: an interpreter finds its environment by the link's own place.
                match std::path::absolute(&file) {
                    Ok(path) if file.is_file() => path.to_string_lossy().into_owned(),
                    _ => argument.clone(),
                }
            })
            .collect();
        Self {
            argv,
            time_limit,
            expected,
            running: None,
        }
    }

    /// Evaluates a point. `cancel` is asked every 20 ms.
    pub fn evaluate(
        &mut self,
        x: &[f64],
        want_gradient: bool,
        cancel: &dyn Fn() -> bool,
    ) -> Outcome {
        let started = Instant::now();
        let answer = self.answer(x, want_gradient, started, cancel);
        let wall_s = started.elapsed().as_secs_f64();
        let cpu_s = self.running.as_mut().and_then(Running::charge);
        if answer.is_err() {
            self.running = None;
        }
        let mut outcome = Outcome {
            status: OutcomeStatus::Ok,
            objective: None,
            constraints: Vec::new(),
            gradient: None,
            constraint_gradients: None,
            report: None,
            wall_s,
            // A program that has ended takes the count of its CPU time with it.
            cpu_s: cpu_s.unwrap_or(wall_s),
        };
        match answer {
            Ok(answer) => {
                outcome.objective = answer.objective;
                outcome.constraints = answer.constraints;
                if want_gradient && self.expected.gradient {
                    outcome.gradient = answer.gradient;
                    outcome.constraint_gradients = answer.constraint_gradients;
                }
            }
            Err(Failure::Cancelled) => outcome.status = OutcomeStatus::Cancelled,
            Err(Failure::Because(reason)) => outcome.status = OutcomeStatus::Failed { reason },
        }
        outcome
    }

    fn answer(
        &mut self,
        x: &[f64],
        want_gradient: bool,
        started: Instant,
        cancel: &dyn Fn() -> bool,
    ) -> Result<Answer, Failure> {
        let question = format!("{}\n", json!({ "x": x, "want_gradient": want_gradient }));
        let until = started + self.time_limit;
        if self
            .running
            .as_mut()
            .is_some_and(|running| !running.asks(&question))
        {
            // It ended after its last answer, as it may.
            self.running = None;
        }
        if self.running.is_none() {
            let mut running = Running::start(&self.argv)?;
            if !running.asks(&question) {
                return Err(running.ended("before it read a point"));
            }
            self.running = Some(running);
        }
        let Some(running) = &mut self.running else {
            return Err(Failure::Because("the program is not running".into()));
        };
        let line = running.wait(until, self.time_limit, cancel)?;
        let answer = self.expected.read(&line, want_gradient)?;
        if let Some(running) = &mut self.running
            && !std::mem::replace(&mut running.answered, true)
        {
            running.stays_or_ended_well()?;
        }
        Ok(answer)
    }
}
