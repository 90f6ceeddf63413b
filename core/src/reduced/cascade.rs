//! Units in a chain: frames, corners for a picture, the tip and its derivatives.

use serde::{Deserialize, Serialize};

use super::LinearTransform;
use crate::geometry::Point;

/// A rigid frame: where the middle of a unit's left edge is, and how the unit is turned.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Frame {
    /// The origin in the scene's coordinates, mm.
    pub origin_mm: Point,
    /// The turn, counter-clockwise positive, rad.
    pub turn_rad: f64,
}

impl Frame {
    /// That of the clamped end: the middle of the left edge of unit 1, at (0, h/2).
    pub fn clamped(unit_mm: [f64; 2]) -> Self {
        Self {
            origin_mm: [0.0, 0.5 * unit_mm[1]],
            turn_rad: 0.0,
        }
    }

    /// A point of the frame in the scene's coordinates.
    pub fn place(&self, [x, y]: Point) -> Point {
        let (s, c) = self.turn_rad.sin_cos();
        [
            self.origin_mm[0] + c * x - s * y,
            self.origin_mm[1] + s * x + c * y,
        ]
    }

    /// A point of the scene in the frame.
    pub fn local(&self, p: Point) -> Point {
        let (s, c) = self.turn_rad.sin_cos();
        let [x, y] = [p[0] - self.origin_mm[0], p[1] - self.origin_mm[1]];
        [c * x + s * y, c * y - s * x]
    }

    /// The frame of the unit that follows one in this frame.
    #[must_use]
    pub fn next(&self, transform: &LinearTransform, unit_mm: [f64; 2]) -> Self {
        Self {
            origin_mm: self.place(transform.apply([unit_mm[0], 0.0])),
            turn_rad: self.turn_rad + transform.turn_rad(),
        }
    }
}

/// The frames of a chain's edges, from the clamped one to the right edge of the last unit: one more than there are units.
pub fn frames(chain: &[LinearTransform], unit_mm: [f64; 2]) -> Vec<Frame> {
    let mut frames = vec![Frame::clamped(unit_mm)];
    for (k, transform) in chain.iter().enumerate() {
        frames.push(frames[k].next(transform, unit_mm));
    }
    frames
}

/// Corners of each unit, counter-clockwise from its lower left, mm. The left-hand nodes of a unit are the right-hand ones of
/// the unit before, so that the picture is connected also where the edge has changed its length.
pub fn corners(chain: &[LinearTransform], unit_mm: [f64; 2]) -> Vec<[Point; 4]> {
    let [width, height] = unit_mm;
    let mut left = [[0.0, 0.0], [0.0, height]];
    chain
        .iter()
        .zip(frames(chain, unit_mm))
        .map(|(transform, frame)| {
            let right = [-0.5, 0.5].map(|y| frame.place(transform.apply([width, y * height])));
            let unit = [left[0], right[0], right[1], left[1]];
            left = right;
            unit
        })
        .collect()
}

/// The middle of the right edge of the last unit of a chain, mm.
pub fn tip(chain: &[LinearTransform], unit_mm: [f64; 2]) -> Point {
    let clamped = Frame::clamped(unit_mm);
    let last = chain.iter().fold(clamped, |f, t| f.next(t, unit_mm));
    last.origin_mm
}

/// The same of `units` equal units.
pub fn tip_of(transform: &LinearTransform, unit_mm: [f64; 2], units: usize) -> Point {
    tip_gradient(transform, unit_mm, units).0
}

/// The same with its derivatives by `[x_scl, x_sh, y_sh, y_scl]`.
///
/// With t = w (x_scl, y_sh) and R the rotation by the turn phi = atan2(-x_sh, y_scl), the tip is at
/// (0, h/2) + sum_k R^k t, k = 0..units, and d phi = (-y_scl d x_sh + x_sh d y_scl) / (x_sh^2 + y_scl^2).
pub fn tip_gradient(
    transform: &LinearTransform,
    unit_mm: [f64; 2],
    units: usize,
) -> (Point, [Point; 4]) {
    let [width, height] = unit_mm;
    let phi = transform.turn_rad();
    let t = transform.apply([width, 0.0]);
    let mut tip = [0.0, 0.5 * height];
    let (mut by_scale, mut by_rise, mut by_turn) = ([0.0; 2], [0.0; 2], [0.0; 2]);
    for k in 0..units {
        let turns = k as f64;
        let (s, c) = (turns * phi).sin_cos();
        let arm = [c * t[0] - s * t[1], s * t[0] + c * t[1]];
        for (i, (scale, rise, turn)) in [(c, -s, -arm[1]), (s, c, arm[0])].into_iter().enumerate() {
            tip[i] += arm[i];
            by_scale[i] += width * scale;
            by_rise[i] += width * rise;
            by_turn[i] += turns * turn;
        }
    }
    let squared = transform.x_sh.powi(2) + transform.y_scl.powi(2);
    let slopes = if squared > 0.0 {
        [-transform.y_scl / squared, transform.x_sh / squared]
    } else {
        [0.0; 2]
    };
    let [by_shear, by_height] = slopes.map(|slope| by_turn.map(|d| slope * d));
    (tip, [by_scale, by_shear, by_rise, by_height])
}

/// The closed path of the tip of `units` equal units: at rest, then after each actuation; the way back is implied.
pub fn tip_path(actuations: &[LinearTransform], unit_mm: [f64; 2], units: usize) -> Vec<Point> {
    std::iter::once(&LinearTransform::IDENTITY)
        .chain(actuations)
        .map(|transform| tip_of(transform, unit_mm, units))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    const UNIT: [f64; 2] = [80.0, 60.0];

    fn close(a: Point, b: Point, tolerance: f64) {
        let distance = (a[0] - b[0]).hypot(a[1] - b[1]);
        assert!(distance < tolerance, "{a:?} {b:?}");
    }

    #[test]
    fn a_chain_at_rest_is_straight() {
        let chain = [LinearTransform::IDENTITY; 9];
        assert_eq!(tip(&chain, UNIT), [720.0, 30.0]);
        let unit = corners(&chain, UNIT)[8];
        assert_eq!(unit, [[640., 0.], [720., 0.], [720., 60.], [640., 60.]]);
    }

    /// Units that turn by phi with an arm along their half turn lie on a circle of radius w / (2 sin(phi / 2)).
    #[test]
    fn equal_turns_make_a_circle() {
        let phi = 0.2_f64;
        let (s, c) = phi.sin_cos();
        let (rise, run) = (0.5 * phi).sin_cos();
        let transform = LinearTransform::from_slice(&[run, -s, rise, c]);
        let radius = UNIT[0] / (2.0 * rise);
        for units in 0..20 {
            let angle = units as f64 * phi;
            let expected = [radius * angle.sin(), 30.0 + radius * (1.0 - angle.cos())];
            close(tip_of(&transform, UNIT, units), expected, 1e-10);
            close(tip(&vec![transform; units], UNIT), expected, 1e-10);
        }
        let frame = *frames(&[transform; 9], UNIT).last().unwrap();
        assert!((frame.turn_rad - 9.0 * phi).abs() < 1e-14);
        close(frame.local(frame.place([3.0, -2.0])), [3.0, -2.0], 1e-12);
    }

    #[test]
    fn units_stay_connected_and_carry_their_own_transformations() {
        let chain = [
            LinearTransform::from_slice(&[1.05, -0.1, 0.02, 1.1]),
            LinearTransform::from_slice(&[0.97, 0.2, -0.05, 0.95]),
        ];
        let units = corners(&chain, UNIT);
        assert_eq!([units[0][1], units[0][2]], [units[1][0], units[1][3]]);
        // The tip is the middle of the last edge.
        let middle = [0, 1].map(|i| f64::midpoint(units[1][1][i], units[1][2][i]));
        close(middle, tip(&chain, UNIT), 1e-12);
        close(units[0][1], [84.0 + 3.0, 30.0 + 1.6 - 33.0], 1e-12);
    }

    #[test]
    fn derivatives_of_the_tip_are_those_of_differences() {
        let entries = [1.08, -0.13, 0.06, 0.94];
        let (_, slopes) = tip_gradient(&LinearTransform::from_slice(&entries), UNIT, 9);
        for k in 0..4 {
            let at = |step: f64| {
                let mut moved = entries;
                moved[k] += step;
                tip_of(&LinearTransform::from_slice(&moved), UNIT, 9)
            };
            let (ahead, behind) = (at(1e-6), at(-1e-6));
            for i in 0..2 {
                let difference = (ahead[i] - behind[i]) / 2e-6;
                assert!((difference - slopes[k][i]).abs() < 1e-5 * slopes[k][i].abs().max(1.0));
            }
        }
        let collapsed = LinearTransform::from_slice(&[1.0, 0.0, 0.0, 0.0]);
        let (tip, slopes) = tip_gradient(&collapsed, UNIT, 3);
        assert!(
            tip.iter()
                .chain(slopes.iter().flatten())
                .all(|v| v.is_finite())
        );
    }
}
