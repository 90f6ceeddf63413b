//! Contributions to the energy beside the solid's own: value, gradient, Hessian, and next to them the derivative with
//! respect to node positions.

pub mod cavity_pressure;
pub mod edge;
pub mod self_contact;
pub mod traction;
