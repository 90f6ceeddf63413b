//! Names of a step's constraint rows, in their order.

use super::error::StudyError;
use super::spec::{StepConstraints, Study};
use crate::scene::measure::Bound;

impl Study {
    /// A name for each constraint value of a step, for reports; chambers and corners count from 1.
    pub fn constraint_names(&self, step: usize) -> Result<Vec<String>, StudyError> {
        let constraints = match &self.step(step)?.constraints {
            StepConstraints::Counts {
                inequalities,
                equalities,
            } => {
                let inequalities = (1..=*inequalities).map(|k| format!("inequality {k}"));
                let equalities = (1..=*equalities).map(|k| format!("equality {k}"));
                return Ok(inequalities.chain(equalities).collect());
            }
            StepConstraints::Chambers(constraints) => constraints,
        };
        let (body, ..) = self.chambers(step)?;
        let mut names = self.geometry_names(step)?;
        let boxes = body.actuator.boxes();
        let corners = boxes.variables() / 2;
        if body.stretch_limit(constraints).is_some() {
            let each = boxes.corners.count();
            let name = |k| format!("stretch: chamber {}, corner {}", k / each + 1, k % each + 1);
            names.extend((0..corners).map(name));
            if let Some(factor) = constraints.load_margin.number() {
                let name = |k| format!("at {factor} times the load, {}", name(k));
                names.extend((0..corners).map(name));
            }
        }
        if constraints.wall_gap_mm.number().is_some() {
            names.extend(
                (1..=boxes.chambers()).map(|k| format!("gap of facing walls: chamber {k}")),
            );
        }
        for bound in &constraints.bounds {
            let end = |at_least: Option<f64>, at_most: Option<f64>| {
                let one = Bound {
                    measure: bound.measure.clone(),
                    at_least,
                    at_most,
                };
                format!("bound: {}", one.words())
            };
            names.extend(bound.at_least.map(|v| end(Some(v), None)));
            names.extend(bound.at_most.map(|v| end(None, Some(v))));
        }
        Ok(names)
    }

    fn geometry_names(&self, step: usize) -> Result<Vec<String>, StudyError> {
        let actuator = self.actuator(step, &self.paper_start(step)?)?;
        let validity = self.validity(step, &actuator)?;
        // Where all units are copies the row of one speaks for all.
        let name = |name: String| {
            if actuator.repeated {
                name.replace("unit 1, ", "")
            } else {
                name
            }
        };
        Ok(validity.rows().map(|row| name(row.name())).collect())
    }
}
