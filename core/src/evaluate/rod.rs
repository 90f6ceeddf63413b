//! The constant-strain rod of a scene's unit: calibrated from one FE solve of three units over the plane of two pressures, and held
//! against FE chains of any length under schedules that it was not calibrated on.

use serde::Serialize;

use super::chain_states::{ChainEnd, ChainStates, solve_chain};
use super::pressure_map::{GRIDS, Tour};
use crate::actuation::{ActuationCycle, Spacing};
use crate::equilibrium::Observer;
use crate::fault::Faults;
use crate::geometry::Point;
use crate::geometry::polygon::{distance, signed_area};
use crate::reduced::surface::Points;
use crate::reduced::{CannotFit, LinearTransform, NoRod, Rod, RodUnit, RodUnits};
use crate::scene::Scene;

/// Units of the chain on which a rod is calibrated: the shortest with two ends and a middle.
pub const CALIBRATED: usize = 3;
/// Pressures of each channel where no number is asked for.
pub const DEFAULT_GRID: usize = 7;
/// Lengths of the chains of the comparison.
pub const LENGTHS: [usize; 3] = [3, 9, 20];
/// Schedules of the comparison; none is what a rod is calibrated on.
pub const SCHEDULES: [&str; 3] = ["hold", "swap", "overlap"];

/// A scene whose unit gives no rod.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum CannotCalibrate {
    /// Not two channels.
    #[error("a rod has two channels, the schedule has {found}")]
    Channels {
        /// Channels of the schedule.
        found: usize,
    },
    /// No grid.
    #[error("a grid has from {} to {} pressures in each channel, not {found}", GRIDS.start(), GRIDS.end())]
    Grid {
        /// What was asked for.
        found: usize,
    },
    /// No positive pressure.
    #[error("the largest pressure of the schedule is {found} kPa; a rod needs a positive one")]
    Pressure {
        /// Largest pressure, kPa.
        found: f64,
    },
    /// The chain did not reach every pressure, or not uniquely.
    #[error(
        "three units reach {:.1} % of the path over the pressure plane{}",
        100.0 * end.load_fraction_reached,
        if end.unique { "" } else { ", where a second equilibrium was met" }
    )]
    Chain {
        /// How it ended.
        end: Box<ChainEnd>,
    },
    /// Edges without a pose.
    #[error(transparent)]
    Fit(#[from] CannotFit),
    /// States that are no grid.
    #[error(transparent)]
    Rod(#[from] NoRod),
    /// Faults of the scene.
    #[error(transparent)]
    Scene(#[from] Faults),
}

/// Largest pressure of a scene of two channels, kPa.
fn largest_kpa(scene: &Scene) -> Result<f64, CannotCalibrate> {
    let found = scene.actuation.channels();
    if found != 2 {
        return Err(CannotCalibrate::Channels { found });
    }
    let pressures = scene.actuation.rows_kpa.iter().flatten();
    let largest = pressures.fold(0.0, |m: f64, p| m.max(*p));
    if largest <= 0.0 {
        return Err(CannotCalibrate::Pressure { found: largest });
    }
    Ok(largest)
}

/// Solves three units at `grid` by `grid` pressures up to the largest of the scene's schedule, and takes the strains of each.
///
/// # Errors
/// Scenes and grids without a rod; a chain that does not reach every pressure on one branch.
pub fn calibrate_rod(
    scene: &Scene,
    grid: usize,
    observer: &mut dyn Observer,
) -> Result<Rod, CannotCalibrate> {
    let largest = largest_kpa(scene)?;
    if !GRIDS.contains(&grid) {
        return Err(CannotCalibrate::Grid { found: grid });
    }
    let shares = Points::new(grid).shares();
    let pressures: Vec<f64> = shares.iter().map(|s| s * largest).collect();
    let mut mapped = scene.clone();
    mapped.objective = None;
    mapped.actuation = ActuationCycle {
        rows_kpa: Tour::new(&pressures).rows_kpa,
        load_steps_per_leg: 1,
        spacing: Spacing::Equal,
    };
    let chain = solve_chain(&mapped, CALIBRATED, false, observer)?;
    if !(chain.is_complete() && chain.end.unique) {
        let end = Box::new(chain.end);
        return Err(CannotCalibrate::Chain { end });
    }
    let [width, _] = chain.unit_mm;
    let unit = |unit: usize| -> Result<RodUnit, CannotCalibrate> {
        let all = chain.fit_unit(unit)?.transforms();
        let at = |k: usize| all[Tour::visit(grid, k % grid, k / grid)];
        let of_grid: Vec<LinearTransform> = (0..grid * grid).map(at).collect();
        Ok(RodUnit::new(grid, largest, width, &of_grid)?)
    };
    Ok(Rod {
        unit_mm: chain.unit_mm,
        first: unit(1)?,
        middle: unit(2)?,
        last: unit(CALIBRATED)?,
    })
}

/// A chain of `units` over all [`SCHEDULES`], one after the other, with the states a leg of the scene's own.
///
/// # Errors
/// Scenes without two channels, and those of [`solve_chain`].
pub fn solve_schedules(
    scene: &Scene,
    units: usize,
    observer: &mut dyn Observer,
) -> Result<ChainStates, CannotCalibrate> {
    let mut rows = vec![vec![0.0, 0.0]];
    for schedule in rows_of(largest_kpa(scene)?) {
        // Each begins where the one before ends, at rest.
        rows.extend_from_slice(&schedule[1..]);
    }
    let mut chained = scene.clone();
    chained.objective = None;
    chained.actuation.rows_kpa = rows;
    Ok(solve_chain(&chained, units, false, observer)?)
}

fn rows_of(largest_kpa: f64) -> impl Iterator<Item = Vec<Vec<f64>>> {
    let rows = move |name| ActuationCycle::named_rows(name, largest_kpa);
    SCHEDULES.into_iter().filter_map(rows)
}

/// A chain foretold by a rod, against FE, over one schedule.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct RodPrediction {
    /// The schedule.
    pub schedule: &'static str,
    /// Units of the chain.
    pub units: usize,
    /// The tip is the middle of the right edge of this unit, from 1.
    pub tip_unit: usize,
    /// Which units the rod is made of.
    pub made_of: RodUnits,
    /// Largest displacement of the tip in FE, mm.
    pub largest_mm: f64,
    /// Largest distance of the two paths over the states, over the largest displacement.
    pub max_error: f64,
    /// Area that the tip encloses in FE, mm^2.
    pub fe_area_mm2: f64,
    /// The same of the rod over the same states, mm^2.
    pub area_mm2: f64,
    /// Places of the tip in FE, mm.
    pub fe_path_mm: Vec<Point>,
    /// Foretold, mm.
    pub path_mm: Vec<Point>,
}

/// Holds a rod against a chain of [`solve_schedules`]: the last unit but one and the last, with and without ends of their own.
///
/// # Errors
/// Pressures that the rod does not know.
pub fn compare_rod(rod: &Rod, chain: &ChainStates) -> Result<Vec<RodPrediction>, NoRod> {
    let units = chain.end.units;
    let mut found = Vec::new();
    let mut from = 0;
    for (schedule, rows) in SCHEDULES.into_iter().zip(rows_of(1.0)) {
        let legs = from..from + rows.len() - 1;
        from = legs.end;
        let inside = |i: &usize| legs.contains(&chain.points[*i].leg);
        let mut states: Vec<usize> = (1..chain.points.len()).filter(inside).collect();
        // The state at rest from which it begins.
        let Some(first) = states.first().copied() else {
            continue;
        };
        states.insert(0, first - 1);
        let pressures: Vec<Vec<f64>> = states
            .iter()
            .map(|i| chain.points[*i].pressure_kpa.clone())
            .collect();
        for tip_unit in [units - 1, units].into_iter().filter(|u| *u > 0) {
            let all = chain.tip_path(tip_unit);
            let fe: Vec<Point> = states.iter().map(|i| all[*i]).collect();
            for made_of in [RodUnits::Middle, RodUnits::Each] {
                let path = rod.path(units, tip_unit, made_of, &pressures)?;
                let largest = fe.iter().fold(0.0, |m: f64, p| m.max(distance(fe[0], *p)));
                let apart = fe.iter().zip(&path).map(|(a, b)| distance(*a, *b));
                let scale = if largest > 0.0 { largest } else { 1.0 };
                found.push(RodPrediction {
                    schedule,
                    units,
                    tip_unit,
                    made_of,
                    largest_mm: largest,
                    max_error: apart.fold(0.0, f64::max) / scale,
                    fe_area_mm2: signed_area(&fe),
                    area_mm2: signed_area(&path),
                    fe_path_mm: fe.clone(),
                    path_mm: path,
                });
            }
        }
    }
    Ok(found)
}
