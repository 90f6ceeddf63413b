//! Events of a study.

use serde::{Deserialize, Serialize};

/// Something that happened.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Event {
    /// Grows; give the last one seen as `Last-Event-ID` or `?after=`.
    pub id: i64,
    /// `state`, `evaluation`, `restart` or `step`.
    pub kind: String,
    /// When, ms since 1970 UTC.
    pub created_ms: i64,
    /// What.
    pub data: serde_json::Value,
}

/// Answer of the long poll.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct EventPage {
    /// Events after the given one, at most 1000.
    pub events: Vec<Event>,
}
