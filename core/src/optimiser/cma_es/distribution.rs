//! The normal distribution from which a generation is drawn, and what a generation teaches it: equations of Hansen's tutorial
//! (arXiv 1604.00772) by their numbers there.
//!
//! The covariance matrix C = B D^2 B' is held as its eigenvectors and eigenvalues. A deviate is y = B D z with z normal, so
//! that B' y = D z and C^(-1/2) y = B z are known without a solve, and an update is written in the basis B: a diagonal with
//! rank-one terms, which [`diagonalise`] turns into the next basis.

use serde::{Deserialize, Serialize};

use super::{eigen::diagonalise, strategy::Strategy};
use crate::optimiser::vector::{add_scaled, dot, norm};

/// Largest standard deviation along a coordinate: beyond the distance of the bounds a step says nothing more.
const WIDEST: f64 = 1.0;

/// Mean, step size, covariance and the two paths.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Distribution {
    pub mean: Vec<f64>,
    /// Step size.
    sigma: f64,
    /// Rows of B': eigenvectors of C.
    axes: Vec<Vec<f64>>,
    /// Diagonal of D: square roots of the eigenvalues of C.
    lengths: Vec<f64>,
    /// Path of the step size, p_sigma.
    path_sigma: Vec<f64>,
    /// Path of the covariance, p_c.
    path_c: Vec<f64>,
    generations: u32,
}

impl Distribution {
    /// Round, of standard deviation `sigma`.
    pub fn new(mean: Vec<f64>, sigma: f64) -> Self {
        let n = mean.len();
        Self {
            mean,
            sigma,
            axes: (0..n)
                .map(|i| (0..n).map(|j| f64::from(i == j)).collect())
                .collect(),
            lengths: vec![1.0; n],
            path_sigma: vec![0.0; n],
            path_c: vec![0.0; n],
            generations: 0,
        }
    }

    /// B times a vector.
    fn along_axes(&self, components: impl Iterator<Item = f64>) -> Vec<f64> {
        let mut sum = vec![0.0; self.mean.len()];
        for (axis, component) in self.axes.iter().zip(components) {
            add_scaled(&mut sum, component, axis);
        }
        sum
    }

    /// B D z.
    fn deviate(&self, z: &[f64]) -> Vec<f64> {
        self.along_axes(self.lengths.iter().zip(z).map(|(d, z)| d * z))
    }

    /// The point m + sigma B D z (38 to 40).
    pub fn point(&self, z: &[f64]) -> Vec<f64> {
        let mut point = self.mean.clone();
        add_scaled(&mut point, self.sigma, &self.deviate(z));
        point
    }

    /// Learns from a generation: its normal vectors in the order of its points, of which the first `usable` had values.
    pub fn update(&mut self, strategy: &Strategy, z: &[&[f64]], usable: usize) {
        let weights = strategy.weights(usable);
        let n = self.mean.len();
        // The weighted mean of the selected, in the basis B (41, 42).
        let mut selected = vec![0.0; n];
        for (z, weight) in z.iter().zip(&weights[..strategy.mu]) {
            add_scaled(&mut selected, *weight, z);
        }
        let step = self.deviate(&selected);
        add_scaled(&mut self.mean, self.sigma, &step);
        // Step size (43, 44).
        let Strategy {
            mu_eff,
            c_sigma,
            d_sigma,
            c_c,
            c_1,
            c_mu,
            chi,
            ..
        } = *strategy;
        let whitened = self.along_axes(selected.iter().copied());
        decay(&mut self.path_sigma, 1.0 - c_sigma);
        add_scaled(
            &mut self.path_sigma,
            (c_sigma * (2.0 - c_sigma) * mu_eff).sqrt(),
            &whitened,
        );
        let length = norm(&self.path_sigma);
        self.generations += 1;
        // Covariance (45 to 47).
        let settled = (1.0 - (1.0 - c_sigma).powi(2 * self.generations.min(10_000) as i32)).sqrt();
        let moves = length / settled < (1.4 + 2.0 / (n as f64 + 1.0)) * chi;
        decay(&mut self.path_c, 1.0 - c_c);
        if moves {
            add_scaled(&mut self.path_c, (c_c * (2.0 - c_c) * mu_eff).sqrt(), &step);
        }
        let missing = if moves { 0.0 } else { c_c * (2.0 - c_c) };
        let kept = 1.0 + c_1 * missing - c_1 - c_mu * weights.iter().sum::<f64>();
        let path: Vec<f64> = self.axes.iter().map(|a| dot(a, &self.path_c)).collect();
        let mut terms = vec![(c_1, path)];
        for (z, weight) in z.iter().zip(&weights) {
            let length = dot(z, z);
            let weight = if *weight < 0.0 && length > 0.0 {
                weight * n as f64 / length
            } else {
                *weight
            };
            let scaled = self.lengths.iter().zip(*z).map(|(d, z)| d * z).collect();
            terms.push((c_mu * weight, scaled));
        }
        let mut matrix = vec![vec![0.0; n]; n];
        for (i, row) in matrix.iter_mut().enumerate() {
            row[i] = kept * self.lengths[i] * self.lengths[i];
            for (factor, term) in &terms {
                add_scaled(row, factor * term[i], term);
            }
        }
        diagonalise(&mut matrix, &mut self.axes);
        for (i, length) in self.lengths.iter_mut().enumerate() {
            // Negative weights leave the matrix positive definite but for rounding.
            *length = matrix[i][i].max(f64::MIN_POSITIVE).sqrt();
        }
        self.sigma *= ((c_sigma / d_sigma) * (length / chi - 1.0)).min(1.0).exp();
        let widest = self.deviations().fold(0.0, f64::max);
        self.sigma *= (WIDEST / widest).min(1.0);
    }

    /// Half the step size, for a generation of which nothing could be evaluated.
    pub fn shrink(&mut self) {
        self.sigma *= 0.5;
    }

    /// Standard deviation along each coordinate.
    fn deviations(&self) -> impl Iterator<Item = f64> {
        (0..self.mean.len()).map(|i| {
            let variance = self.axes.iter().zip(&self.lengths);
            let variance: f64 = variance.map(|(axis, d)| (d * axis[i]).powi(2)).sum();
            self.sigma * variance.sqrt()
        })
    }

    /// The longest step that is likely: along a coordinate, or along the path.
    pub fn step(&self) -> f64 {
        let path = crate::optimiser::vector::largest(&self.path_c);
        self.deviations().fold(self.sigma * path, f64::max)
    }

    /// Condition number of the covariance matrix.
    pub fn condition(&self) -> f64 {
        let longest = self.lengths.iter().copied().fold(0.0, f64::max);
        let shortest = self.lengths.iter().copied().fold(f64::INFINITY, f64::min);
        (longest / shortest).powi(2)
    }
}

fn decay(path: &mut [f64], by: f64) {
    for value in path {
        *value *= by;
    }
}
