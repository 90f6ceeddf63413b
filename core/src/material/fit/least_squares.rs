//! Least squares: linear by singular values, nonlinear by Levenberg and Marquardt's method (Marquardt 1963, J. SIAM 11,
//! 431-441) with steps from the singular values of the equilibrated derivatives, so that normal equations are never formed.

use nalgebra::{DMatrix, DVector};

/// Share of the largest singular value below which a direction is left alone.
const CUT: f64 = 1e-14;
const ITERATIONS: usize = 300;
/// Damping, in shares of the largest singular value.
const FIRST_DAMPING: f64 = 1e-2;
const LARGEST_DAMPING: f64 = 1e12;
const LEAST_DAMPING: f64 = 1e-18;

/// Residuals as functions of parameters.
pub trait Problem {
    /// Residuals; `None` where the parameters are not admissible.
    fn residuals(&self, x: &[f64]) -> Option<Vec<f64>>;
    /// Their derivatives, a row a residual.
    fn jacobian(&self, x: &[f64]) -> DMatrix<f64>;
}

/// Where a minimisation ended.
pub struct Minimum {
    /// Parameters.
    pub x: Vec<f64>,
    /// Sum of squares.
    pub cost: f64,
}

/// R = U S V' of the triangle of an equilibrated matrix.
struct Factors {
    lengths: Vec<f64>,
    /// U' Q' b.
    right: DVector<f64>,
    singular: DVector<f64>,
    v: DMatrix<f64>,
}

impl Factors {
    fn new(matrix: &DMatrix<f64>, b: &DVector<f64>) -> Option<Self> {
        let mut scaled = matrix.clone();
        let lengths: Vec<f64> = matrix.column_iter().map(|c| c.norm()).collect();
        if lengths.iter().any(|l| !(l.is_finite() && *l > 0.0)) {
            return None;
        }
        for (mut column, length) in scaled.column_iter_mut().zip(&lengths) {
            column /= *length;
        }
        let qr = scaled.qr();
        let svd = qr.r().svd(true, true);
        let (u, v_t) = (svd.u?, svd.v_t?);
        let mut rotated = b.clone();
        qr.q_tr_mul(&mut rotated);
        let right = u.transpose() * rotated.rows(0, matrix.ncols());
        Some(Self {
            lengths,
            right,
            singular: svd.singular_values,
            v: v_t.transpose(),
        })
    }

    /// The minimiser of |A x - b|^2 + (damping * largest singular value)^2 |x scaled|^2.
    fn solve(&self, damping: f64) -> Vec<f64> {
        let largest = self.singular.max();
        let shift = (damping * largest).powi(2);
        let parts = self.right.zip_map(&self.singular, |b, s| {
            if s > CUT * largest {
                b * s / (s * s + shift)
            } else {
                0.0
            }
        });
        let x = &self.v * parts;
        x.iter().zip(&self.lengths).map(|(x, l)| x / l).collect()
    }
}

/// The minimiser of |A x - b|^2; `None` for a matrix with fewer rows than columns, a column of zeros or what is no number.
pub fn linear(matrix: &DMatrix<f64>, b: &DVector<f64>) -> Option<Vec<f64>> {
    if matrix.nrows() < matrix.ncols() {
        return None;
    }
    Factors::new(matrix, b).map(|f| f.solve(0.0))
}

/// Minimises the sum of squares from a start; where that is not admissible the cost is infinite.
pub fn minimise(problem: &impl Problem, start: Vec<f64>) -> Minimum {
    let sum = |r: &[f64]| r.iter().map(|r| r * r).sum::<f64>();
    let mut at = Minimum {
        x: start,
        cost: f64::INFINITY,
    };
    let Some(mut residuals) = problem.residuals(&at.x) else {
        return at;
    };
    at.cost = sum(&residuals);
    let mut damping = FIRST_DAMPING;
    for _ in 0..ITERATIONS {
        let right = DVector::from_iterator(residuals.len(), residuals.iter().map(|r| -r));
        let Some(factors) = Factors::new(&problem.jacobian(&at.x), &right) else {
            break;
        };
        let mut improved = false;
        while damping <= LARGEST_DAMPING {
            let step = factors.solve(damping);
            let x: Vec<f64> = at.x.iter().zip(&step).map(|(x, s)| x + s).collect();
            let trial = problem.residuals(&x).map(|r| (sum(&r), r));
            if let Some((cost, r)) = trial
                && cost < at.cost
            {
                (at, residuals) = (Minimum { x, cost }, r);
                damping = (0.1 * damping).max(LEAST_DAMPING);
                improved = true;
                break;
            }
            damping *= 4.0;
        }
        // No shorter step improves: the sum of squares is at its round-off.
        if !improved {
            break;
        }
    }
    at
}
