//! The order of a generation under constraints: ranks by objective and by violation are added, and the weight of the second
//! follows the run.
//!
//! After N. Sakamoto, Y. Akimoto, Adaptive ranking-based constraint handling for explicitly constrained black-box optimization
//! (Evolutionary Computation 30, 2022), with a choice of ours for black boxes, where the distance of the mean from the feasible
//! region is not known: the weight grows while the constraints at the mean, to first order the parents' mean, are violated,
//! and falls while they are not. So the mean settles on the active constraints from either side, and nothing but orders is
//! used: the objective may be replaced by any increasing function of it.

use std::cmp::Ordering;

use serde::{Deserialize, Serialize};

use crate::optimiser::{contract::Values, problem::Problem, vector::add_scaled};

/// The weight changes by exp(+-RATE / sqrt n) in each generation.
const RATE: f64 = 0.2;
/// The weight stays between 1/MOST and MOST, where one of the two ranks decides alone in any generation of common size.
const MOST: f64 = 1e3;

/// What is known of a point.
#[derive(Clone, Copy)]
pub(super) enum Standing<'a> {
    /// Its values, and by how much its geometry was refused before it was repaired; 0 if it was not.
    Evaluated(&'a Values, f64),
    /// Refused by so much, before any analysis.
    Refused(f64),
    /// Nothing.
    Failed,
}

/// The weight of violations against objectives.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Ranking {
    weight: f64,
}

impl Ranking {
    pub fn new() -> Self {
        Self { weight: 1.0 }
    }

    /// Indices of points, the best first; equal ones in the order in which they were drawn. Refused ones follow those that
    /// were evaluated, and failed ones are last.
    pub fn order(&self, problem: &Problem, tolerance: f64, points: &[Standing<'_>]) -> Vec<usize> {
        let values = || {
            points.iter().filter_map(|point| match point {
                Standing::Evaluated(values, refused) => Some((*values, *refused)),
                _ => None,
            })
        };
        let violation = |(values, refused): (&Values, f64)| {
            let violation = problem.violation(&values.constraints).max(refused);
            if violation <= tolerance {
                0.0
            } else {
                violation
            }
        };
        let objectives = ranks(&values().map(|(v, _)| v.objective).collect::<Vec<_>>());
        let violations = ranks(&values().map(violation).collect::<Vec<_>>());
        let mut merits = objectives
            .iter()
            .zip(&violations)
            .map(|(f, v)| f + self.weight * v);
        let keys: Vec<(u8, f64)> = points
            .iter()
            .map(|point| match point {
                Standing::Evaluated(..) => (0, merits.next().unwrap_or(f64::INFINITY)),
                Standing::Refused(violation) => (1, *violation),
                Standing::Failed => (2, 0.0),
            })
            .collect();
        let mut order: Vec<usize> = (0..points.len()).collect();
        order.sort_by(|a, b| compare(keys[*a], keys[*b]));
        order
    }

    /// Follows the mean: the parents with their weights, of which those without values say nothing, and whether its geometry
    /// was refused.
    pub fn follow<'a>(
        &mut self,
        problem: &Problem,
        tolerance: f64,
        parents: impl Iterator<Item = (&'a Standing<'a>, &'a f64)>,
        refused: Option<bool>,
        n: usize,
    ) {
        let mut constraints = vec![0.0; problem.constraints()];
        let mut total = 0.0;
        for (parent, weight) in parents {
            if let Standing::Evaluated(values, _) = parent {
                total += weight;
                add_scaled(&mut constraints, *weight, &values.constraints);
            }
        }
        if total > 0.0 && (!constraints.is_empty() || refused.is_some()) {
            let violated = problem.violation(&constraints) > tolerance * total;
            let violated = violated || refused == Some(true);
            let change = RATE / (n as f64).sqrt() * if violated { 1.0 } else { -1.0 };
            self.weight = (self.weight * change.exp()).clamp(1.0 / MOST, MOST);
        }
    }
}

fn compare(a: (u8, f64), b: (u8, f64)) -> Ordering {
    a.0.cmp(&b.0).then(a.1.total_cmp(&b.1))
}

/// Place of each value among all, from 0; equal values share the mean of their places.
fn ranks(values: &[f64]) -> Vec<f64> {
    let below = |value: &f64| values.iter().filter(|other| *other < value).count() as f64;
    let equal = |value: &f64| values.iter().filter(|other| *other == value).count() as f64;
    let place = |value: &f64| below(value) + 0.5 * (equal(value) - 1.0);
    values.iter().map(place).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn values(objective: f64, constraint: f64) -> Values {
        Values {
            objective,
            constraints: vec![constraint],
            gradient: None,
            constraint_gradients: None,
        }
    }

    fn problem() -> Problem {
        Problem {
            lower: vec![0.0],
            upper: vec![1.0],
            inequalities: 1,
            equalities: 0,
        }
    }

    #[test]
    fn ranks_are_added_and_what_has_no_values_comes_last() {
        let (a, b, c) = (values(1.0, 0.5), values(2.0, -1.0), values(3.0, 0.002));
        let points = [
            Standing::Failed,
            Standing::Evaluated(&c, 0.0),
            Standing::Refused(0.2),
            Standing::Evaluated(&a, 0.0),
            Standing::Refused(0.1),
            Standing::Evaluated(&b, 0.0),
        ];
        let order = |weight| Ranking { weight }.order(&problem(), 0.003, &points);
        assert_eq!(order(1e-3), [3, 5, 1, 4, 2, 0], "by the objective");
        assert_eq!(order(1e3), [5, 1, 3, 4, 2, 0], "feasible points first");
        assert_eq!(ranks(&[2.0, 1.0, 2.0]), [1.5, 0.0, 1.5]);
    }

    #[test]
    fn the_weight_grows_outside_and_falls_inside() {
        let (outside, inside) = (values(1.0, 0.5), values(2.0, -0.5));
        let points = [
            Standing::Evaluated(&outside, 0.0),
            Standing::Evaluated(&inside, 0.0),
        ];
        let mut ranking = Ranking::new();
        ranking.follow(&problem(), 0.003, points.iter().zip(&[0.7, 0.3]), None, 4);
        assert!((ranking.weight - 0.1_f64.exp()).abs() < 1e-15);
        ranking.follow(&problem(), 0.003, points.iter().zip(&[0.3, 0.7]), None, 4);
        assert!((ranking.weight - 1.0).abs() < 1e-15);
        ranking.follow(
            &problem(),
            0.003,
            [Standing::Failed].iter().zip(&[1.0]),
            None,
            4,
        );
        assert!(
            (ranking.weight - 1.0).abs() < 1e-15,
            "a failure says nothing"
        );
    }
}
