//! Weights and learning rates: table 1 of Hansen's tutorial, in its notation.

/// Constants of a strategy for `n` variables and `lambda` points a generation.
pub(super) struct Strategy {
    /// Weights of the points in their order; the last ones are negative.
    pub weights: Vec<f64>,
    /// Points with a positive weight.
    pub mu: usize,
    /// Variance-effective number of them.
    pub mu_eff: f64,
    /// Decay of the step size's path, and its damping.
    pub c_sigma: f64,
    pub d_sigma: f64,
    /// Decay of the covariance's path; learning rates of the rank-one and the rank-mu update.
    pub c_c: f64,
    pub c_1: f64,
    pub c_mu: f64,
    /// Expected length of a normal vector.
    pub chi: f64,
}

/// Points of a generation unless told otherwise.
pub(super) fn population(n: usize) -> usize {
    4 + (3.0 * (n as f64).ln()) as usize
}

impl Strategy {
    pub fn new(n: usize, lambda: usize) -> Self {
        let raw: Vec<f64> = (1..=lambda)
            .map(|i| (0.5 * (lambda as f64 + 1.0)).ln() - (i as f64).ln())
            .collect();
        let mu = lambda / 2;
        let effective = |w: &[f64]| {
            let sum: f64 = w.iter().sum();
            sum * sum / w.iter().map(|w| w * w).sum::<f64>()
        };
        let (mu_eff, mu_eff_negative) = (effective(&raw[..mu]), effective(&raw[mu..]));
        let n = n as f64;
        let c_sigma = (mu_eff + 2.0) / (n + mu_eff + 5.0);
        let c_1 = 2.0 / ((n + 1.3).powi(2) + mu_eff);
        let c_mu = (2.0 * (0.25 + mu_eff + 1.0 / mu_eff - 2.0) / ((n + 2.0).powi(2) + mu_eff))
            .min(1.0 - c_1);
        let of_mu = 1.0 + c_1 / c_mu;
        let of_mu_eff = 1.0 + 2.0 * mu_eff_negative / (mu_eff + 2.0);
        let of_definiteness = (1.0 - c_1 - c_mu) / (n * c_mu);
        let positive: f64 = raw.iter().filter(|w| **w > 0.0).sum();
        let negative: f64 = raw.iter().filter(|w| **w < 0.0).map(|w| w.abs()).sum();
        let of_negative = of_mu.min(of_mu_eff).min(of_definiteness) / negative;
        let weight = |w: &f64| {
            w * if *w > 0.0 {
                1.0 / positive
            } else {
                of_negative
            }
        };
        Self {
            weights: raw.iter().map(weight).collect(),
            mu,
            mu_eff,
            c_sigma,
            d_sigma: 1.0 + 2.0 * (((mu_eff - 1.0) / (n + 1.0)).sqrt() - 1.0).max(0.0) + c_sigma,
            c_c: (4.0 + mu_eff / n) / (n + 4.0 + 2.0 * mu_eff / n),
            c_1,
            c_mu,
            chi: n.sqrt() * (1.0 - 0.25 / n + 1.0 / (21.0 * n * n)),
        }
    }

    /// Weights of a generation of which only the first `usable` points taught anything: those without values attract
    /// nothing, but may repel.
    pub fn weights(&self, usable: usize) -> Vec<f64> {
        let mut weights = self.weights.clone();
        if usable < self.mu {
            let sum: f64 = weights[..usable].iter().sum();
            for (i, weight) in weights[..self.mu].iter_mut().enumerate() {
                *weight = if i < usable { *weight / sum } else { 0.0 };
            }
        }
        weights
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_constants_are_those_of_the_tutorial() {
        // 10 variables, 10 points: values of the reference implementation, pycma 4.5.0.
        let strategy = Strategy::new(10, population(10));
        assert_eq!((strategy.weights.len(), strategy.mu), (10, 5));
        let sum: f64 = strategy.weights[..5].iter().sum();
        assert!((sum - 1.0).abs() < 1e-14);
        assert!(
            (strategy.mu_eff - 3.167_299).abs() < 1e-6,
            "{}",
            strategy.mu_eff
        );
        assert!((strategy.weights[0] - 0.456_27).abs() < 1e-5);
        assert!(strategy.weights[5..].iter().all(|w| *w < 0.0));
        // The update must leave the matrix positive definite.
        let negative: f64 = strategy.weights[5..].iter().sum();
        let left = 1.0 - strategy.c_1 - strategy.c_mu + 10.0 * strategy.c_mu * negative;
        assert!(left > -1e-14, "{left}");
    }

    #[test]
    fn points_without_values_attract_nothing() {
        let strategy = Strategy::new(10, 10);
        let weights = strategy.weights(2);
        assert!((weights[0] + weights[1] - 1.0).abs() < 1e-14);
        assert_eq!(weights[2..5], [0.0; 3]);
        assert_eq!(weights[5..], strategy.weights[5..]);
    }
}
