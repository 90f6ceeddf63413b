//! What a restart will probably ask next, for workers that nothing else needs.

use super::RestartState;
use crate::optimiser::{self, AskKind};
use crate::study::error::StudyError;
use crate::study::result::EvaluationRequest;
use crate::study::spec::Study;

/// The requests that may follow those that are out, as exact as if they were asked for; none where the study does not
/// speculate, and none that the restart's share of the budget would refuse. A pure function: nothing but known results comes
/// of it.
pub fn speculate(
    study: &Study,
    state: &RestartState,
) -> Result<Vec<EvaluationRequest>, StudyError> {
    let [out] = &state.pending[..] else {
        return Ok(Vec::new());
    };
    if !study.speculate || state.stop.is_some() {
        return Ok(Vec::new());
    }
    let study = &*study.given(state.spec.step, &state.spec.given);
    let share = study.step(state.spec.step)?.evaluations_per_restart();
    let left = share.map_or(usize::MAX, |share| {
        share.saturating_sub(state.evaluations + 1)
    });
    let asks = optimiser::speculate(&state.optimiser);
    let (differences, others): (Vec<_>, Vec<_>) = asks
        .into_iter()
        .partition(|ask| ask.kind == AskKind::Gradient);
    let there = state.if_iterate(out);
    let mut guesses = if differences.len() <= left && there.keeps_plan_at(study, &out.x) {
        there.requests(study, differences)?
    } else {
        Vec::new()
    };
    if left > 0 {
        guesses.extend(state.requests(study, others)?);
    }
    Ok(guesses)
}

impl RestartState {
    /// The restart as far as its mesh plan goes if what is out became the iterate.
    fn if_iterate(&self, out: &EvaluationRequest) -> Self {
        let mut there = self.clone();
        if there.plan_base.is_some() && out.plan_base.as_ref() == Some(&out.x) {
            there.plan_base.clone_from(&out.plan_base);
            there.plan_failed = false;
        }
        there
    }

    /// Whether the mesh plan would stay if a design became the iterate. One without a plan of its own becomes none.
    fn keeps_plan_at(&self, study: &Study, x: &[f64]) -> bool {
        match &self.plan_base {
            Some(base) if self.plan_failed => base == x,
            Some(base) if self.before_replan.is_none() => {
                let serves = study.plan_serves(self.spec.step, base, x);
                serves.unwrap_or(false)
            }
            _ => true,
        }
    }
}
