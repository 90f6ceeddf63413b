//! The quasi-Newton matrix of the Lagrangian, B, in scaled variables: damped BFGS.
//!
//! With a move s and a change y of the Lagrangian's gradient along it, Powell's (1978) damping takes r = theta y +
//! (1 - theta) B s with theta = 1 where s'y >= 0.2 s'Bs, else 0.8 s'Bs / (s'Bs - s'y), and
//! B+ = B - B s s'B / s'Bs + r r' / s'r, which stays positive definite whatever the Lagrangian's curvature.
//!
//! Where the curvature along s turns out lower than B said, the whole of B shrinks first, by s'y / s'Bs (Oren and Luenberger
//! 1974; never by more than to a fifth, and never grown, after Al-Baali 1998): the first matrix has the size of the steepest
//! curvature, and in the flat directions would be unlearnt one by one.

use serde::{Deserialize, Serialize};

use crate::optimiser::vector::{add_scaled, dot, norm};

/// B shrinks at most to this part of it in one update.
const LEAST_SHRINKAGE: f64 = 0.2;
/// Share of the present curvature that an update keeps at least.
const DAMPING: f64 = 0.2;
/// A pivot below this part of the largest diagonal entry is lifted to it.
const LEAST_PIVOT: f64 = 1e-10;

/// B, as the rows of its lower triangle.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(transparent)]
pub(super) struct Hessian {
    rows: Vec<Vec<f64>>,
}

impl Hessian {
    /// A multiple of the identity.
    pub fn multiple(n: usize, factor: f64) -> Self {
        let row = |i: usize| {
            let mut row = vec![0.0; i + 1];
            row[i] = factor;
            row
        };
        Self {
            rows: (0..n).map(row).collect(),
        }
    }

    /// B s.
    pub fn times(&self, s: &[f64]) -> Vec<f64> {
        let mut product = vec![0.0; s.len()];
        for (i, row) in self.rows.iter().enumerate() {
            product[i] += dot(row, &s[..=i]);
            add_scaled(&mut product[..i], s[i], &row[..i]);
        }
        product
    }

    /// Learns the change `y` of the Lagrangian's gradient along a move `s`.
    pub fn learn(&mut self, s: &[f64], y: &[f64]) {
        let bent = self.times(s);
        let curvature = dot(s, &bent);
        let product = dot(s, y);
        if !(curvature > 0.0 && curvature.is_finite() && product.is_finite()) {
            return;
        }
        let shrink = (product / curvature).clamp(LEAST_SHRINKAGE, 1.0);
        let curvature = shrink * curvature;
        let bent: Vec<f64> = bent.iter().map(|b| shrink * b).collect();
        for value in self.rows.iter_mut().flatten() {
            *value *= shrink;
        }
        let theta = if product >= DAMPING * curvature {
            1.0
        } else {
            (1.0 - DAMPING) * curvature / (curvature - product)
        };
        let r: Vec<f64> = y
            .iter()
            .zip(&bent)
            .map(|(y, bent)| theta * y + (1.0 - theta) * bent)
            .collect();
        let along = dot(s, &r);
        if !(along > 0.0 && norm(&r).is_finite()) {
            return;
        }
        for (i, row) in self.rows.iter_mut().enumerate() {
            add_scaled(row, -bent[i] / curvature, &bent[..=i]);
            add_scaled(row, r[i] / along, &r[..=i]);
        }
    }

    /// Its Cholesky factor.
    pub fn factor(&self) -> Factor {
        let largest = (0..self.rows.len())
            .map(|i| self.rows[i][i])
            .fold(f64::MIN_POSITIVE, f64::max);
        let mut rows = self.rows.clone();
        for i in 0..rows.len() {
            let (above, rest) = rows.split_at_mut(i);
            let row = &mut rest[0];
            for (j, pivot_row) in above.iter().enumerate() {
                row[j] = (row[j] - dot(&row[..j], &pivot_row[..j])) / pivot_row[j];
            }
            let pivot = row[i] - dot(&row[..i], &row[..i]);
            row[i] = pivot.max(LEAST_PIVOT * largest).sqrt();
        }
        Factor { rows }
    }
}

/// L with L L' = B.
pub(super) struct Factor {
    rows: Vec<Vec<f64>>,
}

impl Factor {
    /// L^-1 v.
    pub fn forward(&self, v: &[f64]) -> Vec<f64> {
        let mut x = v.to_vec();
        // Rows of constraints are often sparse: what comes before their first entry stays zero.
        let first = v.iter().position(|v| *v != 0.0).unwrap_or(v.len());
        for i in first..x.len() {
            let row = &self.rows[i];
            x[i] = (x[i] - dot(&row[first..i], &x[first..i])) / row[i];
        }
        x
    }

    /// L^-T v.
    pub fn backward(&self, v: &[f64]) -> Vec<f64> {
        let mut x = v.to_vec();
        for i in (0..x.len()).rev() {
            let row = &self.rows[i];
            x[i] /= row[i];
            let value = x[i];
            add_scaled(&mut x[..i], -value, &row[..i]);
        }
        x
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn example() -> Hessian {
        let mut hessian = Hessian::multiple(3, 2.0);
        hessian.learn(&[1.0, 0.5, 0.0], &[3.0, 1.0, 0.5]);
        hessian.learn(&[0.0, 1.0, -1.0], &[1.0, 4.0, -2.0]);
        hessian
    }

    #[test]
    fn the_last_move_meets_the_secant_condition() {
        for (found, expected) in example()
            .times(&[0.0, 1.0, -1.0])
            .iter()
            .zip([1.0, 4.0, -2.0])
        {
            assert!((found - expected).abs() < 1e-12, "{found} {expected}");
        }
    }

    #[test]
    fn negative_curvature_leaves_a_fifth_of_a_shrunk_matrix() {
        let mut hessian = example();
        let s = [1.0, -1.0, 2.0];
        let before = dot(&s, &hessian.times(&s));
        hessian.learn(&s, &[-3.0, 1.0, 0.0]);
        let after = dot(&s, &hessian.times(&s));
        assert!(
            (after - 0.04 * before).abs() < 1e-12 * before,
            "{after} {before}"
        );
    }

    #[test]
    fn the_factor_solves() {
        let (hessian, v) = (example(), [1.0, -2.0, 0.5]);
        let factor = hessian.factor();
        let x = factor.backward(&factor.forward(&v));
        for (found, expected) in hessian.times(&x).iter().zip(v) {
            assert!((found - expected).abs() < 1e-12, "{found} {expected}");
        }
    }
}
