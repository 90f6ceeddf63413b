//! The box in which starts are drawn, and what a start must be: valid by its geometry alone, and apart from the others.

use super::{Drawn, scaled_distance};
use crate::study::error::StudyError;
use crate::study::spec::Study;

/// Designs that may be refused before one is moved into validity.
pub(super) const MAX_DRAWS: usize = 200;

/// Rounds of projections of a repair.
const MAX_ROUNDS: usize = 100;
/// How far below zero a repair brings a row, so that rounding does not leave it above.
const MARGIN: f64 = 1e-6;

/// Where a step's starts are drawn.
pub(super) struct StartSpace<'a> {
    study: &'a Study,
    step: usize,
    lower: Vec<f64>,
    upper: Vec<f64>,
}

/// A design that was drawn, with what had become of it.
pub(super) struct Found {
    pub x: Vec<f64>,
    pub drawn: Drawn,
}

impl<'a> StartSpace<'a> {
    pub(super) fn new(study: &'a Study, step: usize) -> Result<Self, StudyError> {
        let variables = study.variables(step)?;
        Ok(Self {
            study,
            step,
            lower: variables.lower,
            upper: variables.upper,
        })
    }

    /// Number of variables.
    pub(super) fn dimensions(&self) -> usize {
        self.lower.len()
    }

    /// The design of a point of the unit cube.
    pub(super) fn design(&self, unit: impl IntoIterator<Item = f64>) -> Vec<f64> {
        let ends = self.lower.iter().zip(&self.upper);
        ends.zip(unit)
            .map(|((a, b), u)| (a + (b - a) * u).clamp(*a, *b))
            .collect()
    }

    /// By how much the geometry refuses a design: its largest row above zero; infinite where the rows hold and the design
    /// cannot be meshed; 0 of a valid one and of models without a geometry.
    pub(super) fn refusal(&self, x: &[f64]) -> Result<f64, StudyError> {
        let values = match self.study.geometry_values(self.step, x) {
            Ok(values) => values,
            Err(StudyError::NoChambers { .. }) => return Ok(0.0),
            Err(error) => return Err(error),
        };
        let worst = values.into_iter().fold(0.0, f64::max);
        if worst > 0.0 || self.study.mesh_plan(self.step, x)?.is_some() {
            return Ok(worst);
        }
        Ok(f64::INFINITY)
    }

    /// The variables on which the most refused row of a design depends; all of them where no row refuses it.
    pub(super) fn offending(&self, x: &[f64]) -> Result<Vec<usize>, StudyError> {
        let all = || (0..x.len()).collect();
        let (values, gradients) = match self.study.geometry_rows(self.step, x) {
            Ok(rows) => rows,
            Err(StudyError::NoChambers { .. }) => return Ok(all()),
            Err(error) => return Err(error),
        };
        let rows = values.iter().zip(&gradients);
        let worst = rows.max_by(|(a, _), (b, _)| a.total_cmp(b));
        Ok(match worst {
            Some((value, gradient)) if *value > 0.0 => {
                (0..x.len()).filter(|k| gradient[*k] != 0.0).collect()
            }
            _ => all(),
        })
    }

    /// The scaled distance to the nearest of some designs; infinite where there are none.
    pub(super) fn distance<'x>(
        &self,
        x: &[f64],
        others: impl IntoIterator<Item = &'x [f64]>,
    ) -> f64 {
        let distance = |other| scaled_distance(&self.lower, &self.upper, x, other);
        others
            .into_iter()
            .map(distance)
            .fold(f64::INFINITY, f64::min)
    }

    /// The first draw that is valid and apart from the others. Where there is none: of the valid ones the farthest from them,
    /// else the least refused one, moved into validity.
    pub(super) fn first_good(
        &self,
        others: &[&[f64]],
        mut draw: impl FnMut() -> Vec<f64>,
    ) -> Result<Found, StudyError> {
        let apart = self.study.step(self.step)?.restarts.least_distance;
        let mut near: Option<(f64, Vec<f64>)> = None;
        let mut refused: Option<(f64, Vec<f64>)> = None;
        for refusals in 0..MAX_DRAWS {
            let x = draw();
            let refusal = self.refusal(&x)?;
            if refusal > 0.0 {
                if refused.as_ref().is_none_or(|(least, _)| refusal < *least) {
                    refused = Some((refusal, x));
                }
                continue;
            }
            let distance = self.distance(&x, others.iter().copied());
            if distance >= apart {
                return Ok(Found::valid(x, refusals));
            }
            if near.as_ref().is_none_or(|(most, _)| distance > *most) {
                near = Some((distance, x));
            }
        }
        match (near, refused) {
            (Some((_, x)), _) => Ok(Found::valid(x, MAX_DRAWS - 1)),
            (None, Some((_, x))) => self.repaired(x, MAX_DRAWS - 1),
            (None, None) => self.repaired(draw(), MAX_DRAWS),
        }
    }

    /// The design, moved into validity where that is possible.
    pub(super) fn repaired(&self, x: Vec<f64>, refusals: usize) -> Result<Found, StudyError> {
        let moved = self.repair(&x)?;
        Ok(Found {
            drawn: Drawn {
                refusals,
                repaired: moved.is_some(),
                valid: moved.is_some(),
            },
            x: moved.unwrap_or(x),
        })
    }

    /// Successive projections: each broken row in turn takes the shortest step, in variables over their ranges and within the
    /// bounds, that closes it to first order (Kaczmarz 1937; Agmon 1954 for inequalities). `None` where that does not lead to a
    /// valid design.
    fn repair(&self, x: &[f64]) -> Result<Option<Vec<f64>>, StudyError> {
        let mut x = x.to_vec();
        for _ in 0..MAX_ROUNDS {
            if self.refusal(&x)? == 0.0 {
                return Ok(Some(x));
            }
            let (values, gradients) = self.study.geometry_rows(self.step, &x)?;
            let start = x.clone();
            for (value, gradient) in values.iter().zip(&gradients) {
                // What earlier rows of this round did to this one, to first order.
                let done: f64 = (gradient.iter().zip(x.iter().zip(&start)))
                    .map(|(g, (now, then))| g * (now - then))
                    .sum();
                let excess = value + done + MARGIN;
                if *value > -MARGIN && excess > 0.0 {
                    self.close(&mut x, excess, gradient);
                }
            }
        }
        Ok(None)
    }

    /// Moves `x` along a row's gradient so that the row falls by `excess`, without the variables that a bound holds.
    fn close(&self, x: &mut [f64], excess: f64, gradient: &[f64]) {
        let width = |k: usize| self.upper[k] - self.lower[k];
        let is_held = |k: usize, x: &[f64]| {
            (gradient[k] > 0.0 && x[k] <= self.lower[k])
                || (gradient[k] < 0.0 && x[k] >= self.upper[k])
        };
        let slopes: Vec<f64> = (0..x.len())
            .map(|k| {
                if is_held(k, x) {
                    0.0
                } else {
                    gradient[k] * width(k)
                }
            })
            .collect();
        let square: f64 = slopes.iter().map(|s| s * s).sum();
        if square <= f64::MIN_POSITIVE {
            return;
        }
        for (k, slope) in slopes.iter().enumerate() {
            let moved = x[k] - excess * slope / square * width(k);
            x[k] = moved.clamp(self.lower[k], self.upper[k]);
        }
    }
}

impl Found {
    pub(super) fn valid(x: Vec<f64>, refusals: usize) -> Self {
        Self {
            x,
            drawn: Drawn {
                refusals,
                repaired: false,
                valid: true,
            },
        }
    }
}
