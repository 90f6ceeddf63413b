//! Restarts that compete: racing over fidelities, early stop of dominated ones, merging of those that head for one optimum.
//!
//! A restart comes to *gates*: the end of a rung of the race, and checks at fixed numbers of evaluations. There it shows a
//! [`Mark`] and waits, with nothing asked. [`due`] decides whether it goes on, from its own mark and from what the restarts of
//! lower index show at the same gate, once each of them has been decided there or is out. A decision so depends neither on who
//! arrived first nor on the number of workers, and is derived anew from what is stored whenever somebody looks.
//!
//! | file | what |
//! |---|---|
//! | `options` | what a document says |
//! | `merit` | the order of designs, and how well two orders agree |
//! | `record` | what a restart shows to the others |
//! | `decide` | the decisions |
//! | `summary` | the race as a whole, for people |
//!
//! Sources: L. Li et al., A system for massively parallel hyperparameter tuning (MLSys 2020), of which the promotion by rank
//! in a growing rung is taken and made to depend on the order of the restarts instead of that of arrival; D. Golovin et al.,
//! Google Vizier (KDD 2017), of the median rule.

mod decide;
mod merit;
mod options;
mod record;
mod summary;
#[cfg(test)]
mod tests;

pub use decide::{BLOCK, Correlation, Decision, LEAST_COMPARED, LEAST_PAIRS, due};
pub use merit::{Merit, spearman};
pub use options::{
    AHEAD, Competition, DEFAULT_EVERY, DominationRule, Fidelity, MERGE_WITHIN, Race, Rung,
    StopDominated,
};
pub use record::{End, Gate, Mark, RaceRecord};
pub use summary::{CheckSummary, RaceSummary, RungSummary};
