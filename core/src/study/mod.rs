//! The study document, its restarts, and what an evaluation is asked and answers.

pub mod result;

pub use result::{
    EvaluationReport, EvaluationRequest, Outcome, OutcomeStatus, OverlapReport, StateReport,
};
