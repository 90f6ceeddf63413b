//! A unit as a piece of a planar rod with constant strains (Selig 2005, Geometric Fundamentals of Robotics, ch. 5; Renda et al. 2018,
//! IEEE Trans. Robot. 34, 1518-1533).
//!
//! Along the axis, s from 0 to the unit's width w, the frame turns by kappa ds and advances by (1 + epsilon) ds along itself and
//! gamma ds across. The right edge is then at exp of the twist (v, omega) = w (1 + epsilon, gamma, kappa) in the frame of the left one:
//! turned by omega and moved by
//!
//! t = [[a, -b], [b, a]] v,   a = sin omega / omega,   b = (1 - cos omega) / omega.
//!
//! N equal units are exp of N times the twist: their tip is on one arc. Every pose with |omega| < pi has strains of its own
//! ([`Strain::of_pose`]), so a unit's pose in FE is kept exactly; what the rod adds is its shape between the edges.

use serde::{Deserialize, Serialize};

use super::{Frame, LinearTransform};
use crate::geometry::Point;
use crate::geometry::polygon::{signed_area, signed_area_gradient};

/// Turns below which the functions of omega are taken from their series.
const SMALL: f64 = 1e-2;

/// Strains of a unit: constant along it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Strain {
    /// Turn per length of the axis at rest, 1/mm; counter-clockwise positive.
    pub curvature_per_mm: f64,
    /// Extension of the axis.
    pub extension: f64,
    /// Advance across the axis, per length at rest.
    pub shear: f64,
}

/// a, b and their derivatives at omega.
fn arc(omega: f64) -> [f64; 4] {
    let square = omega * omega;
    if omega.abs() < SMALL {
        // To order 6, beyond which nothing is left at this size.
        let a = 1.0 - square / 6.0 * (1.0 - square / 20.0 * (1.0 - square / 42.0));
        let b = 0.5 * omega * (1.0 - square / 12.0 * (1.0 - square / 30.0));
        let slope_a = -omega / 3.0 * (1.0 - square / 10.0 * (1.0 - square / 28.0));
        let slope_b = 0.5 - square / 8.0 * (1.0 - square / 18.0 * (1.0 - square / 40.0));
        return [a, b, slope_a, slope_b];
    }
    let (sine, cosine) = omega.sin_cos();
    let half = (0.5 * omega).sin();
    let (a, b) = (sine / omega, 2.0 * half * half / omega);
    [a, b, (cosine - a) / omega, (sine - b) / omega]
}

impl Strain {
    /// `[curvature (1/mm), extension, shear]`.
    pub fn parts(&self) -> [f64; 3] {
        [self.curvature_per_mm, self.extension, self.shear]
    }

    /// From `[curvature (1/mm), extension, shear]`.
    pub fn from_parts([curvature_per_mm, extension, shear]: [f64; 3]) -> Self {
        Self {
            curvature_per_mm,
            extension,
            shear,
        }
    }

    /// The strains that lead to a pose of the right edge in the left one's frame: its middle (mm) and its turn (rad, less than pi).
    pub fn of_pose(middle_mm: Point, turn_rad: f64, width_mm: f64) -> Self {
        let half = 0.5 * turn_rad;
        // (omega / 2) cot(omega / 2)
        let along = if half.abs() < SMALL {
            let square = half * half;
            1.0 - square / 3.0 * (1.0 + square / 15.0 * (1.0 + 2.0 * square / 21.0))
        } else {
            half / half.tan()
        };
        let [x, y] = middle_mm;
        Self {
            curvature_per_mm: turn_rad / width_mm,
            extension: (along * x + half * y) / width_mm - 1.0,
            shear: (along * y - half * x) / width_mm,
        }
    }

    /// The strains of the pose of a transformation's right edge.
    pub fn of_transform(transform: &LinearTransform, width_mm: f64) -> Self {
        Self::of_pose(
            transform.apply([width_mm, 0.0]),
            transform.turn_rad(),
            width_mm,
        )
    }

    /// Where a piece of `length_mm` ends in the frame of its beginning.
    pub fn pose(&self, length_mm: f64) -> Frame {
        let [along, across] = [1.0 + self.extension, self.shear].map(|v| v * length_mm);
        let omega = self.curvature_per_mm * length_mm;
        let [a, b, ..] = arc(omega);
        Frame {
            origin_mm: [a * along - b * across, b * along + a * across],
            turn_rad: omega,
        }
    }

    /// The transformation whose right edge has the same pose and its length at rest.
    pub fn transform(&self, width_mm: f64) -> LinearTransform {
        let pose = self.pose(width_mm);
        let (sine, cosine) = pose.turn_rad.sin_cos();
        let [x, y] = pose.origin_mm;
        LinearTransform::from_slice(&[x / width_mm, -sine, y / width_mm, cosine])
    }

    /// The strains of the unit upside down.
    #[must_use]
    pub fn mirrored(&self) -> Self {
        Self {
            curvature_per_mm: -self.curvature_per_mm,
            shear: -self.shear,
            ..*self
        }
    }
}

impl Frame {
    /// The frame at the end of a piece that begins in this one.
    #[must_use]
    pub fn after(&self, piece: &Frame) -> Self {
        Self {
            origin_mm: self.place(piece.origin_mm),
            turn_rad: self.turn_rad + piece.turn_rad,
        }
    }
}

/// The frames of a chain's edges, from `start` to the right end: one more than there are units.
pub fn rod_frames(start: Frame, chain: &[Strain], width_mm: f64) -> Vec<Frame> {
    let mut frames = vec![start];
    for strain in chain {
        let last = frames[frames.len() - 1];
        frames.push(last.after(&strain.pose(width_mm)));
    }
    frames
}

/// The middle of the right edge of the last of `units` equal units on the clamped end, mm, with its derivatives by
/// `[curvature, extension, shear]`.
pub fn rod_tip(strain: &Strain, unit_mm: [f64; 2], units: usize) -> (Point, [Point; 3]) {
    let length = unit_mm[0] * units as f64;
    let [along, across] = [1.0 + strain.extension, strain.shear].map(|v| v * length);
    let [a, b, slope_a, slope_b] = arc(strain.curvature_per_mm * length);
    let tip = [a * along - b * across, b * along + a * across];
    let by_turn = [
        slope_a * along - slope_b * across,
        slope_b * along + slope_a * across,
    ];
    (
        [tip[0], tip[1] + 0.5 * unit_mm[1]],
        [
            by_turn.map(|d| d * length),
            [a * length, b * length],
            [-b * length, a * length],
        ],
    )
}

/// The signed area of the closed path rest, actuation 1, ..., actuation K, rest of the tip of `units` equal units, mm^2,
/// counter-clockwise positive, with its derivatives by the three strains of each actuation.
pub fn rod_area(
    actuations: &[Strain],
    unit_mm: [f64; 2],
    units: usize,
) -> (f64, Vec<[f64; 3]>, Vec<Point>) {
    let rest = rod_tip(&Strain::default(), unit_mm, units).0;
    let (tips, slopes): (Vec<Point>, Vec<[Point; 3]>) = actuations
        .iter()
        .map(|strain| rod_tip(strain, unit_mm, units))
        .unzip();
    let path: Vec<Point> = std::iter::once(rest).chain(tips).collect();
    let by_point = signed_area_gradient(&path);
    let gradient = slopes
        .iter()
        .zip(&by_point[1..])
        .map(|(slopes, by_tip)| slopes.map(|d| by_tip[0] * d[0] + by_tip[1] * d[1]))
        .collect();
    (signed_area(&path), gradient, path)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::PI;

    const UNIT: [f64; 2] = [80.0, 80.0];
    const BENT: [[f64; 3]; 4] = [
        [2e-3, 0.03, -0.01],
        [-1e-3, 0.08, 0.04],
        [1e-7, -0.02, 0.02],
        [0.015, 0.0, 0.3],
    ];

    fn near(a: Point, b: Point, slack: f64) -> bool {
        (a[0] - b[0]).hypot(a[1] - b[1]) <= slack
    }

    #[test]
    fn the_exponential_is_that_of_the_matrix() {
        // exp of [[0, -w, x], [w, 0, y], [0, 0, 0]] by its series, against the closed form.
        for parts in BENT {
            let strain = Strain::from_parts(parts);
            let pose = strain.pose(80.0);
            let (w, v) = (parts[0] * 80.0, [(1.0 + parts[1]) * 80.0, parts[2] * 80.0]);
            let (mut term, mut sum) = (v, v);
            for k in 2..30 {
                term = [-w * term[1], w * term[0]].map(|t| t / f64::from(k));
                sum = [sum[0] + term[0], sum[1] + term[1]];
            }
            assert!(near(pose.origin_mm, sum, 1e-12), "{parts:?}");
        }
        // Pure bending is an arc of radius 1 / kappa, pure shear and extension a straight line.
        let quarter = Strain::from_parts([0.5 * PI / 80.0, 0.0, 0.0]).pose(80.0);
        let radius = 160.0 / PI;
        assert!(near(quarter.origin_mm, [radius, radius], 1e-12));
        let straight = Strain::from_parts([0.0, 0.25, 0.5]).pose(80.0);
        assert!(near(straight.origin_mm, [100.0, 40.0], 1e-12));
    }

    #[test]
    fn strains_and_poses_lead_back_to_each_other() {
        for parts in BENT {
            let pose = Strain::from_parts(parts).pose(80.0);
            let back = Strain::of_pose(pose.origin_mm, pose.turn_rad, 80.0).parts();
            let transform = Strain::from_parts(parts).transform(80.0);
            let through = Strain::of_transform(&transform, 80.0).parts();
            for ((a, c), b) in back.iter().zip(through).zip(parts) {
                assert!((a - b).abs() < 1e-14, "{parts:?} {back:?}");
                assert!((c - b).abs() < 1e-14, "{parts:?} {through:?}");
            }
        }
    }

    #[test]
    fn equal_units_are_one_arc_and_series_meet_the_closed_forms() {
        for parts in BENT {
            let strain = Strain::from_parts(parts);
            for units in [1, 2, 9] {
                let chain = rod_frames(Frame::clamped(UNIT), &vec![strain; units], UNIT[0]);
                let tip = rod_tip(&strain, UNIT, units).0;
                assert!(near(chain[units].origin_mm, tip, 1e-10), "{parts:?}");
            }
        }
        let (below, above) = (arc(SMALL * (1.0 - 1e-12)), arc(SMALL * (1.0 + 1e-12)));
        for (a, b) in below.iter().zip(above) {
            assert!((a - b).abs() < 1e-12, "{a} {b}");
        }
    }

    #[test]
    fn a_chain_on_a_moved_end_is_the_moved_chain() {
        let chain = BENT.map(Strain::from_parts);
        let moved = Frame {
            origin_mm: [13.0, -7.0],
            turn_rad: 0.9,
        };
        let at_rest = rod_frames(Frame::clamped([0.0; 2]), &chain, 80.0);
        for (frame, expected) in rod_frames(moved, &chain, 80.0).iter().zip(&at_rest) {
            assert!(near(
                frame.origin_mm,
                moved.place(expected.origin_mm),
                1e-11
            ));
            assert!((frame.turn_rad - expected.turn_rad - 0.9).abs() < 1e-14);
        }
    }

    #[test]
    fn a_mirrored_unit_has_the_mirrored_chain_and_the_opposite_area() {
        let chain = BENT.map(Strain::from_parts);
        let mirrored = chain.map(|s| s.mirrored());
        let of = |chain: &[Strain]| rod_frames(Frame::clamped(UNIT), chain, UNIT[0]);
        for (a, b) in of(&chain).iter().zip(of(&mirrored)) {
            let upside_down = [b.origin_mm[0], UNIT[1] - b.origin_mm[1]];
            assert!(near(a.origin_mm, upside_down, 1e-11));
        }
        let (there, back) = (rod_area(&chain, UNIT, 9).0, rod_area(&mirrored, UNIT, 9).0);
        assert!((there + back).abs() < 1e-9 * there.abs() && there != 0.0);
    }

    #[test]
    fn the_area_under_a_bending_rod_is_its_closed_form() {
        // The tip (sin t / t, (1 - cos t) / t) of a rod of length 1 from t = 0 to pi, closed by a straight line, encloses
        // Si(pi) / 2 - 2 / pi.
        let expected = 0.5 * 1.851_937_051_982_466_2 - 2.0 / PI;
        let error = |states: usize| {
            let bent = |i| Strain::from_parts([PI * i as f64 / states as f64, 0.0, 0.0]);
            let path: Vec<Strain> = (1..=states).map(bent).collect();
            (rod_area(&path, [1.0, 0.0], 1).0 - expected).abs()
        };
        let (coarse, fine) = (error(100), error(200));
        assert!(
            fine < 1e-5 && (coarse / fine - 4.0).abs() < 0.01,
            "{coarse} {fine}"
        );
        // One strain alone, there and back, encloses nothing.
        let bent = |f: f64| Strain::from_parts([f * 0.01, f * 0.1, 0.0]);
        let there_and_back = [0.3, 0.7, 1.0, 0.7, 0.3].map(bent);
        assert!(rod_area(&there_and_back, UNIT, 9).0.abs() < 1e-9);
    }

    #[test]
    fn the_gradient_is_that_of_differences() {
        let (_, gradient, _) = rod_area(&BENT.map(Strain::from_parts), UNIT, 9);
        for actuation in 0..4 {
            for part in 0..3 {
                let at = |step: f64| {
                    let mut moved = BENT;
                    moved[actuation][part] += step;
                    rod_area(&moved.map(Strain::from_parts), UNIT, 9).0
                };
                let exact = gradient[actuation][part];
                let unit = if part == 0 { 1e-2 } else { 1.0 };
                let best = [1e-4, 1e-5, 1e-6]
                    .map(|h| h * unit)
                    .map(|h| ((at(h) - at(-h)) / (2.0 * h) / exact - 1.0).abs())
                    .into_iter()
                    .fold(f64::INFINITY, f64::min);
                assert!(best < 1e-6, "{actuation} {part}: {best:e}");
            }
        }
    }
}
