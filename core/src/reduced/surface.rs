//! Values (a displacement, the strains of a unit) as functions of the two shares of the largest pressure: a polynomial in their square roots through the values
//! on a tensor grid of Lobatto's points.
//!
//! s_i = (1 - cos(pi i / (n - 1))) / 2 and p_i / p_max = s_i^2, i = 0..n-1, in each channel: dense at both ends and most towards zero
//! pressure, where thin walls go like p^(1/3). Evaluated by the barycentric formula: l_i(s) = (w_i / (s - s_i)) / sum_j (w_j / (s - s_j)),
//! w_i = (-1)^i, halved at the two ends. The points of n = 2 m - 1 hold those of m: a coarser surface costs nothing.

use std::f64::consts::PI;

/// Points of one channel, as square roots of the share of the largest pressure.
#[derive(Clone, Debug, PartialEq)]
pub struct Points(Vec<f64>);

impl Points {
    /// `count >= 2` points.
    pub fn new(count: usize) -> Self {
        let last = (count - 1) as f64;
        Self(
            (0..count)
                .map(|i| 0.5 * (1.0 - (PI * i as f64 / last).cos()))
                .collect(),
        )
    }

    /// Shares of the largest pressure, from 0 to 1.
    pub fn shares(&self) -> Vec<f64> {
        self.0.iter().map(|s| s * s).collect()
    }

    /// Values of the cardinal polynomials at a share in [0, 1].
    fn cardinals(&self, share: f64) -> Vec<f64> {
        let s = share.sqrt();
        if let Some(hit) = self.0.iter().position(|s_i| (s - s_i).abs() < 1e-14) {
            let mut cardinals = vec![0.0; self.0.len()];
            cardinals[hit] = 1.0;
            return cardinals;
        }
        let last = self.0.len() - 1;
        let term = |(i, s_i): (usize, &f64)| {
            let weight = if i == 0 || i == last { 0.5 } else { 1.0 };
            let sign = if i % 2 == 0 { 1.0 } else { -1.0 };
            sign * weight / (s - s_i)
        };
        let terms: Vec<f64> = self.0.iter().enumerate().map(term).collect();
        let sum: f64 = terms.iter().sum();
        terms.into_iter().map(|t| t / sum).collect()
    }
}

/// Displacements, or other values of `N` parts, over the pressure plane.
#[derive(Clone, Debug, PartialEq)]
pub struct Surface<const N: usize = 2> {
    points: Points,
    /// Values, the first channel running fastest.
    values: Vec<[f64; N]>,
}

impl<const N: usize> Surface<N> {
    /// Through `values` on the grid of `points`, the first channel running fastest; `None` where their number is not its square.
    pub fn new(points: Points, values: Vec<[f64; N]>) -> Option<Self> {
        (values.len() == points.0.len().pow(2)).then_some(Self { points, values })
    }

    /// Value at shares of the largest pressure in [0, 1].
    pub fn at(&self, [first, second]: [f64; 2]) -> [f64; N] {
        let (a, b) = (self.points.cardinals(first), self.points.cardinals(second));
        let mut sum = [0.0; N];
        for (row, b) in self.values.chunks_exact(a.len()).zip(b) {
            for (value, a) in row.iter().zip(&a) {
                for (sum, value) in sum.iter_mut().zip(value) {
                    *sum += a * b * value;
                }
            }
        }
        sum
    }

    /// Through every second point; `None` for an even number of points.
    pub fn coarser(&self) -> Option<Self> {
        let count = self.points.0.len();
        if count.is_multiple_of(2) {
            return None;
        }
        let values = (self.values.chunks_exact(count).step_by(2))
            .flat_map(|row| row.iter().step_by(2).copied())
            .collect();
        Self::new(Points::new(count.div_ceil(2)), values)
    }
}
