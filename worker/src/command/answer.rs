//! What a program answers, and whether it is what was asked.

use serde::Deserialize;

use super::Failure;

/// What a program must answer.
#[derive(Clone, Copy, Debug)]
pub struct Expected {
    /// Design variables.
    pub variables: usize,
    /// Constraints, inequalities and equalities together.
    pub constraints: usize,
    /// Whether it gives gradients where they are wanted.
    pub gradient: bool,
}

/// An answer whose lengths and numbers were checked.
#[derive(Deserialize)]
pub struct Answer {
    pub objective: Option<f64>,
    #[serde(default)]
    pub constraints: Vec<f64>,
    #[serde(default)]
    pub gradient: Option<Vec<f64>>,
    #[serde(default)]
    pub constraint_gradients: Option<Vec<Vec<f64>>>,
}

impl Expected {
    /// Reads a line and checks lengths and numbers.
    pub(super) fn read(self, line: &str, want_gradient: bool) -> Result<Answer, Failure> {
        let because = |reason: String| Err(Failure::Because(reason));
        let answer: Answer = match serde_json::from_str(line) {
            Ok(answer) => answer,
            Err(fault) => return because(format!("the answer cannot be read: {fault}")),
        };
        if !answer.objective.is_some_and(f64::is_finite) {
            return because("the objective is not a finite number".into());
        }
        if let Some(fault) = row_fault("constraints", &answer.constraints, self.constraints) {
            return because(fault);
        }
        if want_gradient && self.gradient {
            let Some(gradient) = &answer.gradient else {
                return because("the gradient is missing".into());
            };
            if let Some(fault) = row_fault("gradient", gradient, self.variables) {
                return because(fault);
            }
            let rows = answer.constraint_gradients.as_deref().unwrap_or_default();
            if rows.len() != self.constraints {
                return because(format!(
                    "constraint_gradients has {} rows, {} are expected",
                    rows.len(),
                    self.constraints
                ));
            }
            for row in rows {
                if let Some(fault) = row_fault("constraint_gradients", row, self.variables) {
                    return because(fault);
                }
            }
        }
        Ok(answer)
    }
}

fn row_fault(name: &str, row: &[f64], expected: usize) -> Option<String> {
    if row.len() != expected {
        return Some(format!(
            "{name} has {} numbers, {expected} are expected",
            row.len()
        ));
    }
    row.iter()
        .any(|value| !value.is_finite())
        .then(|| format!("{name} holds a number that is not finite"))
}
