//! The area that the tip encloses in the reduced model (Eq. 3).

use super::{LinearTransform, cascade};
use crate::geometry::polygon::{signed_area, signed_area_gradient};

/// The signed area of the closed path rest, actuation 1, ..., actuation K, rest of the tip of `units` equal units, mm^2,
/// counter-clockwise positive, with its derivatives by the four entries of each transformation.
///
/// One actuation encloses nothing: the path goes to it and back on one line. Two do, where their tips and rest are not on
/// one line.
pub fn area(
    actuations: &[LinearTransform],
    unit_mm: [f64; 2],
    units: usize,
) -> (f64, Vec<[f64; 4]>) {
    let path = cascade::tip_path(actuations, unit_mm, units);
    let by_point = signed_area_gradient(&path);
    let gradient = actuations
        .iter()
        .zip(&by_point[1..])
        .map(|(transform, by_tip)| {
            let (_, by_entry) = cascade::tip_gradient(transform, unit_mm, units);
            by_entry.map(|d| by_tip[0] * d[0] + by_tip[1] * d[1])
        })
        .collect();
    (signed_area(&path), gradient)
}

#[cfg(test)]
mod tests {
    use super::*;

    const UNIT: [f64; 2] = [80.0, 80.0];
    const BENT: [[f64; 4]; 3] = [
        [1.02, -0.05, 0.01, 1.01],
        [1.07, 0.01, 0.02, 1.03],
        [1.01, 0.06, -0.03, 0.99],
    ];

    fn transforms(entries: &[[f64; 4]]) -> Vec<LinearTransform> {
        entries.iter().map(LinearTransform::from_slice).collect()
    }

    #[test]
    fn one_actuation_encloses_nothing_and_two_do() {
        assert_eq!(area(&[], UNIT, 9).0, 0.0);
        for entries in BENT {
            for units in [1, 2, 3, 8, 9] {
                let one = transforms(&[entries]);
                let tip = cascade::tip_path(&one, UNIT, units);
                let moved = (tip[1][0] - tip[0][0]).hypot(tip[1][1] - tip[0][1]);
                assert!(area(&one, UNIT, units).0.abs() < 1e-15 * moved * moved);
                // There and back along the same states encloses nothing either.
                let path: Vec<LinearTransform> = [0.3, 0.7, 1.0, 0.7, 0.3]
                    .iter()
                    .map(|f| LinearTransform::IDENTITY.towards(&one[0], *f))
                    .collect();
                assert!(area(&path, UNIT, units).0.abs() < 1e-12 * moved * moved);
            }
        }
        let two = transforms(&BENT[..2]);
        let tips = cascade::tip_path(&two, UNIT, 9);
        let moved = (tips[1][0] - tips[0][0]).hypot(tips[1][1] - tips[0][1]);
        assert!(area(&two, UNIT, 9).0.abs() > 0.1 * moved * moved);
    }

    #[test]
    fn the_order_of_the_actuations_gives_the_sign() {
        let two = transforms(&BENT[..2]);
        let (there, _) = area(&two, UNIT, 9);
        let (back, _) = area(&[two[1], two[0]], UNIT, 9);
        assert!((there + back).abs() < 1e-12 * there.abs() && there != 0.0);
        // Up, then out: clockwise about the tip at rest.
        let up = LinearTransform::from_slice(&[1.0, 0.0, 0.1, 1.0]);
        let out = LinearTransform::from_slice(&[1.1, 0.0, 0.0, 1.0]);
        let (clockwise, _) = area(&[up, out], UNIT, 2);
        assert!((clockwise + 0.5 * 16.0 * 16.0).abs() < 1e-10);
    }

    #[test]
    fn the_gradient_is_that_of_differences() {
        let (_, gradient) = area(&transforms(&BENT), UNIT, 9);
        for actuation in 0..3 {
            for entry in 0..4 {
                let at = |step: f64| {
                    let mut moved = BENT;
                    moved[actuation][entry] += step;
                    area(&transforms(&moved), UNIT, 9).0
                };
                let exact = gradient[actuation][entry];
                let best = [1e-4, 1e-5, 1e-6]
                    .map(|h| ((at(h) - at(-h)) / (2.0 * h) / exact - 1.0).abs())
                    .into_iter()
                    .fold(f64::INFINITY, f64::min);
                assert!(best < 1e-7, "{actuation} {entry}: {best:e}");
            }
        }
    }
}
