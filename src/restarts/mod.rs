//! The restarts of a step as a sample of its method: what each found for which CPU time, and under which conditions. Reports
//! write it (`restarts.json`), `salp compare` reads it.

mod conditions;
mod figures;

use std::borrow::Cow;

use salp_core::analysis::{Sample, Trace};
use salp_core::geometry::Point;
use salp_core::scene::Goal;
use salp_core::study::Study;
use salp_protocol::RestartCurve;
use serde::{Deserialize, Serialize};

pub use conditions::{Conditions, Difference, differences};
pub use figures::{Analysis, Named};

use crate::run::active::first_order_residual;
use crate::run::document::Results;
use crate::run::steps;

/// Name of the file in a report folder.
pub const FILE: &str = "restarts.json";
/// Form of the file.
const VERSION: u32 = 1;

/// `restarts.json`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct StudyRestarts {
    /// Form of this document: 1.
    pub version: u32,
    /// Name of the study.
    pub name: String,
    /// Its state when this was written.
    pub state: String,
    /// Steps with an optimiser, in the document's order.
    pub steps: Vec<StepRestarts>,
}

/// The restarts of a step.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct StepRestarts {
    /// Id of the step.
    pub step: String,
    /// Unit of the objective; empty of a program's.
    pub unit: String,
    /// What designs are held to, and how they were sought.
    pub conditions: Conditions,
    /// CPU time of the steps that it takes from, s.
    pub before_cpu_s: f64,
    /// One for each start.
    pub runs: Vec<StartRun>,
}

/// What was done from one start: the restarts of both senses of an area, one after the other.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct StartRun {
    /// Indices of its restarts.
    pub restarts: Vec<usize>,
    /// Their CPU time, s; a result that was known is charged what it cost when it was computed.
    pub cpu_s: f64,
    /// Their evaluations.
    pub evaluations: u64,
    /// [CPU time so far (s), best objective that counts] where the best changes.
    pub best: Vec<[f64; 2]>,
    /// By how much the best design misses the first-order conditions, a share of the objective's gradient; `None` where
    /// there is none, or none with gradients.
    #[serde(default)]
    pub first_order_residual: Option<f64>,
}

impl StudyRestarts {
    /// Of a study's results.
    pub fn of(study: &Study, results: &Results) -> Self {
        let steps = (0..study.steps.len())
            .filter_map(|step| StepRestarts::of(study, results, step))
            .collect();
        Self {
            version: VERSION,
            name: study.name.clone(),
            state: results.view.state.to_string(),
            steps,
        }
    }

    /// Reads the document; the reason why it is none.
    pub fn read(text: &str) -> Result<Self, String> {
        let read: Self = serde_json::from_str(text).map_err(|error| error.to_string())?;
        if read.version == VERSION {
            Ok(read)
        } else {
            Err(format!("its version is {}, not {VERSION}", read.version))
        }
    }

    /// A step by its id, or the last one that has found something.
    pub fn step(&self, id: Option<&str>) -> Option<&StepRestarts> {
        if let Some(id) = id {
            return self.steps.iter().find(|step| step.step == id);
        }
        let found = |step: &&StepRestarts| step.sample().best().is_some();
        self.steps.iter().rfind(found).or(self.steps.last())
    }
}

impl StepRestarts {
    /// Of a step of a study; `None` where it has no restarts.
    fn of(study: &Study, results: &Results, step: usize) -> Option<Self> {
        let s = study.steps.get(step)?;
        let curves = || results.curve.restarts.iter().filter(|r| r.step == step);
        curves().next()?;
        let mut runs: Vec<(Option<&[f64]>, Trace, StartRun)> = Vec::new();
        for curve in curves() {
            let start = start(results, curve);
            let trace = trace(curve);
            let evaluations = curve.points.last().map_or(0, |point| point.evaluations);
            match runs.last_mut() {
                // The twin of the other sense follows its start.
                Some((of, before, run)) if start.is_some() && *of == start => {
                    *before = before.then(&trace);
                    run.restarts.push(curve.index);
                    run.evaluations += evaluations;
                }
                _ => {
                    let restarts = vec![curve.index];
                    let run = StartRun {
                        restarts,
                        evaluations,
                        ..StartRun::default()
                    };
                    runs.push((start, trace, run));
                }
            }
        }
        let given = results.view.steps.get(step).map_or_else(
            || Cow::Borrowed(study),
            |view| study.given(step, &steps::inputs(view).given),
        );
        let residual = |restarts: &[usize], best: f64| {
            let row = results.ledger.iter().find(|row| {
                row.step == step
                    && restarts.contains(&row.restart)
                    && row.fidelity.is_none()
                    && row.objective == Some(best)
            })?;
            first_order_residual(&given, step, &row.x, row.outcome.as_ref()?)
        };
        let told = |(_, trace, run): (_, Trace, StartRun)| StartRun {
            cpu_s: trace.total(),
            first_order_residual: trace
                .steps()
                .last()
                .and_then(|(_, best)| residual(&run.restarts, *best)),
            best: trace
                .steps()
                .iter()
                .map(|(cost, best)| [*cost, *best])
                .collect(),
            ..run
        };
        let goal: Option<&Goal<Point>> = s.target.as_ref().map(|target| &target.goal);
        let needed = study.needed_for(&s.id);
        let before = |row: &&salp_protocol::EvaluationRow| {
            let id = study.steps.get(row.step).map(|other| &other.id);
            let steps = needed.iter().flat_map(|n| &n.steps);
            row.step != step && steps.into_iter().any(|n| Some(&n.id) == id)
        };
        Some(Self {
            step: s.id.clone(),
            unit: goal.map_or_else(String::new, |goal| goal.unit().to_owned()),
            conditions: Conditions::of(study, step),
            before_cpu_s: results
                .ledger
                .iter()
                .filter(before)
                .filter_map(|row| row.cpu_s)
                .sum(),
            runs: runs.into_iter().map(told).collect(),
        })
    }

    /// For statistics.
    pub fn sample(&self) -> Sample {
        let trace = |run: &StartRun| {
            let points = run.best.iter().map(|[cost, best]| (*cost, Some(*best)));
            Trace::new(points.chain([(run.cpu_s, None)]))
        };
        Sample {
            before: self.before_cpu_s,
            runs: self.runs.iter().map(trace).collect(),
        }
    }

    /// By how much the best design of each start misses the first-order conditions, the nearest first; starts without
    /// gradients are left out.
    pub fn first_order_residuals(&self) -> Vec<f64> {
        let runs = self.runs.iter();
        let mut residuals: Vec<f64> = runs.filter_map(|run| run.first_order_residual).collect();
        residuals.sort_by(f64::total_cmp);
        residuals
    }

    /// Number of restarts; each start has one for each sense.
    pub fn restarts(&self) -> usize {
        self.runs.iter().map(|run| run.restarts.len()).sum()
    }
}

fn trace(curve: &RestartCurve) -> Trace {
    Trace::new(curve.points.iter().map(|point| (point.t_s, point.best)))
}

/// The first design of a restart that has a sense of the area.
fn start<'a>(results: &'a Results, curve: &RestartCurve) -> Option<&'a [f64]> {
    let mut restarts = results.restarts.iter();
    let restart = restarts.find(|r| (r.step, r.index) == (curve.step, curve.index))?;
    restart.summary["orientation"].as_str()?;
    let mut rows = results.ledger.iter();
    let first = rows.find(|row| (row.step, row.restart) == (curve.step, curve.index))?;
    Some(&first.x)
}
