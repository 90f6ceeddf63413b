//! Phase events: the core has no clock, its caller has.

/// What the solver is at.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Phase {
    /// Mesh, unknowns, symbolic analysis.
    SetUp,
    /// Residuals and tangents.
    Assembly,
    /// Surfaces that may touch, and steps that they allow.
    Contact,
    /// Factorisations and solves.
    Factorisation,
    /// Adjoint solves and shape derivatives.
    Adjoint,
    /// Stretch, gaps, crossings.
    Measures,
}

/// Hears when a phase begins, and says whether to stop.
pub trait Observer {
    /// A phase begins; the one before has ended.
    fn enter(&mut self, phase: Phase);

    /// Asked at every Newton iteration.
    fn cancelled(&self) -> bool {
        false
    }
}

/// Nobody listens.
#[derive(Clone, Copy, Debug, Default)]
pub struct Unobserved;

impl Observer for Unobserved {
    fn enter(&mut self, _phase: Phase) {}
}
