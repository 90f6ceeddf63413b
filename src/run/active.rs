//! Which limits are active at a step's best design, and what they cost.

use salp_core::optimiser::{Conditions, Values, conditions};
use salp_core::study::{Outcome, Study};
use serde_json::{Value, json};

use crate::output::number;

/// A row this close to its bound, in shares of its limit, counts as active.
const ACTIVE_FROM: f64 = 0.01;
/// Rows that the summary names.
const NAMED: usize = 12;

/// Active limits of a best design.
pub struct ActiveLimits {
    rows: Vec<ActiveRow>,
    conditions: Option<Conditions>,
    variables: usize,
}

struct ActiveRow {
    index: usize,
    name: String,
    value: f64,
    multiplier: Option<f64>,
}

impl ActiveLimits {
    /// Of the outcome at a design; multipliers where it has gradients.
    pub fn of(study: &Study, step: usize, x: &[f64], outcome: &Outcome) -> Option<Self> {
        let problem = study.problem(step).ok()?;
        let names = study.constraint_names(step).ok()?;
        let values = Values {
            objective: outcome.objective?,
            constraints: outcome.constraints.clone(),
            gradient: outcome.gradient.clone(),
            constraint_gradients: outcome.constraint_gradients.clone(),
        };
        let conditions = conditions(&problem, x, &values, ACTIVE_FROM);
        let active: Vec<(usize, Option<f64>)> = match &conditions {
            Some(found) => found.active.iter().map(|(i, m)| (*i, Some(*m))).collect(),
            None => (0..values.constraints.len())
                .filter(|i| *i >= problem.inequalities || values.constraints[*i] >= -ACTIVE_FROM)
                .map(|i| (i, None))
                .collect(),
        };
        let mut rows: Vec<ActiveRow> = active
            .into_iter()
            .map(|(index, multiplier)| ActiveRow {
                index,
                name: names.get(index).cloned().unwrap_or_default(),
                value: values.constraints[index],
                multiplier,
            })
            .collect();
        // The dearest first; rows without a multiplier in their own order.
        let cost = |row: &ActiveRow| row.multiplier.unwrap_or(0.0).abs();
        rows.sort_by(|a, b| cost(b).total_cmp(&cost(a)));
        Some(Self {
            rows,
            conditions,
            variables: problem.dimension(),
        })
    }

    /// As a document.
    pub fn document(&self) -> Value {
        let row = |r: &ActiveRow| json!({ "index": r.index, "name": r.name, "value": r.value, "multiplier": r.multiplier });
        json!({
            "active": self.rows.iter().map(row).collect::<Vec<_>>(),
            "at_bounds": self.conditions.as_ref().map(|c| c.at_bounds),
            "first_order_residual": self.conditions.as_ref().map(|c| c.residual),
        })
    }

    /// Lines of the summary; `unit` is that of the objective, ` (mm)`.
    pub fn lines(&self, unit: &str) -> Vec<String> {
        let dear = |r: &&ActiveRow| r.multiplier.is_none_or(|m| m != 0.0);
        let named: Vec<String> = self
            .rows
            .iter()
            .filter(dear)
            .take(NAMED)
            .map(|r| match r.multiplier {
                Some(m) => format!("{} ({})", r.name, number(Some(m))),
                None => r.name.clone(),
            })
            .collect();
        let others = self.rows.len() - named.len();
        let mut text = if self.rows.is_empty() {
            "no limit is active at the best design".to_owned()
        } else {
            format!("active limits at the best design: {}", named.join("; "))
        };
        if others > 0 && !named.is_empty() {
            text += &format!("; and {others} more");
        } else if others > 0 {
            text += &format!("{others} rows without a multiplier");
        }
        let mut lines = vec![text];
        if let Some(found) = &self.conditions {
            let what = if named.is_empty() {
                String::new()
            } else {
                format!(
                    "in brackets the multiplier, the objective{unit} to be gained for each unit by which its row is relaxed; "
                )
            };
            lines.push(format!(
                "{what}{} of {} variables at a bound; first-order conditions met to {} %",
                found.at_bounds,
                self.variables,
                number(Some(100.0 * found.residual))
            ));
        }
        lines
    }
}
