//! A worker: it claims an evaluation, renews its lease, evaluates, reports; and again, until it is told to end.
//!
//! It speaks HTTP only and keeps nothing: killed at any moment, it costs the evaluation that it had. One process evaluates
//! one design at a time on one thread; the heartbeat has a thread of its own that the solver never starves.
//!
//! | file | what |
//! |---|---|
//! | [`config`] | what a worker is told at its start |
//! | [`run`](mod@run) | the loop |
//! | [`heartbeat`] | the lease |
//! | [`evaluate`] | a study's models, each panic caught |
//! | [`command`] | programs as models |
//! | [`client`] | the typed client of the API, for workers and for the command line |
//! | [`identity`] | build and instruction set |
//! | [`stop`] | signals and the end of the parent |

pub mod client;
pub mod command;
pub mod config;
pub mod evaluate;
pub mod heartbeat;
pub mod identity;
pub mod run;
pub mod stop;

pub use client::{Client, ClientError};
pub use config::WorkerConfig;
pub use run::{WorkerEnd, WorkerError, run};
