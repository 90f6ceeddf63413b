//! The race as a whole, for people: who went up, and whether the orders of the fidelities agree.

use serde::{Deserialize, Serialize};

use super::decide::Correlation;
use super::merit::spearman;
use super::options::Competition;
use super::record::{Gate, Mark, RaceRecord};
use crate::study::restart::StudyStop;

/// The competition of a step so far.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct RaceSummary {
    /// Its rungs.
    pub rungs: Vec<RungSummary>,
    /// The checks at the study's own fidelity.
    pub checks: CheckSummary,
    /// Restarts that somebody brought back after they were stopped.
    pub resumed: Vec<usize>,
}

/// A rung.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct RungSummary {
    /// Restarts that came to its end.
    pub reached: usize,
    /// Those that went up.
    pub promoted: Vec<usize>,
    /// Those that merged with another one here.
    pub merged: usize,
    /// Agreement of its order with that of the next fidelity, over all that went up.
    pub correlation: Option<Correlation>,
    /// First restart for which the race was off.
    pub off_from: Option<usize>,
}

/// The checks.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct CheckSummary {
    /// Decisions taken.
    pub decided: usize,
    /// Restarts that were dominated.
    pub dominated: Vec<usize>,
    /// Restarts that merged with another one.
    pub merged: Vec<usize>,
}

impl RaceSummary {
    /// Of the records of a step's restarts, in their order; `None` where they do not compete.
    pub fn of(competition: &Competition, records: &[RaceRecord]) -> Option<Self> {
        if competition.is_none() {
            return None;
        }
        let rungs = (0..competition.rungs()).map(|rung| rung_summary(rung, records));
        let mut summary = Self {
            rungs: rungs.collect(),
            ..Self::default()
        };
        for (index, record) in records.iter().enumerate() {
            if record.resumed {
                summary.resumed.push(index);
            }
            for mark in record
                .marks
                .iter()
                .filter(|m| m.gate > Gate::Rung(usize::MAX))
            {
                let Some(decision) = &mark.decision else {
                    continue;
                };
                summary.checks.decided += 1;
                match decision.stop {
                    Some(StudyStop::Dominated { .. }) => summary.checks.dominated.push(index),
                    Some(StudyStop::Merged { .. }) => summary.checks.merged.push(index),
                    _ => {}
                }
            }
        }
        Some(summary)
    }
}

fn rung_summary(rung: usize, records: &[RaceRecord]) -> RungSummary {
    let marks: Vec<(usize, &Mark)> = records
        .iter()
        .enumerate()
        .filter_map(|(index, record)| Some((index, record.at(Gate::Rung(rung))?)))
        .collect();
    let decided = || {
        marks
            .iter()
            .filter_map(|(i, m)| Some((*i, m.decision.as_ref()?)))
    };
    let pairs: Vec<_> = marks
        .iter()
        .filter_map(|(_, m)| Some((m.merit, m.next?)))
        .collect();
    RungSummary {
        reached: marks.len(),
        promoted: decided()
            .filter(|(_, d)| d.stop.is_none())
            .map(|(index, _)| index)
            .collect(),
        merged: decided()
            .filter(|(_, d)| matches!(d.stop, Some(StudyStop::Merged { .. })))
            .count(),
        correlation: (pairs.len() > 1).then(|| Correlation {
            pairs: pairs.len(),
            spearman: spearman(&pairs),
        }),
        off_from: decided().find(|(_, d)| d.race_off).map(|(index, _)| index),
    }
}
