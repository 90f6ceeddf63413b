//! The formulas against the check points of their files, before anything is concluded from a run.

use super::cases::{all, formula};

fn close(found: f64, expected: f64, scale: f64) -> bool {
    (found - expected).abs() <= 1e-9 * scale.max(expected.abs())
}

#[test]
fn formulas_and_gradients_meet_their_check_points() {
    for case in all() {
        assert_eq!(case.x0.len(), case.n, "{}", case.id);
        for at in &case.check_points {
            let (f, df, rows) = formula(&case.id, &at.x);
            let place = format!("{} at {}", case.id, at.label);
            assert!(close(f, at.f, 1.0), "{place}: f {f}, expected {}", at.f);
            assert_eq!(rows.len(), case.m, "{place}");
            for (i, (found, expected)) in df.iter().zip(&at.df).enumerate() {
                assert!(
                    close(*found, *expected, 1e2),
                    "{place}: df[{i}] {found}, expected {expected}"
                );
            }
            for (j, ((g, _), expected)) in rows.iter().zip(&at.g).enumerate() {
                assert!(
                    close(*g, *expected, 1.0),
                    "{place}: g[{j}] {g}, expected {expected}"
                );
            }
            for (j, expected) in at.dg.iter().flatten().enumerate() {
                for (i, expected) in expected.iter().enumerate() {
                    let found = rows[j].1[i];
                    assert!(
                        close(found, *expected, 1e1),
                        "{place}: dg[{j}][{i}] {found}, expected {expected}"
                    );
                }
            }
        }
    }
}
