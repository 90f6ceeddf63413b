//! Which limits are active at a step's best design, and what they cost.

use salp_core::optimiser::{Conditions, Values, conditions};
use salp_core::study::spec::StepConstraints;
use salp_core::study::{Outcome, Study};
use serde::Serialize;
use serde_json::{Value, json};

use crate::output::number;

/// A row this close to its bound, in shares of its limit, counts as active.
const ACTIVE_FROM: f64 = 0.01;
/// Rows that the summary names.
const NAMED: usize = 12;

/// Active limits of a best design.
pub struct ActiveLimits {
    rows: Vec<ActiveRow>,
    settings: Vec<LimitSetting>,
    conditions: Option<Conditions>,
    variables: usize,
}

/// A limit of a step: its rows by how their names begin.
struct LimitSetting {
    name: &'static str,
    value: f64,
    unit: &'static str,
    rows: Vec<String>,
    /// d row / d limit from the row's value.
    slope: Box<dyn Fn(f64) -> f64>,
}

/// What the objective is worth by a limit.
#[derive(Serialize)]
pub struct ByLimit {
    /// The field of the constraints.
    limit: &'static str,
    /// Its value.
    value: f64,
    /// d objective / d limit, the design following to the new optimum.
    per_unit: f64,
    #[serde(skip)]
    unit: &'static str,
}

struct ActiveRow {
    index: usize,
    name: String,
    value: f64,
    multiplier: Option<f64>,
}

/// By how much an outcome with gradients misses the first-order conditions at its design, a share of the objective's gradient.
pub fn first_order_residual(
    study: &Study,
    step: usize,
    x: &[f64],
    outcome: &Outcome,
) -> Option<f64> {
    let problem = study.problem(step).ok()?;
    Some(conditions(&problem, x, &values(outcome)?, ACTIVE_FROM)?.residual)
}

fn values(outcome: &Outcome) -> Option<Values> {
    Some(Values {
        objective: outcome.objective?,
        constraints: outcome.constraints.clone(),
        gradient: outcome.gradient.clone(),
        constraint_gradients: outcome.constraint_gradients.clone(),
    })
}

impl ActiveLimits {
    /// Of the outcome at a design; multipliers where it has gradients.
    pub fn of(study: &Study, step: usize, x: &[f64], outcome: &Outcome) -> Option<Self> {
        let problem = study.problem(step).ok()?;
        let names = study.constraint_names(step).ok()?;
        let values = values(outcome)?;
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
            settings: settings(study, step, outcome),
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

    /// d objective / d limit of the limits that are active, from their multipliers: the objective that is gained when rows are
    /// relaxed, times what the limit relaxes them by.
    pub fn by_limit(&self) -> Vec<ByLimit> {
        let of = |limit: &LimitSetting| {
            let begins =
                |row: &&ActiveRow| limit.rows.iter().any(|name| row.name.starts_with(name));
            let rows = self.rows.iter().filter(begins);
            let slopes = rows.map(|row| Some(row.multiplier? * (limit.slope)(row.value)));
            let slopes: Vec<f64> = slopes.collect::<Option<_>>()?;
            let per_unit = slopes.iter().sum();
            (per_unit != 0.0).then_some(ByLimit {
                limit: limit.name,
                value: limit.value,
                per_unit,
                unit: limit.unit,
            })
        };
        self.settings.iter().filter_map(of).collect()
    }

    /// The same as a line; `unit` is that of the objective.
    pub fn limit_lines(&self, unit: &str) -> Option<String> {
        let found: Vec<String> = self
            .by_limit()
            .iter()
            .map(|l| {
                let (value, slope) = (number(Some(l.value)), number(Some(l.per_unit)));
                let per = if l.unit.is_empty() { "1" } else { l.unit };
                format!("{} ({value}): {slope} {unit} per {per}", l.limit)
            })
            .collect();
        (!found.is_empty()).then(|| {
            format!(
                "objective by the limits, the design following to the new optimum: {}",
                found.join("; ")
            )
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

/// The limits of a step whose rows have a derivative by them.
fn settings(study: &Study, step: usize, outcome: &Outcome) -> Vec<LimitSetting> {
    let (Some(body), Some(s)) = (&study.body, study.steps.get(step)) else {
        return Vec::new();
    };
    let StepConstraints::Chambers(limits) = &s.constraints else {
        return Vec::new();
    };
    let mut settings = Vec::new();
    let at_margin = limits
        .load_margin
        .number()
        .map(|f| (f, format!("at {f} times the load, ")));
    // Where the margin was not reached its rows are the margin minus the factor that was.
    let report = outcome.report.as_ref();
    let lost = report.is_some_and(|report| report.margin_reached.is_some());
    if let Some(limit) = body.stretch_limit(limits) {
        let mut rows = vec!["stretch: ".to_owned()];
        rows.extend(
            at_margin
                .iter()
                .filter(|_| !lost)
                .map(|(_, name)| name.clone()),
        );
        settings.push(LimitSetting {
            name: "stretch",
            value: limit,
            unit: "",
            rows,
            // The row is v / limit - 1.
            slope: Box::new(move |row| -(row + 1.0) / limit),
        });
    }
    if let (Some((factor, name)), true) = (at_margin, lost) {
        settings.push(LimitSetting {
            name: "load_margin",
            value: factor,
            unit: "",
            rows: vec![name],
            slope: Box::new(|_| 1.0),
        });
    }
    if let Some(gap) = limits.wall_gap_mm.number() {
        let wall = limits.wall_mm;
        settings.push(LimitSetting {
            name: "wall_gap_mm",
            value: gap,
            unit: "mm",
            rows: vec!["gap of facing walls: ".to_owned()],
            // (gap - v) / wall.
            slope: Box::new(move |_| 1.0 / wall),
        });
    }
    let wall = limits.wall_mm;
    settings.push(LimitSetting {
        name: "wall_mm",
        value: wall,
        unit: "mm",
        rows: vec!["wall: ".to_owned()],
        // 1 - t / wall.
        slope: Box::new(move |row| (1.0 - row) / wall),
    });
    settings
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn limits_are_worth_what_their_rows_are() {
        let row = |name: &str, value: f64, multiplier: f64| ActiveRow {
            index: 0,
            name: name.into(),
            value,
            multiplier: Some(multiplier),
        };
        let limits = ActiveLimits {
            rows: vec![
                row("stretch: chamber 1, corner 2", 0.0, 30.0),
                row("at 1.1 times the load, stretch: chamber 1", -0.001, 10.0),
                row("gap of facing walls: chamber 1", 0.0, 4.0),
                row("spike: chamber 1, corner 1", 0.0, 5.0),
            ],
            settings: vec![
                LimitSetting {
                    name: "stretch",
                    value: 2.0,
                    unit: "",
                    rows: vec!["stretch: ".into(), "at 1.1 times the load, ".into()],
                    slope: Box::new(|row| -(row + 1.0) / 2.0),
                },
                LimitSetting {
                    name: "wall_gap_mm",
                    value: 0.2,
                    unit: "mm",
                    rows: vec!["gap of facing walls: ".into()],
                    slope: Box::new(|_| 0.5),
                },
            ],
            conditions: None,
            variables: 16,
        };
        let found: Vec<(&str, f64)> = limits
            .by_limit()
            .iter()
            .map(|l| (l.limit, l.per_unit))
            .collect();
        assert_eq!(found, [("stretch", -15.0 - 4.995), ("wall_gap_mm", 2.0)]);
        assert!(
            limits
                .limit_lines("mm")
                .is_some_and(|line| line.contains("wall_gap_mm (0.2): 2 mm per mm"))
        );
    }
}
