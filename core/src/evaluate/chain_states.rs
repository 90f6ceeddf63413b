//! A chain of equal units over its path, as the reduced model wants it: where the points of every edge between two units are
//! at every state, and the transformation that each unit makes of that.

use serde::Serialize;

use super::answer::SceneStatus;
use super::scene::{SceneOptions, solve_scene};
use crate::actuation::ActuationPoint;
use crate::equilibrium::Observer;
use crate::fault::Faults;
use crate::geometry::Point;
use crate::reduced::{Calibrated, CannotFit, FittedState, edge, fit, frame_of};
use crate::scene::{Body, Probe, Scene};

/// A solved chain.
#[derive(Clone, Debug, PartialEq)]
pub struct ChainStates {
    /// How it ended.
    pub end: ChainEnd,
    /// Width and height of a unit, mm.
    pub unit_mm: [f64; 2],
    /// The states that were reached, rest first.
    pub points: Vec<ActuationPoint>,
    /// For each state and each edge, from the clamped one to the right end: the places of its points, mm.
    pub edges_mm: Vec<Vec<[Point; edge::POINTS]>>,
}

/// How the analysis of a chain ended.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ChainEnd {
    /// Number of its units.
    pub units: usize,
    /// How it ended.
    pub status: SceneStatus,
    /// The reason of a failure.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub reason: Option<String>,
    /// (leg + fraction) / legs at the last state.
    pub load_fraction_reached: f64,
    /// Whether no second equilibrium was met.
    pub unique: bool,
    /// Free displacement unknowns.
    pub dofs: usize,
    /// Largest averaged stretch over the states, where it was wanted; else 1.
    pub max_stretch: f64,
}

/// Solves `units` copies of the unit of a scene under its schedule; the stretch is looked at where it is wanted.
///
/// # Errors
/// No units; a scene without units, with units that differ, or with obstacles; an unmeshable shape is a status.
pub fn solve_chain(
    scene: &Scene,
    units: usize,
    stretch: bool,
    observer: &mut dyn Observer,
) -> Result<ChainStates, Faults> {
    let mut chain = repeated(scene, units)?;
    let unit_mm = match &chain.body {
        Body::Actuator(body) => body.actuator.unit_mm,
        Body::MeshFile(_) => [0.0; 2],
    };
    let [width, height] = unit_mm;
    let reference: Vec<[Point; edge::POINTS]> = (0..=units)
        .map(|e| edge::points(e as f64 * width, height).map(|[x, y]| [x, 0.5 * height + y]))
        .collect();
    let name = |e: usize, i: usize| format!("edge-{e}-{i}");
    chain.probes = (reference.iter().enumerate())
        .flat_map(|(e, points)| {
            points.iter().enumerate().map(move |(i, at)| Probe {
                name: name(e, i),
                at_mm: *at,
            })
        })
        .collect();
    let options = SceneOptions {
        path_only: !stretch,
        ..SceneOptions::default()
    };
    let answer = solve_scene(&chain, &options, observer)?.answer;
    let stretches = answer.path.iter().map(|s| s.max_stretch);
    let max_stretch = stretches.fold(1.0, f64::max);
    let placed = |moved: &std::collections::BTreeMap<String, Point>| {
        (reference.iter().enumerate())
            .map(|(e, points)| {
                std::array::from_fn(|i| {
                    let u = moved.get(&name(e, i)).copied().unwrap_or([f64::NAN; 2]);
                    [points[i][0] + u[0], points[i][1] + u[1]]
                })
            })
            .collect()
    };
    let edges_mm = answer.path.iter().map(|s| placed(&s.displacement_mm));
    let points = answer.path.iter().map(|state| ActuationPoint {
        leg: state.leg,
        fraction: state.fraction,
        pressure_kpa: state.pressure_kpa.clone(),
    });
    Ok(ChainStates {
        unit_mm,
        points: points.collect(),
        edges_mm: edges_mm.collect(),
        end: ChainEnd {
            units,
            status: answer.status,
            reason: answer.reason,
            load_fraction_reached: answer.load_fraction_reached,
            unique: answer.unique,
            dofs: answer.mesh.dofs,
            max_stretch,
        },
    })
}

/// The scene with `units` copies of its unit, without an objective.
fn repeated(scene: &Scene, units: usize) -> Result<Scene, Faults> {
    let mut faults = Faults::default();
    let mut chain = scene.clone();
    chain.objective = None;
    match &mut chain.body {
        Body::MeshFile(_) => faults.add(
            "mesh_file",
            "a reduced model needs the units of an actuator",
        ),
        Body::Actuator(body) => {
            let all = &body.actuator.units;
            if let Some(other) = all.iter().position(|unit| *unit != all[0]) {
                let message = "differs from unit 0; a reduced model is of one repeated unit";
                faults.add(format!("actuator.units[{other}]"), message);
            }
            let laws = &body.materials;
            if let Some(other) = laws.iter().position(|law| *law != laws[0]) {
                let message =
                    "differs from that of unit 0; a reduced model is of one repeated unit";
                faults.add(format!("unit_materials[{other}]"), message);
            }
            body.actuator.units = all
                .first()
                .cloned()
                .into_iter()
                .cycle()
                .take(units)
                .collect();
            body.materials = laws
                .first()
                .copied()
                .into_iter()
                .cycle()
                .take(units)
                .collect();
            body.actuator.repeated = true;
        }
    }
    if units == 0 {
        faults.add("units", "expected at least 1, found 0");
    }
    if !scene.obstacles.is_empty() {
        faults.add("obstacles", "a reduced model knows none");
    }
    faults.check(chain)
}

impl ChainStates {
    /// Whether every state was reached.
    pub fn is_complete(&self) -> bool {
        self.end.status == SceneStatus::Ok
    }

    /// The transformations of a unit (from 1) over the states that were reached: its right edge in the rigid frame that fits
    /// its left edge best. A unit that is not there has no states.
    ///
    /// # Errors
    /// Points that do not determine a fit.
    pub fn fit_unit(&self, unit: usize) -> Result<Calibrated, CannotFit> {
        let [width, height] = self.unit_mm;
        let [left, right] = [0.0, width].map(|x| edge::points(x, height));
        let there = (1..=self.end.units).contains(&unit);
        let states = self.points.iter().zip(&self.edges_mm).filter(|_| there);
        let states = states.map(|(point, edges)| {
            let frame = frame_of(&left, &edges[unit - 1], &edge::WEIGHTS)?;
            let moved = edges[unit].map(|p| frame.local(p));
            Ok(FittedState {
                point: point.clone(),
                fit: fit(&right, &moved, &edge::WEIGHTS)?,
            })
        });
        Ok(Calibrated {
            unit_mm: self.unit_mm,
            states: states.collect::<Result<_, CannotFit>>()?,
        })
    }

    /// The path of the middle of the right edge of a unit (from 1; 0: the clamped end), mm; empty for one that is not there.
    pub fn tip_path(&self, unit: usize) -> Vec<Point> {
        let edges = self.edges_mm.iter().filter_map(|edges| edges.get(unit));
        edges.map(|points| points[edge::MIDDLE]).collect()
    }
}
