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
    /// A variable that is no letter of the step's alphabet.
    #[error("read letter {letter} of unit {place} (from 0): step {step} has the letters 0 to {} at most", letters.saturating_sub(1))]
    NoSuchLetter {
        /// Index of the step.
        step: usize,
        /// Index of the unit.
        place: usize,
        /// The letter found.
        letter: f64,
        /// Number of letters.
        letters: usize,
    },
    /// A derivative with respect to letters.
    #[error("differentiate step {step}: its variables are letters of a sequence")]
    Discrete {
        /// Index of the step.
        step: usize,
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
