//! Design vectors of a study: bounds and names, the actuator and the scene of a design, its geometric constraints.

use std::borrow::Cow;

use super::error::StudyError;
use super::read::Bounds;
use super::spec::{
    AccuracyDesign, FeModel, Parametrisation, StepConstraints, Study, StudyActuator, StudyBody,
    StudyStep, Variables,
};
use crate::fault::Faults;
use crate::geometry::{Actuator, ChamberCorners, LayoutBoxes, Point, cascade};
use crate::scene::measure::{Bound, Goal, Measure};
use crate::scene::{ActuatorBody, Body, Orientation, Probe, Scene};

/// Name of a target's probe in the scenes of a study.
pub const TIP: &str = "tip";

/// The variables of a step.
#[derive(Clone, Debug, PartialEq)]
pub struct DesignVariables {
    /// Lower bounds.
    pub lower: Vec<f64>,
    /// Upper bounds.
    pub upper: Vec<f64>,
    /// Names, for tables.
    pub names: Vec<String>,
}

impl StudyActuator {
    /// The boxes of its chambers.
    pub fn boxes(&self) -> LayoutBoxes {
        LayoutBoxes {
            layout: self.layout,
            corners: self.corners,
            unit_mm: self.unit_mm,
            wall_mm: self.wall_mm,
            clearance_mm: self.centre_clearance_mm,
        }
    }
}

impl Variables {
    /// Whether they are the letters of a sequence of units.
    pub fn are_letters(&self) -> bool {
        let sequence = Parametrisation::Sequence;
        matches!(self, Self::Chambers { parametrisation, .. } if *parametrisation == sequence)
    }

    /// Corners of each chamber where the step has its own number of them.
    pub fn corners(&self) -> Option<ChamberCorners> {
        match self {
            Self::Chambers { corners, .. } => *corners,
            Self::Bounds { .. } => None,
        }
    }

    /// Bounds; `None` where they depend on an actuator that is not there, or on what other steps give. `direct`: all its units are free.
    pub(super) fn bounds(&self, body: Option<&StudyBody>, direct: bool) -> Option<Bounds> {
        match self {
            Self::Bounds { lower, upper } => Some((lower.clone(), upper.clone())),
            Self::Chambers {
                parametrisation, ..
            } => {
                let actuator = &body?.actuator;
                let mut boxes = actuator.boxes();
                boxes.corners = self.corners().unwrap_or(boxes.corners);
                let [lower, upper] = match parametrisation {
                    Parametrisation::Corners => {
                        let units = if direct { actuator.units } else { 1 };
                        boxes.bounds().map(|of_unit| of_unit.repeat(units))
                    }
                    Parametrisation::Rectangle => boxes.rectangle_bounds().map(Vec::from),
                    // The alphabet is that of the step.
                    Parametrisation::Sequence => return None,
                };
                Some((lower, upper))
            }
        }
    }
}

/// `x1`, `y1`, ...; with several free units `unit1.x1`, ...
fn corner_names(units: usize, variables_per_unit: usize) -> Vec<String> {
    let of_unit = || (1..=variables_per_unit / 2).flat_map(|k| [format!("x{k}"), format!("y{k}")]);
    if units == 1 {
        return of_unit().collect();
    }
    (1..=units)
        .flat_map(|unit| of_unit().map(move |name| format!("unit{unit}.{name}")))
        .collect()
}

impl Study {
    /// A step.
    pub fn step(&self, step: usize) -> Result<&StudyStep, StudyError> {
        self.steps.get(step).ok_or(StudyError::NoSuchStep {
            step,
            steps: self.steps.len(),
        })
    }

    /// Bounds and names of a step's variables.
    pub fn variables(&self, step: usize) -> Result<DesignVariables, StudyError> {
        let s = self.step(step)?;
        let body = self.body_of(step)?;
        let (lower, upper) = if s.variables.are_letters() {
            let units = self.free_units(step)?;
            let last = self.letters(step)?.saturating_sub(1) as f64;
            (vec![0.0; units], vec![last; units])
        } else {
            s.variables
                .bounds(body.as_deref(), s.model.is_direct())
                .ok_or(StudyError::NoChambers { step })?
        };
        let names = match s.variables {
            Variables::Bounds { .. } => (1..=lower.len()).map(|k| format!("x{k}")).collect(),
            Variables::Chambers {
                parametrisation, ..
            } => match parametrisation {
                Parametrisation::Corners => {
                    let units = self.free_units(step)?;
                    corner_names(units, lower.len() / units)
                }
                Parametrisation::Rectangle => vec!["width".into(), "height".into()],
                Parametrisation::Sequence => (1..=lower.len())
                    .map(|unit| format!("unit{unit}"))
                    .collect(),
            },
        };
        Ok(DesignVariables {
            lower,
            upper,
            names,
        })
    }

    /// The shared part as a step has it: with its own numbers of units and of corners, with the layout that it was given. `None` where every
    /// step is a program.
    ///
    /// # Errors
    /// Where the study has no such step.
    pub fn body_of(&self, step: usize) -> Result<Option<Cow<'_, StudyBody>>, StudyError> {
        let s = self.step(step)?;
        let Some(body) = &self.body else {
            return Ok(None);
        };
        let units = s.model.units().unwrap_or(body.actuator.units);
        let layout = s.given.layout.unwrap_or(body.actuator.layout);
        let corners = s.variables.corners().unwrap_or(body.actuator.corners);
        let of_body = &body.actuator;
        if (units, layout, corners) == (of_body.units, of_body.layout, of_body.corners) {
            return Ok(Some(Cow::Borrowed(body)));
        }
        let mut body = body.clone();
        body.actuator.units = units;
        body.actuator.layout = layout;
        body.actuator.corners = corners;
        Ok(Some(Cow::Owned(body)))
    }

    /// The shared part and the settings of a finite-element step.
    pub(super) fn chambers(
        &self,
        step: usize,
    ) -> Result<(Cow<'_, StudyBody>, &StudyStep, &FeModel), StudyError> {
        let s = self.step(step)?;
        match (self.body_of(step)?, s.model.finite_elements()) {
            (Some(body), Some(model)) => Ok((body, s, model)),
            _ => Err(StudyError::NoChambers { step }),
        }
    }

    /// Number of units that a design describes one by one; one where all units are copies of it.
    pub fn free_units(&self, step: usize) -> Result<usize, StudyError> {
        let (body, s, _) = self.chambers(step)?;
        Ok(if s.model.is_direct() {
            body.actuator.units
        } else {
            1
        })
    }

    /// Chamber corners `[x1, y1, ...]` of a design, of each free unit.
    pub fn corners(&self, step: usize, x: &[f64]) -> Result<Vec<f64>, StudyError> {
        let (body, parametrisation) = self.parametrisation(step)?;
        let wrong = |expected: usize| StudyError::Length {
            step,
            expected,
            found: x.len(),
        };
        match (parametrisation, x) {
            (Parametrisation::Rectangle, [width, height]) => {
                Ok(body.actuator.boxes().rectangles([*width, *height]))
            }
            (Parametrisation::Rectangle, _) => Err(wrong(2)),
            (Parametrisation::Sequence, x) => self.corners_of_sequence(step, x),
            (Parametrisation::Corners, x) => {
                let expected = body.actuator.boxes().variables() * self.free_units(step)?;
                if x.len() == expected {
                    Ok(x.to_vec())
                } else {
                    Err(wrong(expected))
                }
            }
        }
    }

    fn parametrisation(
        &self,
        step: usize,
    ) -> Result<(Cow<'_, StudyBody>, Parametrisation), StudyError> {
        let (body, s, _) = self.chambers(step)?;
        match s.variables {
            Variables::Chambers {
                parametrisation, ..
            } => Ok((body, parametrisation)),
            Variables::Bounds { .. } => Err(StudyError::NoChambers { step }),
        }
    }

    /// The chain of units of a design.
    pub fn actuator(&self, step: usize, x: &[f64]) -> Result<Actuator, StudyError> {
        let corners = self.corners(step, x)?;
        let (body, s, _) = self.chambers(step)?;
        let unit_mm = body.actuator.unit_mm;
        let corner_radius_mm = body.actuator.corner_radius_mm;
        let units = body.actuator.boxes().units(&corners).unwrap_or_default();
        if s.model.is_direct() {
            return Ok(Actuator {
                unit_mm,
                units,
                repeated: false,
                corner_radius_mm,
            });
        }
        let unit = units.first().ok_or(StudyError::NoChambers { step })?;
        Ok(Actuator {
            corner_radius_mm,
            ..cascade(unit, unit_mm, body.actuator.units)
        })
    }

    /// The probes of a step: first the tip, which is the point that the target follows, else the middle of the end face;
    /// then the other points of its target and bounds.
    pub fn probes(&self, step: usize) -> Result<Vec<Probe>, StudyError> {
        let (body, s, _) = self.chambers(step)?;
        let StepConstraints::Chambers(constraints) = &s.constraints else {
            return Err(StudyError::NoChambers { step });
        };
        let target = s.target.as_ref().ok_or(StudyError::NoChambers { step })?;
        let [w, h] = body.actuator.unit_mm;
        let end_face = [w * body.actuator.units as f64, h / 2.0];
        let mut points = vec![*target.goal.measure.tip().unwrap_or(&end_face)];
        let measures = constraints.bounds.iter().map(|b| &b.measure);
        for probe in [&target.goal.measure]
            .into_iter()
            .chain(measures)
            .flat_map(Measure::probes)
        {
            if !points.contains(probe) {
                points.push(*probe);
            }
        }
        let probe = |(k, at_mm)| Probe {
            name: if k == 0 {
                TIP.into()
            } else {
                format!("probe-{k}")
            },
            at_mm,
        };
        Ok(points.into_iter().enumerate().map(probe).collect())
    }

    /// The scene that one evaluation solves. Its chamber i is driven by channel i, as in every scene, so that its schedule has
    /// one pressure per chamber.
    pub fn scene(
        &self,
        step: usize,
        x: &[f64],
        orientation: Option<Orientation>,
    ) -> Result<Scene, StudyError> {
        let actuator = self.actuator(step, x)?;
        let (body, s, model) = self.chambers(step)?;
        let probes = self.probes(step)?;
        let target = s.target.as_ref().ok_or(StudyError::NoChambers { step })?;
        let name = |at: &Point| probes.iter().find(|p| p.at_mm == *at);
        let measure = target
            .goal
            .measure
            .map_probes(|at| Some(name(at)?.name.clone()));
        let mut measure = measure.ok_or(StudyError::NoChambers { step })?;
        if let (Measure::EnclosedArea { orientation: o, .. }, Some(sense)) =
            (&mut measure, orientation)
        {
            *o = sense;
        }
        let objective = Some(Goal {
            measure,
            sense: target.goal.sense,
        });
        Ok(Scene {
            body: Body::Actuator(ActuatorBody {
                materials: body.material.laws(actuator.units.len()),
                actuator,
            }),
            actuation: body.actuator.layout.schedule(&body.actuation),
            mesh: model.mesh(),
            contact: model.contact,
            contact_activation_mm: model.contact_activation_mm,
            obstacles: Vec::new(),
            relative_residual_force_tolerance: model.relative_residual_force_tolerance,
            probes,
            objective,
        })
    }

    /// d/dx of a quantity from its derivative with respect to the chamber corners, `[x1, y1, ...]`, of the repeated unit or
    /// of each free one.
    pub fn design_gradient(
        &self,
        step: usize,
        x: &[f64],
        corner_gradient: &[f64],
    ) -> Result<Vec<f64>, StudyError> {
        let corners = self.corners(step, x)?;
        if corner_gradient.len() != corners.len() {
            return Err(StudyError::Length {
                step,
                expected: corners.len(),
                found: corner_gradient.len(),
            });
        }
        let (body, parametrisation) = self.parametrisation(step)?;
        Ok(match parametrisation {
            Parametrisation::Corners => corner_gradient.to_vec(),
            Parametrisation::Sequence => return Err(StudyError::Discrete { step }),
            Parametrisation::Rectangle => {
                let mut gradient = vec![0.0; 2];
                for (g, row) in corner_gradient
                    .iter()
                    .zip(body.actuator.boxes().rectangle_jacobian())
                {
                    gradient[0] += g * row[0];
                    gradient[1] += g * row[1];
                }
                gradient
            }
        })
    }

    /// Number of constraint values of a step: of a finite-element model the geometric rows of its free units and, with a
    /// stretch limit, one row per chamber corner of a unit, with a limit of the gap one per chamber of a unit, and one per
    /// end of each bound.
    pub fn constraint_count(&self, step: usize) -> Result<usize, StudyError> {
        let s = self.step(step)?;
        match &s.constraints {
            StepConstraints::Counts {
                inequalities,
                equalities,
            } => Ok(inequalities + equalities),
            StepConstraints::Chambers(constraints) => {
                let (body, _, _) = self.chambers(step)?;
                let boxes = body.actuator.boxes();
                let corners = boxes.variables() / 2;
                let stretch = body.stretch_limit(constraints).map_or(0, |_| corners);
                let margin = constraints.load_margin.number().map_or(0, |_| stretch);
                let gaps = constraints
                    .wall_gap_mm
                    .number()
                    .map_or(0, |_| boxes.chambers());
                let bounds: usize = constraints.bounds.iter().map(Bound::rows).sum();
                Ok(self.geometric_rows(step)? + stretch + margin + gaps + bounds)
            }
        }
    }

    /// The design that stands for a step where its mesh is chosen for an error: its first given start, else the middle of
    /// its bounds.
    pub fn accuracy_design(&self, step: usize) -> Result<(AccuracyDesign, Vec<f64>), StudyError> {
        if let Some(given) = self.step(step)?.restarts.points.first() {
            return Ok((AccuracyDesign::Given, given.clone()));
        }
        let variables = self.variables(step)?;
        let ends = variables.lower.iter().zip(&variables.upper);
        let middle = ends.map(|(a, b)| f64::midpoint(*a, *b)).collect();
        Ok((AccuracyDesign::Middle, middle))
    }

    /// A fault for each step whose mesh has still to be chosen for an error.
    pub fn unchosen_meshes(&self) -> Faults {
        let mut faults = Faults::default();
        for (i, step) in self.steps.iter().enumerate() {
            let model = step.model.finite_elements();
            if model.is_some_and(FeModel::is_unchosen) {
                faults.add(
                    format!("step[{i}].model.mesh"),
                    "an error is turned into element and size before a study is submitted, by salp run and salp submit, which have the solver: send what they choose, or max_size_mm",
                );
            }
        }
        faults
    }

    fn geometric_rows(&self, step: usize) -> Result<usize, StudyError> {
        let start = self.paper_start(step)?;
        Ok(self.geometry_values(step, &start)?.len())
    }

    /// A void of twice the centre clearance (1 x 1 mm in the paper) at the centre of every chamber's domain; of sequences the
    /// first letter everywhere.
    pub(super) fn paper_start(&self, step: usize) -> Result<Vec<f64>, StudyError> {
        let (body, parametrisation) = self.parametrisation(step)?;
        Ok(match parametrisation {
            Parametrisation::Corners => {
                let of_unit = body.actuator.boxes().common_start();
                of_unit.repeat(self.free_units(step)?)
            }
            Parametrisation::Rectangle => vec![2.0 * body.actuator.centre_clearance_mm; 2],
            Parametrisation::Sequence => vec![0.0; self.free_units(step)?],
        })
    }
}
