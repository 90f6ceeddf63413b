//! What makes a design valid, as rows of inequalities with exact derivatives: no spikes (g1) and no thin walls (g2).
//!
//! - Spike, one row per corner: cos(interior angle) - cos(3 deg) <= 0, the cosine that of the two rays that leave the
//!   corner, so straight and reflex corners pass.
//! - Wall, two kinds of rows of 1 - t / t_min <= 0: two per corner to the outline of its unit (the nearer of left and
//!   right, the nearer of bottom and top), and one per corner and other chamber of its unit to that chamber's edges; t
//!   is negative outside the unit or inside the other chamber.
//!   Both directions together hold the least distance of two chambers. Chambers of neighbouring units need no rows:
//!   their distance is at least the sum of both distances to the common face.
//!
//! - Centre, of chambers that their boxes alone do not keep simple: one row per edge of 1 - d / d_min <= 0, d the distance
//!   of the domain's centre from the edge's line, negative on its right, d_min half the clearance of the corners from the
//!   centre lines. The boundary then runs once round the centre, as that of every quadrilateral in the boxes does.
//!
//! The number and order of the rows depend on the layout alone. Lengths in mm; rows have no unit, slopes 1/mm.

use super::polygon::{self, PointSegment};
use super::{Actuator, ChamberCorners, LayoutBoxes, Point};

/// Smallest interior angle of a corner, degrees.
pub const SPIKE_ANGLE_DEG: f64 = 3.0;

/// What a row speaks of; indices from 0.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ValidityKind {
    /// The interior angle at the corner.
    Spike,
    /// The wall between the corner and the outline of its unit.
    OutlineWall {
        /// 0: to the left or right side; 1: to the bottom or top.
        axis: usize,
    },
    /// The wall between the corner and another chamber of its unit.
    ChamberWall {
        /// The other chamber.
        other: usize,
    },
    /// Where the edge from the corner to the next leaves the centre of the chamber's domain.
    Centre,
}

/// d value / d (position of a corner).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CornerSlope {
    /// Unit.
    pub unit: usize,
    /// Chamber.
    pub chamber: usize,
    /// Corner.
    pub corner: usize,
    /// Slope, 1/mm.
    pub slope: Point,
}

/// One inequality, feasible when its value is <= 0.
#[derive(Clone, Debug, PartialEq)]
pub struct ValidityRow {
    /// What it speaks of.
    pub kind: ValidityKind,
    /// Unit.
    pub unit: usize,
    /// Chamber.
    pub chamber: usize,
    /// Corner.
    pub corner: usize,
    /// Value.
    pub value: f64,
    /// Its derivatives; corners that are not named have none.
    pub gradient: Vec<CornerSlope>,
}

impl ValidityRow {
    /// A name for people, counting from 1.
    pub fn name(&self) -> String {
        let place = format!(
            "unit {}, chamber {}, corner {}",
            self.unit + 1,
            self.chamber + 1,
            self.corner + 1
        );
        match self.kind {
            ValidityKind::Spike => format!("spike: {place}"),
            ValidityKind::OutlineWall { axis: 0 } => format!("wall: {place} to left or right"),
            ValidityKind::OutlineWall { .. } => format!("wall: {place} to bottom or top"),
            ValidityKind::ChamberWall { other } => {
                format!("wall: {place} to chamber {}", other + 1)
            }
            ValidityKind::Centre => format!("edge round the centre: {place} to the next"),
        }
    }

    /// The gradient over a design vector that holds all corners in order (see [`super::design_of_units`]).
    pub fn design_gradient(&self, actuator: &Actuator) -> Vec<f64> {
        let units = if actuator.repeated {
            1
        } else {
            actuator.units.len()
        };
        let mut starts = vec![];
        let mut total = 0;
        for unit in &actuator.units[..units] {
            let mut of_unit = vec![];
            for chamber in &unit.chambers_mm {
                of_unit.push(total);
                total += 2 * chamber.len();
            }
            starts.push(of_unit);
        }
        let mut gradient = vec![0.0; total];
        for s in &self.gradient {
            let at = starts[s.unit][s.chamber] + 2 * s.corner;
            gradient[at] += s.slope[0];
            gradient[at + 1] += s.slope[1];
        }
        gradient
    }
}

/// The rows of a design.
#[derive(Clone, Debug, PartialEq)]
pub struct Validity {
    /// Spike rows.
    pub spikes: Vec<ValidityRow>,
    /// Wall rows.
    pub walls: Vec<ValidityRow>,
    /// Centre rows.
    pub centres: Vec<ValidityRow>,
}

impl Validity {
    /// All rows of an actuator for a least wall t_min; of the first unit alone where all are copies.
    pub fn of(actuator: &Actuator, least_wall_mm: f64) -> Self {
        let units = if actuator.repeated {
            1
        } else {
            actuator.units.len()
        };
        let (mut spikes, mut walls) = (vec![], vec![]);
        for (u, unit) in actuator.units[..units].iter().enumerate() {
            for (c, corners) in unit.chambers_mm.iter().enumerate() {
                for k in 0..corners.len() {
                    let row =
                        |kind, (value, slopes): (f64, Vec<(usize, usize, Point)>)| ValidityRow {
                            kind,
                            unit: u,
                            chamber: c,
                            corner: k,
                            value,
                            gradient: slopes
                                .into_iter()
                                .map(|(chamber, corner, slope)| CornerSlope {
                                    unit: u,
                                    chamber,
                                    corner,
                                    slope,
                                })
                                .collect(),
                        };
                    spikes.push(row(ValidityKind::Spike, spike(c, corners, k)));
                    for axis in 0..2 {
                        let p = corners[k][axis];
                        let (value, slope) = outline_wall(p, actuator.unit_mm[axis], least_wall_mm);
                        let mut slopes = [0.0; 2];
                        slopes[axis] = slope;
                        walls.push(row(
                            ValidityKind::OutlineWall { axis },
                            (value, vec![(c, k, slopes)]),
                        ));
                    }
                    for (other, edges) in unit.chambers_mm.iter().enumerate() {
                        if other != c {
                            walls.push(row(
                                ValidityKind::ChamberWall { other },
                                chamber_wall((c, k, corners[k]), (other, edges), least_wall_mm),
                            ));
                        }
                    }
                }
            }
        }
        Self {
            spikes,
            walls,
            centres: vec![],
        }
    }

    /// The same of chambers in their boxes, for their least wall; with the centre rows where the boxes need them.
    pub fn in_boxes(actuator: &Actuator, boxes: &LayoutBoxes) -> Self {
        let mut validity = Self::of(actuator, boxes.wall_mm);
        if boxes.corners == ChamberCorners::Four {
            return validity;
        }
        let units = if actuator.repeated {
            1
        } else {
            actuator.units.len()
        };
        let centres = boxes.centres();
        for (unit, of_unit) in actuator.units[..units].iter().enumerate() {
            let chambers = of_unit.chambers_mm.iter().zip(&centres).enumerate();
            for (chamber, (corners, centre)) in chambers {
                for (corner, (a, b)) in polygon::edges(corners).enumerate() {
                    let (value, slopes) = centre_row(*centre, [a, b], 0.5 * boxes.clearance_mm);
                    let ends = [corner, (corner + 1) % corners.len()];
                    let slope = |k: usize| CornerSlope {
                        unit,
                        chamber,
                        corner: ends[k],
                        slope: slopes[k],
                    };
                    validity.centres.push(ValidityRow {
                        kind: ValidityKind::Centre,
                        unit,
                        chamber,
                        corner,
                        value,
                        gradient: vec![slope(0), slope(1)],
                    });
                }
            }
        }
        validity
    }

    /// All rows: spikes, walls, centres.
    pub fn rows(&self) -> impl Iterator<Item = &ValidityRow> {
        self.spikes.iter().chain(&self.walls).chain(&self.centres)
    }

    /// g1, the largest spike value; -2 without corners.
    pub fn g1(&self) -> f64 {
        self.spikes.iter().map(|r| r.value).fold(-2.0, f64::max)
    }

    /// g2, the largest wall value; minus infinity without chambers.
    pub fn g2(&self) -> f64 {
        self.walls
            .iter()
            .map(|r| r.value)
            .fold(f64::NEG_INFINITY, f64::max)
    }

    /// g3, the largest centre value; minus infinity where there are none.
    pub fn g3(&self) -> f64 {
        let centres = self.centres.iter().map(|r| r.value);
        centres.fold(f64::NEG_INFINITY, f64::max)
    }
}

/// 1 - d / least and its slopes by both ends of an edge, d the distance of a point from the edge's line, positive to its left.
fn centre_row(point: Point, [a, b]: [Point; 2], least: f64) -> (f64, [Point; 2]) {
    let (u, v) = (polygon::difference(point, a), polygon::difference(point, b));
    let edge = polygon::difference(a, b);
    let length = edge[0].hypot(edge[1]).max(f64::MIN_POSITIVE);
    let distance = polygon::cross(u, v) / length;
    // d cross / d u = (v1, -v0), d cross / d v = (-u1, u0); d length / d b = edge / length.
    let turn = [0, 1].map(|c| distance * edge[c] / (length * length));
    let of_a = [v[1] / length + turn[0], -v[0] / length + turn[1]];
    let of_b = [-u[1] / length - turn[0], u[0] / length - turn[1]];
    let slopes = [of_a, of_b].map(|slope| slope.map(|s| -s / least));
    (1.0 - distance / least, slopes)
}

fn spike(chamber: usize, corners: &[Point], k: usize) -> (f64, Vec<(usize, usize, Point)>) {
    let n = corners.len();
    let (next, before) = ((k + 1) % n, (k + n - 1) % n);
    let unit_ray = |to: usize| {
        let u = polygon::difference(corners[k], corners[to]);
        let length = u[0].hypot(u[1]).max(f64::MIN_POSITIVE);
        ([u[0] / length, u[1] / length], length)
    };
    let ((u, lu), (v, lv)) = (unit_ray(next), unit_ray(before));
    let cosine = u[0] * v[0] + u[1] * v[1];
    // d (u.v) / d (ray end) = (v - (u.v) u) / |ray|.
    let slope_next = [0, 1].map(|i| (v[i] - cosine * u[i]) / lu);
    let slope_before = [0, 1].map(|i| (u[i] - cosine * v[i]) / lv);
    let slope_own = [0, 1].map(|i| -slope_next[i] - slope_before[i]);
    (
        cosine - SPIKE_ANGLE_DEG.to_radians().cos(),
        vec![
            (chamber, before, slope_before),
            (chamber, k, slope_own),
            (chamber, next, slope_next),
        ],
    )
}

fn outline_wall(p: f64, size: f64, least: f64) -> (f64, f64) {
    if p <= size - p {
        (1.0 - p / least, -1.0 / least)
    } else {
        (1.0 - (size - p) / least, 1.0 / least)
    }
}

fn chamber_wall(
    (chamber, corner, p): (usize, usize, Point),
    (other, edges): (usize, &[Point]),
    least: f64,
) -> (f64, Vec<(usize, usize, Point)>) {
    let mut nearest: Option<(usize, PointSegment)> = None;
    for (edge, (a, b)) in polygon::edges(edges).enumerate() {
        let gap = PointSegment::new(p, a, b);
        if nearest.is_none_or(|(_, found)| gap.distance < found.distance) {
            nearest = Some((edge, gap));
        }
    }
    let Some((edge, gap)) = nearest else {
        return (f64::NEG_INFINITY, vec![]);
    };
    let sign = if polygon::contains(edges, p) {
        -1.0
    } else {
        1.0
    };
    let [own, start, end] = gap
        .derivatives()
        .map(|d| d.map(|component| -sign * component / least));
    (
        1.0 - sign * gap.distance / least,
        vec![
            (chamber, corner, own),
            (other, edge, start),
            (other, (edge + 1) % edges.len(), end),
        ],
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::samples::Stratum;
    use crate::geometry::{Layout, cascade, design_of_units};

    const SIX: LayoutBoxes = LayoutBoxes {
        corners: ChamberCorners::Six,
        ..LayoutBoxes::PAPER
    };

    fn in_boxes(boxes: &LayoutBoxes, x: &[f64]) -> Validity {
        let actuator = cascade(&boxes.units(x).unwrap()[0], [80.0, 80.0], 3);
        Validity::in_boxes(&actuator, boxes)
    }

    fn actuator(x: &[f64]) -> Actuator {
        cascade(&LayoutBoxes::PAPER.units(x).unwrap()[0], [80.0, 80.0], 3)
    }

    const SLANTED: [f64; 16] = [
        6.0, 6.0, 60.0, 12.0, 74.0, 34.0, 25.0, 30.0, 10.0, 48.0, 70.0, 44.0, 66.0, 74.0, 30.0,
        70.0,
    ];

    #[test]
    fn rows_have_exact_derivatives() {
        let rows = Validity::of(&actuator(&SLANTED), 2.0);
        assert_eq!((rows.spikes.len(), rows.walls.len()), (8, 24));
        let step = 1e-6;
        for (index, row) in rows.rows().enumerate() {
            let gradient = row.design_gradient(&actuator(&SLANTED));
            for k in 0..16 {
                let at = |sign: f64| {
                    let mut x = SLANTED;
                    x[k] += sign * step;
                    let moved = Validity::of(&actuator(&x), 2.0);
                    moved.rows().nth(index).unwrap().value
                };
                let difference = (at(1.0) - at(-1.0)) / (2.0 * step);
                assert!(
                    (difference - gradient[k]).abs() < 1e-8,
                    "{} {k}: {difference} {}",
                    row.name(),
                    gradient[k]
                );
            }
        }
    }

    #[test]
    fn rows_of_hexagons_have_exact_derivatives() {
        let mut slanted = SIX.with_these_corners(&SLANTED).unwrap();
        // No corner in line with its neighbours, where the nearest edge of a wall is two.
        for (k, value) in slanted.iter_mut().enumerate() {
            *value += 0.3 * (5.0 * k as f64).sin();
        }
        let rows = in_boxes(&SIX, &slanted);
        let counts = (rows.spikes.len(), rows.walls.len(), rows.centres.len());
        assert_eq!(counts, (12, 36, 12));
        let of = cascade(&SIX.units(&slanted).unwrap()[0], [80.0, 80.0], 3);
        let step = 1e-6;
        for (index, row) in rows.rows().enumerate() {
            let gradient = row.design_gradient(&of);
            for k in 0..24 {
                let at = |sign: f64| {
                    let mut x = slanted.clone();
                    x[k] += sign * step;
                    in_boxes(&SIX, &x).rows().nth(index).unwrap().value
                };
                let difference = (at(1.0) - at(-1.0)) / (2.0 * step);
                let off = (difference - gradient[k]).abs();
                assert!(
                    off < 1e-7,
                    "{} {k}: {difference} {}",
                    row.name(),
                    gradient[k]
                );
            }
        }
    }

    /// What the boxes keep of quadrilaterals the rows keep of hexagons.
    #[test]
    fn hexagons_that_keep_the_centre_rows_are_simple_and_quadrilaterals_keep_them() {
        let mut stream = crate::random::SplitMix64::new(3);
        let [lower, upper] = SIX.bounds();
        let (mut kept, mut crossing) = (0, 0);
        for _ in 0..2000 {
            let of_box = |k: usize, t: f64| lower[k] + (upper[k] - lower[k]) * t;
            let x: Vec<f64> = (0..24).map(|k| of_box(k, stream.next_unit())).collect();
            let chambers = SIX.units(&x).unwrap().remove(0).chambers_mm;
            let simple = chambers.iter().all(|c| polygon::is_simple(c));
            if in_boxes(&SIX, &x).g3() <= 0.0 {
                kept += 1;
                assert!(simple, "{x:?}");
            }
            crossing += usize::from(!simple);
        }
        assert!(kept > 200 && crossing > 20, "{kept} {crossing}");
        for (_, layout) in Layout::NAMES {
            let of = |corners| LayoutBoxes {
                layout,
                corners,
                ..SIX
            };
            let (four, six) = (of(ChamberCorners::Four), of(ChamberCorners::Six));
            for index in 0..300 {
                let x = Stratum::NearBounds.design(&four, 11, index);
                let same = six.with_these_corners(&x).unwrap();
                assert!(in_boxes(&six, &same).g3() < 0.0);
                assert_eq!(in_boxes(&four, &x).g3(), f64::NEG_INFINITY);
            }
            assert!(in_boxes(&six, &six.common_start()).g3() < -0.9);
        }
    }

    #[test]
    fn walls_of_the_widest_paper_design_are_exactly_at_the_limit() {
        let widest = [
            2.0, 2.0, 78.0, 2.0, 78.0, 39.0, 2.0, 39.0, 2.0, 41.0, 78.0, 41.0, 78.0, 78.0, 2.0,
            78.0,
        ];
        let rows = Validity::of(&actuator(&widest), 2.0);
        assert!(rows.g2().abs() < 1e-12);
        assert!((rows.g1() + SPIKE_ANGLE_DEG.to_radians().cos()).abs() < 1e-12);
        assert!((Validity::of(&actuator(&widest), 2.5).g2() - 0.2).abs() < 1e-12);
    }

    #[test]
    fn spikes_and_crossings_are_positive_reflex_corners_are_not() {
        let mut x = SLANTED;
        // A needle at corner 1 of the lower chamber: its neighbours nearly in line behind it.
        (x[0], x[1], x[2], x[3], x[6], x[7]) = (2.0, 20.0, 60.0, 20.0, 30.0, 20.5);
        assert!(Validity::of(&actuator(&x), 2.0).g1() > 0.0);
        let mut crossing = SLANTED;
        crossing[5] = 50.0;
        assert!(Validity::of(&actuator(&crossing), 2.0).g2() > 1.0);
        let mut reflex = SLANTED;
        (reflex[0], reflex[1]) = (39.0, 19.0);
        let rows = Validity::of(&actuator(&reflex), 2.0);
        assert!(rows.g1() <= 0.0);
        assert_eq!(design_of_units(&actuator(&reflex).units[..1]), reflex);
    }
}
