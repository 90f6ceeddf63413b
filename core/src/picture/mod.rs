//! Pictures as SVG text: the shape of an actuator, curves of run time against objective, error against run time.
//!
//! Colours are the eight of Okabe and Ito, told apart by colour-blind readers; lines differ in their dashes as well.

pub mod axis;
pub mod curve;
mod frame;
mod labels;
pub mod scatter;
#[cfg(feature = "solver")]
pub mod shape;
mod svg;
mod text;

pub use axis::Scale;
pub use curve::{BestPoint, CurvePicture, CurvePoint, CurveSeries};
pub use scatter::{ScatterPicture, ScatterSeries};
#[cfg(feature = "solver")]
pub use shape::ShapePicture;
