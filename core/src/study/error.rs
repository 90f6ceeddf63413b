//! Why a study cannot answer a question about a design.

use thiserror::Error;

/// Why a study cannot answer a question about a design.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum StudyError {
    /// A step's index beyond the last.
    #[error("find step {step}: the study has {steps}")]
    NoSuchStep {
        /// The index asked for.
        step: usize,
        /// Number of steps.
        steps: usize,
    },
    /// A question about chambers to a step whose model is a program.
    #[error("look into step {step}: its model is a program, which has no chambers")]
    NoChambers {
        /// Index of the step.
        step: usize,
    },
    /// A design of the wrong length.
    #[error("read a design of {found} numbers: step {step} has {expected} variables")]
    Length {
        /// Index of the step.
        step: usize,
        /// Number of variables.
        expected: usize,
        /// Numbers found.
        found: usize,
    },
    /// The optimiser refused the problem.
    #[error("open a run of step {step}: {source}")]
    Start {
        /// Index of the step.
        step: usize,
        /// Why.
        source: crate::optimiser::StartError,
    },
}
