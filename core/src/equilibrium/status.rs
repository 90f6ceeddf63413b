//! How a path ended: a status that carries numbers.

use serde::{Deserialize, Serialize};

/// Kind of a limit of equilibrium.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum LimitKind {
    /// The tangent becomes singular: the load has a maximum.
    LimitPoint,
    /// The stretch grows without bound while the load tends to a value.
    Asymptote,
}

/// Where equilibrium ended.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Limit {
    /// Its kind.
    pub kind: LimitKind,
    /// Leg, from 0.
    pub leg: usize,
    /// Fraction of the leg of the last converged state.
    pub fraction: f64,
    /// Pressures of the last converged state, kPa.
    pub pressure_kpa: Vec<f64>,
}

/// A failure of ours.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, thiserror::Error)]
#[serde(tag = "cause", rename_all = "snake_case")]
pub enum NotConverged {
    /// Newton's method failed at the smallest load step.
    #[error(
        "failed to converge at leg {leg}, fraction {fraction}: relative residual {residual:e} after {iterations} iterations at the smallest load step"
    )]
    Newton {
        /// Leg, from 0.
        leg: usize,
        /// Fraction that was tried.
        fraction: f64,
        /// Largest residual over the force scale at the end.
        residual: f64,
        /// Iterations of the last attempt.
        iterations: usize,
    },
    /// The tangent of the undeformed shape is not positive definite: the body can move rigidly, or a modulus is wrong.
    #[error("the undeformed body is not held: {negative} negative pivots")]
    NotHeld {
        /// Negative pivots.
        negative: usize,
    },
    /// The limit of work was reached.
    #[error("the limit of {factorisations} factorisations was reached")]
    WorkLimit {
        /// Factorisations.
        factorisations: usize,
    },
    /// The caller asked to stop.
    #[error("cancelled")]
    Cancelled,
}

/// How the path ended.
#[derive(Clone, Debug, PartialEq)]
pub enum PathEnd {
    /// Every state was reached.
    Complete,
    /// No equilibrium beyond a load.
    NoEquilibrium(Limit),
    /// A failure of ours.
    NotConverged(NotConverged),
}

/// Work of a path.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct PathWork {
    /// Newton iterations.
    pub newton_iterations: usize,
    /// Factorisations.
    pub factorisations: usize,
    /// States between those of the path.
    pub inserted_states: usize,
    /// Load steps that were cut after a failure.
    pub load_cuts: usize,
    /// States accepted at round-off above the tolerance.
    pub stagnated: usize,
}
