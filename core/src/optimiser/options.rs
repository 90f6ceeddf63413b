//! Options of the optimisers, as a study document holds them.

use serde::{Deserialize, Serialize};

use super::{
    cma_es::CmaEsOptions, descent::DescentOptions, exchange::ExchangeOptions, gcmma::GcmmaOptions,
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
    /// Sequences of letters, improved by exchanges.
    Exchange(ExchangeOptions),
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
pub struct MmfdOptions {
    /// What it has in common with others.
    #[serde(flatten)]
    pub descent: DescentOptions,
    /// A constraint is active from this negative value on (CT).
    pub active_from: f64,
    /// Relative change of the objective that the first step aims at (DOBJ1).
    pub first_objective_change: f64,
    /// Largest relative change of a variable in the first step (DX1).
    pub first_move: f64,
    /// Iterations between two updates of the variable scales (ISCAL); `None`: as many as variables; 0: no scaling.
    pub scale_every: Option<usize>,
    /// Where directions are found in a metric learnt from the last moves (BFGS of the Lagrangian) instead of the
    /// variable scales.
    pub curvature: Curvature,
    /// Push-off from violated constraints (theta).
    pub push_off: f64,
}

impl Default for MmfdOptions {
    fn default() -> Self {
        Self {
            descent: DescentOptions::new(0.003, 1e-3),
            active_from: -0.03,
            first_objective_change: 0.1,
            first_move: 0.01,
            scale_every: None,
            curvature: Curvature::Unconstrained,
            push_off: 1.0,
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
            Self::Exchange(options) => options.faults(path, faults),
            Self::Sweep(options) => options.faults(path, faults),
        }
    }

    /// Above this violation a design does not count as feasible.
    pub fn violation_tolerance(&self) -> f64 {
        match self {
            Self::Mmfd(options) => options.descent.violation_tolerance,
            Self::Gcmma(options) => options.descent.violation_tolerance,
            Self::Sqp(options) => options.descent.violation_tolerance,
            Self::CmaEs(options) => options.violation_tolerance,
            Self::RandomSearch(options) => options.violation_tolerance,
            Self::Exchange(options) => options.violation_tolerance,
            Self::Sweep(options) => options.violation_tolerance,
        }
    }

    /// Whether each of its points stands for itself, as those of a list, of a random search, of a set of sequences do: it may be
    /// handed on beside the best one.
    pub fn is_sample(&self) -> bool {
        matches!(
            self,
            Self::RandomSearch(_) | Self::Exchange(_) | Self::Sweep(_)
        )
    }

    /// Whether it begins where it is told to: a sweep has its points, an exchange descent its uniform sequences.
    pub fn has_starts(&self) -> bool {
        !matches!(self, Self::Exchange(_) | Self::Sweep(_))
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
            Self::Mmfd(_) | Self::Gcmma(_) | Self::Sqp(_) | Self::Exchange(_) | Self::Sweep(_) => {}
        }
        self
    }
}

impl MmfdOptions {
    /// Notes every option outside its range, under `path`.
    pub fn faults(&self, path: &str, faults: &mut Faults) {
        self.descent.faults(path, faults);
        positive(
            path,
            &[
                ("first_objective_change", self.first_objective_change),
                ("first_move", self.first_move),
                ("push_off", self.push_off),
            ],
            faults,
        );
        if !(self.active_from.is_finite() && self.active_from < 0.0) {
            let message = format!("must be negative, found {}", self.active_from);
            faults.add(format!("{path}.active_from"), message);
        }
        at_least_one(path, &[], faults);
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
