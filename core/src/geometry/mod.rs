//! Units, chambers, their cascade, and what makes a design valid. Lengths in mm.

mod unit;

pub use unit::{Actuator, InfeasibleGeometry, Point, Unit};
