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
    /// The path loses its stability to a branch that has no stable state near.
    Bifurcation,
}

impl LimitKind {
    /// Its name in documents.
    pub fn name(self) -> &'static str {
        match self {
            Self::LimitPoint => "limit_point",
            Self::Asymptote => "asymptote",
            Self::Bifurcation => "bifurcation",
        }
    }
}

/// Where equilibrium ended.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Limit {
    /// Its kind.
    pub kind: LimitKind,
    /// Leg, from 0.
    pub leg: usize,
    /// Fraction of the leg.
    pub fraction: f64,
    /// Pressures there, kPa.
    pub pressure_kpa: Vec<f64>,
    /// Of an asymptote: the pressures to which the load tends, extrapolated, kPa.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub asymptote_kpa: Option<Vec<f64>>,
}

/// Where a second equilibrium was met.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct LossOfUniqueness {
    /// Leg, from 0.
    pub leg: usize,
    /// Fraction of the leg: where the branch became unstable (located by bisection to 1 %), bends, or snaps.
    pub fraction: f64,
    /// Channel pressures, kPa.
    pub pressure_kpa: Vec<f64>,
    /// Negative pivots of the equilibrium that was left, or found beside; 0 for a snap.
    pub negative_pivots: usize,
}

/// A load margin that was not reached.
#[derive(Clone, Debug, PartialEq)]
pub struct LostMargin {
    /// Leg at whose end it begins.
    pub leg: usize,
    /// Times the row's load that was reached.
    pub factor: f64,
    /// What ended it.
    pub end: PathEnd,
}

/// A failure of ours.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, thiserror::Error)]
#[serde(tag = "cause", rename_all = "snake_case")]
pub enum NotConverged {
    /// Newton's method failed at the smallest step.
    #[error(
        "failed to converge at leg {leg}, fraction {fraction}: relative residual {residual:e} after {iterations} iterations at the smallest step"
    )]
    Newton {
        /// Leg, from 0.
        leg: usize,
        /// Fraction of the last converged state.
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
    /// The pattern of the tangent could not be analysed with the surfaces that have come near.
    #[error("{detail}")]
    Analysis {
        /// Why.
        detail: String,
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

impl From<NotConverged> for PathEnd {
    fn from(why: NotConverged) -> Self {
        Self::NotConverged(why)
    }
}

/// A followed path.
#[derive(Clone, Debug)]
pub struct PathReport {
    /// How it ended.
    pub end: PathEnd,
    /// Counts of work.
    pub work: PathWork,
    /// (leg + fraction) / legs of the last converged state.
    pub reached: f64,
    /// The first loss of uniqueness that was met.
    pub loss: Option<LossOfUniqueness>,
    /// The first load margin that was not reached.
    pub lost_margin: Option<LostMargin>,
}

/// Work of a path.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct PathWork {
    /// Newton iterations, those with the factor of an earlier one among them.
    pub newton_iterations: usize,
    /// Factorisations.
    pub factorisations: usize,
    /// States between those of the path.
    pub inserted_states: usize,
    /// Load steps that were cut after a failure.
    pub load_cuts: usize,
    /// Snaps to a stable state of a slightly larger load.
    pub snaps: usize,
    /// States accepted at round-off above the tolerance.
    pub stagnated: usize,
    /// Newton iterations at which surfaces act on each other.
    #[serde(default)]
    pub contact_steps: usize,
}

impl PathWork {
    /// Adds the work of an earlier path.
    pub fn add(&mut self, earlier: &Self) {
        self.newton_iterations += earlier.newton_iterations;
        self.factorisations += earlier.factorisations;
        self.inserted_states += earlier.inserted_states;
        self.load_cuts += earlier.load_cuts;
        self.snaps += earlier.snaps;
        self.stagnated += earlier.stagnated;
        self.contact_steps += earlier.contact_steps;
    }
}
