//! The single door: a scene or a study's evaluation request goes in, a document or an outcome comes out.

mod accuracy;
pub mod analysis;
mod answer;
mod chain_states;
pub mod companions;
pub(crate) mod contact;
mod converge;
mod gradient;
mod layout_step;
mod limits;
mod measure;
mod notes;
pub mod numerical_error;
pub mod pressure_map;
mod reduced_step;
pub mod reduction;
pub mod rod;
mod scene;
pub mod sensitivities;
mod study;

pub use accuracy::choose_meshes;
pub use answer::{LeftOut, SceneAnswer, SceneStatus, StateAnswer};
pub use chain_states::{ChainEnd, ChainStates, solve_chain};
pub use converge::{CannotConverge, Clock, Convergence, Family, Reference, Run, Setting, converge};
pub use gradient::{CheckLine, Difference, GradientAnswer, check_bound, check_gradient};
pub use numerical_error::NumericalError;
pub use pressure_map::PressureMap;
pub use scene::{SceneOptions, SceneSolution, solve_scene};
pub use sensitivities::{SceneSensitivities, check_tolerance};
pub use study::evaluate;

#[cfg(test)]
mod tests;
