//! What the geometry says of a design: its constraints, and whether another design would be meshed alike.

use super::error::StudyError;
use super::spec::{ChamberConstraints, StepConstraints, Study};
use crate::geometry::validity::{SPIKE_ANGLE_DEG, Validity};
use crate::geometry::{Actuator, LayoutBoxes, MeshPlan, PlanElement};
use crate::scene::ElementChoice;

/// A plan serves designs whose corners are within this fraction of the unit's smaller side (2 mm of 80) of its base.
const PLAN_REACH: f64 = 0.025;

/// Constraint values and their derivatives d/dx, one row each.
pub type GeometryRows = (Vec<f64>, Vec<Vec<f64>>);

impl Study {
    /// Geometric constraints of a design, feasible when <= 0: spike rows, then wall rows, of hexagons then centre rows,
    /// with their derivatives d/dx. Their number depends on the layout alone.
    pub fn geometry_rows(&self, step: usize, x: &[f64]) -> Result<GeometryRows, StudyError> {
        let values = self.geometry_values(step, x)?;
        let actuator = self.actuator(step, x)?;
        let gradients = self
            .validity(step, &actuator)?
            .rows()
            .map(|row| self.design_gradient(step, x, &row.design_gradient(&actuator)))
            .collect::<Result<_, _>>()?;
        Ok((values, gradients))
    }

    /// The values of [`Study::geometry_rows`] alone.
    pub fn geometry_values(&self, step: usize, x: &[f64]) -> Result<Vec<f64>, StudyError> {
        let validity = self.validity(step, &self.actuator(step, x)?)?;
        // Rows are given for the default angle; another one shifts them.
        let least = self.chamber_constraints(step)?.spike_deg;
        let shift = SPIKE_ANGLE_DEG.to_radians().cos() - least.to_radians().cos();
        let spikes = validity.spikes.iter().map(|row| row.value + shift);
        let walls = validity.walls.iter().map(|row| row.value);
        let centres = validity.centres.iter().map(|row| row.value);
        Ok(spikes.chain(walls).chain(centres).collect())
    }

    fn chamber_constraints(&self, step: usize) -> Result<&ChamberConstraints, StudyError> {
        match &self.step(step)?.constraints {
            StepConstraints::Chambers(constraints) => Ok(constraints),
            StepConstraints::Counts { .. } => Err(StudyError::NoChambers { step }),
        }
    }

    pub(super) fn validity(
        &self,
        step: usize,
        actuator: &Actuator,
    ) -> Result<Validity, StudyError> {
        let constraints = self.chamber_constraints(step)?;
        let (body, ..) = self.chambers(step)?;
        let boxes = LayoutBoxes {
            wall_mm: constraints.wall_mm,
            ..body.actuator.boxes()
        };
        Ok(Validity::in_boxes(actuator, &boxes))
    }

    /// The mesh plan of a finite-element step for a plan base: what [`super::EvaluationRequest::plan_base`] stands for.
    /// `None` where the base itself cannot be planned.
    pub fn mesh_plan(
        &self,
        step: usize,
        plan_base: &[f64],
    ) -> Result<Option<MeshPlan>, StudyError> {
        let actuator = self.actuator(step, plan_base)?;
        let (_, _, model) = self.chambers(step)?;
        let element = match model.element {
            ElementChoice::Quad4 => PlanElement::Quad4,
            ElementChoice::Auto | ElementChoice::Quad9 => PlanElement::Quad9,
        };
        Ok(MeshPlan::choose(&actuator, element, model.mesh().size()).ok())
    }

    /// Whether a corner of one design is so far from that of another that the second may have a mesh plan of its own.
    pub(super) fn is_far(&self, step: usize, from: &[f64], to: &[f64]) -> Result<bool, StudyError> {
        let (body, _, _) = self.chambers(step)?;
        let [w, h] = body.actuator.unit_mm;
        let from = self.corners(step, from)?;
        let moved = self
            .corners(step, to)?
            .iter()
            .zip(&from)
            .map(|(a, b)| (a - b).abs())
            .fold(0.0, f64::max);
        Ok(moved > PLAN_REACH * w.min(h))
    }

    /// Whether the plan of the base may stay in use for an iterate: it gives the same element counts, or no corner has
    /// moved far from the base, or the iterate has no plan of its own. Without the second clause nearly every iteration
    /// would change the plan (counts change about every 3 % of the way through the boxes), and no run would ever settle.
    pub(super) fn plan_serves(
        &self,
        step: usize,
        plan_base: &[f64],
        iterate: &[f64],
    ) -> Result<bool, StudyError> {
        if !self.is_far(step, plan_base, iterate)? {
            return Ok(true);
        }
        Ok(
            match (
                self.mesh_plan(step, plan_base)?,
                self.mesh_plan(step, iterate)?,
            ) {
                (Some(a), Some(b)) => a.same_counts(&b),
                (_, None) => true,
                (None, Some(_)) => false,
            },
        )
    }
}
