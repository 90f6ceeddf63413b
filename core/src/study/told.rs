//! What an outcome means to the optimiser, and what makes a report nonsense.

use super::error::StudyError;
use super::result::{EvaluationRequest, Outcome, OutcomeStatus};
use super::spec::{StepConstraints, Study};
use crate::optimiser::{Problem, Told, Values};
use crate::scene::Orientation;

impl OutcomeStatus {
    /// Its name in documents and hashes.
    pub fn name(&self) -> &'static str {
        match self {
            Self::Ok => "ok",
            Self::InfeasibleGeometry { .. } => "infeasible_geometry",
            Self::NoEquilibrium { .. } => "no_equilibrium",
            Self::NoMargin { .. } => "no_margin",
            Self::NotUnique { .. } => "not_unique",
            Self::NotConverged { .. } => "not_converged",
            Self::InvalidResult { .. } => "invalid_result",
            Self::Failed { .. } => "failed",
            Self::WorkLimit => "work_limit",
            Self::Cancelled => "cancelled",
            Self::Lost => "lost",
        }
    }
}

impl Outcome {
    /// An outcome without values.
    pub fn without_values(status: OutcomeStatus) -> Self {
        Self {
            status,
            objective: None,
            constraints: Vec::new(),
            gradient: None,
            constraint_gradients: None,
            report: None,
            wall_s: 0.0,
            cpu_s: 0.0,
        }
    }

    /// Whether a state of the path lies on an unstable branch: such a design is never called optimal.
    pub fn is_unstable(&self) -> bool {
        self.report.as_ref().is_some_and(|r| r.negative_pivots > 0)
    }

    /// The sense in which the tip ran around its area; `None` where the objective is no area.
    pub fn sense(&self) -> Option<Orientation> {
        let area = self.report.as_ref()?.enclosed_area_mm2?;
        Some(Orientation::of_area(area))
    }

    /// What the optimiser hears. Overlapping walls feed it like any other design.
    pub fn told(&self) -> Told {
        match (&self.status, self.objective) {
            (OutcomeStatus::Ok, Some(objective)) => Told::Values(Values {
                objective,
                constraints: self.constraints.clone(),
                gradient: self.gradient.clone(),
                constraint_gradients: self.constraint_gradients.clone(),
            }),
            _ => Told::Failed,
        }
    }
}

impl Study {
    /// The optimiser's problem of a step.
    pub fn problem(&self, step: usize) -> Result<Problem, StudyError> {
        let variables = self.variables(step)?;
        let equalities = match self.step(step)?.constraints {
            StepConstraints::Counts { equalities, .. } => equalities,
            StepConstraints::Chambers(_) => 0,
        };
        Ok(Problem {
            lower: variables.lower,
            upper: variables.upper,
            inequalities: self.constraint_count(step)? - equalities,
            equalities,
        })
    }

    /// The outcome as it may be stored: one that claims to be ok with a wrong length or a number that is not finite
    /// becomes `invalid_result`, and one that is not ok carries no values. Times that are not finite become 0.
    pub fn checked(
        &self,
        request: &EvaluationRequest,
        outcome: &Outcome,
    ) -> Result<Outcome, StudyError> {
        let problem = if request.second_mesh {
            // The objective alone is asked for.
            Problem {
                inequalities: 0,
                equalities: 0,
                ..self.problem(request.step)?
            }
        } else {
            self.problem(request.step)?
        };
        let mut checked = outcome.clone();
        if outcome.status == OutcomeStatus::Ok
            && let Some(reason) = nonsense(&problem, outcome)
        {
            checked.status = OutcomeStatus::InvalidResult { reason };
        }
        if checked.status != OutcomeStatus::Ok {
            checked.objective = None;
            checked.constraints.clear();
            checked.gradient = None;
            checked.constraint_gradients = None;
        }
        for seconds in [&mut checked.wall_s, &mut checked.cpu_s] {
            if !(seconds.is_finite() && *seconds >= 0.0) {
                *seconds = 0.0;
            }
        }
        Ok(checked)
    }
}

fn nonsense(problem: &Problem, outcome: &Outcome) -> Option<String> {
    let (n, m) = (problem.dimension(), problem.constraints());
    match outcome.objective {
        None => return Some("no objective".into()),
        Some(f) if !f.is_finite() => return Some(format!("the objective is {f}")),
        Some(_) => {}
    }
    if let Some(reason) = bad_row("constraints", &outcome.constraints, m) {
        return Some(reason);
    }
    if let Some(gradient) = &outcome.gradient
        && let Some(reason) = bad_row("gradient", gradient, n)
    {
        return Some(reason);
    }
    let rows = outcome.constraint_gradients.as_ref()?;
    if rows.len() != m {
        return Some(format!(
            "constraint_gradients has {} rows, expected {m}",
            rows.len()
        ));
    }
    rows.iter()
        .enumerate()
        .find_map(|(i, row)| bad_row(&format!("constraint_gradients[{i}]"), row, n))
}

fn bad_row(what: &str, row: &[f64], expected: usize) -> Option<String> {
    if row.len() != expected {
        return Some(format!(
            "{what} has {} numbers, expected {expected}",
            row.len()
        ));
    }
    let i = row.iter().position(|v| !v.is_finite())?;
    Some(format!("{what}[{i}] is {}", row[i]))
}
