//! What is minimised over the path.

pub mod enclosed_area;
pub mod probe;
