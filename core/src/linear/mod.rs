//! Sparse symmetric systems: analyse once per topology, factorise, solve.

mod cholesky;
mod dense;
mod extension;
mod multifrontal;
mod nested_dissection;
mod supernodes;

pub use cholesky::{AnalysisFailed, Factor, Solver};
pub use extension::Coupling;
pub use nested_dissection::{Elements, nested_dissection};
