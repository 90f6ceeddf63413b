//! What a simplification gave up: the value that it gave a candidate beside the value of the same design in the step that took
//! it, which simplifies less.

use serde::{Deserialize, Serialize};

use crate::study::takes::{StepInputs, TakenFrom};

/// A candidate in two models.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct GivenUp {
    /// Where it comes from, with its objective there.
    pub from: Vec<TakenFrom>,
    /// Objective of the same design in the step that took it; `None` where it has none there.
    pub objective: Option<f64>,
    /// Best objective of the step that took it, among designs that count: what was gained by leaving the simplification.
    pub best: Option<f64>,
}

/// Of every design that a step took, in its order. `evaluated` are the step's designs with their objectives, `best` is the best one
/// that counts; of a design that was evaluated in either sense of its area the better value is told.
pub fn given_up(
    inputs: &StepInputs,
    evaluated: &[(&[f64], f64)],
    best: Option<f64>,
) -> Vec<GivenUp> {
    let of = |x: &[f64]| {
        let same = evaluated.iter().filter(|(other, _)| *other == x);
        same.map(|(_, value)| *value).reduce(f64::min)
    };
    inputs
        .designs
        .iter()
        .map(|design| GivenUp {
            from: design.from.clone(),
            objective: of(&design.x),
            best,
        })
        .collect()
}
