//! `salp reduce --rod`: the constant-strain rod of a scene's unit, held against FE under schedules that it was not calibrated on.

use std::path::Path;

use salp_core::equilibrium::Unobserved;
use salp_core::evaluate::rod::{
    CannotCalibrate, LENGTHS, RodPrediction, SCHEDULES, calibrate_rod, compare_rod, solve_schedules,
};
use salp_core::evaluate::{ChainEnd, SceneStatus};
use salp_core::picture::{TipPaths, tip_paths_svg};
use salp_core::reduced::{Rod, RodUnits, Strain};
use salp_core::scene::Scene;
use serde_json::{Value, json};

use super::per_cent;
use crate::failure::Failure;
use crate::numbers::Numbers;
use crate::output::{Output, note, number, table, write_file};
use crate::parallel::{cores, in_parallel};
use crate::stopwatch::cpu_seconds;

/// Calibrates, compares, writes and prints.
pub fn run(
    scene: &Scene,
    name: &str,
    grid: usize,
    svg: Option<&Path>,
    output: Output,
) -> Result<(), Failure> {
    let started = cpu_seconds();
    let rod = calibrate_rod(scene, grid, &mut Unobserved).map_err(failure)?;
    let calibration_s = cpu_seconds() - started;
    // The longest first.
    let mut order = LENGTHS;
    order.reverse();
    let solve = |index: usize| solve_schedules(scene, order[index], &mut Unobserved);
    let chains = in_parallel(cores().min(order.len()), order.len(), solve, |_, _| ());
    let mut ends = Vec::new();
    let mut found = Vec::new();
    for chain in chains.into_iter().rev() {
        let chain = chain.map_err(failure)?;
        found.extend(compare_rod(&rod, &chain).map_err(|no| failure(no.into()))?);
        ends.push(chain.end);
    }
    if let Some(file) = svg {
        write_file(file, &picture(name, scene, grid, &found))?;
    }
    let rows = strains(scene, &rod)?;
    let numbers = Numbers::of(scene);
    let document = json!({
        "grid": grid,
        "numbers": numbers.document(),
        "strains_of_rows": rows,
        "chains": ends,
        "predictions": found,
        "calibration_cpu_s": calibration_s,
        "cpu_s": cpu_seconds() - started,
    });
    output.print(&document, || {
        format!(
            "{}\n\n{}\n\ncalibrated at {grid} by {grid} pressures in {} CPU s, {} CPU s in all",
            numbers.lines().join("\n"),
            text(&ends, &found),
            number(Some(calibration_s)),
            number(Some(cpu_seconds() - started))
        )
    });
    if ends.iter().all(|end| end.status == SceneStatus::Ok) {
        Ok(())
    } else {
        Err(Failure::Run(
            "a chain did not end well: what needs it is missing",
        ))
    }
}

fn failure(cannot: CannotCalibrate) -> Failure {
    match cannot {
        CannotCalibrate::Scene(faults) => Failure::BadInput(faults),
        CannotCalibrate::Grid { .. } => Failure::fault("rod", cannot.to_string()),
        CannotCalibrate::Channels { .. } | CannotCalibrate::Pressure { .. } => {
            Failure::fault("actuation.schedule", cannot.to_string())
        }
        cannot => {
            note(&format!("salp: {cannot}"));
            Failure::Run("the unit has no rod over the pressure plane")
        }
    }
}

/// Strains of the middle unit at the rows of the scene's schedule.
fn strains(scene: &Scene, rod: &Rod) -> Result<Vec<Value>, Failure> {
    let row = |pressure: &Vec<f64>| {
        let strain: Strain = (rod.middle.strain(pressure)).map_err(|no| failure(no.into()))?;
        Ok(json!({ "pressure_kpa": pressure, "strain": strain }))
    };
    scene.actuation.rows_kpa.iter().map(row).collect()
}

fn text(ends: &[ChainEnd], found: &[RodPrediction]) -> String {
    let mut parts = Vec::new();
    for end in ends {
        if end.status != SceneStatus::Ok || !end.unique {
            let reached = per_cent(end.load_fraction_reached);
            let status = json!(end.status);
            let status = status.as_str().unwrap_or_default();
            let unique = if end.unique { "" } else { ", not unique" };
            parts.push(format!(
                "{} units: {status} at {reached} of the path{unique}",
                end.units
            ));
        }
    }
    let rows: Vec<Vec<String>> = found
        .iter()
        .map(|p| {
            vec![
                made_of(p.made_of).into(),
                p.units.to_string(),
                format!("unit {}", p.tip_unit),
                p.schedule.to_owned(),
                number(Some(p.largest_mm)),
                per_cent(p.max_error),
                number(Some(p.fe_area_mm2)),
                number(Some(p.area_mm2)),
            ]
        })
        .collect();
    let header = [
        "rod of",
        "units",
        "tip",
        "schedule",
        "moves (mm)",
        "largest error",
        "area in FE (mm^2)",
        "of the rod",
    ];
    parts.push(table(&header, &rows));
    parts.join("\n")
}

fn made_of(units: RodUnits) -> &'static str {
    match units {
        RodUnits::Middle => "middle of three",
        RodUnits::Each => "each of three",
    }
}

fn picture(name: &str, scene: &Scene, grid: usize, found: &[RodPrediction]) -> String {
    let panels: Vec<TipPaths<'_>> = LENGTHS
        .iter()
        .flat_map(|units| SCHEDULES.map(|schedule| (*units, schedule)))
        .filter_map(|(units, schedule)| {
            let of_panel = |p: &&RodPrediction| {
                p.units == units && p.schedule == schedule && p.tip_unit + 1 == units
            };
            let all: Vec<&RodPrediction> = found.iter().filter(of_panel).collect();
            Some(TipPaths {
                title: format!("unit {} of {units}, {schedule}", units - 1),
                fe_mm: &all.first()?.fe_path_mm,
                foretold_mm: all
                    .iter()
                    .map(|p| {
                        let label = format!("{} ({})", made_of(p.made_of), per_cent(p.max_error));
                        (label, &p.path_mm[..])
                    })
                    .collect(),
            })
        })
        .collect();
    let mut caption = Numbers::of(scene).lines();
    caption.push(format!(
        "Dots: tip in FE at the states of the schedule. Dashed: constant-strain rods, calibrated on the units of one chain of three at {grid} by {grid} pairs of pressures; in brackets the largest distance over the largest displacement."
    ));
    let title = format!("{name}: the constant-strain rod against FE");
    tip_paths_svg(&title, &panels, SCHEDULES.len(), &caption)
}
