//! Constraints with their gradients.

/// A constraint's value and gradient.
pub(super) type Row = (f64, Vec<f64>);
/// Objective, its gradient, and the constraints.
pub(super) type Values = (f64, Vec<f64>, Vec<Row>);

/// A constraint divided by its size.
pub(super) fn scaled(g: f64, dg: &[f64], by: f64) -> Row {
    (g / by, dg.iter().map(|value| value / by).collect())
}

/// A row with a few entries.
pub(super) fn sparse(n: usize, g: f64, entries: &[(usize, f64)], by: f64) -> Row {
    let mut dg = vec![0.0; n];
    for &(i, value) in entries {
        dg[i] = value / by;
    }
    (g / by, dg)
}
