//! A study with fewer states on each leg: what a rung of a race evaluates.

use std::borrow::Cow;

use super::spec::{StepConstraints, Study, StudyBody, Target};
use crate::scene::measure::Measure;

/// Whether the measures of a step mean the same on a path with fewer states on each leg: none is of a state within a leg.
pub(super) fn allows_fewer_states(
    body: &StudyBody,
    target: Option<&Target>,
    constraints: &StepConstraints,
) -> bool {
    let (legs, own) = (body.actuation.legs(), body.actuation.load_steps_per_leg);
    let bounds = match constraints {
        StepConstraints::Chambers(constraints) => &constraints.bounds[..],
        StepConstraints::Counts { .. } => &[],
    };
    let target = target.map(|t| &t.goal.measure).into_iter();
    let bounds = bounds.iter().map(|bound| &bound.measure);
    target
        .chain(bounds)
        .all(|measure: &Measure<_>| measure.with_load_steps(legs, own, 1).is_some())
}

impl Study {
    /// The study with at most so many states on each leg, for an evaluation of one of its steps. Measures that are of a state
    /// within a leg, which the reader of documents does not let pass, stay as they are.
    pub fn with_load_steps(&self, step: usize, most: usize) -> Cow<'_, Self> {
        let Some(body) = &self.body else {
            return Cow::Borrowed(self);
        };
        let (legs, own) = (body.actuation.legs(), body.actuation.load_steps_per_leg);
        if most >= own {
            return Cow::Borrowed(self);
        }
        let mut study = self.clone();
        if let Some(body) = &mut study.body {
            body.actuation.load_steps_per_leg = most;
        }
        if let Some(step) = study.steps.get_mut(step) {
            let target = step.target.iter_mut().map(|t| &mut t.goal.measure);
            let bounds = match &mut step.constraints {
                StepConstraints::Chambers(constraints) => &mut constraints.bounds[..],
                StepConstraints::Counts { .. } => &mut [],
            };
            for measure in target.chain(bounds.iter_mut().map(|b| &mut b.measure)) {
                if let Some(fewer) = measure.with_load_steps(legs, own, most) {
                    *measure = fewer;
                }
            }
        }
        Cow::Owned(study)
    }
}
