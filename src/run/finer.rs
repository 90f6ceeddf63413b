//! The best design on elements half as large: what becomes of its objective and of its limits there.
//!
//! An optimiser goes where the mesh lets it: a design at a limit is at the edge of what its own elements show, and coarse ones
//! show too little. The error band of the objective says nothing of that.

use salp_core::evaluate::evaluate;
use salp_core::optimiser::AskKind;
use salp_core::study::race::Fidelity;
use salp_core::study::{EvaluationRequest, Given, OutcomeStatus, Study};
use salp_protocol::Best;
use serde::Serialize;

use super::winner::Evaluated;
use crate::output::number;
use crate::stopwatch::Stopwatch;

/// Elements each way over those of the design's own mesh.
const SHARE: f64 = 2.0;
/// A violation beyond this is said to be due to a mesh that is too coarse.
const ALARMING: f64 = 0.05;

/// The best design on finer elements.
#[derive(Clone, Debug, Serialize)]
pub struct Finer {
    /// How the evaluation ended.
    status: OutcomeStatus,
    /// Number of elements.
    elements: Option<usize>,
    /// The objective.
    objective: Option<f64>,
    /// The objective on the design's own elements.
    own_objective: f64,
    /// Largest violation of a constraint, 0 where all hold.
    max_violation: Option<f64>,
    /// The constraint that is nearest to its limit or farthest beyond it.
    constraint: Option<String>,
    /// Whether the largest violation is within the tolerance of the optimiser.
    within_tolerance: bool,
}

/// Evaluates the best design of a step on finer elements.
pub fn solve(study: &Study, step: usize, best: &Best, evaluated: &Evaluated) -> Option<Finer> {
    let problem = study.problem(step).ok()?;
    let request = EvaluationRequest {
        step,
        kind: AskKind::Initial,
        iteration: 0,
        x: best.x.clone(),
        want_gradient: false,
        plan_base: evaluated.plan_base.clone(),
        orientation: evaluated.orientation,
        second_mesh: false,
        fidelity: Some(Fidelity {
            mesh: SHARE,
            load_steps_per_leg: None,
        }),
        given: Given::default(),
    };
    let outcome = evaluate(study, &request, &mut Stopwatch::start());
    let rows = outcome.constraints.iter().enumerate();
    let breaks = |(i, value): (usize, &f64)| {
        if i < problem.inequalities {
            *value
        } else {
            value.abs()
        }
    };
    let most = rows.max_by(|a, b| breaks(*a).total_cmp(&breaks(*b)));
    let names = study.constraint_names(step).unwrap_or_default();
    let violation = most.map(|row| breaks(row).max(0.0));
    let tolerance = study.step(step).ok()?.optimiser.violation_tolerance();
    Some(Finer {
        elements: outcome.report.as_ref().map(|report| report.elements),
        objective: outcome.objective,
        own_objective: best.objective,
        max_violation: violation,
        constraint: most.and_then(|(i, _)| names.get(i).cloned()),
        within_tolerance: violation.is_some_and(|violation| violation <= tolerance),
        status: outcome.status,
    })
}

impl Finer {
    /// A line of the report.
    pub fn line(&self, unit: &str) -> String {
        let (Some(objective), Some(violation)) = (self.objective, self.max_violation) else {
            let status = serde_json::to_value(&self.status).unwrap_or_default();
            let status = status["status"].as_str().unwrap_or_default();
            return format!(
                "on elements half as large: no values ({status}), so limits are known on this mesh only"
            );
        };
        let elements = self.elements.unwrap_or_default();
        let change = 100.0 * (objective / self.own_objective - 1.0);
        let space = if unit.is_empty() { "" } else { " " };
        let limits = match &self.constraint {
            _ if self.within_tolerance => "all limits hold".to_owned(),
            Some(name) => format!(
                "a limit is broken by {:.1} % of it ({name}){}",
                100.0 * violation,
                if violation > ALARMING {
                    ": this mesh is too coarse for the limits"
                } else {
                    ""
                }
            ),
            None => String::new(),
        };
        format!(
            "on elements half as large ({elements}): objective {}{space}{unit} ({change:+.1} %); {limits}",
            number(Some(objective))
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn finer(max_violation: Option<f64>) -> Finer {
        Finer {
            status: match max_violation {
                Some(_) => OutcomeStatus::Ok,
                None => OutcomeStatus::WorkLimit,
            },
            elements: Some(5088),
            objective: max_violation.map(|_| -736.94),
            own_objective: -726.5,
            max_violation,
            constraint: Some("stretch: chamber 1, corner 3".into()),
            within_tolerance: max_violation.is_some_and(|violation| violation <= 3e-3),
        }
    }

    #[test]
    fn a_line_says_what_becomes_of_the_objective_and_of_the_limits() {
        let said = |violation| finer(violation).line("mm\u{b2}");
        let holds = said(Some(1e-3));
        assert!(
            holds.contains("(5088): objective -736.94 mm\u{b2} (+1.4 %)"),
            "{holds}"
        );
        assert!(holds.ends_with("all limits hold"), "{holds}");
        let broken = said(Some(0.025));
        assert!(
            broken.ends_with("broken by 2.5 % of it (stretch: chamber 1, corner 3)"),
            "{broken}"
        );
        assert!(said(Some(0.31)).ends_with("too coarse for the limits"));
        let unknown = said(None);
        assert!(unknown.contains("no values (work_limit)"), "{unknown}");
    }
}
