//! The science of Salp: no async, no SQL, no sockets, no clock, no environment, no printing.

pub mod actuation;
pub mod document;
pub mod fault;
pub mod geometry;
pub mod material;
pub mod optimiser;
pub mod picture;
pub mod scene;
pub mod study;

#[cfg(feature = "solver")]
pub mod adjoint;
#[cfg(feature = "solver")]
pub mod assembly;
#[cfg(feature = "solver")]
pub mod constraint;
#[cfg(feature = "solver")]
pub mod element;
#[cfg(feature = "solver")]
pub mod equilibrium;
#[cfg(feature = "solver")]
pub mod evaluate;
#[cfg(feature = "solver")]
pub mod force;
#[cfg(feature = "solver")]
pub mod linear;
#[cfg(feature = "solver")]
pub mod mesh;
#[cfg(feature = "solver")]
pub mod objective;
