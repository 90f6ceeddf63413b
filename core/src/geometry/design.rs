//! The design vector (Eq. 2 of the paper): [x1, y1, x2, y2, ...], the corners of a unit's chambers in the unit's own
//! coordinates, chamber after chamber. A list of free units has their vectors one after the other.

use super::chamber_layout::VARIABLES_PER_CHAMBER;
use super::{Point, Unit};

/// Units of quadrilateral chambers from a design vector with a number of variables for each; `None` if its length is not a
/// positive multiple of that, or that not of a chamber's eight.
pub fn units_of_design(x: &[f64], variables_per_unit: usize) -> Option<Vec<Unit>> {
    let whole = |n: usize, of: usize| n > 0 && of > 0 && n.is_multiple_of(of);
    if !whole(x.len(), variables_per_unit) || !whole(variables_per_unit, VARIABLES_PER_CHAMBER) {
        return None;
    }
    let chamber = |x: &[f64]| x.chunks_exact(2).map(|p| [p[0], p[1]]).collect();
    Some(
        x.chunks_exact(variables_per_unit)
            .map(|x| Unit {
                chambers_mm: x.chunks_exact(VARIABLES_PER_CHAMBER).map(chamber).collect(),
            })
            .collect(),
    )
}

/// The design vector of units: all corners in order.
pub fn design_of_units(units: &[Unit]) -> Vec<f64> {
    units
        .iter()
        .flat_map(|u| u.chambers_mm.iter().flatten().flatten().copied())
        .collect()
}

/// A gradient per unit, chamber and corner as one over the design vector: summed over the units where they are copies.
pub fn design_gradient(corners: &[Vec<Vec<Point>>], repeated: bool) -> Vec<f64> {
    let unit = |u: &Vec<Vec<Point>>| u.iter().flatten().flatten().copied().collect::<Vec<f64>>();
    if !repeated {
        return corners.iter().flat_map(unit).collect();
    }
    let mut sum: Vec<f64> = vec![];
    for u in corners.iter().map(unit) {
        sum.resize(u.len(), 0.0);
        for (s, g) in sum.iter_mut().zip(u) {
            *s += g;
        }
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn units_and_vectors_go_both_ways() {
        let x: Vec<f64> = (0..48).map(f64::from).collect();
        let units = units_of_design(&x[..32], 16).unwrap();
        assert_eq!(units.len(), 2);
        assert_eq!(units[1].chambers_mm[1][3], [30.0, 31.0]);
        assert_eq!(design_of_units(&units), x[..32]);
        for (length, of_unit) in [(15, 16), (0, 16), (16, 0), (12, 12)] {
            assert!(units_of_design(&x[..length], of_unit).is_none());
        }
        let gradient = [units[0].chambers_mm.clone(), units[1].chambers_mm.clone()];
        assert_eq!(design_gradient(&gradient, false), x[..32]);
        assert_eq!(design_gradient(&gradient, true)[1], 18.0);
        let triples = units_of_design(&x, 24).unwrap();
        assert_eq!(triples[1].chambers_mm[2][3], [46.0, 47.0]);
        assert_eq!(design_of_units(&triples), x);
    }
}
