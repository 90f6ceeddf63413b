//! Asks for evaluations of a study's first step, and holds their gradients against differences.

use serde_json::json;

use super::super::evaluate;
use crate::equilibrium::Unobserved;
use crate::scene::Orientation;
use crate::study::{EvaluationRequest, Outcome, OutcomeStatus, Study};

/// A step with the design of its mesh plan and the sense of its area.
pub(super) struct Asked<'a> {
    pub study: &'a Study,
    pub base: &'a [f64],
    pub orientation: Option<Orientation>,
}

impl Asked<'_> {
    /// The outcome at a design, which is to be ok.
    pub fn at(&self, x: &[f64], want_gradient: bool) -> Outcome {
        let request = EvaluationRequest {
            step: 0,
            kind: serde_json::from_value(json!("trial")).expect("a kind"),
            iteration: 0,
            x: x.to_vec(),
            want_gradient,
            plan_base: Some(self.base.to_vec()),
            orientation: self.orientation,
            second_mesh: false,
            fidelity: None,
            given: crate::study::Given::default(),
        };
        let outcome = evaluate(self.study, &request, &mut Unobserved);
        assert_eq!(outcome.status, OutcomeStatus::Ok, "{:?}", outcome.report);
        self.study.checked(&request, &outcome).expect("a step")
    }

    /// Holds the gradients of all rows and of the objective at a design against differences of step `h` along some directions:
    /// within `bound` of the sum of a gradient's components.
    pub fn check_gradients(&self, x: &[f64], directions: u8, h: f64, bound: f64) {
        let outcome = self.at(x, true);
        let gradient = outcome.gradient.expect("a gradient");
        assert_eq!(gradient.len(), x.len());
        let rows = outcome.constraint_gradients.expect("rows");
        for k in 0..directions {
            let along = direction(x.len(), f64::from(k));
            let differences = difference(x, &along, h, |x| {
                let outcome = self.at(x, false);
                let mut values = outcome.constraints;
                values.push(outcome.objective.expect("an objective"));
                values
            });
            assert_eq!(differences.len(), rows.len() + 1);
            for (i, row) in rows.iter().chain([&gradient]).enumerate() {
                let (exact, size) = (dot(row, &along), size(row));
                assert!(size > 1e-9 || i < rows.len(), "row {i} is flat");
                assert!(
                    (differences[i] - exact).abs() <= bound * size.max(1e-6),
                    "row {i}, direction {k}: {} against {exact}",
                    differences[i]
                );
            }
        }
    }
}

/// A direction that moves every variable.
pub(super) fn direction(variables: usize, k: f64) -> Vec<f64> {
    (0..variables)
        .map(|i| (1.3 * i as f64 * (k + 1.0) + k).sin())
        .collect()
}

/// Derivatives of values along a direction by central differences of fourth order, so that truncation stays small.
pub(super) fn difference(
    x: &[f64],
    along: &[f64],
    h: f64,
    values: impl Fn(&[f64]) -> Vec<f64>,
) -> Vec<f64> {
    let shifted = |s: f64| {
        let moved = x.iter().zip(along).map(|(x, d)| x + s * d);
        values(&moved.collect::<Vec<_>>())
    };
    let [a, b, c, d] = [-2.0 * h, -h, h, 2.0 * h].map(shifted);
    (0..a.len())
        .map(|i| (a[i] - 8.0 * b[i] + 8.0 * c[i] - d[i]) / (12.0 * h))
        .collect()
}

pub(super) fn dot(gradient: &[f64], along: &[f64]) -> f64 {
    gradient.iter().zip(along).map(|(g, d)| g * d).sum()
}

/// Sum of the components' sizes.
pub(super) fn size(gradient: &[f64]) -> f64 {
    gradient.iter().map(|g| g.abs()).sum()
}
