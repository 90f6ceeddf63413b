//! Sourced parameter records.

use super::{HyperelasticModel, MaterialLaw};

/// A named set of parameters with its source.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MaterialRecord {
    /// Name in documents.
    pub name: &'static str,
    /// Parameters, MPa; K = 1000 mu.
    pub law: MaterialLaw,
    /// Where the parameters come from.
    pub source: &'static str,
    /// Largest principal stretch of the data behind the fit.
    pub fit_stretch: f64,
    /// Engineering strain at break (3.39 = 339 %), where the supplier gives it.
    pub elongation_at_break: Option<f64>,
}
