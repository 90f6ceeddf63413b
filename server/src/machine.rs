//! What the coordinator asks of a study. The state of a restart is opaque JSON to everything outside this file.

use salp_core::fault::Faults;
use salp_core::hierarchy::{self, Due, Progress, StepResult};
use salp_core::study::race::{self, Decision, RaceRecord, RaceSummary};
use salp_core::study::spec::StudyStep;
use salp_core::study::{
    self, EvaluationRequest, Given, Outcome, OutcomeStatus, RestartState, RestartStep, StepInputs,
    Study, StudyError,
};
use salp_protocol::StepState;
use serde::Deserialize as _;
use serde_json::{Value, json};

use crate::store::StoredStep;

/// A study whose restarts can be begun and stepped: pure functions of their arguments.
pub struct StudyMachine {
    study: Study,
}

/// A restart after its beginning or after a step.
#[derive(Clone, Debug)]
pub struct Advance {
    /// State to store.
    pub state: Value,
    /// The next batch; empty where the restart is done.
    pub asks: Vec<EvaluationRequest>,
    /// What it will probably ask after that.
    pub guesses: Vec<EvaluationRequest>,
    /// Error bands of what a restart that has ended may hand on, each with its place in the optimiser's order.
    pub bands: Vec<(usize, BandAsk)>,
    /// Whether the optimiser stopped.
    pub done: bool,
    /// Whether the restart waits for a decision, with nothing asked.
    pub waits: bool,
    /// Whether it shows more to the restarts that compete with it than before.
    pub shows_more: bool,
    /// What the optimiser says of itself, for people and for reports.
    pub summary: Value,
}

/// Whether a point counts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Verdict {
    /// Largest violation of a constraint, 0 when none; `None` without values.
    pub max_violation: Option<f64>,
    /// Within the optimiser's violation tolerance.
    pub feasible: bool,
    /// Walls cross somewhere on the path.
    pub overlap: bool,
    /// May be a best point: feasible, free of overlap, on a stable branch, at the study's own fidelity.
    pub counts: bool,
}

/// What the coordinator makes of an outcome.
#[derive(Clone, Debug, PartialEq)]
pub struct Judgement {
    /// Whether the point counts.
    pub verdict: Verdict,
    /// What is asked for its error band, should it be the best so far; `None` where it will have none.
    pub band: Option<BandAsk>,
}

/// The evaluation of an error band.
#[derive(Clone, Debug, PartialEq)]
pub struct BandAsk {
    /// What is asked.
    pub request: EvaluationRequest,
    /// Key of the result.
    pub key: String,
}

/// An optimiser that broke: the study fails with this text.
#[derive(Debug, thiserror::Error)]
#[error("step {step}, restart {restart}: failed to {reason}")]
pub struct MachineError {
    /// Index of the step.
    pub step: usize,
    /// Index of the restart.
    pub restart: usize,
    /// What failed.
    pub reason: String,
}

impl StudyMachine {
    /// Reads and checks a document. `allow_commands`: its models may be programs.
    ///
    /// # Errors
    /// Every fault of the document, each with its path.
    pub fn read(document: &Value, allow_commands: bool) -> Result<Self, Faults> {
        let study = study::read_study(document, allow_commands)?;
        study.unchosen_meshes().check(Self { study })
    }

    /// The study.
    pub fn study(&self) -> &Study {
        &self.study
    }

    /// Ids of the steps, in order.
    pub fn steps(&self) -> Vec<String> {
        let steps = self.study.steps.iter();
        steps.map(|step| step.id.clone()).collect()
    }

    /// Whether the evaluations of a step start programs.
    pub fn starts_programs(&self, step: usize) -> bool {
        let step = self.study.steps.get(step);
        step.is_some_and(|step| matches!(step.model, study::spec::Model::Command(_)))
    }

    /// What is due among the steps: `progress` has one entry for each.
    pub fn due(&self, progress: &[Progress]) -> Result<Vec<Due>, MachineError> {
        hierarchy::due(&self.study, progress).map_err(|e| MachineError {
            step: 0,
            restart: 0,
            reason: e.to_string(),
        })
    }

    /// How far a step is, from what is stored of it.
    pub fn progress(&self, step: &StoredStep) -> Result<Progress, MachineError> {
        Ok(match step.state {
            StepState::Waiting => Progress::Waiting,
            StepState::Running => Progress::Running,
            StepState::Blocked => Progress::Blocked,
            StepState::Done => {
                let result = step
                    .result
                    .clone()
                    .unwrap_or_else(|| json!(StepResult::default()));
                let result = serde_json::from_value(result).map_err(|e| MachineError {
                    step: step.step,
                    restart: 0,
                    reason: format!("read its own result back: {e}"),
                })?;
                Progress::Done(result)
            }
        })
    }

    /// What an ended step hands on. `restarts` are the indices and states of its restarts.
    pub fn result(
        &self,
        step: usize,
        restarts: Vec<(usize, Value)>,
    ) -> Result<Value, MachineError> {
        let broke = |restart, reason: String| MachineError {
            step,
            restart,
            reason,
        };
        let mut kept = Vec::new();
        let mut given = Given::default();
        for (index, state) in restarts {
            let state: RestartState = serde_json::from_value(state)
                .map_err(|e| broke(index, format!("read its own state back: {e}")))?;
            given = state.spec.given.clone();
            kept.extend(
                state
                    .candidates()
                    .iter()
                    .map(|point| (index, point.clone())),
            );
        }
        let result = StepResult::of(&self.study, step, &given, &kept)
            .map_err(|e| broke(0, e.to_string()))?;
        serde_json::to_value(result).map_err(|e| broke(0, format!("store its result: {e}")))
    }

    /// The restarts of a step that takes `inputs`, each with its first batch.
    pub fn begin(&self, step: usize, inputs: &StepInputs) -> Result<Vec<Advance>, MachineError> {
        let broke = |restart, reason: StudyError| MachineError {
            step,
            restart,
            reason: reason.to_string(),
        };
        let specs = self.study.restarts(step, inputs).map_err(|e| broke(0, e))?;
        specs
            .iter()
            .map(|spec| {
                let (state, asks) =
                    study::begin(&self.study, spec).map_err(|e| broke(spec.index, e))?;
                self.stored(&state, asks, false)
            })
            .collect()
    }

    /// One step of a restart: `outcomes` are the answers to its last batch, in the batch's order.
    pub fn advance(
        &self,
        step: usize,
        restart: usize,
        state: Value,
        outcomes: &[Outcome],
    ) -> Result<Advance, MachineError> {
        let broke = |reason: String| MachineError {
            step,
            restart,
            reason,
        };
        let state: RestartState = serde_json::from_value(state)
            .map_err(|e| broke(format!("read its own state back: {e}")))?;
        let next = study::step(&self.study, &state, outcomes).map_err(|e| broke(e.to_string()))?;
        self.moved(&state, next)
    }

    /// What a step of a restart leads to.
    fn moved(&self, before: &RestartState, next: RestartStep) -> Result<Advance, MachineError> {
        let shows_more = before.race_record() != next.state.race_record();
        let bands = if next.done.is_some() {
            self.bands(&next.state)?
        } else {
            Vec::new()
        };
        let advance = self.stored(&next.state, next.asks, next.done.is_some())?;
        Ok(Advance {
            bands,
            shows_more,
            ..advance
        })
    }

    /// The bands of the designs that a restart which has ended may hand on.
    fn bands(&self, state: &RestartState) -> Result<Vec<(usize, BandAsk)>, MachineError> {
        let spec = &state.spec;
        let points = state.candidates().iter();
        let kept: Vec<_> = points.map(|point| (spec.index, point.clone())).collect();
        let result = StepResult::of(&self.study, spec.step, &spec.given, &kept);
        let result = result.map_err(|e| MachineError {
            step: spec.step,
            restart: spec.index,
            reason: e.to_string(),
        })?;
        let chosen = result.candidates.iter().map(|c| c.evaluation);
        let mut bands = Vec::new();
        for place in chosen {
            let point = kept.iter().find(|(_, point)| point.evaluation == place);
            let request = point.map(|(_, point)| state.request_again(point));
            if let Some(request) = request.and_then(|request| self.study.band(&request)) {
                let key = self.key(&request)?;
                bands.push((place, BandAsk { request, key }));
            }
        }
        Ok(bands)
    }

    /// Whether the restarts of a step compete.
    pub fn competes(&self, step: usize) -> bool {
        let step = self.study.steps.get(step);
        step.is_some_and(|step| !step.restarts.competition.is_none())
    }

    /// What the restarts of a step show each other, from their summaries.
    fn records(step: usize, summaries: &[&Value]) -> Result<Vec<RaceRecord>, MachineError> {
        let record = |(restart, summary): (usize, &&Value)| {
            RaceRecord::deserialize(&summary["race"]).map_err(|e| MachineError {
                step,
                restart,
                reason: format!("read what it shows the others: {e}"),
            })
        };
        summaries.iter().enumerate().map(record).collect()
    }

    /// The decisions that can be taken now among the restarts of a step, by index. `inputs`: what the step took; `summaries`:
    /// one for each restart, in order.
    pub fn decisions(
        &self,
        step: usize,
        inputs: &StepInputs,
        summaries: &[&Value],
    ) -> Result<Vec<(usize, Decision)>, MachineError> {
        let records = Self::records(step, summaries)?;
        let study = self.study.given(step, &inputs.given);
        let competition = study.step(step).map_err(|e| MachineError {
            step,
            restart: 0,
            reason: e.to_string(),
        })?;
        let competition = &competition.restarts.competition;
        let far = f64::INFINITY;
        let distance = |a: &[f64], b: &[f64]| study.scaled_distance(step, a, b).unwrap_or(far);
        Ok(race::due(competition, &records, &distance))
    }

    /// A restart after the decision for which it waits.
    pub fn pass(
        &self,
        step: usize,
        restart: usize,
        state: Value,
        decision: &Decision,
    ) -> Result<Advance, MachineError> {
        let broke = |reason: String| MachineError {
            step,
            restart,
            reason,
        };
        let state: RestartState = serde_json::from_value(state)
            .map_err(|e| broke(format!("read its own state back: {e}")))?;
        let next = study::pass(&self.study, &state, decision).map_err(|e| broke(e.to_string()))?;
        self.moved(&state, next)
    }

    /// A restart that goes on though the competition stopped it; `None` where it was not stopped so.
    pub fn resume(
        &self,
        step: usize,
        restart: usize,
        state: Value,
    ) -> Result<Option<Advance>, MachineError> {
        let broke = |reason: String| MachineError {
            step,
            restart,
            reason,
        };
        let state: RestartState = serde_json::from_value(state)
            .map_err(|e| broke(format!("read its own state back: {e}")))?;
        let next = study::resume(&self.study, &state).map_err(|e| broke(e.to_string()))?;
        next.map(|next| self.moved(&state, next)).transpose()
    }

    /// Indices of the steps that take from a step.
    pub fn takers(&self, step: usize) -> Vec<usize> {
        let takes = |s: &StudyStep| {
            s.takes
                .iter()
                .any(|t| self.study.index_of(&t.step) == Some(step))
        };
        let steps = self.study.steps.iter().enumerate();
        steps.filter(|(_, s)| takes(s)).map(|(k, _)| k).collect()
    }

    /// The competition of a step as a whole; `None` where its restarts do not compete, or cannot be read.
    pub fn race(&self, step: usize, summaries: &[&Value]) -> Option<RaceSummary> {
        let competition = &self.study.steps.get(step)?.restarts.competition;
        let records = Self::records(step, summaries).ok()?;
        RaceSummary::of(competition, &records).filter(|_| !summaries.is_empty())
    }

    /// A restart as it is stored.
    fn stored(
        &self,
        state: &RestartState,
        asks: Vec<EvaluationRequest>,
        done: bool,
    ) -> Result<Advance, MachineError> {
        let (step, restart) = (state.spec.step, state.spec.index);
        let broke = |reason: String| MachineError {
            step,
            restart,
            reason,
        };
        let waits = state.waits_at().is_some();
        // An optimiser that neither asks nor stops would hang its study.
        if (done || waits) != asks.is_empty() {
            return Err(broke(format!(
                "go on: it has {} and asks for {} points",
                if done { "stopped" } else { "not stopped" },
                asks.len()
            )));
        }
        let text =
            serde_json::to_value(state).map_err(|e| broke(format!("store its state: {e}")))?;
        let guesses = study::speculate(&self.study, state).map_err(|e| broke(e.to_string()))?;
        let last = state.final_point();
        let fidelity = state
            .fidelity(&self.study)
            .map_err(|e| broke(e.to_string()))?;
        Ok(Advance {
            state: text,
            asks,
            guesses,
            bands: Vec::new(),
            done,
            waits,
            shows_more: false,
            summary: json!({
                "seed": state.spec.seed,
                "start": state.spec.start_kind,
                "drawn": state.spec.drawn,
                "orientation": state.spec.orientation,
                "x0": state.spec.x0,
                "stop": state.stop,
                "evaluations": state.evaluations,
                "analyses": state.optimiser.analyses(),
                "gradients": state.optimiser.gradients(),
                "iterations": state.optimiser.iteration(),
                "replans": state.replans,
                "multipliers": state.optimiser.multipliers(),
                "x": last.map(|point| &point.x),
                "objective": last.map(|point| point.objective),
                "best": state.best,
                "best_with_overlap": state.best_with_overlap,
                "history_sha256": state.history_sha256,
                "fidelity": fidelity,
                "race": state.race_record(),
            }),
        })
    }

    /// Hash of model, mesh plan, settings, design bits and what is wanted. Build and instruction set stand beside it in
    /// the store.
    pub fn key(&self, request: &EvaluationRequest) -> Result<String, MachineError> {
        request.key(&self.study, "").map_err(|e| broke(request, &e))
    }

    /// The outcome as it may be stored, and what is wrong with it as an answer to the request, if anything: a wrong
    /// length, a missing or non-finite number.
    pub fn checked(
        &self,
        request: &EvaluationRequest,
        outcome: &Outcome,
    ) -> Result<(Outcome, Option<String>), MachineError> {
        let study = self.study.given(request.step, &request.given);
        let checked = study
            .checked(request, outcome)
            .map_err(|e| broke(request, &e))?;
        let nonsense = match &checked.status {
            OutcomeStatus::InvalidResult { reason } => Some(reason.clone()),
            _ => None,
        };
        Ok((checked, nonsense))
    }

    /// Whether a point counts, and what its error band asks for.
    pub fn judge(
        &self,
        request: &EvaluationRequest,
        outcome: &Outcome,
    ) -> Result<Judgement, MachineError> {
        let verdict = self.verdict(request, outcome)?;
        let band = self.study.band(request).filter(|_| verdict.counts);
        let band = band.map(|request| {
            let key = self.key(&request)?;
            Ok(BandAsk { request, key })
        });
        Ok(Judgement {
            verdict,
            band: band.transpose()?,
        })
    }

    fn verdict(
        &self,
        request: &EvaluationRequest,
        outcome: &Outcome,
    ) -> Result<Verdict, MachineError> {
        // A band says something of a point, and is none.
        if outcome.objective.is_none() || request.second_mesh {
            return Ok(Verdict::WITHOUT_VALUES);
        }
        let broke = |e: StudyError| broke(request, &e);
        let study = self.study.given(request.step, &request.given);
        let problem = study.problem(request.step).map_err(broke)?;
        let step = study.step(request.step).map_err(broke)?;
        let violation = problem.violation(&outcome.constraints);
        let feasible = violation <= step.optimiser.violation_tolerance();
        let overlap = outcome.walls_overlap();
        Ok(Verdict {
            max_violation: Some(violation),
            feasible,
            overlap,
            counts: feasible && !overlap && !outcome.is_unstable() && request.fidelity.is_none(),
        })
    }
}

fn broke(request: &EvaluationRequest, error: &StudyError) -> MachineError {
    MachineError {
        step: request.step,
        restart: 0,
        reason: error.to_string(),
    }
}

impl Judgement {
    /// Of an outcome without values.
    pub const WITHOUT_VALUES: Self = Self {
        verdict: Verdict::WITHOUT_VALUES,
        band: None,
    };
}

impl Verdict {
    /// Of an outcome without values.
    pub const WITHOUT_VALUES: Self = Self {
        max_violation: None,
        feasible: false,
        overlap: false,
        counts: false,
    };
}
