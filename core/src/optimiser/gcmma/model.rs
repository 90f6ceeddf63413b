//! The convex separable approximations of the objective and of all rows.
//!
//! With the step w from the iterate in units of the asymptotes' distance, and g the slopes in these units
//!
//! ```text
//! f~(w) = f + sum_j [p_j / (1 - w) + q_j / (1 + w) - (p_j + q_j)]
//! p = 1.001 g+ + 0.001 g- + rho,   q = 0.001 g+ + 1.001 g- + rho
//!       = f + sum_j [g_j a(w_j) + (1.002 |g_j| + 2 rho) b(w_j)],
//! a = w / (1 - w^2),   b = w^2 / (1 - w^2)
//! ```
//! (Svanberg 2007 with rho measured as in 2002; the last line is the first sorted by what is odd and what is even.) The
//! part of rho is the same function of w in every row, so the Jacobian is as sparse as the gradients plus a product of two
//! vectors.
//!
//! Rows are divided by their largest slope, the objective too and afresh in every iteration, so that rho and the elastic
//! cost mean the same for objectives and constraints of any size.

use super::asymptotes::Asymptotes;
use crate::optimiser::{
    point::Point,
    problem::Problem,
    rows::{self, Gradient},
    vector::largest,
};

/// Weight of |g| in b: Svanberg's 1.001 + 0.001.
const EVEN: f64 = 1.002;
/// A row's scale is at least this share of its violation, and at least this.
const VIOLATION_SHARE: f64 = 1e-3;
const LEAST_SCALE: f64 = 1e-12;

/// An objective or a row, in scaled form.
pub(super) struct Function {
    /// Value at the iterate, over the scale; the objective's is 0.
    pub value: f64,
    /// What value and slopes were divided by.
    pub scale: f64,
    /// Variables with a slope, and it.
    pub slopes: Vec<(usize, f64)>,
    /// One side of an equality: replaced by its tangent, since two opposed convex rows leave no room between them.
    pub linear: bool,
}

impl Function {
    /// A variable's part without rho, or its derivatives.
    pub fn part(&self, terms: &Terms, slope: f64, order: usize) -> f64 {
        if self.linear {
            slope * terms.w[order]
        } else {
            terms.part(slope, order)
        }
    }
}

/// The functions at an iterate: first the objective, then the rows.
pub(super) struct Model {
    pub functions: Vec<Function>,
    variables: usize,
    objective: f64,
}

/// w, a, b and their first two derivatives at a step.
#[derive(Clone, Copy, Default)]
pub(super) struct Terms {
    pub w: [f64; 3],
    pub a: [f64; 3],
    pub b: [f64; 3],
}

impl Terms {
    pub fn at(w: f64) -> Self {
        let square = w * w;
        let d = 1.0 - square;
        let (d2, d3) = (d * d, d * d * d);
        Self {
            w: [w, 1.0, 0.0],
            a: [w / d, (1.0 + square) / d2, w * (6.0 + 2.0 * square) / d3],
            b: [square / d, 2.0 * w / d2, (2.0 + 6.0 * square) / d3],
        }
    }

    /// The part of a slope without rho, or its derivatives.
    pub fn part(&self, slope: f64, order: usize) -> f64 {
        slope * self.a[order] + EVEN * slope.abs() * self.b[order]
    }

    /// What rho is multiplied by.
    pub fn rho(&self, order: usize) -> f64 {
        2.0 * self.b[order]
    }
}

impl Model {
    pub fn new(
        problem: &Problem,
        asymptotes: &Asymptotes,
        at: &Point,
        gradient: &Gradient,
    ) -> Self {
        let function = |value: f64, gradient: &[f64], least_scale: f64, linear: bool| {
            let slopes: Vec<(usize, f64)> = gradient
                .iter()
                .enumerate()
                .map(|(j, g)| (j, g * asymptotes.unit(j)))
                .filter(|(_, g)| *g != 0.0)
                .collect();
            let steepest = slopes
                .iter()
                .fold(0.0, |most: f64, (_, g)| most.max(g.abs()));
            let scale = steepest.max(least_scale);
            let scale = if scale > 0.0 { scale } else { 1.0 };
            Function {
                value: value / scale,
                scale,
                slopes: slopes.into_iter().map(|(j, g)| (j, g / scale)).collect(),
                linear,
            }
        };
        let mut functions = vec![function(0.0, &gradient.objective, 0.0, false)];
        for (row, &value) in rows::values(problem, &at.constraints).iter().enumerate() {
            let least_scale = (VIOLATION_SHARE * value).max(LEAST_SCALE);
            let gradient = rows::gradient(problem, gradient, row);
            let linear = row >= problem.inequalities;
            functions.push(function(value, &gradient, least_scale, linear));
        }
        Self {
            functions,
            variables: at.x.len(),
            objective: at.objective,
        }
    }

    /// Scaled values of the functions at an evaluated point.
    pub fn scaled(&self, problem: &Problem, point: &Point) -> Vec<f64> {
        let rows = rows::values(problem, &point.constraints);
        std::iter::once(point.objective - self.objective)
            .chain(rows)
            .zip(&self.functions)
            .map(|(value, function)| value / function.scale)
            .collect()
    }

    /// Approximations at a step without rho, and what rho is multiplied by there; none beyond an asymptote.
    pub fn at(&self, step: &[f64]) -> Option<(Vec<f64>, f64)> {
        if largest(step) >= 0.999 {
            return None;
        }
        let terms: Vec<Terms> = step.iter().map(|w| Terms::at(*w)).collect();
        let values = self
            .functions
            .iter()
            .map(|function| {
                let parts = function
                    .slopes
                    .iter()
                    .map(|&(j, g)| function.part(&terms[j], g, 0));
                function.value + parts.sum::<f64>()
            })
            .collect();
        Some((values, terms.iter().map(|t| t.rho(0)).sum()))
    }

    /// Mean slope of each function: the natural size of its rho.
    pub fn mean_slopes(&self) -> Vec<f64> {
        let n = self.variables as f64;
        let mean =
            |function: &Function| function.slopes.iter().map(|(_, g)| g.abs()).sum::<f64>() / n;
        self.functions.iter().map(mean).collect()
    }
}
