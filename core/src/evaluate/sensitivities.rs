//! What a design's objective is worth by each of its numbers, and what a maker may be off by.
//!
//! *Pressure* and *modulus*: derivatives by a factor on all pressures of the schedule, and on all moduli at constant K/mu. The
//! response of such laws, frictionless contact included (its stiffness is a multiple of mu), depends on p/mu alone, so that
//! dJ/d ln mu = -dJ/d ln p; dead tractions are forces that do not scale, with them there is no derivative by the modulus.
//!
//! *Walls*: by the thickness of a wall, the corners that bound it moving straight away from each other, a wall between two
//! chambers by half of it on either side. A corner bounds the wall on that side of its chamber's centre (the mean of its
//! corners) on which it lies. Copies move alike, and of a list of units all do.
//!
//! *Tolerances* are linear: what makes a hundredth of the objective where nothing else changes.

use serde::Serialize;

use super::gradient::GradientAnswer;
use super::scene::{BodySource, SceneOptions, SceneSolution, solve_scene};
use crate::equilibrium::Observer;
use crate::fault::Faults;
use crate::geometry::{Point, Unit};
use crate::material::MaterialLaw;
use crate::scene::{Body, Scene};

/// The share of the objective that tolerances are for.
pub const TOLERATED: f64 = 0.01;

/// Derivatives of an objective, and the tolerances that they leave.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SceneSensitivities {
    /// The objective.
    pub objective: f64,
    /// The share of it that tolerances are for: 0.01.
    pub tolerated: f64,
    /// By the largest pressure of the schedule, all others in proportion.
    pub pressure: Option<PerCondition>,
    /// By the initial shear modulus of the first unit's law, all moduli in proportion at constant K/mu.
    pub modulus: Option<PerCondition>,
    /// By each corner; empty of a mesh file.
    pub corners: Vec<CornerSensitivity>,
    /// By the thickness of each wall; empty of a mesh file.
    pub walls: Vec<WallSensitivity>,
    /// The most sensitive corner moved by its tolerance, where that was solved.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub check: Option<ToleranceCheck>,
}

/// A derivative by a condition of use.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct PerCondition {
    /// Its value: kPa of pressure, MPa of modulus.
    pub value: f64,
    /// Objective per kPa or MPa.
    pub per_unit: f64,
    /// Objective per 1 % of it.
    pub per_percent: f64,
    /// By how many per cent it may be off.
    pub tolerance_percent: Option<f64>,
}

/// A derivative by the place of a corner.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct CornerSensitivity {
    /// Unit, from 0; the first of copies.
    pub unit: usize,
    /// Chamber, from 0.
    pub chamber: usize,
    /// Corner, from 0.
    pub corner: usize,
    /// Its place in the unit, mm.
    pub at_mm: Point,
    /// Objective per mm in x and y.
    pub per_mm: [f64; 2],
    /// How far it may be off in the worst direction, mm.
    pub tolerance_mm: Option<f64>,
}

/// A derivative by the thickness of a wall.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct WallSensitivity {
    /// Which one.
    pub wall: Wall,
    /// Objective per mm of thickness.
    pub per_mm: f64,
    /// How much thicker or thinner it may be, mm.
    pub tolerance_mm: Option<f64>,
}

/// A wall of a unit.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Wall {
    /// Below the lowest chambers.
    Bottom,
    /// Above the highest.
    Top,
    /// Between chambers above each other.
    BetweenStacked,
    /// Left of the leftmost: half of the wall between copies.
    Left,
    /// Right of the rightmost.
    Right,
    /// Between chambers beside each other.
    BetweenBeside,
}

/// The most sensitive corner moved by its tolerance in the direction that raises the objective.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ToleranceCheck {
    /// Unit, from 0.
    pub unit: usize,
    /// Chamber, from 0.
    pub chamber: usize,
    /// Corner, from 0.
    pub corner: usize,
    /// Its move, mm.
    pub move_mm: Point,
    /// Change of the objective by the derivative, in shares of the objective's size.
    pub predicted: f64,
    /// By an analysis of the moved design on the same mesh plan; `None` where it has no equilibrium.
    pub found: Option<f64>,
}

impl SceneSolution {
    /// The sensitivities of a scene that was solved with its gradient.
    pub fn sensitivities(&self, scene: &Scene) -> Option<SceneSensitivities> {
        let objective = self.answer.objective?;
        let gradient = self.gradient()?;
        let [pressure, modulus] = self.conditions(scene, objective);
        let units = units(scene, &gradient);
        Some(SceneSensitivities {
            objective,
            tolerated: TOLERATED,
            pressure,
            modulus,
            corners: corners(&units, objective),
            walls: walls(&units, objective),
            check: None,
        })
    }

    /// By pressure and modulus.
    fn conditions(&self, scene: &Scene, objective: f64) -> [Option<PerCondition>; 2] {
        let Some(slope) = self.pressure_derivative else {
            return [None; 2];
        };
        let (law, scales) = match &scene.body {
            Body::Actuator(chain) => (chain.materials.first(), true),
            Body::MeshFile(file) => (Some(&file.material), file.tractions.is_empty()),
        };
        let per = |value: f64, slope: f64| PerCondition {
            value,
            per_unit: slope / value,
            per_percent: 0.01 * slope,
            tolerance_percent: tolerance(objective, slope).map(|share| 100.0 * share),
        };
        let pressure = scene.actuation.largest_kpa();
        let modulus = law.map(MaterialLaw::shear_modulus_mpa);
        [
            (pressure > 0.0).then(|| per(pressure, slope)),
            modulus.filter(|_| scales).map(|mu| per(mu, -slope)),
        ]
    }
}

/// Solves the scene again with its most sensitive corner moved by its tolerance, on the mesh plan of the solution.
///
/// # Errors
/// Those of [`solve_scene`].
pub fn check_tolerance(
    scene: &Scene,
    solution: &SceneSolution,
    sensitivities: &SceneSensitivities,
    observer: &mut dyn Observer,
) -> Result<Option<ToleranceCheck>, Faults> {
    let Some(BodySource::Mapped(mesh)) = &solution.source else {
        return Ok(None);
    };
    let tolerance = |corner: &CornerSensitivity| corner.tolerance_mm.unwrap_or(f64::INFINITY);
    let Some(corner) = sensitivities
        .corners
        .iter()
        .filter(|corner| corner.tolerance_mm.is_some())
        .min_by(|a, b| tolerance(a).total_cmp(&tolerance(b)))
    else {
        return Ok(None);
    };
    let [gx, gy] = corner.per_mm;
    let length = tolerance(corner) / gx.hypot(gy);
    let move_mm = [length * gx, length * gy];
    let mut moved = scene.clone();
    if let Body::Actuator(chain) = &mut moved.body {
        let repeated = chain.actuator.repeated;
        for (unit, u) in chain.actuator.units.iter_mut().enumerate() {
            let chamber = u.chambers_mm.get_mut(corner.chamber);
            let place = chamber.and_then(|c| c.get_mut(corner.corner));
            if let Some(at) = place.filter(|_| repeated || unit == corner.unit) {
                *at = [at[0] + move_mm[0], at[1] + move_mm[1]];
            }
        }
    }
    let options = SceneOptions {
        plan: Some(mesh.plan().clone()),
        path_only: true,
        ..SceneOptions::default()
    };
    let found = solve_scene(&moved, &options, observer)?.answer.objective;
    let share = |value: f64| (value - sensitivities.objective) / sensitivities.objective.abs();
    Ok(Some(ToleranceCheck {
        unit: corner.unit,
        chamber: corner.chamber,
        corner: corner.corner,
        move_mm,
        predicted: sensitivities.tolerated,
        found: found.map(share),
    }))
}

/// What a derivative of this size leaves; `None` where there is none to speak of.
fn tolerance(objective: f64, slope: f64) -> Option<f64> {
    let tolerance = TOLERATED * objective.abs() / slope.abs();
    tolerance.is_finite().then_some(tolerance)
}

/// Units with the gradients of their corners; the first of copies stands for all.
fn units<'a>(scene: &'a Scene, gradient: &GradientAnswer) -> Vec<(&'a Unit, Unit)> {
    let Body::Actuator(chain) = &scene.body else {
        return Vec::new();
    };
    let gradients = match gradient {
        GradientAnswer::Repeated { chambers_mm } => vec![Unit {
            chambers_mm: chambers_mm.clone(),
        }],
        GradientAnswer::Units { units } => units.clone(),
        GradientAnswer::Nodes { .. } => Vec::new(),
    };
    chain.actuator.units.iter().zip(gradients).collect()
}

fn corners(units: &[(&Unit, Unit)], objective: f64) -> Vec<CornerSensitivity> {
    let mut corners = Vec::new();
    for (unit, (shape, gradient)) in units.iter().enumerate() {
        let chambers = shape.chambers_mm.iter().zip(&gradient.chambers_mm);
        for (chamber, (places, slopes)) in chambers.enumerate() {
            for (corner, (at, per_mm)) in places.iter().zip(slopes).enumerate() {
                corners.push(CornerSensitivity {
                    unit,
                    chamber,
                    corner,
                    at_mm: *at,
                    per_mm: *per_mm,
                    tolerance_mm: tolerance(objective, per_mm[0].hypot(per_mm[1])),
                });
            }
        }
    }
    corners
}

/// Of a unit's walls, in the order of [`Wall`]; those that it does not have are left out.
fn walls(units: &[(&Unit, Unit)], objective: f64) -> Vec<WallSensitivity> {
    const WALLS: [Wall; 6] = [
        Wall::Bottom,
        Wall::Top,
        Wall::BetweenStacked,
        Wall::Left,
        Wall::Right,
        Wall::BetweenBeside,
    ];
    let mut slopes = [None; WALLS.len()];
    for (shape, gradient) in units {
        for (chamber, places) in shape.chambers_mm.iter().enumerate() {
            let centre = centre(places);
            for (at, slope) in places.iter().zip(&gradient.chambers_mm[chamber]) {
                for axis in [1, 0] {
                    let below = at[axis] < centre[axis];
                    let between = faces(shape, chamber, axis, below);
                    let wall = match (axis, between, below) {
                        (1, false, true) => 0,
                        (1, false, false) => 1,
                        (1, true, _) => 2,
                        (_, false, true) => 3,
                        (_, false, false) => 4,
                        (_, true, _) => 5,
                    };
                    // The corner recedes from the wall as that grows.
                    let away = if below { 1.0 } else { -1.0 };
                    let share = if between { 0.5 } else { 1.0 };
                    *slopes[wall].get_or_insert(0.0) += share * away * slope[axis];
                }
            }
        }
    }
    let line = |(wall, slope): (Wall, Option<f64>)| {
        let per_mm = slope?;
        Some(WallSensitivity {
            wall,
            per_mm,
            tolerance_mm: tolerance(objective, per_mm),
        })
    };
    WALLS.into_iter().zip(slopes).filter_map(line).collect()
}

fn centre(corners: &[Point]) -> Point {
    let share = 1.0 / corners.len().max(1) as f64;
    corners
        .iter()
        .fold([0.0; 2], |c, p| [c[0] + share * p[0], c[1] + share * p[1]])
}

/// Whether another chamber of the unit lies on that side of a chamber: its centre does, within the chamber's extent across.
fn faces(unit: &Unit, chamber: usize, axis: usize, below: bool) -> bool {
    let own = centre(&unit.chambers_mm[chamber]);
    let across = 1 - axis;
    let extent = unit.chambers_mm[chamber].iter().map(|p| p[across]);
    let (low, high) = extent.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| {
        (l.min(v), h.max(v))
    });
    let others = unit.chambers_mm.iter().enumerate();
    others.filter(|(other, _)| *other != chamber).any(|(_, c)| {
        let at = centre(c);
        (at[axis] < own[axis]) == below
            && at[axis] != own[axis]
            && (low..=high).contains(&at[across])
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn square(x: f64, y: f64) -> Vec<Point> {
        vec![[x, y], [x + 10.0, y], [x + 10.0, y + 10.0], [x, y + 10.0]]
    }

    #[test]
    fn walls_are_those_that_corners_bound() {
        let shape = Unit {
            chambers_mm: vec![square(20.0, 5.0), square(22.0, 30.0)],
        };
        let gradient = Unit {
            chambers_mm: vec![
                vec![[1.0, 2.0], [3.0, 4.0], [5.0, 6.0], [7.0, 8.0]],
                vec![[10.0, 20.0], [30.0, 40.0], [50.0, 60.0], [70.0, 80.0]],
            ],
        };
        let found = walls(&[(&shape, gradient)], -50.0);
        let found: Vec<(Wall, f64, Option<f64>)> = found
            .into_iter()
            .map(|w| (w.wall, w.per_mm, w.tolerance_mm))
            .collect();
        assert_eq!(
            found,
            [
                (Wall::Bottom, 6.0, Some(0.5 / 6.0)),
                (Wall::Top, -140.0, Some(0.5 / 140.0)),
                (Wall::BetweenStacked, 0.5 * (60.0 - 14.0), Some(0.5 / 23.0)),
                (Wall::Left, 88.0, Some(0.5 / 88.0)),
                (Wall::Right, -88.0, Some(0.5 / 88.0)),
            ]
        );
        assert_eq!(tolerance(1.0, 0.0), None);
    }
}
