//! Programs as models. A program is started in an empty folder of its own, reads lines
//! `{"x": [...], "want_gradient": bool}` and answers one line each, `{"objective": f, "constraints": [...],
//! "gradient": [...] | null, "constraint_gradients": [[...]] | null}`. It is kept alive between points and started anew
//! after it ended. A non-zero exit, no line, a wrong length, a non-finite number, or a passed time limit is a failed
//! evaluation. However it ends, its whole process group ends with it.

use std::collections::BTreeSet;
use std::io::{BufRead, BufReader, Read, Write};
use std::os::unix::process::CommandExt;
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdin, Command, Stdio};
use std::sync::mpsc::{Receiver, RecvTimeoutError, channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

use rustix::process::{Pid, Signal, kill_process_group, set_parent_process_death_signal};
use salp_core::study::{Outcome, OutcomeStatus};
use serde::Deserialize;
use serde_json::json;

/// How often a waiting worker looks whether it is to stop.
const LOOK: Duration = Duration::from_millis(20);
/// How long after its first answer a program may still show that it ends after each point, and how.
const FIRST_GRACE: Duration = Duration::from_millis(100);
/// Longest line of an answer, bytes.
const LONGEST_LINE: u64 = 256 << 20;
/// What is kept of a program's standard error for the reason of a failure, bytes.
const KEPT_ERROR: usize = 2000;

/// Process groups that are alive, for an end of the worker that runs no destructor.
static ALIVE: Mutex<BTreeSet<i32>> = Mutex::new(BTreeSet::new());

fn alive() -> std::sync::MutexGuard<'static, BTreeSet<i32>> {
    ALIVE.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Kills every program of this process.
pub fn kill_all() {
    for &group in alive().iter() {
        kill_group(group);
    }
}

fn kill_group(group: i32) {
    if let Some(group) = Pid::from_raw(group) {
        // It fails only where the group has ended already.
        let _ = kill_process_group(group, Signal::KILL);
    }
}

/// What a program must answer.
#[derive(Clone, Copy, Debug)]
pub struct Expected {
    /// Design variables.
    pub variables: usize,
    /// Constraints, inequalities and equalities together.
    pub constraints: usize,
    /// Whether it gives gradients where they are wanted.
    pub gradient: bool,
}

/// A program as a model.
pub struct Program {
    argv: Vec<String>,
    time_limit: Duration,
    expected: Expected,
    running: Option<Running>,
}

struct Running {
    child: Child,
    group: i32,
    folder: PathBuf,
    input: ChildStdin,
    lines: Receiver<String>,
    error: Arc<Mutex<Vec<u8>>>,
    /// CPU time that earlier points paid for, s.
    paid_s: f64,
    answered: bool,
}

#[derive(Deserialize)]
struct Answer {
    objective: Option<f64>,
    #[serde(default)]
    constraints: Vec<f64>,
    #[serde(default)]
    gradient: Option<Vec<f64>>,
    #[serde(default)]
    constraint_gradients: Option<Vec<Vec<f64>>>,
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
                match file.canonicalize() {
                    Ok(path) if path.is_file() => path.to_string_lossy().into_owned(),
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

impl Running {
    fn start(argv: &[String]) -> Result<Self, Failure> {
        let because =
            |what: &str, failure: std::io::Error| Failure::Because(format!("{what}: {failure}"));
        let Some((program, arguments)) = argv.split_first() else {
            return Err(Failure::Because("no program is named".into()));
        };
        let once = getrandom::u64().map_err(|failure| Failure::Because(failure.to_string()))?;
        let folder = std::env::temp_dir().join(format!("salp-command-{once:016x}"));
        std::fs::create_dir(&folder)
            .map_err(|failure| because("cannot make an empty folder", failure))?;
        let mut command = Command::new(program);
        command
            .args(arguments)
            .current_dir(&folder)
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .process_group(0);
        // SAFETY: between fork and exec only one system call is made; it allocates nothing and takes no lock.
        unsafe {
            command.pre_exec(|| {
                set_parent_process_death_signal(Some(Signal::KILL)).map_err(Into::into)
            });
        }
        let mut child = command.spawn().map_err(|failure| {
            let _ = std::fs::remove_dir_all(&folder);
            because(&format!("cannot start {program}"), failure)
        })?;
        let group = i32::try_from(child.id()).unwrap_or(i32::MAX);
        alive().insert(group);
        let (Some(input), Some(output), Some(error)) =
            (child.stdin.take(), child.stdout.take(), child.stderr.take())
        else {
            return Err(Failure::Because("the program has no pipes".into()));
        };
        let (send, lines) = channel();
        thread::spawn(move || {
            let mut output = BufReader::new(output);
            let mut line = String::new();
            while matches!(
                output.by_ref().take(LONGEST_LINE).read_line(&mut line),
                Ok(1..)
            ) {
                if send.send(std::mem::take(&mut line)).is_err() {
                    break;
                }
            }
        });
        let kept = Arc::new(Mutex::new(Vec::new()));
        let theirs = Arc::clone(&kept);
        thread::spawn(move || keep_end(error, &theirs));
        Ok(Self {
            child,
            group,
            folder,
            input,
            lines,
            error: kept,
            paid_s: 0.0,
            answered: false,
        })
    }

    /// Hands a point over; false where the program has ended.
    fn asks(&mut self, question: &str) -> bool {
        if !matches!(self.child.try_wait(), Ok(None)) {
            return false;
        }
        self.input
            .write_all(question.as_bytes())
            .and_then(|()| self.input.flush())
            .is_ok()
    }

    fn wait(
        &mut self,
        until: Instant,
        limit: Duration,
        cancel: &dyn Fn() -> bool,
    ) -> Result<String, Failure> {
        loop {
            match self.lines.recv_timeout(LOOK) {
                Ok(line) => return Ok(line),
                Err(RecvTimeoutError::Disconnected) => {
                    return Err(self.ended("without an answer"));
                }
                Err(RecvTimeoutError::Timeout) if cancel() => return Err(Failure::Cancelled),
                Err(RecvTimeoutError::Timeout) if Instant::now() >= until => {
                    return Err(Failure::Because(format!(
                        "no answer within {} s",
                        limit.as_secs_f64()
                    )));
                }
                Err(RecvTimeoutError::Timeout) => {}
            }
        }
    }

    /// A program that ends after each point must end well.
    fn stays_or_ended_well(&mut self) -> Result<(), Failure> {
        let until = Instant::now() + FIRST_GRACE;
        while Instant::now() < until {
            match self.child.try_wait() {
                Ok(Some(status)) if status.success() => return Ok(()),
                Ok(Some(_)) | Err(_) => return Err(self.ended("after its answer")),
                Ok(None) => thread::sleep(Duration::from_millis(2)),
            }
        }
        Ok(())
    }

    /// How it ended, with the end of its standard error.
    fn ended(&mut self, when: &str) -> Failure {
        let until = Instant::now() + Duration::from_secs(1);
        let mut how = "it closed its output".to_owned();
        while Instant::now() < until {
            match self.child.try_wait() {
                Ok(Some(status)) => {
                    how = format!("it ended with {status}");
                    break;
                }
                Ok(None) => thread::sleep(Duration::from_millis(2)),
                Err(failure) => {
                    how = failure.to_string();
                    break;
                }
            }
        }
        let error = self.error.lock().unwrap_or_else(PoisonError::into_inner);
        let said = String::from_utf8_lossy(&error);
        let said = said.trim();
        let colon = if said.is_empty() { "" } else { ": " };
        Failure::Because(format!("{how} {when}{colon}{said}"))
    }

    /// CPU time since the last point, s; `None` once it has ended.
    fn charge(&mut self) -> Option<f64> {
        let total = cpu_s(self.group)?;
        let since = total - self.paid_s;
        self.paid_s = total;
        Some(since.max(0.0))
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        kill_group(self.group);
        let _ = self.child.wait();
        alive().remove(&self.group);
        let _ = std::fs::remove_dir_all(&self.folder);
    }
}

/// CPU time of a process over its threads, s. The kernel counts it in nanoseconds; the children of a program are not in it.
fn cpu_s(process: i32) -> Option<f64> {
    let mut nanoseconds: u64 = 0;
    for task in std::fs::read_dir(format!("/proc/{process}/task")).ok()? {
        let text = std::fs::read_to_string(task.ok()?.path().join("schedstat")).ok()?;
        nanoseconds += text.split_whitespace().next()?.parse::<u64>().ok()?;
    }
    (nanoseconds > 0).then_some(nanoseconds as f64 * 1e-9)
}

fn keep_end(mut error: impl Read, kept: &Mutex<Vec<u8>>) {
    let mut buffer = [0_u8; 4096];
    while let Ok(count @ 1..) = error.read(&mut buffer) {
        let mut kept = kept.lock().unwrap_or_else(PoisonError::into_inner);
        kept.extend_from_slice(&buffer[..count]);
        let excess = kept.len().saturating_sub(KEPT_ERROR);
        kept.drain(..excess);
    }
}

impl Expected {
    fn read(self, line: &str, want_gradient: bool) -> Result<Answer, Failure> {
        let because = |reason: String| Err(Failure::Because(reason));
        let answer: Answer = match serde_json::from_str(line) {
            Ok(answer) => answer,
            Err(fault) => return because(format!("the answer cannot be read: {fault}")),
        };
        if !answer.objective.is_some_and(f64::is_finite) {
            return because("the objective is not a finite number".into());
        }
        if let Some(fault) = row_fault("constraints", &answer.constraints, self.constraints) {
            return because(fault);
        }
        if want_gradient && self.gradient {
            let Some(gradient) = &answer.gradient else {
                return because("the gradient is missing".into());
            };
            if let Some(fault) = row_fault("gradient", gradient, self.variables) {
                return because(fault);
            }
            let rows = answer.constraint_gradients.as_deref().unwrap_or_default();
            if rows.len() != self.constraints {
                return because(format!(
                    "constraint_gradients has {} rows, {} are expected",
                    rows.len(),
                    self.constraints
                ));
            }
            for row in rows {
                if let Some(fault) = row_fault("constraint_gradients", row, self.variables) {
                    return because(fault);
                }
            }
        }
        Ok(answer)
    }
}

fn row_fault(name: &str, row: &[f64], expected: usize) -> Option<String> {
    if row.len() != expected {
        return Some(format!(
            "{name} has {} numbers, {expected} are expected",
            row.len()
        ));
    }
    row.iter()
        .any(|value| !value.is_finite())
        .then(|| format!("{name} holds a number that is not finite"))
}

#[cfg(test)]
mod tests {
    use super::*;

    const EXPECTED: Expected = Expected {
        variables: 1,
        constraints: 1,
        gradient: false,
    };

    fn python(script: &str) -> Program {
        let argv = ["python3".into(), "-uc".into(), script.into()];
        Program::new(&argv, Path::new("/"), Duration::from_secs(5), EXPECTED)
    }

    fn reason(outcome: &Outcome) -> String {
        match &outcome.status {
            OutcomeStatus::Failed { reason } => reason.clone(),
            other => format!("{other:?}"),
        }
    }

    const SQUARE: &str = "
import sys, json, os
for line in sys.stdin:
    x = json.loads(line)['x'][0]
    print(json.dumps({'objective': x * x, 'constraints': [os.getpid()]}))";

    #[test]
    fn a_program_is_kept_alive_and_its_folder_is_empty() {
        let mut program = python(&format!(
            "import os\nassert os.listdir('.') == []\n{SQUARE}"
        ));
        let first = program.evaluate(&[3.0], false, &|| false);
        let second = program.evaluate(&[0.1], false, &|| false);
        assert_eq!(first.objective, Some(9.0), "{}", reason(&first));
        assert_eq!(second.objective, Some(0.1 * 0.1));
        assert_eq!(first.constraints, second.constraints);
        assert!(first.cpu_s > 0.0);
    }

    #[test]
    fn a_program_may_end_after_each_point_but_must_end_well() {
        let one = "import sys, json\njson.loads(input())\nprint('{\"objective\": 1, \"constraints\": [0]}')\n";
        let mut program = python(one);
        for _ in 0..2 {
            assert_eq!(
                program.evaluate(&[3.0], false, &|| false).objective,
                Some(1.0)
            );
        }
        let mut program = python(&format!("{one}sys.exit(3)"));
        let outcome = program.evaluate(&[3.0], false, &|| false);
        assert!(
            reason(&outcome).contains("exit status: 3"),
            "{}",
            reason(&outcome)
        );
    }

    #[test]
    fn failures_say_why() {
        let cases = [
            (
                "import sys\ninput()\nprint('no', file=sys.stderr)\nsys.exit(2)",
                "exit status: 2 without an answer: no",
            ),
            ("input()", "without an answer"),
            (
                "input()\nprint('{\"objective\": NaN, \"constraints\": [0]}')",
                "cannot be read",
            ),
            (
                "input()\nprint('{\"objective\": 1e999, \"constraints\": [0]}')",
                "cannot be read",
            ),
            (
                "input()\nprint('{\"objective\": null, \"constraints\": [0]}')",
                "not a finite number",
            ),
            (
                "input()\nprint('{\"objective\": 1, \"constraints\": [0, 0]}')",
                "has 2 numbers, 1 are expected",
            ),
        ];
        for (script, expected) in cases {
            let outcome = python(script).evaluate(&[1.0], false, &|| false);
            assert!(
                reason(&outcome).contains(expected),
                "{script}: {}",
                reason(&outcome)
            );
        }
        let argv = ["/nowhere/program".to_owned()];
        let mut program = Program::new(&argv, Path::new("/"), Duration::from_secs(5), EXPECTED);
        let outcome = program.evaluate(&[1.0], false, &|| false);
        assert!(
            reason(&outcome).contains("cannot start"),
            "{}",
            reason(&outcome)
        );
    }

    #[test]
    fn the_time_limit_and_a_cancellation_leave_no_process_behind() {
        let script = "
import subprocess, sys, time
child = subprocess.Popen(['sleep', '60'])
print(child.pid, file=sys.stderr)
time.sleep(60)";
        let mut program = python(script);
        program.time_limit = Duration::from_millis(400);
        let outcome = program.evaluate(&[1.0], false, &|| false);
        assert!(
            reason(&outcome).contains("no answer within 0.4 s"),
            "{}",
            reason(&outcome)
        );
        assert!(program.running.is_none() && alive().is_empty() || alive().len() < 10);

        program.time_limit = Duration::from_secs(60);
        let started = Instant::now();
        let cancel = || started.elapsed() > Duration::from_millis(400);
        let outcome = program.evaluate(&[1.0], false, &cancel);
        assert_eq!(outcome.status, OutcomeStatus::Cancelled);
        assert!(started.elapsed() < Duration::from_secs(5));
    }
}
