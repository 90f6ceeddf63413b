//! Why a verb did not end well, and the exit code that says so.

use std::path::PathBuf;
use std::process::ExitCode;

use salp_core::fault::{Fault, Faults};
use salp_protocol::problem::{INVALID_STUDY, UNKNOWN_STUDY};
use salp_worker::{ClientError, WorkerError};
use serde_json::{Value, json};

/// Why a verb did not end well.
#[derive(Debug, thiserror::Error)]
pub enum Failure {
    /// Everything that can be decided from the documents and arguments alone.
    #[error("{0}")]
    BadInput(Faults),
    /// The run failed; its document is already printed.
    #[error("{0}")]
    Run(&'static str),
    /// A study that failed.
    #[error("the study failed: {0}")]
    Study(String),
    /// Paused or interrupted.
    #[error("paused: the same command goes on from here")]
    Paused,
    /// The coordinator cannot be asked, or says no.
    #[error("{0}")]
    Client(ClientError),
    /// A file of ours cannot be written or read.
    #[error("cannot {doing} {path}: {source}")]
    File {
        /// What was tried.
        doing: &'static str,
        /// The file.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// The coordinator does not start, or ends by itself.
    #[error("the coordinator failed: {0}")]
    Coordinator(String),
    /// A worker does not start, or all of them die.
    #[error("{0}")]
    Worker(String),
    /// The system refuses a thread, a signal handler, a process.
    #[error("cannot {doing}: {source}")]
    System {
        /// What was tried.
        doing: &'static str,
        /// Why.
        source: std::io::Error,
    },
}

impl Failure {
    /// A single fault.
    pub fn fault(path: impl Into<String>, message: impl Into<String>) -> Self {
        Self::BadInput(Faults(vec![Fault {
            path: path.into(),
            message: message.into(),
        }]))
    }

    /// 1 a failed run, 2 bad input, 3 paused.
    pub fn exit_code(&self) -> ExitCode {
        match self {
            Self::BadInput(_) => ExitCode::from(2),
            Self::Paused => ExitCode::from(3),
            _ => ExitCode::FAILURE,
        }
    }

    /// The document of `--json`; `None` where the verb has printed its own.
    pub fn document(&self) -> Option<Value> {
        match self {
            Self::BadInput(faults) => Some(json!({ "status": "bad_input", "faults": faults })),
            Self::Run(_) | Self::Study(_) | Self::Paused => None,
            Self::Client(ClientError::Refused(problem)) => {
                Some(json!({ "status": "failed", "reason": self.to_string(), "problem": problem }))
            }
            _ => Some(json!({ "status": "failed", "reason": self.to_string() })),
        }
    }
}

impl From<Faults> for Failure {
    fn from(faults: Faults) -> Self {
        Self::BadInput(faults)
    }
}

impl From<ClientError> for Failure {
    fn from(error: ClientError) -> Self {
        match error {
            ClientError::Refused(problem) if problem.kind == INVALID_STUDY => {
                Self::BadInput(Faults(problem.faults))
            }
            ClientError::Refused(problem) if problem.kind == UNKNOWN_STUDY => {
                Self::fault("study", problem.detail)
            }
            error => Self::Client(error),
        }
    }
}

impl From<WorkerError> for Failure {
    fn from(error: WorkerError) -> Self {
        match error {
            WorkerError::Address(_) => Self::fault("url", error.to_string()),
            error => Self::Worker(error.to_string()),
        }
    }
}
