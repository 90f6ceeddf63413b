//! A restart: an optimiser's run with its mesh plan, as a pure function of (state, outcomes).
//!
//! ```text
//! begin(study, spec)            -> state, requests
//! step(study, state, outcomes)  -> state, requests | stop
//! ```
//! A state is a plain record: stored as JSON and read back it goes on bit by bit. Outcomes are told in the order of the
//! requests; who evaluated them, and when, has no influence.
//!
//! *Mesh plan.* The element counts of an evaluation come from one design, the plan base. A trial so far from the iterate that
//! its acceptance would change the base has its own plan, and becomes the base if it becomes the iterate. After each
//! iteration of the optimiser the iterate's own plan is looked at; where its counts differ and many short steps have led
//! some way from the base, or where the plan could not follow a trial, the iterate becomes the base and is evaluated again
//! (kind `Replan`), and the optimiser restarts its memories. Should that evaluation fail, the run goes on with the plan that it had.

mod gate;
mod plan;
mod speculation;

pub use gate::{pass, resume};
pub use speculation::speculate;

use serde::{Deserialize, Serialize};

use super::error::StudyError;
use super::fingerprint::{HistoryEntry, empty_history, extend_history};
use super::race::{DominationRule, Merit};
use super::result::{EvaluationRequest, Outcome, OutcomeStatus};
use super::spec::Study;
use super::start::RestartSpec;
use crate::optimiser::{
    self, Ask, AskKind, OptimiserOptions, OptimiserState, Point, StopReason, Told,
};
use crate::scene::Orientation;

/// Points of a sample that are kept for each candidate of its step: near ones count as one candidate later.
const KEPT_PER_CANDIDATE: usize = 8;

/// A restart between two batches of evaluations.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RestartState {
    /// Where it began.
    pub spec: RestartSpec,
    /// The optimiser's run.
    pub optimiser: OptimiserState,
    /// The design from which element counts are chosen; `None` for models without a mesh, and where the optimiser does not
    /// walk from point to point: there each point has its own.
    pub plan_base: Option<Vec<f64>>,
    /// Evaluations that are waited for.
    pub pending: Vec<EvaluationRequest>,
    /// Evaluations told so far.
    pub evaluations: usize,
    /// Changes of the mesh plan so far.
    pub replans: usize,
    /// The best design that counts: within the violation tolerance, without overlapping walls, stable.
    pub best: Option<BestPoint>,
    /// Designs that count and that a sample of points may hand on, the best first; at most as many as its step keeps. Empty
    /// of an optimiser, which leads to one.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub kept: Vec<BestPoint>,
    /// The best design within the violation tolerance, overlapping walls and unstable branches included.
    pub best_with_overlap: Option<BestPoint>,
    /// Why it ended.
    pub stop: Option<RestartStop>,
    /// Hash of the history so far.
    pub history_sha256: String,
    /// How it competes with the other restarts of its step; `None` where they do not.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(super) racing: Option<Box<gate::Racing>>,
    /// Whether the present plan failed to follow a design since the last look at it.
    plan_failed: bool,
    /// Far trials since the last change of plan, each evaluated on its own.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    on_own_plan: Vec<Vec<f64>>,
    /// The run and the plan base before the change of plan that is being evaluated.
    before_replan: Option<Box<BeforeReplan>>,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
struct BeforeReplan {
    optimiser: OptimiserState,
    plan_base: Option<Vec<f64>>,
}

/// A design that is the best so far.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct BestPoint {
    /// Which evaluation of the restart, from 0.
    pub evaluation: usize,
    /// Design variables.
    pub x: Vec<f64>,
    /// Objective.
    pub objective: f64,
    /// Constraints.
    pub constraints: Vec<f64>,
    /// Largest violation.
    pub max_violation: f64,
    /// The design of its mesh plan.
    pub plan_base: Option<Vec<f64>>,
    /// Whether walls overlap.
    pub walls_overlap: bool,
    /// The sense in which its enclosed area counts.
    #[serde(default)]
    pub orientation: Option<Orientation>,
}

/// Why a restart ended.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum RestartStop {
    /// The optimiser ended it.
    Optimiser(StopReason),
    /// The study did.
    Study(StudyStop),
}

/// Why a study ends a restart.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "reason", rename_all = "snake_case")]
pub enum StudyStop {
    /// The next batch would exceed the restart's share of the evaluations.
    EvaluationBudget {
        /// Its share.
        evaluations: usize,
    },
    /// At the end of a rung of the race others were better.
    NotPromoted {
        /// The rung, from 0.
        rung: usize,
        /// How many earlier restarts were at least as good.
        rank: usize,
        /// Number of those compared, itself included.
        of: usize,
        /// How many of them go up.
        places: usize,
    },
    /// At a check others were better at equal cost.
    Dominated {
        /// By which rule.
        rule: DominationRule,
        /// Its evaluations.
        evaluations: usize,
        /// Its best so far.
        merit: Merit,
        /// What it may be expected to reach, by the rule.
        bound: Merit,
        /// What the earlier ones have reached.
        reference: Merit,
        /// Their number.
        of: usize,
    },
    /// Its design came near to that of an earlier restart, which goes on.
    Merged {
        /// Index of that restart.
        with: usize,
        /// Largest difference of a variable in shares of its range.
        distance: f64,
    },
}

/// What a step leads to.
#[derive(Clone, Debug, PartialEq)]
pub struct RestartStep {
    /// The restart after the step.
    pub state: RestartState,
    /// Evaluations wanted next, independent of each other; none when it has ended.
    pub asks: Vec<EvaluationRequest>,
    /// Why it has ended, if it has.
    pub done: Option<RestartStop>,
    /// The best design that counts, so far.
    pub best: Option<BestPoint>,
}

impl StudyStop {
    /// Whether it comes from the competition of restarts, so that [`resume`] brings the restart back.
    pub fn is_of_competition(&self) -> bool {
        !matches!(self, Self::EvaluationBudget { .. })
    }
}

/// Opens a restart.
pub fn begin(
    study: &Study,
    spec: &RestartSpec,
) -> Result<(RestartState, Vec<EvaluationRequest>), StudyError> {
    let study = &*study.given(spec.step, &spec.given);
    let step = study.step(spec.step)?;
    let problem = study.problem(spec.step)?;
    let mut options = step.optimiser.clone().seeded(spec.seed, spec.index);
    match &mut options {
        OptimiserOptions::Sweep(sweep) if !spec.points.is_empty() => {
            sweep.points.clone_from(&spec.points);
        }
        OptimiserOptions::RandomSearch(search) => {
            let share = step.evaluations_per_restart().unwrap_or(usize::MAX);
            search.evaluations = search.evaluations.min(share);
        }
        OptimiserOptions::Exchange(exchange) => {
            let limits = [exchange.max_evaluations, step.evaluations_per_restart()];
            exchange.max_evaluations = limits.into_iter().flatten().min();
        }
        _ => {}
    }
    let (optimiser, asks) =
        optimiser::start(options, problem, spec.x0.clone()).map_err(|source| {
            StudyError::Start {
                step: spec.step,
                source,
            }
        })?;
    let has_base = step.model.finite_elements().is_some() && step.optimiser.walks();
    let mut state = RestartState {
        spec: spec.clone(),
        // The optimiser moves the start into the bounds: its first ask is the design that counts.
        plan_base: asks.first().filter(|_| has_base).map(|ask| ask.x.clone()),
        optimiser,
        pending: Vec::new(),
        evaluations: 0,
        replans: 0,
        best: None,
        kept: Vec::new(),
        best_with_overlap: None,
        stop: None,
        history_sha256: empty_history(),
        racing: gate::Racing::open(step, spec),
        plan_failed: false,
        on_own_plan: Vec::new(),
        before_replan: None,
    };
    let asks = state.screened(study)?.unwrap_or(asks);
    state.pending = state.requests(study, asks)?;
    let asks = state.pending.clone();
    Ok((state, asks))
}

/// Goes on with the outcomes of the pending evaluations, in their order. A missing outcome counts as `lost`; a restart
/// that has ended stays as it is.
pub fn step(
    study: &Study,
    state: &RestartState,
    outcomes: &[Outcome],
) -> Result<RestartStep, StudyError> {
    let mut state = state.clone();
    let study = &*study.given(state.spec.step, &state.spec.given);
    if state.stop.is_none() {
        let out = state.pending.clone();
        let told = state.take(study, outcomes)?;
        match state.again_on_base(&out, outcomes) {
            Some(again) if state.affords(study, 1)? => state.pending = vec![again],
            _ => state.advance(study, &told)?,
        }
        state.note_end();
    }
    Ok(state.into_step())
}

impl RestartState {
    /// The designs that count and that may be handed on.
    pub fn candidates(&self) -> &[BestPoint] {
        match (&self.kept[..], &self.best) {
            ([], Some(best)) => std::slice::from_ref(best),
            (kept, _) => kept,
        }
    }

    /// What was asked of a point's evaluation, without its gradient, its kind and its iteration.
    pub fn request_again(&self, point: &BestPoint) -> EvaluationRequest {
        EvaluationRequest {
            step: self.spec.step,
            kind: AskKind::Initial,
            iteration: 0,
            x: point.x.clone(),
            want_gradient: false,
            plan_base: point.plan_base.clone(),
            orientation: self.spec.orientation,
            second_mesh: false,
            fidelity: None,
            given: self.spec.given.clone(),
        }
    }

    /// The optimiser's best point, whether or not it counts as a candidate.
    pub fn final_point(&self) -> Option<&Point> {
        self.optimiser.best()
    }

    fn into_step(self) -> RestartStep {
        RestartStep {
            asks: self.pending.clone(),
            done: self.stop,
            best: self.best.clone(),
            state: self,
        }
    }

    /// Books the outcomes: history, counts, best so far.
    fn take(&mut self, study: &Study, outcomes: &[Outcome]) -> Result<Vec<Told>, StudyError> {
        let problem = study.problem(self.spec.step)?;
        let step = study.step(self.spec.step)?;
        let tolerance = step.optimiser.violation_tolerance();
        let is_sample = step.optimiser.is_sample();
        let keeps = KEPT_PER_CANDIDATE * step.keeps;
        let lost = Outcome::without_values(OutcomeStatus::Lost);
        let pending = std::mem::take(&mut self.pending);
        let mut told = Vec::with_capacity(pending.len());
        for (i, request) in pending.into_iter().enumerate() {
            let outcome = study.checked(&request, outcomes.get(i).unwrap_or(&lost))?;
            self.history_sha256 = extend_history(
                &self.history_sha256,
                &HistoryEntry::new(self.spec.index, &request, &outcome),
            );
            told.push(outcome.told());
            self.note_plan(&request);
            self.plan_failed |= request.plan_base == self.plan_base
                && matches!(outcome.status, OutcomeStatus::InfeasibleGeometry { .. });
            let violation = problem.violation(&outcome.constraints);
            self.note_merit(step, &request, &outcome, violation);
            if let Some(objective) = outcome.objective
                && violation <= tolerance
                && request.fidelity.is_none()
            {
                let point = BestPoint {
                    evaluation: self.evaluations,
                    x: request.x,
                    objective,
                    max_violation: violation,
                    plan_base: request.plan_base,
                    walls_overlap: outcome.walls_overlap(),
                    orientation: request.orientation.or(outcome.sense()),
                    constraints: outcome.constraints.clone(),
                };
                if !point.walls_overlap && !outcome.is_unstable() {
                    if is_sample {
                        insert(&mut self.kept, &point, keeps);
                    }
                    keep_better(&mut self.best, &point);
                }
                keep_better(&mut self.best_with_overlap, &point);
            }
            self.evaluations += 1;
        }
        Ok(told)
    }

    fn advance(&mut self, study: &Study, told: &[Told]) -> Result<(), StudyError> {
        let replanned = self.before_replan.take();
        let failed = matches!(told, [Told::Failed]);
        let asks = match replanned {
            Some(before) if failed => {
                self.optimiser = before.optimiser;
                self.plan_base = before.plan_base;
                self.plan_failed = false;
                self.optimiser.asks()
            }
            was_replanned => {
                let next = self.tell_optimiser(told);
                self.optimiser = next.state;
                self.follow_iterate();
                if self.comes_to_gate(study)? {
                    return Ok(());
                }
                self.stop = next.done.map(RestartStop::Optimiser);
                if self.stop.is_some() {
                    next.asks
                } else if let Some(drawn) = self.screened(study)? {
                    drawn
                } else if was_replanned.is_none() {
                    self.replan(study)?.unwrap_or(next.asks)
                } else {
                    next.asks
                }
            }
        };
        if self.stop.is_some() {
            return Ok(());
        }
        self.ask(study, asks)
    }

    /// Goes on with what the optimiser asks, within the restart's share of the budget.
    fn ask(&mut self, study: &Study, asks: Vec<Ask>) -> Result<(), StudyError> {
        if self.affords(study, asks.len())? {
            self.pending = self.requests(study, asks)?;
        }
        Ok(())
    }

    /// Whether so many more evaluations are within the restart's share of the budget; it ends where they are not.
    fn affords(&mut self, study: &Study, more: usize) -> Result<bool, StudyError> {
        let share = study.step(self.spec.step)?.evaluations_per_restart();
        let beyond = share.filter(|share| self.evaluations + more > *share);
        if let Some(evaluations) = beyond {
            let stop = StudyStop::EvaluationBudget { evaluations };
            self.stop = Some(RestartStop::Study(stop));
        }
        Ok(beyond.is_none())
    }

    /// Lets an optimiser that draws its points draw others for those that their geometry refuses, so that no analysis is
    /// spent on them; `None` for one that walks to its points.
    fn screened(&mut self, study: &Study) -> Result<Option<Vec<Ask>>, StudyError> {
        let step = self.spec.step;
        let options = &study.step(step)?.optimiser;
        if options.walks() {
            return Ok(None);
        }
        let tolerance = options.violation_tolerance();
        let mut error = None;
        let next = optimiser::screen(&self.optimiser, |x| match study.refusal(step, x) {
            Ok(refusal) => (refusal > tolerance).then_some(refusal),
            Err(source) => {
                error.get_or_insert(source);
                None
            }
        });
        if let Some(error) = error {
            return Err(error);
        }
        self.optimiser = next.state;
        Ok(Some(next.asks))
    }

    fn requests(
        &self,
        study: &Study,
        asks: Vec<Ask>,
    ) -> Result<Vec<EvaluationRequest>, StudyError> {
        let model = &study.step(self.spec.step)?.model;
        let meshed = model.finite_elements().is_some();
        let fidelity = self.fidelity(study)?;
        let request = |ask: Ask| {
            let plan_base = meshed.then(|| self.plan_for(study, &ask)).transpose()?;
            Ok(EvaluationRequest {
                step: self.spec.step,
                kind: ask.kind,
                iteration: ask.iteration,
                plan_base,
                x: ask.x,
                want_gradient: ask.want_gradient,
                orientation: self.spec.orientation,
                second_mesh: false,
                fidelity,
                given: self.spec.given.clone(),
            })
        };
        asks.into_iter().map(request).collect()
    }
}

impl RestartStop {
    /// The reason's name, as it is serialised.
    pub fn name(&self) -> String {
        let value = serde_json::to_value(self).unwrap_or_default();
        value
            .get("reason")
            .and_then(serde_json::Value::as_str)
            .unwrap_or_default()
            .to_string()
    }
}

/// Inserts a point into a list by its objective, which keeps its `most` best; the earlier one first among equals.
fn insert(kept: &mut Vec<BestPoint>, point: &BestPoint, most: usize) {
    let place = kept.partition_point(|other| other.objective <= point.objective);
    if place < most {
        kept.insert(place, point.clone());
        kept.truncate(most);
    }
}

fn keep_better(best: &mut Option<BestPoint>, point: &BestPoint) {
    if best
        .as_ref()
        .is_none_or(|best| point.objective < best.objective)
    {
        *best = Some(point.clone());
    }
}
