//! Worker processes: children of this one, in groups of their own so that Ctrl-C reaches only this process, and ended with
//! it however it ends: each reads the end of a pipe that this process never writes to.

use std::fs::File;
use std::os::unix::process::CommandExt as _;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use rustix::process::{Pid, Signal, kill_process};

use super::folder::RunFolder;
use crate::failure::Failure;
use crate::output::note;

/// How long a worker may take to end before it is killed.
const GRACE: Duration = Duration::from_secs(5);
/// A worker that lived shorter died at its start.
const SHORT_LIFE: Duration = Duration::from_secs(2);
/// So many deaths at the start in a row end the run.
const DEATHS: usize = 4;

/// Running workers.
pub struct Workers {
    url: String,
    programs: Option<PathBuf>,
    logs: PathBuf,
    children: Vec<(Child, Instant)>,
    deaths: usize,
}

impl Workers {
    /// Starts `count` workers. `programs`: they may start programs, looked up in this folder.
    pub fn start(
        folder: &mut RunFolder,
        url: &str,
        count: usize,
        programs: Option<&Path>,
    ) -> Result<Self, Failure> {
        let logs = folder.at("logs");
        std::fs::create_dir_all(&logs).map_err(|source| Failure::File {
            doing: "create",
            path: logs.clone(),
            source,
        })?;
        let mut workers = Self {
            url: url.to_owned(),
            programs: programs.map(Path::to_owned),
            logs,
            children: Vec::new(),
            deaths: 0,
        };
        for index in 0..count {
            let child = workers.spawn(index)?;
            workers.children.push((child, Instant::now()));
        }
        folder.workers(workers.pids())?;
        Ok(workers)
    }

    fn pids(&self) -> Vec<u32> {
        self.children.iter().map(|(child, _)| child.id()).collect()
    }

    fn spawn(&self, index: usize) -> Result<Child, Failure> {
        let refused = |source| Failure::System {
            doing: "start a worker",
            source,
        };
        let log = self.logs.join(format!("worker-{index}.log"));
        let log = File::options()
            .create(true)
            .append(true)
            .open(&log)
            .map_err(|source| Failure::File {
                doing: "write",
                path: log.clone(),
                source,
            })?;
        let mut command = Command::new(std::env::current_exe().map_err(refused)?);
        command.args(["work", &self.url, "--die-with-parent"]);
        if let Some(folder) = &self.programs {
            command.arg("--allow-commands").arg("--folder").arg(folder);
        }
        command
            .stdin(Stdio::piped())
            .stdout(log.try_clone().map_err(refused)?)
            .stderr(log)
            .process_group(0)
            .spawn()
            .map_err(refused)
    }

    /// Replaces workers that died.
    pub fn look_after(&mut self, folder: &mut RunFolder) -> Result<(), Failure> {
        for index in 0..self.children.len() {
            let (child, started) = &mut self.children[index];
            let Ok(Some(status)) = child.try_wait() else {
                continue;
            };
            let (pid, lived) = (child.id(), started.elapsed());
            note(&format!(
                "worker {index} (process {pid}) ended with {status}; another one takes its place"
            ));
            self.deaths = if lived < SHORT_LIFE {
                self.deaths + 1
            } else {
                0
            };
            if self.deaths >= DEATHS {
                let log = self.logs.join(format!("worker-{index}.log"));
                self.end(true);
                return Err(Failure::Worker(format!(
                    "workers end as soon as they start, see {}",
                    log.display()
                )));
            }
            let child = self.spawn(index)?;
            self.children[index] = (child, Instant::now());
            folder.workers(self.pids())?;
        }
        Ok(())
    }

    /// Ends them: after the evaluation they have, or `at_once`, which gives it back.
    pub fn end(&mut self, at_once: bool) {
        for _ in 0..if at_once { 2 } else { 1 } {
            for (child, _) in &mut self.children {
                // One that has ended already is not signalled: its id may be another's by now.
                if matches!(child.try_wait(), Ok(None)) {
                    let _ = kill_process(Pid::from_child(child), Signal::TERM);
                }
            }
            // Two signals at once would be seen as one.
            std::thread::sleep(Duration::from_millis(if at_once { 50 } else { 0 }));
        }
        let until = Instant::now() + GRACE;
        for (child, _) in &mut self.children {
            while matches!(child.try_wait(), Ok(None)) && Instant::now() < until {
                std::thread::sleep(Duration::from_millis(20));
            }
            // Both fail only on a child that has ended.
            let _ = child.kill();
            let _ = child.wait();
        }
        self.children.clear();
    }
}

impl Drop for Workers {
    fn drop(&mut self) {
        if !self.children.is_empty() {
            self.end(true);
        }
    }
}
