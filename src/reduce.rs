//! `salp reduce`: the reduced models of a scene's unit, fitted, and held against FE.

mod rod;

use std::path::PathBuf;

use clap::Args;
use salp_core::equilibrium::Unobserved;
use salp_core::evaluate::reduction::{CHAINS, Prediction, Reduction, Source, UnitFit, reduction};
use salp_core::evaluate::{SceneStatus, solve_chain};
use salp_core::picture::{ReducedPicture, TipPaths};
use salp_core::scene::{Body, Scene, read_scene};
use serde_json::json;

use crate::failure::Failure;
use crate::input::DocumentArguments;
use crate::numbers::Numbers;
use crate::output::{Output, note, number, table, write_file};
use crate::parallel::{cores, in_parallel};
use crate::stopwatch::cpu_seconds;

/// Arguments of `salp reduce`.
#[derive(Args)]
pub struct Reduce {
    #[command(flatten)]
    scene: DocumentArguments,
    /// Draws unit, cascade, paths of the tip and design space
    #[arg(long)]
    svg: Option<PathBuf>,
    /// Writes the transformations of every state
    #[arg(long)]
    csv: Option<PathBuf>,
    /// The constant-strain rod instead of the paper's model, calibrated at N by N pairs of pressures (odd or even, 5 to 33), against 3,
    /// 9 and 20 units under `hold`, `swap` and `overlap`
    #[arg(long, value_name = "N", num_args = 0..=1, default_missing_value = "7", conflicts_with = "csv")]
    rod: Option<usize>,
}

impl Reduce {
    /// Solves one, three and nine units, fits, compares, writes and prints.
    pub fn run(self, output: Output) -> Result<(), Failure> {
        let scene = read_scene(&self.scene.read()?, self.scene.folder())?;
        if let Some(grid) = self.rod {
            let name = self.scene.file.file_stem().unwrap_or_default();
            return rod::run(
                &scene,
                &name.to_string_lossy(),
                grid,
                self.svg.as_deref(),
                output,
            );
        }
        let started = cpu_seconds();
        // The longest first.
        let mut order = CHAINS;
        order.reverse();
        let solve = |index: usize| solve_chain(&scene, order[index], false, &mut Unobserved);
        let threads = cores().min(order.len());
        let chains = in_parallel(threads, order.len(), solve, |_, _| ());
        let mut chains = chains.into_iter().collect::<Result<Vec<_>, _>>()?;
        chains.reverse();
        let found = reduction(&chains).map_err(|cannot| {
            note(&format!("salp: {cannot}"));
            Failure::Run("the edges of a unit do not determine its transformation")
        })?;
        let cpu_s = cpu_seconds() - started;
        if let Some(file) = &self.csv {
            write_file(file, &csv(&found))?;
        }
        if let Some(file) = &self.svg {
            let name = self.scene.file.file_stem().unwrap_or_default();
            write_file(file, &picture(&name.to_string_lossy(), &scene, &found))?;
        }
        let numbers = Numbers::of(&scene);
        let mut document = json!(found);
        document["numbers"] = numbers.document();
        document["cpu_s"] = json!(cpu_s);
        output.print(&document, || {
            let cpu = number(Some(cpu_s));
            format!(
                "{}\n\n{}\n{cpu} CPU s",
                numbers.lines().join("\n"),
                text(&found)
            )
        });
        if found.chains.iter().all(|end| end.status == SceneStatus::Ok) {
            Ok(())
        } else {
            Err(Failure::Run(
                "a chain did not end well: what needs it is missing",
            ))
        }
    }
}

fn source(source: Source) -> &'static str {
    match source {
        Source::OneUnit => "one unit",
        Source::MiddleOfThree => "middle of three",
        Source::EachOfThree => "each of three",
    }
}

fn fitted_in(fit: &UnitFit) -> String {
    match fit.chain {
        1 => "one unit".into(),
        chain => format!("unit {} of {chain}", fit.unit),
    }
}

fn pressures(of: &[f64]) -> String {
    let of: Vec<String> = of.iter().map(|p| number(Some(*p))).collect();
    format!("({})", of.join(", "))
}

fn per_cent(share: f64) -> String {
    format!("{:.2} %", 100.0 * share)
}

fn text(found: &Reduction) -> String {
    let mut parts = Vec::new();
    for end in &found.chains {
        let units = match end.units {
            1 => "1 unit".to_owned(),
            n => format!("{n} units"),
        };
        if end.status != SceneStatus::Ok {
            let status = json!(end.status);
            let reached = per_cent(end.load_fraction_reached);
            let status = status.as_str().unwrap_or_default();
            parts.push(format!("{units}: {status} at {reached} of the path"));
        } else if !end.unique {
            parts.push(format!("{units}: another equilibrium was met"));
        }
    }
    if !found.fits.is_empty() {
        let rows: Vec<Vec<String>> = found.fits.iter().flat_map(fit_rows).collect();
        let header = [
            "fitted in",
            "kPa",
            "x_scl",
            "x_sh",
            "y_sh",
            "y_scl",
            "turn",
            "rms mm",
            "max mm",
        ];
        parts.push(table(&header, &rows));
        let rows: Vec<Vec<String>> = found.fits.iter().map(residual_row).collect();
        let header = [
            "over all states",
            "moved mm",
            "rms mm",
            "max mm",
            "rms / moved",
        ];
        parts.push(table(&header, &rows));
    }
    if !found.predictions.is_empty() {
        let rows: Vec<Vec<String>> = found.predictions.iter().map(prediction_row).collect();
        let header = [
            "foretold by",
            "units",
            "tip of",
            "largest mm",
            "max error",
            "rms error",
            "FE mm\u{b2}",
            "area mm\u{b2}",
            "FE rows",
            "rows",
        ];
        parts.push(table(&header, &rows));
    }
    if !found.unit_differences.is_empty() {
        let rows: Vec<Vec<String>> = found
            .unit_differences
            .iter()
            .map(|d| {
                vec![
                    format!("unit {} of 9", d.unit),
                    number(Some(d.max_mm)),
                    per_cent(d.relative),
                    number(Some(d.turn_deg)),
                ]
            })
            .collect();
        let header = ["against unit 2 of 3", "mm", "of moved", "turn, degrees"];
        parts.push(table(&header, &rows));
    }
    if let Some(space) = &found.exploration {
        let areas: Vec<String> = (space.largest.iter())
            .map(|e| format!("{}: {}", e.actuations, number(Some(e.area_mm2))))
            .collect();
        parts.push(format!(
            "largest area of {} units by number of actuations, mm\u{b2}: {}",
            space.units,
            areas.join(", ")
        ));
    }
    parts.join("\n\n")
}

/// A line for each row of the schedule but rest.
fn fit_rows(fit: &UnitFit) -> Vec<Vec<String>> {
    let rows = fit.calibrated.rows();
    rows.filter(|(_, state)| state.point.pressure_kpa.iter().any(|p| *p != 0.0))
        .map(|(_, state)| {
            let t = &state.fit.transform;
            let mut cells = vec![fitted_in(fit), pressures(&state.point.pressure_kpa)];
            cells.extend(t.entries().map(|e| format!("{e:.5}")));
            cells.push(format!("{:.3}\u{b0}", t.turn_rad().to_degrees()));
            cells.extend([state.fit.rms_mm, state.fit.max_mm].map(|r| format!("{r:.4}")));
            cells
        })
        .collect()
}

fn residual_row(fit: &UnitFit) -> Vec<String> {
    let share = if fit.moved_mm > 0.0 {
        per_cent(fit.rms_mm / fit.moved_mm)
    } else {
        "-".into()
    };
    vec![
        fitted_in(fit),
        number(Some(fit.moved_mm)),
        number(Some(fit.rms_mm)),
        number(Some(fit.max_mm)),
        share,
    ]
}

fn prediction_row(p: &Prediction) -> Vec<String> {
    vec![
        source(p.source).into(),
        p.units.to_string(),
        format!("unit {}", p.tip_unit),
        number(Some(p.largest_mm)),
        per_cent(p.max_error),
        per_cent(p.rms_error),
        number(Some(p.fe_area_mm2)),
        number(Some(p.area_mm2)),
        number(Some(p.fe_area_of_rows_mm2)),
        number(Some(p.area_of_rows_mm2)),
    ]
}

fn csv(found: &Reduction) -> String {
    let channels = found
        .fits
        .first()
        .map_or(0, |fit| fit.calibrated.range_kpa().len());
    let mut text = String::from("chain,unit,leg,fraction");
    for channel in 0..channels {
        text += &format!(",channel_{channel}_kpa");
    }
    text += ",x_scl,x_sh,y_sh,y_scl,rms_mm,max_mm\n";
    for fit in &found.fits {
        for state in &fit.calibrated.states {
            let point = &state.point;
            let head = [fit.chain, fit.unit, point.leg].map(|n| n.to_string());
            let values = std::iter::once(point.fraction)
                .chain(point.pressure_kpa.iter().copied())
                .chain(state.fit.transform.entries())
                .chain([state.fit.rms_mm, state.fit.max_mm])
                .map(|v| v.to_string());
            text += &head.into_iter().chain(values).collect::<Vec<_>>().join(",");
            text.push('\n');
        }
    }
    text
}

/// The middle unit of three where there is one, else one alone.
fn picture(name: &str, scene: &Scene, found: &Reduction) -> String {
    let middle = found
        .fits
        .iter()
        .find(|fit| fit.chain == 3 && fit.unit == 2);
    let fit = middle.or(found.fits.first());
    let rows: Vec<_> = fit
        .iter()
        .flat_map(|fit| fit.calibrated.rows())
        .filter(|(_, state)| state.point.pressure_kpa.iter().any(|p| *p != 0.0))
        .map(|(_, state)| {
            let label = format!("{} kPa", pressures(&state.point.pressure_kpa));
            (label, state.fit.transform)
        })
        .collect();
    let paths: Vec<TipPaths<'_>> = [[3, 2], [9, 8]]
        .into_iter()
        .filter_map(|[units, tip_unit]| {
            let of_tip = |p: &&Prediction| p.units == units && p.tip_unit == tip_unit;
            let all: Vec<&Prediction> = found.predictions.iter().filter(of_tip).collect();
            Some(TipPaths {
                title: format!("path of the right edge of unit {tip_unit} of {units}"),
                fe_mm: &all.first()?.fe_path_mm,
                foretold_mm: all
                    .iter()
                    .map(|p| {
                        let error = per_cent(p.max_error);
                        (
                            format!("{} (max {error})", source(p.source)),
                            &p.path_mm[..],
                        )
                    })
                    .collect(),
            })
        })
        .collect();
    let (unit_mm, chambers) = match &scene.body {
        Body::Actuator(body) => {
            let unit = body.actuator.units.first();
            let chambers = unit.map_or(&[][..], |unit| &unit.chambers_mm);
            (body.actuator.unit_mm, chambers)
        }
        Body::MeshFile(_) => ([1.0; 2], &[][..]),
    };
    let space = found.exploration.as_ref();
    let largest: Vec<f64> = space
        .iter()
        .flat_map(|space| space.largest.iter().map(|e| e.area_mm2))
        .collect();
    let mut caption = Numbers::of(scene).lines();
    caption.push(format!(
        "(a), (b): {}; grey: at rest. (c), (d): dots are states; dashed: cascades of the transformations fitted in FE on one unit, on the middle one of three, on each of three. (e): each entry within its range over the states of (a). (f): all other entries as fitted.",
        fit.map_or_else(String::new, |fit| format!("transformations of {}", fitted_in(fit)))
    ));
    ReducedPicture {
        title: &format!("{name}: the reduced model (Eq. 1) against FE"),
        unit_mm,
        chambers_mm: chambers,
        rows: &rows,
        units: 9,
        paths: &paths,
        largest_mm2: &largest,
        map: space.and_then(|space| Some((space.map.as_ref()?, space.fitted?))),
        caption: &caption,
    }
    .svg()
}
