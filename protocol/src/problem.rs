//! Problem documents (RFC 9457): how the API says no.

use salp_core::fault::Fault;
use serde::{Deserialize, Serialize};

/// A problem document. `kind` is stable and made for programs, `detail` for people.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Problem {
    /// One of the constants of this module.
    #[serde(rename = "type")]
    pub kind: String,
    /// The kind in words.
    pub title: String,
    /// HTTP status.
    pub status: u16,
    /// This very case in words.
    pub detail: String,
    /// Faults of a refused document.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub faults: Vec<Fault>,
}

/// Media type of a problem document.
pub const MEDIA_TYPE: &str = "application/problem+json";

macro_rules! kinds {
    ($($(#[$doc:meta])* $name:ident = $kind:literal, $status:literal, $title:literal;)*) => {
        $($(#[$doc])* pub const $name: &str = $kind;)*

        /// Status and title of a kind.
        fn describe(kind: &str) -> (u16, &'static str) {
            match kind {
                $($kind => ($status, $title),)*
                _ => (500, "internal error"),
            }
        }
    };
}

kinds! {
    /// No such path.
    NOT_FOUND = "urn:salp:not-found", 404, "not found";
    /// No such study.
    UNKNOWN_STUDY = "urn:salp:unknown-study", 404, "unknown study";
    /// No such restart.
    UNKNOWN_RESTART = "urn:salp:unknown-restart", 404, "unknown restart";
    /// No such evaluation.
    UNKNOWN_EVALUATION = "urn:salp:unknown-evaluation", 404, "unknown evaluation";
    /// The path does not know the method.
    METHOD_NOT_ALLOWED = "urn:salp:method-not-allowed", 405, "method not allowed";
    /// The document has faults.
    INVALID_STUDY = "urn:salp:invalid-study", 422, "the study has faults";
    /// The body is not JSON or not of the expected form.
    INVALID_BODY = "urn:salp:invalid-body", 400, "the body cannot be read";
    /// A query parameter cannot be read.
    INVALID_QUERY = "urn:salp:invalid-query", 400, "the query cannot be read";
    /// The body is larger than the limit.
    TOO_LARGE = "urn:salp:too-large", 413, "the body is too large";
    /// The Idempotency-Key was used for another body.
    KEY_REUSED = "urn:salp:idempotency-key-reused", 422, "the Idempotency-Key was used for another study";
    /// The study's state does not allow this.
    WRONG_STATE = "urn:salp:wrong-state", 409, "the study's state does not allow this";
    /// The fence is not the latest one.
    STALE_LEASE = "urn:salp:stale-lease", 409, "the lease is not held any more";
    /// Work waits, but for workers of another build or instruction set.
    WORKER_MISMATCH = "urn:salp:worker-mismatch", 409, "the waiting work needs another build or instruction set";
    /// Work waits, but it starts programs.
    COMMANDS_NOT_ALLOWED = "urn:salp:commands-not-allowed", 409, "the waiting work starts programs";
    /// The worker was told to end.
    DRAINED = "urn:salp:drained", 409, "the worker was told to end";
    /// No token, or not the right one.
    UNAUTHORISED = "urn:salp:unauthorised", 401, "a token is needed";
    /// A web page of another site asks, through the user's browser.
    FOREIGN_ORIGIN = "urn:salp:foreign-origin", 403, "another site may not use this coordinator";
    /// The coordinator is going down.
    UNAVAILABLE = "urn:salp:unavailable", 503, "the coordinator is going down";
    /// A fault of ours.
    INTERNAL = "urn:salp:internal", 500, "internal error";
}

impl Problem {
    /// A problem of a kind, its status and title the kind's own.
    pub fn new(kind: &str, detail: impl Into<String>) -> Self {
        let (status, title) = describe(kind);
        Self {
            kind: kind.to_owned(),
            title: title.to_owned(),
            status,
            detail: detail.into(),
            faults: Vec::new(),
        }
    }
}

impl std::fmt::Display for Problem {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}: {}", self.title, self.detail)?;
        for fault in &self.faults {
            write!(f, "\n{}: {}", fault.path, fault.message)?;
        }
        Ok(())
    }
}

impl std::error::Error for Problem {}
