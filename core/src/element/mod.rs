//! Finite elements: shape functions, quadrature, and the mixed element with its pressure condensed.

pub mod kernel;
pub mod shape;
