//! The transformation of Eq. 1.

use serde::{Deserialize, Serialize};

use crate::geometry::Point;

/// `[[x_scl, x_sh], [y_sh, y_scl]]`, applied to points relative to the middle of a unit's left edge.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct LinearTransform {
    /// Scale along x: what the unit's length becomes.
    pub x_scl: f64,
    /// Shear of x by y: minus the tangent of the turn of the right edge, where y_scl is 1.
    pub x_sh: f64,
    /// Shear of y by x: the rise of the right edge's middle per length.
    pub y_sh: f64,
    /// Scale along y: what the right edge's height becomes.
    pub y_scl: f64,
}

/// One of the four.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Entry {
    /// Scale along x.
    XScl,
    /// Shear of x by y.
    XSh,
    /// Shear of y by x.
    YSh,
    /// Scale along y.
    YScl,
}

impl Entry {
    /// In the order of the slices.
    pub const ALL: [Self; 4] = [Self::XScl, Self::XSh, Self::YSh, Self::YScl];

    /// The paper's symbol.
    pub fn symbol(self) -> &'static str {
        ["x_scl", "x_sh", "y_sh", "y_scl"][self as usize]
    }
}

impl LinearTransform {
    /// A unit at rest.
    pub const IDENTITY: Self = Self {
        x_scl: 1.0,
        x_sh: 0.0,
        y_sh: 0.0,
        y_scl: 1.0,
    };

    /// From `[x_scl, x_sh, y_sh, y_scl]`.
    pub fn from_slice(entries: &[f64; 4]) -> Self {
        let [x_scl, x_sh, y_sh, y_scl] = *entries;
        Self {
            x_scl,
            x_sh,
            y_sh,
            y_scl,
        }
    }

    /// `[x_scl, x_sh, y_sh, y_scl]`.
    pub fn entries(&self) -> [f64; 4] {
        [self.x_scl, self.x_sh, self.y_sh, self.y_scl]
    }

    /// The transformed point.
    pub fn apply(&self, [x, y]: Point) -> Point {
        [
            self.x_scl * x + self.x_sh * y,
            self.y_sh * x + self.y_scl * y,
        ]
    }

    /// The turn of the right edge, counter-clockwise positive, rad. An edge that shrinks to a point is not turned.
    pub fn turn_rad(&self) -> f64 {
        (-self.x_sh).atan2(self.y_scl)
    }

    /// A fraction of the way to another.
    #[must_use]
    pub fn towards(&self, other: &Self, fraction: f64) -> Self {
        let (a, b) = (self.entries(), other.entries());
        Self::from_slice(&std::array::from_fn(|i| a[i] + fraction * (b[i] - a[i])))
    }

    /// How far another moves the two right-hand nodes of a unit from where this one does: the larger distance, mm.
    pub fn node_distance_mm(&self, other: &Self, [width, height]: [f64; 2]) -> f64 {
        let moved = |y: f64| {
            let (a, b) = (self.apply([width, y]), other.apply([width, y]));
            (a[0] - b[0]).hypot(a[1] - b[1])
        };
        moved(-0.5 * height).max(moved(0.5 * height))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn entries_act_as_in_the_paper() {
        let t = LinearTransform::from_slice(&[1.1, 0.2, -0.3, 0.9]);
        assert_eq!(t.entries(), [1.1, 0.2, -0.3, 0.9]);
        assert_eq!(t.apply([10.0, 0.0]), [11.0, -3.0]);
        assert_eq!(t.apply([0.0, 10.0]), [2.0, 9.0]);
        assert_eq!(LinearTransform::IDENTITY.apply([3.0, -4.0]), [3.0, -4.0]);
        let names: Vec<String> = Entry::ALL
            .iter()
            .map(|e| serde_json::to_string(e).unwrap())
            .collect();
        for (name, entry) in names.iter().zip(Entry::ALL) {
            assert_eq!(name.trim_matches('"'), entry.symbol());
        }
    }

    #[test]
    fn the_edge_turns_clockwise_where_its_upper_node_moves_ahead() {
        let angle = 0.3_f64;
        let (s, c) = angle.sin_cos();
        let rotation = LinearTransform::from_slice(&[c, -s, s, c]);
        assert!((rotation.turn_rad() - angle).abs() < 1e-15);
        let ahead = LinearTransform::from_slice(&[1.0, 0.1, 0.0, 1.0]);
        assert!(ahead.turn_rad() < 0.0);
    }
}
