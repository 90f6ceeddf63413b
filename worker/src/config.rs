//! What a worker is told at its start.

use std::path::PathBuf;
use std::time::Duration;

/// Set-up of a worker.
#[derive(Clone, Debug)]
pub struct WorkerConfig {
    /// Address of the coordinator, `http://host:port`.
    pub url: String,
    /// Token, where the coordinator wants one.
    pub token: Option<String>,
    /// May start programs for `command` models; their relative paths are looked up in this folder, which is that of the
    /// study file. `None`: may not.
    pub commands: Option<PathBuf>,
    /// Ends at once, programs included, when the standard input ends. A parent that keeps the write end of a pipe open
    /// and never writes thereby takes its workers with it however it ends, by `kill -9` too.
    pub die_with_parent: bool,
    /// Takes SIGTERM and SIGINT: the first one ends the worker after its evaluation, the second one at once.
    pub take_signals: bool,
    /// How long the coordinator may hold a claim back.
    pub wait: Duration,
}

impl WorkerConfig {
    /// A worker for a coordinator, without programs, that takes signals.
    pub fn new(url: impl Into<String>) -> Self {
        Self {
            url: url.into(),
            token: None,
            commands: None,
            die_with_parent: false,
            take_signals: true,
            wait: Duration::from_secs(20),
        }
    }
}
