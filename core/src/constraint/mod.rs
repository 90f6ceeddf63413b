//! Limits that make an optimum mean something, and verdicts on a deformed shape.

pub mod gap;
pub mod stretch;
pub mod walls;
