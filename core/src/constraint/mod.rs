//! Limits that make an optimum mean something, and verdicts on a deformed shape.

pub mod stretch;
pub mod walls;
