//! Cholesky factorisation of a symmetric matrix in envelope storage, for the few hundred unknowns of a block map.

/// The lower triangle of a symmetric matrix; row i holds the columns `first[i]..=i`.
#[derive(Clone, Debug)]
pub(super) struct Envelope {
    first: Vec<usize>,
    start: Vec<usize>,
    values: Vec<f64>,
}

impl Envelope {
    /// A zero matrix whose row i reaches back to column `first[i] <= i`.
    pub(super) fn new(first: Vec<usize>) -> Self {
        let mut start = Vec::with_capacity(first.len() + 1);
        let mut total = 0;
        for (i, f) in first.iter().enumerate() {
            start.push(total);
            total += i - f + 1;
        }
        start.push(total);
        Self {
            first,
            start,
            values: vec![0.0; total],
        }
    }

    /// Number of rows.
    pub(super) fn len(&self) -> usize {
        self.first.len()
    }

    /// Adds to entry (i, j), j <= i, inside the envelope.
    pub(super) fn add(&mut self, i: usize, j: usize, value: f64) {
        self.values[self.start[i] + j - self.first[i]] += value;
    }

    /// Adds to the diagonal.
    pub(super) fn shift(&mut self, value: f64) {
        for i in 0..self.len() {
            self.values[self.start[i + 1] - 1] += value;
        }
    }

    /// Largest diagonal entry.
    pub(super) fn largest_diagonal(&self) -> f64 {
        (0..self.len())
            .map(|i| self.values[self.start[i + 1] - 1])
            .fold(0.0, f64::max)
    }

    /// Replaces the matrix A by L with A = L L^T; `false` if a pivot is not positive.
    pub(super) fn factorise(&mut self) -> bool {
        for i in 0..self.len() {
            let (fi, si) = (self.first[i], self.start[i]);
            let (done, rest) = self.values.split_at_mut(si);
            let row = &mut rest[..=i - fi];
            for j in fi..i {
                let (fj, sj) = (self.first[j], self.start[j]);
                let from = fi.max(fj);
                let lj = &done[sj + from - fj..sj + j - fj];
                let dot: f64 = row[from - fi..j - fi]
                    .iter()
                    .zip(lj)
                    .map(|(a, b)| a * b)
                    .sum();
                row[j - fi] = (row[j - fi] - dot) / done[sj + j - fj];
            }
            let original = row[i - fi];
            let dot: f64 = row[..i - fi].iter().map(|a| a * a).sum();
            let pivot = original - dot;
            if pivot.is_nan() || pivot <= 1e-14 * original.abs() {
                return false;
            }
            row[i - fi] = pivot.sqrt();
        }
        true
    }

    /// Solves L L^T x = b in place.
    pub(super) fn solve(&self, b: &mut [f64]) {
        for i in 0..self.len() {
            let (fi, si) = (self.first[i], self.start[i]);
            let row = &self.values[si..=si + i - fi];
            let dot: f64 = row[..i - fi]
                .iter()
                .zip(&b[fi..i])
                .map(|(a, b)| a * b)
                .sum();
            b[i] = (b[i] - dot) / row[i - fi];
        }
        for i in (0..self.len()).rev() {
            let (fi, si) = (self.first[i], self.start[i]);
            let row = &self.values[si..=si + i - fi];
            b[i] /= row[i - fi];
            let x = b[i];
            for (bj, l) in b[fi..i].iter_mut().zip(row) {
                *bj -= l * x;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn solves_a_small_system_and_refuses_an_indefinite_one() {
        let mut a = Envelope::new(vec![0, 0, 0]);
        for (i, j, v) in [
            (0, 0, 4.0),
            (1, 0, 1.0),
            (1, 1, 3.0),
            (2, 0, 0.5),
            (2, 2, 2.0),
        ] {
            a.add(i, j, v);
        }
        let mut b = vec![5.5, 4.0, 2.5];
        let mut bad = a.clone();
        assert!(a.factorise());
        a.solve(&mut b);
        for x in b {
            assert!((x - 1.0).abs() < 1e-14);
        }
        bad.shift(-3.5);
        assert!(!bad.factorise());
    }
}
