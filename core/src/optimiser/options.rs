//! Options of the optimisers, as a study document holds them.

use serde::{Deserialize, Serialize};

use super::{
    cma_es::CmaEsOptions, convergence::Rules, gcmma::GcmmaOptions, linearisation::Common,
    sqp::SqpOptions,
};
use crate::{fault::Faults, random::start_seed};

/// An optimiser and its options.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "method", rename_all = "snake_case")]
pub enum OptimiserOptions {
    /// Modified method of feasible directions.
    Mmfd(MmfdOptions),
    /// Moving asymptotes.
    Gcmma(GcmmaOptions),
    /// Sequential quadratic programming.
    Sqp(SqpOptions),
    /// Evolution strategy with covariance matrix adaptation, without gradients.
    CmaEs(CmaEsOptions),
    /// Points drawn uniformly within the bounds.
    RandomSearch(RandomSearchOptions),
    /// A list of points, each evaluated once.
    Sweep(SweepOptions),
}

impl From<MmfdOptions> for OptimiserOptions {
    fn from(options: MmfdOptions) -> Self {
        Self::Mmfd(options)
    }
}

impl From<GcmmaOptions> for OptimiserOptions {
    fn from(options: GcmmaOptions) -> Self {
        Self::Gcmma(options)
    }
}

impl From<SqpOptions> for OptimiserOptions {
    fn from(options: SqpOptions) -> Self {
        Self::Sqp(options)
    }
}

impl From<CmaEsOptions> for OptimiserOptions {
    fn from(options: CmaEsOptions) -> Self {
        Self::CmaEs(options)
    }
}

/// Where gradients come from.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum GradientSource {
    /// The model gives them.
    #[default]
    Model,
    /// Forward differences: as many independent evaluations as there are variables.
    Differences,
}

/// Where the method uses what its moves teach about curvature.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Curvature {
    /// Nowhere: conjugate directions (Fletcher-Reeves) where no constraint is active.
    Never,
    /// Where no constraint is active, as DOT's method 1 uses BFGS where there are no constraints.
    #[default]
    Unconstrained,
    /// Everywhere: no longer the published method, but fewer evaluations on curved problems.
    Always,
}

/// Options of the modified method of feasible directions; defaults and names in brackets are those of DOT.
///
/// Constraints are expected in normalised form (of order one); DOT's documentation says the same.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct MmfdOptions {
    /// Where gradients come from.
    pub gradient: GradientSource,
    /// Ask for the gradient with every evaluation and skip the gradient phase where the accepted point's is known:
    /// for models whose adjoint costs a few per cent of the value. Ignored with differences.
    pub eager_gradients: bool,
    /// Relative step of forward differences (FDCH).
    #[serde(alias = "fdch")]
    pub difference_step: f64,
    /// Least absolute step of forward differences (FDCHM).
    #[serde(alias = "fdchm")]
    pub least_difference_step: f64,
    /// A constraint is active from this negative value on (CT).
    #[serde(alias = "ct")]
    pub active_from: f64,
    /// A constraint is violated above this value (CTMIN).
    #[serde(alias = "ctmin")]
    pub violation_tolerance: f64,
    /// Absolute change of the objective that counts as none (DABOBJ); `None`: max(1e-4 |F0|, 1e-20).
    #[serde(alias = "dabobj")]
    pub absolute_tolerance: Option<f64>,
    /// Relative change of the objective that counts as none (DELOBJ).
    #[serde(alias = "delobj")]
    pub relative_tolerance: f64,
    /// Consecutive iterations on which a change must count as none (ITRMOP).
    #[serde(alias = "itrmop")]
    pub consecutive: usize,
    /// Most iterations (ITMAX).
    #[serde(alias = "itmax")]
    pub max_iterations: usize,
    /// Relative change of the objective that the first step aims at (DOBJ1).
    #[serde(alias = "dobj1")]
    pub first_objective_change: f64,
    /// Largest relative change of a variable in the first step (DX1).
    #[serde(alias = "dx1")]
    pub first_move: f64,
    /// Iterations between two updates of the variable scales (ISCAL); `None`: as many as variables; 0: no scaling.
    #[serde(alias = "iscal")]
    pub scale_every: Option<usize>,
    /// Consecutive infeasible iterations after which the search for a feasible design is given up.
    pub infeasible_iterations: usize,
    /// Where directions are found in a metric learnt from the last moves (BFGS of the Lagrangian) instead of the
    /// variable scales.
    pub curvature: Curvature,
    /// Push-off from violated constraints (theta).
    pub push_off: f64,
    /// A feasible run stops when it costs this many times what brought it to within 0.1 % of its best value; 0: never.
    pub stall_factor: f64,
}

impl Default for MmfdOptions {
    fn default() -> Self {
        Self {
            gradient: GradientSource::Model,
            eager_gradients: false,
            difference_step: 1e-3,
            least_difference_step: 1e-4,
            active_from: -0.03,
            violation_tolerance: 0.003,
            absolute_tolerance: None,
            relative_tolerance: 1e-3,
            consecutive: 2,
            max_iterations: 100,
            first_objective_change: 0.1,
            first_move: 0.01,
            scale_every: None,
            infeasible_iterations: 20,
            curvature: Curvature::Unconstrained,
            push_off: 1.0,
            stall_factor: 3.0,
        }
    }
}

/// Options of a sweep.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct SweepOptions {
    /// Points, asked as one batch of independent evaluations; empty: the start alone.
    pub points: Vec<Vec<f64>>,
    /// A constraint is violated above this value.
    pub violation_tolerance: f64,
}

impl Default for SweepOptions {
    fn default() -> Self {
        Self {
            points: Vec::new(),
            violation_tolerance: 0.003,
        }
    }
}

/// Options of a random search.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct RandomSearchOptions {
    /// Seed of its random numbers.
    pub seed: u64,
    /// Points, the start included.
    pub evaluations: usize,
    /// Points asked as one batch of independent evaluations.
    pub batch: usize,
    /// A constraint is violated above this value.
    pub violation_tolerance: f64,
}

impl Default for RandomSearchOptions {
    fn default() -> Self {
        Self {
            seed: 1,
            evaluations: 1000,
            batch: 64,
            violation_tolerance: 0.003,
        }
    }
}

impl OptimiserOptions {
    /// Notes every option outside its range, under `path`.
    pub fn faults(&self, path: &str, faults: &mut Faults) {
        match self {
            Self::Mmfd(options) => options.faults(path, faults),
            Self::Gcmma(options) => options.faults(path, faults),
            Self::Sqp(options) => options.faults(path, faults),
            Self::CmaEs(options) => options.faults(path, faults),
            Self::RandomSearch(options) => options.faults(path, faults),
            Self::Sweep(options) => options.faults(path, faults),
        }
    }

    /// Above this violation a design does not count as feasible.
    pub fn violation_tolerance(&self) -> f64 {
        match self {
            Self::Mmfd(options) => options.violation_tolerance,
            Self::Gcmma(options) => options.violation_tolerance,
            Self::Sqp(options) => options.violation_tolerance,
            Self::CmaEs(options) => options.violation_tolerance,
            Self::RandomSearch(options) => options.violation_tolerance,
            Self::Sweep(options) => options.violation_tolerance,
        }
    }

    /// Whether its points are known before any is answered, each for itself: none is nearer to an optimum for the others.
    pub fn is_sample(&self) -> bool {
        matches!(self, Self::RandomSearch(_) | Self::Sweep(_))
    }

    /// Whether it walks from point to point, so that its points can share a mesh plan and one leads to the next.
    pub fn walks(&self) -> bool {
        matches!(self, Self::Mmfd(_) | Self::Gcmma(_) | Self::Sqp(_))
    }

    /// The options for one of several runs: what they draw at random comes from their own seed and the run's.
    #[must_use]
    pub fn seeded(mut self, run: u64, index: usize) -> Self {
        match &mut self {
            Self::CmaEs(CmaEsOptions { seed, .. })
            | Self::RandomSearch(RandomSearchOptions { seed, .. }) => {
                *seed = start_seed(start_seed(*seed, index) ^ run, index);
            }
            Self::Mmfd(_) | Self::Gcmma(_) | Self::Sqp(_) | Self::Sweep(_) => {}
        }
        self
    }
}

impl MmfdOptions {
    pub(super) fn common(&self) -> Common {
        Common {
            gradient: self.gradient,
            eager_gradients: self.eager_gradients,
            difference_step: self.difference_step,
            least_difference_step: self.least_difference_step,
            absolute_tolerance: self.absolute_tolerance,
            absolute_share: 1e-4,
            rules: Rules {
                relative_tolerance: self.relative_tolerance,
                consecutive: self.consecutive,
                stall_factor: self.stall_factor,
                violation_tolerance: self.violation_tolerance,
            },
        }
    }

    /// Notes every option outside its range, under `path`.
    pub fn faults(&self, path: &str, faults: &mut Faults) {
        positive(
            path,
            &[
                ("difference_step", self.difference_step),
                ("least_difference_step", self.least_difference_step),
                ("violation_tolerance", self.violation_tolerance),
                ("first_objective_change", self.first_objective_change),
                ("first_move", self.first_move),
                ("push_off", self.push_off),
            ],
            faults,
        );
        not_negative(
            path,
            &[
                ("relative_tolerance", self.relative_tolerance),
                ("absolute_tolerance", self.absolute_tolerance.unwrap_or(0.0)),
                ("stall_factor", self.stall_factor),
            ],
            faults,
        );
        if !(self.active_from.is_finite() && self.active_from < 0.0) {
            let message = format!("must be negative, found {}", self.active_from);
            faults.add(format!("{path}.active_from"), message);
        }
        at_least_one(
            path,
            &[
                ("consecutive", self.consecutive),
                ("max_iterations", self.max_iterations),
                ("infeasible_iterations", self.infeasible_iterations),
            ],
            faults,
        );
    }
}

/// Notes every option that is not positive.
pub(super) fn positive(path: &str, options: &[(&str, f64)], faults: &mut Faults) {
    for (name, value) in options {
        if !(value.is_finite() && *value > 0.0) {
            faults.add(
                format!("{path}.{name}"),
                format!("must be positive, found {value}"),
            );
        }
    }
}

/// Notes every option that is negative.
pub(super) fn not_negative(path: &str, options: &[(&str, f64)], faults: &mut Faults) {
    for (name, value) in options {
        if !(value.is_finite() && *value >= 0.0) {
            faults.add(
                format!("{path}.{name}"),
                format!("must not be negative, found {value}"),
            );
        }
    }
}

/// Notes every count that is 0.
pub(super) fn at_least_one(path: &str, options: &[(&str, usize)], faults: &mut Faults) {
    for (name, value) in options {
        if *value == 0 {
            faults.add(format!("{path}.{name}"), "must be at least 1");
        }
    }
}

impl RandomSearchOptions {
    /// Notes every option outside its range, under `path`.
    pub fn faults(&self, path: &str, faults: &mut Faults) {
        positive(
            path,
            &[("violation_tolerance", self.violation_tolerance)],
            faults,
        );
        at_least_one(
            path,
            &[("evaluations", self.evaluations), ("batch", self.batch)],
            faults,
        );
    }
}

impl SweepOptions {
    /// Notes every option outside its range, under `path`.
    pub fn faults(&self, path: &str, faults: &mut Faults) {
        for (i, point) in self.points.iter().enumerate() {
            if point.iter().any(|value| !value.is_finite()) {
                faults.add(format!("{path}.points[{i}]"), "must hold finite numbers");
            }
        }
        if !(self.violation_tolerance.is_finite() && self.violation_tolerance >= 0.0) {
            let message = format!("must not be negative, found {}", self.violation_tolerance);
            faults.add(format!("{path}.violation_tolerance"), message);
        }
    }
}
