//! Pictures as SVG text: the shape of an actuator and curves of run time against objective.
//!
//! Colours are the eight of Okabe and Ito, told apart by colour-blind readers; lines differ in their dashes as well.

pub mod axis;
pub mod curve;
#[cfg(feature = "solver")]
pub mod shape;
mod svg;
mod text;

pub use curve::{CurvePicture, CurvePoint, CurveSeries};
#[cfg(feature = "solver")]
pub use shape::ShapePicture;
