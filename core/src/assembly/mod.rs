//! From elements to the global system: unknowns, sparsity pattern once per topology, allocation-free assembly.

mod block;
mod dof_map;
mod pattern;
mod system;

pub use block::{BlockKernel, PointSample, PointSensitivity};
pub use dof_map::DofMap;
pub use pattern::Pattern;
pub use system::{Assembled, FoldedReference, Load, State, System, Workspace};
