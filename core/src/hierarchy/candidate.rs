//! What an ended step hands on: its N best designs that are distinct.

use serde::{Deserialize, Serialize};

use crate::scene::Orientation;
use crate::study::{BestPoint, Given, Study, StudyError};

/// Two designs are the same candidate if no variable differs by more than this share of its range.
pub const DISTINCT: f64 = 0.01;

/// A design that a step hands on.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Candidate {
    /// Restart that found it.
    pub restart: usize,
    /// Which evaluation of the restart, from 0.
    pub evaluation: usize,
    /// Design variables.
    pub x: Vec<f64>,
    /// Objective.
    pub objective: f64,
    /// Largest violation of a constraint.
    pub max_violation: f64,
    /// The sense in which its area counts.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub orientation: Option<Orientation>,
    /// What the step was given by others: a layout changes what its variables mean.
    #[serde(default, skip_serializing_if = "Given::is_empty")]
    pub given: Given,
}

/// The result of a step.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct StepResult {
    /// Its candidates, the best first; none where nothing feasible was found.
    pub candidates: Vec<Candidate>,
}

impl StepResult {
    /// Of the points that the restarts of a step kept, each with its restart: the `keeps` best distinct ones. Among equals
    /// the first restart's. `given`: what the step was given.
    ///
    /// # Errors
    /// Where the study has no such step.
    pub fn of(
        study: &Study,
        step: usize,
        given: &Given,
        kept: &[(usize, BestPoint)],
    ) -> Result<Self, StudyError> {
        let study = &*study.given(step, given);
        let keeps = study.step(step)?.keeps;
        let mut order: Vec<&(usize, BestPoint)> = kept.iter().collect();
        order.sort_by(|(a, p), (b, q)| {
            (p.objective.total_cmp(&q.objective))
                .then(a.cmp(b))
                .then(p.evaluation.cmp(&q.evaluation))
        });
        let mut candidates: Vec<Candidate> = Vec::new();
        for (restart, point) in order {
            if candidates.len() == keeps {
                break;
            }
            let mut is_new = true;
            for other in &candidates {
                is_new &= study.scaled_distance(step, &point.x, &other.x)? > DISTINCT;
            }
            if is_new {
                candidates.push(Candidate {
                    restart: *restart,
                    evaluation: point.evaluation,
                    x: point.x.clone(),
                    objective: point.objective,
                    max_violation: point.max_violation,
                    orientation: point.orientation,
                    given: given.clone(),
                });
            }
        }
        Ok(Self { candidates })
    }
}
