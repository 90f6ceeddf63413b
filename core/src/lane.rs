//! Four elements side by side: the kernels do the same arithmetic on four elements at a time.
//!
//! A [`Pack`] holds one number of four elements. The compiler turns its arithmetic into vector instructions where the
//! caller has them; fused multiply-add is a choice of the caller, because without the instruction it is a slow library
//! call.

#![expect(
    clippy::inline_always,
    reason = "compiled once per instruction set only where inlined into the caller that enables it"
)]

use std::ops::{Add, AddAssign, Mul, Neg, Sub};

/// Whether this processor has vector instructions with fused multiply-add that the kernels are compiled for.
pub fn has_fma() -> bool {
    #[cfg(target_arch = "x86_64")]
    {
        std::arch::is_x86_feature_detected!("avx2") && std::arch::is_x86_feature_detected!("fma")
    }
    #[cfg(not(target_arch = "x86_64"))]
    {
        cfg!(target_arch = "aarch64")
    }
}

/// Elements that are computed side by side.
pub const LANES: usize = 4;

/// One number of each of four elements.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[repr(align(32))]
pub struct Pack(pub [f64; LANES]);

impl Pack {
    /// Zero in all lanes.
    pub const ZERO: Self = Self([0.0; LANES]);

    /// The same number in all lanes.
    #[inline(always)]
    pub fn splat(v: f64) -> Self {
        Self([v; LANES])
    }

    /// `self * b + c`, fused if `FMA`.
    #[inline(always)]
    #[must_use]
    pub fn fma<const FMA: bool>(self, b: Self, c: Self) -> Self {
        if FMA {
            Self(std::array::from_fn(|i| self.0[i].mul_add(b.0[i], c.0[i])))
        } else {
            Self(std::array::from_fn(|i| self.0[i] * b.0[i] + c.0[i]))
        }
    }

    /// A function of each lane.
    #[inline(always)]
    #[must_use]
    pub fn map(self, f: impl Fn(f64) -> f64) -> Self {
        Self(std::array::from_fn(|i| f(self.0[i])))
    }

    /// 1 / self.
    #[inline(always)]
    #[must_use]
    pub fn recip(self) -> Self {
        Self(std::array::from_fn(|i| 1.0 / self.0[i]))
    }

    /// The smallest lane.
    #[inline(always)]
    pub fn min_lane(self) -> f64 {
        self.0[0].min(self.0[1]).min(self.0[2].min(self.0[3]))
    }
}

impl Add for Pack {
    type Output = Self;
    #[inline(always)]
    fn add(self, b: Self) -> Self {
        Self(std::array::from_fn(|i| self.0[i] + b.0[i]))
    }
}

impl AddAssign for Pack {
    #[inline(always)]
    fn add_assign(&mut self, b: Self) {
        *self = *self + b;
    }
}

impl Sub for Pack {
    type Output = Self;
    #[inline(always)]
    fn sub(self, b: Self) -> Self {
        Self(std::array::from_fn(|i| self.0[i] - b.0[i]))
    }
}

impl Mul for Pack {
    type Output = Self;
    #[inline(always)]
    fn mul(self, b: Self) -> Self {
        Self(std::array::from_fn(|i| self.0[i] * b.0[i]))
    }
}

impl Mul<f64> for Pack {
    type Output = Self;
    #[inline(always)]
    fn mul(self, b: f64) -> Self {
        Self(std::array::from_fn(|i| self.0[i] * b))
    }
}

impl Neg for Pack {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Self(std::array::from_fn(|i| -self.0[i]))
    }
}
