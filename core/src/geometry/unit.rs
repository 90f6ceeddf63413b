//! A chain of units with chambers.

use serde::{Deserialize, Serialize};

use super::Rounded;

/// A point in the plane, mm.
pub type Point = [f64; 2];

/// A chain of units along x; unit k (from 0) spans [k w, (k + 1) w] x [0, h]; the edge x = 0 is fixed.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Actuator {
    /// Width w and height h of a unit.
    pub unit_mm: [f64; 2],
    /// The units from the clamped end. Chamber i of every unit is driven by channel i.
    pub units: Vec<Unit>,
    /// Whether all units are copies of the first, so that a gradient sums over them.
    pub repeated: bool,
    /// Radius of the chambers' corners, mm; 0: sharp. It shrinks where it does not fit (see [`super::Rounded`]).
    #[serde(default, skip_serializing_if = "is_zero")]
    pub corner_radius_mm: f64,
}

#[expect(clippy::trivially_copy_pass_by_ref, reason = "what serde asks for")]
fn is_zero(radius: &f64) -> bool {
    *radius == 0.0
}

impl Actuator {
    /// A chamber with its corners rounded.
    pub fn rounded(&self, unit: usize, chamber: usize) -> Rounded {
        Rounded::new(
            &self.units[unit].chambers_mm[chamber],
            self.corner_radius_mm,
        )
    }
}

/// One unit: its chambers are counter-clockwise simple polygons in the unit's own coordinates.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Unit {
    /// Chamber corners, mm.
    pub chambers_mm: Vec<Vec<Point>>,
}

/// Why a valid document cannot be meshed.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, thiserror::Error)]
#[serde(tag = "reason", rename_all = "snake_case")]
pub enum InfeasibleGeometry {
    /// A layout that the mesher does not know.
    #[error("unsupported layout in unit {unit}: {detail}")]
    UnsupportedLayout {
        /// Unit, from 0.
        unit: usize,
        /// What is not supported.
        detail: String,
    },
    /// The mesh plan cannot follow this design.
    #[error("the mesh folds in unit {unit}: scaled corner Jacobian {scaled_jacobian}")]
    MeshFolds {
        /// Unit, from 0.
        unit: usize,
        /// The smallest scaled corner Jacobian that was reached.
        scaled_jacobian: f64,
    },
}
