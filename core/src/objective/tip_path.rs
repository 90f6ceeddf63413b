//! How far a point strays from the path that it should follow: the mean of the squared distances over the states, mm^2.
//!
//! Each state has its own place to be, so that the measure is a polynomial of the displacements, and smooth.

/// Where the point should be at each state: `points` has one entry for each state, else one for each row of the schedule
/// with straight lines between them. `at` are the states' legs and fractions.
pub fn targets(points: &[[f64; 2]], at: &[(usize, f64)]) -> Vec<[f64; 2]> {
    if points.len() == at.len() {
        return points.to_vec();
    }
    at.iter()
        .map(|&(leg, t)| {
            let (a, b) = (points[leg], points[leg + 1]);
            std::array::from_fn(|i| a[i] + t * (b[i] - a[i]))
        })
        .collect()
}

/// Mean squared distance, mm^2.
pub fn mean_square(points: &[[f64; 2]], targets: &[[f64; 2]]) -> f64 {
    let sum: f64 = points
        .iter()
        .zip(targets)
        .map(|(p, t)| (p[0] - t[0]).powi(2) + (p[1] - t[1]).powi(2))
        .sum();
    sum / points.len() as f64
}

/// Its derivative with respect to each point, mm.
pub fn gradient(points: &[[f64; 2]], targets: &[[f64; 2]]) -> Vec<[f64; 2]> {
    let scale = 2.0 / points.len() as f64;
    points
        .iter()
        .zip(targets)
        .map(|(p, t)| [scale * (p[0] - t[0]), scale * (p[1] - t[1])])
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn targets_run_straight_between_rows_or_are_given_state_by_state() {
        let at = [(0, 0.0), (0, 0.25), (0, 1.0), (1, 0.25), (1, 1.0)];
        let rows = [[0.0, 0.0], [4.0, 0.0], [4.0, 8.0]];
        let along = targets(&rows, &at);
        assert_eq!(
            along,
            [[0.0, 0.0], [1.0, 0.0], [4.0, 0.0], [4.0, 2.0], [4.0, 8.0]]
        );
        assert_eq!(targets(&along, &at), along);
        assert_eq!(mean_square(&along, &along), 0.0);
        // One state of five that is off by (3, 4).
        let mut off = along.clone();
        off[3] = [7.0, 6.0];
        assert_eq!(mean_square(&off, &along), 5.0);
        assert!((gradient(&off, &along)[3][1] - 1.6).abs() < 1e-15);
    }
}
