//! Data profiles: the share of its problems that each method has solved, against what it has evaluated.

use super::OptimiserTable;
use crate::analysis::{Profile, Profiles, Solved};
use crate::optimiser::GradientSource;

/// A problem is solved once all but this share of the possible gain was made (tau of More and Wild 2009).
pub const TOLERANCES: [f64; 2] = [1e-3, 1e-7];

/// The data profile of a method.
#[derive(Clone, Debug, PartialEq)]
pub struct DataProfile {
    /// The share over k evaluations of n + 1 designs.
    pub profile: Profile,
    /// Number of problems on which the method was run.
    pub problems: usize,
}

/// The data profiles of all methods in the order of the tables, for each of [`TOLERANCES`]: from `x0`, with differences, whose
/// gradient is what an evaluation of n + 1 designs buys. Each method counts the problems that it is run on.
pub fn data_profiles(tables: &[OptimiserTable]) -> [Vec<DataProfile>; 2] {
    let by_differences = |table: &&OptimiserTable| table.gradient == GradientSource::Differences;
    let lines = || {
        let tables = tables.iter().filter(by_differences);
        tables.flat_map(|t| &t.lines).filter(|l| l.start == "x0")
    };
    let mut methods: Vec<&str> = Vec::new();
    for line in lines() {
        if !methods.contains(&line.method) {
            methods.push(line.method);
        }
    }
    [0, 1].map(|which| {
        let of_method = |method: &&str| {
            let own = lines().filter(|line| line.method == *method);
            let solved: Vec<Solved> = own
                .map(|line| Solved {
                    problem: line.problem.clone(),
                    method: line.method.to_owned(),
                    variables: line.variables,
                    cost: line.to_share[which].map(|cost| cost as f64),
                })
                .collect();
            let found = Profiles::of(&solved);
            let profile = found.data.into_iter().next()?;
            Some(DataProfile {
                profile,
                problems: found.problems,
            })
        };
        methods.iter().filter_map(of_method).collect()
    })
}
