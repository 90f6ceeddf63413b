//! Sparse symmetric systems: analyse once per topology, factorise, solve.

mod cholesky;
mod nested_dissection;

pub use cholesky::{AnalysisFailed, Factor, Solver};
pub use nested_dissection::{Elements, nested_dissection};
