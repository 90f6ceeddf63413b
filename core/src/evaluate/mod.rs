//! The single door: a scene or a study's evaluation request goes in, a document or an outcome comes out.

mod accuracy;
pub mod analysis;
mod answer;
pub mod companions;
pub(crate) mod contact;
mod converge;
mod gradient;
mod limits;
mod measure;
mod notes;
pub mod numerical_error;
mod scene;
mod study;

pub use accuracy::choose_meshes;
pub use answer::{LeftOut, SceneAnswer, SceneStatus, StateAnswer};
pub use converge::{CannotConverge, Clock, Convergence, Family, Reference, Run, Setting, converge};
pub use gradient::{CheckLine, Difference, GradientAnswer, check_bound, check_gradient};
pub use numerical_error::NumericalError;
pub use scene::{SceneOptions, SceneSolution, solve_scene};
pub use study::evaluate;

#[cfg(test)]
mod tests;
