//! A running program: its process group, its pipes, its end.

use std::collections::BTreeSet;
use std::io::{BufRead, BufReader, Read, Write};
use std::os::unix::process::CommandExt;
use std::process::{Child, ChildStdin, Command, Stdio};
use std::sync::mpsc::{Receiver, RecvTimeoutError, channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

use rustix::process::{Pid, Signal, kill_process_group, set_parent_process_death_signal};

use super::Failure;
use super::folder::Folder;

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

/// Process groups that are alive.
pub fn alive() -> std::sync::MutexGuard<'static, BTreeSet<i32>> {
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

/// A program that runs.
pub struct Running {
    child: Child,
    group: i32,
    _folder: Folder,
    input: ChildStdin,
    lines: Receiver<String>,
    error: Arc<Mutex<Vec<u8>>>,
    /// CPU time that earlier points paid for, s.
    paid_s: f64,
    pub answered: bool,
}

impl Running {
    /// Starts it in an empty folder of its own, as the head of a process group.
    pub fn start(argv: &[String]) -> Result<Self, Failure> {
        let because =
            |what: &str, failure: std::io::Error| Failure::Because(format!("{what}: {failure}"));
        let Some((program, arguments)) = argv.split_first() else {
            return Err(Failure::Because("no program is named".into()));
        };
        let folder =
            Folder::new().map_err(|failure| because("cannot make an empty folder", failure))?;
        let mut command = Command::new(program);
        command
            .args(arguments)
            .current_dir(folder.work())
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
        let mut child = command
            .spawn()
            .map_err(|failure| because(&format!("cannot start {program}"), failure))?;
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
            _folder: folder,
            input,
            lines,
            error: kept,
            paid_s: 0.0,
            answered: false,
        })
    }

    /// Hands a point over; false where the program has ended.
    pub fn asks(&mut self, question: &str) -> bool {
        if !matches!(self.child.try_wait(), Ok(None)) {
            return false;
        }
        self.input
            .write_all(question.as_bytes())
            .and_then(|()| self.input.flush())
            .is_ok()
    }

    /// Waits for a line.
    pub fn wait(
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
    pub fn stays_or_ended_well(&mut self) -> Result<(), Failure> {
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
    pub fn ended(&mut self, when: &str) -> Failure {
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
    pub fn charge(&mut self) -> Option<f64> {
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
