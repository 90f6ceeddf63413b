//! From a feasible iterate: extend, shorten or refine the step until the best trial is worth a return.

use super::{MOST_REDUCTIONS, Next, Sample, Search, Setting};
use crate::optimiser::{
    mmfd::interpolation::{crossing, minimum},
    point::Point,
    rows,
};

/// Trials that may extend the search.
const MOST_EXTENSIONS: usize = 8;
/// Trials that may refine a bracket.
const MOST_REFINEMENTS: usize = 2;
/// The step may grow by this factor at once.
const LONGEST_EXTENSION: f64 = 5.0;
/// A longer step is tried where the expected one is this many times as long.
const WORTH_EXTENDING: f64 = 2.0;
/// A step inside a bracket is tried where it is longer by this fraction.
const WORTH_REFINING: f64 = 0.3;
/// Tangent rows may be violated this far before a first-order return is no longer believed, other rows so far.
const TRUSTED_VIOLATION: f64 = 0.3;
const HARDLY_VIOLATED: f64 = 0.01;

impl Search {
    pub(super) fn next_feasible(&mut self, setting: &Setting<'_>) -> Next {
        let start = self.estimate(setting, setting.origin);
        let mut upper = self.bad.iter().copied().fold(f64::INFINITY, f64::min);
        let mut lower: Option<&Sample> = None;
        let mut order: Vec<&Sample> = self.trials.iter().collect();
        order.sort_by(|a, b| a.alpha.total_cmp(&b.alpha));
        for sample in order {
            if sample.alpha >= upper {
                break;
            }
            let best = lower.map_or(start, |sample| sample.merit);
            if sample.merit < best && self.believable(setting, &sample.point) {
                lower = Some(sample);
            } else {
                upper = sample.alpha;
            }
        }
        let Some(lower) = lower.cloned() else {
            if self.reductions >= MOST_REDUCTIONS {
                return Next::Fail;
            }
            self.reductions += 1;
            let alpha = self
                .shorter(setting, start, 0.0, upper)
                .clamp(0.02 * upper, 0.5 * upper);
            return self.try_at(alpha);
        };
        if upper.is_infinite() {
            let wanted = self.longer(setting, start, &lower);
            let saturated = self.on_ray(setting, 2.0 * lower.alpha) == lower.point.x;
            if self.extensions >= MOST_EXTENSIONS
                || wanted <= WORTH_EXTENDING * lower.alpha
                || saturated
            {
                return self.finalise(setting, &lower);
            }
            self.extensions += 1;
            let mut alpha = wanted.min(LONGEST_EXTENSION * lower.alpha);
            if !self.direction.tangent.is_empty()
                && let Some(bound) = self
                    .direction
                    .to_bound
                    .filter(|bound| *bound > 1.1 * lower.alpha)
            {
                alpha = alpha.min(bound);
            }
            return self.try_at(alpha);
        }
        // Where trust alone ends the bracket a return from inside it says more than another trial.
        let beyond = self.trials.iter().find(|sample| sample.alpha == upper);
        let only_trust = beyond.is_some_and(|beyond| {
            beyond.merit < lower.merit && self.only_tangent_rows_violated(setting, &beyond.point)
        });
        let at_boundary =
            beyond.is_some_and(|beyond| self.stopped_by_row(setting, &lower.point, &beyond.point));
        if self.refinements >= MOST_REFINEMENTS || only_trust || at_boundary {
            return self.finalise(setting, &lower);
        }
        let width = upper - lower.alpha;
        let alpha = self
            .shorter(setting, start, lower.alpha, upper)
            .clamp(lower.alpha + 0.02 * width, lower.alpha + 0.98 * width);
        if alpha - lower.alpha < WORTH_REFINING * lower.alpha {
            return self.finalise(setting, &lower);
        }
        self.refinements += 1;
        self.try_at(alpha)
    }

    /// Whether a row that the direction is not tangent to separates two trials, the nearer one being at its boundary.
    fn stopped_by_row(&self, setting: &Setting<'_>, near: &Point, far: &Point) -> bool {
        let near = rows::values(setting.problem, &near.constraints);
        let far = rows::values(setting.problem, &far.constraints);
        (0..far.len()).any(|row| {
            !self.is_tangent(row) && far[row] > HARDLY_VIOLATED && near[row] > -setting.ctmin
        })
    }

    fn only_tangent_rows_violated(&self, setting: &Setting<'_>, point: &Point) -> bool {
        let g = rows::values(setting.problem, &point.constraints);
        g.iter()
            .enumerate()
            .all(|(row, &g)| g <= setting.ctmin || self.is_tangent(row))
    }

    /// Whether a trial's merit says what a return would give: tangent rows are violated little, others hardly.
    fn believable(&self, setting: &Setting<'_>, point: &Point) -> bool {
        let g = rows::values(setting.problem, &point.constraints);
        g.iter().enumerate().all(|(row, &g)| {
            g <= if self.is_tangent(row) {
                TRUSTED_VIOLATION
            } else {
                HARDLY_VIOLATED
            }
        })
    }

    /// The step at which the next row is expected at its boundary, or the merit at its minimum, beyond `lower`.
    fn longer(&self, setting: &Setting<'_>, start: f64, lower: &Sample) -> f64 {
        let previous = self
            .trials
            .iter()
            .filter(|sample| sample.alpha < lower.alpha)
            .max_by(|a, b| a.alpha.total_cmp(&b.alpha));
        let mut wanted = minimum(
            start,
            self.merit_slope(),
            (lower.alpha, lower.merit),
            previous.map(|sample| (sample.alpha, sample.merit)),
        );
        let from = rows::values(setting.problem, &setting.origin.constraints);
        let to = rows::values(setting.problem, &lower.point.constraints);
        for row in 0..from.len() {
            if !self.is_tangent(row) {
                let target = 0.5 * setting.ctmin;
                let at = crossing(
                    from[row],
                    self.direction.row_slopes[row],
                    lower.alpha,
                    to[row],
                    target,
                );
                if at > lower.alpha {
                    wanted = wanted.min(at);
                }
            }
        }
        wanted
    }

    /// A step between `lower` and `upper`, from what is known at both and at the iterate.
    fn shorter(&self, setting: &Setting<'_>, start: f64, lower: f64, upper: f64) -> f64 {
        let Some(beyond) = self.trials.iter().find(|sample| sample.alpha == upper) else {
            return 0.5 * (lower + upper);
        };
        let inside = self.trials.iter().find(|sample| sample.alpha == lower);
        let mut wanted = minimum(
            start,
            self.merit_slope(),
            (upper, beyond.merit),
            inside.map(|sample| (sample.alpha, sample.merit)),
        );
        let from = rows::values(setting.problem, &setting.origin.constraints);
        let to = rows::values(setting.problem, &beyond.point.constraints);
        for row in 0..from.len() {
            if self.is_tangent(row) {
                if to[row] > TRUSTED_VIOLATION {
                    // Curvature alone takes a tangent row away from its boundary.
                    wanted = wanted.min(upper * (TRUSTED_VIOLATION * 0.8 / to[row]).sqrt());
                }
            } else if to[row] > setting.ctmin {
                let slope = self.direction.row_slopes[row];
                wanted = wanted.min(crossing(
                    from[row],
                    slope,
                    upper,
                    to[row],
                    0.5 * setting.ctmin,
                ));
            }
        }
        if wanted > lower && wanted < upper {
            wanted
        } else {
            0.5 * (lower + upper)
        }
    }

    /// d merit / d alpha at the iterate: tangent rows are flat there.
    fn merit_slope(&self) -> f64 {
        let rows = &self.direction.row_slopes;
        let tangent = self.direction.tangent.iter();
        self.direction.slope
            + tangent
                .map(|&(row, multiplier)| multiplier * rows[row])
                .sum::<f64>()
    }

    fn is_tangent(&self, row: usize) -> bool {
        self.direction
            .tangent
            .iter()
            .any(|&(tangent, _)| tangent == row)
    }
}
