//! The symmetric eigenproblem by cyclic Jacobi rotations (Jacobi 1846; Golub and Van Loan, section 8.5).
//!
//! The matrix comes in the basis of its last eigenvectors, where a generation has changed it by little: two or three sweeps
//! serve, each entry in a fixed order, so that the same matrix gives the same bits. Small eigenvalues keep their relative
//! accuracy, which is what a condition number of 1e14 asks for.

/// Entries below this share of their diagonal entries' geometric mean count as none.
const NONE: f64 = 1e-12;
/// Sweeps at most; a matrix needs fewer than ten even from scratch.
const SWEEPS: usize = 30;

/// Rotates a symmetric matrix to its diagonal, and the rows of `basis` with it: where the rows were the basis in which the
/// matrix is written, they become its eigenvectors. Eigenvalues are left on the diagonal, in no order.
pub(super) fn diagonalise(matrix: &mut [Vec<f64>], basis: &mut [Vec<f64>]) {
    let n = matrix.len();
    for _ in 0..SWEEPS {
        let mut rotated = false;
        for p in 0..n {
            for q in p + 1..n {
                let (pp, qq, pq) = (matrix[p][p], matrix[q][q], matrix[p][q]);
                if pq.abs() <= NONE * (pp * qq).abs().sqrt() {
                    continue;
                }
                rotated = true;
                // The smaller root of t^2 + 2 theta t - 1 = 0 keeps the angle within 45 degrees.
                let theta = (qq - pp) / (2.0 * pq);
                let t = theta.signum() / (theta.abs() + (theta * theta + 1.0).sqrt());
                let c = 1.0 / (t * t + 1.0).sqrt();
                let s = t * c;
                rotate(matrix, p, q, c, s);
                rotate(basis, p, q, c, s);
                matrix[p][p] = pp - t * pq;
                matrix[q][q] = qq + t * pq;
                matrix[p][q] = 0.0;
                matrix[q][p] = 0.0;
                for k in (0..n).filter(|k| *k != p && *k != q) {
                    matrix[k][p] = matrix[p][k];
                    matrix[k][q] = matrix[q][k];
                }
            }
        }
        if !rotated {
            return;
        }
    }
}

/// Rows p and q become c p - s q and s p + c q.
fn rotate(rows: &mut [Vec<f64>], p: usize, q: usize, c: f64, s: f64) {
    let (head, tail) = rows.split_at_mut(q);
    for (a, b) in head[p].iter_mut().zip(&mut tail[0]) {
        (*a, *b) = (c * *a - s * *b, s * *a + c * *b);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::optimiser::vector::dot;
    use crate::random::SplitMix64;

    fn identity(n: usize) -> Vec<Vec<f64>> {
        (0..n)
            .map(|i| (0..n).map(|j| f64::from(i == j)).collect())
            .collect()
    }

    #[test]
    fn eigenvalues_of_a_known_matrix() {
        // Second differences: 2 - 2 cos(k pi / (n + 1)).
        let n = 12;
        let mut matrix = vec![vec![0.0; n]; n];
        for i in 0..n {
            matrix[i][i] = 2.0;
            if i + 1 < n {
                matrix[i][i + 1] = -1.0;
                matrix[i + 1][i] = -1.0;
            }
        }
        diagonalise(&mut matrix, &mut identity(n));
        let mut found: Vec<f64> = (0..n).map(|i| matrix[i][i]).collect();
        found.sort_by(f64::total_cmp);
        for (k, found) in found.iter().enumerate() {
            let angle = (k + 1) as f64 * std::f64::consts::PI / (n + 1) as f64;
            assert!((found - (2.0 - 2.0 * angle.cos())).abs() < 1e-13);
        }
    }

    #[test]
    fn vectors_are_orthonormal_and_give_the_matrix_back() {
        let n = 30;
        let mut stream = SplitMix64::new(5);
        let rows: Vec<Vec<f64>> = (0..n)
            .map(|i| {
                let scale = 10_f64.powf(-0.1 * i as f64);
                (0..n).map(|_| scale * stream.next_normal()).collect()
            })
            .collect();
        let original: Vec<Vec<f64>> = (0..n)
            .map(|i| (0..n).map(|j| dot(&rows[i], &rows[j])).collect())
            .collect();
        let (mut matrix, mut basis) = (original.clone(), identity(n));
        diagonalise(&mut matrix, &mut basis);
        for i in 0..n {
            for j in 0..n {
                let product = dot(&basis[i], &basis[j]) - f64::from(i == j);
                let back: f64 = (0..n)
                    .map(|k| matrix[k][k] * basis[k][i] * basis[k][j])
                    .sum();
                assert!(product.abs() < 1e-13, "{product:e}");
                assert!((back - original[i][j]).abs() < 1e-11 * original[0][0]);
            }
        }
    }
}
