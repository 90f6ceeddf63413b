//! The coordinator: it keeps studies in a store, hands their evaluations to workers over HTTP, and steps their optimisers.
//!
//! One evaluation travels like this. The optimiser of a restart asks for a batch of points; they are stored and queued.
//! A worker [claims](store::Store::claim) one, renews its lease, and reports. The report is
//! [stored](store::Store::accept_result) in one short transaction. When the whole batch is answered, the next step of the
//! optimiser is computed outside any lock ([`coordinator`]) and [saved](store::Store::save_step) by a second transaction,
//! if the restart is still the version that was read. Any process may die between any two transactions: what is stored
//! without its step is stepped at the next start, and since a step depends on the batch alone, never on who answered it
//! or when, the history is the same.
//!
//! | file | what |
//! |---|---|
//! | [`machine`] | what the coordinator needs of a study: restarts, steps, verdicts |
//! | [`store`] | the contract with the database, in transactions of the domain |
//! | [`coordinator`] | claim, report, step: the scheduler |
//! | [`curve`] | run time against best objective |
//! | [`http`] | the API |
//! | [`config`] | address, token, lease |

pub mod config;
#[cfg(feature = "conformance")]
pub mod conformance;
pub mod coordinator;
pub mod curve;
pub mod http;
pub mod machine;
mod serve;
pub mod store;

pub use config::{ConfigError, ServerConfig};
pub use serve::{ServeError, serve};
