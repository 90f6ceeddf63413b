//! Every optimiser on every published problem, with exact gradients and with differences, beside what others took and with
//! what each is held to.

mod methods;
mod profiles;
mod rule;
mod run;
#[cfg(test)]
mod tests;

use std::collections::BTreeMap;

use serde::Serialize;

pub use methods::{METHODS, Method};
pub use profiles::{DataProfile, TOLERANCES, data_profiles};

use crate::optimiser::published::{self, Case, Other};
use crate::optimiser::{GradientSource, StopReason};

/// One run of one method.
#[derive(Clone, Debug, Serialize)]
pub struct OptimiserLine {
    /// The method.
    pub method: &'static str,
    /// The problem.
    pub problem: String,
    /// Number of its variables.
    pub variables: usize,
    /// `x0`, or the name of another start.
    pub start: String,
    /// Where gradients came from.
    pub gradient: GradientSource,
    /// Objective at the best design.
    pub objective: Option<f64>,
    /// Its relative distance from the best known optimum; absolute where that is 0.
    pub gap: Option<f64>,
    /// Its largest violation.
    pub violation: Option<f64>,
    /// What is left of first-order conditions there, variables in shares of their ranges, over the slope at the start; of
    /// problems with many optima alone.
    pub residual: Option<f64>,
    /// Iterations.
    pub iterations: usize,
    /// Designs evaluated.
    pub analyses: usize,
    /// Gradients had.
    pub gradients: usize,
    /// Analyses and gradients to a gap of 0.1 %.
    pub to_target: Option<[usize; 2]>,
    /// Analyses until all but a share of the possible gain was made, for each share of [`TOLERANCES`].
    pub to_share: [Option<usize>; 2],
    /// Cost of the run over its cost to within 0.1 % of its own last value.
    pub tail: f64,
    /// Why it ended.
    pub stop: StopReason,
    /// What it is held to, in words.
    pub held_to: String,
    /// Whether it keeps to it.
    pub passed: bool,
    /// What it does not keep to.
    pub why: Vec<String>,
}

/// A problem with one kind of gradients: what our methods and others took.
#[derive(Clone, Debug, Serialize)]
pub struct OptimiserTable {
    /// The problem.
    pub problem: String,
    /// In words.
    pub title: String,
    /// Where gradients came from.
    pub gradient: GradientSource,
    /// Our runs.
    pub lines: Vec<OptimiserLine>,
    /// Others from `x0`, as measured.
    pub others: BTreeMap<String, Other>,
}

/// Where one method reaches a gap of 0.1 % at a cost lower than another's by some share.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Win {
    /// The method.
    pub method: &'static str,
    /// The other.
    pub over: &'static str,
    /// The problem, from `x0`.
    pub problem: String,
    /// Where gradients came from.
    pub gradient: GradientSource,
    /// Analyses, and gradients where they are exact.
    pub cost: usize,
    /// The other's; none where it did not get there.
    pub other: Option<usize>,
}

/// Where `method` is cheaper than `over` by at least `share` of that one's cost.
pub fn wins(tables: &[OptimiserTable], [method, over]: [&'static str; 2], share: f64) -> Vec<Win> {
    let cost = |table: &OptimiserTable, name: &str| -> Option<usize> {
        let mut lines = table.lines.iter();
        let line = lines.find(|line| line.method == name && line.start == "x0")?;
        let [analyses, gradients] = line.to_target?;
        Some(analyses + gradients)
    };
    let win = |table: &OptimiserTable| {
        let ran = table.lines.iter().any(|line| line.method == over);
        let (own, other) = (cost(table, method)?, cost(table, over));
        let cheaper = other.is_none_or(|other| own as f64 <= (1.0 - share) * other as f64);
        (ran && cheaper).then(|| Win {
            method,
            over,
            problem: table.problem.clone(),
            gradient: table.gradient,
            cost: own,
            other,
        })
    };
    tables.iter().filter_map(win).collect()
}

/// Runs the methods for which `wants(method, problem)` holds, from every start.
pub fn optimisers(wants: &dyn Fn(&str, &str) -> bool) -> Vec<OptimiserTable> {
    let mut tables = Vec::new();
    for case in published::all() {
        for gradient in [GradientSource::Model, GradientSource::Differences] {
            if case.id == "rosen_suzuki_noisy" && gradient == GradientSource::Model {
                // The exact slope of a ripple says nothing about what is below it.
                continue;
            }
            let lines = lines(&case, gradient, wants);
            if !lines.is_empty() {
                tables.push(OptimiserTable {
                    problem: case.id.clone(),
                    title: case.title.clone(),
                    gradient,
                    lines,
                    others: published::others(&case.id, gradient),
                });
            }
        }
    }
    tables
}

fn lines(
    case: &Case,
    gradient: GradientSource,
    wants: &dyn Fn(&str, &str) -> bool,
) -> Vec<OptimiserLine> {
    let mut lines = Vec::new();
    for method in METHODS.iter().filter(|method| wants(method.name, &case.id)) {
        for (start, x0) in case.all_starts() {
            if !method.excepted(case, gradient, start) {
                lines.push(run::run(method, case, gradient, start, x0));
            }
        }
    }
    lines
}
