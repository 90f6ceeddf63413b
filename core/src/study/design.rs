//! Design vectors of a study: bounds and names, the actuator and the scene of a design, its geometric constraints.

use super::error::StudyError;
use super::read_optimiser::Bounds;
use super::spec::{
    FeCascade, Model, Parametrisation, StepConstraints, Study, StudyActuator, StudyBody, StudyStep,
    Target, Variables,
};
use crate::geometry::{Actuator, Point, Unit};
use crate::scene::{ActuatorBody, Body, MeshRequest, Orientation, Probe, Scene, SceneObjective};

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

/// Lower left and upper right corner of each chamber's domain in a unit, mm.
pub(super) fn domains(actuator: &StudyActuator) -> [[Point; 2]; 2] {
    let ([w, h], t) = (actuator.unit_mm, actuator.wall_mm);
    [
        [[t, t], [w - t, h / 2.0 - t / 2.0]],
        [[t, h / 2.0 + t / 2.0], [w - t, h - t]],
    ]
}

impl Variables {
    /// Bounds; `None` where they depend on an actuator that is not there.
    pub(super) fn bounds(&self, body: Option<&StudyBody>) -> Option<Bounds> {
        match self {
            Self::Bounds { lower, upper } => Some((lower.clone(), upper.clone())),
            Self::Chambers { parametrisation } => {
                let actuator = &body?.actuator;
                Some(match parametrisation {
                    Parametrisation::Corners => corner_bounds(actuator),
                    Parametrisation::Rectangle => rectangle_bounds(actuator),
                })
            }
        }
    }
}

/// Each corner lives in its own quadrant of its chamber's domain, clear of the domain's centre lines.
fn corner_bounds(actuator: &StudyActuator) -> Bounds {
    let clear = actuator.centre_clearance_mm;
    let (mut lower, mut upper) = (Vec::new(), Vec::new());
    for [[x0, y0], [x1, y1]] in domains(actuator) {
        let (cx, cy) = (f64::midpoint(x0, x1), f64::midpoint(y0, y1));
        let (left, right) = ([x0, cx - clear], [cx + clear, x1]);
        let (low, high) = ([y0, cy - clear], [cy + clear, y1]);
        for (x, y) in [(left, low), (right, low), (right, high), (left, high)] {
            lower.extend([x[0], y[0]]);
            upper.extend([x[1], y[1]]);
        }
    }
    (lower, upper)
}

fn rectangle_bounds(actuator: &StudyActuator) -> Bounds {
    let [[x0, y0], [x1, y1]] = domains(actuator)[0];
    let least = 2.0 * actuator.centre_clearance_mm;
    (vec![least, least], vec![x1 - x0, y1 - y0])
}

/// Corners of the two rectangles of `[width, height]`.
fn rectangles(actuator: &StudyActuator, [width, height]: [f64; 2]) -> Vec<f64> {
    let mut corners = Vec::new();
    for [[x0, y0], [x1, y1]] in domains(actuator) {
        let (cx, cy) = (f64::midpoint(x0, x1), f64::midpoint(y0, y1));
        for [sx, sy] in RECTANGLE_SIGNS {
            corners.extend([cx + sx * width / 2.0, cy + sy * height / 2.0]);
        }
    }
    corners
}

const RECTANGLE_SIGNS: [[f64; 2]; 4] = [[-1., -1.], [1., -1.], [1., 1.], [-1., 1.]];

fn corner_names() -> Vec<String> {
    (1..=8)
        .flat_map(|k| [format!("x{k}"), format!("y{k}")])
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
        let (lower, upper) = s
            .variables
            .bounds(self.body.as_ref())
            .ok_or(StudyError::NoChambers { step })?;
        let names = match s.variables {
            Variables::Bounds { .. } => (1..=lower.len()).map(|k| format!("x{k}")).collect(),
            Variables::Chambers { parametrisation } => match parametrisation {
                Parametrisation::Corners => corner_names(),
                Parametrisation::Rectangle => vec!["width".into(), "height".into()],
            },
        };
        Ok(DesignVariables {
            lower,
            upper,
            names,
        })
    }

    /// The shared part and the settings of a finite-element step.
    fn chambers(&self, step: usize) -> Result<(&StudyBody, &StudyStep, &FeCascade), StudyError> {
        let s = self.step(step)?;
        match (&self.body, &s.model) {
            (Some(body), Model::FeCascade(model)) => Ok((body, s, model)),
            _ => Err(StudyError::NoChambers { step }),
        }
    }

    /// Chamber corners `[x1, y1, ..., x8, y8]` of a design.
    pub fn corners(&self, step: usize, x: &[f64]) -> Result<Vec<f64>, StudyError> {
        let (body, s, _) = self.chambers(step)?;
        let length = |expected: usize| StudyError::Length {
            step,
            expected,
            found: x.len(),
        };
        match (&s.variables, x) {
            (
                Variables::Chambers {
                    parametrisation: Parametrisation::Rectangle,
                },
                [width, height],
            ) => Ok(rectangles(&body.actuator, [*width, *height])),
            (
                Variables::Chambers {
                    parametrisation: Parametrisation::Corners,
                },
                corners,
            ) if corners.len() == 16 => Ok(corners.to_vec()),
            (
                Variables::Chambers {
                    parametrisation: Parametrisation::Rectangle,
                },
                _,
            ) => Err(length(2)),
            _ => Err(length(16)),
        }
    }

    /// The chain of units of a design.
    pub fn actuator(&self, step: usize, x: &[f64]) -> Result<Actuator, StudyError> {
        let corners = self.corners(step, x)?;
        let (body, _, _) = self.chambers(step)?;
        let points: Vec<Point> = corners.chunks_exact(2).map(|p| [p[0], p[1]]).collect();
        let unit = Unit {
            chambers_mm: points.chunks_exact(4).map(<[Point]>::to_vec).collect(),
        };
        Ok(Actuator {
            unit_mm: body.actuator.unit_mm,
            units: vec![unit; body.actuator.units],
            repeated: true,
        })
    }

    /// The scene that one evaluation solves.
    pub fn scene(
        &self,
        step: usize,
        x: &[f64],
        orientation: Option<Orientation>,
    ) -> Result<Scene, StudyError> {
        let actuator = self.actuator(step, x)?;
        let (body, s, model) = self.chambers(step)?;
        let probe_mm = match &s.target {
            Some(Target::EnclosedArea { probe_mm, .. } | Target::Displacement { probe_mm, .. }) => {
                *probe_mm
            }
            None => return Err(StudyError::NoChambers { step }),
        };
        let objective = s.target.as_ref().map(|target| match target {
            Target::EnclosedArea { orientation: o, .. } => SceneObjective::EnclosedArea {
                probe: TIP.into(),
                orientation: orientation.unwrap_or(o.senses()[0]),
            },
            Target::Displacement {
                component,
                state,
                sign,
                ..
            } => SceneObjective::Displacement {
                probe: TIP.into(),
                component: *component,
                state: *state,
                sign: *sign,
            },
        });
        Ok(Scene {
            body: Body::Actuator(ActuatorBody {
                materials: vec![body.material.law; actuator.units.len()],
                actuator,
            }),
            actuation: body.actuation.clone(),
            mesh: MeshRequest {
                element: model.element,
                max_size_mm: model.max_size_mm,
            },
            contact: model.contact,
            relative_residual_force_tolerance: model.relative_residual_force_tolerance,
            probes: vec![Probe {
                name: TIP.into(),
                at_mm: probe_mm,
            }],
            objective,
        })
    }

    /// d/dx of a quantity from its derivative with respect to the chamber corners of the repeated unit, `[x1, y1, ...]`.
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
        let (_, s, _) = self.chambers(step)?;
        let rectangle = matches!(
            s.variables,
            Variables::Chambers {
                parametrisation: Parametrisation::Rectangle
            }
        );
        if !rectangle {
            return Ok(corner_gradient.to_vec());
        }
        let mut gradient = vec![0.0; 2];
        for (k, g) in corner_gradient.iter().enumerate() {
            gradient[k % 2] += g * RECTANGLE_SIGNS[k / 2 % 4][k % 2] / 2.0;
        }
        Ok(gradient)
    }

    /// Number of constraint values of a step: of a finite-element model the geometric rows and the stretch row.
    pub fn constraint_count(&self, step: usize) -> Result<usize, StudyError> {
        let s = self.step(step)?;
        match &s.constraints {
            StepConstraints::Counts {
                inequalities,
                equalities,
            } => Ok(inequalities + equalities),
            StepConstraints::Chambers(constraints) => {
                let (body, _, _) = self.chambers(step)?;
                let stretch = usize::from(body.stretch_limit(constraints).is_some());
                Ok(self.geometric_rows(step)? + stretch)
            }
        }
    }

    fn geometric_rows(&self, step: usize) -> Result<usize, StudyError> {
        let start = self.paper_start(step)?;
        Ok(self.geometry_rows(step, &start)?.0.len())
    }

    /// A void of twice the centre clearance (1 x 1 mm in the paper) at the centre of every chamber's domain.
    pub(super) fn paper_start(&self, step: usize) -> Result<Vec<f64>, StudyError> {
        let (body, s, _) = self.chambers(step)?;
        let size = 2.0 * body.actuator.centre_clearance_mm;
        Ok(match s.variables {
            Variables::Chambers {
                parametrisation: Parametrisation::Rectangle,
            } => vec![size, size],
            _ => rectangles(&body.actuator, [size, size]),
        })
    }
}
