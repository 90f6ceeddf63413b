//! The space in which the strategy lives: one coordinate per free variable, 0 at its lower bound and 1 at its upper.
//!
//! Bounds that are a thousand times further apart than the start is large say nothing about where to look: there the unit is
//! the start's size, and the start is at 0.
//!
//! Coordinates are unbounded. What lies beyond a bound is folded back by a mirror whose edge is rounded to a parabola
//! (as in Hansen's implementations): no mean is pushed off a bound by points that were cut there, and an optimum on a
//! bound is the bottom of a smooth valley, not of a kink. The fold is the identity but for 5 % of a unit at each bound.

use serde::{Deserialize, Serialize};

use crate::optimiser::problem::Problem;

/// Reach of the parabola on each side of a bound.
const ROUNDING: f64 = 0.05;
/// A bound beyond this counts as none.
const UNBOUNDED: f64 = 1e20;
/// Bounds further apart than this many times the start's size say nothing.
const WIDE: f64 = 1e3;

/// A variable that has room.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
struct Axis {
    /// Which variable.
    variable: usize,
    /// Its value at 0, and from there to 1.
    origin: f64,
    width: f64,
    /// Coordinates of its bounds, if it has any.
    bounds: [Option<f64>; 2],
}

/// Free variables as coordinates.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Coordinates {
    axes: Vec<Axis>,
    /// The start, from which variables that are not free have their values.
    start: Vec<f64>,
}

impl Coordinates {
    pub fn new(problem: &Problem, x0: &[f64]) -> Self {
        let axis = |variable: usize| {
            let (lower, upper, start) = (
                problem.lower[variable],
                problem.upper[variable],
                x0[variable],
            );
            let size = start.abs().max(1.0);
            let (origin, width) = if upper - lower <= WIDE * size {
                (lower, upper - lower)
            } else {
                (start, 2.0 * size)
            };
            let at = |bound: f64| (bound.abs() < UNBOUNDED).then(|| (bound - origin) / width);
            Axis {
                variable,
                origin,
                width,
                bounds: [at(lower), at(upper)],
            }
        };
        let free = |i: &usize| problem.lower[*i] < problem.upper[*i];
        Self {
            axes: (0..x0.len()).filter(free).map(axis).collect(),
            start: x0.to_vec(),
        }
    }

    /// Free variables.
    pub fn dimension(&self) -> usize {
        self.axes.len()
    }

    /// The start.
    pub fn start(&self) -> &[f64] {
        &self.start
    }

    /// Variables at coordinates.
    pub fn variables(&self, problem: &Problem, at: &[f64]) -> Vec<f64> {
        let mut x = self.start.clone();
        for (axis, u) in self.axes.iter().zip(at) {
            x[axis.variable] = axis.origin + axis.width * fold(*u, axis.bounds);
        }
        problem.clip(&mut x);
        x
    }

    /// Coordinates of variables within their bounds.
    pub fn at(&self, x: &[f64]) -> Vec<f64> {
        let coordinate =
            |axis: &Axis| unfold((x[axis.variable] - axis.origin) / axis.width, axis.bounds);
        self.axes.iter().map(coordinate).collect()
    }
}

/// From anywhere to what lies between the bounds.
fn fold(u: f64, bounds: [Option<f64>; 2]) -> f64 {
    let outer = [
        bounds[0].map(|b| b - ROUNDING),
        bounds[1].map(|b| b + ROUNDING),
    ];
    let mirrored = match outer {
        // Points that need no mirror keep all their digits, however far the bounds.
        [low, high] if low.is_none_or(|b| u >= b) && high.is_none_or(|b| u <= b) => u,
        [Some(low), Some(high)] => {
            let period = 2.0 * (high - low);
            let along = (u - low).abs() % period;
            low + along.min(period - along)
        }
        [Some(edge), None] | [None, Some(edge)] => 2.0 * edge - u,
        [None, None] => u,
    };
    match (bounds, outer) {
        ([Some(low), _], [Some(edge), _]) if mirrored < low + ROUNDING => {
            low + (mirrored - edge).powi(2) / (4.0 * ROUNDING)
        }
        ([_, Some(high)], [_, Some(edge)]) if mirrored > high - ROUNDING => {
            high - (edge - mirrored).powi(2) / (4.0 * ROUNDING)
        }
        _ => mirrored,
    }
}

/// The nearest coordinate that [`fold`] takes there.
fn unfold(v: f64, bounds: [Option<f64>; 2]) -> f64 {
    match bounds {
        [Some(low), _] if v < low + ROUNDING => {
            low - ROUNDING + (4.0 * ROUNDING * (v - low).max(0.0)).sqrt()
        }
        [_, Some(high)] if v > high - ROUNDING => {
            high + ROUNDING - (4.0 * ROUNDING * (high - v).max(0.0)).sqrt()
        }
        _ => v,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_fold_stays_within_bounds_and_is_smooth_and_undone() {
        for bounds in [
            [Some(0.0), Some(1.0)],
            [Some(0.0), None],
            [None, Some(1.0)],
            [None, None],
        ] {
            let h = 1e-6;
            let mut last = None;
            for i in -4000..4000 {
                let u = 1e-3 * f64::from(i);
                let v = fold(u, bounds);
                assert!(bounds[0].is_none() || v >= 0.0);
                assert!(bounds[1].is_none() || v <= 1.0);
                assert!((fold(unfold(v, bounds), bounds) - v).abs() < 1e-14);
                let slope = (fold(u + h, bounds) - fold(u - h, bounds)) / (2.0 * h);
                assert!(slope.abs() < 1.0 + 1e-6);
                // The slope turns over 0.1, so that it changes by 0.02 a step at most.
                if let Some(last) = last {
                    let change: f64 = slope - last;
                    assert!(change.abs() < 0.021, "at {u}: {change}");
                }
                last = Some(slope);
            }
            for v in [0.05, 0.3, 0.95] {
                assert_eq!(fold(v, bounds), v, "the identity between");
            }
        }
    }

    #[test]
    fn fixed_variables_are_no_coordinates_and_wide_bounds_leave_the_scale_to_the_start() {
        let problem = Problem {
            lower: vec![0.0, 2.0, -1e30, 5.0],
            upper: vec![10.0, 2.0, 1e30, 1e9],
            inequalities: 0,
            equalities: 0,
        };
        let x0 = [2.5, 2.0, -40.0, 8.0];
        let coordinates = Coordinates::new(&problem, &x0);
        assert_eq!(coordinates.dimension(), 3);
        assert_eq!(coordinates.at(&x0), [0.25, 0.0, 0.0]);
        let x = coordinates.variables(&problem, &[0.5, 1.5, -1.0]);
        assert_eq!(x[..3], [5.0, 2.0, 80.0]);
        // 8 - 16 lies beyond the bound of 5 by 13, and comes back from an edge that is 0.8 behind it.
        assert!((x[3] - (4.2 + 12.2)).abs() < 1e-12, "{}", x[3]);
    }
}
