//! The metric in which directions are found: x = J t, directions steepest in t.
//!
//! J = diag(s), the variable scales, is the method as published. With curvature, J J' is the inverse BFGS matrix of the
//! Lagrangian from the last moves, kept as a product of rank-one factors (Brodlie, Gourlay and Greenstadt 1973):
//! J+ = (I + d w') J, w = tau B d - y / d'y, tau = 1 / sqrt(d'y d'Bd), for a move d and a gradient change y.

use std::collections::VecDeque;

use serde::{Deserialize, Serialize};

use crate::optimiser::vector::{add_scaled, dot, norm};

/// Moves remembered.
const MOST_PAIRS: usize = 20;

/// Moves and the gradient changes that they brought.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(transparent)]
pub(super) struct Moves {
    pairs: VecDeque<(Vec<f64>, Vec<f64>)>,
}

impl Moves {
    /// Learns from a move; nothing where the curvature along it is not clearly positive.
    pub fn learn(&mut self, moved: Vec<f64>, change: Vec<f64>) {
        let product = dot(&moved, &change);
        if product > 1e-8 * norm(&moved) * norm(&change) && product > 0.0 {
            if self.pairs.len() == MOST_PAIRS.min(moved.len() + 2) {
                self.pairs.pop_front();
            }
            self.pairs.push_back((moved, change));
        }
    }

    /// The metric that these moves speak for.
    pub fn metric(&self, scale: &[f64]) -> Metric {
        let Some((_, newest)) = self.pairs.back() else {
            return Metric::scaled(scale);
        };
        let n = scale.len();
        let (moved, _) = &self.pairs[self.pairs.len() - 1];
        let scaled: Vec<f64> = newest.iter().zip(scale).map(|(y, s)| y * s).collect();
        let size = (dot(moved, newest) / dot(&scaled, &scaled)).sqrt();
        // Rows of J, and of its inverse.
        let diagonal = |value: &dyn Fn(usize) -> f64| -> Vec<Vec<f64>> {
            (0..n)
                .map(|i| {
                    let mut row = vec![0.0; n];
                    row[i] = value(i);
                    row
                })
                .collect()
        };
        let mut root = diagonal(&|i| size * scale[i]);
        let mut inverse = diagonal(&|i| 1.0 / (size * scale[i]));
        for (moved, change) in &self.pairs {
            let product = dot(moved, change);
            let t: Vec<f64> = inverse.iter().map(|row| dot(row, moved)).collect();
            let bent = dot(&t, &t);
            let tau = 1.0 / (product * bent).sqrt();
            // B d = J^-T J^-1 d
            let mut w = vec![0.0; n];
            for (row, t) in inverse.iter().zip(&t) {
                add_scaled(&mut w, tau * t, row);
            }
            add_scaled(&mut w, -1.0 / product, change);
            let mut pulled = vec![0.0; n];
            for (row, w) in root.iter().zip(&w) {
                add_scaled(&mut pulled, *w, row);
            }
            for (row, d) in root.iter_mut().zip(moved) {
                add_scaled(row, *d, &pulled);
            }
            let divisor = (bent / product).sqrt();
            for (row, t) in inverse.iter_mut().zip(&t) {
                add_scaled(row, -t / divisor, &w);
            }
        }
        Metric {
            scale: scale.to_vec(),
            root: Some(root),
        }
    }
}

/// J.
pub(super) struct Metric {
    scale: Vec<f64>,
    root: Option<Vec<Vec<f64>>>,
}

impl Metric {
    /// The variable scales alone.
    pub fn scaled(scale: &[f64]) -> Self {
        Self {
            scale: scale.to_vec(),
            root: None,
        }
    }

    /// What the moves speak for, or the variable scales.
    pub fn of(moves: Option<&Moves>, scale: &[f64]) -> Self {
        moves.map_or_else(|| Self::scaled(scale), |moves| moves.metric(scale))
    }

    /// A gradient with respect to t: J' g.
    pub fn pull(&self, gradient: &[f64]) -> Vec<f64> {
        match &self.root {
            None => gradient
                .iter()
                .zip(&self.scale)
                .map(|(g, s)| g * s)
                .collect(),
            Some(root) => {
                let mut pulled = vec![0.0; gradient.len()];
                for (row, g) in root.iter().zip(gradient) {
                    if *g != 0.0 {
                        add_scaled(&mut pulled, *g, row);
                    }
                }
                pulled
            }
        }
    }

    /// A move in x: J t.
    pub fn push(&self, t: &[f64]) -> Vec<f64> {
        match &self.root {
            None => t.iter().zip(&self.scale).map(|(t, s)| t * s).collect(),
            Some(root) => root.iter().map(|row| dot(row, t)).collect(),
        }
    }

    /// Whether lengths mean anything: a direction of its natural length is the step to the expected minimum.
    pub fn has_curvature(&self) -> bool {
        self.root.is_some()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_metric_is_the_inverse_of_bfgs() {
        // Moves on a quadratic: J J' must meet the newest secant condition and equal the recursion of BFGS.
        let hessian = [[4.0, 1.0, 0.0], [1.0, 3.0, 0.5], [0.0, 0.5, 2.0]];
        let scale = [1.0, 2.0, 0.5];
        let mut moves = Moves::default();
        let mut pairs = Vec::new();
        for moved in [
            vec![1.0, 0.2, -0.3],
            vec![-0.1, 0.9, 0.4],
            vec![0.3, 0.3, 1.0],
        ] {
            let change: Vec<f64> = hessian.iter().map(|row| dot(row, &moved)).collect();
            moves.learn(moved.clone(), change.clone());
            pairs.push((moved, change));
        }
        moves.learn(vec![1.0, 0.0, 0.0], vec![-1.0, 0.0, 0.0]);
        let metric = moves.metric(&scale);
        let product = |g: &[f64]| metric.push(&metric.pull(g));
        for (found, expected) in product(&pairs[2].1).iter().zip(&pairs[2].0) {
            assert!(
                (found - expected).abs() < 1e-12,
                "secant condition: {found} {expected}"
            );
        }
        let scaled: Vec<f64> = pairs[2].1.iter().zip(scale).map(|(y, s)| y * s).collect();
        let size = dot(&pairs[2].0, &pairs[2].1) / dot(&scaled, &scaled);
        let mut h = vec![vec![0.0; 3]; 3];
        for i in 0..3 {
            h[i][i] = size * scale[i] * scale[i];
        }
        for (d, y) in &pairs {
            let dy = dot(d, y);
            let hy: Vec<f64> = h.iter().map(|row| dot(row, y)).collect();
            let yhy = dot(y, &hy);
            for i in 0..3 {
                for j in 0..3 {
                    h[i][j] +=
                        (1.0 + yhy / dy) * d[i] * d[j] / dy - (hy[i] * d[j] + d[i] * hy[j]) / dy;
                }
            }
        }
        for j in 0..3 {
            let mut unit = vec![0.0; 3];
            unit[j] = 1.0;
            for (i, found) in product(&unit).iter().enumerate() {
                assert!(
                    (found - h[i][j]).abs() < 1e-12,
                    "({i}, {j}): {found} {}",
                    h[i][j]
                );
            }
        }
    }
}
