//! Reads a study document, and answers every fault at once.

mod constraints;
mod graph;
mod model;
mod optimiser;
mod race;
mod restarts;
mod step;
mod study;
mod takes;
mod target;
mod variables;

pub use optimiser::Bounds;
pub use study::read_study;
