//! What is minimised or bounded over the path.

pub mod bending_angle;
pub mod enclosed_area;
pub mod probe;
pub mod tip_path;
