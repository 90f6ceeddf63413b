//! Which steps can begin, and which never will.

use super::candidate::StepResult;
use super::inputs::inputs;
use crate::study::takes::StepInputs;
use crate::study::{Study, StudyError};

/// How far a step is.
#[derive(Clone, Debug, PartialEq)]
pub enum Progress {
    /// It has not begun.
    Waiting,
    /// Its restarts are under way.
    Running,
    /// It has ended.
    Done(StepResult),
    /// It will never begin.
    Blocked,
}

/// What is to be done with a waiting step.
#[derive(Clone, Debug, PartialEq)]
pub enum Due {
    /// All that it takes is there.
    Begin {
        /// Index of the step.
        step: usize,
        /// What it takes.
        inputs: StepInputs,
    },
    /// What it takes will never be there.
    Block {
        /// Index of the step.
        step: usize,
        /// Why.
        reason: String,
    },
}

/// What is due, in the document's order. `progress` has one entry per step.
///
/// # Errors
/// Where a candidate does not fit the step that it came from, which only happens to results of another document.
pub fn due(study: &Study, progress: &[Progress]) -> Result<Vec<Due>, StudyError> {
    let mut all = Vec::new();
    for (step, waits) in progress.iter().enumerate() {
        if *waits != Progress::Waiting {
            continue;
        }
        let takes = &study.step(step)?.takes;
        let sources: Option<Vec<&Progress>> = takes
            .iter()
            .map(|take| progress.get(study.index_of(&take.step)?))
            .collect();
        let Some(sources) = sources else { continue };
        let given_up = takes.iter().zip(&sources).find_map(|(take, source)| {
            let id = &study.steps[step].id;
            match source {
                Progress::Blocked => Some(format!(
                    "step \"{id}\" did not begin: step \"{}\", from which it takes, did not begin either",
                    take.step
                )),
                Progress::Done(result) if result.candidates.is_empty() => Some(format!(
                    "step \"{id}\" did not begin: step \"{}\" found nothing feasible to hand on",
                    take.step
                )),
                _ => None,
            }
        });
        if let Some(reason) = given_up {
            all.push(Due::Block { step, reason });
            continue;
        }
        let results: Option<Vec<&StepResult>> = sources
            .iter()
            .map(|source| match source {
                Progress::Done(result) => Some(result),
                _ => None,
            })
            .collect();
        if let Some(results) = results {
            all.push(match inputs(study, step, &results)? {
                Ok(inputs) => Due::Begin { step, inputs },
                Err(reason) => Due::Block { step, reason },
            });
        }
    }
    Ok(all)
}
