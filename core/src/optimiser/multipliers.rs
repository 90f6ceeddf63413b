//! First-order conditions at a point: which constraints are active there and what they cost.
//!
//! With D the widths of the bounds, the multipliers lambda >= 0 of the active constraints and mu >= 0 of the active bounds
//! minimise |D (grad f + A' lambda + B' mu)|. They belong to the point, whichever method found it: an objective that is
//! smaller by lambda_i is to be had for each unit by which row i may be passed.

use super::contract::Values;
use super::nnls;
use super::problem::Problem;
use super::vector::norm;

/// A bound at or beyond this counts as none.
const NO_BOUND: f64 = 1e20;
/// A variable this close to a bound, as a part of their distance, is at it: methods of asymptotes end near their bounds, at 1e-8 to 1e-6,
/// not on them.
const AT_BOUND: f64 = 1e-5;

/// What holds at a point.
#[derive(Clone, Debug, PartialEq)]
pub struct Conditions {
    /// Active constraints with their multipliers: index, and d objective / d constraint with the sign reversed.
    pub active: Vec<(usize, f64)>,
    /// Variables at a bound.
    pub at_bounds: usize,
    /// |D grad L| / |D grad f|: 0 at a point that meets the conditions.
    pub residual: f64,
}

/// The conditions at a point where constraints within `active_from` of their bound, or beyond it, count as active; `None`
/// where its gradients are not known.
pub fn conditions(
    problem: &Problem,
    x: &[f64],
    values: &Values,
    active_from: f64,
) -> Option<Conditions> {
    let gradient = values.gradient.as_ref()?;
    let rows = values.constraint_gradients.as_ref()?;
    let n = problem.dimension();
    let width: Vec<f64> = problem
        .lower
        .iter()
        .zip(&problem.upper)
        .map(|(l, u)| {
            if *l > -NO_BOUND && *u < NO_BOUND && u > l {
                u - l
            } else {
                1.0
            }
        })
        .collect();
    let scaled = |row: &[f64], sign: f64| -> Vec<f64> {
        row.iter().zip(&width).map(|(v, w)| sign * v * w).collect()
    };
    // Columns of unit length, with what each belongs to and what its length was.
    let mut columns = Vec::new();
    let mut owners = Vec::new();
    let mut active = Vec::new();
    for (index, row) in rows.iter().enumerate() {
        let equality = index >= problem.inequalities;
        let value = *values.constraints.get(index)?;
        if !equality && value < -active_from {
            continue;
        }
        let signs: &[f64] = if equality { &[1.0, -1.0] } else { &[1.0] };
        for sign in signs {
            let column = scaled(row, *sign);
            let length = norm(&column);
            if length > 0.0 {
                columns.push(column.iter().map(|v| v / length).collect());
                owners.push((active.len(), sign / length));
            }
        }
        active.push((index, 0.0));
    }
    let mut at_bounds = 0;
    for k in 0..n {
        let near = AT_BOUND * width[k];
        let ends = [
            (-1.0, x[k] - problem.lower[k]),
            (1.0, problem.upper[k] - x[k]),
        ];
        let here: Vec<f64> = ends
            .into_iter()
            .filter(|(_, distance)| *distance <= near)
            .map(|(sign, _)| sign)
            .collect();
        at_bounds += usize::from(!here.is_empty());
        for sign in here {
            let mut column = vec![0.0; n];
            column[k] = sign;
            columns.push(column);
        }
    }
    let target = scaled(gradient, 1.0);
    let solution = nnls::solve(&columns, &target);
    for ((owner, factor), multiplier) in owners.iter().zip(&solution.multipliers) {
        active[*owner].1 += factor * multiplier;
    }
    Some(Conditions {
        active,
        at_bounds,
        residual: norm(&solution.residual) / norm(&target).max(f64::MIN_POSITIVE),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn multipliers_of_a_known_optimum() {
        // min x0^2 + x1^2 + 3 x2, x0 + x1 >= 2, x0 <= 5, x2 >= 0 (its bound): optimum (1, 1, 0), lambda 2.
        let problem = Problem {
            lower: vec![0.0, 0.0, 0.0],
            upper: vec![10.0, 4.0, 1.0],
            inequalities: 2,
            equalities: 0,
        };
        let x = [1.0, 1.0, 0.0];
        let values = Values {
            objective: 2.0,
            constraints: vec![0.0, -4.0],
            gradient: Some(vec![2.0, 2.0, 3.0]),
            constraint_gradients: Some(vec![vec![-1.0, -1.0, 0.0], vec![1.0, 0.0, 0.0]]),
        };
        let found = conditions(&problem, &x, &values, 0.01).unwrap();
        assert_eq!(found.at_bounds, 1);
        assert_eq!(found.active.len(), 1);
        assert!((found.active[0].1 - 2.0).abs() < 1e-12 && found.active[0].0 == 0);
        assert!(found.residual < 1e-12);
        // As methods end that stay inside their bounds.
        let inside = conditions(&problem, &[1.0, 1.0, 1e-7], &values, 0.01).unwrap();
        assert_eq!(inside.at_bounds, 1);
        assert!(inside.residual < 1e-12);
        // Away from the optimum the conditions do not hold, and say by how much.
        let away = Values {
            gradient: Some(vec![3.0, 2.0, 3.0]),
            ..values.clone()
        };
        assert!(conditions(&problem, &x, &away, 0.01).unwrap().residual > 0.05);
        let blind = Values {
            gradient: None,
            ..values
        };
        assert!(conditions(&problem, &x, &blind, 0.01).is_none());
    }

    #[test]
    fn an_equality_may_pull_either_way() {
        let problem = Problem {
            lower: vec![-9.0; 2],
            upper: vec![9.0; 2],
            inequalities: 0,
            equalities: 1,
        };
        let values = |sign: f64| Values {
            objective: 0.0,
            constraints: vec![0.0],
            gradient: Some(vec![1.0, 1.0]),
            constraint_gradients: Some(vec![vec![sign, sign]]),
        };
        for sign in [1.0, -1.0] {
            let found = conditions(&problem, &[0.0; 2], &values(sign), 0.01).unwrap();
            assert!((found.active[0].1 + sign).abs() < 1e-12, "{found:?}");
        }
    }
}
