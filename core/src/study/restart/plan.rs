//! From which design the element counts of an evaluation come, and when that changes.

use super::{BeforeReplan, RestartState};
use crate::optimiser::{self, Ask, AskKind, Step, Told};
use crate::study::error::StudyError;
use crate::study::result::{EvaluationRequest, Outcome, OutcomeStatus};
use crate::study::spec::Study;

impl RestartState {
    /// The plan of what the optimiser asks: the base, or for a trial so far from the iterate that its acceptance would change
    /// the base the trial itself, so that it need not be evaluated again.
    pub(super) fn plan_for(&self, study: &Study, ask: &Ask) -> Result<Vec<f64>, StudyError> {
        let Some(base) = &self.plan_base else {
            return Ok(ask.x.clone());
        };
        let is_trial = matches!(ask.kind, AskKind::Trial | AskKind::Return);
        let iterate = self.optimiser.iterate().filter(|_| is_trial);
        let own = match iterate {
            Some(iterate) => {
                study.is_far(self.spec.step, &iterate.x, &ask.x)?
                    && !study.plan_serves(self.spec.step, base, &ask.x)?
            }
            None => false,
        };
        Ok(if own { &ask.x } else { base }.clone())
    }

    /// Notes an evaluation that had its own plan where the iterate has the base.
    pub(super) fn note_plan(&mut self, request: &EvaluationRequest) {
        if self.plan_base.is_some()
            && request.plan_base != self.plan_base
            && request.plan_base.as_ref() == Some(&request.x)
        {
            self.on_own_plan.push(request.x.clone());
        }
    }

    /// The same trial on the base, where its own plan does not mesh it: that of a slanted design may fold on elements which
    /// another design's counts keep apart.
    pub(super) fn again_on_base(
        &mut self,
        out: &[EvaluationRequest],
        outcomes: &[Outcome],
    ) -> Option<EvaluationRequest> {
        let ([request], [outcome]) = (out, outcomes) else {
            return None;
        };
        let folded = matches!(outcome.status, OutcomeStatus::InfeasibleGeometry { .. })
            && self.on_own_plan.last() == Some(&request.x)
            && request.plan_base != self.plan_base;
        folded.then(|| {
            self.on_own_plan.pop();
            EvaluationRequest {
                plan_base: self.plan_base.clone(),
                ..request.clone()
            }
        })
    }

    /// Tells the optimiser the answers to what is out, and, where they lead it to a point of another mesh, that it is one.
    pub(super) fn tell_optimiser(&self, told: &[Told]) -> Step {
        let next = optimiser::step(&self.optimiser, told);
        let iterate = next.state.iterate();
        if iterate.is_some_and(|point| self.on_own_plan.contains(&point.x)) {
            optimiser::step_on_another_mesh(&self.optimiser, told)
        } else {
            next
        }
    }

    /// Where a trial with its own plan has become the iterate, its plan is the base.
    pub(super) fn follow_iterate(&mut self) {
        if self.on_own_plan.is_empty() {
            return;
        }
        let iterate = self.optimiser.iterate().map(|point| &point.x);
        if let Some(x) = iterate.filter(|x| self.on_own_plan.contains(x)) {
            self.plan_base = Some(x.clone());
            self.plan_failed = false;
            self.replans += 1;
            self.on_own_plan.clear();
        } else if self.optimiser.at_iteration_boundary() {
            self.on_own_plan.clear();
        }
    }

    /// Between two iterations: makes the iterate the plan's base if the present plan no longer serves.
    pub(super) fn replan(&mut self, study: &Study) -> Result<Option<Vec<Ask>>, StudyError> {
        if !self.optimiser.at_iteration_boundary() {
            return Ok(None);
        }
        let failed = std::mem::take(&mut self.plan_failed);
        let (Some(base), Some(iterate)) = (&self.plan_base, self.optimiser.iterate()) else {
            return Ok(None);
        };
        let serves = if failed {
            *base == iterate.x
        } else {
            study.plan_serves(self.spec.step, base, &iterate.x)?
        };
        if serves {
            return Ok(None);
        }
        let iterate = iterate.x.clone();
        let rebased = optimiser::rebase(&self.optimiser);
        let before = BeforeReplan {
            optimiser: std::mem::replace(&mut self.optimiser, rebased.state),
            plan_base: self.plan_base.replace(iterate),
        };
        self.before_replan = Some(Box::new(before));
        self.on_own_plan.clear();
        self.replans += 1;
        Ok(Some(rebased.asks))
    }
}
