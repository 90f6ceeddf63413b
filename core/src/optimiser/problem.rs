//! The shape of a problem: bounds and counts of constraints.

use serde::{Deserialize, Serialize};
use thiserror::Error;

use super::contract::{Told, Values};

/// Points tried near a start that cannot be evaluated, as fractions of the way to the middle of the bounds.
pub(crate) const NUDGES: [f64; 5] = [0.0, 0.01, 0.1, 0.3, 1.0];

/// Minimise f(x) with lower <= x <= upper, g(x) <= 0 (`inequalities` of them) and h(x) = 0 (`equalities`).
///
/// Bounds are finite so that a state survives JSON; a bound beyond 1e20 counts as none.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Problem {
    /// Lower bounds.
    pub lower: Vec<f64>,
    /// Upper bounds.
    pub upper: Vec<f64>,
    /// Number of constraints g <= 0, first in [`Values::constraints`].
    pub inequalities: usize,
    /// Number of constraints h = 0, after the inequalities.
    pub equalities: usize,
}

/// Why a problem cannot be started.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum StartError {
    /// No variables.
    #[error("start a problem without variables")]
    NoVariables,
    /// Lengths disagree.
    #[error("start with {found} entries in {what}, expected {expected}")]
    Length {
        /// Which list.
        what: &'static str,
        /// Number of variables.
        expected: usize,
        /// Entries found.
        found: usize,
    },
    /// A number that is infinite or not a number.
    #[error("start with the non-finite entry {index} in {what}")]
    NotFinite {
        /// Which list.
        what: &'static str,
        /// Which entry.
        index: usize,
    },
    /// Bounds the wrong way round.
    #[error("start with bounds [{lower}, {upper}] of variable {index} the wrong way round")]
    Bounds {
        /// Which variable.
        index: usize,
        /// Its lower bound.
        lower: f64,
        /// Its upper bound.
        upper: f64,
    },
    /// Bounds that are no letters: 0 to the last one, the same at every place.
    #[error("start a sequence whose places do not all have the letters 0, 1, 2, ...")]
    NoLetters,
    /// An option outside its range.
    #[error("start with {0}")]
    Options(crate::fault::Faults),
}

impl Problem {
    /// Number of variables.
    pub fn dimension(&self) -> usize {
        self.lower.len()
    }

    /// Number of constraint values, inequalities and equalities.
    pub fn constraints(&self) -> usize {
        self.inequalities + self.equalities
    }

    /// Largest violation of values: max of 0, g and |h|.
    pub fn violation(&self, constraints: &[f64]) -> f64 {
        let (g, h) = constraints.split_at(self.inequalities.min(constraints.len()));
        let largest = g.iter().copied().fold(0.0, f64::max);
        h.iter().map(|value| value.abs()).fold(largest, f64::max)
    }

    /// The bounds' nearest point to `x`.
    pub fn clip(&self, x: &mut [f64]) {
        for (value, (lower, upper)) in x.iter_mut().zip(self.lower.iter().zip(&self.upper)) {
            *value = value.max(*lower).min(*upper);
        }
    }

    pub(crate) fn check(&self, x0: &[f64]) -> Result<(), StartError> {
        let n = self.dimension();
        if n == 0 {
            return Err(StartError::NoVariables);
        }
        for (what, list) in [("upper", self.upper.as_slice()), ("x0", x0)] {
            if list.len() != n {
                return Err(StartError::Length {
                    what,
                    expected: n,
                    found: list.len(),
                });
            }
        }
        for (what, list) in [
            ("lower", self.lower.as_slice()),
            ("upper", &self.upper),
            ("x0", x0),
        ] {
            if let Some(index) = list.iter().position(|value| !value.is_finite()) {
                return Err(StartError::NotFinite { what, index });
            }
        }
        for (index, (&lower, &upper)) in self.lower.iter().zip(&self.upper).enumerate() {
            if lower > upper {
                return Err(StartError::Bounds {
                    index,
                    lower,
                    upper,
                });
            }
        }
        Ok(())
    }

    /// The start, or a point on the way from it to the middle of the bounds.
    pub(crate) fn nudged(&self, start: &[f64], attempt: usize) -> Vec<f64> {
        let fraction = NUDGES[attempt.min(NUDGES.len() - 1)];
        if fraction == 0.0 {
            return start.to_vec();
        }
        let toward = |i: usize| {
            let (x, lower, upper) = (start[i], self.lower[i], self.upper[i]);
            let reach = 0.5 * (upper - lower).min(2.0 * x.abs().max(1.0));
            let middle = 0.5 * (lower + upper);
            let aim = if (middle - x).abs() > 1e-3 * reach {
                (middle - x).clamp(-reach, reach)
            } else {
                0.5 * reach
            };
            x + fraction * aim
        };
        let mut x: Vec<f64> = (0..start.len()).map(toward).collect();
        self.clip(&mut x);
        x
    }

    /// An answer that can be used.
    pub(crate) fn usable<'a>(&self, told: Option<&'a Told>) -> Option<&'a Values> {
        match told {
            Some(Told::Values(values)) if self.accepts(values) => Some(values),
            _ => None,
        }
    }

    /// Whether values have this problem's lengths and are finite; a worker's nonsense counts as a failure.
    pub(crate) fn accepts(&self, values: &Values) -> bool {
        values.objective.is_finite()
            && values.constraints.len() == self.constraints()
            && values.constraints.iter().all(|value| value.is_finite())
    }
}
