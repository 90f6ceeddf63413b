//! `salp reproduce paper`: both methods of the paper as the paper ran them and as Salp does, its Table 3 and lookalikes of its
//! Figs. 4, 7, 8 and 10 from our own runs, and what differs. Interrupted, the same command goes on where it was.

mod arms;

use std::path::Path;
use std::sync::atomic::AtomicBool;

use salp_core::picture::{BandPicture, BandSeries, BandStep, Scale};
use salp_core::scene::Scene;
use salp_protocol::{BandCounts, Curve, StudyState, csv};
use serde_json::{Value, json};

use super::realised::{Reach, Realised, passes, reach, realise};
use crate::failure::Failure;
use crate::numbers::Numbers;
use crate::output::{note, number, table, write_file};
use crate::parallel::cores;
use crate::raster::write_picture;
use crate::run::document::Results;
use crate::run::{Ended, Setting, steps, winner};
use arms::{Arm, arms};

/// The paper's headline areas, mm^2.
const HEADLINES: [f64; 2] = [843.0, 342.0];

/// What differs from the paper and why.
const DIFFERENCES: &[&str] = &[
    "solver: Salp's own elements and Newton method in place of Marc; quad4 has mean dilatation, not reduced integration with Herrmann's formulation",
    "optimiser: MMFD follows DOT's published rules and defaults; it is not DOT",
    "material: the paper gives no constants; the record mold-star-30 comes from the data sheet's 100 % modulus, without test data",
    "which chamber is driven first is not said in the paper: both orders are run",
    "contact: a smooth potential without friction that acts within 0.2 mm, in place of Marc's",
    "the paper's areas are most likely those of different models (three and nine units): methods are compared on the nine-unit columns alone",
    "times are CPU seconds of this machine; no ratio to the paper's hours means anything",
];

/// The paper's methods in a folder.
pub struct Reproduction<'a> {
    /// Coarse, and says so.
    pub quick: bool,
    /// How studies are run.
    pub setting: &'a Setting,
    /// Folder of the results.
    pub out: &'a Path,
}

/// A study that has ended, with its winner on nine units.
struct Row {
    arm: Arm,
    results: Results,
    realised: Option<Realised>,
    winner: Option<Scene>,
}

impl Reproduction<'_> {
    /// Runs what has not ended yet; document and text of what came out.
    pub fn run(&self, interrupted: &AtomicBool) -> Result<(Value, String), Failure> {
        let mut rows = Vec::new();
        for arm in arms(self.quick)? {
            note(&format!("study {}: {}", arm.id, arm.title));
            rows.push(self.row(arm, interrupted)?);
        }
        self.report(&rows)
    }

    fn row(&self, arm: Arm, interrupted: &AtomicBool) -> Result<Row, Failure> {
        let out = self.out;
        let folder = out.join(arm.id);
        let ended: Ended = self
            .setting
            .carry_out(&arm.study, folder.clone(), interrupted)?;
        if ended.state == StudyState::Paused {
            return Err(Failure::Paused);
        }
        let winner = winning_scene(&arm, &ended.results);
        let realised = match &winner {
            Some(scene) => {
                note(&format!("{}: its winner on nine units", arm.id));
                realise(&format!("{} on nine units", arm.title), scene, self.quick)?
            }
            None => None,
        };
        if let Some(svg) = realised.as_ref().and_then(|r| r.svg.as_ref()) {
            write_picture(&out.join(format!("fig-8-{}.svg", arm.id)), svg)?;
        }
        Ok(Row {
            arm,
            results: ended.results,
            realised,
            winner,
        })
    }

    fn report(&self, rows: &[Row]) -> Result<(Value, String), Failure> {
        let (out, threads) = (self.out, self.setting.workers);
        copy(out, "hfm-salp/report/steps/motion.svg", "fig-4.svg")?;
        copy(out, "hfm-salp/report/hierarchy.svg", "fig-3.svg")?;
        copy(
            out,
            "hfm-salp/report/steps/three-units.svg",
            "fig-7-hfm-salp.svg",
        )?;
        for id in ["hfm-paper-upper", "hfm-paper-lower"] {
            copy(
                out,
                &format!("{id}/report/best.svg"),
                &format!("fig-7-{id}.svg"),
            )?;
        }
        write_picture(&out.join("fig-10.svg"), &self.fig_10(rows))?;
        write_file(&out.join("fig-10.csv"), &csv::curve(&all_curves(rows)))?;
        let table_3 = table_3(rows);
        let results = results(rows);
        write_file(&out.join("table-3.txt"), &table_3)?;
        let best = rows.iter().find(|row| row.arm.id == "hfm-salp");
        let reached = match best.and_then(|row| row.winner.as_ref()) {
            Some(scene) => reach(scene, self.quick, threads)?,
            None => Vec::new(),
        };
        let mut lines = vec![
            "The paper's methods, by our own runs".to_owned(),
            self.said(),
            format!("Table 3 from our studies:\n{table_3}"),
            format!(
                "Results (areas in mm\u{b2}, counter-clockwise positive; every winner on nine units with quad9, contact and a tolerance of 1e-8):\n{results}"
            ),
        ];
        lines.extend(reachable(&reached));
        lines.extend(
            best.and_then(|row| row.winner.as_ref())
                .map(Numbers::of)
                .iter()
                .flat_map(Numbers::lines),
        );
        lines.push(format!("machine: {}", machine()));
        lines.push(format!(
            "what differs from the paper:\n- {}",
            DIFFERENCES.join("\n- ")
        ));
        lines.push(format!("figures, tables and studies in {}", out.display()));
        let text = lines.join("\n");
        write_file(&out.join("summary.txt"), &format!("{text}\n"))?;
        let document = json!({
            "status": "ok",
            "quick": self.quick,
            "studies": rows.iter().map(row_document).collect::<Vec<_>>(),
            "reach": reached,
            "differences": DIFFERENCES,
            "machine": machine(),
            "folder": out.display().to_string(),
        });
        let pretty = serde_json::to_string_pretty(&document).unwrap_or_default();
        write_file(&out.join("summary.json"), &pretty)?;
        Ok((document, text))
    }

    /// Run time against area, best so far with its error band, all studies on one axis. Logarithmic: from voids of 1 x 1 mm areas
    /// grow by orders of magnitude.
    fn fig_10(&self, rows: &[Row]) -> String {
        let series = rows.iter().map(|row| {
            let curve = &row.results.curve;
            let step = main_step(&row.arm);
            let of_step = curve.best.iter().filter(|b| b.point.step == step);
            let steps = of_step.map(|best| BandStep {
                at: best.point.t_s,
                // Minimised is minus the area.
                middle: best.point.best.map(|objective| -objective),
                band: [best.band_high, best.band_low].map(|end| end.map(|v| -v)),
            });
            let mut steps: Vec<BandStep> = steps.filter(|s| s.middle > Some(0.0)).collect();
            // The last best so far stands until the end of the study.
            let restarts = curve.restarts.iter().filter(|r| r.step == step);
            let ends = restarts.flat_map(|r| r.points.iter().map(|p| p.t_s));
            if let (Some(last), Some(end)) = (steps.last().copied(), ends.reduce(f64::max)) {
                steps.push(BandStep { at: end, ..last });
            }
            BandSeries {
                label: row.arm.title.to_owned(),
                steps,
            }
        });
        let banded = rows.iter().any(|row| row.results.curve.bands.answered > 0);
        let bands = if banded {
            "Bands: 1.25 times the difference to a mesh of elements twice as large, where one was evaluated; their CPU time is not on the axis."
        } else {
            "No error bands."
        };
        BandPicture {
            title: "HFm and Dm: best area so far against CPU time".into(),
            x_label: "CPU time of the study (s)".into(),
            y_label: "best feasible area so far (mm\u{b2})".into(),
            scales: [Scale::Logarithmic; 2],
            within: Vec::new(),
            top: None,
            series: series.collect(),
            level: None,
            caption: vec![
                "Each method by its own objective: three units (tip at x = 160 mm) for HFm, nine (x = 640 mm) for Dm; compare methods by the table. Areas of the wrong sign, below 0, have no place.".to_owned(),
                bands.to_owned(),
                self.said(),
            ],
        }
        .svg()
    }

    fn said(&self) -> String {
        if self.quick {
            "QUICK: coarse meshes, two load steps a leg, few iterations, small budgets; the numbers are those of such a run".to_owned()
        } else {
            "full settings".to_owned()
        }
    }
}

/// The best design that the method hands on: that of the three-unit step for the framework, of the last step else.
fn winning_scene(arm: &Arm, results: &Results) -> Option<Scene> {
    let step = main_step(arm);
    let best = results.view.steps.get(step)?.best.as_ref()?;
    let study = steps::as_given(&arm.study, results, step);
    Some(winner::evaluated(&study, results, step, best)?.scene)
}

/// The step in which a method's corners are optimised.
fn main_step(arm: &Arm) -> usize {
    arm.study.index_of("three-units").unwrap_or(0)
}

/// All studies' restarts, each study as a step of one curve.
fn all_curves(rows: &[Row]) -> Curve {
    let mut all = Curve {
        axis: salp_protocol::Axis::Cpu,
        restarts: Vec::new(),
        best: Vec::new(),
        bands: BandCounts::default(),
    };
    for (k, row) in rows.iter().enumerate() {
        let step = main_step(&row.arm);
        for restart in row.results.curve.restarts.iter().filter(|r| r.step == step) {
            let mut restart = restart.clone();
            restart.step = k;
            all.restarts.push(restart);
        }
    }
    all
}

/// Table 3 of the paper: variables, constraints (aggregates and rows), side constraints, size of the analysis.
fn table_3(rows: &[Row]) -> String {
    let line = |row: &Row| {
        let study = &row.arm.study;
        let step = main_step(&row.arm);
        let variables = study.variables(step).map_or(0, |v| v.lower.len());
        let constraints = study.constraint_count(step).unwrap_or(0);
        let whole = study.body.as_ref().map_or(1, |body| body.actuator.units);
        let units = study.steps[step].model.units().unwrap_or(whole);
        vec![
            row.arm.title.to_owned(),
            variables.to_string(),
            format!("{} ({constraints} rows)", kinds(study, step)),
            (2 * variables).to_string(),
            if units == 9 {
                "full".to_owned()
            } else {
                format!("{units}/9")
            },
        ]
    };
    let lines: Vec<Vec<String>> = rows.iter().map(line).collect();
    let header = [
        "method",
        "design variables",
        "constraints",
        "side constraints",
        "FE size",
    ];
    table(&header, &lines)
}

/// Kinds of constraints: the paper counts each as one.
fn kinds(study: &salp_core::study::Study, step: usize) -> usize {
    use salp_core::study::spec::{StepConstraints, StretchLimit};
    match &study.steps[step].constraints {
        StepConstraints::Chambers(c) => {
            let stretch = usize::from(c.stretch != StretchLimit::Off);
            let margin = stretch * usize::from(c.load_margin.number().is_some());
            2 + stretch + margin + usize::from(c.wall_gap_mm.number().is_some())
        }
        StepConstraints::Counts { .. } => 0,
    }
}

fn cost(row: &Row) -> (usize, f64) {
    let paid = row
        .results
        .ledger
        .iter()
        .filter(|r| r.cached_from.is_none());
    let seconds = paid.clone().filter_map(|r| r.cpu_s).sum();
    let fe = paid.filter(|r| {
        let model = row.arm.study.steps.get(r.step).map(|s| &s.model);
        model.is_none_or(|model| model.reduced().is_none())
    });
    (fe.count(), seconds)
}

fn results(rows: &[Row]) -> String {
    let line = |row: &Row| {
        let step = main_step(&row.arm);
        let own = row
            .results
            .view
            .steps
            .get(step)
            .and_then(|s| s.best.as_ref());
        let (fe, cpu_s) = cost(row);
        let realised = row.realised.as_ref();
        let areas = realised.and_then(|r| r.areas_mm2);
        vec![
            row.arm.title.to_owned(),
            fe.to_string(),
            number(Some(cpu_s)),
            number(own.map(|best| best.objective)),
            number(realised.and_then(|r| r.three_units_mm2)),
            number(areas.map(|a| a[0])),
            number(areas.map(|a| a[1])),
            number(realised.map(|r| r.max_stretch)),
        ]
    };
    let lines: Vec<Vec<String>> = rows.iter().map(line).collect();
    let header = [
        "method",
        "FE",
        "CPU s",
        "own objective",
        "3 units",
        "9, x = 640",
        "9, x = 720",
        "stretch on 9",
    ];
    table(&header, &lines)
}

/// In which p/mu the paper's areas are reached at all by the design that was found: an inference, not the paper's setting.
fn reachable(reached: &[Reach]) -> Vec<String> {
    HEADLINES
        .iter()
        .map(|area| {
            let said = |p: Option<f64>| p.map_or("at none of the p/mu looked at".to_owned(), |p| format!("from p/mu = {p:.4}"));
            format!(
                "inference: the design of HFm in Salp's settings encloses {area} mm\u{b2} {} on three units (x = 160) and {} on nine (x = 640)",
                said(passes(reached, |r| r.three_units_mm2, *area)),
                said(passes(reached, |r| r.nine_units_mm2, *area)),
            )
        })
        .collect()
}

fn row_document(row: &Row) -> Value {
    let (fe, cpu_s) = cost(row);
    json!({
        "id": row.arm.id,
        "title": row.arm.title,
        "direct": row.arm.direct,
        "ours": row.arm.ours,
        "state": row.results.view.state,
        "fe_analyses": fe,
        "cpu_s": cpu_s,
        "realised": row.realised,
    })
}

fn machine() -> String {
    let cpu = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let model = cpu.lines().find_map(|line| line.strip_prefix("model name"));
    let model = model.map_or("unknown processor", |m| {
        m.trim_start_matches([' ', '\t', ':'])
    });
    format!(
        "{model}, {} cores; {}",
        cores(),
        salp_worker::identity::instruction_set()
    )
}

/// Copies a figure that a study's report has; one that is not there is left out.
fn copy(out: &Path, from: &str, to: &str) -> Result<(), Failure> {
    match std::fs::read_to_string(out.join(from)) {
        Ok(text) => write_picture(&out.join(to), &text),
        Err(_) => Ok(()),
    }
}
