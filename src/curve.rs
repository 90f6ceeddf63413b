//! `salp curve`: run time against objective of a study.

use std::path::PathBuf;

use clap::{Args, ValueEnum};
use salp_core::picture::{BestPoint, CurvePicture, CurvePoint, CurveSeries};
use salp_protocol::{Axis, Curve, csv};
use serde_json::json;

use crate::client::StudyArguments;
use crate::failure::Failure;
use crate::output::{Output, number, write_file};

/// Arguments of `salp curve`.
#[derive(Args)]
pub struct CurveVerb {
    #[command(flatten)]
    study: StudyArguments,
    /// What runs along the curve
    #[arg(long, value_enum, default_value_t = AxisArgument::Cpu)]
    axis: AxisArgument,
    /// Form of the answer
    #[arg(long, value_enum, default_value_t = Format::Csv)]
    format: Format,
    /// Writes to a file instead of standard output
    #[arg(long)]
    out: Option<PathBuf>,
}

/// What runs along a curve.
#[derive(Clone, Copy, ValueEnum)]
pub enum AxisArgument {
    /// CPU time of a restart
    Cpu,
    /// Wall time of the study
    Wall,
    /// Number of evaluations
    Evaluations,
}

#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Format {
    Csv,
    Json,
    Svg,
}

impl CurveVerb {
    /// Prints or writes a curve.
    pub fn run(self, output: Output) -> Result<(), Failure> {
        let (client, id) = self.study.open()?;
        let axis = match self.axis {
            AxisArgument::Cpu => Axis::Cpu,
            AxisArgument::Wall => Axis::Wall,
            AxisArgument::Evaluations => Axis::Evaluations,
        };
        let curve = client.curve(&id, axis)?;
        let format = if output.json && self.out.is_none() {
            Format::Json
        } else {
            self.format
        };
        let text = match format {
            Format::Json => json!(curve).to_string(),
            Format::Csv => csv::curve(&curve),
            Format::Svg => {
                let name = client.study(&id)?.name;
                let label = |_: usize, index: usize| format!("restart {index}");
                picture(&curve, &name, "", label, Vec::new()).svg()
            }
        };
        match &self.out {
            None => output.line(text.trim_end()),
            Some(file) => {
                write_file(file, &text)?;
                let path = file.display().to_string();
                output.print(&json!({ "status": "ok", "file": path }), || {
                    format!("wrote {path}")
                });
            }
        }
        Ok(())
    }
}

/// A curve as a picture. A restart's line is its best feasible objective so far, overlapping walls included; the parts
/// that rest on overlapping walls are marked. Points below the study's own fidelity cost and do not count. `unit` ends the label of the objective, ` (mm²)`.
pub fn picture(
    curve: &Curve,
    name: &str,
    unit: &str,
    label: impl Fn(usize, usize) -> String,
    mut caption: Vec<String>,
) -> CurvePicture {
    if curve.bands.evaluations > 0 {
        caption.push(format!(
            "error band: 1.25 times the difference to a mesh of elements twice as large, about each best so far; a tie lies within the band before it; {} evaluations of bands, {} s of CPU, not on the axis",
            curve.bands.answered,
            number(Some(curve.bands.cpu_s))
        ));
    }
    let all = || curve.restarts.iter().flat_map(|restart| &restart.points);
    let coarse = all().filter(|point| point.coarse).count();
    if coarse > 0 {
        caption.push(format!(
            "{coarse} of {} evaluations below the study's own fidelity: their CPU time is on the axis, their objectives are not",
            all().count()
        ));
    }
    let at = |point: &salp_protocol::CurvePoint| match curve.axis {
        Axis::Evaluations => point.evaluations as f64,
        Axis::Cpu | Axis::Wall => point.t_s,
    };
    let restarts = curve
        .restarts
        .iter()
        .map(|restart| {
            let mut best: Option<CurvePoint> = None;
            let mut points = Vec::new();
            for point in &restart.points {
                if let (Some(objective), true) = (point.objective, point.feasible && !point.coarse)
                    && best.is_none_or(|b| objective < b.objective)
                {
                    best = Some(CurvePoint {
                        at: at(point),
                        objective,
                        overlapped: point.overlap,
                    });
                }
                points.extend(best.map(|b| CurvePoint { at: at(point), ..b }));
            }
            CurveSeries {
                label: label(restart.step, restart.index),
                points,
            }
        })
        .collect();
    // The best over all restarts, of the last step that has points.
    let last = curve.best.iter().map(|best| best.point.step).max();
    let best = curve
        .best
        .iter()
        .filter(|best| Some(best.point.step) == last)
        .filter_map(|best| {
            Some(BestPoint {
                at: at(&best.point),
                objective: best.point.best?,
                band: best.band_low.zip(best.band_high),
                tie: best.tie,
            })
        })
        .collect();
    let (time_label, against) = match curve.axis {
        Axis::Cpu => (
            "CPU time (s): of the restart; of the study for the best so far",
            "CPU time",
        ),
        Axis::Wall => ("wall time of the study (s)", "wall time"),
        Axis::Evaluations => (
            "evaluations: of the restart; of the study for the best so far",
            "evaluations",
        ),
    };
    CurvePicture {
        title: format!("{name}: objective against {against}"),
        time_label: time_label.into(),
        objective_label: format!("best feasible objective so far{unit}"),
        restarts,
        best,
        caption,
    }
}
