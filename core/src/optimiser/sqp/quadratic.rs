//! The quadratic subproblem, by least distance and non-negative least squares.
//!
//! min g'd + d'Bd / 2 with a_j'd + c_j <= 0 and l <= d <= u. With B = L L' and y = L'd + L^-1 g it is the least distance
//! problem min |y| with b_i'y >= h_i, whose dual is a non-negative least squares problem (Lawson and Hanson, Solving Least
//! Squares Problems, 1974, chapter 23; Kraft, DFVLR-FB 88-28, 1988): minimise |E u - e| over u >= 0 with columns
//! (b_i, h_i) and e = (0, 1); its residual r gives y = -r_y / r_h, and r = 0 says that no y meets the rows. The rows with
//! u_i > 0 are active; y and the multipliers are then solved for once more from these alone, which returns the digits that
//! the division cost.
//!
//! Where no d meets the rows each constraint gets a slack v_j of its own, a_j'd + c_j <= e |L^-1 a_j| v_j, and the
//! objective |v|^2 / 2: the step that violates them least, to within e^2.

use super::hessian::Factor;
use crate::optimiser::{
    nnls,
    thin_qr::ThinQr,
    vector::{dot, norm},
};

/// e: a slack of size e costs as much as a unit of y.
const SLACK: f64 = 1e-3;
/// A row may be missed by this part of the distance to the farthest.
const MISSED: f64 = 1e-7;
/// |r| below this says that the rows contradict each other.
const CONTRADICTION: f64 = 1e-6;

/// A subproblem; vectors have the free variables' length.
pub(super) struct Quadratic<'a> {
    pub factor: &'a Factor,
    /// g.
    pub gradient: &'a [f64],
    /// a_j.
    pub rows: &'a [Vec<f64>],
    /// c_j.
    pub values: &'a [f64],
    /// l <= 0.
    pub lower: &'a [f64],
    /// u >= 0.
    pub upper: &'a [f64],
}

/// A step and its multipliers.
#[derive(Clone, Debug)]
pub(super) struct Solution {
    /// d.
    pub step: Vec<f64>,
    /// One per row, not negative.
    pub multipliers: Vec<f64>,
    /// Whether the rows contradict each other, so that some are not met.
    pub relaxed: bool,
}

/// b'y >= h, with |b| = 1.
struct Side {
    b: Vec<f64>,
    h: f64,
    /// Length of L^-1 a.
    length: f64,
    /// The row; none for a bound.
    row: Option<usize>,
}

impl Quadratic<'_> {
    /// The step, relaxed if need be.
    pub fn solve(&self) -> Solution {
        let centre = self.factor.forward(self.gradient);
        let mut sides = self.sides(&centre);
        let mut least = least_distance(&sides, centre.len());
        let relaxed = least.is_none();
        if relaxed {
            self.slacken(&mut sides);
            least = least_distance(&sides, centre.len() + self.rows.len());
        }
        let mut multipliers = vec![0.0; self.rows.len()];
        let Some(Least { y, active }) = least else {
            // Rounding alone leads here: bounds with slack rows always hold together.
            return Solution {
                step: vec![0.0; centre.len()],
                multipliers,
                relaxed,
            };
        };
        for (side, multiplier) in active {
            if let Some(row) = sides[side].row {
                multipliers[row] = multiplier / sides[side].length;
            }
        }
        let moved: Vec<f64> = y.iter().zip(&centre).map(|(y, w)| y - w).collect();
        let mut step = self.factor.backward(&moved);
        for (d, (lower, upper)) in step.iter_mut().zip(self.lower.iter().zip(self.upper)) {
            *d = d.max(*lower).min(*upper);
        }
        Solution {
            step,
            multipliers,
            relaxed,
        }
    }

    fn sides(&self, centre: &[f64]) -> Vec<Side> {
        let n = centre.len();
        let mut sides = Vec::with_capacity(self.rows.len() + 2 * n);
        let mut add = |mut b: Vec<f64>, c: f64, row: Option<usize>| {
            let length = norm(&b);
            if length > 0.0 && length.is_finite() {
                for value in &mut b {
                    *value /= -length;
                }
                let h = c / length + dot(&b, centre);
                sides.push(Side { b, h, length, row });
            }
        };
        for (row, (a, &c)) in self.rows.iter().zip(self.values).enumerate() {
            add(self.factor.forward(a), c, Some(row));
        }
        for i in 0..n {
            let mut unit = vec![0.0; n];
            unit[i] = 1.0;
            let column = self.factor.forward(&unit);
            add(column.iter().map(|v| -v).collect(), self.lower[i], None);
            add(column, -self.upper[i], None);
        }
        sides
    }

    /// Gives each row a slack.
    fn slacken(&self, sides: &mut [Side]) {
        for side in sides {
            let n = side.b.len();
            side.b.resize(n + self.rows.len(), 0.0);
            if let Some(row) = side.row {
                side.b[n + row] = SLACK;
                // Of unit length again.
                let length = 1.0_f64.hypot(SLACK);
                for value in &mut side.b {
                    *value /= length;
                }
                side.h /= length;
                side.length *= length;
            }
        }
    }
}

/// A shortest y, and the sides that hold it with their multipliers.
struct Least {
    y: Vec<f64>,
    active: Vec<(usize, f64)>,
}

/// The shortest y with b_i'y >= h_i for all sides; none where no y meets them all.
fn least_distance(sides: &[Side], n: usize) -> Option<Least> {
    let farthest = sides.iter().map(|side| side.h).fold(0.0, f64::max);
    if farthest <= 0.0 {
        return Some(Least {
            y: vec![0.0; n],
            active: Vec::new(),
        });
    }
    let columns: Vec<Vec<f64>> = sides
        .iter()
        .map(|side| {
            let h = side.h / farthest;
            let length = 1.0_f64.hypot(h);
            let mut column: Vec<f64> = side.b.iter().map(|b| b / length).collect();
            column.push(h / length);
            column
        })
        .collect();
    let mut target = vec![0.0; n + 1];
    target[n] = -1.0;
    let dual = nnls::solve(&columns, &target);
    if norm(&dual.residual) < CONTRADICTION {
        return None;
    }
    let active: Vec<usize> = (0..sides.len())
        .filter(|i| dual.multipliers[*i] > 0.0)
        .collect();
    let missed = |y: &[f64]| {
        let miss = |side: &Side| side.h - dot(&side.b, y);
        sides.iter().map(miss).fold(0.0, f64::max) / farthest
    };
    // From the active sides alone.
    let mut span = ThinQr::default();
    let mut products = Vec::new();
    for &i in &active {
        if span.push(i, &sides[i].b) {
            products.push(sides[i].h);
        }
    }
    let y = span.shortest(&products, n);
    let multipliers = span.solve(&y);
    let size = norm(&y).max(farthest);
    if multipliers.iter().all(|m| *m >= -1e-9 * size) && missed(&y) <= MISSED {
        let held = span.members.iter().zip(&multipliers);
        let active = held.map(|(&i, m)| (i, m.max(0.0))).collect();
        return Some(Least { y, active });
    }
    // As the dual tells it.
    let last = -dual.residual[n];
    let y: Vec<f64> = dual.residual[..n]
        .iter()
        .map(|r| farthest * r / last)
        .collect();
    let multiplier = |i: usize| {
        let h = sides[i].h / farthest;
        farthest * dual.multipliers[i] / (last * 1.0_f64.hypot(h))
    };
    (missed(&y) <= 1e-3).then(|| {
        let active = active.iter().map(|&i| (i, multiplier(i))).collect();
        Least { y, active }
    })
}

#[cfg(test)]
mod tests {
    use super::super::hessian::Hessian;
    use super::*;

    fn sequence(seed: u64) -> impl FnMut() -> f64 {
        let mut state = seed;
        move || {
            state = state
                .wrapping_mul(6364136223846793005)
                .wrapping_add(1442695040888963407);
            (state >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
        }
    }

    #[test]
    fn random_subproblems_meet_their_optimality_conditions() {
        for (n, m) in [(1, 1), (2, 3), (5, 8), (10, 4), (30, 40)] {
            for seed in 0..20 {
                let mut next = sequence(1000 * seed + n as u64);
                let mut vector = |n: usize| -> Vec<f64> { (0..n).map(|_| next()).collect() };
                let mut hessian = Hessian::multiple(n, 1.0);
                for _ in 0..4 {
                    let s = vector(n);
                    let y: Vec<f64> = s.iter().zip(vector(n)).map(|(s, r)| s * 10.0 + r).collect();
                    hessian.learn(&s, &y);
                }
                let rows: Vec<Vec<f64>> = (0..m).map(|_| vector(n)).collect();
                // d = 0.3 of a random point of the box meets every row.
                let inside: Vec<f64> = vector(n).iter().map(|v| 0.3 * v).collect();
                let values: Vec<f64> = rows
                    .iter()
                    .zip(vector(m))
                    .map(|(a, slack)| -dot(a, &inside) - 0.1 * slack.abs())
                    .collect();
                let gradient: Vec<f64> = vector(n).iter().map(|v| 100.0 * v).collect();
                let (lower, upper) = (vec![-0.5; n], vec![1.0; n]);
                let factor = hessian.factor();
                let quadratic = Quadratic {
                    factor: &factor,
                    gradient: &gradient,
                    rows: &rows,
                    values: &values,
                    lower: &lower,
                    upper: &upper,
                };
                let found = quadratic.solve();
                let place = format!("{n} x {m}, {seed}");
                assert!(!found.relaxed, "{place}");
                let mut slope = hessian.times(&found.step);
                for i in 0..n {
                    slope[i] += gradient[i];
                }
                for ((a, c), lambda) in rows.iter().zip(&values).zip(&found.multipliers) {
                    let value = c + dot(a, &found.step);
                    assert!(value < 1e-8, "{place}: a row is missed by {value:.1e}");
                    assert!(*lambda >= 0.0 && (lambda * value).abs() < 1e-6, "{place}");
                    for i in 0..n {
                        slope[i] += lambda * a[i];
                    }
                }
                for (i, (slope, d)) in slope.iter().zip(&found.step).enumerate() {
                    let held =
                        (*slope > 0.0 && *d < -0.5 + 1e-9) || (*slope < 0.0 && *d > 1.0 - 1e-9);
                    assert!(
                        held || slope.abs() < 1e-6,
                        "{place}: slope {i} {slope:.1e} at {d}"
                    );
                }
            }
        }
    }

    #[test]
    fn rows_that_contradict_each_other_are_missed_by_as_little_as_can_be() {
        // d <= -0.5 and d >= 0.5 (with its row twice as long): the least squares of both in their own lengths is 0.
        let hessian = Hessian::multiple(2, 4.0);
        let factor = hessian.factor();
        let quadratic = Quadratic {
            factor: &factor,
            gradient: &[3.0, 1.0],
            rows: &[vec![1.0, 0.0], vec![-2.0, 0.0], vec![0.0, 0.0]],
            values: &[0.5, 1.0, 1.0],
            lower: &[-1.0, -0.1],
            upper: &[1.0, 1.0],
        };
        let found = quadratic.solve();
        assert!(found.relaxed);
        assert!(found.step[0].abs() < 1e-4, "{found:?}");
        assert!((found.step[1] + 0.1).abs() < 1e-9, "{found:?}");
        assert_eq!(found.multipliers[2], 0.0, "a row without a slope");
    }
}
