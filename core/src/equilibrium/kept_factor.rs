//! When the factor of an earlier tangent is used again for a Newton step.
//!
//! A step with the tangent of a state a small way off (the chord method) needs a residual and two triangular solves instead
//! of an assembled and factorised tangent: about a fifth of the work. With displacements and independent pressures as the
//! unknowns, for both of which the tangent is held (`System::freeze`), its error falls by a factor that is proportional to
//! the way, whatever the ratio of bulk to shear modulus. The factor is first kept by hope, then by what is observed.

/// Contraction per size of the way at first: that of most states. Where walls or corners are soft it may be a hundred times
/// larger, which the first kept step shows.
const FIRST_RATE: f64 = 0.5;
/// Slowest contraction of a kept step that is taken.
const SLOWEST: f64 = 0.3;
/// Steps to the tolerance with a kept factor that cost less than a Newton step and what follows it.
const MOST_STEPS: f64 = 5.0;

/// The factor of a positive definite tangent at a load, and what is known of its use.
pub(super) struct KeptFactor {
    at: Vec<[f64; 2]>,
    again: bool,
    distance: f64,
    rate: f64,
}

impl KeptFactor {
    pub fn none() -> Self {
        Self {
            at: Vec::new(),
            again: false,
            distance: f64::INFINITY,
            rate: FIRST_RATE,
        }
    }

    /// The displacements of its tangent, where it is to be used for the next step.
    pub fn at(&self) -> Option<&[[f64; 2]]> {
        self.again.then_some(self.at.as_slice())
    }

    /// Size of the way from there to the present state; infinite where there is no factor.
    pub fn distance(&self) -> f64 {
        self.distance
    }

    /// A new factor at displacements `u`, whose first step has a size.
    pub fn renew(&mut self, u: &[[f64; 2]], size: f64) {
        self.distance = 0.0;
        self.again = size * self.rate <= SLOWEST;
        self.at.clear();
        self.at.extend_from_slice(u);
    }

    /// The factor is of no use beyond its own step.
    pub fn forget(&mut self) {
        self.distance = f64::INFINITY;
        self.again = false;
        self.at.clear();
    }

    /// The displacements of the factor's tangent; empty where there is none.
    pub fn into_place(self) -> Vec<[f64; 2]> {
        self.at
    }

    /// Whether a step with the kept factor is to be taken: its size over the last one's is `ratio`, and the logarithm of the
    /// residual has `fall` (negative) to go. Decides as well whether the factor is to be kept beyond this step.
    pub fn serves(&mut self, ratio: f64, fall: f64) -> bool {
        if ratio.is_nan() || ratio > SLOWEST {
            self.again = false;
        }
        self.rate = self.rate.max(ratio / self.distance);
        let taken = self.again;
        self.again &= fall >= MOST_STEPS * ratio.ln();
        taken
    }

    /// The state moved by a step of a size.
    pub fn moved(&mut self, size: f64) {
        self.distance += size;
    }
}
