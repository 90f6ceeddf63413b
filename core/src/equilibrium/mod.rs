//! Equilibrium: Newton's method told once, and the path of load states.

mod area_control;
mod kept_factor;
mod leg;
mod load_path;
mod load_steps;
mod newton;
mod observer;
mod status;
mod tracker;
mod uniqueness;

pub use load_path::{AcceptedState, LimitPoint, StateVisitor, follow};
pub use newton::{Control, Settings};
pub use observer::{Observer, Phase, Unobserved};
pub use status::{
    Limit, LimitKind, LossOfUniqueness, LostMargin, NotConverged, PathEnd, PathReport, PathWork,
};
