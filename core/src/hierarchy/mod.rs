//! The hierarchical framework in motion: which step of a study is due, what it takes, what an ended one hands on.
//!
//! Pure functions of the study and of the results so far, so that a coordinator may stop and go on anywhere. The document
//! itself (levels, passes, simplifications, what is taken from where) is read and checked in [`crate::study`].
//!
//! | file | what |
//! |---|---|
//! | [`candidate`] | the N best distinct designs of an ended step |
//! | [`optima`] | how far these are apart, and which are the same within their errors |
//! | [`due`](mod@due) | steps that can begin, and those that never can |
//! | [`inputs`] | the designs, the layout, the behaviour that a step takes |
//! | [`given_up`](mod@given_up) | what a simplification gave up, seen where its candidates are evaluated again |

pub mod candidate;
pub mod due;
pub mod given_up;
pub mod inputs;
pub mod optima;
#[cfg(test)]
mod tests;

pub use candidate::{Candidate, StepResult};
pub use due::{Due, Progress, due};
pub use given_up::{GivenUp, given_up};
