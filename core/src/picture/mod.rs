//! Pictures as SVG text: the shape of an actuator, curves of run time against objective, error against run
//! time, the reduced model.
//!
//! Colours are the eight of Okabe and Ito, told apart by colour-blind readers; lines differ in their dashes as well.

pub mod axis;
mod bands;
pub mod curve;
mod frame;
pub mod graph;
mod labels;
mod panel;
pub mod pressure_plane;
mod profile;
mod reduced;
pub mod scatter;
#[cfg(feature = "solver")]
pub mod shape;
mod svg;
mod tension;
mod text;

pub use axis::Scale;
pub use bands::{BandPicture, BandSeries, BandStep};
pub use curve::{BestPoint, CurvePicture, CurvePoint, CurveSeries};
pub use graph::{GraphPicture, GraphStep};
pub use pressure_plane::PressurePlanePicture;
pub use profile::{ProfilePanel, ProfilePicture};
pub use reduced::{ReducedPicture, TipPaths, tip_paths_svg};
pub use scatter::{ScatterPicture, ScatterSeries};
#[cfg(feature = "solver")]
pub use shape::ShapePicture;
pub use tension::TensionPicture;
