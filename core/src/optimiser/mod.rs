//! Optimisers as pure, serialisable ask/tell state machines over slices of f64.

mod contract;

pub use contract::{Ask, AskKind, Told, Values};
