//! The linear system of a Newton step, reduced to the smaller of variables and rows.
//!
//! G = S + rho t', S as sparse as the gradients. Both reductions are a sparse product plus products of vectors:
//! G D G' = S D S' + rho (S D t)' + (S D t) rho' + (t' D t) rho rho', and G' E G likewise.

use crate::optimiser::vector::{add_scaled, dot};

/// Dx dw + G' dl = -dx, G dw - Dl dl = -dl.
pub(super) struct System<'a> {
    /// S: variables and entries of each row.
    pub jacobian: &'a [Vec<(usize, f64)>],
    pub rho: &'a [f64],
    /// t.
    pub even: &'a [f64],
    pub diagonal_x: &'a [f64],
    pub diagonal_l: &'a [f64],
    pub dx: &'a [f64],
    pub dl: &'a [f64],
}

/// Changes of the variables and of the multipliers.
pub(super) fn solve(system: &System<'_>) -> (Vec<f64>, Vec<f64>) {
    if system.dl.len() <= system.dx.len() {
        by_rows(system)
    } else {
        by_variables(system)
    }
}

impl System<'_> {
    /// G v.
    fn times(&self, v: &[f64]) -> Vec<f64> {
        let even = dot(self.even, v);
        self.jacobian
            .iter()
            .zip(self.rho)
            .map(|(row, rho)| row.iter().map(|&(j, s)| s * v[j]).sum::<f64>() + rho * even)
            .collect()
    }

    /// G' v.
    fn transposed_times(&self, v: &[f64]) -> Vec<f64> {
        let mut product: Vec<f64> = self.even.to_vec();
        let rho = dot(self.rho, v);
        for value in &mut product {
            *value *= rho;
        }
        for (row, v) in self.jacobian.iter().zip(v) {
            for &(j, s) in row {
                product[j] += v * s;
            }
        }
        product
    }
}

/// (Dl + G Dx^-1 G') dl = dl - G Dx^-1 dx.
fn by_rows(system: &System<'_>) -> (Vec<f64>, Vec<f64>) {
    let (n, m) = (system.dx.len(), system.dl.len());
    let inverse: Vec<f64> = system.diagonal_x.iter().map(|d| 1.0 / d).collect();
    let mut columns: Vec<Vec<(usize, f64)>> = vec![Vec::new(); n];
    let mut weighted_even = vec![0.0; m];
    for (i, row) in system.jacobian.iter().enumerate() {
        for &(j, s) in row {
            columns[j].push((i, s));
            weighted_even[i] += s * inverse[j] * system.even[j];
        }
    }
    let mut matrix = vec![vec![0.0; m]; m];
    for (column, inverse) in columns.iter().zip(&inverse) {
        for (count, &(i, s)) in column.iter().enumerate() {
            let weight = s * inverse;
            for &(k, other) in &column[..=count] {
                matrix[i][k] += weight * other;
            }
        }
    }
    let even: f64 = system
        .even
        .iter()
        .zip(&inverse)
        .map(|(t, d)| t * t * d)
        .sum();
    add_outer(
        &mut matrix,
        system.rho,
        &weighted_even,
        even,
        system.diagonal_l,
    );
    let scaled: Vec<f64> = system.dx.iter().zip(&inverse).map(|(d, i)| d * i).collect();
    let product = system.times(&scaled);
    let right = system.dl.iter().zip(product).map(|(d, p)| d - p).collect();
    let lambda = cholesky_solve(matrix, right);
    let w = system
        .transposed_times(&lambda)
        .iter()
        .zip(system.dx)
        .zip(&inverse)
        .map(|((g, d), inverse)| -(d + g) * inverse)
        .collect();
    (w, lambda)
}

/// (Dx + G' Dl^-1 G) dw = -dx - G' Dl^-1 dl.
fn by_variables(system: &System<'_>) -> (Vec<f64>, Vec<f64>) {
    let n = system.dx.len();
    let inverse: Vec<f64> = system.diagonal_l.iter().map(|d| 1.0 / d).collect();
    let mut matrix = vec![vec![0.0; n]; n];
    let mut weighted_rho = vec![0.0; n];
    for ((row, inverse), rho) in system.jacobian.iter().zip(&inverse).zip(system.rho) {
        for (count, &(j, s)) in row.iter().enumerate() {
            let weight = s * inverse;
            weighted_rho[j] += weight * rho;
            // Slopes are in the order of the variables.
            for &(k, other) in &row[..=count] {
                matrix[j][k] += weight * other;
            }
        }
    }
    let rho: f64 = system
        .rho
        .iter()
        .zip(&inverse)
        .map(|(r, d)| r * r * d)
        .sum();
    add_outer(
        &mut matrix,
        system.even,
        &weighted_rho,
        rho,
        system.diagonal_x,
    );
    let scaled: Vec<f64> = system.dl.iter().zip(&inverse).map(|(d, i)| d * i).collect();
    let right = system
        .transposed_times(&scaled)
        .iter()
        .zip(system.dx)
        .map(|(g, d)| -d - g)
        .collect();
    let w = cholesky_solve(matrix, right);
    let lambda = system
        .times(&w)
        .iter()
        .zip(system.dl)
        .zip(&inverse)
        .map(|((g, d), inverse)| (g + d) * inverse)
        .collect();
    (w, lambda)
}

/// Lower triangle += v u' + u v' + weight v v' + diag(diagonal).
fn add_outer(matrix: &mut [Vec<f64>], v: &[f64], u: &[f64], weight: f64, diagonal: &[f64]) {
    for (i, row) in matrix.iter_mut().enumerate() {
        add_scaled(&mut row[..=i], v[i], &u[..=i]);
        add_scaled(&mut row[..=i], u[i] + weight * v[i], &v[..=i]);
        row[i] += diagonal[i];
    }
}

/// Solves with the lower triangle of a positive definite matrix; a pivot that rounding has taken is made tiny.
fn cholesky_solve(mut matrix: Vec<Vec<f64>>, mut right: Vec<f64>) -> Vec<f64> {
    let n = right.len();
    for i in 0..n {
        let (done, rest) = matrix.split_at_mut(i);
        let row = &mut rest[0];
        let whole = row[i];
        for (j, other) in done.iter().enumerate() {
            row[j] = (row[j] - dot(&row[..j], &other[..j])) / other[j];
        }
        let pivot = row[i] - dot(&row[..i], &row[..i]);
        row[i] = pivot.max(1e-14 * whole).max(f64::MIN_POSITIVE).sqrt();
        right[i] = (right[i] - dot(&row[..i], &right[..i])) / row[i];
    }
    for i in (0..n).rev() {
        right[i] /= matrix[i][i];
        let value = right[i];
        add_scaled(&mut right[..i], -value, &matrix[i][..i]);
    }
    right
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn both_reductions_solve_the_same_system() {
        let wave = |k: usize| ((k * 7919 % 97) as f64 / 97.0) - 0.4;
        let (n, m) = (9, 6);
        let jacobian: Vec<Vec<(usize, f64)>> = (0..m)
            .map(|i| {
                (0..n)
                    .filter(|j| (i + j) % 3 != 0)
                    .map(|j| (j, wave(i * n + j)))
                    .collect()
            })
            .collect();
        let vector =
            |k: usize, count: usize| (0..count).map(|i| wave(31 * k + i)).collect::<Vec<f64>>();
        let positive = |k: usize, count: usize| {
            vector(k, count)
                .iter()
                .map(|v| 0.1 + v * v)
                .collect::<Vec<f64>>()
        };
        let (rho, even) = (positive(1, m), vector(2, n));
        let (diagonal_x, diagonal_l) = (positive(3, n), positive(4, m));
        let (dx, dl) = (vector(5, n), vector(6, m));
        let system = System {
            jacobian: &jacobian,
            rho: &rho,
            even: &even,
            diagonal_x: &diagonal_x,
            diagonal_l: &diagonal_l,
            dx: &dx,
            dl: &dl,
        };
        for (w, lambda) in [by_rows(&system), by_variables(&system)] {
            let up = system.transposed_times(&lambda);
            let across = system.times(&w);
            for j in 0..n {
                assert!((diagonal_x[j] * w[j] + up[j] + dx[j]).abs() < 1e-10);
            }
            for i in 0..m {
                assert!((across[i] - diagonal_l[i] * lambda[i] + dl[i]).abs() < 1e-10);
            }
        }
    }
}
