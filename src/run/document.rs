//! The results of a study as the document that `salp run --json` prints.

use salp_core::study::Study;
use salp_core::study::race::Fidelity;
use salp_protocol::{
    Axis, Best, BestSoFar, Curve, EvaluationRow, RestartView, StepState, StepView, StudyId,
    StudyState, StudyView,
};
use salp_worker::Client;
use serde_json::{Value, json};

use super::active::ActiveLimits;
use super::optima::{self, Listed};
use super::progress::label;
use crate::failure::Failure;
use crate::show::stop_reason;

/// Kind of the rows of guesses.
const GUESS: &str = "guess";

/// Everything that a report needs.
pub struct Results {
    /// The study.
    pub view: StudyView,
    /// Its restarts.
    pub restarts: Vec<RestartView>,
    /// Its ledger, by restart in the optimiser's order.
    pub ledger: Vec<EvaluationRow>,
    /// The evaluations of its error bands.
    pub bands: Vec<EvaluationRow>,
    /// Guesses at what the optimisers would ask.
    pub guesses: Vec<EvaluationRow>,
    /// The best distinct designs of each step.
    pub optima: Vec<Vec<Listed>>,
    /// Run time against objective.
    pub curve: Curve,
    /// Active limits at each step's best design.
    active: Vec<Option<ActiveLimits>>,
    /// Wall time, s.
    pub seconds: f64,
}

impl Results {
    /// Asks the coordinator for everything.
    pub fn fetch(
        client: &Client,
        id: &StudyId,
        study: &Study,
        seconds: f64,
    ) -> Result<Self, Failure> {
        let rows = client.evaluations(id, true)?.into_iter();
        let (guesses, rows): (Vec<_>, Vec<_>) = rows.partition(|row| row.kind == GUESS);
        let rows = rows.into_iter();
        let (bands, mut ledger): (Vec<_>, Vec<_>) = rows.partition(|row| row.band_of.is_some());
        ledger.sort_by_key(|row| (row.step, row.restart, row.batch, row.batch_index));
        let view = client.study(id)?;
        let active = |(step, s): (usize, &StepView)| {
            let best = s.best.as_ref()?;
            let row = ledger.iter().find(|r| r.evaluation == best.evaluation)?;
            let given = study.given(step, &super::steps::inputs(s).given);
            ActiveLimits::of(&given, step, &best.x, row.outcome.as_ref()?)
        };
        let candidates = client.candidates(id)?;
        let of_step = |step| optima::of_step(study, step, &candidates, &ledger, &bands);
        let optima = view.steps.iter().enumerate().map(of_step).collect();
        Ok(Self {
            active: view.steps.iter().enumerate().map(active).collect(),
            optima,
            view,
            restarts: client.restarts(id)?,
            ledger,
            bands,
            guesses,
            curve: client.curve(id, Axis::Cpu)?,
            seconds,
        })
    }

    /// A name for a restart.
    pub fn label(&self, study: &Study, step: usize, index: usize) -> String {
        let found = self
            .restarts
            .iter()
            .find(|r| (r.step, r.index) == (step, index));
        let summary = found.map_or(&Value::Null, |r| &r.summary);
        label(study, step, index, summary)
    }

    /// Why the study failed.
    pub fn failure(&self) -> Option<&str> {
        self.view.failure.as_deref()
    }

    /// The best point of the last step that has one, and that step's index.
    pub fn best(&self) -> Option<(usize, &Best)> {
        self.view
            .steps
            .iter()
            .enumerate()
            .rev()
            .find_map(|(step, view)| Some((step, view.best.as_ref()?)))
    }

    /// The error band of a step's best design.
    pub fn band(&self, step: usize) -> Option<[f64; 2]> {
        let of_step = |best: &&BestSoFar| best.point.step == step;
        let last = self.curve.best.iter().rfind(of_step)?;
        Some([last.band_low?, last.band_high?])
    }

    /// Active limits at a step's best design.
    pub fn active(&self, step: usize) -> Option<&ActiveLimits> {
        self.active.get(step)?.as_ref()
    }

    /// The document.
    pub fn document(&self, state: StudyState) -> Value {
        let steps: Vec<Value> = (0..self.view.steps.len())
            .map(|step| self.step(step, state))
            .collect();
        json!({
            "study_id": self.view.id,
            "status": state,
            "steps": steps,
            "bands": self.view.counts.bands,
            "guesses": self.view.counts.guesses,
            "seconds": self.seconds,
        })
    }

    fn step(&self, step: usize, state: StudyState) -> Value {
        let view = &self.view.steps[step];
        let status = match (view.state, state) {
            (StepState::Running, StudyState::Done) => "done".to_owned(),
            (StepState::Running, state) => state.to_string(),
            (state, _) => json!(state).as_str().unwrap_or_default().to_owned(),
        };
        let best = view.best.as_ref().map(|best| {
            json!({
                "x": best.x,
                "objective": best.objective,
                "max_violation": best.max_violation,
                "evaluation": best.evaluation,
                "band": self.band(step),
                "limits": self.active(step).map(ActiveLimits::document),
            })
        });
        let restarts: Vec<Value> = self
            .restarts
            .iter()
            .filter(|r| r.step == step)
            .map(|r| self.restart(r))
            .collect();
        let listed = self.optima.get(step).into_iter().flatten();
        let candidates: Vec<Value> = listed.filter_map(Listed::document).collect();
        json!({
            "id": view.id,
            "status": status,
            "inputs": view.inputs,
            "best": best,
            "candidates": candidates,
            "race": view.race,
            "restarts": restarts,
        })
    }

    fn restart(&self, restart: &RestartView) -> Value {
        let rows: Vec<&EvaluationRow> = self
            .ledger
            .iter()
            .filter(|row| (row.step, row.restart) == (restart.step, restart.index))
            .filter(|row| row.finished_ms.is_some())
            .collect();
        let summary = &restart.summary;
        let said = |name: &str| summary.get(name).cloned().unwrap_or(Value::Null);
        let x: Option<Vec<f64>> = serde_json::from_value(said("x")).ok();
        let fidelity = serde_json::from_value::<Option<Fidelity>>(said("fidelity"));
        let fidelity = fidelity.unwrap_or_default();
        // The optimiser keeps no violation of its final point; the ledger does.
        let max_violation = rows
            .iter()
            .filter(|row| row.fidelity == fidelity)
            .rfind(|row| Some(&row.x) == x.as_ref() && row.objective.is_some())
            .and_then(|row| row.max_violation);
        let mut document = json!({
            "index": restart.index,
            "seed": said("seed"),
            "stop_reason": stop_reason(summary),
            "analyses": said("analyses"),
            "gradients": said("gradients"),
            "iterations": said("iterations"),
            "x": x,
            "objective": said("objective"),
            "max_violation": max_violation,
            "history_sha256": restart.history_sha256,
            "history": rows.into_iter().map(entry).collect::<Vec<Value>>(),
        });
        if !said("race").is_null() {
            document["stop"] = said("stop");
            document["fidelity"] = json!(fidelity);
            document["race"] = said("race");
        }
        document
    }
}

fn entry(row: &EvaluationRow) -> Value {
    let mut entry = json!({
        "evaluation": row.evaluation,
        "kind": row.kind,
        "x": row.x,
        "objective": row.objective,
        "constraints": row.outcome.as_ref().map_or(&[][..], |o| &o.constraints),
        "iteration": row.iteration,
        "outcome": row.status,
        "cpu_s": row.cpu_s,
        "worker": row.worker,
    });
    if let Some(fidelity) = row.fidelity {
        entry["fidelity"] = json!(fidelity);
    }
    entry
}
