//! Rigid obstacles: outlines that do not deform and may travel with a channel.

use serde::{Deserialize, Serialize};

use super::Point;

/// A rigid obstacle.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Obstacle {
    /// Its name, for its resultant force.
    pub name: String,
    /// Its outline where it starts, mm.
    #[serde(flatten)]
    pub outline: Outline,
    /// Displacement at the full value of the channel, mm.
    pub travel_mm: Point,
    /// The channel with which a travel ramps.
    pub channel: usize,
}

/// The outline of an obstacle; both sides of it repel.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "shape", rename_all = "snake_case")]
pub enum Outline {
    /// A straight wall from one point to another.
    Line {
        /// Its ends, mm.
        points_mm: [Point; 2],
    },
    /// A closed polygon.
    Polygon {
        /// Its corners, mm.
        points_mm: Vec<Point>,
    },
    /// A circle.
    Circle {
        /// Its centre, mm.
        centre_mm: Point,
        /// Its radius, mm.
        radius_mm: f64,
    },
}

/// A smooth part of an outline.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Side {
    /// A straight segment.
    Straight([Point; 2]),
    /// A whole circle.
    Circle {
        /// Its centre, mm.
        centre: Point,
        /// Its radius, mm.
        radius: f64,
    },
}

impl Obstacle {
    /// The parts of the outline.
    pub fn sides(&self) -> Vec<Side> {
        match &self.outline {
            Outline::Line { points_mm } => vec![Side::Straight(*points_mm)],
            Outline::Polygon { points_mm } => {
                let n = points_mm.len();
                let side = |k: usize| Side::Straight([points_mm[k], points_mm[(k + 1) % n]]);
                (0..n).map(side).collect()
            }
            Outline::Circle {
                centre_mm,
                radius_mm,
            } => vec![Side::Circle {
                centre: *centre_mm,
                radius: *radius_mm,
            }],
        }
    }
}

impl Side {
    /// Its length, mm.
    pub fn length(&self) -> f64 {
        match self {
            Self::Straight([a, b]) => (b[0] - a[0]).hypot(b[1] - a[1]),
            Self::Circle { radius, .. } => std::f64::consts::TAU * radius,
        }
    }

    /// The point at a share of its length.
    pub fn point(&self, share: f64) -> Point {
        match self {
            Self::Straight([a, b]) => std::array::from_fn(|i| a[i] + share * (b[i] - a[i])),
            Self::Circle { centre, radius } => {
                let (sin, cos) = (std::f64::consts::TAU * share).sin_cos();
                [centre[0] + radius * cos, centre[1] + radius * sin]
            }
        }
    }
}
