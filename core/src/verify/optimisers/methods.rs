//! The methods, with what each is held to.

use crate::optimiser::published::Case;
use crate::optimiser::{
    CmaEsOptions, Curvature, DescentOptions, GcmmaOptions, GradientSource, MmfdOptions,
    OptimiserOptions, RandomSearchOptions, SqpOptions,
};

/// What the cost of a method is measured by.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Against {
    /// Cost of the whole run at most 1.5 times that of another's, plus 10.
    WholeRun(&'static str),
    /// Analyses and gradients to a gap of 0.1 % at most twice another's; where that one does not get there, a second's.
    Both(&'static str, &'static str),
    /// Gradients to a gap of 0.1 % at most twice another's; with differences analyses.
    Gradients(&'static str),
    /// Nobody's cost: it works by values alone, and is shown beside the differences of problems of at most ten variables.
    Values,
}

/// A method as it is run.
#[derive(Clone, Copy, Debug)]
pub struct Method {
    /// Its name.
    pub name: &'static str,
    /// Largest gap at its end.
    pub(super) largest_gap: f64,
    pub(super) against: Against,
    /// Problems that it need not solve.
    pub(super) may_fail: &'static [&'static str],
    /// Its options; with `many_optima` such that runs end at first-order conditions.
    pub(super) options: fn(gradient: GradientSource, many_optima: bool) -> OptimiserOptions,
}

/// All methods.
pub const METHODS: [Method; 7] = [
    Method {
        name: "mmfd",
        largest_gap: 0.011,
        against: Against::WholeRun("reference_mmfd"),
        may_fail: &[],
        options: |gradient, _| {
            MmfdOptions {
                descent: DescentOptions {
                    gradient,
                    ..MmfdOptions::default().descent
                },
                ..MmfdOptions::default()
            }
            .into()
        },
    },
    Method {
        name: "mmfd-curvature",
        // No longer the published method, which is held to 1.1 %.
        largest_gap: 0.02,
        against: Against::WholeRun("reference_mmfd"),
        may_fail: &[],
        options: |gradient, _| {
            MmfdOptions {
                descent: DescentOptions {
                    gradient,
                    ..MmfdOptions::default().descent
                },
                curvature: Curvature::Always,
                ..MmfdOptions::default()
            }
            .into()
        },
    },
    Method {
        name: "gcmma",
        largest_gap: 1e-3,
        against: Against::Both("svanberg_GCMMA", "svanberg_MMA"),
        // So slow from its start near the optimum that the stall guard ends it at 0.2 %.
        may_fail: &["hs93"],
        options: |gradient, many_optima| asymptotes(gradient, many_optima, true).into(),
    },
    Method {
        name: "mma",
        largest_gap: 1e-3,
        against: Against::Both("svanberg_MMA", "svanberg_MMA"),
        // It cycles, or wanders outside the feasible region.
        may_fail: &[
            "cantilever_50",
            "cantilever_100",
            "hs26",
            "hs35",
            "hs65",
            "hs93",
            "keane_10",
            "keane_2",
            "rastrigin_plane_4",
            "rosenbrock_disk",
            "six_hump_camel",
        ],
        options: |gradient, many_optima| asymptotes(gradient, many_optima, false).into(),
    },
    Method {
        name: "sqp",
        largest_gap: 1e-3,
        against: Against::Gradients("scipy_SLSQP"),
        may_fail: &[],
        options: |gradient, _| {
            SqpOptions {
                descent: DescentOptions {
                    gradient,
                    ..SqpOptions::default().descent
                },
                ..SqpOptions::default()
            }
            .into()
        },
    },
    Method {
        name: "cma_es",
        largest_gap: 1e-2,
        against: Against::Values,
        // Four runs of five reach it.
        may_fail: &["spring"],
        options: |_, _| CmaEsOptions::default().into(),
    },
    Method {
        name: "random_search",
        // The baseline.
        largest_gap: f64::INFINITY,
        against: Against::Values,
        may_fail: &[],
        options: |_, _| OptimiserOptions::RandomSearch(RandomSearchOptions::default()),
    },
];

/// Most variables of a problem on which methods are shown that work by values alone.
const MOST_BY_VALUES: usize = 10;

fn asymptotes(gradient: GradientSource, many_optima: bool, globalise: bool) -> GcmmaOptions {
    let default = GcmmaOptions {
        descent: DescentOptions {
            gradient,
            ..GcmmaOptions::default().descent
        },
        globalise,
        ..GcmmaOptions::default()
    };
    let default = if globalise {
        default
    } else {
        GcmmaOptions {
            descent: DescentOptions {
                infeasible_iterations: 100,
                ..default.descent.clone()
            },
            ..default
        }
    };
    if many_optima {
        // Small changes of the objective say less about conditions here than where curvature is known.
        GcmmaOptions {
            descent: DescentOptions {
                relative_tolerance: 1e-7,
                stall_factor: 0.0,
                ..default.descent.clone()
            },
            ..default
        }
    } else {
        default
    }
}

impl Method {
    /// Whether it is not run: by values alone with gradients, from a second start, or on many variables; along the floor of
    /// `rosenbrock_disk`, where descent is below the error of differences and a tolerance that is a part of a large first
    /// objective ends the run early.
    pub(super) fn excepted(&self, case: &Case, gradient: GradientSource, start: &str) -> bool {
        if self.against == Against::Values {
            return gradient == GradientSource::Model || start != "x0" || case.n > MOST_BY_VALUES;
        }
        self.name != "sqp"
            && case.id == "rosenbrock_disk"
            && gradient == GradientSource::Differences
            && start != "x0"
    }
}
