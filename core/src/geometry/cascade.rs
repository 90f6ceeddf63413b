//! The cascade: copies of one unit in a chain.

use super::{Actuator, Unit};

/// n copies of a unit, its corners sharp.
pub fn cascade(unit: &Unit, unit_mm: [f64; 2], n: usize) -> Actuator {
    Actuator {
        unit_mm,
        units: vec![unit.clone(); n],
        repeated: true,
        corner_radius_mm: 0.0,
    }
}
