//! Optimisers as pure, serialisable ask/tell state machines over slices of f64.
//!
//! [`start`] opens a run and says which points it wants evaluated; [`step`] takes the answers and says which points
//! come next, or why the run is over. Between two calls a run is a plain record ([`OptimiserState`]): store it as JSON
//! (with serde_json's `float_roundtrip`), read it back anywhere, and the run goes on bit by bit as if nothing had
//! happened. There is no clock and no hidden state; what randomness a method has comes from a seed in its options.

mod cma_es;
mod contract;
mod convergence;
mod descent;
mod differences;
mod exchange;
mod gcmma;
mod linearisation;
mod method;
mod mmfd;
mod multipliers;
mod nnls;
mod options;
mod point;
mod problem;
pub mod published;
mod random_search;
mod rows;
mod speculate;
mod sqp;
mod state;
mod stop;
mod sweep;
mod thin_qr;
mod vector;

#[cfg(test)]
mod tests;

pub use cma_es::{CmaEs, CmaEsOptions};
pub use contract::{Ask, AskKind, Told, Values};
pub use descent::DescentOptions;
pub use exchange::{Exchange, ExchangeOptions};
pub use gcmma::{Gcmma, GcmmaOptions};
pub use mmfd::Mmfd;
pub use multipliers::{Conditions, conditions};
pub use options::{
    Curvature, GradientSource, MmfdOptions, OptimiserOptions, RandomSearchOptions, SweepOptions,
};
pub use point::Point;
pub use problem::{Problem, StartError};
pub use random_search::RandomSearch;
pub use speculate::speculate;
pub use sqp::{Sqp, SqpOptions};
pub use state::{OptimiserState, Step, rebase, screen, start, step, step_on_another_mesh};
pub use stop::StopReason;
pub use sweep::Sweep;
