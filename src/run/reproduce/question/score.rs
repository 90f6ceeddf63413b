//! What a restart's design is worth: its areas as nine units.

use std::path::Path;

use salp_core::scene::Scene;
use salp_core::study::spec::StepConstraints;
use salp_core::study::{BestPoint, Study};
use salp_protocol::{EvaluationRow, RestartView};
use serde::{Deserialize, Serialize};

use crate::failure::Failure;
use crate::output::write_file;
use crate::run::reproduce::realised::realise;
use crate::stopwatch::thread_cpu_seconds;

/// A design counts where its averaged stretch on nine units is at most this much beyond the limit.
const BEYOND_LIMIT: f64 = 1.05;

/// A restart and its design as nine units.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Scored {
    /// Index of the restart.
    pub restart: usize,
    /// Design variables; none where nothing within the limits was found.
    pub x: Option<Vec<f64>>,
    /// Its own objective.
    pub objective: Option<f64>,
    /// |A| at the ends of units 8 and 9, mm^2, where the design counts.
    pub areas_mm2: Option<[f64; 2]>,
    /// Largest averaged stretch on nine units.
    pub max_stretch: Option<f64>,
    /// CPU seconds of its evaluations.
    pub search_cpu_s: f64,
    /// CPU seconds of the nine units.
    pub realised_cpu_s: f64,
    /// Finite-element analyses.
    pub analyses: usize,
}

impl Scored {
    /// CPU seconds of all of it.
    pub fn cpu_s(&self) -> f64 {
        self.search_cpu_s + self.realised_cpu_s
    }
}

/// The scene of a restart's best design.
pub fn scene(study: &Study, best: &BestPoint) -> Option<Scene> {
    study.scene(0, &best.x, best.orientation).ok()
}

/// The best design that counts of a restart.
pub fn best(restart: &RestartView) -> Option<BestPoint> {
    serde_json::from_value(restart.summary.get("best")?.clone()).ok()?
}

/// Scores a restart, or reads the score that `file` keeps.
pub fn score(
    study: &Study,
    restart: &RestartView,
    ledger: &[EvaluationRow],
    quick: bool,
    file: &Path,
) -> Result<Scored, Failure> {
    let kept = std::fs::read_to_string(file).ok();
    if let Some(kept) = kept.and_then(|text| serde_json::from_str(&text).ok()) {
        return Ok(kept);
    }
    let best = best(restart);
    let before = thread_cpu_seconds();
    let scene = best.as_ref().and_then(|best| scene(study, best));
    let realised = match &scene {
        Some(scene) => realise("", scene, quick)?,
        None => None,
    };
    let own = ledger
        .iter()
        .filter(|row| row.restart == restart.index && row.finished_ms.is_some());
    let limit = BEYOND_LIMIT * stretch_limit(study).unwrap_or(f64::INFINITY);
    let scored = Scored {
        restart: restart.index,
        objective: best.as_ref().map(|best| best.objective),
        x: best.map(|best| best.x),
        areas_mm2: realised
            .as_ref()
            .filter(|r| r.max_stretch <= limit)
            .and_then(|r| r.areas_mm2)
            .map(|areas| areas.map(f64::abs)),
        max_stretch: realised.as_ref().map(|r| r.max_stretch),
        search_cpu_s: own.clone().filter_map(|row| row.cpu_s).sum(),
        realised_cpu_s: thread_cpu_seconds() - before,
        analyses: own.count(),
    };
    let text = serde_json::to_string(&scored).unwrap_or_default();
    write_file(file, &text)?;
    Ok(scored)
}

fn stretch_limit(study: &Study) -> Option<f64> {
    match &study.steps.first()?.constraints {
        StepConstraints::Chambers(constraints) => study.body.as_ref()?.stretch_limit(constraints),
        StepConstraints::Counts { .. } => None,
    }
}
