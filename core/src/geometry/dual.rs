//! Forward derivatives with respect to the four corners that a place on a rounded edge depends on.

use std::ops::{Add, Div, Mul, Sub};

/// Number of derivatives: x and y of four corners.
pub(super) const VARIABLES: usize = 8;

/// A value with its gradient.
#[derive(Clone, Copy, Debug)]
pub(super) struct Dual {
    pub(super) value: f64,
    pub(super) slope: [f64; VARIABLES],
}

impl Dual {
    pub(super) fn constant(value: f64) -> Self {
        Self {
            value,
            slope: [0.0; VARIABLES],
        }
    }

    pub(super) fn variable(value: f64, index: usize) -> Self {
        let mut x = Self::constant(value);
        x.slope[index] = 1.0;
        x
    }

    /// f(self) with f's value and slope given.
    fn chain(self, value: f64, by_self: f64) -> Self {
        Self {
            value,
            slope: self.slope.map(|s| by_self * s),
        }
    }

    pub(super) fn scaled(self, factor: f64) -> Self {
        self.chain(factor * self.value, factor)
    }

    pub(super) fn sqrt(self) -> Self {
        let root = self.value.sqrt();
        self.chain(root, 0.5 / root)
    }

    pub(super) fn powi(self, n: i32) -> Self {
        self.chain(self.value.powi(n), f64::from(n) * self.value.powi(n - 1))
    }

    pub(super) fn sin(self) -> Self {
        self.chain(self.value.sin(), self.value.cos())
    }

    pub(super) fn cos(self) -> Self {
        self.chain(self.value.cos(), -self.value.sin())
    }

    pub(super) fn atan(self) -> Self {
        self.chain(self.value.atan(), 1.0 / (1.0 + self.value * self.value))
    }
}

impl Add for Dual {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        Self {
            value: self.value + other.value,
            slope: std::array::from_fn(|k| self.slope[k] + other.slope[k]),
        }
    }
}

impl Sub for Dual {
    type Output = Self;

    fn sub(self, other: Self) -> Self {
        self + other.scaled(-1.0)
    }
}

impl Mul for Dual {
    type Output = Self;

    #[expect(clippy::suspicious_arithmetic_impl, reason = "the product rule")]
    fn mul(self, other: Self) -> Self {
        Self {
            value: self.value * other.value,
            slope: std::array::from_fn(|k| {
                self.slope[k] * other.value + self.value * other.slope[k]
            }),
        }
    }
}

impl Div for Dual {
    type Output = Self;

    #[expect(clippy::suspicious_arithmetic_impl, reason = "the quotient rule")]
    fn div(self, other: Self) -> Self {
        let value = self.value / other.value;
        Self {
            value,
            slope: std::array::from_fn(|k| (self.slope[k] - value * other.slope[k]) / other.value),
        }
    }
}
