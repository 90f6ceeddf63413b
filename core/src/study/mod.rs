//! The study document, its restarts, and what an evaluation is asked and answers.

mod band;
mod chambers;
mod design;
mod error;
mod fidelity;
mod fingerprint;
mod model;
mod preset;
pub mod race;
mod read;
pub mod restart;
pub mod result;
mod rows;
mod schema;
mod sequence;
pub mod spec;
mod start;
pub mod surrogate;
pub mod takes;
#[cfg(test)]
mod tests;
mod told;

pub use band::band_half_width;
pub use design::{DesignVariables, TIP};
pub use error::StudyError;
pub use fingerprint::{HistoryEntry, empty_history, extend_history, history_sha256};
pub use preset::{PRESETS, expand, preset};
pub use read::read_study;
pub use restart::{
    BestPoint, RestartState, RestartStep, RestartStop, StudyStop, begin, pass, resume, speculate,
    step,
};
pub use result::{
    EvaluationReport, EvaluationRequest, LossReport, Note, Outcome, OutcomeStatus, OverlapReport,
    StateReport,
};
pub use schema::{SCHEMA, schema};
pub use spec::Study;
pub(crate) use start::scaled_distance;
pub use start::{Drawn, RestartSpec};
pub use takes::{Given, Letter, StepInputs};
