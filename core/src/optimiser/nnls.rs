//! Non-negative least squares: lambda >= 0 that minimises |p + A' lambda|.
//!
//! Lawson and Hanson, Solving Least Squares Problems (1974), chapter 23. The columns of the passive set are held as a
//! thin QR factorisation that grows by orthogonalisation and shrinks by plane rotations, so that an exchange costs
//! O(variables x passive rows). Deterministic: ties go to the lower index.

use super::{
    thin_qr::ThinQr,
    vector::{dot, norm},
};

/// A solution of the problem.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Solution {
    /// One multiplier per row of A.
    pub multipliers: Vec<f64>,
    /// p + A' lambda.
    pub residual: Vec<f64>,
}

/// Minimises |p + A' lambda| over lambda >= 0; the rows of A are expected with unit length, or null.
pub(crate) fn solve(rows: &[Vec<f64>], p: &[f64]) -> Solution {
    let target: Vec<f64> = p.iter().map(|value| -value).collect();
    let tolerance = 1e-12 * norm(p).max(f64::MIN_POSITIVE);
    let mut multipliers = vec![0.0; rows.len()];
    let mut passive = ThinQr::default();
    let mut residual = target.clone();
    // A row that could not enter (dependent on the passive ones, or leaving at once) waits until the set has changed.
    let mut barred = vec![false; rows.len()];
    for _ in 0..3 * rows.len() + 10 {
        let Some(entering) = most_wanted(rows, &residual, &barred, &passive.members, tolerance)
        else {
            break;
        };
        if !passive.push(entering, &rows[entering]) {
            barred[entering] = true;
            continue;
        }
        let mut trial = passive.solve(&target);
        if trial.last().is_none_or(|&value| value <= 0.0) {
            passive.remove(passive.members.len() - 1);
            barred[entering] = true;
            continue;
        }
        while let Some(blocking) = first_to_leave(&passive.members, &multipliers, &trial) {
            let (position, fraction) = blocking;
            for (&row, &value) in passive.members.iter().zip(&trial) {
                multipliers[row] += fraction * (value - multipliers[row]);
            }
            multipliers[passive.members[position]] = 0.0;
            passive.remove(position);
            trial = passive.solve(&target);
        }
        for (&row, &value) in passive.members.iter().zip(&trial) {
            multipliers[row] = value;
        }
        residual = passive.residual(&target);
        barred.fill(false);
    }
    Solution {
        multipliers,
        residual: residual.iter().map(|value| -value).collect(),
    }
}

/// The row outside the passive set that reduces the residual fastest.
fn most_wanted(
    rows: &[Vec<f64>],
    residual: &[f64],
    barred: &[bool],
    members: &[usize],
    tolerance: f64,
) -> Option<usize> {
    let mut inside = vec![false; rows.len()];
    for &row in members {
        inside[row] = true;
    }
    let mut best = None;
    let mut most = tolerance.max(1e-10 * norm(residual));
    for (i, row) in rows.iter().enumerate() {
        if !inside[i] && !barred[i] {
            let rate = dot(row, residual);
            if rate > most {
                most = rate;
                best = Some(i);
            }
        }
    }
    best
}

/// Position in the passive set of the first multiplier to reach zero on the way to `trial`, and the fraction of the way.
fn first_to_leave(members: &[usize], multipliers: &[f64], trial: &[f64]) -> Option<(usize, f64)> {
    let mut first: Option<(usize, f64)> = None;
    for (position, (&row, &value)) in members.iter().zip(trial).enumerate() {
        if value <= 0.0 {
            let from = multipliers[row];
            let fraction = if from - value > 0.0 {
                from / (from - value)
            } else {
                0.0
            };
            if first.is_none_or(|(_, least)| fraction < least) {
                first = Some((position, fraction));
            }
        }
    }
    first
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A fixed sequence in [-1, 1).
    fn sequence(seed: u64) -> impl FnMut() -> f64 {
        let mut state = seed;
        move || {
            state = state
                .wrapping_mul(6364136223846793005)
                .wrapping_add(1442695040888963407);
            (state >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
        }
    }

    /// Residual r = p + A' lambda: lambda >= 0, A r >= 0, lambda . A r = 0.
    fn assert_optimal(rows: &[Vec<f64>], solution: &Solution, place: &str) {
        for (i, (row, &multiplier)) in rows.iter().zip(&solution.multipliers).enumerate() {
            let rate = dot(row, &solution.residual);
            assert!(multiplier >= 0.0, "{place}: multiplier {i} is {multiplier}");
            assert!(
                rate > -1e-8,
                "{place}: row {i} would still help, {rate:.1e}"
            );
            assert!(
                (multiplier * rate).abs() < 1e-8,
                "{place}: row {i}, {multiplier} x {rate:.1e}"
            );
        }
    }

    #[test]
    fn solutions_meet_their_optimality_conditions() {
        for (n, m) in [(2, 5), (5, 3), (10, 30), (40, 40), (60, 120)] {
            for seed in 0..20 {
                let mut next = sequence(seed * 1000 + n as u64);
                let rows: Vec<Vec<f64>> = (0..m)
                    .map(|_| {
                        let row: Vec<f64> = (0..n).map(|_| next()).collect();
                        let length = norm(&row);
                        row.iter().map(|value| value / length).collect()
                    })
                    .collect();
                let p: Vec<f64> = (0..n).map(|_| next()).collect();
                let solution = solve(&rows, &p);
                for i in 0..n {
                    let sum: f64 = rows
                        .iter()
                        .zip(&solution.multipliers)
                        .map(|(row, l)| row[i] * l)
                        .sum();
                    assert!((p[i] + sum - solution.residual[i]).abs() < 1e-9);
                }
                assert_optimal(&rows, &solution, &format!("{n} x {m}, {seed}"));
            }
        }
    }

    #[test]
    fn repeated_opposed_and_null_rows_are_no_trouble() {
        let rows = vec![
            vec![1.0, 0.0, 0.0],
            vec![1.0, 0.0, 0.0],
            vec![-1.0, 0.0, 0.0],
            vec![0.0, 0.0, 0.0],
            vec![0.6, 0.8, 0.0],
            vec![0.6, 0.8, 1e-13],
        ];
        for p in [
            [-1.0, -2.0, 0.5],
            [1.0, 2.0, 0.5],
            [-1.0, 1.0, 0.0],
            [0.0, 0.0, 0.0],
        ] {
            let solution = solve(&rows, &p);
            assert_optimal(&rows, &solution, &format!("{p:?}"));
        }
    }

    #[test]
    fn the_projection_on_a_corner_is_the_textbooks() {
        // Rows e1 and e2: the feasible cone is the negative quadrant; -p = (1, -2) projects to (0, -2).
        let solution = solve(&[vec![1.0, 0.0], vec![0.0, 1.0]], &[-1.0, 2.0]);
        assert_eq!(solution.multipliers, vec![1.0, 0.0]);
        assert_eq!(solution.residual, vec![0.0, 2.0]);
    }
}
