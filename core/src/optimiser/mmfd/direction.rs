//! The direction-finding problem.
//!
//! In scaled variables z = x / s, with rows a_j of active constraints and bounds normalised to unit length and
//! d = grad f / |grad f|:
//! - nothing active: the conjugate direction of Fletcher and Reeves;
//! - active, none violated: min d.S with a_j.S <= 0, |S| <= 1. Its solution is the projection of -d on the cone of
//!   feasible directions, S = -(d + A' lambda), lambda = argmin over lambda >= 0 of |d + A' lambda|;
//! - violated: min d.S - phi beta with a_j.S + theta_j beta <= 0, |(S, beta)| <= 1: the same problem with one more
//!   variable.
//!
//! Vanderplaats, Numerical Optimization Techniques for Engineering Design, chapter 6; the push-off
//! theta = (1 - g / CT)^2, at most 50, is CONMIN's (NASA TM X-62,282).

use serde::{Deserialize, Serialize};

use super::{boundary, metric::Metric};
use crate::optimiser::{
    nnls,
    problem::Problem,
    rows::{self, Gradient},
    vector::{dot, largest, norm},
};

/// A projected gradient shorter than this, the gradient's length being 1, is none.
pub(super) const KUHN_TUCKER: f64 = 1e-3;
/// A row shorter than this has no direction.
const NULL_ROW: f64 = 1e-12;
const MOST_PUSH_OFF: f64 = 50.0;

/// What a direction is found from.
pub(super) struct At<'a> {
    pub problem: &'a Problem,
    pub x: &'a [f64],
    /// Row values.
    pub g: &'a [f64],
    pub gradient: &'a Gradient,
    pub scale: &'a [f64],
    /// Steepest in this metric.
    pub metric: &'a Metric,
    /// Variables that must not move.
    pub frozen: &'a [usize],
    pub ct: f64,
    pub ctmin: f64,
    pub phi: f64,
    pub push_off: f64,
    /// Below this length of the scaled gradient the objective is stationary.
    pub stationary: f64,
}

/// A direction to search along.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Direction {
    /// dx / d alpha; in scaled variables the largest component is 1.
    pub step: Vec<f64>,
    /// df / d alpha.
    pub slope: f64,
    /// d row / d alpha, for every row.
    pub row_slopes: Vec<f64>,
    /// Rows that the direction is tangent to, each with its Lagrange multiplier (positive).
    pub tangent: Vec<(usize, f64)>,
    /// Variables pressed against an active bound.
    pub held: Vec<usize>,
    /// The step to the first bound that is not yet active.
    pub to_bound: Option<f64>,
    /// The step to the expected minimum, where the metric knows curvature.
    pub natural: Option<f64>,
}

/// Memory of the conjugate directions.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct Conjugacy {
    /// The last direction in scaled variables, before its normalisation; none after a restart.
    pub direction: Option<Vec<f64>>,
    /// Squared length of the gradient that it came from.
    pub squared_gradient: f64,
    /// Directions since the restart.
    pub count: usize,
}

pub(super) enum Found {
    Direction(Direction),
    /// First-order conditions hold to this residual.
    KuhnTucker {
        residual: f64,
        multipliers: Vec<f64>,
    },
    /// No direction leads towards the feasible region.
    None,
    /// First-order conditions hold with multipliers on rows that are not at their boundary: CT must shrink.
    NotComplementary,
}

/// A row of the subproblem.
struct Row {
    /// Constraint row, or none for a bound.
    source: Option<usize>,
    /// Variable of a bound.
    variable: usize,
    /// Length of the gradient before normalisation.
    length: f64,
    unit: Vec<f64>,
    theta: f64,
}

/// Finds the direction; `conjugacy` is what the last one left behind.
pub(super) fn find(at: &At<'_>, conjugacy: &mut Conjugacy) -> Found {
    let scaled = Metric::scaled(at.scale);
    let plain = active_rows(at, &scaled);
    if at.g.iter().any(|&g| g > at.ctmin) {
        *conjugacy = Conjugacy::default();
        let active = if at.metric.has_curvature() {
            active_rows(at, at.metric)
        } else {
            plain
        };
        return towards_feasible(at, active);
    }
    let projection = Projection::of(at, plain, &scaled);
    if let Some(found) = projection.first_order(at) {
        return found;
    }
    if at.metric.has_curvature() {
        *conjugacy = Conjugacy::default();
        let curved = Projection::of(at, active_rows(at, at.metric), at.metric);
        return Found::Direction(curved.direction(at));
    }
    if projection.active.is_empty() {
        let direction = conjugate(&projection.objective, projection.length, conjugacy);
        return Found::Direction(finish(at, &direction, projection.length, &[], &[]));
    }
    *conjugacy = Conjugacy::default();
    Found::Direction(projection.direction(at))
}

/// The projection of the steepest descent in a metric on the cone of feasible directions.
struct Projection {
    active: Vec<Row>,
    /// Gradient of the objective in the metric, and its length.
    objective: Vec<f64>,
    length: f64,
    /// For an objective's gradient of unit length.
    solution: nnls::Solution,
}

impl Projection {
    fn of(at: &At<'_>, active: Vec<Row>, metric: &Metric) -> Self {
        let objective = metric.pull(&at.gradient.objective);
        let length = norm(&objective);
        let unit: Vec<f64> = objective
            .iter()
            .map(|value| value / length.max(f64::MIN_POSITIVE))
            .collect();
        let matrix: Vec<Vec<f64>> = active.iter().map(|row| row.unit.clone()).collect();
        Self {
            solution: nnls::solve(&matrix, &unit),
            active,
            objective,
            length,
        }
    }

    /// Whether first-order conditions hold; to be asked in the scaled variables.
    fn first_order(&self, at: &At<'_>) -> Option<Found> {
        if self.length <= at.stationary {
            let multipliers = vec![0.0; at.problem.constraints()];
            return Some(Found::KuhnTucker {
                residual: 0.0,
                multipliers,
            });
        }
        let residual = norm(&self.solution.residual);
        if residual >= KUHN_TUCKER {
            return None;
        }
        let multipliers = &self.solution.multipliers;
        let off_boundary = self
            .active
            .iter()
            .zip(multipliers)
            .any(|(row, &multiplier)| {
                multiplier > 1e-9 && row.source.is_some_and(|source| at.g[source] < -at.ctmin)
            });
        if off_boundary {
            return Some(Found::NotComplementary);
        }
        let multipliers =
            told_multipliers(at.problem, &tangent(&self.active, multipliers, self.length));
        Some(Found::KuhnTucker {
            residual,
            multipliers,
        })
    }

    fn direction(&self, at: &At<'_>) -> Direction {
        let direction: Vec<f64> = self
            .solution
            .residual
            .iter()
            .map(|value| -value * self.length)
            .collect();
        finish(
            at,
            &direction,
            self.length,
            &self.active,
            &self.solution.multipliers,
        )
    }
}

/// The direction from outside the feasible region: usable and, for the violated rows, feasible.
fn towards_feasible(at: &At<'_>, mut active: Vec<Row>) -> Found {
    drop_opposed(&mut active);
    let objective = at.metric.pull(&at.gradient.objective);
    let length = norm(&objective);
    let mut p: Vec<f64> = objective
        .iter()
        .map(|value| value / length.max(f64::MIN_POSITIVE))
        .collect();
    p.push(-at.phi);
    let steepest = active.iter().map(|row| row.theta).fold(0.0, f64::max);
    let extended: Vec<Vec<f64>> = active
        .iter()
        .map(|row| {
            let mut entries = row.unit.clone();
            entries.push(row.theta / steepest.max(f64::MIN_POSITIVE));
            entries
        })
        .collect();
    let solution = nnls::solve(&extended, &p);
    let n = at.x.len();
    let direction: Vec<f64> = solution.residual[..n].iter().map(|value| -value).collect();
    let beta = -solution.residual[n];
    if steepest <= 0.0 || norm(&direction) <= 1e-9 * at.phi || beta <= 1e-9 * at.phi {
        return least_correction(at).map_or(Found::None, Found::Direction);
    }
    // Multipliers of this subproblem price the way back, not the objective: the search does not use them.
    let unpriced = vec![0.0; active.len()];
    Found::Direction(Direction {
        held: held(&active, &solution.multipliers),
        natural: None,
        ..finish(at, &direction, length, &active, &unpriced)
    })
}

/// Leaves out rows that a violated one opposes: of the two sides of an equality only the violated one counts, else no
/// direction would lead back.
fn drop_opposed(active: &mut Vec<Row>) {
    let violated: Vec<Vec<f64>> = active
        .iter()
        .filter(|row| row.theta > 0.0)
        .map(|row| row.unit.clone())
        .collect();
    active.retain(|row| {
        row.theta > 0.0
            || row.source.is_none()
            || violated.iter().all(|v| dot(v, &row.unit) > -0.999)
    });
}

/// The way of the least move that satisfies the violated rows to first order, where no direction keeps all others.
fn least_correction(at: &At<'_>) -> Option<Direction> {
    let back = boundary::back(&boundary::From {
        problem: at.problem,
        x: at.x,
        g: at.g,
        gradient: at.gradient,
        metric: at.metric,
        tangent: &[],
        held: at.frozen,
        ctmin: at.ctmin,
    })?;
    let mut step: Vec<f64> = back.iter().zip(at.x).map(|(to, from)| to - from).collect();
    let most = step
        .iter()
        .zip(at.scale)
        .map(|(dx, s)| (dx / s).abs())
        .fold(0.0, f64::max);
    if most <= 1e-12 {
        return None;
    }
    for dx in &mut step {
        *dx /= most;
    }
    let row_slopes: Vec<f64> = (0..rows::count(at.problem))
        .map(|row| dot(&rows::gradient(at.problem, at.gradient, row), &step))
        .collect();
    let helps =
        at.g.iter()
            .zip(&row_slopes)
            .any(|(&g, &slope)| g > at.ctmin && slope < 0.0);
    helps.then(|| Direction {
        slope: dot(&at.gradient.objective, &step),
        row_slopes,
        tangent: Vec::new(),
        held: Vec::new(),
        to_bound: to_bound(at, &step),
        natural: None,
        step,
    })
}

/// Active constraints and bounds, normalised in a metric.
fn active_rows(at: &At<'_>, metric: &Metric) -> Vec<Row> {
    let n = at.x.len();
    let mut active = Vec::new();
    for (source, &g) in at.g.iter().enumerate() {
        if g >= at.ct {
            let mut unit = metric.pull(&rows::gradient(at.problem, at.gradient, source));
            let length = norm(&unit);
            if length < NULL_ROW {
                tracing::debug!(
                    row = source,
                    "active constraint without a gradient is left out of the direction"
                );
                continue;
            }
            for value in &mut unit {
                *value /= length;
            }
            let theta = if g > at.ctmin {
                at.push_off * (1.0 - g / at.ct).powi(2).min(MOST_PUSH_OFF)
            } else {
                0.0
            };
            active.push(Row {
                source: Some(source),
                variable: 0,
                length,
                unit,
                theta,
            });
        }
    }
    for (variable, &x) in at.x.iter().enumerate() {
        let (lower, upper) = (at.problem.lower[variable], at.problem.upper[variable]);
        let frozen = at.frozen.contains(&variable);
        for (sign, distance, bound) in [(-1.0, x - lower, lower), (1.0, upper - x, upper)] {
            if frozen || distance <= 1e-6 * bound.abs().max(1.0) {
                let mut unit = vec![0.0; n];
                unit[variable] = sign;
                let mut unit = metric.pull(&unit);
                let length = norm(&unit);
                for value in &mut unit {
                    *value /= length;
                }
                active.push(Row {
                    source: None,
                    variable,
                    length,
                    unit,
                    theta: 0.0,
                });
            }
        }
    }
    active
}

/// Fletcher and Reeves; steepest descent after n + 1 directions or where it would not descend.
fn conjugate(objective: &[f64], length: f64, conjugacy: &mut Conjugacy) -> Vec<f64> {
    let mut direction: Vec<f64> = objective.iter().map(|value| -value).collect();
    let squared = length * length;
    let mut count = 1;
    if let Some(last) = conjugacy.direction.as_ref()
        && conjugacy.count <= objective.len()
        && conjugacy.squared_gradient > 0.0
    {
        let factor = squared / conjugacy.squared_gradient;
        let candidate: Vec<f64> = direction
            .iter()
            .zip(last)
            .map(|(d, l)| d + factor * l)
            .collect();
        if dot(&candidate, objective) < -1e-3 * norm(&candidate) * length {
            direction = candidate;
            count = conjugacy.count + 1;
        }
    }
    *conjugacy = Conjugacy {
        direction: Some(direction.clone()),
        squared_gradient: squared,
        count,
    };
    direction
}

/// Takes a direction to x, normalises it and works out what the search needs to know of it. `length` is that of the
/// objective's gradient in the metric.
fn finish(
    at: &At<'_>,
    direction: &[f64],
    length: f64,
    active: &[Row],
    multipliers: &[f64],
) -> Direction {
    let mut step = at.metric.push(direction);
    let scaled: Vec<f64> = step
        .iter()
        .zip(at.scale)
        .map(|(dx, scale)| dx / scale)
        .collect();
    let most = largest(&scaled).max(f64::MIN_POSITIVE);
    for dx in &mut step {
        *dx /= most;
    }
    let row_slopes = (0..rows::count(at.problem))
        .map(|row| dot(&rows::gradient(at.problem, at.gradient, row), &step))
        .collect();
    Direction {
        slope: dot(&at.gradient.objective, &step),
        row_slopes,
        tangent: tangent(active, multipliers, length),
        held: held(active, multipliers),
        to_bound: to_bound(at, &step),
        natural: at.metric.has_curvature().then_some(most),
        step,
    }
}

/// The step along a direction to the first bound ahead.
fn to_bound(at: &At<'_>, step: &[f64]) -> Option<f64> {
    let room = |i: usize| {
        if step[i] > 0.0 {
            at.problem.upper[i] - at.x[i]
        } else {
            at.x[i] - at.problem.lower[i]
        }
    };
    let far = |i: &usize| {
        let bound = if step[*i] > 0.0 {
            at.problem.upper[*i]
        } else {
            at.problem.lower[*i]
        };
        step[*i] != 0.0 && room(*i) > 1e-6 * bound.abs().max(1.0)
    };
    (0..step.len())
        .filter(far)
        .map(|i| room(i) / step[i].abs())
        .min_by(f64::total_cmp)
}

/// Constraint rows with a positive multiplier, in units of the objective per unit of the row.
fn tangent(active: &[Row], multipliers: &[f64], length: f64) -> Vec<(usize, f64)> {
    active
        .iter()
        .zip(multipliers)
        .filter(|&(_, &multiplier)| multiplier > 1e-9)
        .filter_map(|(row, &multiplier)| {
            row.source
                .map(|source| (source, multiplier * length / row.length))
        })
        .collect()
}

/// Variables of the bounds with a positive multiplier.
fn held(active: &[Row], multipliers: &[f64]) -> Vec<usize> {
    active
        .iter()
        .zip(multipliers)
        .filter(|(row, multiplier)| row.source.is_none() && **multiplier > 0.0)
        .map(|(row, _)| row.variable)
        .collect()
}

/// Multipliers of rows as multipliers of the constraints that were told.
pub(super) fn told_multipliers(problem: &Problem, tangent: &[(usize, f64)]) -> Vec<f64> {
    let mut multipliers = vec![0.0; problem.constraints()];
    for &(row, multiplier) in tangent {
        let (index, sign) = rows::constraint(problem, row);
        multipliers[index] += sign * multiplier;
    }
    multipliers
}
