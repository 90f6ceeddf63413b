//! The return to the boundary: the least move that brings rows back to zero, by the gradients at hand.
//!
//! A direction tangent to curved constraints leaves them to second order. As in the generalised reduced gradient
//! method, the trial is brought back by min |dz| with a_j.dz = -g_j; without it the method stops far from the optimum.

use super::rows::{self, Gradient};
use crate::optimiser::{
    problem::Problem,
    thin_qr::ThinQr,
    vector::{dot, norm},
};

/// What a return starts from.
pub(super) struct From<'a> {
    pub problem: &'a Problem,
    pub x: &'a [f64],
    /// Row values at `x`.
    pub g: &'a [f64],
    pub gradient: &'a Gradient,
    pub scale: &'a [f64],
    /// Rows to end at zero from either side.
    pub tangent: &'a [(usize, f64)],
    /// Variables to leave where they are.
    pub held: &'a [usize],
    pub ctmin: f64,
}

/// The point back on the boundary, as far as the gradients can tell; none if there is nothing to do.
pub(super) fn back(from: &From<'_>) -> Option<Vec<f64>> {
    let n = from.x.len();
    let mut free = vec![true; n];
    for &variable in from.held {
        free[variable] = false;
    }
    let mut wanted: Vec<usize> = from.tangent.iter().map(|&(row, _)| row).collect();
    wanted.extend((0..from.g.len()).filter(|row| from.g[*row] > 0.5 * from.ctmin));
    // Most out of place first: where rows depend on each other those decide.
    wanted.sort_by(|a, b| from.g[*b].total_cmp(&from.g[*a]).then(a.cmp(b)));
    wanted.dedup();
    let mut answer = None;
    // Each pass may find bounds that stop a variable, and rows that the move itself would violate.
    for _ in 0..6 {
        let mut columns = ThinQr::default();
        let mut products = Vec::new();
        for &row in &wanted {
            let mut a = rows::scaled_gradient(from.problem, from.gradient, from.scale, row);
            for (value, free) in a.iter_mut().zip(&free) {
                if !free {
                    *value = 0.0;
                }
            }
            let length = norm(&a);
            if length > 1e-12 {
                for value in &mut a {
                    *value /= length;
                }
                if columns.push(row, &a) {
                    products.push(-from.g[row] / length);
                }
            }
        }
        if products.is_empty() {
            break;
        }
        let move_z = columns.shortest(&products, n);
        let mut x: Vec<f64> = from
            .x
            .iter()
            .zip(move_z.iter().zip(from.scale))
            .map(|(x, (dz, s))| x + dz * s)
            .collect();
        let mut again = false;
        for i in 0..n {
            if free[i] && (x[i] < from.problem.lower[i] || x[i] > from.problem.upper[i]) {
                free[i] = false;
                again = true;
            }
        }
        for row in 0..from.g.len() {
            if !wanted.contains(&row) {
                let a = rows::scaled_gradient(from.problem, from.gradient, from.scale, row);
                if from.g[row] + dot(&a, &move_z) > from.ctmin {
                    wanted.push(row);
                    again = true;
                }
            }
        }
        from.problem.clip(&mut x);
        answer = Some(x).filter(|x| x.iter().all(|value| value.is_finite()) && x != from.x);
        if !again {
            break;
        }
    }
    answer
}
