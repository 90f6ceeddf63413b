//! The return to the boundary: the least move that brings rows back to zero, by the gradients at hand.
//!
//! A direction tangent to curved constraints leaves them to second order. As in the generalised reduced gradient
//! method, the trial is brought back by min |dz| with a_j.dz = -g_j; without it the method stops far from the optimum.

use super::metric::Metric;
use crate::optimiser::{
    problem::Problem,
    rows::{self, Gradient},
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
    pub metric: &'a Metric,
    /// Rows to end at zero from either side.
    pub tangent: &'a [(usize, f64)],
    /// Variables to leave where they are.
    pub held: &'a [usize],
    pub ctmin: f64,
}

/// The point back on the boundary, as far as the gradients can tell; none if there is nothing to do.
pub(super) fn back(from: &From<'_>) -> Option<Vec<f64>> {
    let n = from.x.len();
    // Variables that stop at a value, and by how much that moves them.
    let mut stopped: Vec<(usize, f64)> =
        from.held.iter().map(|&variable| (variable, 0.0)).collect();
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
        let mut ask = |gradient: &[f64], product: f64| {
            let mut a = from.metric.pull(gradient);
            let length = norm(&a);
            if length > 1e-12 {
                for value in &mut a {
                    *value /= length;
                }
                if columns.push(products.len(), &a) {
                    products.push(product / length);
                }
            }
        };
        for &(variable, product) in &stopped {
            let mut unit = vec![0.0; n];
            unit[variable] = 1.0;
            ask(&unit, product);
        }
        for &row in &wanted {
            ask(
                &rows::gradient(from.problem, from.gradient, row),
                -from.g[row],
            );
        }
        if products.len() <= stopped.len() {
            break;
        }
        let step = from.metric.push(&columns.shortest(&products, n));
        let mut x: Vec<f64> = from.x.iter().zip(&step).map(|(x, dx)| x + dx).collect();
        let mut again = false;
        for i in 0..n {
            let within = x[i].max(from.problem.lower[i]).min(from.problem.upper[i]);
            if within != x[i] && stopped.iter().all(|&(variable, _)| variable != i) {
                stopped.push((i, within - from.x[i]));
                again = true;
            }
        }
        for row in 0..from.g.len() {
            if !wanted.contains(&row)
                && from.g[row] + dot(&rows::gradient(from.problem, from.gradient, row), &step)
                    > from.ctmin
            {
                wanted.push(row);
                again = true;
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
