//! The paper's reduced model (Eq. 1): a unit under pressure is a 2x2 transformation of its two right-hand nodes, a chain
//! is a cascade of them, and only the ends of the actuations count.
//!
//! Points of a unit are relative to the middle of its left edge, so its right-hand nodes are (w, -h/2) and (w, h/2). The
//! paper says how one unit moves and shows a chain (Fig. 4b) without saying how the units are joined. Our reading: the next
//! unit's frame is fixed rigidly to the transformed right edge, its origin at T (w, 0), turned as the edge vector
//! T (0, h) = h (x_sh, y_scl) is turned from the vertical. With the edges' points fitted as in [`fit`], this is the frame that
//! fits the next unit's left edge best in the sense of least squares: a cascade of the transformations of all the units of an
//! FE chain has the mean of each of its edges exactly (see [`edge`]).
//!
//! A second model, the constant-strain [`Rod`], keeps of each unit the curvature, extension and shear that lead from its left edge's
//! frame to its right one's, as smooth functions of the two pressures: it knows every schedule within its range.

mod area;
mod calibrated;
mod cascade;
mod constant_strain;
pub mod edge;
mod explore;
mod fit;
mod linear_transform;
mod rod;
pub mod surface;

pub use area::area;
pub use calibrated::{Calibrated, FittedState, OutsideFit};
pub use cascade::{Frame, corners, frames, tip, tip_gradient, tip_of, tip_path};
pub use constant_strain::{Strain, rod_area, rod_frames, rod_tip};
pub use explore::{AreaMap, Bounds, CannotMap, Explored, MapAxis, area_map, largest_areas};
pub use fit::{CannotFit, Fit, fit, frame_of};
pub use linear_transform::{Entry, LinearTransform};
pub use rod::{NoRod, Rod, RodUnit, RodUnits};
