//! Equilibrium: Newton's method told once, and the path of load states.

mod load_path;
mod newton;
mod observer;
mod status;
#[cfg(test)]
mod tests;

pub use load_path::{AcceptedState, StateVisitor, follow};
pub use newton::Settings;
pub use observer::{Observer, Phase, Unobserved};
pub use status::{Limit, LimitKind, NotConverged, PathEnd, PathWork};
