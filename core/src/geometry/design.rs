//! The design vector (Eq. 2 of the paper): [x1, y1, x2, y2, ...], the corners of a unit's chambers in the unit's own
//! coordinates, chamber after chamber. A list of free units has their vectors one after the other.

use super::{ChamberCorners, LayoutBoxes, Point, Unit, polygon};

impl LayoutBoxes {
    /// Units from a design vector; `None` if its length is not a positive multiple of a unit's number of variables.
    pub fn units(&self, x: &[f64]) -> Option<Vec<Unit>> {
        if x.is_empty() || !x.len().is_multiple_of(self.variables()) {
            return None;
        }
        let chamber = |x: &[f64]| x.chunks_exact(2).map(|p| [p[0], p[1]]).collect();
        let unit = |x: &[f64]| Unit {
            chambers_mm: x
                .chunks_exact(self.variables_per_chamber())
                .map(chamber)
                .collect(),
        };
        Some(x.chunks_exact(self.variables()).map(unit).collect())
    }

    /// The design of a unit of the same layout with these boxes' corners: quadrilaterals become hexagons of the same shape, the
    /// new corners in the middle of their lower and upper sides. `None` where it cannot be had.
    pub fn with_these_corners(&self, unit: &[f64]) -> Option<Vec<f64>> {
        if unit.len() == self.variables() {
            return Some(unit.to_vec());
        }
        let quadrilaterals = Self {
            corners: ChamberCorners::Four,
            ..*self
        };
        if unit.len() != quadrilaterals.variables() {
            return None;
        }
        let units = quadrilaterals.units(unit)?;
        let chambers = units.iter().flat_map(|unit| &unit.chambers_mm);
        let corners = chambers.flat_map(|chamber| {
            let edges = polygon::edges(chamber).enumerate();
            edges.flat_map(|(edge, (a, b))| {
                let middle = [0, 1].map(|c| f64::midpoint(a[c], b[c]));
                let own = if edge % 2 == 0 {
                    vec![a, middle]
                } else {
                    vec![a]
                };
                own.into_iter().flatten()
            })
        });
        Some(corners.collect())
    }
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
    use crate::geometry::Layout;
    use crate::geometry::samples::Stratum;

    #[test]
    fn units_and_vectors_go_both_ways() {
        let x: Vec<f64> = (0..48).map(f64::from).collect();
        let pair = LayoutBoxes::PAPER;
        let units = pair.units(&x[..32]).unwrap();
        assert_eq!(units.len(), 2);
        assert_eq!(units[1].chambers_mm[1][3], [30.0, 31.0]);
        assert_eq!(design_of_units(&units), x[..32]);
        for length in [0, 15, 24] {
            assert!(pair.units(&x[..length]).is_none());
        }
        let gradient = [units[0].chambers_mm.clone(), units[1].chambers_mm.clone()];
        assert_eq!(design_gradient(&gradient, false), x[..32]);
        assert_eq!(design_gradient(&gradient, true)[1], 18.0);
        let three = LayoutBoxes {
            layout: Layout::ThreeChambers,
            ..pair
        };
        let triples = three.units(&x).unwrap();
        assert_eq!(triples[1].chambers_mm[2][3], [46.0, 47.0]);
        assert_eq!(design_of_units(&triples), x);
        let hexagons = LayoutBoxes {
            corners: ChamberCorners::Six,
            ..pair
        };
        let sixes = hexagons.units(&x).unwrap();
        assert_eq!(sixes[1].chambers_mm[1][5], [46.0, 47.0]);
        assert_eq!(design_of_units(&sixes), x);
    }

    #[test]
    fn a_quadrilateral_is_a_hexagon_of_the_same_shape_within_its_boxes() {
        for (name, layout) in Layout::NAMES {
            let four = LayoutBoxes {
                layout,
                ..LayoutBoxes::PAPER
            };
            let six = LayoutBoxes {
                corners: ChamberCorners::Six,
                ..four
            };
            assert_eq!(
                six.with_these_corners(&four.rectangles([30.0, 9.0])),
                Some(six.rectangles([30.0, 9.0]))
            );
            let [lower, upper] = six.bounds();
            for index in 0..200 {
                let x = Stratum::NearBounds.design(&four, 7, index);
                let y = six.with_these_corners(&x).unwrap();
                assert!(
                    (0..y.len()).all(|k| lower[k] <= y[k] && y[k] <= upper[k]),
                    "{name}"
                );
                let area = |boxes: &LayoutBoxes, x: &[f64]| -> f64 {
                    let chambers = boxes.units(x).unwrap().remove(0).chambers_mm;
                    chambers.iter().map(|c| polygon::signed_area(c)).sum()
                };
                assert!((area(&four, &x) - area(&six, &y)).abs() < 1e-9);
                assert_eq!(six.with_these_corners(&y), Some(y));
                assert_eq!(four.with_these_corners(&x[1..]), None);
            }
            assert_eq!(four.with_these_corners(&six.common_start()), None);
        }
    }
}
