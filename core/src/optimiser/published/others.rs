//! What existing optimisers took on the problems, as measured.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use crate::optimiser::GradientSource;

/// What another optimiser took on one problem. Costs are analyses and, with exact gradients, gradients.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Other {
    /// Cost to a violation of at most 1e-3 and a gap of at most 0.1 %; none where it did not get there.
    pub to_target: Option<Vec<usize>>,
    /// Cost of the whole run.
    pub whole: Vec<usize>,
    /// Gap at its end; none where nothing was returned.
    pub gap: Option<f64>,
    /// Violation at its end where that is more than 1e-3.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub violation: Option<f64>,
    /// Whether a time limit of 75 s or a failure stopped it.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub stopped: bool,
}

type ByProblem = BTreeMap<String, BTreeMap<String, Other>>;

#[derive(Deserialize)]
struct File {
    exact: ByProblem,
    differences: ByProblem,
}

/// What others took on a problem, by their names.
#[expect(clippy::expect_used, reason = "a shipped file, read by a test")]
pub fn others(problem: &str, gradient: GradientSource) -> BTreeMap<String, Other> {
    let file: File =
        serde_json::from_str(include_str!("data/others.json")).expect("the file of figures");
    let mut figures = match gradient {
        GradientSource::Model => file.exact,
        GradientSource::Differences => file.differences,
    };
    figures.remove(problem).unwrap_or_default()
}
