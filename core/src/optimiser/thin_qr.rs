//! A thin QR factorisation that grows by orthogonalisation and shrinks by plane rotations.

use super::vector::{add_scaled, dot, norm};

/// Thin QR factorisation of a set of vectors taken as columns.
#[derive(Default)]
pub(crate) struct ThinQr {
    /// Names of the columns, in their order.
    pub members: Vec<usize>,
    /// Orthonormal columns.
    q: Vec<Vec<f64>>,
    /// Columns of the upper triangle; column k has k + 1 entries.
    r: Vec<Vec<f64>>,
}

impl ThinQr {
    /// Appends a column; false, and nothing changed, if it depends on those already there.
    pub fn push(&mut self, row: usize, column: &[f64]) -> bool {
        let length = norm(column);
        let mut rest = column.to_vec();
        let mut coefficients = vec![0.0; self.q.len()];
        let mut before = length;
        for pass in 0..2 {
            for (q, coefficient) in self.q.iter().zip(&mut coefficients) {
                let share = dot(q, &rest);
                add_scaled(&mut rest, -share, q);
                *coefficient += share;
            }
            let after = norm(&rest);
            // "Twice is enough": a second pass only where the first one cancelled digits.
            if pass == 0 && after > 0.5 * before {
                break;
            }
            before = after;
        }
        let left = norm(&rest);
        if left <= 1e-9 * length || left == 0.0 {
            return false;
        }
        for value in &mut rest {
            *value /= left;
        }
        coefficients.push(left);
        self.members.push(row);
        self.q.push(rest);
        self.r.push(coefficients);
        true
    }

    /// Takes the column at a position out again.
    pub fn remove(&mut self, position: usize) {
        self.members.remove(position);
        self.r.remove(position);
        for k in position..self.r.len() {
            // Rotate rows k and k + 1 so that column k ends at its diagonal again.
            let (a, b) = (self.r[k][k], self.r[k][k + 1]);
            let length = a.hypot(b);
            let (c, s) = if length > 0.0 {
                (a / length, b / length)
            } else {
                (1.0, 0.0)
            };
            for column in &mut self.r[k..] {
                let (upper, lower) = (column[k], column[k + 1]);
                column[k] = c * upper + s * lower;
                column[k + 1] = c * lower - s * upper;
            }
            self.r[k].pop();
            let (head, tail) = self.q.split_at_mut(k + 1);
            for (upper, lower) in head[k].iter_mut().zip(&mut tail[0]) {
                let (u, l) = (*upper, *lower);
                *upper = c * u + s * l;
                *lower = c * l - s * u;
            }
        }
        self.q.pop();
    }

    /// Least-squares coefficients of the columns.
    pub fn solve(&self, target: &[f64]) -> Vec<f64> {
        let mut x: Vec<f64> = self.q.iter().map(|q| dot(q, target)).collect();
        for k in (0..x.len()).rev() {
            x[k] /= self.r[k][k];
            let value = x[k];
            for (entry, coefficient) in x[..k].iter_mut().zip(&self.r[k]) {
                *entry -= coefficient * value;
            }
        }
        x
    }

    /// Target minus its projection on the columns.
    pub fn residual(&self, target: &[f64]) -> Vec<f64> {
        let mut rest = target.to_vec();
        for q in &self.q {
            let share = dot(q, &rest);
            add_scaled(&mut rest, -share, q);
        }
        rest
    }

    /// The shortest x whose products with the columns are `products`.
    pub fn shortest(&self, products: &[f64], dimension: usize) -> Vec<f64> {
        let mut x = vec![0.0; dimension];
        let mut shares: Vec<f64> = Vec::with_capacity(products.len());
        for (k, (q, r)) in self.q.iter().zip(&self.r).enumerate() {
            let share = (products[k] - dot(&r[..k], &shares)) / r[k];
            shares.push(share);
            add_scaled(&mut x, share, q);
        }
        x
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_come_and_go_without_loss() {
        let columns: Vec<Vec<f64>> = (0..6_i32)
            .map(|k| {
                (0..8_i32)
                    .map(|i| f64::from((i * 7 + k * k * 3 + i * i * k) % 11) - 4.0)
                    .collect()
            })
            .collect();
        let target: Vec<f64> = (0..8_i32).map(|i| f64::from(i % 3) - 0.7).collect();
        let mut qr = ThinQr::default();
        for (k, column) in columns.iter().enumerate() {
            assert!(qr.push(k, column));
        }
        qr.remove(1);
        qr.remove(3);
        qr.remove(0);
        let mut fresh = ThinQr::default();
        for &k in &qr.members {
            assert!(fresh.push(k, &columns[k]));
        }
        for (one, other) in qr.solve(&target).iter().zip(fresh.solve(&target)) {
            assert!((one - other).abs() < 1e-12, "{one} {other}");
        }
        assert!(
            !qr.push(9, &columns[qr.members[0]]),
            "a column that is already there depends on itself"
        );
        let products: Vec<f64> = vec![1.0, -2.0, 0.5];
        let x = qr.shortest(&products, 8);
        for (&k, product) in qr.members.iter().zip(products) {
            assert!((dot(&columns[k], &x) - product).abs() < 1e-12);
        }
        assert!(
            norm(&qr.residual(&x)) < 1e-12,
            "the shortest solution lies in the span of the columns"
        );
    }
}
